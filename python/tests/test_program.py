"""Commands beside fits give the same JSON and files as the program, its refusals are errors, and the wheel has its command."""

import json
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import tongue_fit as tf

ROOT = Path(__file__).resolve().parents[2]


def run_program(program: str, out: Path, *words: str) -> tuple[dict[str, Any], dict[str, bytes]]:
    done = subprocess.run([program, *words, "--json", "--out", str(out)], capture_output=True, check=False)
    assert done.returncode in (0, 3), done.stderr.decode()
    return json.loads(done.stdout), {path.name: path.read_bytes() for path in out.iterdir()}


def timeless(record: Any) -> Any:
    """A record without the times of the run and the command that made it."""
    if isinstance(record, dict):
        return {k: timeless(v) for k, v in record.items() if k not in ("wall_s", "command", "time_by_effect", "file", "files")}
    return [timeless(v) for v in record] if isinstance(record, list) else record


def test_scenes_sounds_and_checks_are_those_of_the_program(program: str, tmp_path: Path) -> None:
    scene = tf.scene("supine")
    record, files = run_program(program, tmp_path / "scene", "scene", "run", "supine")
    assert timeless(scene) == timeless(record) and set(scene.files) == set(files)
    sound = tf.sound(tension={"GGa": 12.0, "SGm": 3}, hyoid=[1, -1], lip_opening=9)
    words = ("sound", "--tension", "GGa=12", "--tension", "SGm=3", "--hyoid", "1,-1", "--lip-opening", "9")
    record, files = run_program(program, tmp_path / "sound", *words)
    assert timeless(sound) == timeless(record)
    # A WAV file has the command that made it before its samples.
    here, there = (wav.split(b"data", 1)[1] for wav in (sound.files["sound.wav"], files["sound.wav"]))
    assert here == there and len(here) > 44_000
    table = pd.DataFrame({"subject": "X", "vowel": ["ɯ", "a"], "GGa_mm": [46, 38], "SGm_mm": pd.array([25, None], dtype="Int64")})
    assert len(tf.check(table)["subjects"]) == 1


def test_recordings_bodies_and_validations_are_those_of_the_program(program: str, tmp_path: Path) -> None:
    coils = pd.DataFrame({"recording": "n", "time_s": 0.0, "point": ["T1", "T2", "T3"], "x_mm": [-5.6, 9.4, 28.2], "y_mm": [37.5, 46.0, 50.6]})
    points = {"T1": {"surface_mm": 9.0}, "T2": {"surface_mm": 26.0}, "T3": {"surface_mm": 47.0}}
    roles = {"back": "x", "up": "y", "noise_mm": 0.5, "points": points}
    track = tf.track(coils, map=roles, as_is=True, frames=0)
    coils.to_csv(tmp_path / "coils.csv", index=False)
    (tmp_path / "map.toml").write_text(tf.program.toml_text(roles), encoding="utf-8")
    words = ("track", str(tmp_path / "coils.csv"), "--map", str(tmp_path / "map.toml"), "--as-is", "--frames", "0")
    record, files = run_program(program, tmp_path / "track", *words)
    assert track["courses"] == record["courses"] and set(track.files) == set(files)
    assert list(track.frame("track.csv").tension_n_per_m) == list(pd.read_csv(tmp_path / "track/track.csv").tension_n_per_m)
    # The body of a speaker can be an argument of functions that take a body.
    adapted = tf.adapt(example=True)
    record, _ = run_program(program, tmp_path / "adapt", "adapt", "--example")
    assert timeless(adapted) == timeless(record)
    body = json.loads(adapted.files["body.json"])
    adapted.save(tmp_path / "speaker")
    assert tf.Body.read(tmp_path / "speaker/body.json").nodes.tolist() == body["nodes_m"]
    assert tf.track(example=True, mesh=adapted.files["body.json"], frames=0).is_trustworthy
    # One vowel of two subjects, because all of them take minutes.
    lines = (ROOT / "targets/takano2007_lengths.csv").read_text(encoding="utf-8").splitlines()
    few = [line for line in lines if line.startswith(("subject", "S1,ɯ", "S1,a", "S2,ɯ", "S2,a"))]
    (tmp_path / "few.csv").write_text("\n".join(few) + "\n", encoding="utf-8")
    validated = tf.validate(lengths=tmp_path / "few.csv", permutations=1)
    asked = ("validate", "--lengths", str(tmp_path / "few.csv"), "--permutations", "1")
    record, files = run_program(program, tmp_path / "validate", *asked)
    assert timeless(validated) == timeless(record) and set(validated.files) == set(files)


def test_a_scene_may_be_a_dict_and_a_table_a_frame() -> None:
    keys = {"title": "t", "want": "shape", "body": {"tongue": {"h_mm": 8.0}}, "effects": {"incompressibility": True, "gravity": {"posture": "supine"}}}
    scene = tf.scene(keys)
    # The verdict of S2 /i/ can be trusted, but not the tensions of its fit.
    fit = tf.run(vowel="i")
    assert fit["conclusion"]["trusted"] and not fit["conclusion"]["tensions_trusted"] and not fit.is_trustworthy
    assert scene["converged"] and scene.is_trustworthy and np.array(scene["positions_m"]).shape[1] == 2
    table = pd.DataFrame({"subject": "X", "vowel": ["ɯ", "a"], "GGa_mm": [46, 38], "SGm_mm": [25, 21], "HGa_mm": [36, 33]})
    by_program = tf.run(vowel="a", subject="X", lengths=tf.dataset(table), target="stretch", method="gauss-newton")
    here = tf.fit(tf.dataset(table), "X", "a", target="stretch", method="gauss-newton", verdict=False)
    assert by_program["tensions_n"] == here["tensions_n"]
    assert list(by_program.frame("fit.csv").muscle) == list(here["tensions_n"])
    # A cell that is no length is left out and told, and the rest is fitted.
    broken = table.to_csv(index=False).replace("36", "x").encode()
    assert tf.run(vowel="a", subject="X", lengths=broken, target="stretch")["not_measured"][0] == "HGa"
    assert pickle.loads(pickle.dumps(scene)) == scene and "supine" not in repr(scene) and (scene._repr_svg_() or "").startswith("<")


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda: tf.sound(vowel="q"), "/q/"),
        (lambda: tf.sound(tension={"GGa": -3}), "-3"),
        (lambda: tf.sound(vowel=object()), "vowel must be"),  # type: ignore[arg-type]
        (lambda: tf.scene({"title": 1}), "wrong kind of value"),
        (lambda: tf.scene({"title": {"x": float("nan")}}), "title.x"),
        (lambda: tf.scene("nothing.toml"), "nothing.toml"),
        (lambda: tf.track("nothing.csv"), "nothing.csv"),
        (lambda: tf.adapt(b"nonsense"), "recordings"),
        (lambda: tf.check("-"), "no standard input"),
        (lambda: tf.scene("supine").frame("x.csv"), "x.csv"),
    ],
)
def test_what_the_program_refuses_is_an_error_with_its_text(ask: Any, said: str) -> None:
    with pytest.raises(tf.Error, match=said.replace("/", "\\/")) as refused:
        ask()
    assert not str(refused.value).startswith("error:")


def test_the_command_is_in_the_wheel() -> None:
    command = Path(sys.executable).parent / "tongue-fit"
    told = subprocess.run([command, "--version"], capture_output=True, text=True, check=True).stdout
    assert tf.VERSION in told
    wrong = subprocess.run([command, "--nothing"], capture_output=True, text=True, check=False)
    assert wrong.returncode == 2 and "--nothing" in wrong.stderr
    module = subprocess.run([sys.executable, "-m", "tongue_fit", "scene", "list"], capture_output=True, text=True, check=True)
    assert "supine" in module.stdout


def test_commands_run_in_this_process_side_by_side(monkeypatch: pytest.MonkeyPatch) -> None:
    def heard(tension: float) -> Any:
        found = tf.sound(tension={"GGa": tension}, threads=1)
        return found["formants_hz"], found["area_function"], found.files["sound.csv"].split(b"\n", 1)[1]

    expected = [heard(tension) for tension in (5.0, 10.0, 15.0)]
    monkeypatch.setattr(subprocess, "Popen", lambda *_, **__: pytest.fail("a process was started"))
    with ThreadPoolExecutor(3) as pool:
        assert list(pool.map(heard, (5.0, 10.0, 15.0))) == expected
    assert tf.scene("supine").is_trustworthy and tf.check(b"subject,vowel,GGa_mm\nX,a,50\n")


def threads() -> int:
    return len(os.listdir("/proc/self/task"))


def test_ctrl_c_ends_a_command_and_its_threads() -> None:
    """The call returns immediately, and the computing threads end at their next report of progress."""
    sent: list[float] = []

    def interrupt() -> None:
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    before = threads()
    threading.Timer(0.7, interrupt).start()
    with pytest.raises(KeyboardInterrupt):
        tf.run("batch", target="stretch", h=2, threads=2)
    assert time.monotonic() - sent[0] < 0.2
    while threads() > before:
        assert time.monotonic() - sent[0] < 60, "the threads go on"
        time.sleep(0.05)


def test_a_posterior_is_that_of_the_program_and_goes_to_arviz(program: str, tmp_path: Path) -> None:
    # The mesh is coarse, which takes a fifth of the time.
    priors = {"tension": {"fixed_n_per_m": {"hgp": 3.0}}, "baseline": {"fixed_n_per_m": {"*": 8.0, "GGa": 2.0}}}
    found = tf.posterior(tf.Dataset.reference(), "S2", "a", target="stretch", draws=400, h=10, priors=priors)
    (tmp_path / "priors.toml").write_text('[tension.fixed_n_per_m]\nhgp = 3.0\n[baseline.fixed_n_per_m]\n"*" = 8.0\nGGa = 2.0\n')
    words = ["--vowel", "a", "--subject", "S2", "--target", "stretch", "--method", "gauss-newton", "--posterior", "400", "--h", "10", "--priors", str(tmp_path / "priors.toml")]
    record, files = run_program(program, tmp_path / "out", *words)
    assert timeless(found) == timeless(record)
    table = pd.read_csv(tmp_path / "out" / "posterior.csv")
    draws = found.draws
    chains = table.chain.nunique()
    assert draws["tension_n_per_m"].shape == (chains, 400 // chains, len(found.muscles)) and draws["hyoid_mm"].shape[2] == 2
    assert set(draws) == {"tension_n_per_m", "baseline_tension_n_per_m", "change_n_per_m", "hyoid_mm", "stretch"}
    one = table[(table.chain == table.chain.unique()[1])].sort_values("draw").tension_SGm_n_per_m.to_numpy()
    assert np.array_equal(draws["tension_n_per_m"][1, :, found.muscles.index("SGm")], one)
    assert np.allclose(draws["change_n_per_m"], draws["tension_n_per_m"] - draws["baseline_tension_n_per_m"])
    groups = found.to_dict()
    # The priors are half-normal: their mean is sqrt(2 / pi) times the scale. Fixed tensions are the same in prior and posterior.
    scale = found["posterior"]["priors"]["tension"]["scale_n_per_m"]
    assert abs(groups["prior"]["tension_n_per_m"][0, :, 0].mean() / (scale * np.sqrt(2 / np.pi)) - 1) < 0.15
    at = found.muscles.index("HGp")
    assert (groups["prior"]["tension_n_per_m"][..., at] == 3.0).all() and (draws["tension_n_per_m"][..., at] == 3.0).all()
    baseline = [2.0 if muscle == "GGa" else 8.0 for muscle in found.muscles]
    for group in ("prior", "posterior"):
        assert (groups[group]["baseline_tension_n_per_m"] == baseline).all(), group
    assert groups["sample_stats"]["lp"].shape == (chains, 400 // chains)
    assert pickle.loads(pickle.dumps(found)) == found and found.status == "not_mixed"
    with pytest.warns(UserWarning, match="have not mixed"):
        found.draws  # noqa: B018
    pytest.importorskip("arviz")
    with pytest.warns(UserWarning) as told:
        tree = found.to_arviz()
    assert len([one for one in told if "have not mixed" in str(one.message)]) == 1
    assert list(tree["posterior"]["tension_n_per_m"].coords["muscle"].values) == found.muscles
    assert float(tree["observed_data"]["measured_stretch"].sel(measured="SGm")) == found["target_stretches"]["SGm"]


def test_the_likelihood_and_the_diagnostics_are_those_of_arviz() -> None:
    arviz = pytest.importorskip("arviz")
    # One muscle of the body was not measured, but it is sampled.
    rows = "X,ɯ,46,56,46,56,25,40,36\nX,a,38,57,50,54,21,47,33\n"
    table = tf.Dataset.from_text(f"subject,vowel,GGa_mm,GGm_mm,GGp_mm,SGp_mm,SGm_mm,SGa_mm,HGa_mm\n{rows}")
    found = tf.posterior(table, "X", "a", draws=1000, h=10)
    assert "HGp" in found.muscles and "HGp" not in found.measured and len(found.measured) == 7
    tree = found.to_arviz()
    # The definition: the normal density of a stretch given the others, from the joint density.
    likelihood, draws = found.to_dict()["log_likelihood"]["measured_stretch"], found.draws["stretch"]
    assert likelihood.shape == (*draws.shape[:2], 7)
    at = [found.muscles.index(muscle) for muscle in found.measured]
    residuals = np.array([found["target_stretches"][muscle] for muscle in found.measured]) - draws[..., at]
    # Given the others a residual is normal with the precision Q_ii: ln(Q_ii / 2 pi) / 2 less the square of a linear form of all residuals.
    pairs = [(i, j) for i in range(7) for j in range(i, 7)]
    products = np.stack([residuals[..., i].ravel() * residuals[..., j].ravel() for i, j in pairs] + [np.ones(residuals[..., 0].size)], axis=1)
    for muscle in range(7):
        values = likelihood[..., muscle].ravel()
        solution, _, _, _ = np.linalg.lstsq(products, values, rcond=None)
        assert np.abs(products @ solution - values).max() < 1e-6
        precision = -2.0 * solution[pairs.index((muscle, muscle))]
        assert abs(solution[-1] - 0.5 * np.log(precision / (2.0 * np.pi))) < 1e-5
    loo = arviz.loo(tree, pointwise=True)
    assert np.isfinite(float(loo.elpd_loo)) and loo.loo_i.shape == (7,)
    # ArviZ, which estimates autocorrelations slightly differently, agrees with the program about the chains.
    told = found["posterior"]
    data = arviz.convert_to_dataset(tree["posterior"])[["tension_n_per_m", "baseline_tension_n_per_m", "change_n_per_m", "hyoid_mm"]]
    worst = max(float(value.max()) for value in arviz.rhat(data).values())
    fewest = min(float(value.min()) for kind in ("bulk", "tail") for value in arviz.ess(data, method=kind).values())
    assert 1.0 < worst <= told["r_hat"] + 1e-3
    assert fewest >= 0.95 * min(told["ess"]["bulk"], told["ess"]["tail"])

"""The answers of the module are those of the program, bit by bit."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import plain

import tongue_fit as tf

Asked = Callable[..., dict[str, Any]]
TENSIONS = {"GGa": 12.0, "SGm": 11.5, "HGa": 4.5}
#: A mesh on which a fit with its verdict takes a third of the time.
COARSE = ["--h", "8mm"]
OPTIONS = [word for name, n in TENSIONS.items() for word in ("--tension", f"{name}={n}")]


@pytest.mark.parametrize(
    ("words", "body", "model"),
    [
        ([], tf.Body.tongue, {}),
        (["--poisson-ratio", "0.45"], tf.Body.tongue, {"poisson_ratio": 0.45}),
        (["--body", "continuum", "--h", "8mm"], lambda: tf.Body.continuum(8e-3), {}),
    ],
)
def test_an_equilibrium(asked: Asked, words: list[str], body: Callable[[], tf.Body], model: dict[str, Any]) -> None:
    solver = tf.Model(**model).assemble(body(), list(TENSIONS)).solver()
    assert plain(solver.follow_from_rest(TENSIONS).record()) == asked("simulate", *OPTIONS, *words)
    direct = solver.equilibrium(list(TENSIONS.values()))
    assert plain(direct.record()) == asked("simulate", *OPTIONS, *words, "--direct")
    assert direct.record()["positions_m"] == direct.positions.tolist()


def test_an_equilibrium_that_is_not_to_be_believed_says_so(asked: Asked) -> None:
    solver = tf.Model().assemble(tf.Body.tongue(), ["GGa"]).solver()
    record = plain(solver.follow_from_rest({"GGa": 1000.0}).record())
    assert record == asked("simulate", "--tension", "GGa=1000")
    kinds = ["barrier_acts", "not_on_branch", "overstrained", "muscle_overstrained"]
    assert [alarm["kind"] for alarm in record["alarms"]] == kinds


@pytest.mark.parametrize(
    ("words", "given"),
    [
        (["--vowel", "a"], {"method": "nelder-mead"}),
        (["--vowel", "a", "--target", "stretch", *COARSE], {"target": "stretch", "method": "nelder-mead", "body": tf.Body.tongue(8e-3)}),
        (["--vowel", "i", "--method", "gauss-newton", *COARSE], {"body": tf.Body.tongue(8e-3)}),
        (
            ["--vowel", "a", "--muscles", "GGa,SGm,HGa,SGp", *COARSE],
            {"muscles": ["GGa", "SGm", "HGa", "SGp"], "method": "nelder-mead", "body": tf.Body.tongue(8e-3)},
        ),
    ],
)
def test_a_fit(asked: Asked, words: list[str], given: dict[str, Any]) -> None:
    assert plain(tf.fit(tf.Dataset.reference(), "S2", words[1], **given)) == asked(*words)


def test_all_rows(asked: Asked, tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    found = tf.batch(
        tf.Dataset.reference(),
        subjects=["S2", "S4"],
        vowels=["a", "e"],
        target="both",
        progress=lambda done, of: seen.append((done, of)),
    )
    words = ("batch", "--subjects", "S2,S4", "--vowels", "a,e")
    of_program = asked(*words, "--out", str(tmp_path / "out"))
    assert [plain(fit) for fit in found.fits] == [plain(fit) for fit in of_program["fits"]]
    assert found.not_fitted == []
    assert seen == [(n, len(found)) for n in range(1, len(found) + 1)]
    one = tf.batch(tf.Dataset.reference(), subjects=["S2", "S4"], vowels=["a", "e"], target="both", threads=1, progress=False)
    assert one.to_json() == found.to_json()
    # The tidy table without its provenance.
    pd = pytest.importorskip("pandas")
    theirs = pd.read_csv(tmp_path / "out/muscles.csv", keep_default_na=False, na_values=[""])
    who = ["version", "command", "inputs_sha256"]
    pd.testing.assert_frame_equal(found.frame().drop(columns=who), theirs.drop(columns=who), check_exact=True)


def test_shards_brought_together_are_one_run_and_a_missing_one_is_named() -> None:
    data = tf.Dataset.reference()

    def shard(cut: str) -> tf.Batch:
        return tf.batch(data, subjects=["S2", "S3"], shard=cut, progress=False)

    parts = [shard("3/3"), shard("1/3")]
    with pytest.raises(tf.Error, match="not every shard is done, so nothing is merged: 2/3 is missing"):
        tf.merge(parts)
    with pytest.raises(tf.Error, match="shards of batches with different numbers of shards: of 2 and of 3"):
        tf.merge([*parts, shard("1/2")])
    with pytest.raises(tf.Error, match="no shard of a batch"):
        tf.merge([])
    parts.append(shard("2/3"))
    assert tf.merge(parts).to_json() == shard("1/1").to_json()


def test_a_frame_is_the_table_that_it_was_read_from() -> None:
    pd = pytest.importorskip("pandas")
    table = "subject,vowel,GGa_mm,SGm_mm,HGa_mm\nX,ɯ,46,25,36\nX,a,38,21,\nX,e,40.5,22,30\n"
    read = tf.Dataset.from_text(table)
    # pandas makes floats of a column with a gap; 36 must not become 36.0, whose half width would be 0.05 mm.
    frame = pd.read_csv(__import__("io").StringIO(table))
    assert frame["HGa_mm"].dtype == np.float64
    data = tf.dataset(frame)
    assert (data.rows, data.muscles) == (read.rows, read.muscles)
    np.testing.assert_array_equal(data.lengths_mm, read.lengths_mm)
    first, second = (tf.fit(d, "X", "e", target="stretch", verdict=False) for d in (data, read))
    assert plain(first) == plain(second)


def test_a_body_is_what_the_program_prints(asked: Asked) -> None:
    mesh = asked("mesh")
    body = tf.Body.tongue()
    assert body.nodes.tolist() == mesh["nodes_m"]
    assert body.triangles.tolist() == mesh["triangles"]
    assert body.connections.tolist() == [c["nodes"] for c in mesh["connections"]]
    assert body.fixed.tolist() == mesh["fixed"]
    assert {name: chain.tolist() for name, chain in body.muscles.items()} == mesh["muscles"]
    assert {name: nodes.tolist() for name, nodes in body.bones.items()} == mesh["bones"]


def test_a_body_in_a_file(program: str, tmp_path: Path, asked: Asked) -> None:
    import subprocess

    subprocess.run([program, "mesh", "--h", "8mm", "--out", str(tmp_path)], check=True, capture_output=True)
    body = tf.Body.read(tmp_path / "mesh.msh")
    assert body.nodes.tolist() == asked("mesh", "--h", "8mm")["nodes_m"]
    assert isinstance(json.dumps(body.what), str)

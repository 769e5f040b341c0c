"""Bad input raises an exception with the text of the program, and never panics."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import tongue_fit as tf

Call = Callable[[], object]
DATA = tf.Dataset.reference()
BODY = tf.Body.tongue()
MODEL = tf.Model().assemble(BODY, ["GGa", "SGm"])


def simulate(**tensions: float) -> object:
    return tf.Model().assemble(BODY, list(tensions)).solver().equilibrium(tensions)


def fit(vowel: str = "a", subject: str = "S2", **said: Any) -> object:
    return tf.fit(DATA, subject, vowel, **said)


def rows(**said: Any) -> object:
    return tf.batch(DATA, progress=False, **said)


#: Calls in Python, and the same calls of the program.
BOTH: list[tuple[Call, list[str]]] = [
    (lambda: simulate(GGaa=12.0), ["simulate", "--tension", "GGaa=12"]),
    (lambda: simulate(GGa=-5.0), ["simulate", "--tension", "GGa=-5"]),
    (lambda: simulate(GGa=float("inf")), ["simulate", "--tension", "GGa=inf"]),
    (lambda: simulate(GGa=float("nan")), ["simulate", "--tension", "GGa=NaN"]),
    (lambda: tf.Model().assemble(BODY, ["GGa", "GGa"]), ["simulate", "--tension", "GGa=1", "--tension", "GGa=2"]),
    (lambda: tf.Model(poisson_ratio=0.5).assemble(BODY, []), ["simulate", "--poisson-ratio", "0.5"]),
    (lambda: tf.Model(poisson_ratio=-3.0).assemble(BODY, []), ["simulate", "--poisson-ratio=-3"]),
    (lambda: tf.Body.tongue(-1e-3), ["mesh", "--h=-1mm"]),
    (lambda: tf.Body.tongue(0.5), ["mesh", "--h", "500mm"]),
    (lambda: tf.Body.tongue(1e-6), ["mesh", "--h", "0.001mm"]),
    (lambda: tf.Body.continuum(0.5), ["mesh", "--body", "continuum", "--h", "500mm"]),
    (lambda: tf.Body.read("nix.msh"), ["simulate", "--mesh", "nix.msh"]),
    (lambda: tf.Body.read("nix.json"), ["simulate", "--mesh", "nix.json"]),
    (lambda: fit("a", "S9"), ["--vowel", "a", "--subject", "S9"]),
    (lambda: fit("x"), ["--vowel", "x"]),
    (lambda: fit(""), ["--vowel", ""]),
    (lambda: fit("ɯ"), ["--vowel", "ɯ"]),
    (lambda: fit("a", "S4"), ["--vowel", "a", "--subject", "S4"]),
    (lambda: fit(baseline="x"), ["--vowel", "a", "--baseline", "x"]),
    (lambda: fit(target="length"), ["--vowel", "a", "--target", "length"]),
    (lambda: fit(muscles=["GGx"]), ["--vowel", "a", "--muscles", "GGx"]),
    (lambda: fit(muscles=["GGa", "GGa"]), ["--vowel", "a", "--muscles", "GGa,GGa"]),
    (lambda: fit(muscles=["GGa"]), ["--vowel", "a", "--muscles", "GGa"]),
    (lambda: rows(subjects=["S9"]), ["batch", "--subjects", "S9"]),
    (lambda: rows(vowels=[""]), ["batch", "--vowels", ""]),
    (lambda: rows(target="length"), ["batch", "--target", "length"]),
    (lambda: rows(baselines={"S9": "e"}), ["batch", "--baseline", "S9=e"]),
    (lambda: rows(shard="3/2"), ["batch", "--shard", "3/2"]),
    (lambda: DATA.with_half_width_mm(-1.0), ["--vowel", "a", "--error-mm=-1"]),
    (lambda: DATA.with_half_width_mm(float("nan")), ["--vowel", "a", "--error-mm", "NaN"]),
    (lambda: tf.Dataset.from_path("nix.csv"), ["--vowel", "a", "--lengths", "nix.csv"]),
    (lambda: tf.Dataset.from_path("."), ["--vowel", "a", "--lengths", "."]),
]


@pytest.mark.parametrize(("call", "words"), BOTH, ids=[" ".join(words) for _, words in BOTH])
def test_the_text_is_that_of_the_program(
    told: Callable[..., str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: Call, words: list[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(tf.Error) as caught:
        call()
    assert isinstance(caught.value, ValueError)
    said = told(*words)
    # The message of the program may begin with the name of the option.
    assert str(caught.value) in said, said


TABLES = [
    "",
    "nonsense",
    "subject,vowel\nX,a\n",
    "subject,vowel,GGa_mm\nX,a,4.6\n",
    "subject,vowel,GGa_mm\nX,a,forty\n",
    "subject,vowel,GGa_mm,GGa_mm\nX,a,46,46\n",
    "subject,vowel,GGa\nX,a,46\n",
    "vowel,GGa_mm\na,46\n",
    "subject,vowel,GGa_mm\nX,a,46,47\n",
    "subject,vowel,GGa_mm\n",
]


@pytest.mark.parametrize("table", TABLES)
def test_the_text_about_a_table_is_that_of_the_program(told: Callable[..., str], tmp_path: Path, table: str) -> None:
    (tmp_path / "my.csv").write_text(table)
    with pytest.raises(tf.Error) as caught:
        tf.fit(tf.Dataset.from_text(table, "my.csv"), "X", "a")
    assert str(caught.value) in told("--vowel", "a", "--subject", "X", "--lengths", "my.csv")


@pytest.mark.parametrize(
    ("call", "part"),
    [
        (lambda: MODEL.solver().equilibrium([1.0]), "1 tensions are given; 2 muscles contract: GGa, SGm"),
        (lambda: MODEL.solver().equilibrium({"HGa": 1.0}), "HGa does not contract in this model"),
        (lambda: MODEL.solver().shift_bone("tail", (0.0, 0.0)), 'there is no bone "tail"'),
        (lambda: MODEL.solver().shift_bone("hyoid", (float("nan"), 0.0)), "the shift of hyoid is NaN"),
        (lambda: MODEL.solver().equilibrium_from(coarse(), [1.0, 1.0]), "take a shape of the same body"),
        (lambda: MODEL.solver().jacobian(coarse()), "take a shape of the same body"),
        (lambda: MODEL.solver().vjp(MODEL.solver().equilibrium([0, 0]), np.zeros((3, 2))), "cotangent has the shape (3, 2)"),
        (lambda: MODEL.solver().jacobian(MODEL.solver().equilibrium([1e12, 1.0])), "no stable equilibrium"),
        (lambda: MODEL.length("GGa").value(np.zeros((3, 2))), "positions has the shape (3, 2)"),
        (lambda: MODEL.contour([float("nan"), 0.0]), "the distance of the point from the surface is NaN"),
        (lambda: MODEL.trajectory([1.0, 1.0], -1.0), "the time to the end is -1"),
        (lambda: tf.Observation(MODEL.length("GGa"), float("nan")), "the measured value is NaN"),
        (lambda: tf.Observation(MODEL.length("GGa"), 1.0, 0.0), "the standard deviation of an observation is 0"),
        (lambda: tf.InverseProblem(MODEL, []).fit(), ""),
        (lambda: tf.InverseProblem(MODEL, [], starts=0), "the number of starts is 0"),
        (lambda: tf.InverseProblem(MODEL, [], starts=20_000), "the number of starts is 20000; it must be from 1 to 10000"),
        (lambda: tf.InverseProblem(MODEL, [], upper_bound=-1.0), "the upper bound of the tensions is -1"),
        (lambda: tf.InverseProblem(MODEL, [], upper_bound=1e10), "to 1e9 N"),
        (lambda: tf.InverseProblem(MODEL, []).free_young_modulus(float("nan"), 1.0).fit(), ""),
        (lambda: tf.Model(poisson_ratio=0.5), "Poisson's ratio"),
        (lambda: rows(threads=0), "threads must be from 1"),
        (lambda: tf.Body.from_anatomy("nonsense"), "anatomy"),
    ],
)
def test_what_only_python_can_ask_for_is_refused_as_well(call: Call, part: str) -> None:
    with pytest.raises(tf.Error) as caught:
        call()
    assert part in str(caught.value)


def coarse() -> tf.Shape:
    return tf.Model().assemble(tf.Body.tongue(8e-3), ["GGa"]).solver().equilibrium([1.0])


@pytest.mark.parametrize(
    "call",
    [
        lambda: MODEL.solver().equilibrium("GGa"),  # type: ignore[arg-type]
        lambda: MODEL.solver().equilibrium(None),  # type: ignore[arg-type]
        lambda: MODEL.solver().equilibrium(np.zeros((2, 2))),
        lambda: MODEL.solver().vjp(MODEL.solver().equilibrium([0, 0]), np.zeros(3)),
        lambda: tf.fit("S2", "S2", "a"),  # type: ignore[arg-type]
        lambda: tf.fit(DATA, "S2", "a", threads=-1),
    ],
)
def test_a_wrong_type_is_an_exception(call: Call) -> None:
    with pytest.raises((TypeError, OverflowError, ValueError)):
        call()


@settings(max_examples=60, deadline=None)
@given(tensions=st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=0, max_size=3))
def test_no_tensions_panic(tensions: list[float]) -> None:
    try:
        shape = MODEL.solver().equilibrium(tensions)
        assert np.isfinite(shape.positions).all()
    except tf.Error:
        pass


@settings(max_examples=60, deadline=None)
@given(text=st.text(max_size=200), vowel=st.text(max_size=4))
def test_no_table_panics(text: str, vowel: str) -> None:
    for table in (text, f"subject,vowel,GGa_mm,SGm_mm\n{text}"):
        try:
            tf.fit(tf.Dataset.from_text(table), "X", vowel)
        except tf.Error:
            pass


def test_ctrl_c_stops_long_work() -> None:
    """Runs in a process of its own, because test runners may ignore the signal. The fits would take minutes."""
    code = """
import signal, tongue_fit as tf
signal.signal(signal.SIGINT, signal.default_int_handler)
print("ready", flush=True)
try:
    tf.batch(tf.Dataset.reference(), body=tf.Body.tongue(1e-3), progress=False)
except KeyboardInterrupt:
    print("stopped", flush=True)
"""
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as child:
        try:
            assert child.stdout is not None and child.stdout.readline() == "ready\n"
            time.sleep(0.5)
            child.send_signal(signal.SIGINT)
            told, _ = child.communicate(timeout=60)
        finally:
            child.kill()
    assert told == "stopped\n" and child.returncode == 0

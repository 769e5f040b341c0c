"""Options of functions that run the program are those of the program; type checkers and functions refuse wrong ones; help() explains each."""

from __future__ import annotations

import inspect
import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import pytest
from test_arguments import CALLS, OF_OPTIONS, ROOT, resolved

import tongue_fit as tf
from tongue_fit import options

DATA = tf.Dataset.reference()
#: The package without its types, for wrong calls.
UNTYPED: Any = tf
OF_EVERY_COMMAND = {"help", "version", "json", "out", "threads", "quiet", "verbose"}
#: The types of options, the command of each, and its options that are arguments of the function or (a template) no analysis.
TYPES: list[tuple[Any, list[str], str]] = [
    (options.PosteriorOptions, [], "vowel subject target baseline method lengths posterior posterior-seed"),
    (options.AdaptOptions, ["adapt"], "map-template"),
    (options.TrackOptions, ["track"], "map-template"),
    (options.SoundOptions, ["sound"], ""),
    (options.ValidateOptions, ["validate"], ""),
    (options.CheckOptions, ["lengths", "check"], ""),
]


@pytest.mark.parametrize(("kind", "command", "own"), TYPES, ids=[kind.__name__ for kind, _, _ in TYPES])
def test_the_options_are_those_of_the_program(program: str, kind: Any, command: list[str], own: str) -> None:
    told = subprocess.run([program, *command, "--help"], capture_output=True, text=True, check=True).stdout
    theirs = dict(re.findall(r"^ +(?:-\w, )?--([a-z-]+)(.*?)(?=^ +(?:-\w, )?--[a-z]|^ *[<\[]FILE|^\S|\Z)", told, re.DOTALL | re.MULTILINE))
    assert set(theirs) - OF_EVERY_COMMAND - set(own.split()) == {name.replace("_", "-") for name in kind.__annotations__}
    for name, option in kind.__annotations__.items():
        text = theirs[name.replace("_", "-")]
        default = re.search(r"\[default: (\S+)\]", text)
        assert default is None or option.__metadata__[0] == default[1], name
        assert ("<" not in text.split("\n")[0]) == (option.__origin__ is bool), name
        listed = re.search(r"\[possible values: (.*?)\]|Format of the files: (.*?) \[", text)
        possible = re.findall(r"\w+", f"{listed[1] or listed[2]}".replace(" or ", " ")) if listed else re.findall(r"- (\w+): ", text)
        names = {word for one in (option.__origin__, *get_args(option.__origin__)) for word in get_args(one) if isinstance(word, str)}
        assert not possible or names == set(possible), name


def test_fit_batch_and_posterior_have_the_same_defaults() -> None:
    functions = [inspect.signature(function).parameters for function in (tf.fit, tf.batch, tf.posterior)]
    for name in {name for parameters in functions for name in parameters}:
        assert len({repr(parameters[name].default) for parameters in functions if name in parameters}) == 1, name


#: Every line is wrong.
WRONG = """\
tf.fit(data, "S2", "a", target="strech")
tf.fit(data, "S2", "a", method="newton")
tf.fit(data, "S2", "a", basline="e")
tf.batch(data, target="all")
tf.posterior(data, "S2", "a", target="strech")
tf.posterior(data, "S2", "a", priorities={})
tf.posterior(data, "S2", "a", body="spring")
tf.track("a.csv", hold_ot=[2, 5, 8])
tf.track("a.csv", also=["svg", "stl"])
tf.track("a.csv", draws="many")
tf.adapt("a.csv", rest="similarty")
tf.sound(vowle="a")
tf.sound(tension=12.0)
tf.validate(permutations=[1])
tf.check("a.csv", error="0.5")
tf.scene("supine", out="x")
tf.Body.read("a.msh", unit="cm")
"""
RIGHT = """\
record: dict[str, float] = tf.fit(data, "S2", "a", target="stretch", muscles=["GGa", "HGa"]).tensions_n_per_m
tf.batch(data, target="both", subjects="S2")
tf.posterior(data, "S2", "a", draws=2000, priors={"tension": {"scale_n_per_m": 20.0}}, contour={"a": "a.csv"}, body="continuum")
given: tf.options.TrackOptions = {"hold_out": [2, 5, 8], "also": ["svg", "sto"], "body": "tongue3d"}
tf.track("a.csv", b"bytes", **given, threads=2)
tf.adapt("a.csv", rest="joint", map={"back": "x"})
tf.sound(tension={"GGa": 12.0}, hyoid=(1.0, -1.0))
tf.validate(lengths=data, permutations=1)
tf.check("a.csv", baseline="e")
tf.run("scene", "run", "supine", anything=1)
"""
MYPY = [sys.executable, "-m", "mypy", "--strict", "--no-incremental"]
PYRIGHT = [str(Path(sys.executable).parent / "basedpyright"), "--level", "error", "--pythonpath", sys.executable]


@pytest.mark.parametrize("checker", [MYPY, PYRIGHT], ids=["mypy", "pyright"])
def test_type_checkers_refuse_every_wrong_use_and_no_right_one(checker: list[str], tmp_path: Path) -> None:
    start = "import tongue_fit as tf\n\ndata = tf.Dataset.reference()\n"
    (tmp_path / "wrong.py").write_text(start + WRONG)
    (tmp_path / "right.py").write_text(start + RIGHT)
    (tmp_path / "pyrightconfig.json").write_text(json.dumps({"typeCheckingMode": "strict"}))
    told = subprocess.run([*checker, "wrong.py", "right.py"], cwd=tmp_path, capture_output=True, text=True).stdout
    found = re.findall(r"(\w+\.py):(\d+):.*error", told)
    assert {int(line) for file, line in found if file == "wrong.py"} == set(range(4, 4 + len(WRONG.splitlines()))), told
    assert not [file for file, _ in found if file != "wrong.py"], told


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: UNTYPED.track("a.csv", hold_ot=[2]), r"track\(\) got an unexpected keyword argument 'hold_ot'; did you mean 'hold_out'\?"),
        (lambda: UNTYPED.check("a.csv", colour=1), r"check\(\) got an unexpected keyword argument 'colour'; it has baseline, error_mm"),
        (lambda: UNTYPED.posterior(DATA, "S2", "a", target="strech"), "target must be 'ratio' or 'stretch', not 'strech'; did you mean 'stretch'"),
        (lambda: UNTYPED.posterior(DATA, "S2", "a", draws="many"), "draws must be a whole number"),
        (lambda: UNTYPED.posterior(DATA, "S2", "a", seed=-1), "'-1' for seed"),
        (lambda: UNTYPED.track("a.csv", also=["svg", "stl"]), "also must be .*'vtu', not 'stl'"),
        (lambda: UNTYPED.track("a.csv", draws="many"), "'many' for draws"),
        (lambda: UNTYPED.track("a.csv", as_is="yes"), "'yes' for as_is"),
        (lambda: UNTYPED.track("a.csv", sides_apart=True), "sides_apart needs a body in space: body space"),
        (lambda: UNTYPED.track("a.csv", threads=0), "'0' for threads"),
        (lambda: UNTYPED.adapt(landmarks="a.csv", contour="b.csv", h=5, mesh="c.msh"), "h cannot be used with mesh"),
        (lambda: UNTYPED.run(vowel="a", target="ratio", methd="x"), "argument methd found"),
        (lambda: UNTYPED.fit(DATA, "S2", "a", target="strech"), 'unknown target kind "strech"; did you mean "stretch"'),
        (lambda: UNTYPED.fit(DATA, "S2", "a", method="newton"), "'newton' for 'method' .possible values: nelder-mead, gauss-newton"),
    ],
)
def test_a_wrong_option_is_refused_in_terms_of_python(call: Callable[[], object], said: str) -> None:
    with pytest.raises((tf.Error, TypeError), match=said) as refused:
        call()
    assert "Usage" not in str(refused.value) and "--help" not in str(refused.value)


def test_what_the_program_refuses_later_is_in_terms_of_python_too(tmp_path: Path) -> None:
    with pytest.raises(tf.Error, match="^draws is 99 draws; it must be from 100"):
        tf.posterior(DATA, "S2", "a", draws=99)
    lines = (ROOT / "tests/gmsh/tongue_41.msh").read_text(encoding="utf-8").splitlines()
    huge = [re.sub(r"^-?\d+\.\S+ -?\d+\.\S+ 0$", lambda at: " ".join(str(1e3 * float(n)) for n in at[0].split()), line) for line in lines]
    (tmp_path / "mm.msh").write_text("\n".join(huge))
    with pytest.raises(tf.Error, match='read them with unit="mm"'):
        tf.Body.read(tmp_path / "mm.msh")
    message = "a note\nerror: leave '--hold-out <POINTS>' out, or --map\n\nUsage: tongue-fit"
    assert options.in_python(message, {"hold-out": "hold_out"}) == "leave hold_out out, or --map\na note"


@pytest.mark.parametrize("name", sorted({*CALLS, *OF_OPTIONS} - {"Posterior.frame", "Posterior.save"}))
def test_help_names_every_argument(name: str) -> None:
    function = resolved(name) if "." in name else getattr(tf, name)
    types = [kind for kind, _, _ in TYPES if kind.__name__.lower() == f"{name}options"]
    arguments = {*inspect.signature(function).parameters} - {"self", "options"} | {name for kind in types for name in kind.__annotations__}
    text = inspect.getdoc(function) or ""
    if inspect.isfunction(function):
        assert re.findall(r"^(\w+)\n-+$", text, re.MULTILINE) == ["Parameters", "Returns", "Raises"]
        assert {name.strip("*") for name in re.findall(r"^([*\w]+) : ", text, re.MULTILINE)} - {"options"} == arguments
    assert [argument for argument in arguments if not re.search(rf"\b{argument}\b", text)] == []


def test_what_the_program_notes_on_a_mesh_is_a_warning() -> None:
    with pytest.warns(UserWarning, match="second_order.msh: no muscle GGm"):
        tf.Body.read(ROOT / "tests/gmsh/second_order.msh")

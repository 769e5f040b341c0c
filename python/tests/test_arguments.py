"""Every argument of every public function: other types for the same numbers and texts give the same answer, and impossible values are
refused with an error that names the argument or the value."""

from __future__ import annotations

import inspect
from collections import UserDict
from collections.abc import Callable
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
import pytest
from conftest import plain

import tongue_fit as tf

ROOT = Path(__file__).resolve().parents[2]
BODY = tf.Body.tongue(8e-3)
DATA = tf.Dataset.reference()
MODEL = tf.Model().assemble(BODY, ["GGa", "HGa"])
SHAPE = MODEL.solver().equilibrium([1.0, 2.0])
POINTS = np.round(SHAPE.positions * 1024) / 1024  # exact in float32
LENGTH = MODEL.length("GGa")
SEEN = [tf.Observation(LENGTH, 0.041), tf.Observation(MODEL.length("HGa"), 0.0275)]
FRAME = pd.DataFrame({"subject": "X", "vowel": ["ɯ", "a"], "GGa_mm": [46, 38], "SGm_mm": [25, 21], "HGa_mm": [36, 33]})
ROWS: dict[str, Any] = {"target": "stretch", "progress": False}


def problem() -> tf.InverseProblem:
    return tf.InverseProblem(MODEL, SEEN, starts=1).free_bone("hyoid", 0.01)


def fitted(change: Callable[..., tf.InverseProblem]) -> Callable[..., Any]:
    """A problem whose arguments are checked by the fit at the latest."""
    return lambda **given: change(**given).fit().tensions


#: For every callable of the package a function that calls it, and correct arguments.
CALLS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "Assembly.contour": (MODEL.contour, {"point": (0.01, 0.02)}),
    "Assembly.length": (MODEL.length, {"muscle": "GGa"}),
    "Assembly.observations": (MODEL.observations, {"target": DATA.stretches("S2", "a", muscles=["GGa", "HGa"])}),
    "Assembly.ratio": (MODEL.ratio, {"muscle": "GGa", "over": "HGa"}),
    "Assembly.stretch": (MODEL.stretch, {"muscle": "GGa"}),
    "Assembly.trajectory": (MODEL.trajectory, {"tensions": [1.0, 2.0], "t_end_s": 0.01, "ramp_s": 0.0, "samples": 3}),
    "Body.continuum": (tf.Body.continuum, {"spacing_m": 8e-3}),
    "Body.from_anatomy": (
        tf.Body.from_anatomy,
        {"toml": (ROOT / "targets/anatomy.toml").read_text(encoding="utf-8"), "spacing_m": 8e-3, "origin": "x"},
    ),
    "Body.read": (tf.Body.read, {"path": str(ROOT / "tests/gmsh/tongue_41.msh"), "unit": "m"}),
    "Body.tongue": (tf.Body.tongue, {"spacing_m": 8e-3}),
    "Dataset.from_path": (tf.Dataset.from_path, {"path": str(ROOT / "targets/takano2007_lengths.csv")}),
    "Dataset.from_text": (tf.Dataset.from_text, {"text": "subject,vowel,GGa_mm,SGm_mm\nX,ɯ,46,25\nX,a,38,21\n", "origin": "x"}),
    "Dataset.ratios": (DATA.ratios, {"subject": "S2", "vowel": "a", "muscles": ["GGa", "HGa"], "baseline": "e"}),
    "Dataset.stretches": (DATA.stretches, {"subject": "S2", "vowel": "a", "muscles": ["GGa", "HGa"], "baseline": "e"}),
    "Dataset.vowels": (DATA.vowels, {"subject": "S2"}),
    "Dataset.with_half_width_mm": (DATA.with_half_width_mm, {"mm": 0.5}),
    "Estimate.displacement": (problem().fit().displacement, {"bone": "hyoid"}),
    "Estimate.tension": (problem().fit().tension, {"muscle": "GGa"}),
    "InverseProblem": (
        fitted(tf.InverseProblem),
        {"assembly": MODEL, "observations": SEEN, "method": "gauss-newton", "starts": 1, "upper_bound": 100.0},
    ),
    "InverseProblem.fit": (lambda **given: problem().fit(**given).tensions, {"threads": 1}),
    "InverseProblem.free_bone": (fitted(lambda **given: problem().free_bone(**given)), {"bone": "mental_spine", "most": 0.01}),
    "InverseProblem.free_poisson_ratio": (fitted(lambda **given: problem().free_poisson_ratio(**given)), {"lower": 0.4, "upper": 0.495}),
    "InverseProblem.free_young_modulus": (fitted(lambda **given: problem().free_young_modulus(**given)), {"lower": 4e3, "upper": 8e3}),
    "InverseProblem.with_bone_prior": (fitted(lambda **given: problem().with_bone_prior(**given)), {"bone": "hyoid", "sd": 0.002}),
    "InverseProblem.with_bounds": (fitted(lambda **given: problem().with_bounds(**given)), {"muscle": "GGa", "lower": 0.0, "upper": 20.0}),
    "InverseProblem.with_prior": (fitted(lambda **given: problem().with_prior(**given)), {"muscle": "GGa", "mean": 0.0, "sd": 20.0}),
    "InverseProblem.with_tension": (fitted(lambda **given: problem().with_tension(**given)), {"muscle": "GGa", "tension": 20.0}),
    "Model": (
        lambda **given: tf.Model(**given).assemble(BODY, ["GGa"]),
        {"young_modulus": 6900.0, "poisson_ratio": 0.49},
    ),
    "Model.assemble": (tf.Model().assemble, {"body": BODY, "muscles": ["GGa"]}),
    "Observable.gradient": (LENGTH.gradient, {"positions": POINTS}),
    "Observable.value": (LENGTH.value, {"positions": POINTS}),
    "Observation": (tf.Observation, {"observable": LENGTH, "measured": 0.04, "standard_deviation": 1e-3}),
    "Posterior.frame": (lambda **given: tf.scene("supine").frame(**given), {"name": "none.csv"}),
    "Posterior.save": (lambda **given: tf.Run({}, {}, "", True).save(**given), {"folder": "."}),
    "Shape.length": (SHAPE.length, {"muscle": "GGa"}),
    "Shape.picture": (SHAPE.picture, {"title": "x"}),
    "Shape.ratio": (SHAPE.ratio, {"muscle": "GGa", "over": "HGa"}),
    "Shape.rest_length": (SHAPE.rest_length, {"muscle": "GGa"}),
    "Shape.stretch": (SHAPE.stretch, {"muscle": "GGa"}),
    "Shape.tension": (SHAPE.tension, {"muscle": "GGa"}),
    "Solver.equilibrium": (MODEL.solver().equilibrium, {"tensions": [1.0, 2.0]}),
    "Solver.equilibrium_from": (MODEL.solver().equilibrium_from, {"start": SHAPE, "tensions": [1.0, 2.0]}),
    "Solver.follow_from_rest": (MODEL.solver().follow_from_rest, {"tensions": [1.0, 2.0]}),
    "Solver.jacobian": (MODEL.solver().jacobian, {"shape": SHAPE}),
    "Solver.shift_bone": (MODEL.solver().shift_bone, {"bone": "hyoid", "shift": (0.001, 0.0)}),
    "Solver.vjp": (MODEL.solver().vjp, {"shape": SHAPE, "cotangent": POINTS}),
    "Trajectory.lengths": (MODEL.trajectory([1.0, 2.0], 0.01, samples=3).lengths, {"muscle": "GGa"}),
    "batch": (
        tf.batch,
        {"data": DATA, "subjects": ["S2"], "vowels": ["a"], **ROWS, "baseline": "e", "baselines": {"S2": "e"}, "method": "gauss-newton"}
        | {"body": BODY, "model": tf.Model(), "shard": "1/1"}
        | {"threads": 1},
    ),
    "check": (tf.check, {"table": FRAME}),
    "dataset": (tf.dataset, {"frame": FRAME, "origin": "x"}),
    "fit": (
        tf.fit,
        {"data": DATA, "subject": "S2", "vowel": "a", "target": "stretch", "muscles": ["GGa", "HGa", "SGm"], "baseline": "e", "body": BODY}
        | {"model": tf.Model(), "method": "gauss-newton", "verdict": False, "threads": 1},
    ),
    "merge": (tf.merge, {"shards": [tf.batch(DATA, subjects="S2", vowels="a", **ROWS)]}),
    "posterior": (
        tf.posterior,
        {"data": DATA, "subject": "S2", "vowel": "a", "target": "ratio", "baseline": "e", "method": "gauss-newton", "draws": 100, "seed": 1}
        | {"threads": 1},
    ),
    "scene": (tf.scene, {"scene": "supine", "threads": 1}),
}
#: Callables with arbitrary options, which the program checks (`test_program.py`).
OF_OPTIONS = {"adapt", "run", "sound", "track", "validate"}
#: Types whose objects only the package makes.
MADE = {"Assembly", "Batch", "Body", "Dataset", "Error", "Estimate", "Fit", "Observable", "Posterior", "Run", "Shape", "Solver", "Target", "Trajectory"}
#: The same as `Posterior.frame` and `Posterior.save`.
SAME = {"Run.frame", "Run.save"}

#: Values that are wrong for every argument, each with the forms in which messages may show it.
WRONG: dict[str, tuple[Any, tuple[str, ...]]] = {
    "None": (None, ("None",)),
    "NaN": (float("nan"), ("NaN", "nan")),
    "infinity": (float("inf"), ("inf",)),
    "minus one": (-1, ("-1",)),
    "a text": ("nonsense", ("nonsense", "a name without = and a value", "missing from the header")),
    "bytes": (b"nonsense", ("nonsense", "missing from the header")),
    "no items": ([], ("none", "no ", "0 ", "at least one observation")),
    "three numbers": ([1.0, 2.0, 3.0], ("1",)),
    "a dict": ({"nonsense": 1.0}, ("nonsense",)),
    "a series": (pd.Series({"nonsense": 1.0}), ("nonsense",)),
    "two axes": (np.zeros((2, 2)), ("0",)),
    "an object": (object(), ("object",)),
}


def is_meant(call: str, name: str, kind: str, right: Any) -> bool:
    """Whether the argument may have such a value."""
    without = {"muscles", "baseline", "baselines", "body", "model", "threads", "standard_deviation", "subjects", "vowels"}
    if kind == "None":
        return name in without
    if kind == "a text":
        return name in {"origin", "title"} or (call, name) in {("batch", "baseline"), ("Posterior.save", "folder")}
    if kind == "no items":
        return name == "baselines" or (call, name) == ("Model.assemble", "muscles")
    # Measured values and the mean of a prior may be any numbers.
    return kind == "minus one" and (call, name) in {("Observation", "measured"), ("InverseProblem.with_prior", "mean")}


def functions() -> set[str]:
    """The names of all callables of the package that take arguments."""
    found = set()
    for name in tf.__all__:
        value = getattr(tf, name)
        if callable(value):
            found.add(name)
        if inspect.isclass(value) and not issubclass(value, Exception):
            own = [method for kind in value.__mro__ if kind.__module__.startswith("tongue_fit") for method in vars(kind)]
            found |= {f"{name}.{method}" for method in own if not method.startswith("_") and callable(getattr(value, method))}
    with_arguments = {name for name in found if "." not in name or set(inspect.signature(resolved(name)).parameters) - {"self"}}
    return with_arguments - MADE - OF_OPTIONS - SAME


def resolved(name: str) -> Any:
    kind, method = name.split(".")
    return getattr(getattr(tf, kind), method)


def test_every_function_is_in_this_table_with_all_of_its_arguments() -> None:
    assert functions() == set(CALLS)
    for name, (_, right) in CALLS.items():
        signature = inspect.signature(resolved(name) if "." in name else getattr(tf, name))
        named = {p.name for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD} - {"self"}
        assert named == set(right), name


def cases() -> list[tuple[str, str]]:
    return [(call, name) for call, (_, right) in CALLS.items() for name in right]


@pytest.mark.parametrize(("call", "name"), cases(), ids=[f"{call}, {name}" for call, name in cases()])
def test_what_cannot_be_meant_is_refused_with_the_argument_or_the_value(call: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    function, right = CALLS[call]
    for kind, (value, shown) in WRONG.items():
        if is_meant(call, name, kind, right[name]):
            continue
        with pytest.raises((tf.Error, TypeError, OverflowError)) as caught:
            function(**{**right, name: value})
        # Errors of Python have the name of the argument in a note.
        text = "\n".join([str(caught.value), *getattr(caught.value, "__notes__", [])])
        words = (name,) if not isinstance(caught.value, tf.Error) else (name, *shown)
        assert any(word in text for word in words), (kind, type(caught.value), text)


def told(answer: Any) -> Any:
    """A form of an answer that can be compared bit by bit."""
    if isinstance(answer, tf.Run):
        return {key: value for key, value in answer.items() if key not in ("wall_s", "command", "time_by_effect", "file")}.__repr__()
    if isinstance(answer, dict):
        return plain(answer)
    if isinstance(answer, tf.Batch):
        return [plain(fit) for fit in answer.fits]
    for attribute in ("positions", "lengths_mm"):
        answer = getattr(answer, attribute, answer)
    return answer.tobytes() if isinstance(answer, np.ndarray) else answer


@pytest.mark.parametrize("call", [call for call in CALLS if call not in ("posterior", "Posterior.frame", "Observable.gradient")])
def test_numbers_and_texts_of_numpy_are_the_same(call: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    function, right = CALLS[call]
    as_numpy: dict[str, Any] = {}
    for name, value in right.items():
        if isinstance(value, bool):
            continue
        if isinstance(value, int):
            as_numpy[name] = np.int64(value)
        elif isinstance(value, float):
            as_numpy[name] = np.float64(value)
        elif isinstance(value, str):
            as_numpy[name] = np.str_(value)
    if as_numpy:
        assert told(function(**{**right, **as_numpy})) == told(function(**right))


def read_only(values: Any) -> np.ndarray:
    array = np.array(values)
    array.flags.writeable = False
    return array


def forms(name: str, right: Any) -> dict[str, Any]:
    """The same numbers or names in all other types of Python; nothing for an argument that is a single value."""
    if isinstance(right, dict):
        return {"Series": pd.Series(right), "UserDict": UserDict(right), "MappingProxyType": MappingProxyType(right)}
    if not isinstance(right, (list, tuple, np.ndarray)) or len(right) == 0 or isinstance(right[0], (tf.Batch, tf.Observation)):
        return {}
    array, nested = np.array(right), np.array(right).tolist()
    found: dict[str, Any] = {"list": nested, "tuple": tuple(nested), "array": array, "read-only": read_only(right)}
    found["strided"] = np.repeat(array, 2, axis=0)[::2]
    if array.dtype.kind == "f":
        single = array.astype(np.float32)
        found |= {"float32": single} if (single == array).all() else {}
        found["columns first"] = np.asfortranarray(array)
    if array.ndim == 2:
        return found | {"tuples": tuple(map(tuple, nested)), "frame, y first": pd.DataFrame(array, columns=["x", "y"])[["y", "x"]]}
    if array.dtype.kind == "f":
        by_name = dict(zip(["GGa", "HGa"] if name == "tensions" else ["x", "y"], nested, strict=True))
        turned = dict(reversed(by_name.items()))
        return found | {"dict in another order": turned, "Series in another order": pd.Series(turned)}
    return found | {"Series": pd.Series(nested), "Index": pd.Index(nested), "keys of a dict": dict.fromkeys(nested, 1)}


def test_the_same_value_in_any_form_gives_the_same_bits_and_a_spoilt_one_is_refused_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    tried = 0
    for call, name in cases():
        function, right = CALLS[call]
        given = forms(name, right[name])
        expected = told(function(**right)) if given else None
        for kind, value in given.items():
            assert told(function(**{**right, name: value})) == expected, (call, name, kind)
            tried += 1
        if "strided" not in given or given["array"].dtype.kind != "f":
            continue
        array = given["array"]
        spoilt: dict[str, Any] = {"too long": np.concatenate([array, array[:1]]), "too short": array[:-1]}
        for fault in (np.nan, None):
            spoilt[f"{fault} in it"] = array.astype(object)
            spoilt[f"{fault} in it"].flat[1] = fault
        for kind, value in spoilt.items():
            with pytest.raises(tf.Error) as caught:
                function(**{**right, name: value})
            text = str(caught.value)
            assert name in text or "tension of HGa is NaN" in text, (call, kind, text)
            tried += 1
    assert tried > 150

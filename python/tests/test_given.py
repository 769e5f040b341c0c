"""Numbers and names are accepted in all types of Python: by name if there are names, otherwise in order and with the right length.
`test_arguments.py` tests the arguments of every function."""

from __future__ import annotations

from collections import OrderedDict, UserDict
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from conftest import plain

import tongue_fit as tf

MUSCLES = ["GGa", "SGm", "HGa"]
LOAD = {"GGa": 12.0, "SGm": 11.5, "HGa": 4.5}
TURNED = {"HGa": 4.5, "GGa": 12.0, "SGm": 11.5}
MODEL = tf.Model().assemble(tf.Body.tongue(), MUSCLES)
EXPECTED = MODEL.solver().equilibrium(LOAD)


class Pulls(NamedTuple):
    HGa: float
    GGa: float
    SGm: float


IN_ORDER = list(LOAD.values())


def read_only(values: Any) -> np.ndarray:
    array = np.array(values)
    array.flags.writeable = False
    return array


def unaligned(values: Any) -> np.ndarray:
    buffer = bytearray(b"\0" + np.array(values).tobytes())
    return np.frombuffer(buffer, dtype=np.float64, offset=1).reshape(np.shape(values))


#: The same tensions in all types of Python. Each is exact in float32 and float16.
KINDS: dict[str, Any] = {
    "dict in another order": TURNED,
    "OrderedDict": OrderedDict(TURNED),
    "UserDict": UserDict(TURNED),
    "MappingProxyType": MappingProxyType(TURNED),
    "dict of numpy numbers": {name: np.float32(n) for name, n in TURNED.items()},
    "named tuple": Pulls(**TURNED),
    "Series in another order": pd.Series(TURNED),
    "Series of Float64": pd.Series(TURNED).astype("Float64"),
    "row of a frame": pd.DataFrame([TURNED]).iloc[0],
    "Series without names": pd.Series(IN_ORDER),
    "xarray by name": xr.DataArray(list(TURNED.values()), dims="muscle", coords={"muscle": list(TURNED)}),
    "xarray by another name": xr.DataArray(list(TURNED.values()), dims="m", coords={"muscle": ("m", list(TURNED))}),
    "xarray without names": xr.DataArray(IN_ORDER),
    "list": IN_ORDER,
    "tuple": tuple(IN_ORDER),
    "list of numpy numbers": [np.float32(n) for n in IN_ORDER],
    "float32": np.array(IN_ORDER, dtype=np.float32),
    "float16": np.array(IN_ORDER, dtype=np.float16),
    "big-endian": np.array(IN_ORDER, dtype=">f8"),
    "objects": np.array(IN_ORDER, dtype=object),
    "strided": np.repeat(IN_ORDER, 2)[::2],
    "backwards": np.array(IN_ORDER[::-1])[::-1],
    "read-only": read_only(IN_ORDER),
    "unaligned": unaligned(IN_ORDER),
    "masked where nothing is": np.ma.array(IN_ORDER, mask=[False] * 3),
}


@pytest.mark.parametrize("kind", KINDS)
def test_tensions_of_every_kind_give_the_same_bits(kind: str) -> None:
    assert MODEL.solver().equilibrium(KINDS[kind]).positions.tobytes() == EXPECTED.positions.tobytes()


@pytest.mark.parametrize(
    ("given", "part"),
    [
        (None, "tensions must be numbers, not None"),
        ("GGa", "tensions must be numbers, not 'GGa'"),
        (b"GGa", "tensions must be numbers"),
        (3.0, "tensions has 0 axes; it must have one"),
        ({1.0, 2.0, 3.0}, "tensions"),
        (object(), "tensions must be numbers"),
        ([1.0, 2.0], "2 tensions are given; 3 muscles contract: GGa, SGm, HGa"),
        ([1.0, None, 2.0], "tensions has None where a number is needed"),
        (["1", "2", "3"], "tensions has '1' where a number is needed"),
        (np.zeros((3, 1)), "tensions has 2 axes; it must have one"),
        (np.zeros(3, dtype=complex), "tensions must be numbers"),
        (np.array(["1", "2", "3"]), "tensions must be numbers"),
        (np.ma.array([1.0, 2.0, 3.0], mask=[False, True, False]), "tensions has values that are masked"),
        (np.array((1.0, 2.0), dtype=[("GGa", "f8"), ("SGm", "f8")]), "tensions has named fields; give a dict"),
        ({"GGa": "1"}, "tensions: GGa has '1' where a number is needed"),
        ({0: 1.0}, "tensions has 0 where a name is needed"),
        ({"GGa": float("nan")}, "GGa"),
        ([float("nan"), 1.0, 1.0], "GGa"),
        (pd.Series([1.0, 2.0, 3.0], index=[2, 1, 0]), "tensions has 2 where a name is needed"),
        (pd.Series([1.0, 2.0, 3.0], index=["GGa", "SGm", "SGm"]), "tensions has the name SGm twice"),
        (pd.Series([1, None, 2], index=MUSCLES, dtype="Int64"), "tensions: SGm has <NA> where a number is needed"),
        (pd.Series([1, None, 2], dtype="Int64"), "tensions must be numbers"),
        (pd.DataFrame([TURNED]), "tensions has two axes; it must have one"),
        (xr.DataArray(np.zeros((1, 3)), dims=("t", "muscle")), "tensions has 2 axes; it must have 1"),
        (pd.Series(TURNED).rename({"HGa": "HGx"}), "HGx"),
    ],
)
def test_tensions_that_cannot_be_used_are_refused_by_name(given: Any, part: str) -> None:
    with pytest.raises(tf.Error) as caught:
        MODEL.solver().equilibrium(given)
    assert part in str(caught.value)


POINTS = np.round(EXPECTED.positions * 1024) / 1024  # exact in float32
POINT_KINDS: dict[str, Any] = {
    "unaligned": unaligned(POINTS),
    "frame": pd.DataFrame(POINTS, columns=["x", "y"]),
    "frame without names": pd.DataFrame(POINTS),
    "xarray, y first": xr.DataArray(POINTS[:, ::-1], dims=("node", "axis"), coords={"axis": ["y", "x"]}),
}


@pytest.mark.parametrize("kind", POINT_KINDS)
def test_points_of_every_kind_give_the_same_bits(kind: str) -> None:
    given, length, solver = POINT_KINDS[kind], MODEL.length("GGa"), MODEL.solver()
    assert length.value(given) == length.value(POINTS)
    assert length.gradient(given).tobytes() == length.gradient(POINTS).tobytes()
    assert solver.vjp(EXPECTED, given).tobytes() == solver.vjp(EXPECTED, POINTS).tobytes()


@pytest.mark.parametrize(
    "given",
    [
        None,
        "x",
        {"x": 1.0, "y": 2.0},
        [[1.0]],
        POINTS.T,
        POINTS[1:],
        POINTS[:, 0],
        [["a", "b"]] * len(POINTS),
        pd.DataFrame(POINTS, columns=["y", "z"]),
        pd.DataFrame(POINTS, columns=["x", "y"]).iloc[::-1],
    ],
)
def test_points_that_cannot_be_used_are_refused_by_name(given: Any) -> None:
    for name, call in (
        ("positions", MODEL.length("GGa").value),
        ("positions", MODEL.length("GGa").gradient),
        ("cotangent", lambda points: MODEL.solver().vjp(EXPECTED, points)),
    ):
        with pytest.raises(tf.Error, match=name):
            call(given)


@pytest.mark.parametrize("given", [None, "xy", 1.0, [1.0], [1.0, 2.0, 3.0], {"x": 1.0}, {"x": 1.0, "z": 2.0}])
def test_two_coordinates_that_cannot_be_used_are_refused_by_name(given: Any) -> None:
    with pytest.raises(tf.Error, match="shift"):
        MODEL.solver().shift_bone("hyoid", given)
    with pytest.raises(tf.Error, match="point"):
        MODEL.contour(given)


def test_a_text_is_one_name() -> None:
    found = tf.batch(tf.Dataset.reference(), subjects="S2", vowels="a", target="stretch", progress=False)
    assert [(fit["subject"], fit["vowel"]) for fit in found.fits] == [("S2", "a")]
    assert tf.Model().assemble(tf.Body.tongue(), "GGa").contracting == ["GGa"]


@pytest.mark.parametrize("given", [{"GGa", "SGm"}, 1, [1], b"GGa", [None]])
def test_names_that_cannot_be_used_are_refused_by_name(given: Any) -> None:
    data = tf.Dataset.reference()
    for name, call in (
        ("muscles", lambda: tf.Model().assemble(tf.Body.tongue(), given)),
        ("muscles", lambda: data.ratios("S2", "a", muscles=given)),
        ("muscles", lambda: tf.fit(data, "S2", "a", muscles=given)),
        ("subjects", lambda: tf.batch(data, subjects=given, progress=False)),
        ("vowels", lambda: tf.batch(data, vowels=given, progress=False)),
    ):
        with pytest.raises(tf.Error, match=name):
            call()


def test_frames_of_every_kind_are_the_table() -> None:
    table = "subject,vowel,GGa_mm,SGm_mm,HGa_mm\nX,ɯ,46,25,36\nX,a,38,21,\nX,e,40.5,22,30\n"
    read = tf.Dataset.from_text(table, "frame")
    frame = pd.DataFrame({"subject": "X", "vowel": ["ɯ", "a", "e"], "GGa_mm": [46, 38, 40.5], "SGm_mm": [25, 21, 22]})
    frame["HGa_mm"] = pd.array([36, None, 30], dtype="Int64")
    kinds = [
        frame,
        frame.set_index(["subject", "vowel"]),
        frame.set_index("vowel"),
        frame.convert_dtypes(),
        frame.astype({"GGa_mm": np.float32}),
        frame.iloc[[0, 1, 2]].set_axis([5, 3, 9]),
    ]
    quick: dict[str, Any] = {"target": "stretch", "method": "gauss-newton", "verdict": False}
    expected = plain(tf.fit(read, "X", "e", **quick))
    for kind in kinds:
        data = tf.dataset(kind)
        assert (data.rows, data.muscles) == (read.rows, read.muscles)
        np.testing.assert_array_equal(data.lengths_mm, read.lengths_mm)
        assert plain(tf.fit(data, "X", "e", **quick)) == expected


def test_errors_say_which_argument_and_what_to_do() -> None:
    frame = pd.DataFrame({"subject": ["X"], "vowel": ["a"], "GGa_mm": [46]})
    for call in (lambda: tf.batch(frame), lambda: tf.fit(frame, "X", "a")):
        with pytest.raises(tf.Error, match=r"data must be a tongue_fit.Dataset.*tongue_fit.dataset\(frame\)"):
            call()
    with pytest.raises(tf.Error, match="frame must be a pandas DataFrame"):
        tf.dataset("my.csv")
    with pytest.raises(tf.Error, match="baselines must be a dict"):
        tf.batch(tf.Dataset.reference(), baselines=["e"], progress=False)  # type: ignore[arg-type]

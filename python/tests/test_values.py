"""Objects can be pickled, copied, compared and shown."""

from __future__ import annotations

import copy
import pickle
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import plain

import tongue_fit as tf

DATA = tf.Dataset.reference()
TABLE = "subject,vowel,GGa_mm,SGm_mm,HGa_mm\nX,ɯ,46,25,36\nX,a,38,21,\n<b>,e,40.5,22,30\n"
MODEL = tf.Model().assemble(tf.Body.tongue(), ["GGa", "HGa"])
QUICK: dict[str, Any] = {"target": "stretch", "method": "gauss-newton"}

#: Functions that make an object, each with one that makes a different object of the same type.
VALUES: dict[str, tuple[Callable[[], object], Callable[[], object]]] = {
    "Body": (tf.Body.tongue, lambda: tf.Body.tongue(6e-3)),
    "Body, continuum": (lambda: tf.Body.continuum(8e-3), tf.Body.tongue),
    "Model": (tf.Model, lambda: tf.Model(poisson_ratio=0.45)),
    "Model, all said": (
        lambda: tf.Model(young_modulus=5e3, poisson_ratio=0.45),
        lambda: tf.Model(young_modulus=5e3),
    ),
    "Assembly": (lambda: tf.Model().assemble(tf.Body.tongue(), ["GGa"]), lambda: tf.Model().assemble(tf.Body.tongue(), ["HGa"])),
    "Dataset": (tf.Dataset.reference, lambda: tf.Dataset.from_text(TABLE)),
    "Dataset, own": (lambda: tf.Dataset.from_text(TABLE, "my.csv"), lambda: tf.Dataset.from_text(TABLE)),
    "Dataset, rounded": (lambda: DATA.with_half_width_mm(0.25), tf.Dataset.reference),
    "Target": (lambda: DATA.stretches("S2", "a"), lambda: DATA.ratios("S2", "a")),
    "Target, said": (lambda: DATA.ratios("S2", "a", muscles=["GGa", "HGa"], baseline="e"), lambda: DATA.ratios("S2", "a")),
    "Observable": (lambda: MODEL.ratio("GGa", "HGa"), lambda: MODEL.ratio("HGa", "GGa")),
    "Observable, point": (lambda: MODEL.contour((0.01, 0.02)), lambda: MODEL.contour((0.01, 0.03))),
    "Observation": (lambda: tf.Observation(MODEL.length("GGa"), 0.04, 1e-3), lambda: tf.Observation(MODEL.length("GGa"), 0.04)),
    "Observation of a target": (
        lambda: MODEL.observations(DATA.stretches("S2", "a", muscles=["GGa", "HGa"]))[1],
        lambda: MODEL.observations(DATA.stretches("S2", "a", muscles=["GGa", "HGa"]))[0],
    ),
    "Batch": (
        lambda: tf.batch(DATA, subjects="S2", vowels="a", target="stretch", progress=False),
        lambda: tf.batch(DATA, subjects="S2", vowels="e", target="stretch", progress=False),
    ),
}


@pytest.fixture(scope="module")
def found() -> tf.Fit:
    return tf.fit(DATA, "S2", "a", **QUICK)


@pytest.mark.parametrize("name", VALUES)
def test_a_value_is_pickled_copied_compared_and_shown(name: str) -> None:
    make, make_other = VALUES[name]
    value, other = make(), make_other()
    assert value == make() and not value != make()
    assert value != other and value != "GGa"
    for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1):
        assert pickle.loads(pickle.dumps(value, protocol)) == value
    assert copy.copy(value) == value
    assert copy.deepcopy([value])[0] == value
    if not isinstance(value, (tf.Batch, tf.Observable, tf.Observation)):
        assert len({value, make()}) == 1
    assert " object at 0x" not in repr(value)
    assert repr(value) != repr(other) or name in ("Dataset, rounded", "Batch")


def test_a_body_in_a_file_goes_with_its_pickle(program: str, tmp_path: Path, asked: Callable[..., dict[str, Any]]) -> None:
    import json
    import subprocess

    subprocess.run([program, "mesh", "--h", "8mm", "--out", str(tmp_path)], check=True, capture_output=True)
    (tmp_path / "body.json").write_text(json.dumps(asked("mesh", "--h", "8mm")), encoding="utf-8")
    for name in ("mesh.msh", "body.json"):
        body = tf.Body.read(tmp_path / name)
        pickled = pickle.dumps(body)
        (tmp_path / name).unlink()
        assert pickle.loads(pickled) == body


def test_what_a_pickle_brings_back_is_solved_with_the_same_bits() -> None:
    model = pickle.loads(pickle.dumps(MODEL))
    load = [12.0, 4.5]
    np.testing.assert_array_equal(model.solver().equilibrium(load).positions, MODEL.solver().equilibrium(load).positions)
    seen = [tf.Observation(MODEL.length("GGa"), 0.041, 0.3e-3), tf.Observation(MODEL.length("HGa"), 0.0275, 0.3e-3)]
    first, second = (tf.InverseProblem(m, s).fit() for m, s in ((MODEL, seen), (model, pickle.loads(pickle.dumps(seen)))))
    assert plain(first.record()) == plain(second.record())


def test_a_fit_is_the_dict_of_the_program_with_a_picture(found: tf.Fit) -> None:
    assert isinstance(found, dict) and found == pickle.loads(pickle.dumps(found)) == copy.deepcopy(found)
    assert pickle.loads(pickle.dumps(found))._repr_svg_() == found._repr_svg_()
    assert f"{found['tensions_n']['GGa']:.2f}" in found._repr_html_()
    assert "surely harder: " in found._repr_html_()
    of_continuum = tf.fit(DATA, "S2", "a", body=tf.Body.continuum(12e-3))
    assert "minutes" in of_continuum["no_verdict"] and of_continuum["no_verdict"] in of_continuum._repr_html_()
    of_batch = tf.batch(DATA, subjects="S2", vowels="a", target=found["target_kind"], progress=False).fits[0]
    assert found.tensions_n_per_m == found["tensions_n"] and of_batch.tensions_n_per_m == pytest.approx(found["tensions_n"], abs=1e-3)


def test_notebooks_show_tables_and_shapes(found: tf.Fit) -> None:
    model = tf.Model().assemble(tf.Body.tongue(), ["GGa", "HGa"])
    estimate = tf.InverseProblem(model, [tf.Observation(model.length("GGa"), 0.041)]).with_tension("HGa", 3.0).fit()
    for drawn in (model.body, model.solver().equilibrium([1.0, 2.0]), estimate, found):
        assert ElementTree.fromstring(drawn._repr_svg_() or "").tag.endswith("svg")
    batch = tf.batch(DATA, subjects="S2", target="stretch", progress=False)
    table = tf.Dataset.from_text(TABLE)
    for shown, cells in ((table, 3 * 5), (batch, 5 * len(batch))):
        html = shown._repr_html_()
        assert html.count("<td>") == cells and html.count("<table>") == html.count("</table>") == 1
    assert "&lt;b&gt;" in table._repr_html_() and "<b>" not in table._repr_html_()

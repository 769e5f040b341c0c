"""Shapes, derivatives, observations and motions are correct."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

import tongue_fit as tf

MUSCLES = ["GGa", "SGm", "HGa"]


@pytest.fixture
def model() -> tf.Assembly:
    return tf.Model().assemble(tf.Body.tongue(), MUSCLES)


def test_derivatives_are_those_of_differences(model: tf.Assembly) -> None:
    solver, at = model.solver(), np.array([12.0, 11.5, 4.5])
    shape = solver.equilibrium(at)
    jacobian = solver.jacobian(shape)
    assert jacobian.shape == (3, len(model.body.nodes), 2)
    for muscle in range(3):
        step = 1e-3 * np.eye(3)[muscle]
        difference = (solver.equilibrium(at + step).positions - solver.equilibrium(at - step).positions) / 2e-3
        assert np.abs(difference - jacobian[muscle]).max() < 1e-6 * np.abs(jacobian[muscle]).max()
    cotangent = np.random.default_rng(1).normal(size=shape.positions.shape)
    np.testing.assert_allclose(solver.vjp(shape, cotangent), np.einsum("mnd,nd->m", jacobian, cotangent), rtol=1e-12)


def test_own_observations_give_back_the_tensions(model: tf.Assembly) -> None:
    shape = model.solver().equilibrium([12.0, 11.5, 4.5])
    seen = [tf.Observation(model.length(name), shape.length(name), 0.3e-3) for name in MUSCLES]
    estimate = tf.InverseProblem(model, seen).fit()
    assert estimate.is_trustworthy and estimate.undetermined == 0
    for name, tension in zip(MUSCLES, [12.0, 11.5, 4.5], strict=True):
        assert estimate.tension(name) == pytest.approx(tension, abs=1e-3)
    known = tf.InverseProblem(model, seen).with_tension("GGa", 12.0).with_bounds("SGm", 0.0, 20.0)
    freed = known.free_bone("hyoid", 10e-3).with_bone_prior("hyoid", 2e-3).fit()
    assert np.abs(freed.displacement("hyoid")).max() < 1e-4
    np.testing.assert_allclose(estimate.simulated, [o.measured for o in seen], atol=1e-8)


def test_what_is_observed_has_the_gradient_of_differences(model: tf.Assembly) -> None:
    positions = model.solver().equilibrium([12.0, 11.5, 4.5]).positions
    outside = positions[model.body.triangles.ravel()].max(axis=0) + 5e-3
    direction = np.random.default_rng(2).normal(size=positions.shape)
    for observable in (model.length("GGa"), model.stretch("HGa"), model.ratio("SGm", "GGa"), model.contour(list(outside))):
        slope = float((observable.gradient(positions) * direction).sum())
        step = 1e-7
        difference = (observable.value(positions + step * direction) - observable.value(positions - step * direction)) / (2 * step)
        assert slope == pytest.approx(difference, rel=1e-5, abs=1e-6)


def test_a_motion_ends_where_it_leads(model: tf.Assembly) -> None:
    motion = model.trajectory({"GGa": 12.0}, 0.2, samples=5)
    with pytest.raises(tf.Error, match="GGx"):
        model.trajectory({"GGa": 12.0}, 0.2, samples=0).lengths("GGx")
    assert motion.times.tolist() == pytest.approx([0.0, 0.05, 0.1, 0.15, 0.2])
    assert motion.positions.shape == (5, len(model.body.nodes), 2)
    np.testing.assert_allclose(motion.positions[0], model.body.nodes, rtol=1e-14)
    assert motion.lengths("GGa")[-1] < motion.lengths("GGa")[0]
    assert motion.part_of_way is not None and 0.0 < motion.part_of_way < 1.0


def test_arrays_are_copies_that_may_be_written_to(model: tf.Assembly) -> None:
    shape = model.solver().equilibrium([12.0, 11.5, 4.5])
    first = shape.positions
    first[:] = 0.0
    assert np.abs(shape.positions).max() > 0.0


def test_long_work_lets_others_run(model: tf.Assembly) -> None:
    counted = 0
    done = threading.Event()

    def count() -> None:
        nonlocal counted
        while not done.is_set():
            counted += 1
            time.sleep(1e-4)

    other = threading.Thread(target=count)
    other.start()
    tf.batch(tf.Dataset.reference(), subjects=["S2"], progress=False)
    done.set()
    other.join()
    assert counted > 10


def test_solvers_in_threads_give_the_same_bits(model: tf.Assembly) -> None:
    loads = [np.array([n, 11.5, 4.5]) for n in range(8)]
    alone = model.solver()
    expected = [alone.equilibrium(load).positions for load in loads]
    found: dict[int, np.ndarray] = {}

    def work(start: int) -> None:
        solver = model.solver()
        for n in range(start, 8, 2):
            found[n] = solver.equilibrium(loads[n]).positions

    threads = [threading.Thread(target=work, args=(start,)) for start in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all((found[n] == expected[n]).all() for n in range(8))

"""The programs in the bench solve the same problem: from the mesh that the program prints they find the same positions, and the derivatives
of their energies are those of JAX."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import tongue_fit as tf

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "bench"))
MUSCLES = ["GGa", "SGm", "HGa"]


@pytest.mark.parametrize("load", [[12.0, 11.5, 4.5], [40.0, 5.0, 30.0]])
def test_three_programs_find_the_same_equilibrium(program: str, load: list[float]) -> None:
    from model import springs
    from with_jax import newton
    from with_scipy import Newton

    body, tensions = springs(program, MUSCLES), np.array(load)
    expected = tf.Model().assemble(tf.Body.tongue(), MUSCLES).solver().equilibrium(tensions).positions
    near = tf.Model().assemble(tf.Body.tongue(), MUSCLES).solver().equilibrium(0.97 * tensions).positions
    start = body.rest.copy()
    start[body.free] = near[body.free]
    by_scipy, _ = Newton(body).solve(tensions, start, 1e-9)
    by_jax, _ = newton(body, 1e-9)(tensions, start)
    for found in (by_scipy, np.asarray(by_jax)):
        assert np.abs(found[body.free] - expected[body.free]).max() < 1e-10
    assert np.abs(near - expected).max() > 1e-5

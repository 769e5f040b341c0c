"""Newton's method in JAX, compiled as a whole: the derivatives of each spring and triangle by `jax.grad` and `jax.hessian`, all of them
at once by `vmap`, put into a dense matrix and solved by Cholesky's factorisation."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from model import Springs

jax.config.update("jax_enable_x64", True)


def newton(body: Springs, tolerance: float) -> Callable[[np.ndarray, np.ndarray], tuple[jax.Array, jax.Array]]:
    """(tensions, start) -> positions, m, and iterations."""
    ends, triangles, free = jnp.array(body.ends), jnp.array(body.triangles), jnp.array(body.free)
    stiffness, length, area = jnp.array(body.stiffness), jnp.array(body.length), jnp.array(body.area)
    pulls, count = jnp.array(body.pulls), 2 * len(body.free)
    # Entries of nodes on bone are placed behind the unknowns and cut off.
    place = np.where(body.unknown < 0, len(body.free), body.unknown)
    dofs = np.stack([2 * place, 2 * place + 1], -1)
    of_spring, of_cell = (jnp.array(dofs[n].reshape(len(n), -1)) for n in (body.ends, body.triangles))

    def spring(x: jax.Array, k: jax.Array, l0: jax.Array, pull: jax.Array) -> jax.Array:
        l = jnp.linalg.norm(x[2:] - x[:2])
        return 0.5 * k * (l - l0) ** 2 + pull * (l - l0)

    def cell(x: jax.Array, s0: jax.Array) -> jax.Array:
        u, v = x[2:4] - x[:2], x[4:] - x[:2]
        s = 0.5 * (u[0] * v[1] - u[1] * v[0])
        return 0.5 * body.kappa * ((s - s0) / s0) ** 2

    def both(of: Callable[..., jax.Array]) -> Callable[..., tuple[jax.Array, jax.Array]]:
        return jax.vmap(lambda *a: (jax.grad(of)(*a), jax.hessian(of)(*a)))

    def derivatives(x: jax.Array, pull: jax.Array) -> tuple[jax.Array, jax.Array]:
        g1, h1 = both(spring)(x[ends].reshape(-1, 4), stiffness, length, pull)
        g2, h2 = both(cell)(x[triangles].reshape(-1, 6), area)
        g = jnp.zeros(count + 2).at[of_spring].add(g1).at[of_cell].add(g2)
        h = jnp.zeros((count + 2, count + 2))
        h = h.at[of_spring[:, :, None], of_spring[:, None, :]].add(h1).at[of_cell[:, :, None], of_cell[:, None, :]].add(h2)
        return g[:count], h[:count, :count]

    @jax.jit
    def solve(tensions: jax.Array, start: jax.Array) -> tuple[jax.Array, jax.Array]:
        pull = tensions @ pulls
        largest = lambda g: jnp.linalg.norm(g.reshape(-1, 2), axis=1).max()  # noqa: E731

        def step(state: tuple[jax.Array, ...]) -> tuple[jax.Array, ...]:
            x, g, h, n = state
            moved = jax.scipy.linalg.cho_solve(jax.scipy.linalg.cho_factor(h), g)
            x = x.at[free].add(-moved.reshape(-1, 2))
            return (x, *derivatives(x, pull), n + 1)

        begin = (start, *derivatives(start, pull), 0)
        x, _, _, n = jax.lax.while_loop(lambda s: (largest(s[1]) > tolerance) & (s[3] < 50), step, begin)
        return x, n

    return solve

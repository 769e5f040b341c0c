"""The model inside JAX: positions as a function that can be differentiated and compiled, by `pure_callback` and `vjp`."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np

import tongue_fit as tf

jax.config.update("jax_enable_x64", True)


def positions_of(model: tf.Assembly) -> Callable[[jax.Array], jax.Array]:
    """Positions of all nodes (nodes, 2), m, as a function of the tensions in the order of `model.contracting`."""
    solver = model.solver()
    nodes, muscles = (len(model.body.nodes), 2), (len(model.contracting),)

    def solve(tensions: np.ndarray) -> np.ndarray:
        return solver.equilibrium(np.asarray(tensions)).positions

    def pull(tensions: np.ndarray, cotangent: np.ndarray) -> np.ndarray:
        return solver.vjp(solver.equilibrium(np.asarray(tensions)), np.asarray(cotangent))

    @jax.custom_vjp
    def positions(tensions: jax.Array) -> jax.Array:
        return jax.pure_callback(solve, jax.ShapeDtypeStruct(nodes, jnp.float64), tensions, vmap_method="sequential")

    def backward(tensions: jax.Array, cotangent: jax.Array) -> tuple[jax.Array]:
        result = jax.ShapeDtypeStruct(muscles, jnp.float64)
        return (jax.pure_callback(pull, result, tensions, cotangent, vmap_method="sequential"),)

    positions.defvjp(lambda tensions: (positions(tensions), tensions), backward)
    return positions


model = tf.Model().assemble(tf.Body.tongue(), ["GGa", "SGm", "HGa"])
positions = positions_of(model)
tip = int(model.body.nodes[:, 0].argmin())
height = jax.jit(lambda tensions: 1e3 * positions(tensions)[tip, 1])
slope = jax.jit(jax.grad(height))(jnp.array([12.0, 11.5, 4.5]))
print("the tip rises, mm for a newton per metre:", dict(zip(model.contracting, slope.round(4).tolist(), strict=True)))
step = 1e-3 * jnp.eye(3)
at = jnp.array([12.0, 11.5, 4.5])
difference = jnp.array([(height(at + s) - height(at - s)) / 2e-3 for s in step])
assert jnp.abs(slope - difference).max() < 1e-6 * jnp.abs(slope).max()

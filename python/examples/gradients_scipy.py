"""A search of one's own with scipy: tensions whose muscles have given lengths, with exact gradients by `vjp`."""

import numpy as np
from scipy.optimize import minimize

import tongue_fit as tf

muscles = ["GGa", "SGm", "HGa"]
model = tf.Model().assemble(tf.Body.tongue(), muscles)
solver, lengths = model.solver(), [model.length(name) for name in muscles]
wanted = np.array([solver.equilibrium([12.0, 11.5, 4.5]).length(name) for name in muscles])


def misfit(tensions: np.ndarray) -> tuple[float, np.ndarray]:
    """Half the sum of squares of the lengths that are missed, mm², and its gradient."""
    shape = solver.equilibrium(tensions)
    missed = 1e3 * (np.array([shape.length(name) for name in muscles]) - wanted)
    slope = sum(m * 1e3 * length.gradient(shape.positions) for m, length in zip(missed, lengths, strict=True))
    return 0.5 * missed @ missed, solver.vjp(shape, slope)


found = minimize(misfit, np.full(3, 5.0), jac=True, method="L-BFGS-B", bounds=[(0.0, 100.0)] * 3, options={"ftol": 1e-15, "gtol": 1e-9})
print(dict(zip(muscles, found.x.round(4), strict=True)), f"after {found.nfev} equilibria")
assert np.abs(found.x - [12.0, 11.5, 4.5]).max() < 1e-2

"""Solves a neo-Hookean body of six-node triangles with scikit-fem, independently of tongue-fit.

Reads JSON from stdin: nodes_m, triangles, lambda, mu, held [[x, y, ux, uy], ...], loads [[x, y, fx, fy], ...], tolerance (N), repeats. Prints
JSON: places and displacements of all nodes, m, the median time of a solve, s, its Newton iterations, and the steps in which it was loaded.
"""
import json, sys, time
import numpy as np
from skfem import Basis, BilinearForm, DiscreteField, ElementTriP2, ElementVector, LinearForm, MeshTri, condense, solve
from skfem.helpers import ddot, det, grad, inv, transpose
from skfem.utils import solver_direct_scipy

given = json.load(sys.stdin)
lam, mu = given["lambda"], given["mu"]
mesh = MeshTri(np.array(given["nodes_m"]).T, np.array(given["triangles"]).T)
basis = Basis(mesh, ElementVector(ElementTriP2()), intorder=2)
places = basis.doflocs.T
eye = np.eye(2)
# The fastest of scipy's orderings for these matrices.
solver = solver_direct_scipy(permc_spec="MMD_AT_PLUS_A")


@BilinearForm
def stiffness(u, v, w):
    return np.einsum("ijkl...,kl...,ij...->...", w["moduli"], grad(u), grad(v))


@LinearForm
def force(v, w):
    return ddot(w["stress"], grad(v))


def law(f):
    """Stress and moduli at all points, once for all pairs of shape functions."""
    log, g = np.log(det(f)), transpose(inv(f))
    stress = mu * f + (lam * log - mu) * g
    moduli = mu * np.einsum("ik,jl->ijkl", eye, eye)[..., None, None]
    moduli = moduli + lam * np.einsum("ij...,kl...->ijkl...", g, g)
    moduli = moduli + (mu - lam * log) * np.einsum("il...,kj...->ijkl...", g, g)
    return DiscreteField(stress), DiscreteField(moduli)


def component(dof):
    return 0 if dof in first else 1


def key(x, y):
    return round(x * 1e9), round(y * 1e9)


# Of the dofs of a corner and of the middle of a side the first are along x.
first = set(basis.nodal_dofs[0]) | set(basis.facet_dofs[0])
held = {key(x, y): (ux, uy) for x, y, ux, uy in given["held"]}
loads = {key(x, y): (fx, fy) for x, y, fx, fy in given["loads"]}
fixed, values, external = [], [], np.zeros(basis.N)
for dof, (x, y) in enumerate(places):
    external[dof] = loads[key(x, y)][component(dof)]
    if key(x, y) in held:
        fixed.append(dof)
        values.append(held[key(x, y)][component(dof)])
assert len(fixed) == 2 * len(held), (len(fixed), len(held))
fixed, values = np.array(fixed), np.array(values)
free = np.setdiff1d(np.arange(basis.N), fixed)


def newton(steps):
    """Solves from rest in a number of steps and returns the iterations; None if an element is inverted."""
    u, solves = np.zeros(basis.N), 0
    for step in range(1, steps + 1):
        u_held = values * step / steps
        change = np.inf
        for _ in range(40):
            f = grad(basis.interpolate(u)) + eye[:, :, None, None]
            if det(f).min() <= 0:
                return None
            stress, moduli = law(f)
            residual = external * step / steps - force.assemble(basis, stress=stress)
            there = np.array_equal(u[fixed], u_held)
            # The residual of a node is at most sqrt 2 times that of a component.
            if there and (np.abs(residual[free]).max() * np.sqrt(2) <= given["tolerance"] or change < 1e-15):
                break
            start = np.zeros(basis.N)
            start[fixed] = u_held - u[fixed]
            matrix = stiffness.assemble(basis, moduli=moduli)
            du = solve(*condense(matrix, residual, x=start, D=fixed), solver=solver)
            u, change, solves = u + du, np.abs(du).max(), solves + 1
            u[fixed] = u_held
    return u, solves


# In as few steps as will do, whose time alone counts.
steps = next(n for n in (1, 2, 4, 8, 16) if newton(n) is not None)
seconds = []
for _ in range(given["repeats"]):
    clock = time.perf_counter()
    u, iterations = newton(steps)
    seconds.append(time.perf_counter() - clock)
shift = {}
for dof, place in enumerate(places):
    shift.setdefault(tuple(place), [0.0, 0.0])[component(dof)] = u[dof]
rows = [[x, y, ux, uy] for (x, y), (ux, uy) in shift.items()]
found = {"rows": rows, "seconds": float(np.median(seconds)), "iterations": iterations, "steps": steps}
json.dump(found, sys.stdout)

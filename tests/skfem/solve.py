"""Solves a neo-Hookean body of six-node triangles with scikit-fem, independently of tongue-fit.

Reads JSON from stdin: nodes_m, triangles, lambda, mu, held [[x, y, ux, uy], ...]. Prints JSON: places and displacements of all nodes, m,
and the time of the last of the Newton solves, s.
"""
import json, sys, time
import numpy as np
from skfem import Basis, BilinearForm, ElementTriP2, ElementVector, LinearForm, MeshTri, condense, solve
from skfem.helpers import ddot, det, grad, inv, trace, transpose

given = json.load(sys.stdin)
lam, mu = given["lambda"], given["mu"]
mesh = MeshTri(np.array(given["nodes_m"]).T, np.array(given["triangles"]).T)
basis = Basis(mesh, ElementVector(ElementTriP2()), intorder=2)
places = basis.doflocs.T


def product(a, b):
    return np.einsum("ij...,jk...->ik...", a, b)


def strained(w):
    f = grad(w["u"]) + np.eye(2)[:, :, None, None]
    return f, np.log(det(f)), inv(f)


@BilinearForm
def stiffness(u, v, w):
    f, log, g = strained(w)
    df, turned = grad(u), transpose(g)
    dp = mu * df + lam * trace(product(g, df)) * turned
    dp = dp + (mu - lam * log) * product(product(turned, transpose(df)), turned)
    return ddot(dp, grad(v))


@LinearForm
def force(v, w):
    f, log, g = strained(w)
    return ddot(mu * f + (lam * log - mu) * transpose(g), grad(v))


def component(dof):
    return 0 if dof in first else 1


# Which dof is x and which y: a field of ones in one direction tells.
first = set(np.flatnonzero(basis.project(lambda x: np.array([1.0 + 0 * x[0], 0 * x[0]])) > 0.5))
held = {(round(x * 1e9), round(y * 1e9)): (ux, uy) for x, y, ux, uy in given["held"]}
fixed, values = [], []
for dof, (x, y) in enumerate(places):
    key = (round(x * 1e9), round(y * 1e9))
    if key in held:
        fixed.append(dof)
        values.append(held[key][component(dof)])
assert len(fixed) == 2 * len(held), (len(fixed), len(held))
fixed, values = np.array(fixed), np.array(values)

u, steps = np.zeros(basis.N), 8
clock = time.perf_counter()
for step in range(1, steps + 1):
    for iteration in range(40):
        field = basis.interpolate(u)
        residual = -force.assemble(basis, u=field)
        change = np.zeros(basis.N)
        change[fixed] = values * step / steps - u[fixed]
        change = solve(*condense(stiffness.assemble(basis, u=field), residual, x=change, D=fixed))
        u += change
        if np.abs(change).max() < 1e-15:
            break
seconds = time.perf_counter() - clock
shift = {}
for dof, place in enumerate(places):
    shift.setdefault(tuple(place), [0.0, 0.0])[component(dof)] = u[dof]
rows = [[x, y, ux, uy] for (x, y), (ux, uy) in shift.items()]
json.dump({"rows": rows, "seconds": seconds}, sys.stdout)

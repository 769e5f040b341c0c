"""Newton's method in numpy and scipy: exact forces and stiffness in arrays, scipy's sparse factorisation."""

from __future__ import annotations

import numpy as np
from model import Springs, area_of
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu


class Newton:
    """Makes once what is the same in every solve."""

    def __init__(self, body: Springs) -> None:
        self.body = body
        dofs = np.repeat(2 * body.unknown, 2) + np.tile([0, 1], len(body.rest))
        dofs[np.repeat(body.unknown < 0, 2)] = -1
        self.dofs = dofs.reshape(-1, 2)
        of_spring = self.dofs[body.ends].reshape(-1, 4)
        of_cell = self.dofs[body.triangles].reshape(-1, 6)
        pairs = [(np.repeat(d, d.shape[1], 1).ravel(), np.tile(d, d.shape[1]).ravel()) for d in (of_spring, of_cell)]
        rows, columns = (np.concatenate([p[i] for p in pairs]) for i in range(2))
        self.kept = (rows >= 0) & (columns >= 0)
        self.rows, self.columns = rows[self.kept], columns[self.kept]
        self.count = 2 * len(body.free)
        # The second derivative of an area is constant.
        turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
        corner = np.array([[0, 1, -1], [-1, 0, 1], [1, -1, 0]])
        self.bend = 0.5 * np.kron(corner, turn)

    def solve(self, tensions: np.ndarray, start: np.ndarray, tolerance: float) -> tuple[np.ndarray, int]:
        """Positions (m) and iterations from positions near the equilibrium; `tolerance` is the largest residual force on a node, N."""
        body, x = self.body, start.copy()
        pull = tensions @ body.pulls
        for iteration in range(50):
            way = x[body.ends[:, 1]] - x[body.ends[:, 0]]
            length = np.linalg.norm(way, axis=1)
            unit = way / length[:, None]
            force = body.stiffness * (length - body.length) + pull
            area = area_of(x, body.triangles)
            pressure = body.kappa * (area - body.area) / body.area**2
            corners = x[body.triangles]
            edge = np.roll(corners, -1, 1) - np.roll(corners, 1, 1)
            slope = 0.5 * np.stack([-edge[..., 1], edge[..., 0]], -1)
            slope = -slope
            gradient = np.zeros_like(x)
            np.add.at(gradient, body.ends[:, 0], -force[:, None] * unit)
            np.add.at(gradient, body.ends[:, 1], force[:, None] * unit)
            np.add.at(gradient, body.triangles, pressure[:, None, None] * slope)
            residual = gradient[body.free]
            if np.linalg.norm(residual, axis=1).max() < tolerance:
                return x, iteration
            lateral = force / length
            block = (body.stiffness - lateral)[:, None, None] * unit[:, :, None] * unit[:, None, :] + lateral[:, None, None] * np.eye(2)
            spring = np.block([[block, -block], [-block, block]])
            flat = slope.reshape(-1, 6)
            cell = (body.kappa / body.area**2)[:, None, None] * flat[:, :, None] * flat[:, None, :] + pressure[:, None, None] * self.bend
            values = np.concatenate([spring.ravel(), cell.ravel()])[self.kept]
            stiffness = csc_matrix((values, (self.rows, self.columns)), shape=(self.count, self.count))
            x[body.free] -= splu(stiffness, permc_spec="MMD_AT_PLUS_A").solve(residual.ravel()).reshape(-1, 2)
        raise RuntimeError("no equilibrium")

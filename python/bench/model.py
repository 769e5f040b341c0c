"""The spring model of a body as plain arrays, for programs that are compared: what the energy consists of, and nothing of tongue-fit's
way to solve it.

E(x) = sum 1/2 k (l - l0)² + sum F (l - l0) + sum 1/2 kappa ((S - S0)/S0)²; parts of muscles outside the tissue are one straight spring.
"""

from __future__ import annotations

import json
import subprocess
from dataclasses import dataclass

import numpy as np


@dataclass
class Springs:
    """Numbers of nodes are positions in `rest`; `free` has the nodes that move, `unknown` the position of each among the unknowns, or -1."""

    rest: np.ndarray  # (nodes, 2), m
    free: np.ndarray
    unknown: np.ndarray
    ends: np.ndarray  # (springs, 2)
    stiffness: np.ndarray  # N/m
    length: np.ndarray  # m
    pulls: np.ndarray  # (muscles, springs): how often a spring is part of a contracting muscle
    triangles: np.ndarray
    area: np.ndarray  # m²
    kappa: float  # J


def area_of(x: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (x[triangles[:, i]] for i in range(3))
    u, v = b - a, c - a
    return 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def springs(program: str, contracting: list[str]) -> Springs:
    """The model of the reference tongue, from the output of `tongue-fit mesh --json`."""
    printed = subprocess.run([program, "mesh", "--json"], capture_output=True, check=True)
    mesh = json.loads(printed.stdout)
    rest, triangles = np.array(mesh["nodes_m"]), np.array(mesh["triangles"])
    held = set(mesh["fixed"])
    of = {tuple(sorted(c["nodes"])): (c["rest_length_m"], c["stiffness_n_per_m"]) for c in mesh["connections"]}
    degree = np.bincount(np.array(list(of)).ravel(), minlength=len(rest))
    in_tissue = np.isin(np.arange(len(rest)), triangles)
    inner = {n for n in range(len(rest)) if not in_tissue[n] and degree[n] == 2 and n not in held}
    # The inner nodes of muscles outside the tissue are left out.
    chains: dict[str, list[tuple[int, int]]] = {}
    for name, chain in mesh["muscles"].items():
        links, start, rest_length, compliance = [], chain[0], 0.0, 0.0
        for a, b in zip(chain, chain[1:]):
            length, k = of[tuple(sorted((a, b)))]
            rest_length, compliance = rest_length + length, compliance + 1.0 / k
            if b not in inner:
                pair = tuple(sorted((start, b)))
                of.setdefault(pair, (rest_length, 1.0 / compliance))
                links.append(pair)
                start, rest_length, compliance = b, 0.0, 0.0
        chains[name] = links
    kept = [pair for pair in of if not inner & set(pair)]
    number = {pair: i for i, pair in enumerate(kept)}
    pulls = np.zeros((len(contracting), len(kept)))
    for m, name in enumerate(contracting):
        for pair in chains[name]:
            pulls[m, number[pair]] += 1.0
    free = np.array([n for n in range(len(rest)) if n not in held and n not in inner])
    unknown = np.full(len(rest), -1)
    unknown[free] = np.arange(len(free))
    return Springs(
        rest, free, unknown, np.array(kept), np.array([of[p][1] for p in kept]), np.array([of[p][0] for p in kept]),
        pulls, triangles, area_of(rest, triangles), mesh["kappa_s_j"],
    )  # fmt: skip

"""One equilibrium of the same spring tongue by Rust, by the module, by JAX and by scipy, side by side in one run.

    cargo build --release -p tongue-fit-python --example warm --features pyo3/extension-module
    python python/bench/compare.py [--write python/bench/results.md]

Warm: tensions go back and forth between two that differ by 3 %, each solve from the shape of the one before. Every program is given
the same tensions and the same tolerance, and has to end at the same positions.
"""

from __future__ import annotations

import os
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from model import springs
from with_jax import newton
from with_scipy import Newton

import tongue_fit as tf

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("TONGUE_FIT", str(ROOT / "target/release/tongue-fit"))
WARM = ROOT / "target/release/examples/warm"
MUSCLES = ["GGa", "SGm", "HGa"]
LOADS = [np.array([12.0, 11.5, 4.5]), np.array([12.3, 11.3, 4.7])]
#: Residual force on a node, N per metre, at which the other programs stop; that of tongue-fit is smaller.
TOLERANCE = 1e-6


def microseconds(solve: Callable[[int], object], batch: int) -> float:
    """Median over batches of the time of one solve."""
    times = []
    for _ in range(15):
        began = time.perf_counter()
        for n in range(batch):
            solve(n)
        times.append((time.perf_counter() - began) / batch)
    return 1e6 * statistics.median(times)


def main() -> None:
    model = tf.Model().assemble(tf.Body.tongue(), MUSCLES)
    solver, shape = model.solver(), model.solver().equilibrium(LOADS[0])
    body = springs(PROGRAM, MUSCLES)
    expected = [model.solver().equilibrium(load).positions for load in LOADS]
    starts = [body.rest.copy() for _ in LOADS]
    for start, positions in zip(starts, expected, strict=True):
        start[body.free] = positions[body.free]

    state = {"shape": shape, "scipy": starts[0], "jax": starts[0]}

    def module(n: int) -> None:
        state["shape"] = solver.equilibrium_from(state["shape"], LOADS[(n + 1) % 2])

    def module_with_arrays(n: int) -> None:
        module(n)
        state["shape"].positions

    by_scipy, by_jax = Newton(body), newton(body, TOLERANCE)
    iterations = {}

    def scipy(n: int) -> None:
        state["scipy"], iterations["scipy"] = by_scipy.solve(LOADS[(n + 1) % 2], state["scipy"], TOLERANCE)

    def jax(n: int) -> None:
        state["jax"], iterations["jax"] = by_jax(LOADS[(n + 1) % 2], state["jax"])
        state["jax"].block_until_ready()

    # All programs find the same positions.
    for n in range(4):
        module(n), scipy(n), jax(n)
        for found in (state["shape"].positions, state["scipy"], np.asarray(state["jax"])):
            off = np.abs(found[body.free] - expected[(n + 1) % 2][body.free]).max()
            assert off < 1e-9, f"{off} m"

    rows: list[tuple[str, float]] = []
    for _ in range(3):
        rust = float(subprocess.run([str(WARM)], capture_output=True, text=True, check=True).stdout)
        rows.append(("Rust (`Solver::equilibrium_from`)", rust))
        rows.append(("Python (`Solver.equilibrium_from`)", microseconds(module, 500)))
        rows.append(("the same, and the positions as an array", microseconds(module_with_arrays, 500)))
        rows.append((f"JAX, compiled ({iterations['jax']} iterations)", microseconds(jax, 20)))
        rows.append((f"numpy and scipy ({iterations['scipy']} iterations)", microseconds(scipy, 20)))
    # The smallest of three medians, because of other load on the machine.
    best = {name: min(t for other, t in rows if other == name) for name, _ in rows}
    python = best["Python (`Solver.equilibrium_from`)"]
    lines = [
        f"One warm equilibrium of the reference tongue ({2 * len(body.free)} unknowns), {platform.processor() or platform.machine()}, "
        f"{os.cpu_count()} cores, tongue-fit {tf.VERSION}, Python {platform.python_version()}:",
        "",
        "| by | µs | times that of Python |",
        "|---|---|---|",
        *(f"| {name} | {t:.1f} | {t / python:.2f} |" for name, t in best.items()),
        "",
    ]
    text = "\n".join(lines)
    print(text)
    if sys.argv[1:2] == ["--write"]:
        command = f"<!-- made by: python python/bench/compare.py --write; tongue-fit {tf.VERSION} -->\n"
        Path(sys.argv[2]).write_text(command + text, encoding="utf-8")


if __name__ == "__main__":
    main()

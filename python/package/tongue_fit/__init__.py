"""tongue-fit: the tensions of tongue muscles from their lengths.

A thin layer over the Rust library. Names and units are those of Rust: SI units, or millimetres in names with `_mm`; tensions are newtons
per metre of thickness, because the model is a plane. Arrays are numpy's: positions have the shape (nodes, 2), tensions the order of
`Assembly.contracting`. Invalid input raises `tongue_fit.Error` (a ValueError) that names the argument, and an argument that a function
does not have raises Python's TypeError. Other threads run during a solve; fits, batches and motions stop on Ctrl-C.

    import tongue_fit as tf

    data = tf.Dataset.reference()                      # or tf.dataset(frame), of pandas
    fits = tf.batch(data, target="stretch").frame()    # every row
    model = tf.Model().assemble(tf.Body.tongue(), ["GGa", "SGm", "HGa"])
    shape = model.solver().equilibrium({"GGa": 12.0, "SGm": 11.5, "HGa": 4.5})
    shape.positions, model.body.triangles              # arrays for matplotlib's tripcolor
"""

from __future__ import annotations

from . import options
from ._tongue_fit import (
    VERSION,
    Assembly,
    Body,
    Dataset,
    Error,
    Estimate,
    InverseProblem,
    Model,
    Observable,
    Observation,
    Shape,
    Solver,
    Target,
    Trajectory,
)
from .posterior import Posterior, posterior
from .program import Run, adapt, check, run, scene, sound, track, validate
from .rows import Batch, Fit, batch, dataset, fit, merge

# VERSION also has the commit, which the version of a Python package cannot have.
__version__ = VERSION.split()[0]
__all__ = [
    "VERSION",
    "Assembly",
    "Batch",
    "Body",
    "Dataset",
    "Error",
    "Estimate",
    "Fit",
    "InverseProblem",
    "Model",
    "Observable",
    "Observation",
    "Posterior",
    "Run",
    "Shape",
    "Solver",
    "Target",
    "Trajectory",
    "adapt",
    "batch",
    "check",
    "dataset",
    "fit",
    "merge",
    "options",
    "posterior",
    "run",
    "scene",
    "sound",
    "track",
    "validate",
]

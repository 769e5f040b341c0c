"""The Rust side of tongue_fit: SI units, tensions in newtons per metre of thickness."""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, Protocol, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

VERSION: str

_Floats: TypeAlias = NDArray[np.float64]
_Numbers: TypeAlias = NDArray[np.int64]
_Listed: TypeAlias = Sequence[float] | NDArray[np.floating[Any]] | NDArray[np.integer[Any]]
_Tensions: TypeAlias = Mapping[str, float] | _Listed | _Labelled
_Pair: TypeAlias = Mapping[str, float] | _Listed | _Labelled
_Points: TypeAlias = Sequence[Sequence[float]] | NDArray[np.floating[Any]] | NDArray[np.integer[Any]] | _Labelled
_Names: TypeAlias = str | Sequence[str]
_Method: TypeAlias = Literal["nelder-mead", "gauss-newton"]

class _Labelled(Protocol):
    """Labelled numbers: a Series or a DataFrame of pandas, a DataArray of xarray."""

    def to_numpy(self) -> Any: ...

class Error(ValueError):
    """Input that cannot be used: what is wrong, where, and what to do."""

@final
class Body:
    """A tongue in the midsagittal plane: nodes, triangles, named muscles and named bones. SI units."""

    def __copy__(self) -> Body: ...
    def __deepcopy__(self, _memo: Any) -> Body: ...
    def __hash__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...

    @staticmethod
    def tongue(spacing_m: float = 0.0055) -> Body:
        """The reference tongue with the mesh spacing `spacing_m`, m (the thesis's is 5.5 mm)."""
    @staticmethod
    def continuum(spacing_m: float = 0.004) -> Body:
        """The reference tongue as a continuum of quadratic elements with the mesh spacing `spacing_m`, m."""
    @staticmethod
    def from_anatomy(toml: str, spacing_m: float = 0.0055, origin: str = "anatomy") -> Body:
        """A tongue of an anatomy (`toml`, the text of the file) with the mesh spacing `spacing_m`, m; `origin` is its name in messages."""
    @staticmethod
    def read(path: str | PathLike[str], unit: Literal["m", "mm"] = "m") -> Body:
        """A body from the file `path`: Gmsh's (`unit` of its coordinates: m or mm), or the JSON of
        `tongue-fit mesh --json` (.json). What the program notes on the file is a `UserWarning`."""
    @property
    def what(self) -> str:
        """A description in words."""
    @property
    def nodes(self) -> _Floats:
        """Positions of the nodes at rest, m, shape (nodes, 2): x backwards, y upwards."""
    @property
    def triangles(self) -> _Numbers:
        """Node numbers of every triangle, shape (triangles, 3)."""
    @property
    def connections(self) -> _Numbers:
        """Numbers of the two nodes of every connection, shape (connections, 2)."""
    @property
    def fixed(self) -> _Numbers:
        """Numbers of the nodes held by bone, ascending."""
    @property
    def muscles(self) -> dict[str, _Numbers]:
        """The chain of nodes of every muscle, from end to end; of several fibres the first."""
    @property
    def bones(self) -> dict[str, _Numbers]:
        """The nodes of every named bone."""
    @property
    def palate(self) -> _Floats | None:
        """The palate as a line of points, m, shape (points, 2); None if the body has none."""
    def _repr_svg_(self) -> str:
        """A picture for notebooks (SVG)."""

@final
class Model:
    """The model of a body: Young's modulus `young_modulus` of the tissue, Pa, and its Poisson's ratio `poisson_ratio`, below 0.5."""

    def __copy__(self) -> Model: ...
    def __deepcopy__(self, _memo: Any) -> Model: ...
    def __hash__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...

    def __new__(
        cls,
        *,
        young_modulus: float = 6900.0,
        poisson_ratio: float = 0.49,
    ) -> Model:
        """The model with these constants."""
    def assemble(self, body: Body, muscles: _Names) -> Assembly:
        """Makes `body` ready to be solved; the named muscles contract, and all others are passive tissue."""

@final
class Assembly:
    """A body of which some muscles can contract, ready to be solved. Threads may share it."""

    def __copy__(self) -> Assembly: ...
    def __deepcopy__(self, _memo: Any) -> Assembly: ...
    def __hash__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...

    @property
    def body(self) -> Body:
        """The body."""
    @property
    def contracting(self) -> list[str]:
        """Names of the muscles that can contract, in the given order, which is the order of all arrays of tensions."""
    def solver(self) -> Solver:
        """A solver of this assembly; each thread needs its own."""
    def trajectory(self, tensions: _Tensions, t_end_s: float, ramp_s: float = 0.0, samples: int = 101) -> Trajectory:
        """The motion from rest while the tensions grow to their values in `ramp_s` (s) and then stay, until `t_end_s`."""
    def length(self, muscle: str) -> Observable:
        """The length of a muscle, m, as an observable."""
    def stretch(self, muscle: str) -> Observable:
        """The length of a muscle over its length at rest, as an observable."""
    def ratio(self, muscle: str, over: str) -> Observable:
        """The length of a muscle over another's, as an observable."""
    def contour(self, point: _Pair) -> Observable:
        """The signed distance of a measured point (x, y), m, from the outline of the tissue, as an
        observable: positive outside."""
    def observations(self, target: Target) -> list[Observation]:
        """The observations of this body in a measured target: one for every fitted muscle."""

@final
class Solver:
    """Solves equilibria, one after another. Each thread needs its own, because a solve writes to it."""

    def equilibrium(self, tensions: _Tensions) -> Shape:
        """The equilibrium at these tensions (a dict by muscle, or an array in the order of Assembly.contracting), from rest. The result
        does not depend on earlier solves."""
    def equilibrium_from(self, start: Shape, tensions: _Tensions) -> Shape:
        """The equilibrium at these tensions, found from the earlier shape `start`, which is faster for small changes of the tensions."""
    def follow_from_rest(self, tensions: _Tensions) -> Shape:
        """The equilibrium at these tensions. The branch from rest is followed, too, to check that the shape lies on it (Shape.is_traced).
        Costs about twenty solves, or some 120 more where that branch ends."""
    def shift_bone(self, bone: str, shift: _Pair) -> None:
        """Displaces a bone by `shift` (x, y; m) from its place at rest in all later solves."""
    def jacobian(self, shape: Shape) -> _Floats:
        """Derivatives of the positions of the nodes of an equilibrium by each tension: shape (contracting muscles, nodes, 2)."""
    def vjp(self, shape: Shape, cotangent: _Points) -> _Floats:
        """The derivatives by the tensions (shape (contracting muscles,)) of a function whose derivatives by the positions of an
        equilibrium are `cotangent` (shape (nodes, 2)): the vector-Jacobian product."""

@final
class Shape:
    """A shape of a body under tensions."""

    @property
    def positions(self) -> _Floats:
        """Positions of all nodes, m, shape (nodes, 2)."""
    @property
    def assembly(self) -> Assembly:
        """The assembly of the shape."""
    @property
    def status(self) -> str:
        """How the solve ended: `converged`, or the reason why not."""
    @property
    def is_converged(self) -> bool:
        """Whether it is an equilibrium."""
    @property
    def is_traced(self) -> bool:
        """Whether the shape is known to lie on the branch of equilibria from rest."""
    @property
    def guarded(self) -> int:
        """Number of elements in which the barrier against inversion acts."""
    @property
    def iterations(self) -> int:
        """Newton iterations."""
    @property
    def energy_j(self) -> float:
        """Potential energy, J per metre of thickness."""
    def tension(self, muscle: str) -> float:
        """The tension of a muscle, N per metre of thickness."""
    def length(self, muscle: str) -> float:
        """The length of a muscle, the straight distance between its ends, m."""
    def rest_length(self, muscle: str) -> float:
        """The length of a muscle at rest, m."""
    def stretch(self, muscle: str) -> float:
        """The length of a muscle over its length at rest: below 1 if it shortened."""
    def ratio(self, muscle: str, over: str) -> float:
        """The length of a muscle over another's."""
    def record(self) -> dict[str, Any]:
        """The output of `tongue-fit simulate --json` as a dict: `lengths_mm`, `ratios`, `stretches`,
        `positions_m`, `alarms` and so on."""
    def picture(self, title: str = "Tongue at rest (grey) and deformed") -> str:
        """A picture (SVG) with a `title`: the tissue at rest and deformed, and the muscles with their names."""
    def vtu(self) -> str:
        """Shape and tensions for ParaView (VTU)."""
    def _repr_svg_(self) -> str:
        """A picture for notebooks (SVG)."""

@final
class Trajectory:
    """The motion of a body from rest, at equidistant times."""

    @property
    def times(self) -> _Floats:
        """Times, s, shape (times,)."""
    @property
    def positions(self) -> _Floats:
        """Positions of all nodes at each time, m, shape (times, nodes, 2)."""
    @property
    def part_of_way(self) -> float | None:
        """Part of the way to equilibrium that the body has moved at the end; None if the way is not known."""
    def lengths(self, muscle: str) -> _Floats:
        """The length of a muscle at each of the times, m, shape (times,)."""

@final
class Observable:
    """A number computed from the positions of the nodes of one body."""

    def __eq__(self, other: object, /) -> bool: ...

    def value(self, positions: _Points) -> float:
        """The number at these positions of all nodes, m, shape (nodes, 2)."""
    def gradient(self, positions: _Points) -> _Floats:
        """Its derivatives by the positions of all nodes, unit of the value per m, shape (nodes, 2)."""

@final
class Observation:
    """A measurement: an `observable` has the value `measured`, in its unit. Its residual is divided by `standard_deviation` (same unit,
    default: not divided)."""

    def __eq__(self, other: object, /) -> bool: ...

    def __new__(cls, observable: Observable, measured: float, standard_deviation: float | None = None) -> Observation:
        """The observation of this value."""
    @property
    def measured(self) -> float:
        """The measured value, unit of the observable."""

@final
class InverseProblem:
    """The `observations` of a body, and its unknowns: at first the tensions of the contracting muscles of the `assembly`, N per metre of
    thickness, up to `upper_bound`. The search (`method`) starts at `starts` points. Every `with_` and `free_` method returns another
    problem."""

    def __new__(
        cls,
        assembly: Assembly,
        observations: Sequence[Observation],
        *,
        method: _Method = "gauss-newton",
        starts: int = 4,
        upper_bound: float = 100.0,
    ) -> InverseProblem:
        """The problem in which only the tensions are unknown."""
    def with_tension(self, muscle: str, tension: float) -> InverseProblem:
        """The problem with a known `tension` of a `muscle`, N per metre of thickness."""
    def with_bounds(self, muscle: str, lower: float, upper: float) -> InverseProblem:
        """The problem with the bounds `lower` and `upper` of the tension of a `muscle`, N per metre of thickness."""
    def with_prior(self, muscle: str, mean: float, sd: float) -> InverseProblem:
        """The problem with a normal prior of the tension of a `muscle`: its `mean` and standard deviation `sd`, N per metre of thickness."""
    def free_bone(self, bone: str, most: float) -> InverseProblem:
        """The problem with the displacement of a bone as an unknown, of at most `most` (m) in both
        directions of each axis."""
    def with_bone_prior(self, bone: str, sd: float) -> InverseProblem:
        """The problem with a normal prior of the displacement of a free `bone`: its standard deviation `sd` along each axis, m."""
    def free_young_modulus(self, lower: float, upper: float) -> InverseProblem:
        """The problem with Young's modulus as an unknown between `lower` and `upper`, Pa."""
    def free_poisson_ratio(self, lower: float, upper: float) -> InverseProblem:
        """The problem with Poisson's ratio as an unknown between `lower` and `upper`."""
    def fit(self, *, threads: int | None = None) -> Estimate:
        """Searches for the best fit of the observations on `threads` threads (default: one for each core).
        The result has the same bits for any number of threads."""

@final
class Estimate:
    """The values of the unknowns with the best fit of the observations."""

    @property
    def status(self) -> str:
        """How the fit ended."""
    @property
    def is_trustworthy(self) -> bool:
        """Whether the observations are met by the shape to which the tensions lead from rest, under the published law."""
    @property
    def tensions(self) -> dict[str, float]:
        """The tensions of all contracting muscles, N per metre of thickness."""
    def tension(self, muscle: str) -> float:
        """The tension of a muscle, N per metre of thickness."""
    def displacement(self, bone: str) -> _Floats:
        """Displacement of a free bone from its place at rest, m, shape (2,)."""
    @property
    def undetermined(self) -> int | None:
        """Number of directions in which the unknowns can change without a worse fit; None if it is not known."""
    @property
    def simulated(self) -> _Floats:
        """The value of each observable in the fitted shape, in the order and units of the observations."""
    @property
    def shape(self) -> Shape:
        """The fitted shape."""
    def record(self) -> dict[str, Any]:
        """The whole answer as a dict."""
    def _repr_svg_(self) -> str:
        """A picture for notebooks (SVG)."""

@final
class Dataset:
    """Measured muscle lengths by subject and vowel."""

    def __copy__(self) -> Dataset: ...
    def __deepcopy__(self, _memo: Any) -> Dataset: ...
    def __hash__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...

    @staticmethod
    def reference() -> Dataset:
        """The lengths of Takano and Honda (2007): eight muscles of the subjects S1 to S4."""
    @staticmethod
    def from_path(path: str | PathLike[str]) -> Dataset:
        """The table in the file `path` (CSV)."""
    @staticmethod
    def from_text(text: str, origin: str = "text") -> Dataset:
        """The table in a text (CSV); `origin` is its name in messages."""
    def with_half_width_mm(self, mm: float) -> Dataset:
        """The same lengths with the half width `mm` of rounding for all of them."""
    @property
    def origin(self) -> str:
        """The origin of the data."""
    @property
    def muscles(self) -> list[str]:
        """The muscles, in the order of their columns."""
    @property
    def subjects(self) -> list[str]:
        """The subjects, in the order of their first rows."""
    @property
    def rows(self) -> list[tuple[str, str]]:
        """Subject and vowel of every row, in the order of the table."""
    @property
    def lengths_mm(self) -> _Floats:
        """The lengths, mm, shape (rows, muscles); NaN for missing values."""
    @property
    def broken(self) -> list[str]:
        """The faults of the rows and cells that cannot be used."""
    def vowels(self, subject: str) -> list[str]:
        """The vowels of a subject, in the order of the table."""
    def ratios(self, subject: str, vowel: str, *, muscles: _Names | None = None, baseline: str | None = None) -> Target:
        """The target of a fit of the ratios to GGa of the row of `subject` and `vowel`. `muscles` contract (default: those shorter than
        in the baseline); `baseline` is the vowel that is compared with (default: ɯ)."""
    def stretches(self, subject: str, vowel: str, *, muscles: _Names | None = None, baseline: str | None = None) -> Target:
        """The target of a fit of lengths over those in the baseline, with the arguments `subject`, `vowel`, `muscles` and `baseline` of `ratios`."""
    def __len__(self) -> int: ...
    def _repr_html_(self) -> str:
        """The table for notebooks."""

@final
class Target:
    """The target of a fit, made from one measured row and its baseline."""

    def __copy__(self) -> Target: ...
    def __deepcopy__(self, _memo: Any) -> Target: ...
    def __hash__(self) -> int: ...
    def __eq__(self, other: object, /) -> bool: ...

    @property
    def subject(self) -> str:
        """The subject."""
    @property
    def vowel(self) -> str:
        """The vowel."""
    @property
    def baseline(self) -> str:
        """The vowel it is compared with."""
    @property
    def kind(self) -> Literal["ratio", "stretch"]:
        """`ratio` or `stretch`."""
    @property
    def muscles(self) -> list[str]:
        """The muscles measured in both rows: the order of `values`."""
    @property
    def active(self) -> list[str]:
        """The muscles that contract."""
    @property
    def values(self) -> _Floats:
        """The measured quantity of all muscles, dimensionless, shape (muscles,)."""

def fit_row(
    data: Dataset,
    subject: str,
    vowel: str,
    *,
    target: Literal["ratio", "stretch"] = "ratio",
    muscles: _Names | None = None,
    baseline: str | None = None,
    body: Body | None = None,
    model: Model | None = None,
    method: _Method = "gauss-newton",
    verdict: bool = True,
    threads: int | None = None,
) -> tuple[dict[str, Any], str]:
    """Fits one row: the implementation of `tongue_fit.fit`, with the picture of the fitted shape (SVG)."""

def fit_rows(
    data: Dataset,
    subjects: _Names | None,
    vowels: _Names | None,
    target: str,
    baseline: str | None,
    baselines: dict[str, str],
    body: Body | None,
    model: Model | None,
    method: str,
    shard: str,
    threads: int | None,
    command: str,
    report: Callable[[int, int], object],
) -> tuple[int, list[tuple[int, str | None, str]], list[str]]:
    """The implementation of `tongue_fit.batch`: the fits of a `shard` of a table."""

def run_program(words: Sequence[str]) -> int:
    """Runs the program with a command line (its name first) and returns its exit status; wrong usage ends the process. Once in a process."""

def call_program(words: Sequence[str]) -> tuple[int, str, str]:
    """Runs a command line (the program's name first) within this process: the exit status, and what it printed on standard output and on
    standard error. After Ctrl-C it ends at its next report of progress."""

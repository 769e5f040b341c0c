"""The posterior of the tensions of one vowel, for numpy and ArviZ."""

from __future__ import annotations

import csv
import io
import re
import warnings
from typing import TYPE_CHECKING, Any

from . import _tongue_fit as native
from .options import Kind, Method, PosteriorOptions, check_value, documented
from .program import Run, _ran
from .rows import _measured

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from typing_extensions import Unpack

    _Arrays = dict[str, NDArray[np.float64]]

#: Columns of the program's `posterior.csv` by muscle: `tension_GGa_n_per_m` is muscle GGa of `tension_n_per_m`.
_BY_MUSCLE = re.compile(r"(tension|baseline_tension|change|stretch|log_likelihood)_(.+?)(_n_per_m)?")


class Posterior(Run):
    """The output and files of `tongue-fit --vowel V --posterior N`. If the chains have not mixed there are no intervals: `status` says so,
    and every access to the draws warns."""

    @property
    def status(self) -> str:
        """`mixed`, or why there are no intervals."""
        return str(self["posterior"]["status"])

    def _warn(self) -> None:
        if self.status != "mixed":
            warnings.warn("the chains have not mixed: these draws are not those of the posterior; take more draws", stacklevel=3)

    @property
    def _columns(self) -> tuple[list[str], NDArray[np.float64]]:
        import numpy as np

        rows = list(csv.reader(io.StringIO(self.files["posterior.csv"].decode())))
        # The columns after the numbers are version and command.
        names = rows[0][: rows[0].index("version")]
        table = np.array([[float(cell) for cell in row[: len(names)]] for row in rows[1:]])
        chains = len(set(table[:, 0]))
        return names, table[np.lexsort((table[:, 1], table[:, 0]))].reshape(chains, -1, len(names))

    @property
    def muscles(self) -> list[str]:
        """The muscles, in the order of the last axis of arrays."""
        found = (re.fullmatch(r"tension_(.+)_n_per_m", name) for name in self._columns[0])
        return [match[1] for match in found if match]

    @property
    def measured(self) -> list[str]:
        """The muscles whose stretch was measured, in the order of the last axis of `log_likelihood`."""
        return [name.removeprefix("log_likelihood_") for name in self._columns[0] if name.startswith("log_likelihood_")]

    @property
    def draws(self) -> _Arrays:
        """The draws: `tension_n_per_m`, `baseline_tension_n_per_m`, `change_n_per_m` and `stretch` with the shape (chains, draws,
        muscles), `hyoid_mm` with (chains, draws, 2)."""
        self._warn()
        return self._draws()

    def _draws(self) -> _Arrays:
        return {name: values for name, values in self._arrays().items() if name != "log_likelihood"}

    def _arrays(self) -> _Arrays:
        names, table = self._columns
        found: dict[str, list[int]] = {}
        for at, name in enumerate(names):
            if match := _BY_MUSCLE.fullmatch(name):
                found.setdefault(match[1] + (match[3] or ""), []).append(at)
            elif match := re.fullmatch(r"(hyoid)_[xy](_mm)", name):
                found.setdefault(match[1] + match[2], []).append(at)
        return {name: table[:, :, at] for name, at in found.items()}

    def _prior(self, draws: int) -> _Arrays:
        """Draws of the priors of tensions and hyoid, as the record has them."""
        import numpy as np

        priors, muscles, random = self["posterior"]["priors"], self.muscles, np.random.default_rng(1)
        tensions = {}
        for name, key in [("tension_n_per_m", "tension"), ("baseline_tension_n_per_m", "baseline")]:
            prior = priors[key]
            scale = 0.0 if prior.get("off") else prior["scale_n_per_m"]
            tensions[name] = np.abs(random.normal(0.0, scale, (1, draws, len(muscles))))
            known = {muscle.lower(): tension for muscle, tension in prior["fixed_n_per_m"].items()}
            for at, muscle in enumerate(muscles):
                # As in the program, case does not matter, and "*" stands for every muscle that is not named.
                fixed = known.get(muscle.lower(), known.get("*"))
                if fixed is not None:
                    tensions[name][:, :, at] = fixed
        hyoid = priors["hyoid"]
        shift = random.normal(0.0, 0.0 if hyoid["off"] else hyoid["sd_mm"], (1, draws, 2))
        shift = shift if hyoid["fixed_mm"] is None else np.broadcast_to(np.array(hyoid["fixed_mm"], float), shift.shape)
        change = tensions["tension_n_per_m"] - tensions["baseline_tension_n_per_m"]
        return {**tensions, "change_n_per_m": change, "hyoid_mm": shift}

    def to_dict(self) -> dict[str, _Arrays]:
        """The groups of ArviZ: `posterior`, `prior` (as many draws), `sample_stats` (the logarithm of the density, up to a constant),
        `observed_data` (the measured stretches), `log_likelihood` (of each stretch given all others, because their errors are correlated;
        Pareto k of `arviz.loo` is above 0.7 for many of them, so that models cannot be compared by it) and `constant_data` (Poisson's
        ratio)."""
        self._warn()
        return self._groups()

    def _groups(self) -> dict[str, _Arrays]:
        import numpy as np

        names, table = self._columns
        observed = [self["target_stretches"][muscle] for muscle in self.measured]
        return {
            "posterior": self._draws(),
            "prior": self._prior(table.shape[0] * table.shape[1]),
            "sample_stats": {"lp": table[:, :, names.index("log_density")]},
            "observed_data": {"measured_stretch": np.array(observed, float)},
            "log_likelihood": {"measured_stretch": self._arrays()["log_likelihood"]},
            "constant_data": {"poisson_ratio": np.array(self["posterior"]["poisson_ratio"], float)},
        }

    def to_arviz(self) -> Any:
        """The groups as an `InferenceData` of ArviZ or, from ArviZ 1.0 on, as a `DataTree` of xarray."""
        self._warn()
        try:
            import arviz_base as arviz
        except ImportError:
            import arviz
        by_muscle = ["tension_n_per_m", "baseline_tension_n_per_m", "change_n_per_m", "stretch"]
        dims = {**dict.fromkeys(by_muscle, ["muscle"]), "hyoid_mm": ["axis"], "measured_stretch": ["measured"]}
        said = {"coords": {"muscle": self.muscles, "measured": self.measured, "axis": ["back", "up"]}, "dims": dims}
        if hasattr(arviz, "InferenceData"):
            return arviz.from_dict(**self._groups(), **said)
        return arviz.from_dict(self._groups(), **said)


@documented(PosteriorOptions, "The draws, and the JSON of the program as a dict.")
def posterior(
    data: native.Dataset,
    subject: str,
    vowel: str,
    *,
    target: Kind = "ratio",
    baseline: str | None = None,
    method: Method = "gauss-newton",
    draws: int = 1000,
    seed: int = 1,
    threads: int | None = None,
    **options: Unpack[PosteriorOptions],
) -> Posterior:
    """Draws from the posterior of the tensions of one row (`tongue-fit --vowel V --posterior N`).

    All measured stretches determine the draws; `target`, `method` and `muscles` are settings of the fit that is made, too.
    """
    for name, text in (("subject", subject), ("vowel", vowel), ("target", target), ("method", method)):
        if not isinstance(text, str):
            raise native.Error(f"{name} must be a text, not {text!r:.60}")
    check_value("target", target, Kind)
    check_value("method", method, Method)
    for name, number in (("draws", draws), ("seed", seed)):
        if not hasattr(number, "__index__"):
            raise native.Error(f"{name} must be a whole number, not {number!r:.60}")
    own = {
        "lengths": ("data", _measured(data)), "subject": ("subject", subject), "vowel": ("vowel", vowel), "target": ("target", target),
        "baseline": ("baseline", baseline), "method": ("method", method), "posterior": ("draws", draws), "posterior-seed": ("seed", seed),
    }  # fmt: skip
    return _ran(Posterior, [], threads, options, PosteriorOptions, own=own)

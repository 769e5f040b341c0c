"""All rows of a table: from pandas, and back to it."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from . import _tongue_fit as native

if TYPE_CHECKING:
    import pandas as pd

#: Shards that are named one by one.
_MOST_NAMED = 20


def dataset(frame: pd.DataFrame, origin: str = "frame") -> native.Dataset:
    """The table of lengths in a pandas frame, with the columns that a CSV has: `subject`, `vowel`, `GGa_mm`, ...

    Numbers count with the digits that they need, so that lengths in whole millimetres are known to 0.5 mm, whether pandas holds them as
    integers or, because some are missing, as floats.
    """

    def cell(value: Any) -> Any:
        if value is None or value != value:
            return ""
        return repr(float(value)).removesuffix(".0") if isinstance(value, float) else value

    text = frame.astype(object).map(cell).to_csv(index=False)
    return native.Dataset.from_text(text, origin)


class Batch:
    """What came of the fits of a table.

    `fits` holds the fits in the order of the table: what `batch.json` of the program has under that name. `numbers` are their places
    among all the fits that the table asks for, `all_fits` how many these are, `not_fitted` what is wrong with the rows without a fit,
    `shard` which part it is ("1/1": all).
    """

    def __init__(
        self,
        shard: str,
        all_fits: int,
        found: Sequence[tuple[int, str | None, str]],
        not_fitted: Sequence[str],
    ) -> None:
        self.shard = shard
        self.all_fits = all_fits
        self._found = list(found)
        self._not_fitted = list(not_fitted)

    @property
    def numbers(self) -> list[int]:
        """Places of the fits, from 0."""
        return [number for number, fit, _ in self._found if fit is not None]

    @property
    def fits(self) -> list[dict[str, Any]]:
        """The fits, each as a dict."""
        return [json.loads(fit) for _, fit, _ in self._found if fit is not None]

    @property
    def not_fitted(self) -> list[str]:
        """What is wrong with the rows that have no fit."""
        return self._not_fitted + [why for _, fit, why in self._found if fit is None]

    def to_json(self) -> str:
        """The fits and what was not fitted, as one JSON object: the same bytes for one run and for merged shards."""
        fits = ",\n".join(fit for _, fit, _ in self._found if fit is not None)
        return f'{{"fits":[\n{fits}],\n"not_fitted":{json.dumps(self.not_fitted, ensure_ascii=False)}}}\n'

    def frame(self) -> pd.DataFrame:
        """A pandas frame with a row for each muscle of each fit: the columns of the program's `muscles.csv`, such as
        `tension_n_per_m`, `tension_low_n_per_m` and `tension_high_n_per_m` (95 % interval), `simulated_stretch`."""
        import pandas as pd

        tables = [lines for _, fit, lines in self._found if fit is not None]
        rows = "".join(lines if n == 0 else lines.split("\n", 1)[1] for n, lines in enumerate(tables))
        return pd.read_csv(io.StringIO(rows), keep_default_na=False, na_values=[""]) if rows else pd.DataFrame()

    def __len__(self) -> int:
        return len(self.numbers)

    def __repr__(self) -> str:
        return f"<Batch {self.shard}: {len(self)} of {self.all_fits} fits, {len(self.not_fitted)} rows not fitted>"


def batch(
    data: native.Dataset,
    *,
    subjects: Sequence[str] | None = None,
    vowels: Sequence[str] | None = None,
    target: str = "both",
    baseline: str | None = None,
    baselines: Mapping[str, str] | None = None,
    body: native.Body | None = None,
    model: native.Model | None = None,
    draws: int = 200,
    seed: int = 1,
    subsets: int = 2,
    method: str = "gauss-newton",
    starts: int = 8,
    upper_bound: float = 100.0,
    thesis: bool = False,
    tone: float | Mapping[str, float] | None = None,
    hyoid: str | None = None,
    free_bones: Sequence[str] = (),
    shard: str = "1/1",
    threads: int | None = None,
    progress: bool | Callable[[int, int], object] = True,
) -> Batch:
    """Fits every row of a table, as `tongue-fit batch` does, with the same names, defaults and bits.

    `target` is ratio, stretch or both; `baseline` the vowel that is taken as rest (default: ɯ, and e for who has none), `baselines` that
    of single subjects; `draws` of every length within its rounding make the 95 % intervals (0: none); `subsets` is in how many muscles
    other subsets of contracting muscles may differ; `tone` (N per metre of thickness) and `hyoid` (free, forward, fixed) are what is
    assumed of the baseline. `shard`, such as "3/16", makes every sixteenth fit from the third on; `merge` brings the shards together.
    `progress` shows a bar of tqdm's where that is installed, or is called with (done, all).
    """
    said = {
        "subjects": subjects, "vowels": vowels, "target": target, "baseline": baseline, "baselines": baselines, "body": body,
        "model": model, "draws": draws, "seed": seed, "subsets": subsets, "method": method, "starts": starts,
        "upper_bound": upper_bound, "thesis": thesis, "tone": tone, "hyoid": hyoid, "free_bones": list(free_bones) or None,
    }  # fmt: skip
    given = ", ".join(f"{name}={value!r}" for name, value in said.items() if value is not None and value is not False)
    report, close = _bar(progress)
    try:
        all_fits, found, not_fitted = native.fit_rows(
            data, _list(subjects), _list(vowels), target, baseline, dict(baselines or {}), body, model, draws, seed, subsets,
            method, starts, upper_bound, thesis, dict(tone) if isinstance(tone, Mapping) else tone, hyoid, list(free_bones), shard,
            threads, f"tongue_fit.batch({given})", report,
        )  # fmt: skip
    finally:
        close()
    return Batch(shard, all_fits, found, not_fitted)


def merge(shards: Iterable[Batch]) -> Batch:
    """Brings the shards of a batch together: what one run gives, to the byte. A shard that is missing is named, and nothing is merged."""
    parts = list(shards)
    if not parts:
        raise native.Error('no shard of a batch; tongue_fit.batch(data, shard="1/16") makes one')
    cuts = sorted({int(part.shard.split("/")[1]) for part in parts})
    if len(cuts) > 1:
        of = " and of ".join(str(cut) for cut in cuts)
        raise native.Error(f"shards of differently cut batches: of {of}; keep those of one cut only")
    if len({part.all_fits for part in parts}) > 1:
        raise native.Error("shards of different batches: they disagree on how many fits there are; keep those of one batch only")
    here = {part.shard: part for part in parts}
    missing = [f"{n}/{cuts[0]} is missing" for n in range(1, cuts[0] + 1) if f"{n}/{cuts[0]}" not in here]
    if missing:
        more = f"; and {len(missing) - _MOST_NAMED} more" if len(missing) > _MOST_NAMED else ""
        raise native.Error(f"not every shard is done, so nothing is merged: {'; '.join(missing[:_MOST_NAMED])}{more}")
    found = sorted((item for part in here.values() for item in part._found), key=lambda item: item[0])
    return Batch("1/1", parts[0].all_fits, found, parts[0]._not_fitted)


def _list(words: Sequence[str] | None) -> list[str] | None:
    return None if words is None else list(words)


def _bar(progress: bool | Callable[[int, int], object]) -> tuple[Callable[[int, int], object], Callable[[], object]]:
    """What is told of progress, and what ends it."""
    if callable(progress):
        return progress, lambda: None
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return lambda done, of: None, lambda: None
    bar = tqdm(disable=not progress, unit="fit")

    def report(done: int, of: int) -> None:
        bar.total = of
        bar.update(done - bar.n)

    return report, bar.close

"""Fits of measured rows: one, and all rows of a table, from pandas and back to it."""

from __future__ import annotations

import html
import io
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from . import _tongue_fit as native
from .options import documented

if TYPE_CHECKING:
    import pandas as pd

    from .options import Kind, Kinds, Method, Names

#: Maximum number of shards that are named one by one.
_MOST_NAMED = 20
#: Maximum number of fits in a notebook.
_MOST_SHOWN = 60


@documented(None, "The lengths.")
def dataset(frame: pd.DataFrame, origin: str = "frame") -> native.Dataset:
    """The table of lengths in a pandas frame.

    A number has as many digits as it needs: lengths in whole millimetres have a half width of 0.5 mm, whether they are integers or, because
    some are missing, floats.
    """
    return frame if isinstance(frame, native.Dataset) else native.Dataset.from_text(csv_text(frame), origin)


def csv_text(frame: pd.DataFrame) -> str:
    """A frame as the text of a CSV table; numbers have as many digits as they need."""
    if not (hasattr(frame, "columns") and hasattr(frame, "reset_index")):
        raise native.Error(f"frame must be a pandas DataFrame with the columns subject, vowel, GGa_mm, ..., not {_shown(frame)}")
    named = [name for name in frame.index.names if name is not None]
    if named:
        frame = frame.reset_index(level=named)

    def cell(value: Any) -> Any:
        # NaN differs from itself; a comparison with pandas' NA is NA, so that is found by its type.
        if value is None or type(value).__name__ in ("NAType", "NaTType") or value != value:
            return ""
        # The shortest text of a float32 is that of the number; as a float64 it would have more digits.
        if type(value).__name__ in ("float32", "float16"):
            value = float(str(value))
        return repr(float(value)).removesuffix(".0") if isinstance(value, float) else value

    text: str = frame.astype(object).map(cell).to_csv(index=False)
    return text


class Fit(dict[str, Any]):
    """The fit of one row: a dict with the names and bits of the JSON of `tongue-fit --vowel V --json`. A notebook shows its
    verdict (`verdict`, or why there is none, `no_verdict`), its tensions, and the fitted shape (`picture`, SVG)."""

    picture: str = ""

    @property
    def tensions_n_per_m(self) -> dict[str, float]:
        """The tensions by muscle, N per metre of thickness: `tensions_n` of the JSON."""
        return dict(self["tensions_n"])

    def _repr_html_(self) -> str:
        tensions, active = self.get("tensions_n", {}), self.get("active", [])
        heads = ["muscle", "tension, N/m", "stretch", "measured"]
        rows = [
            [name, f"{n:.2f}", _number(self["stretches"].get(name)), _number(self["target_stretches"].get(name))]
            for name, n in tensions.items()
            if name in active
        ]
        what = f"{self.get('subject')} /{self.get('vowel')}/ over /{self.get('baseline')}/, {self.get('target_kind')}: {self.get('status')}"
        words: dict[str, list[str]] = {}
        for muscle in self.get("verdict", []):
            words.setdefault(muscle["word"], []).append(muscle["muscle"])
        verdict = "; ".join(f"{word}: {', '.join(names)}" for word, names in words.items())
        if "no_verdict" in self:
            verdict = f"no verdict: {self['no_verdict']}"
        alarms = "".join(f"<li>{html.escape(alarm['text'])}</li>" for alarm in self.get("alarms", []))
        said = f"<p>{html.escape(verdict)}</p>" if verdict else ""
        return f"<p>{html.escape(what)}</p>{said}{_table(heads, rows)}" + (f"<ul>{alarms}</ul>" if alarms else "")

    def _repr_svg_(self) -> str | None:
        """The fitted shape over that of the baseline, as in the program."""
        return self.picture or None


@documented(None, "The JSON of the program as a dict, and a picture of the shape.")
def fit(
    data: native.Dataset,
    subject: str,
    vowel: str,
    *,
    target: Kind = "ratio",
    muscles: Names | None = None,
    baseline: str | None = None,
    body: native.Body | None = None,
    model: native.Model | None = None,
    method: Method = "gauss-newton",
    verdict: bool = True,
    threads: int | None = None,
) -> Fit:
    """Fits one row (`tongue-fit --vowel V`).

    `fit`, `batch` and `posterior` have the same defaults. Those of the program differ where it follows the thesis: its `--vowel` searches by
    nelder-mead, which finds the same tensions more slowly, and its `batch` fits ratios and stretches.
    """
    record, picture = native.fit_row(
        _measured(data), subject, vowel, target=target, muscles=muscles, baseline=baseline, body=body, model=model, method=method,
        verdict=verdict, threads=threads,
    )  # fmt: skip
    found = Fit(record)
    found.picture = picture
    return found


class Batch:
    """Results of the fits of a table.

    `fits` has the fits in the order of the table, as in `batch.json`; `numbers` their indices among all fits of the table;
    `all_fits` the number of these; `not_fitted` the reasons for rows without a fit; `shard` the part ("1/1": all).
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
        """Indices of the fits among all fits of the table, from 0."""
        return [number for number, fit, _ in self._found if fit is not None]

    @property
    def fits(self) -> list[Fit]:
        """The fits, without pictures."""
        return [Fit(json.loads(fit)) for _, fit, _ in self._found if fit is not None]

    @property
    def not_fitted(self) -> list[str]:
        """The reasons of rows without a fit."""
        return self._not_fitted + [why for _, fit, why in self._found if fit is None]

    def to_json(self) -> str:
        """The fits and the reasons of missing ones as a JSON object, whose bytes are the same for one run and for merged shards."""
        fits = ",\n".join(fit for _, fit, _ in self._found if fit is not None)
        return f'{{"fits":[\n{fits}],\n"not_fitted":{json.dumps(self.not_fitted, ensure_ascii=False)}}}\n'

    def frame(self) -> pd.DataFrame:
        """A pandas frame with a row for each muscle of each fit: the columns of the program's `muscles.csv`, such as
        `tension_n_per_m` and `simulated_stretch`."""
        import pandas as pd

        tables = [lines for _, fit, lines in self._found if fit is not None]
        rows = "".join(lines if n == 0 else lines.split("\n", 1)[1] for n, lines in enumerate(tables))
        return pd.read_csv(io.StringIO(rows), keep_default_na=False, na_values=[""]) if rows else pd.DataFrame()

    def __len__(self) -> int:
        return len(self.numbers)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Batch):
            return NotImplemented
        same = (self.shard, self.all_fits, self._not_fitted) == (other.shard, other.all_fits, other._not_fitted)
        return same and self.to_json() == other.to_json()

    __hash__ = None  # type: ignore[assignment]

    def _repr_html_(self) -> str:
        heads = ["subject", "vowel", "target", "status", "tensions, N/m"]
        rows = []
        for fit in self.fits[:_MOST_SHOWN]:
            tensions = ", ".join(f"{name} {fit['tensions_n'][name]:.2f}" for name in fit["active"])
            rows.append([fit["subject"], fit["vowel"], fit["target_kind"], fit["status"], tensions])
        more = f"<p>and {len(self) - _MOST_SHOWN} more fits</p>" if len(self) > _MOST_SHOWN else ""
        return f"<p>{html.escape(repr(self)[1:-1])}</p>{_table(heads, rows)}{more}"

    def __repr__(self) -> str:
        return f"<Batch {self.shard}: {len(self)} of {self.all_fits} fits, {len(self.not_fitted)} rows not fitted>"


@documented(None, "The fits, and the reasons for rows without one.")
def batch(
    data: native.Dataset,
    *,
    subjects: Names | None = None,
    vowels: Names | None = None,
    target: Kinds = "ratio",
    baseline: str | None = None,
    baselines: Mapping[str, str] | None = None,
    body: native.Body | None = None,
    model: native.Model | None = None,
    method: Method = "gauss-newton",
    shard: str = "1/1",
    threads: int | None = None,
    progress: bool | Callable[[int, int], object] = True,
) -> Batch:
    """Fits every row of a table (`tongue-fit batch`), with the defaults of `fit`."""
    said: dict[str, Any] = {
        "subjects": subjects, "vowels": vowels, "target": target, "baseline": baseline, "baselines": baselines, "body": body,
        "model": model, "method": method,
    }  # fmt: skip
    plain = {name: value.item() if getattr(value, "shape", None) == () else value for name, value in said.items()}
    given = ", ".join(f"{name}={value!r}" for name, value in plain.items() if value is not None and value is not False)
    data = _measured(data)
    words = {subject: vowel for subject, vowel in _items("baselines", baselines)}
    report, close = _bar(progress)
    try:
        all_fits, found, not_fitted = native.fit_rows(
            data, subjects, vowels, target, baseline, words, body, model,
            method, shard, threads, f"tongue_fit.batch({given})", report,
        )  # fmt: skip
    finally:
        close()
    return Batch(shard, all_fits, found, not_fitted)


@documented(None, "The whole batch.")
def merge(shards: Iterable[Batch]) -> Batch:
    """Merges the shards of a batch, with the same bytes as one run. If a shard is missing, an error names it."""
    parts: list[Any] = list(shards) if hasattr(shards, "__iter__") else [shards]
    if wrong := [part for part in parts if not isinstance(part, Batch)]:
        raise native.Error(f"shards must be batches that tongue_fit.batch(data, shard=..) made, not {_shown(wrong[0])}")
    if not parts:
        raise native.Error('no shard of a batch; tongue_fit.batch(data, shard="1/16") makes one')
    cuts = sorted({int(part.shard.split("/")[1]) for part in parts})
    if len(cuts) > 1:
        of = " and of ".join(str(cut) for cut in cuts)
        raise native.Error(f"shards of batches with different numbers of shards: of {of}; keep those of one batch")
    if len({part.all_fits for part in parts}) > 1:
        raise native.Error("shards of different batches: they disagree on how many fits there are; keep those of one batch only")
    here = {part.shard: part for part in parts}
    missing = [f"{n}/{cuts[0]} is missing" for n in range(1, cuts[0] + 1) if f"{n}/{cuts[0]}" not in here]
    if missing:
        more = f"; and {len(missing) - _MOST_NAMED} more" if len(missing) > _MOST_NAMED else ""
        raise native.Error(f"not every shard is done, so nothing is merged: {'; '.join(missing[:_MOST_NAMED])}{more}")
    found = sorted((item for part in here.values() for item in part._found), key=lambda item: item[0])
    return Batch("1/1", parts[0].all_fits, found, parts[0]._not_fitted)


def _measured(data: native.Dataset) -> native.Dataset:
    if isinstance(data, native.Dataset):
        return data
    what = "a DataFrame; make a Dataset of it: tongue_fit.dataset(frame)" if hasattr(data, "columns") else _shown(data)
    raise native.Error(f"data must be a tongue_fit.Dataset, not {what}")


def _items(what: str, words: Mapping[str, str] | None) -> list[tuple[str, str]]:
    if words is None:
        return []
    if not hasattr(words, "items"):
        raise native.Error(f"{what} must be a dict, such as {{'S4': 'e'}}, not {_shown(words)}")
    items = list(words.items())
    if not all(isinstance(word, str) for item in items for word in item):
        raise native.Error(f"{what} must be a dict of texts, such as {{'S4': 'e'}}, not {_shown(words)}")
    return [(str(name), str(word)) for name, word in items]


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:60]}..."


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    head = "".join(f"<th>{html.escape(cell)}</th>" for cell in heads)
    body = "".join("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><tr>{head}</tr>{body}</table>"


def _bar(progress: bool | Callable[[int, int], object]) -> tuple[Callable[[int, int], object], Callable[[], object]]:
    """The functions that report progress and that end the report."""
    if callable(progress):
        return progress, lambda: None
    if not isinstance(progress, bool):
        raise native.Error(f"progress must be True, False or a function of two numbers, not {_shown(progress)}")
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return lambda done, of: None, lambda: None
    bar = tqdm(disable=not progress, unit="fit")

    def report(done: int, of: int) -> None:
        bar.total = of
        bar.update(done - bar.n)

    return report, bar.close

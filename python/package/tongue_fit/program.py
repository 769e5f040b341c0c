"""Commands of the program beside fits: posteriors, recordings, bodies, scenes, sounds.

Each function runs a command within this process, on threads of its own. The JSON that the command prints becomes a dict, and the files
that it writes become bytes by name. As an argument a list stands for several values, a dict for values by muscle or vowel or for a file of
keys (TOML), a DataFrame or a Dataset for a CSV file, and bytes for any file.
"""

from __future__ import annotations

import io
import json
import math
import tempfile
from collections.abc import Mapping, Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from . import _tongue_fit as native
from .options import AdaptOptions, CheckOptions, File, Keys, SoundOptions, TrackOptions, ValidateOptions, check_options, documented, in_python
from .rows import csv_text

if TYPE_CHECKING:
    import pandas as pd
    from typing_extensions import Unpack

#: Exit status of a result that did not converge or cannot be trusted.
_UNTRUSTWORTHY = 3


class Run(dict[str, Any]):
    """The output of a command, as a dict with the names and bits of the program's JSON; `files` are the bytes of the files it wrote, by
    name, and `told` is its standard error.

    `is_trustworthy` is false if the program ended with status 3, or if the tensions of a fit without a posterior cannot be trusted although
    its verdict can: `run["conclusion"]` says which (`trusted`, `tensions_trusted`, `text`)."""

    files: dict[str, bytes]
    told: str
    is_trustworthy: bool

    def __init__(self, record: Mapping[str, Any], files: Mapping[str, bytes], told: str, is_trustworthy: bool) -> None:
        super().__init__(record)
        self.files = dict(files)
        self.told = told
        self.is_trustworthy = is_trustworthy

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (dict(self), self.files, self.told, self.is_trustworthy)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Run):
            return NotImplemented
        return dict(self) == dict(other) and self.files == other.files

    __hash__ = None

    def frame(self, name: str) -> pd.DataFrame:
        """A written CSV file as a pandas frame."""
        import pandas as pd

        if not isinstance(name, str) or name not in self.files:
            raise native.Error(f"no file {name} was written; there are {', '.join(self.files) or 'none'}")
        return pd.read_csv(io.BytesIO(self.files[name]), keep_default_na=False, na_values=[""], comment="#")

    def save(self, folder: str | PathLike[str]) -> None:
        """Writes all files into a folder, which is made if it does not exist."""
        if not isinstance(folder, (str, PathLike)):
            raise native.Error(f"folder must be a path, not {folder!r:.60}")
        for name, content in self.files.items():
            path = Path(folder) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)

    def _repr_svg_(self) -> str | None:
        """The first picture, for notebooks."""
        return next((content.decode() for name, content in self.files.items() if name.endswith(".svg")), None)

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {', '.join(self)}; files {', '.join(self.files) or 'none'}>"


@documented(None, "The output as a dict, and the files.")
def run(*words: Any, threads: int | None = None, **options: Any) -> Run:
    """Runs any command: `run("scene", "run", "supine", threads=2)` is `tongue-fit scene run supine --threads=2 --json`."""
    return _ran(Run, words, threads, options, None, "words")


_R = TypeVar("_R", bound=Run)


def _ran(
    kind: type[_R], words: Sequence[Any], threads: int | None, options: Mapping[str, object], typed: type | None,
    what: str = "given", own: Mapping[str, tuple[str, object]] | None = None,
) -> _R:  # fmt: skip
    """Runs a command with options of the type `typed` (None: any). `own` maps options of the program to the names and values of arguments."""
    own = {**(own or {}), "threads": ("threads", threads)}
    if typed:
        check_options(typed.__name__.removesuffix("Options").lower(), options, typed)
    named = {name.removesuffix("_").replace("_", "-"): name for name in [*(typed.__annotations__ if typed else ()), *options]}
    named |= {option: argument for option, (argument, _) in own.items()}
    with tempfile.TemporaryDirectory(prefix="tongue-fit-") as folder:
        given, out = Path(folder) / "given", Path(folder) / "out"
        given.mkdir()
        line = [_word(word, given, what) for word in words]
        for option, (name, value) in own.items():
            line += _option(option, name, value, given)
        for name, value in options.items():
            line += _option(name.removesuffix("_").replace("_", "-"), name, value, given)
        status, printed, told = native.call_program(["tongue-fit", *line, "--json", "--out", str(out)])
        told = told.replace(str(given) + "/", "")
        # A table with faults ends with status 1, but with an answer from the rest.
        if not printed:
            raise native.Error(in_python(told, named) or f"the program ended with status {status}")
        files = {str(path.relative_to(out)): path.read_bytes() for path in sorted(out.rglob("*")) if path.is_file()}
        try:
            record = json.loads(printed)
        except json.JSONDecodeError:
            raise native.Error(f"the program printed no JSON but {printed[:200]!r}") from None
        is_trustworthy = status == 0
        if "conclusion" in record and "posterior" not in record:
            is_trustworthy = record["conclusion"]["tensions_trusted"]
        return kind(record, files, told, is_trustworthy)


def _option(option: str, name: str, value: Any, given: Path) -> list[str]:
    """The words of an option for the command line; its value is that of the argument `name`."""
    option = f"--{option}"
    if isinstance(value, native.Dataset):
        state: Any = value.__reduce__()[1]
        table, _, half_width_mm = state
        # No bytes stand for the built-in table, which is the default of the program.
        words = [f"{option}={_written(given, name, '.csv', table)}"] if table else []
        return words if half_width_mm is None else [*words, f"--error-mm={half_width_mm}"]
    if value is None or value is False:
        return []
    if value is True:
        return [option]
    if isinstance(value, Mapping) and name not in _FILES:
        return [f"{option}={key}={_word(one, given, name)}" for key, one in value.items()]
    if name in _SEVERAL:
        return [f"{option}={_word(one, given, name)}" for one in ([value] if isinstance(value, str) else value)]
    if isinstance(value, (list, tuple)):
        value = ",".join(_word(one, given, name) for one in value)
    return [f"{option}={_word(value, given, name)}"]


#: Options for which a dict is a file of keys (TOML), and options that are repeated for each value.
_FILES = ("priors", "map", "anatomy", "tract")
_SEVERAL = ("free_bone",)


def _word(value: Any, given: Path, name: str) -> str:
    """A value as a word of a command line. Values that stand for a file are written to one."""
    if hasattr(value, "columns"):
        return _written(given, name, ".csv", csv_text(value).encode())
    if isinstance(value, Mapping):
        return _written(given, name, ".toml", toml_text(value).encode())
    if isinstance(value, (bytes, bytearray, memoryview)):
        # The program recognises a body in JSON by the ending of its file.
        return _written(given, name, ".json" if bytes(value).lstrip().startswith(b"{") else "", bytes(value))
    if isinstance(value, PathLike):
        return str(fspath(value))
    if getattr(value, "shape", None) == () and hasattr(value, "item"):
        value = value.item()
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise native.Error(f"{name} must be a text, a number, a path, a DataFrame or a dict, not {value!r:.60}")
    return str(value)


def _written(given: Path, name: str, ending: str, content: bytes) -> str:
    path = given / f"{name}-{len(list(given.iterdir()))}{ending}"
    path.write_bytes(content)
    return str(path)


def toml_text(keys: Mapping[str, Any]) -> str:
    """A dict as TOML, with inline tables."""
    return "".join(f"{json.dumps(str(key))} = {_toml(value, str(key))}\n" for key, value in keys.items() if value is not None)


def _toml(value: Any, key: str) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{json.dumps(str(k))} = {_toml(v, f'{key}.{k}')}" for k, v in value.items() if v is not None) + "}"
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(one, key) for one in value) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and not math.isfinite(value):
        raise native.Error(f"{key} is {value}; give a finite number")
    if isinstance(value, (str, int, float)):
        return json.dumps(value, ensure_ascii=False)
    raise native.Error(f"{key} must be a text, a number, a list or a dict, not {value!r:.60}")


@documented(None, "Positions (m), lengths (mm) and alarms; its picture in `files`.")
def scene(scene: Keys, *, threads: int | None = None) -> Run:
    """Runs a scene: only the effects that it names are simulated (`tongue-fit scene run`)."""
    return _ran(Run, ["scene", "run", scene], threads, {}, None, "scene")


@documented(SoundOptions, "Formants (`formants_hz`, Hz) and areas of the tract; a voice in `files` (WAV).")
def sound(*, threads: int | None = None, **options: Unpack[SoundOptions]) -> Run:
    """The sound of a tongue (`tongue-fit sound`): of `vowel="a"`, or of `tension={"GGa": 12.0}`."""
    return _ran(Run, ["sound"], threads, options, SoundOptions)


@documented(AdaptOptions, 'How the body was found; `files["body.json"]` is for `mesh` of other functions.')
def adapt(*recordings: File, threads: int | None = None, **options: Unpack[AdaptOptions]) -> Run:
    """A speaker's body, from recordings or from `landmarks` and `contour` (`tongue-fit adapt`)."""
    return _ran(Run, ["adapt", *recordings], threads, options, AdaptOptions, "recordings")


@documented(TrackOptions, 'Tensions and their courses (N/m); `frame("track.csv")` has them by time and muscle.')
def track(*recordings: File, threads: int | None = None, **options: Unpack[TrackOptions]) -> Run:
    """Tensions over time, from recordings (`tongue-fit track`)."""
    return _ran(Run, ["track", *recordings], threads, options, TrackOptions, "recordings")


@documented(ValidateOptions, "Errors of the predicted stretches, dimensionless.")
def validate(*, threads: int | None = None, **options: Unpack[ValidateOptions]) -> Run:
    """Errors of predictions of muscles that were not fitted, and of simpler predictions (`tongue-fit validate`)."""
    return _ran(Run, ["validate"], threads, options, ValidateOptions)


@documented(CheckOptions, "Subjects, vowels and muscles that were understood, and the faults.")
def check(table: File, **options: Unpack[CheckOptions]) -> Run:
    """How a table of lengths is understood, and which rows cannot be used (`tongue-fit lengths check`)."""
    return _ran(Run, ["lengths", "check", table], None, options, CheckOptions, "table")

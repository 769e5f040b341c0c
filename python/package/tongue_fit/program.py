"""What the program does beside single fits: posteriors, recordings, bodies, scenes, sounds.

Each function runs the program of this package in a process of its own. What `--json` prints is a dict, and the files that the program
writes are bytes by name. Options are keyword arguments with the names of the program's: `--hold-out` is `hold_out=`, True gives an option
without a value, a list is joined by commas, a dict gives the option once for each `NAME=VALUE`. A DataFrame or a Dataset stands for a CSV
file, a dict of keys for a scene, priors or a map (TOML), bytes for any file.
"""

from __future__ import annotations

import io
import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from . import _tongue_fit as native
from .rows import csv_text

if TYPE_CHECKING:
    import pandas as pd

#: Exit status of a result that did not converge or cannot be trusted.
_UNTRUSTWORTHY = 3


class Run(dict[str, Any]):
    """What a command printed, as a dict with the names and bits of the program's JSON; `files` are the bytes of the files it wrote, by
    name, and `told` is what it said on its standard error.

    `is_trustworthy` is false where the program ended with status 3. For the fit of a vowel without a posterior it is false too where
    its verdict can be trusted but its tensions cannot: `run["conclusion"]` says which (`trusted`, `tensions_trusted`, `text`)."""

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
        """A CSV file that was written, as a pandas frame."""
        import pandas as pd

        if not isinstance(name, str) or name not in self.files:
            raise native.Error(f"no file {name} was written; there are {', '.join(self.files) or 'none'}")
        return pd.read_csv(io.BytesIO(self.files[name]), keep_default_na=False, na_values=[""], comment="#")

    def save(self, folder: str | PathLike[str]) -> None:
        """Writes all files into a folder, which is made if it is not there."""
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


def run(*words: Any, threads: int | None = None, **options: Any) -> Run:
    """Runs the program: `run("scene", "run", "supine")` is `tongue-fit scene run supine --json`."""
    return _ran(Run, words, threads, options, "words")


_R = TypeVar("_R", bound=Run)


def _ran(kind: type[_R], words: Iterable[Any], threads: int | None, options: Mapping[str, Any], what: str = "given") -> _R:
    with tempfile.TemporaryDirectory(prefix="tongue-fit-") as folder:
        given, out = Path(folder) / "given", Path(folder) / "out"
        given.mkdir()
        line = [_word(word, given, what) for word in words]
        for name, value in options.items():
            line += _option(name, value, given)
        if threads is not None:
            line.append(f"--threads={_word(threads, given, 'threads')}")
        command = [sys.executable, "-m", "tongue_fit", *line, "--json", "--out", str(out)]
        with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as child:
            try:
                printed, said = _communicated(child)
            except BaseException:
                child.kill()
                raise
        told = said.decode(errors="replace").replace(str(given) + "/", "")
        # A check of a table that has faults answers with them.
        answered = child.returncode in (0, _UNTRUSTWORTHY) or line[:2] == ["lengths", "check"]
        if not answered or not printed:
            raise native.Error(told.strip().removeprefix("error: ") or f"the program ended with status {child.returncode}")
        files = {str(path.relative_to(out)): path.read_bytes() for path in sorted(out.rglob("*")) if path.is_file()}
        record = json.loads(printed)
        is_trustworthy = child.returncode == 0
        if "conclusion" in record and "posterior" not in record:
            is_trustworthy = record["conclusion"]["tensions_trusted"]
        return kind(record, files, told, is_trustworthy)


def _communicated(child: subprocess.Popen[bytes]) -> tuple[bytes, bytes]:
    """What a process prints, waited for in short spells: after Ctrl-C Python waits for the rest of a spell, and at most a quarter of a second."""
    while True:
        try:
            return child.communicate(timeout=0.05)
        except subprocess.TimeoutExpired:
            continue


def _option(name: str, value: Any, given: Path) -> list[str]:
    option = f"--{name.removesuffix('_').replace('_', '-')}"
    if isinstance(value, native.Dataset):
        state: Any = value.__reduce__()[1]
        table, _, half_width_mm = state
        # The built-in table has no bytes of its own: it is the default.
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


#: Options whose value may be a dict that stands for a file of keys (TOML), and those that are given once for each value.
_FILES = ("priors", "map")
_SEVERAL = ("free_bone",)


def _word(value: Any, given: Path, name: str) -> str:
    """A value as a word of a command line; what stands for a file is written to one."""
    if hasattr(value, "columns"):
        return _written(given, name, ".csv", csv_text(value).encode())
    if isinstance(value, Mapping):
        return _written(given, name, ".toml", toml_text(value).encode())
    if isinstance(value, (bytes, bytearray, memoryview)):
        return _written(given, name, "", bytes(value))
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
    """A dict as TOML: tables are written in line."""
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


def scene(scene: str | PathLike[str] | Mapping[str, Any], *, threads: int | None = None, **options: Any) -> Run:
    """Runs a scene (`tongue-fit scene run`): the name of a built-in one, a file, or its keys as a dict."""
    return _ran(Run, ["scene", "run", scene], threads, options, "scene")


def sound(*, threads: int | None = None, **options: Any) -> Run:
    """The vowel that is heard (`tongue-fit sound`): `vowel="a"`, or `tension={"GGa": 12.0}`; formants, areas, and a voice in
    `files` (WAV)."""
    return _ran(Run, ["sound"], threads, options)


def adapt(*recordings: Any, threads: int | None = None, **options: Any) -> Run:
    """A speaker's body from recordings, or from `landmarks=` and `contour=` (`tongue-fit adapt`); `files["body.json"]` is for `mesh=` of
    other functions."""
    return _ran(Run, ["adapt", *recordings], threads, options, "recordings")


def track(*recordings: Any, threads: int | None = None, **options: Any) -> Run:
    """Tensions over time from recordings (`tongue-fit track`); `.frame(NAME)` gives a table that was written."""
    return _ran(Run, ["track", *recordings], threads, options, "recordings")


def validate(*, threads: int | None = None, **options: Any) -> Run:
    """How well muscles are predicted that were not fitted (`tongue-fit validate`)."""
    return _ran(Run, ["validate"], threads, options)


def check(table: Any, **options: Any) -> Run:
    """What is understood of a table of lengths, and which rows are not (`tongue-fit lengths check`): a file, a DataFrame, or bytes."""
    return _ran(Run, ["lengths", "check", table], None, options, "table")

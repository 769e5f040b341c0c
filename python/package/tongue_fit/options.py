"""Options of the functions that run the program: type, default and meaning.

`help()` of a function has its text from here, and a test compares names, values and defaults with those of the program.
"""

import difflib
import inspect
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from os import PathLike
from types import UnionType
from typing import TYPE_CHECKING, Annotated, Any, ForwardRef, Literal, TypeAlias, TypedDict, TypeVar, Union, get_args, get_origin

from . import _tongue_fit as native

if TYPE_CHECKING:
    import pandas as pd

Path: TypeAlias = str | PathLike[str]
#: A file: its path, its bytes, or a DataFrame for a table.
File: TypeAlias = "str | PathLike[str] | bytes | pd.DataFrame"
#: Keys of a TOML file as a dict, or the file.
Keys: TypeAlias = "Mapping[str, Any] | str | PathLike[str] | bytes"
#: A file, or files by vowel.
ByVowel: TypeAlias = "str | PathLike[str] | bytes | pd.DataFrame | Mapping[str, Any]"
Lengths: TypeAlias = "native.Dataset | str | PathLike[str] | bytes | pd.DataFrame"
Names: TypeAlias = str | Sequence[str]
Kind: TypeAlias = Literal["ratio", "stretch"]
Kinds: TypeAlias = Literal["ratio", "stretch", "both"]
Method: TypeAlias = Literal["nelder-mead", "gauss-newton"]
Unit: TypeAlias = Literal["m", "mm"]
Format: TypeAlias = Literal["aaa", "csv", "pos", "ema", "con", "fan", "txy", "mat", "dlc", "sensors"]
Also: TypeAlias = Literal["svg", "sto", "ssff", "textgrid", "draws", "repeats", "vtu"]


class Mesh(TypedDict, total=False):
    h: Annotated[float | str, "5.5 (of a continuum 4)", 'Mesh spacing, mm, or a text with its unit such as "2.75mm".']
    anatomy: Annotated[Keys, None, "Anatomy (TOML) instead of the built-in one."]
    mesh: Annotated[Path | bytes, None, "A body instead of an anatomy: Gmsh's (.msh), or `body.json` of `adapt`."]
    mesh_unit: Annotated[Unit, "m", "Unit of the coordinates in `mesh`."]
    poisson_ratio: Annotated[float, "0.49", "Poisson's ratio of the tissue, below 0.5."]


class Plane(Mesh, total=False):
    body: Annotated[Literal["springs", "continuum"], "springs", "Springs on connections, or a continuum of quadratic elements."]


class Space(TypedDict, total=False):
    muscles_as: Annotated[Literal["stress", "lines"], "stress", "Muscles in space: stress along fibres, or lines from node to node."]
    stiffening: Annotated[float, "0", "Stiffening of a muscle's tissue by full activation, as a multiple of its passive stiffness."]
    refined: Annotated[bool, "False", "Cut every hexahedron in eight."]
    tip: Annotated[int, "the foremost of the midsagittal plane", "The node, by its number from 1, that is the tip."]
    body_unit: Annotated[Unit, "m", "Unit of the coordinates of a body from Gmsh."]


class PosteriorOptions(Plane, total=False):
    muscles: Annotated[Names, "those shorter than in the baseline", "Muscles that contract in the fit; in the draws every muscle may pull."]
    error_mm: Annotated[float, "from the digits of the lengths", "Half width of the rounding of every length, mm."]
    priors: Annotated[Keys, "those that `tongue-fit priors` prints", "Priors: a dict or a file (TOML)."]
    joint: Annotated[bool, "False", "Sample the vowels of the subject together, for contrasts between them."]
    emg: Annotated[File, None, "Relative muscle activity, 0 to 1: the column `muscle` and one for each vowel."]
    contour: Annotated[ByVowel, None, "Contour of the vowel, mm in the body's frame; a dict gives those of several vowels."]
    points: Annotated[ByVowel, None, "Coils by their names, mm: the columns `point`, `x_mm`, `y_mm`; a dict as in `contour`."]


class Recordings(TypedDict, total=False):
    example: Annotated[bool, "False", "Use the built-in recording of a simulated tongue."]
    map: Annotated[Keys, "from the names of the channels", "Meaning of channels, axes and unit: a dict or a file (TOML)."]
    palate: Annotated[File, None, "The palate in the frame of the recordings, mm: the columns `point`, `x_mm`, `y_mm`, from front to back."]
    speaker: Annotated[str, "all", "Only the recordings of this speaker."]
    format: Annotated[Format, "from their content", "Format of the files."]
    prior: Annotated[float, "20", "Scale of the tensions in the prior, N/m."]
    memory: Annotated[float, "0.1", "Correlation time of the tensions, s; 0: every frame by itself."]


class AdaptOptions(Recordings, Plane, total=False):
    rest: Annotated[Literal["joint", "similarity"], "joint", "The rest shape: one that explains many frames, or the body turned, scaled and shifted."]
    landmarks: Annotated[File, None, "Instead of recordings: `mental_spine` and `hyoid` at rest, mm: `point`, `x_mm`, `y_mm`, or 3D Slicer's."]
    contour: Annotated[File, None, "The contour of the tongue beside `landmarks`, in the same formats."]


class TrackOptions(Recordings, Mesh, Space, total=False):
    body: Annotated[
        Literal["springs", "continuum", "space"] | Path, "springs",
        "Springs, a continuum, the built-in tongue in space, a folder with ArtiSynth's, or hexahedra from Gmsh (.msh).",
    ]  # fmt: skip
    rest: Annotated[Literal["joint", "similarity"], "similarity", "The rest shape if no body is given, as in `adapt`."]
    as_is: Annotated[bool, "False", "Use the body unchanged: the recordings are in its frame."]
    hold_out: Annotated[str | int | Sequence[str | int], "none", "Contour points or coils that are predicted instead of fitted."]
    muscles: Annotated[Names, "all of the body", "Muscles that can contract."]
    free_bone: Annotated[Names, "none", "Bones that may be displaced where they were not seen, such as hyoid."]
    draws: Annotated[int, "1000", "Number of draws for the intervals."]
    seed: Annotated[int, "0", "Seed of the random numbers."]
    frames: Annotated[int, "100", "Maximum number of frames of a recording whose shapes are kept."]
    also: Annotated[Also | Sequence[Also], "none", "Files beside the page and the tables."]
    sides_apart: Annotated[bool, "False", "In space: let the sides of a muscle be activated apart."]
    starts: Annotated[int, "4", "In space: number of starting points of the search."]
    sd: Annotated[float, "0.5", "In space: standard deviation of each coordinate, mm, where a table has no column `sd_mm`."]
    formants: Annotated[bool, "False", "Compute F1 and F2 of every frame."]
    tract: Annotated[Keys, "the built-in one", "Tract (TOML) in the frame of the recordings."]
    lip_opening: Annotated[float, "8", "Height of the opening between the lips, mm."]
    lip_protrusion: Annotated[float, "0", "Protrusion of the lips, mm."]


class SoundOptions(Space, total=False):
    body: Annotated[Literal["space"] | Path, None, "A tongue in space instead of a vowel: the built-in one, or as in `track`."]
    vowel: Annotated[str, None, "Vowel whose lengths are fitted."]
    subject: Annotated[str, "S2", "Subject whose lengths are fitted."]
    target: Annotated[Kind, "stretch", "Quantity to fit: ratio (to GGa) or stretch (to the subject's own /ɯ/)."]
    tension: Annotated[Mapping[str, float], None, "Tensions by muscle instead of a vowel, N/m."]
    activation: Annotated[Mapping[str, float], None, "In space: activations by muscle, 0 to 1."]
    tract: Annotated[Keys, "that of the reference tongue", "Tract (TOML)."]
    jaw: Annotated[float, "that of the tract for the vowel, else 0", "Opening of the jaw, degrees."]
    hyoid: Annotated[Sequence[float], "(0, 0)", "Shift of the hyoid, mm: back, up."]
    lip_opening: Annotated[float, "that of the tract for the vowel, else 8", "Height of the opening between the lips, mm."]
    lip_protrusion: Annotated[float, "that of the tract for the vowel, else 0", "Protrusion of the lips, mm."]
    h: Annotated[float, "5.5", "Mesh spacing, mm."]
    pitch: Annotated[float, "120", "Pitch of the voice, Hz."]
    seconds: Annotated[float, "1", "Duration of the voice, s."]


class ValidateOptions(Plane, total=False):
    lengths: Annotated[Lengths, "the built-in ones", "Measured lengths."]
    baseline: Annotated[str, "ɯ", "Vowel that the others are compared with."]
    permutations: Annotated[int, "25", "Number of permutations of the names of muscles."]
    seed: Annotated[int, "1", "Seed of permutations and bootstraps."]
    posterior: Annotated[bool, "False", "Validate the posterior too; takes about half an hour of one core."]


class CheckOptions(TypedDict, total=False):
    baseline: Annotated[str, "ɯ, and e for subjects without ɯ", "Vowel that the others are compared with."]
    error_mm: Annotated[float, "from the digits of the lengths", "Half width of the rounding of every length, mm."]


#: Arguments in the signatures of the functions: the meaning of None, and the meaning of the argument.
ARGUMENTS: dict[str, tuple[str | None, str]] = {
    "data": (None, "The measured lengths."),
    "subject": (None, "Subject of the row."),
    "vowel": (None, "Vowel of the row."),
    "subjects": ("all", "Only these subjects."),
    "vowels": ("all", "Only these vowels."),
    "target": (None, "What the fit meets: lengths over that of GGa, as in the thesis, or over those in the baseline."),
    "muscles": ("those shorter than in the baseline", "Muscles that contract in the fit; in the draws of a posterior every muscle may pull."),
    "baseline": ("ɯ (in `batch` e for subjects without ɯ)", "The vowel that rows are compared with; its shape is that of rest."),
    "baselines": ("`baseline`", "The baseline of single subjects, such as {'S4': 'e'}."),
    "body": ("Body.tongue()", "The tongue."),
    "model": ("Model()", "Constants of the tissue."),
    "method": (None, "The search of the fit: by the simplex of the thesis, or by the derivatives of the equilibrium, for the same tensions."),
    "verdict": (None, "Say for every muscle how probably it pulls harder than in the baseline, which takes most of the time."),
    "shard": (None, '"3/16" makes every sixteenth fit from the third on; `merge` merges the shards.'),
    "shards": (None, "All shards of one batch, in any order."),
    "progress": (None, "Show a progress bar if tqdm is installed, or call the function with (done, all)."),
    "draws": (None, "Number of draws; with fewer than 500 the chains seldom mix."),
    "seed": (None, "Seed of the random numbers."),
    "threads": ("one for each core", "Number of threads; results do not depend on it."),
    "frame": (None, "The columns of a CSV: `subject`, `vowel`, `GGa_mm`, ...; subject and vowel may also be the index."),
    "origin": (None, "The name of the data in messages."),
    "table": (None, "Lengths with their unit in the names of columns: `subject`, `vowel`, `GGa_mm`, ..."),
    "recordings": (None, "Recordings: contours, sensors and bones over time."),
    "scene": (None, "The name of a built-in scene, a file (TOML), or its keys."),
    "words": (None, "The words of the command line. Values that stand for a file are written to one."),
    "options": (None, "Options by their names, `hold_out=` for `--hold-out`; True gives an option without a value."),
}
_Function = TypeVar("_Function", bound=Callable[..., object])


def documented(options: type | None, returns: str) -> Callable[[_Function], _Function]:
    """Adds arguments (from `ARGUMENTS` and the type of the options), result and errors to a function's docstring, in numpydoc's format."""

    def put(function: _Function) -> _Function:
        signature, lines = inspect.signature(function), ["Parameters", "----------"]
        for name, one in signature.parameters.items():
            if one.kind is one.VAR_KEYWORD and options:
                continue
            default, text = ARGUMENTS[name]
            default = default if one.default in (one.empty, None) else repr(one.default)
            stars = "*" if one.kind is one.VAR_POSITIONAL else "**" if one.kind is one.VAR_KEYWORD else ""
            lines += _entry(stars + name, _words(one.annotation), default, text, default is None)
        for name, option in options.__annotations__.items() if options else ():
            default, text = option.__metadata__
            lines += _entry(name, _words(option.__origin__), default, text, False)
        lines += ["", "Returns", "-------", _words(signature.return_annotation), f"    {returns}"]
        lines += ["", "Raises", "------", "Error", "    What cannot be used, by the name of the argument."]
        # Under `python -OO` there is no docstring.
        function.__doc__ = "\n".join([inspect.cleandoc(function.__doc__ or ""), "", *lines])
        return function

    return put


def _entry(name: str, kind: str, default: str | None, text: str, needed: bool) -> list[str]:
    default = f'"{default}"' if f'"{default}"' in kind else default
    return [f"{name} : {kind}" + ("" if needed else f", default {default}" if default else ", optional"), f"    {text}"]


def _words(kind: Any) -> str:
    """The name of a type in documentation."""
    if isinstance(kind, (str, ForwardRef)):
        text = kind if isinstance(kind, str) else kind.__forward_arg__
        text = re.sub(r"\b(File|Keys|Kinds?|Method|Names)\b", lambda alias: _words(globals()[alias[1]]), text.replace(" | None", ""))
    elif get_origin(kind) is Literal:
        text = "{" + ", ".join(f'"{word}"' for word in get_args(kind)) + "}"
    elif get_origin(kind) in (Union, UnionType):
        text = " or ".join(_words(one) for one in get_args(kind))
    else:
        text = getattr(get_origin(kind) or kind, "__name__", "Any")
        text += f"[{', '.join(_words(one) for one in get_args(kind))}]" if get_args(kind) else ""
    for long, short in ((" | ", " or "), ("str or PathLike[str]", "path"), ("Mapping[str, Any]", "dict"), ("native.", ""), ("pd.", ""), ("'", '"')):
        text = text.replace(long, short)
    return text


def check_options(function: str, given: Mapping[str, object], options: type) -> None:
    """Refuses an option that the function does not have, as Python does, and a name that is not one of its values."""
    known = options.__annotations__
    for name, value in given.items():
        if name not in known:
            hint = _nearest(name, known) or f"; it has {', '.join(known)}"
            raise TypeError(f"{function}() got an unexpected keyword argument '{name}'{hint}")
        check_value(name, value, known[name].__origin__)


def check_value(name: str, value: object, kind: Any) -> None:
    """Refuses a name that is not in a `Literal`, unless any text is allowed."""
    names = [word for one in (kind, *get_args(kind)) if get_origin(one) is Literal for word in get_args(one)]
    if not names or str in get_args(kind) or value is None:
        return
    for one in value if isinstance(value, (list, tuple)) else [value]:
        if not (isinstance(one, str) and one in names):
            raise native.Error(f"{name} must be {' or '.join(map(repr, names))}, not {one!r:.60}{_nearest(one, names)}")


def _nearest(word: object, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(str(word), known, 1)
    return f"; did you mean '{near[0]}'?" if near else ""


def in_python(message: str, arguments: Mapping[str, str]) -> str:
    """A message of the program in Python's terms: `arguments` maps options of the program to the arguments that replace them."""
    notes, _, error = re.split(r"\n+(?:Usage:|For more information)", f"\n{message}")[0].rpartition("\nerror: ")
    message = f"{error.strip()}\n{notes.strip()}".strip()
    return re.sub(r"('?)--([a-z][a-z-]*)(?: <[^>]*>(?:\.\.\.)?)?\1", lambda option: arguments.get(option[2], option[0]), message)

"""The registry of file formats: a declaration each, which names the functions of the format's file.

It is free of NumPy, so that `--help` can list the formats; a format's file is imported with the
first path of its kind. Whatever lists endings (messages, help, the table in the docs) asks here.
"""

from __future__ import annotations

import errno
import stat
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

from facert.errors import InputError, OutputExistsError, OutputKeptError
from facert.io.claims import claim
from facert.io.content import endings_by_content
from facert.io.guarded import door, parsing
from facert.io.pictures import bears_mark as pictures_mark
from facert.io.pictures import may_bear_mark

Kind = Literal["take", "rig", "mesh", "mesh sequence", "morphs"]
Use = Literal["read", "write"]
Missing = Literal["held", "marked", ""]

FOLDER = "/"
"""The ending of a folder."""


@dataclass(frozen=True)
class Format:
    """One format of files; functions are named as ``"module.function"`` in `facert.io`."""

    endings: tuple[str, ...]
    """In lower case; the last parts of a name."""
    read: Mapping[Kind, str] = field(default_factory=dict)
    """The reader of each kind of thing that such a file can hold: it takes the path, and those of
    ``target``, ``shapes`` and ``fps`` that it has parameters for."""
    write: Mapping[Kind, str] = field(default_factory=dict)
    """The writer of each kind: it takes the thing, the path, and whether to overwrite."""
    kind_of: str = ""
    """From the path, and the kind that was asked for or None, to what that very file holds."""
    targets: str = ""
    """From the path to the targets of a take in it, and the controls of each."""
    nodes: str = ""
    """From the path to the names of nodes in it that drivers may move."""
    missing: Missing = ""
    """What stands for missing frames where a file is played row by row at its rate, so that rows
    have to be even: the frame before, or a row that says so; empty where rows have their times."""
    mark: str = ""
    """From the path to whether facert wrote that very file; without it, facert writes none."""
    about: str = ""
    """What writes such takes, for ``--help``."""
    reads: str = ""
    writes: str = ""
    """The cells of the table in the docs."""

    def functions(self, use: Use) -> Mapping[Kind, str]:
        """Names of the format's readers or writers, by kind."""
        return self.read if use == "read" else self.write


FORMATS = (
    Format(
        (".h5", ".hdf5"),
        read={"take": "take.read_take", "rig": "rig.read_rig"},
        write={
            "take": "take.write_take",
            "rig": "rig.write_rig",
            "mesh sequence": "mesh_sequence.write_mesh_sequence",
        },
        kind_of="hdf5.kind_of",
        mark="hdf5.bears_mark",
        reads="take, rig or mesh sequence",
        writes="take, rig or mesh sequence",
    ),
    Format(
        (".livelink.csv",),  # read as .csv: the header decides
        write={"take": "tables.livelink.write_livelink"},
        missing="marked",
        mark="tables.livelink.bears_mark",
        reads="Live Link Face",
        writes="poses (else source weights), if they are ARKit's; rows are even in time",
    ),
    Format(
        (".curvetable.csv", ".curvetable.json"),  # read as .csv and .json: their content decides
        write={"take": "tables.curve_table.write_curve_table"},
        mark="tables.curve_table.bears_mark",
        reads="a Curve Table of Unreal: a row a curve, a column a time",
        writes="poses (else source weights) as a Curve Table",
    ),
    Format(
        (".csv",),
        read={"take": "tables.csv_table.read_csv_take"},
        write={"take": "tables.csv_table.write_table"},
        mark="tables.csv_table.bears_mark",
        about=" of Live Link Face, another tracker or plain",
        reads="Live Link Face, or a table with a header: a clock or `frame`, `NAME.x NAME.y "
        "NAME.z` or weights; of OpenFace, MediaPipe, Vicon and others; separated by commas, or by "
        "semicolons or tabs with decimal commas as well",
        writes="poses (else the source) as a table; never both",
    ),
    Format(
        (".json",),
        read={"take": "tables.tracker_json.read_json_take"},
        write={"take": "curves.write_curves"},
        missing="held",
        mark="curves.bears_mark",
        about=" of Audio2Face or a tracker",
        reads="Audio2Face curves; frames of MediaPipe, BEAT and others: a list of objects, one a "
        "line, or columns",
        writes="poses (else source weights); rows are even in time",
    ),
    Format(
        (".txt",),
        {"take": "facecap.read_facecap"},
        mark="tables.csv_table.bears_mark",  # of the curve of a training
        about=" of Face Cap",
        reads="Face Cap",
    ),
    Format(
        (".tsv", ".tab"),
        {"take": "tables.csv_table.read_csv_take"},
        reads="the same as `.csv`, between tabs",
    ),
    Format((".c3d",), {"take": "c3d.read_c3d"}, reads="markers"),
    Format(
        (".trc",),
        {"take": "trc.read_trc"},
        reads="markers; where DataRate or counts of the header contradict the frames, these count; "
        "blanks, doubled tabs, UTF-16 and Latin-1 are read as well",
    ),
    Format(
        (".glb", ".gltf"),
        read={
            "take": "gltf.take.read_gltf_take",
            "rig": "gltf.rig.read_gltf_rig",
            "mesh": "gltf.rig.read_gltf_mesh",
        },
        kind_of="gltf.take.kind_of",
        nodes="gltf.driven.nodes_of",
        reads="a rig of morph targets, at rest as the scene and its skeleton place it; their "
        "animation as a take",
    ),
    Format(
        (".vrm",),
        read={"take": "gltf.take.read_gltf_take", "rig": "gltf.rig.read_gltf_rig"},
        kind_of="gltf.take.kind_of",
        nodes="gltf.driven.nodes_of",
        reads="the same of a VRM avatar; with `--shapes expressions` its expressions",
    ),
    Format(
        (".vrma",),
        {"take": "gltf.take.read_gltf_take"},
        reads="a take of the expressions of a VRM animation",
    ),
    Format(
        (".glb",),
        write={"morphs": "gltf.writer.write_glb"},
        mark="gltf.document.bears_mark",
        writes="by `convert`: a rig, a take with `--rig`, a mesh sequence",
    ),
    Format(
        (".usd", ".usda", ".usdc"),
        write={"morphs": "usd.write_usd"},
        mark="usd.bears_mark",
        writes="the same (`pip install 'facert[usd]'`)",
    ),
    Format(
        (".npz",),
        read={"take": "npz.read_npz_take", "rig": "npz.read_npz_rig"},
        kind_of="npz.kind_of",
        targets="npz.targets_of",
        reads="tracks: `markers`, `marker_names`, `time`, `fps`, any targets `KEY` with "
        "`KEY_names` (choose with `--target KEY`); rigs: `neutral`, `faces`, `deltas`, `names`, "
        "or several `KEY_deltas`, `KEY_names` (choose with `--shapes KEY`)",
    ),
    Format((".obj",), {"mesh": "obj.read_obj"}, reads="a mesh at rest, for `drive`"),
    Format((".ply",), {"mesh": "ply.read_ply"}, reads="a mesh at rest, for `drive`"),
    Format(
        (".recording",),
        {"take": "live_recording.read_recording"},
        mark="live_recording.bears_mark",
        reads="what `live` recorded until its session was killed",
    ),
    Format(
        (".safetensors",),
        mark="tensors.bears_mark",
        reads="a model, by `--model`",
        writes="a model, by `train`",
    ),
    Format(
        (FOLDER,),
        {"rig": "obj.read_obj_folder"},
        reads="`neutral.obj` and one OBJ a shape: a rig; shapes beside the neutral, in another "
        "unit or with another axis up are named, and moved by `--align-shapes`",
    ),
)

_TEXT_MARKS = ("tables.csv_table.bears_mark", "curves.bears_mark", "importers.bears_mark")
"""Of text that facert writes under whatever name it is given, such as a script as ``.txt``."""

OWN_ENDINGS = FORMATS[0].endings
"""Of facert's own files, which keep all that a take has."""

GLTF_ENDINGS = (".glb", ".gltf", ".vrm")
"""Of glTF files, which a .glb keeps as they are."""

_ADVICE = {
    ".fbx": "Export it as .glb from Blender, Maya or Unreal.",
    ".bvh": "Export it as .c3d or .trc.",
    ".mp4": "Track the face first, e.g. with Live Link Face or Face Cap.",
    ".mov": "Track the face first, e.g. with Live Link Face or Face Cap.",
    ".obj": "Give the folder with neutral.obj and one OBJ file a shape.",
    ".safetensors": "This is a model: give it with --model.",
    **dict.fromkeys((".usd", ".usda", ".usdc"), "facert only writes USD: export a .glb."),
}


def endings(use: Use, *kinds: Kind) -> tuple[str, ...]:
    """The endings of files from which one of these kinds is read, or to which it is written."""
    found = (one.endings for one in FORMATS if one.functions(use).keys() & set(kinds))
    return tuple(dict.fromkeys(ending for some in found for ending in some if ending != FOLDER))


def format_of(path: Path, use: Use, *kinds: Kind) -> Format | None:
    """The format of those with one of these kinds that the name's ending stands for.

    Of a file that is read, the content counts where the ending says nothing or something else.
    """
    folder = use == "read" and path.is_dir()
    name = FOLDER if folder else path.name.lower() if path.suffix else ""
    able = [one for one in FORMATS if one.functions(use).keys() & set(kinds)]
    found = next((one for one in able if name.endswith(one.endings)), None)
    if use == "write" or not path.is_file():
        return found
    held = set(endings_by_content(path, likely=found is None))
    if not held or (found and held & set(found.endings)):
        return found
    return next((one for one in able if held & set(one.endings)), found)


def function(name: str) -> Callable[..., Any]:
    """The function of that name, see `Format`."""
    module, _, attribute = name.rpartition(".")
    found: Callable[..., Any] = getattr(import_module(f"facert.io.{module}"), attribute)
    return found


def is_foreign(path: Path) -> bool:
    """Whether there is a file of a format that facert reads or writes, and facert did not write it.

    It is of a format by its ending or by its content, and facert's by the format's mark, or by that
    of any text of facert's; so is a picture, a clip or a page. An empty file is nobody's; one that
    cannot be read is somebody's.
    """
    if not path.is_file() or not path.stat().st_size:
        return False
    name, held = path.name.lower(), set(endings_by_content(path, likely=True))
    formats = [one for one in FORMATS if name.endswith(one.endings) or held & set(one.endings)]
    if not formats:
        return may_bear_mark(path) and not pictures_mark(path)
    with suppress(InputError), parsing("file", "one that bears a mark"):
        marks = dict.fromkeys([*(one.mark for one in formats if one.mark), *_TEXT_MARKS])
        return not any(function(mark)(path) for mark in marks)
    return True


def require_replaceable(path: Path, overwrite: bool) -> None:
    """Refuse to replace an existing file, before any work is done, and claim it for this run.

    Raises `OutputKeptError`, whatever `overwrite` is, when it `is_foreign`: a recording or a
    character that came from elsewhere cannot be made anew; or when it is no file at all, but a
    folder, a pipe or a device. Else raises `OutputExistsError` unless `overwrite` is set, and
    `InputError` when another run writes it; see `facert.io.claims`.
    """
    require_free(path, overwrite)
    claim(path)


def require_free(path: Path, overwrite: bool) -> None:
    """Refuse what `require_replaceable` refuses, without a claim."""
    kind = _kind_of_place(path)
    if kind:
        raise OutputKeptError(path, f"it is {kind}")
    if is_foreign(path):
        raise OutputKeptError(path)
    if path.exists() and not overwrite:
        raise OutputExistsError(path)
    if path.is_symlink() and not overwrite:
        raise OutputExistsError(path, "it is a link to a file that is not there")


def _kind_of_place(path: Path) -> str:
    """What stands at the place of a file that is none; empty for a file, or nothing."""
    try:
        mode = path.stat().st_mode
    except OSError as error:
        return "a link that leads nowhere" if error.errno == errno.ELOOP else ""
    if stat.S_ISREG(mode):
        return ""
    kinds = {stat.S_IFDIR: "a folder", stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket"}
    return kinds.get(stat.S_IFMT(mode), "a device")


def output_format(path: Path, *kinds: Kind) -> Format:
    """The format to write one of these kinds to, whether `path` exists or not.

    Raises `InputError` for an ending to which none of them is written.
    """
    found = format_of(path, "write", *kinds)
    if found is None:
        known = ", ".join(endings("write", *kinds))
        fix = "Choose a name for the output that ends so."
        raise InputError("output's ending", known, _ending(path), fix, where=str(path))
    return found


def require_output(path: Path, overwrite: bool, *kinds: Kind) -> Format:
    """The format to write one of these kinds to, found before any work is done.

    Raises what `output_format` and `require_replaceable` raise.
    """
    found = output_format(path, *kinds)
    require_replaceable(path, overwrite)
    return found


def write(kind: Kind, thing: object, path: Path, overwrite: bool = False) -> None:
    """Write a thing of that kind in the format of the name's ending.

    Raises `InputError` for an ending to which this kind is not written, or a thing that the format
    cannot hold, and `OutputExistsError` when `path` exists and `overwrite` is not set.
    """
    function(require_output(path, overwrite, kind).write[kind])(thing, path, overwrite)


def read(name: str, path: Path, *arguments: object, **options: object) -> Any:
    """What one of a format's functions makes of a file.

    Raises `InputError` that names the file for whatever goes wrong in it, and is not of the system.
    """
    with door(path):
        return function(name)(path, *arguments, **options)


def unknown_input(path: Path) -> InputError:
    """The error for a file that holds no take or rig by its ending, with what to do about it."""
    known = f"{', '.join(endings('read', 'take', 'rig'))}, or a folder of .obj files"
    known_by = (path.suffix.lower(), *endings_by_content(path, likely=True))
    advice = next(filter(None, map(_ADVICE.get, known_by)), "Export it in one of these formats.")
    return InputError("kind of file", known, _ending(path), advice, where=str(path))


def listed(use: Use, kind: Kind) -> str:
    """The endings of files from which a kind is read, or to which it is written, for ``--help``."""
    able = (one for one in FORMATS if kind in one.functions(use) and FOLDER not in one.endings)
    return ", ".join(", ".join(one.endings) + (one.about if use == "read" else "") for one in able)


def table_rows() -> list[str]:
    """The rows of the docs' table in Markdown: endings, what is read, what is written."""
    names = (", ".join(f"`{e}`" for e in one.endings if e != FOLDER) for one in FORMATS)
    return [
        f"| {name or 'a folder'} | {one.reads} | {one.writes} |".replace("|  |", "| |")
        for name, one in zip(names, FORMATS, strict=True)
    ]


def _ending(path: Path) -> str:
    return repr(path.suffix) if path.suffix else "no ending"

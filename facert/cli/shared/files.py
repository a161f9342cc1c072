"""Work of several commands with files: refuse names in time, read without bad markers, write."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from facert.cli.shared import console
from facert.data.text import for_json
from facert.errors import InputError, OutputKeptError, reading
from facert.io.atomic import write_bytes, write_text
from facert.io.pictures import METADATA
from facert.io.registry import require_replaceable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from facert.data.moments import Timed
    from facert.data.rig import Rig
    from facert.data.take import Take
    from facert.io.take import Beside
    from facert.io.video_frames import VideoFrames
    from facert.render.faces import Face

PICTURES = (".png", ".pdf", ".svg")


def require_name(path: Path, overwrite: bool, endings: tuple[str, ...] = PICTURES) -> None:
    """Refuse a name that cannot be written to, before any work is done.

    Raises
    ------
    InputError
        When it ends in none of `endings`.
    OutputExistsError
        When the file exists and `overwrite` is not set.
    """
    if path.suffix.lower() not in endings:
        expected = f"a name that ends in {', '.join(endings)}"
        found = repr(path.suffix) if path.suffix else "none"
        raise InputError("output", expected, found, "Give another name.", where=str(path))
    require_replaceable(path, overwrite)


def require_report(path: Path, overwrite: bool) -> None:
    """Refuse a name of JSON that could not be written to, or would replace anything but a report.

    Raises
    ------
    OutputExistsError
        When the file exists and `overwrite` is not set, or it holds a take or something else.
    """
    from facert.io.curves import holds_curves, read_json_object

    require_replaceable(path, overwrite)
    if path.exists():
        try:
            holds_report = not holds_curves(read_json_object(path))
        except InputError:
            holds_report = False
        if not holds_report:
            raise OutputKeptError(path, "the file holds something else than a report")


def require_other_file(source: Path, output: Path, name: str) -> None:
    """Refuse to write over a file that is read, whatever it is called."""
    if source.exists() and output.exists() and identity(source) == identity(output):
        fix = "Give another name: what is read would be lost."
        raise InputError("OUT", f"another file than {name}", "the same", fix, str(output))


def identity(path: Path) -> tuple[int, int]:
    """Device and inode of a file: equal for all its names, symbolic and hard links."""
    found = path.stat()
    return found.st_dev, found.st_ino


def read_observed(path: Path, target: str | None, no_detect: bool) -> Take:
    """A take without its bad markers, unless every marker is to be taken as observed."""
    from facert.io.formats import read_source_file
    from facert.preprocess.faults import without_faults

    take = read_source_file(path, target)
    with reading(path):
        return take if no_detect else without_faults(take)


NO_ACTOR = Path("none")  # for --actor


def actor_file(path: Path | None) -> Path | None:
    """The file of ``--actor``, None where there is none to read."""
    return None if path == NO_ACTOR and not path.exists() else path


def read_character(
    path: Path | None, shapes: str | None, drivers: Path | None = None
) -> Rig | None:
    """The character's rig, if it is given, with what its drivers move.

    Raises
    ------
    InputError
        When the drivers come without a rig, or do not fit it.
    """
    from facert.io.formats import read_rig_file
    from facert.io.toml import read_drivers

    if path is None and drivers is not None:
        raise InputError("--drivers", "the rig that they move", "none", "Give it with --rig.")
    if path is None:
        return None
    return read_rig_file(path, shapes, read_drivers(drivers) if drivers else None)


def read_actor(take: Take, path: Path | None, shapes: str | None) -> Face | None:
    """The face of an actor whose weights were tracked: by his rig, or facert's stand-in for ARKit.

    Raises
    ------
    InputError
        When there is a rig, but the take holds markers, or the rig has a shape for none of the
        weights.
    """
    from facert.io.formats import read_rig_file
    from facert.render.faces import actor_face

    if path is None:
        return _stand_in(take)
    if actor_file(path) is None:
        return None
    if take.source.kind != "weights":
        raise InputError("--actor", "a take of weights", "markers", "Leave it out.")
    return actor_face(take, read_rig_file(path, shapes))


def _stand_in(take: Take) -> Face | None:
    """The face of facert for weights of ARKit; none for others, which the log says."""
    from facert.demo.stand_in import is_tracked, stand_in_face

    if take.source.kind != "weights":
        return None
    if not is_tracked(take):
        console.log.info("the weights are not ARKit's: to see the actor's face, --actor RIG")
        return None
    text = "the actor's face is facert's stand-in for ARKit's shapes; --actor RIG shows his own,"
    console.log.info("%s --actor none leaves it out", text)
    return stand_in_face(take)


def open_footage(
    path: Path | None, take: Timed, start: float | None, pixels: int = 480
) -> VideoFrames | None:
    """The performer's video by the take's time, if there is one.

    Raises
    ------
    InputError
        When it is no video or shows nothing of the take; when there is only its start.
    """
    from facert.io.video_frames import open_video

    if path is None and start is not None:
        raise InputError("--video-start", "the video, --video FILE", "none", "Give it, or neither.")
    return None if path is None else open_video(path, take, start, pixels)


def write_beside(take: Take, output: Path, overwrite: bool, beside: Beside) -> None:
    """Write a take, and beside it what only HDF5 can hold, with a note where it cannot."""
    from facert.io.formats import write_take_file
    from facert.io.registry import OWN_ENDINGS
    from facert.io.take import write_take

    if output.suffix.lower() in OWN_ENDINGS:
        write_take(take, output, overwrite, beside)
        return
    write_take_file(take, output, overwrite)
    what = dict.fromkeys("the verdict" if "/verdict/" in name else name for name in beside)
    console.log.info("only a .h5 file would hold %s as well", " and ".join(what))


def save_picture(figure: Figure, path: Path, overwrite: bool) -> None:
    """Write a figure in the format of the file's ending."""
    from facert.render.texts import with_plain_texts

    content = io.BytesIO()
    ending = path.suffix.lower()
    with_plain_texts(figure).savefig(content, format=ending[1:], metadata=METADATA[ending])
    write_bytes(content.getvalue(), path, overwrite)


def save_json(content: Mapping[str, object], path: Path, overwrite: bool) -> None:
    """Write JSON for people to read as well."""
    save_text(for_json(content) + "\n", path, overwrite)


def save_text(text: str, path: Path, overwrite: bool) -> None:
    """Write text in UTF-8."""
    write_text(text, path, overwrite)


def warn_of_unit(unit: str) -> None:
    """Note that numbers in no known unit are written as metres."""
    from facert.data.units import in_metres

    if in_metres(unit) is None:
        text = "the mesh has no unit that is known: its numbers are written as metres; where they"
        console.log.warning("%s are not, give theirs: --in-units cm", text)

"""Several takes, and old animation, given to a command: read, and matched to each other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from facert.cli.shared import console
from facert.errors import reading

if TYPE_CHECKING:
    from facert.data.take import Take
    from facert.data.takes import Takes

BUILT_IN = "the built-in take"


def read_takes(
    paths: Sequence[Path],
    target: str | None,
    animation: Sequence[Path] = (),
    predicted: bool = False,
) -> Takes:
    """Takes with the unit, the names and the controls of the first; without any the built-in one.

    Parameters
    ----------
    paths : sequence of Path
    target : str, optional
        Of those that can have several.
    animation : sequence of Path
        Old animation of the character.
    predicted : bool
        Take poses that a model predicted for somebody's.

    Raises
    ------
    InputError
        For a file that cannot be read, or does not fit to the first.
    """
    from facert.data.matching_takes import as_takes
    from facert.io.animation import read_animation
    from facert.io.formats import read_take_file, targets_for
    from facert.io.take import with_recording

    keys = targets_for(target, *paths, *animation)
    takes = [
        with_recording(read_take_file(path, target=key), path)
        for path, key in zip(paths, keys, strict=False)
    ]
    if predicted:
        takes = [take.with_poses(take.controls, take.params) for take in takes]
    old = zip(animation, keys[len(paths) :], strict=True)
    poses = [read_animation(path, key) for path, key in old]
    with reading(listed_files(paths)):
        return as_takes(
            takes or _built_in(), poses, short_names(paths) or [BUILT_IN], short_names(animation)
        )


def short_names(paths: Sequence[Path]) -> list[str]:
    """Names of files in messages: without their folders, where that distinguishes them."""
    names = [path.name for path in paths]
    return names if len(set(names)) == len(names) else [str(path) for path in paths]


def listed_files(paths: Sequence[Path]) -> str:
    """The files in one line, for errors about all of them."""
    return ", ".join(map(str, paths)) or BUILT_IN


def _built_in() -> Take:
    from facert.demo import training_take

    console.log.info("no take given: training on the built-in demo take")
    return training_take()

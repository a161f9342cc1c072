"""The demo's takes and rigs, and the folder of files made from them.

The same seed gives the same values. They are rounded to a grid that float32 holds exactly: far
below the noise of a capture, and it lets compression do its work.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from facert.data.arrays import FloatArray, IntArray
from facert.data.names import ARKIT_SHAPES
from facert.data.rig import Rig
from facert.data.take import Controls, Source, Take
from facert.demo import acting, build
from facert.demo.arkit import arkit_shapes
from facert.demo.character import CONTROLS, animate, control_shapes
from facert.demo.expressions import ACTIVATIONS, expressions
from facert.demo.head import Head, make_head, marker_vertices
from facert.io.registry import require_replaceable
from facert.io.rig import write_rig
from facert.io.take import write_take

FPS = 30.0
TRAINING_SECONDS, PERFORMANCE_SECONDS = 60.0, 20.0
ANIMATION_POSES = 300
NOISE = 0.01  # cm, standard deviation of a recorded coordinate
UNITS = "cm"
FILES = ("training.h5", "performance.h5", "actor.h5", "character.h5")


def training_take(seed: int = 0, posed: int | None = 40) -> Take:
    """A minute of performance with a few key poses, and an old animation of the character.

    Parameters
    ----------
    seed : int
    posed : int, optional
        Number of frames whose pose is given, spread over the performance; None gives all.
    """
    take = _record(TRAINING_SECONDS, seed)
    assert take.params is not None
    params = take.params.copy()
    if posed is not None:
        params[_unposed(len(take), posed, seed)] = np.nan
    return replace(take, params=params, animation=_old_animation(seed))


def performance_take(seed: int = 1) -> Take:
    """Twenty other seconds of the same actor, with the true pose in every frame."""
    return _record(PERFORMANCE_SECONDS, seed)


@cache
def actor_rig() -> Rig:
    """The actor's mesh with a shape for each activation."""
    head = make_head(build.ACTOR)
    return _rig(head, expressions(head), ACTIVATIONS)


@cache
def character_rig() -> Rig:
    """The character's mesh with a shape for each control, as it looks at 1."""
    head = make_head(build.CHARACTER)
    names = tuple(control.name for control in CONTROLS)
    return _rig(head, control_shapes(expressions(head)), names)


@cache
def arkit_face() -> Rig:
    """A face with the 52 shapes of ARKit, to look at weights that a phone tracked."""
    head = make_head(build.ARKIT, inner=True)
    return _rig(head, arkit_shapes(head), ARKIT_SHAPES)


def write_demo(folder: Path, seed: int = 0, overwrite: bool = False) -> tuple[Path, ...]:
    """Write the four files of the demo into a folder and return their paths.

    Raises
    ------
    OutputExistsError
        When one of them exists and `overwrite` is not set; then none is written.
    """
    paths = tuple(Path(folder) / name for name in FILES)
    for path in paths:
        require_replaceable(path, overwrite)
    training, performance, actor, character = paths
    write_take(training_take(seed), training, overwrite)
    write_take(performance_take(seed + 1), performance, overwrite)
    write_rig(actor_rig(), actor, overwrite)
    write_rig(character_rig(), character, overwrite)
    return paths


def _record(seconds: float, seed: int) -> Take:
    """A recorded performance of the actor, with the true poses."""
    activations = acting.perform(seconds, FPS, seed)
    rig = actor_rig()
    names, vertices = marker_vertices(make_head(build.ACTOR))
    shapes = rig.shapes[:, vertices].reshape(len(ACTIVATIONS), -1)
    markers = rig.neutral[vertices] + (activations @ shapes).reshape(-1, len(vertices), 3)
    noise = np.random.default_rng([seed, 1]).normal(scale=NOISE, size=markers.shape)
    return Take(
        time=np.arange(len(activations)) / FPS,
        source=Source(_rounded(markers + noise), names),
        controls=_controls(),
        params=_rounded(animate(activations)),
        fps=FPS,
        units=UNITS,
        up_axis="y",
    )


def _old_animation(seed: int) -> FloatArray:
    """Poses (300, P) from another performance, which nobody recorded."""
    activations = acting.perform(TRAINING_SECONDS, FPS, seed + 1000)
    chosen = np.linspace(0, len(activations) - 1, ANIMATION_POSES).round().astype(int)
    return _rounded(animate(activations[chosen]))


def _unposed(frames: int, posed: int, seed: int) -> IntArray:
    """Indices of all frames but the posed ones: one at random in each equal part of the take."""
    rng = np.random.default_rng([seed, 2])
    edges = np.linspace(0, frames, posed + 1).astype(int)
    return np.setdiff1d(np.arange(frames), rng.integers(edges[:-1], edges[1:]))


def _controls() -> Controls:
    limits = np.array([[control.low, control.high] for control in CONTROLS])
    return Controls(tuple(control.name for control in CONTROLS), limits)


def _rig(head: Head, shapes: FloatArray, names: tuple[str, ...]) -> Rig:
    return Rig(
        neutral=_rounded(head.vertices),
        shapes=_rounded(shapes),
        names=names,
        faces=head.faces,
        units=UNITS,
        colours=_rounded(head.colours),
    )


def _rounded(values: FloatArray, steps: int = 4096) -> FloatArray:
    return np.asarray(np.round(values * steps) / steps)

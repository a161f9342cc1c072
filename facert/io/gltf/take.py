"""Takes in glTF files: the animation of morph targets' weights, or of a VRM's expressions."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from facert.data.arrays import FloatArray
from facert.data.memory import FLOAT
from facert.data.rate import AGREES, nominal_rate
from facert.data.take import Source, Take
from facert.errors import InputError
from facert.io.gltf.document import Document, open_gltf
from facert.io.gltf.names import target_names
from facert.io.gltf.vrm import animated_expressions
from facert.io.registry import Kind

log = logging.getLogger("facert")

_WEIGHTS = "weights"
_FASTEST = 240.0  # frames a second
_CLOSE = 0.05  # the share of the steps between keys that are as close as frames, at least
_SAME = 1e-6  # seconds: keys are stored as float32
_TERMS = 6  # of the sum that a key is sampled by, in memory at once


@dataclass(frozen=True, eq=False)
class _Curves:
    """The keys of the weights of one mesh."""

    time: FloatArray  # (n,)
    values: FloatArray  # (n, K), or (n, 3, K) with tangents in, values, tangents out
    names: tuple[str, ...]
    interpolation: str


def read_gltf_take(path: Path, target: str | None = None) -> Take:
    """Read the animation of morph targets as a take whose source is weights.

    Every key is a frame; between keys that lie farther apart than frames, there are others, which
    are sampled by the file's own interpolation. `target` names one of several animations.

    Raises `InputError` when the file cannot be read safely, or holds no animation of weights, or
    several.
    """
    with open_gltf(path) as document:
        curves = _chosen(document, target)
        names = tuple(dict.fromkeys(name for one in curves for name in one.names))
        column = {name: place for place, name in enumerate(names)}
        widest = max(len(one.names) for one in curves)
        most = FLOAT * (len(names) + _TERMS * widest + _TERMS)

        def require(frames: int) -> None:
            document.memory.require(most * frames, "animations")

        time, rate = _frame_times([one.time for one in curves], require)
        values = np.full((len(time), len(names)), np.nan)
        for one in reversed(curves):  # where two meshes have a name, the first one's counts
            values[:, [column[name] for name in one.names]] = _sampled(one, time)
        return Take(time=time, source=Source(values, names), fps=rate)


def kind_of(path: Path, asked: Kind | None = None) -> Kind:
    """Kind to read: the one asked for, else the rig, with a line in the log on its animation."""
    if asked is None:
        with open_gltf(path) as document:
            nodes = animated_expressions(document.root)
            animated = any(_channels(nodes, one) for one in document.root.get("animations", []))
        if animated:
            log.info("%s: this is the rig; its animation is a take as well", path.name)
    return asked or "rig"


def _channels(expressions: Mapping[int, str], animation: dict[str, Any]) -> list[dict[str, Any]]:
    """The channels of morph targets' weights, and of the nodes that stand for expressions.

    Of several that move the same the first, as the others are not allowed.
    """
    found: dict[tuple[Any, str], dict[str, Any]] = {}
    for one in animation["channels"]:
        node, path = one["target"].get("node"), one["target"]["path"]
        if path == _WEIGHTS or (path == "translation" and node in expressions):
            found.setdefault((node, path), one)
    return list(found.values())


def _chosen(document: Document, asked: str | None) -> list[_Curves]:
    """The curves of the animation that was asked for, or of the only one."""
    nodes = animated_expressions(document.root)
    found = [one for one in document.root.get("animations", []) if _channels(nodes, one)]
    names = [str(one.get("name", f"animation {i}")) for i, one in enumerate(found, start=1)]
    there = f"one of: {', '.join(names)}" if names else "an animation of morph targets"
    if asked is not None and asked not in names:
        raise InputError("--target", there, repr(asked), "Choose with --target.")
    if asked is None and len(found) != 1:
        wanted = "Choose with --target." if found else "Export the animation as well."
        raise InputError("animations", there, "none" if not found else "no choice", wanted)
    animation = found[names.index(asked)] if asked is not None else found[0]
    known = _names_by_node(document)
    channels = _channels(nodes, animation)
    return [_curves(document, animation, channel, known) for channel in channels]


def _names_by_node(document: Document) -> dict[int, tuple[str, ...]]:
    """The names of what an animation of each node moves: targets of its mesh, or an expression."""
    of_meshes = target_names(document)
    nodes = enumerate(document.root["nodes"])
    known = {i: of_meshes[one["mesh"]] for i, one in nodes if one.get("mesh") in of_meshes}
    expressions = animated_expressions(document.root)
    return known | {node: (str(name),) for node, name in expressions.items()}


def _curves(
    document: Document,
    animation: dict[str, Any],
    channel: dict[str, Any],
    known: dict[int, tuple[str, ...]],
) -> _Curves:
    sampler, target = animation["samplers"][channel["sampler"]], channel["target"]
    names = known[target["node"]]
    count = len(names)
    time = document.numbers(sampler["input"])[:, 0]
    if not np.isfinite(time).all() or (np.diff(time) <= 0).any():
        raise ValueError("keys whose time does not rise")
    interpolation = sampler.get("interpolation", "LINEAR")
    values = document.numbers(sampler["output"])
    values = values if target["path"] == _WEIGHTS else values[:, :1]  # of a translation the x
    shape = (len(time), 3, count) if interpolation == "CUBICSPLINE" else (len(time), count)
    return _Curves(time, values.reshape(shape), names, interpolation)


def _frame_times(
    keys: list[FloatArray], require: Callable[[int], None]
) -> tuple[FloatArray, float]:
    """Times of the frames, and their rate: at every key, and evenly between keys far apart.

    `require` refuses too many.
    """
    time = np.unique(np.concatenate(keys))
    if len(time) < 2:
        return time, nominal_rate(time)
    steps = np.diff(time)
    usual = float(np.quantile(steps, _CLOSE, method="lower"))
    rate = min(nominal_rate(np.array([0.0, usual])), _FASTEST)
    frames = np.maximum(np.rint(steps * rate), 1)  # in each step
    require(int(frames.sum()))
    step = np.repeat(np.arange(len(steps)), frames.astype(np.int64))
    number = np.arange(len(step)) - np.repeat(np.cumsum(frames) - frames, frames.astype(np.int64))
    found = np.append(time[step] + steps[step] * number / frames[step], time[-1])
    shown = nominal_rate(found)  # by all frames: a step alone is as rough as float32
    return found, shown if abs(shown - rate) <= AGREES * rate else rate


def _sampled(curves: _Curves, time: FloatArray) -> FloatArray:
    """The weights at some times, (T, K); before the first key and after the last they stay."""
    keys, values = curves.time, curves.values
    if len(keys) == 1:
        only = values[0, 1] if values.ndim == 3 else values[0]
        return np.tile(only, (len(time), 1))
    before = np.clip(np.searchsorted(keys, time + _SAME, side="right") - 1, 0, len(keys) - 2)
    step = (keys[before + 1] - keys[before])[:, None]
    t = np.clip((time - keys[before])[:, None] / step, 0.0, 1.0)
    t[np.abs(time - keys[before + 1]) <= _SAME] = 1.0
    if curves.interpolation == "STEP":
        return np.where(t < 1.0, values[before], values[before + 1])
    if curves.interpolation == "CUBICSPLINE":
        return np.asarray(
            (2 * t**3 - 3 * t**2 + 1) * values[before, 1]
            + step * (t**3 - 2 * t**2 + t) * values[before, 2]
            + (3 * t**2 - 2 * t**3) * values[before + 1, 1]
            + step * (t**3 - t**2) * values[before + 1, 0]
        )
    return np.asarray((1 - t) * values[before] + t * values[before + 1])

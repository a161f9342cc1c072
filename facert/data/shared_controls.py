"""Two takes cut down to the controls that both have, so that they can be compared."""

from __future__ import annotations

from dataclasses import dataclass, replace

from facert.data.names import NameIndex
from facert.data.take import Controls, Take
from facert.data.text import plural
from facert.errors import InputError


@dataclass(frozen=True, eq=False)
class SharedControls:
    """A truth and a result with the same controls, in the order and spelling of the result."""

    truth: Take
    result: Take
    of_truth: tuple[str, ...] = ()
    of_result: tuple[str, ...] = ()
    """The controls that only one of them has: they are left out."""

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the controls that both have."""
        assert self.result.controls is not None
        return self.result.controls.names

    @property
    def left_out(self) -> str:
        """A line about what is left out; empty where nothing is."""
        parts = [
            f"{', '.join(names)} (only in {where})"
            for names, where in ((self.of_truth, "the truth"), (self.of_result, "the result"))
            if names
        ]
        return f"not compared: {'; '.join(parts)}" if parts else ""


def shared_controls(truth: Take, result: Take) -> SharedControls | None:
    """Two takes with the controls that they share by name, in any spelling.

    None where one has no poses, or no control has the same name.
    """
    if truth.controls is None or truth.params is None:
        return None
    if result.controls is None or result.params is None:
        return None
    ours, theirs = result.controls.names, truth.controls.names
    pairs = _pairs(ours, theirs)
    if not pairs:
        return None
    names = tuple(ours[i] for i, _ in pairs)
    of_ours, of_theirs = ([pair[side] for pair in pairs] for side in (0, 1))
    return SharedControls(
        _cut(truth, of_theirs, names),
        _cut(result, of_ours, names),
        _others(theirs, of_theirs),
        _others(ours, of_ours),
    )


def require_shared(truth: Take, result: Take, fix: str) -> SharedControls:
    """A result and its truth with the controls that they share.

    Raises `InputError` with this fix: when it is no truth of the result, by its frames or its
    controls.
    """
    if len(truth) != len(result):
        raise InputError("--truth", plural(len(result), "frame"), f"{len(truth)}", fix)
    shared = shared_controls(truth, result)
    if shared is None or not len(shared.truth.labels):
        raise InputError("--truth", "poses of some of the take's controls", "none", fix)
    return shared


def _pairs(ours: tuple[str, ...], theirs: tuple[str, ...]) -> list[tuple[int, int]]:
    """Index pairs of the shared names; only mutual matches count, so none is used twice."""
    there = NameIndex.among(theirs, ours, "/target/names")
    here = NameIndex.among(ours, theirs, "/target/names", quiet=True)
    found = ((i, there.find(name)) for i, name in enumerate(ours))
    return [(i, j) for i, j in found if j is not None and here.find(theirs[j]) == i]


def _cut(take: Take, columns: list[int], names: tuple[str, ...]) -> Take:
    """The take with some of its controls, under these names."""
    assert take.params is not None
    std = None if take.std is None else take.std[:, columns]
    params = take.params[:, columns]
    return replace(
        take,
        controls=Controls(names),
        params=params,
        std=std,
        animation=None,
        corrections=None,
    )


def _others(names: tuple[str, ...], shared: list[int]) -> tuple[str, ...]:
    return tuple(name for index, name in enumerate(names) if index not in set(shared))

"""Maps of names: what another program calls a marker, a weight or a control, and what we do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from facert.data.names import NameIndex, nearest
from facert.data.rig import Rig
from facert.data.take import Controls, Take
from facert.errors import InputError


def renamed(found: Take | Rig, names: Mapping[str, str]) -> Take | Rig:
    """The same take or rig with other names.

    Parameters
    ----------
    found : Take or Rig
    names : mapping
        From the names in the file, in any spelling, to the new ones. Of a take the markers or
        weights and the controls are renamed. What is not in the mapping keeps its name.

    Raises
    ------
    InputError
        For a name that the file does not have, with the nearest one that it has; for two that
        would bear one name.
    """
    names = _checked(names)
    if isinstance(found, Rig):
        _require_known(names, found.names)
        return replace(found, names=_renamed(found.names, names))
    controls = found.controls
    _require_known(names, (*found.source.names, *(controls.names if controls else ())))
    source = replace(found.source, names=_renamed(found.source.names, names))
    if controls is not None:
        controls = Controls(_renamed(controls.names, names), controls.limits)
    return replace(found, source=source, controls=controls)


def _checked(names: Mapping[str, object]) -> dict[str, str]:
    """Check that the map holds text only."""
    for theirs, ours in names.items():
        if not isinstance(ours, str):
            raise InputError(
                theirs, 'a name, as in theirs = "ours"', repr(ours), "Correct the map."
            )
    return {theirs: str(ours) for theirs, ours in names.items()}


def _require_known(names: Mapping[str, str], there: Sequence[str]) -> None:
    """Refuse a name that is nowhere in the file."""
    index = NameIndex(tuple(dict.fromkeys(there)))
    unknown = [name for name in names if index.find(name) is None]
    if unknown:
        near = nearest(unknown[0], there)
        more = f" ({len(unknown) - 1} more)" if len(unknown) > 1 else ""
        raise InputError(
            "--map",
            f"names in the file, such as {near or there[0]!r}",
            f"{unknown[0]!r}{more}",
            f"Did you mean {near!r}?" if near else "Correct the map.",
        )


def _renamed(present: Sequence[str], names: Mapping[str, str]) -> tuple[str, ...]:
    index, result = NameIndex(present), list(present)
    for theirs, ours in names.items():
        place = index.find(theirs)
        if place is not None:
            result[place] = ours
    return tuple(result)

"""From the regions of the settings to those of a take."""

from __future__ import annotations

from facert.data.regions import Regions
from facert.data.take import Take
from facert.regions.automatic import find_regions


def resolved(wanted: Regions | str | None, take: Take, prepared: Take) -> Regions | None:
    """Regions by the names of a take; None: the face is learned as a whole.

    Parameters
    ----------
    wanted : Regions, "auto" or None
    take, prepared : Take
        As it was recorded, and without the markers that no frame shows.

    Raises
    ------
    InputError
        When the regions do not fit the take.
    """
    if wanted is None or take.controls is None:
        return None
    if isinstance(wanted, str):
        return find_regions(prepared)
    found = wanted.matched(take.source.names, take.controls.names)
    return found.seen_by(prepared.source.names)

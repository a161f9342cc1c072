"""Labels: the points whose target is given, and whether they suffice.

B does not depend on where a connected component lies: the constant over it costs nothing, so that
a label at least must hold it. With tangent spaces as large as space itself (d = D), any affine map
of the component costs nothing, and D + 1 labels must hold it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from facert.data.arrays import IntArray
from facert.errors import InputError
from facert.topology.neighbourhoods import Neighbourhoods

SHOWN = 4  # components that a message lists


def checked_labels(labels: ArrayLike, points: int) -> IntArray:
    """Check labelled points; return them as indices, (M,).

    Raises
    ------
    InputError
        When there is none, one is no point, or one comes twice.
    """
    chosen = np.atleast_1d(np.asarray(labels))
    whole = chosen.ndim == 1 and chosen.size > 0 and chosen.dtype.kind in "iu"
    if not whole or chosen.min() < 0 or chosen.max() >= points:
        bad = chosen[(chosen < 0) | (chosen >= points)] if whole else chosen
        raise _bad(f"whole numbers from 0 to {points - 1}", str(bad.tolist()) if bad.size else "")
    values, counts = np.unique(chosen, return_counts=True)
    if (counts > 1).any():
        raise _bad("points that are all different", f"{values[counts > 1][0]} twice")
    return chosen.astype(np.int64)


def needed_labels(dim: int, coordinates: int) -> int:
    """Least number of labels that fix a component whose points have so many coordinates."""
    return coordinates + 1 if dim >= coordinates else 1


def lacking_components(
    neighbourhoods: Neighbourhoods, labelled: IntArray, needed: int = 1
) -> IntArray:
    """Components, by number, that have fewer labels than needed."""
    components = neighbourhoods.components
    there = np.bincount(components)
    held = np.bincount(components[labelled], minlength=len(there))
    return np.flatnonzero(held < np.minimum(needed, there))


def require_enough_labels(
    neighbourhoods: Neighbourhoods, labelled: IntArray, needed: int = 1
) -> None:
    """Refuse components that have too few labels to be solved for.

    Raises
    ------
    InputError
        Naming the components with fewer labels than needed by one of their points.
    """
    lacking = lacking_components(neighbourhoods, labelled, needed)
    if not len(lacking):
        return
    components = neighbourhoods.components
    sizes = np.bincount(components)
    first = np.unique(components, return_index=True)[1]
    listed = [f"that of point {first[c]} ({sizes[c]} in all)" for c in lacking[:SHOWN]]
    more = f" and {len(lacking) - SHOWN} more" if len(lacking) > SHOWN else ""
    raise InputError(
        "labels",
        f"{needed} or more in each connected component",
        f"{len(lacking)} components with fewer",
        f"Label {', '.join(listed)}{more}; or carry them along (--carry), or drop their points.",
    )


def _bad(expected: str, found: str) -> InputError:
    return InputError("labels", expected, found or "none", "Check which points are given.")

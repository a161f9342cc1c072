"""What of a take goes into a file that holds one matrix: the poses, else the source."""

from __future__ import annotations

from facert.data.arrays import FloatArray
from facert.data.take import Take
from facert.errors import InputError


def named_columns(take: Take) -> tuple[tuple[str, ...], FloatArray]:
    """Names and numbers (T, P) of the poses; of the source weights; or of markers, three each."""
    if take.controls is not None and take.params is not None:
        return take.controls.names, take.params
    if take.source.kind == "weights":
        return take.source.names, take.source.values
    names = tuple(f"{name}.{axis}" for name in take.source.names for axis in "xyz")
    return names, take.source.matrix


def named_curves(take: Take) -> tuple[tuple[str, ...], FloatArray]:
    """Names and numbers (T, P) of the poses, or of the source weights.

    Raises
    ------
    InputError
        When there are only markers.
    """
    if take.params is None and take.source.kind == "markers":
        raise InputError(
            "/target/params",
            "poses or source weights",
            "markers only",
            "Retarget the take first, or write a .csv or .h5 file.",
        )
    return named_columns(take)

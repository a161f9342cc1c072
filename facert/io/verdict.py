"""Verdicts in take files: beside a result, for who shows it later.

========================  ===============  =====================================================
``/verdict/anomaly``      (T,)             how anomalous each frame is
``/verdict/reasons``      (r, T) bool      where each reason is
``/verdict/kinds``        (r,)             UTF-8: what each is about; likewise ``levels``,
                                           ``texts`` and ``cures``
========================  ===============  =====================================================

A verdict is of the very poses that it stands beside: whoever changes a take leaves it out.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from facert.data.arrays import require_finite, require_shape
from facert.data.verdict import LEVELS, Reason, Verdict
from facert.errors import InputError
from facert.io.hdf5 import TAKE_FORMAT, GuardedFile, open_guarded, stated_format
from facert.io.take import Beside

_FIX = "Retarget the take again."
_WORDS = ("kind", "level", "text", "cure")


def beside_result(verdict: Verdict) -> Beside:
    """What `facert.io.take.write_take` is to write beside a result."""
    reasons = verdict.reasons
    frames = np.arange(len(verdict.anomaly))
    words = {f"/verdict/{word}s": tuple(getattr(r, word) for r in reasons) for word in _WORDS}
    masks = [np.isin(frames, reason.frames) for reason in reasons]
    where = np.array(masks, dtype=np.bool_).reshape(len(reasons), len(frames))
    return {"/verdict/anomaly": verdict.anomaly, "/verdict/reasons": where, **words}


def read_verdict(path: Path) -> Verdict | None:
    """The verdict in a take file; None where there is none, or in a file of another kind.

    Raises
    ------
    InputError
        When it is damaged.
    """
    if stated_format(path) != TAKE_FORMAT:
        return None
    with open_guarded(path) as file:
        return _read(file) if "/verdict/anomaly" in file else None


def _read(file: GuardedFile) -> Verdict:
    time, anomaly = file.numbers("/time"), file.numbers("/verdict/anomaly")
    where = file.flags("/verdict/reasons")
    require_shape(anomaly.shape, time.shape, "/verdict/anomaly", _FIX)
    require_finite(anomaly, "/verdict/anomaly", _FIX)
    words = [file.names(f"/verdict/{word}s") for word in _WORDS]
    for word, found in zip(_WORDS, words, strict=True):
        require_shape((len(found),), where.shape[:1], f"/verdict/{word}s", _FIX)
    require_shape(where.shape, (len(words[0]), len(time)), "/verdict/reasons", _FIX)
    unknown = [level for level in words[1] if level not in LEVELS]
    if unknown:
        raise InputError("/verdict/levels", f"one of {', '.join(LEVELS)}", repr(unknown[0]), _FIX)
    rows = zip(*words, where, strict=True)
    reasons = tuple(
        Reason(kind, next(one for one in LEVELS if one == level), text, cure, np.flatnonzero(mask))
        for kind, level, text, cure, mask in rows
    )
    return Verdict(reasons, anomaly, time)

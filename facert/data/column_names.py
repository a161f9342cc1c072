"""Meanings of column names: clocks, counters, rates, confidences and flags beside a face's names.

A name means one of these when all of its words do, or go with such words: ``timestamp_ms``,
``frameNumber``, ``is_tracked``. A word of a face makes it a weight's (``mouthTime``), unless it
ends with a word that no shape is called by, as ``leftEyeConfidence`` does. A letter alone is a
clock only if its values rise: ``t`` and ``s`` are sounds as well.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from enum import Enum
from functools import lru_cache
from typing import TypeVar

from facert.data.spelling import words

_Key = TypeVar("_Key")


class Role(Enum):
    """The meaning of a column that is no weight."""

    CLOCK = "a clock"
    FRAME = "a frame number"
    COUNTER = "a counter"
    RATE = "a rate or delay"
    CONFIDENCE = "a confidence"
    FLAG = "a flag"
    ABSENCE = "a flag of absence"
    SUBJECT = "a subject's number"
    SIZE = "a size"


def _by_word(texts: Mapping[_Key, str]) -> dict[str, _Key]:
    """From each word of the texts to the key of its text."""
    return {word: key for key, text in texts.items() for word in text.split()}


def _set(text: str) -> frozenset[str]:
    return frozenset(text.split())


UNITS = _by_word(
    {
        1.0: "s sec secs second seconds",
        1e-3: "ms msec msecs millis milli millisec millisecond milliseconds",
        1e-6: "us usec usecs micros micro microsecond microseconds",
        1e-9: "ns nsec nsecs nanos nano nanosecond nanoseconds",
        1e-7: "ticks tick",
        60.0: "minute minutes",
    }
)
"""Seconds of a unit of time, by the word for it in a column's name."""

_ROLES = _by_word(
    {
        Role.RATE: "fps rate framerate delta dt latency delay duration exposure interval "
        "process processing inference",
        Role.CONFIDENCE: "confidence conf score quality probability prob certainty reliability "
        "likelihood konfidenz confiance confianza confidenza 信頼度 置信度",
        Role.FLAG: "erkannt success successful succeeded tracked tracking valid validity detected "
        "detection found visible visibility present presence status state ok "
        "done checked approved reviewed note notes comment comments remark remarks",
        Role.ABSENCE: "lost missing absent invalid untracked",
        Role.CLOCK: "time times timestamp timestamps timecode tc stamp clock epoch unix elapsed "
        "datetime date pts utc ts recorded created smpte "
        "zeit zeitstempel temps horodatage tiempo 時間 時刻 时间 时间戳",
        Role.FRAME: "frame frames",
        Role.COUNTER: "index idx row rows id ids uid seq sequence number num no nr count counter "
        "unnamed packet record progress",
    }
)
_NUMBERS = _set("index idx id ids uid number num no nr count counter seq sequence")
_BESIDE = _set(
    "head face faces blend shape shapes blendshape blendshapes landmark landmarks is has device "
    "system capture captured video camera cam image img host local gmt posix world mono monotonic "
    "sensor recv received receive send sent server client arrival relative rel absolute abs since "
    "start code of in the per arkit mediapipe raw data app hw cpu gpu user person subject actor "
    "tracker total wall media hardware software recording "
    "at on sub overall mean average day clip gesicht visage cara"
)
# A name that ends so is no shape's, whatever stands in front.
_LAST = _set("confidence conf timestamp timecode probability")
# Words that mean something only when they are all of a name.
_WHOLE = {
    "t": Role.CLOCK,
    "": Role.COUNTER,
    "#": Role.COUNTER,
    "level 0": Role.COUNTER,
    **dict.fromkeys(UNITS, Role.CLOCK),
}
_PRESENCE = {("has", "face"): Role.FLAG, ("is", "face"): Role.FLAG, ("no", "face"): Role.ABSENCE}

_LONG = sorted((w for w in {*_ROLES, *_BESIDE, *UNITS} if len(w) > 2), key=len, reverse=True)
_JOINED = re.compile(
    f"({'|'.join(_LONG)})({'|'.join([*_LONG, 'ms', 'us', 'ns', 's', 'id', 'no'])})?"
)
_MOST = 40  # letters of a name of this kind
_REMEMBERED = 2**16  # names: a table asks several times for each of its own

_STEMS = _set(
    "brow eyebrow forehead eye lid gaze blink pupil wink nose nostril sneer cheek puff mouth lip "
    "tongue teeth tooth smile frown pucker funnel dimple kiss grin jaw chin neck squint viseme "
    "phoneme happy sad angry anger surprise fear disgust joy sorrow neutral emotion expression "
    "open close wide stretch raise lower upper inner outer roll pitch yaw rotat press shrug left "
    "right corner wrinkle depress tighten compress suck bite swallow throat smirk pout laugh scowl "
    "contempt confus worr scream shout whistle snarl grimace yawn crease bulge flare clench"
)
_FACE_STEMS = tuple(sorted(_STEMS))
_FACE_WORDS = _set("head up down au aa ih ou ee oh ear ears rot vis")
_ACTION_UNIT = re.compile(r"au\d+.*", re.IGNORECASE)


@lru_cache(maxsize=_REMEMBERED)
def role_of_name(name: str) -> Role | None:
    """The meaning of a column by its name alone; None for a weight, and for what may be one.

    >>> role_of_name("timestamp_ms"), role_of_name("faceDetected"), role_of_name("jawOpen")
    (<Role.CLOCK: 'a clock'>, <Role.FLAG: 'a flag'>, None)
    """
    found = name_words(name)
    whole = " ".join(found) or name.strip()
    if whole in _WHOLE:
        return _WHOLE[whole]
    if len(name) > _MOST or not found:
        return None
    if len(found) == 2 and found[0] == "t" and found[1] in UNITS:
        return Role.CLOCK
    known = all(w in _ROLES or w in _BESIDE or w in UNITS or w.isdigit() for w in found)
    if not known and found[-1] not in _LAST:
        return None
    return _role_of_words(found)


def is_letter(name: str) -> bool:
    """Whether a name is one letter, which shows nothing by itself."""
    return len(name.strip()) == 1 and name.strip().isalpha()


def _role_of_words(found: tuple[str, ...]) -> Role | None:
    """The role of a name of such words: of several the one that says most."""
    roles = {_ROLES[word] for word in found if word in _ROLES}
    if roles & {Role.RATE, Role.CONFIDENCE}:
        return Role.RATE if Role.RATE in roles else Role.CONFIDENCE
    if found in _PRESENCE:
        return _PRESENCE[found]
    if not roles:
        ticks = {"ticks", "tick"} & set(found)
        return Role.CLOCK if ticks or all(word in UNITS for word in found) else None
    if _NUMBERS & set(found) and Role.CLOCK not in roles:
        return _role_of_number(found, roles)
    order = (Role.ABSENCE, Role.FLAG, Role.CLOCK, Role.FRAME, Role.COUNTER)
    return next(role for role in order if role in roles)


def _role_of_number(found: tuple[str, ...], roles: set[Role]) -> Role:
    """The role of a number of something: of frames, of faces that are there, of a face, of rows."""
    if Role.FRAME in roles:
        return Role.FRAME
    of_faces = {"face", "faces", "blend", "shape", "shapes", "blendshape", "blendshapes"}
    if of_faces & set(found) and {"count", "num", "number"} & set(found):
        return Role.FLAG
    if {"face", "person", "subject", "actor", "user"} & set(found):
        return Role.SUBJECT
    return Role.COUNTER


@lru_cache(maxsize=_REMEMBERED)
def name_words(name: str) -> tuple[str, ...]:
    """The words of a column's name in lower case; ``timestampms`` is taken apart.

    >>> name_words("Time (ms)"), name_words("timestampms"), name_words("time [µs]")
    (('time', 'ms'), ('timestamp', 'ms'), ('time', 'us'))
    """
    plain = unicodedata.normalize("NFKC", name[: 2 * _MOST]).replace("μs", "us")
    parts: list[str] = []
    for word in words(plain):
        joined = _JOINED.fullmatch(word) if word not in _ROLES else None
        parts += [part for part in joined.groups() if part] if joined else [word]
    return tuple(parts)


def unit_of_name(name: str) -> float | None:
    """Seconds of the unit that a clock's name states, if it states one.

    >>> unit_of_name("timestamp_ms"), unit_of_name("Time [s]"), unit_of_name("time")
    (0.001, 1.0, None)
    """
    found = name_words(name)
    stated = [UNITS[word] for word in found if word in UNITS]
    return stated[-1] if stated else None


@lru_cache(maxsize=_REMEMBERED)
def names_face(name: str) -> bool:
    """Whether a name has a word of a face, so that its values are those of a weight.

    >>> names_face("jawOpen"), names_face("AU12_r"), names_face("ctrl_7")
    (True, True, False)
    """
    found = words(name[: 2 * _MOST])
    stems = any(word.startswith(_FACE_STEMS) or word in _FACE_WORDS for word in found)
    return stems or _ACTION_UNIT.fullmatch(name.strip()) is not None

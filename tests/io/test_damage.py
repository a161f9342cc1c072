"""Files of every format with some bytes changed: facert's errors come out, and nothing else."""

from __future__ import annotations

import json
import struct
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from facert.data.facts import facts_of
from facert.errors import InputError
from facert.io.formats import read_any

FRAMES = range(20)
TABLE = "time,jawOpen,smile\n" + "".join(f"{f / 25},{f % 7 / 7},{f % 5}\n" for f in FRAMES)
MARKERS = "time,a.x,a.y,a.z\n" + "".join(f"{f / 25},{f},{-f},{f % 3}\n" for f in FRAMES)
LIVE_LINK = "Timecode,BlendShapeCount,EyeBlinkLeft,JawOpen\n" + "".join(
    f"10:00:00:{f:02}.000,2,{f % 7 / 7:.4f},{f % 5 / 5:.4f}\n" for f in FRAMES
)
FACE_CAP = "info,x\nbs,jawOpen,smile\n" + "".join(
    f"k,{40 * f}" + ",0" * 10 + f",{f % 7 / 7},{f % 5 / 5}\n" for f in FRAMES
)
TRC = (
    "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tNumMarkers\tNumFrames\tUnits\n25\t1\t20\tmm\n"
    "Frame#\tTime\tchin\n\t\tX1\tY1\tZ1\n"
    + "".join(f"{f + 1}\t{f / 25}\t{f}\t{f % 5}\t1\n" for f in FRAMES)
)
CURVES = json.dumps(
    {"exportFps": 25, "facsNames": ["a", "b"], "weightMat": [[f % 7 / 7, 0.5] for f in FRAMES]}
)
FRAMES_IN_JSON = json.dumps([{"time": f / 25, "weights": {"a": f % 7, "b": 1}} for f in FRAMES])
SEEDS = {
    "table": (".csv", TABLE),
    "markers": (".csv", MARKERS),
    "live link": (".csv", LIVE_LINK),
    "face cap": (".txt", FACE_CAP),
    "trc": (".trc", TRC),
    "curves": (".json", CURVES),
    "frames": (".json", FRAMES_IN_JSON),
}
ODD = ("1e300", "-inf", "nan", "1e-320", "9" * 5000, "", "null", "[", "{", '"', ",", "\n", "\t",
       ":", "\0", "\ud7ff", "true", "-1", "0x1", ";", "٣")  # fmt: skip


def changed(text: str) -> st.SearchStrategy[bytes]:
    """The text with one to three pieces replaced by what is odd."""
    places = st.tuples(st.integers(0, len(text)), st.integers(0, 12), st.sampled_from(ODD))

    def apply(changes: list[tuple[int, int, str]]) -> bytes:
        result = text
        for place, length, odd in changes:
            result = result[:place] + odd + result[place + length :]
        return result.encode()

    return st.lists(places, min_size=1, max_size=3).map(apply)


@pytest.mark.parametrize("kind", SEEDS)
@settings(
    max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_odd_text_gives_a_take_or_one_error(tmp_path: Path, kind: str, data: st.DataObject) -> None:
    ending, text = SEEDS[kind]
    path = tmp_path / f"damaged{ending}"
    path.write_bytes(data.draw(changed(text)))
    with suppress(InputError):
        json.dumps(facts_of(read_any(path)))


def capture() -> bytes:
    """A C3D file of four points without labels."""
    head, parameters = bytearray(512), bytearray(512)
    struct.pack_into("<BBHHHHHfHHf", head, 0, 2, 0x50, 4, 0, 1, 5, 0, -1.0, 3, 0, 25.0)
    parameters[:4] = bytes([0, 0, 1, 84])
    return bytes(head) + bytes(parameters) + np.ones((5, 4, 4), "<f4").tobytes()


@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(places=st.lists(st.tuples(st.integers(0, 800), st.integers(0, 255)), min_size=1, max_size=3))
@pytest.mark.parametrize("ending", [".npz", ".c3d"])
def test_odd_bytes_give_a_take_or_one_error(
    tmp_path: Path, ending: str, places: list[tuple[int, int]]
) -> None:
    path = tmp_path / f"damaged{ending}"
    if ending == ".c3d":
        path.write_bytes(capture())
    else:
        np.savez(path, weights=np.eye(3), weight_names=np.array(["a", "b", "c"]), fps=25.0)
    content = bytearray(path.read_bytes())
    for place, value in places:
        content[place % len(content)] = value
    path.write_bytes(content)
    with suppress(InputError):
        json.dumps(facts_of(read_any(path)))

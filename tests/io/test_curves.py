"""Curves in JSON go out and come back exactly."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from facert.data.take import Controls, Source, Take
from facert.errors import InputError
from facert.io.curves import read_curves, write_curves

AUDIO2FACE = {
    "exportFps": 60.0,
    "trackPath": "speech.wav",
    "numPoses": 2,
    "numFrames": 3,
    "facsNames": ["jawOpen", "mouthClose"],
    "weightMat": [[0.0, 0.25], [0.5, 0], [1.0, 0.125]],
}


@pytest.fixture(name="path")
def _path(tmp_path: Path) -> Path:
    return tmp_path / "curves.json"


def test_an_export_of_audio2face_is_a_take(path: Path) -> None:
    path.write_text(json.dumps(AUDIO2FACE))
    take = read_curves(path)
    assert take.source.names == ("jawOpen", "mouthClose")
    np.testing.assert_array_equal(take.source.values, AUDIO2FACE["weightMat"])
    np.testing.assert_allclose(take.time, [0, 1 / 60, 2 / 60])


@settings(deadline=None, max_examples=25)
@given(arrays.arrays(float, (4, 2), elements=st.floats(-1e3, 1e3)))
def test_writing_and_reading_change_nothing(tmp_path_factory, values) -> None:
    path = tmp_path_factory.mktemp("curves") / "a.json"
    values[1] = np.nan
    time = [0.1, 0.2, 0.4, 1 / 3 + 1]
    take = Take(time, Source(values, ("a", "b")), fps=7.5, start_timecode="01:00:00:00")
    write_curves(take, path)
    read = read_curves(path)
    np.testing.assert_array_equal(read.source.values, values)
    np.testing.assert_array_equal(read.time, take.time)
    assert (read.fps, read.start_timecode) == (7.5, "01:00:00:00")
    again = path.with_name("b.json")
    write_curves(read, again)
    assert again.read_bytes() == path.read_bytes()


def test_poses_come_before_the_source_and_markers_are_no_curves(path: Path) -> None:
    source = Source(np.ones((2, 1, 3)), ("m",))
    with pytest.raises(InputError, match="markers only"):
        write_curves(Take([0, 1], source), path)
    assert not path.exists()
    write_curves(Take([0, 1], source, Controls(("jaw",)), [[0.5], [np.nan]]), path)
    assert json.loads(path.read_text())["weightMat"] == [[0.5], [None]]


def test_a_rate_that_the_file_does_not_say_must_be_given(path: Path) -> None:
    path.write_text(json.dumps({"names": ["a"], "weights": [[1.0], [2.0]]}))
    np.testing.assert_allclose(read_curves(path, fps=25.0).time, [0, 0.04])
    with pytest.raises(InputError, match="--in-fps"):
        read_curves(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"exportFps": 0}, "exportFps"),
        ({"exportFps": "fast"}, "exportFps"),
        ({"exportFps": None}, "exportFps"),
        ({"numPoses": 5}, "numPoses: expected 2"),
        ({"numFrames": "3"}, "numFrames: expected 3"),
        ({"facsNames": ["a"]}, "rows of 1 numbers"),
        ({"facsNames": ["a", "a"]}, "twice"),
        ({"facsNames": [1, 2]}, "a list of names"),
        ({"facsNames": "ab"}, "a list of names"),
        ({"weightMat": [[1, 2], [3]]}, "rows of equal length"),
        ({"weightMat": [["1", "2"]]}, "numbers"),
        ({"weightMat": [[True, False]]}, "numbers"),
        ({"weightMat": [], "numFrames": 0}, "rows of 2 numbers"),
        ({"weightMat": {}}, "numbers"),
        ({"weightMat": [[10**400, 0]]}, "numbers"),
        ({"weightMat": [[1e999, 0]] * 3}, "finite"),
        ({"time": [0, 1]}, "/time"),
        ({"time": [0, 1, 1]}, "/time"),
        ({"time": "now"}, "time: expected numbers"),
        ({"startTimecode": 7}, "startTimecode"),
        ({"startTimecode": "\x1b[31m"}, "control characters"),
    ],
)
def test_what_is_wrong_is_named(path: Path, change: dict, message: str) -> None:
    path.write_text(json.dumps({**AUDIO2FACE, **change}))
    with pytest.raises(InputError, match=message) as caught:
        read_curves(path)
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize("text", ["", "{", "[1]", "[" * 100_000, "1" * 5000, '{"facsNames": []}'])
def test_other_text_is_refused(path: Path, text: str) -> None:
    path.write_text(text)
    with pytest.raises(InputError, match=r"curves\.json"):
        read_curves(path)

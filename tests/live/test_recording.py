import resource
import shutil
from contextlib import ExitStack, closing
from dataclasses import replace

import numpy as np
import pytest

import facert
from facert.data.take import Controls
from facert.errors import InputError, OutputExistsError, OutputKeptError
from facert.io.folder import takes_in
from facert.io.formats import read_take_file
from facert.live.frames import Frame, frame_pattern
from facert.live.recording import Recordings
from facert.retarget.stream import Streamed

CONTROLS = Controls(("jawOpen", "cheekPuff"), np.array([[0.0, 1.0], [0.0, 2.0]]))
RNG = np.random.default_rng(0)
WEIGHTS = [Frame(5.0 + number / 60, RNG.random(3), 0.0) for number in range(8)]
MARKERS = [Frame(number / 60, RNG.random((4, 3)), 0.0) for number in range(8)]


@pytest.fixture
def recordings():
    """Makes recordings of the frames above, or of others."""
    with ExitStack() as stack:

        def make(pattern=None, overwrite=False):
            pattern = pattern or frame_pattern(["a", "b", "c"])
            return stack.enter_context(
                closing(Recordings(pattern, ("a", "b"), CONTROLS, overwrite))
            )

        yield make


def pose(frame, std=None):
    return Streamed(frame.values.ravel()[:2], lambda: (std, 2.0 * frame.values[:2]))


def test_what_comes_in_is_written_as_a_take_that_begins_at_0(recordings, tmp_path):
    files = recordings()
    record = files.source(tmp_path / "in.h5")
    for frame in WEIGHTS:
        record.add(frame)
    assert files.write("10:00:00:00.000") == [tmp_path / "in.h5"]
    take = facert.read_take(tmp_path / "in.h5")
    np.testing.assert_array_equal(take.source.values, [frame.values for frame in WEIGHTS])
    np.testing.assert_allclose(take.time, np.arange(8) / 60, atol=1e-12)
    assert (take.source.names, take.fps) == (("a", "b", "c"), 60.0)
    assert take.start_timecode == "10:00:00:00.000"


def test_what_was_not_observed_stays_so(recordings, tmp_path):
    files = recordings(frame_pattern(["a", "b", "c", "d"], "markers", "cm"))
    record = files.source(tmp_path / "in.h5")
    hidden = MARKERS[0].values.copy()
    hidden[2] = np.nan
    for frame in (replace(MARKERS[0], values=hidden), *MARKERS[1:]):
        record.add(frame)
    files.write("")
    take = facert.read_take(tmp_path / "in.h5")
    np.testing.assert_array_equal(take.source.values[0], hidden)
    assert take.units == "cm"


@pytest.mark.parametrize("frames", [WEIGHTS, MARKERS])
def test_poses_are_written_with_their_std_and_the_cleaned_source(recordings, tmp_path, frames):
    kind = "markers" if frames is MARKERS else "weights"
    files = recordings(frame_pattern("abcd"[: len(frames[0].values)], kind))
    spread = np.array([0.1, 0.2])
    with_std, without = files.poses(tmp_path / "out.h5"), files.poses(tmp_path / "out.csv")
    for frame in frames:
        with_std.send(frame, pose(frame, spread))
        without.send(frame, pose(frame))
    files.write("")
    take = facert.read_take(tmp_path / "out.h5")
    np.testing.assert_array_equal(take.params, [frame.values.ravel()[:2] for frame in frames])
    np.testing.assert_array_equal(take.std, np.tile(spread, (8, 1)))
    np.testing.assert_array_equal(take.source.values, [2 * frame.values[:2] for frame in frames])
    np.testing.assert_array_equal(take.controls.limits, CONTROLS.limits)
    table = np.loadtxt(tmp_path / "out.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(table[:, 1:], take.params, atol=1e-9)


def test_a_file_that_exists_is_refused_before_the_show(recordings, tmp_path):
    path = tmp_path / "in.h5"
    facert.write_take(frame_pattern("ab"), path)
    before = path.read_bytes()
    with pytest.raises(OutputExistsError):
        recordings().source(path)
    recordings(overwrite=True).source(path)
    assert path.read_bytes() == before
    path.write_text("precious")
    with pytest.raises(OutputKeptError):
        recordings(overwrite=True).source(path)


def test_a_recording_that_appears_during_the_show_stays_even_with_overwrite(recordings, tmp_path):
    files = recordings(overwrite=True)
    files.source(tmp_path / "in.h5").add(WEIGHTS[0])
    (tmp_path / "in.h5").write_text("precious")
    assert files.write("") == [tmp_path / "in-2.h5"]
    assert (tmp_path / "in.h5").read_text() == "precious"


def test_a_file_that_appears_during_the_show_is_left_alone(recordings, tmp_path, caplog):
    files = recordings()
    record = files.source(tmp_path / "in.livelink.h5")
    record.add(WEIGHTS[0])
    for name in ("in.livelink.h5", "in-2.livelink.h5"):
        (tmp_path / name).write_text("precious")
    assert files.write("") == [tmp_path / "in-3.livelink.h5"]
    assert len(facert.read_take(tmp_path / "in-3.livelink.h5")) == 1
    assert (tmp_path / "in.livelink.h5").read_text() == "precious"
    assert "in.livelink.h5 appeared meanwhile: written to" in caplog.text


@pytest.mark.parametrize("name", ["in.txt", "in.livelink.csv"])
def test_a_format_that_cannot_hold_the_take_is_refused_before_the_show(recordings, tmp_path, name):
    with pytest.raises(InputError):
        recordings().source(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_two_recordings_need_two_files(recordings, tmp_path):
    files = recordings()
    files.source(tmp_path / "a.h5")
    with pytest.raises(InputError, match="a file for each"):
        files.poses(tmp_path / "a.h5")


def test_without_a_frame_nothing_is_written(recordings, tmp_path, caplog):
    files = recordings()
    files.source(tmp_path / "in.h5")
    files.poses(tmp_path / "out.h5")
    assert files.write("") == []
    assert not list(tmp_path.iterdir())
    assert caplog.text.count("no frame") == 2


def test_what_the_format_cannot_hold_in_the_end_is_kept_as_hdf5(recordings, tmp_path, caplog):
    files = recordings(frame_pattern(["jawOpen", "cheekPuff", "mouthClose"]))
    record = files.source(tmp_path / "in.livelink.csv")
    record.add(Frame(0.0, np.array([0.5, np.nan, 0.1]), 0.0))
    assert files.write("") == [tmp_path / "in.livelink.csv.h5"]
    assert "instead" in caplog.text
    take = facert.read_take(tmp_path / "in.livelink.csv.h5")
    np.testing.assert_array_equal(take.source.values, [[0.5, np.nan, 0.1]])


def test_one_file_that_fails_does_not_take_the_others_along(recordings, tmp_path):
    files = recordings()
    first, second = files.source(tmp_path / "gone" / "in.h5"), files.source(tmp_path / "in.h5")
    for record in (first, second):
        record.add(WEIGHTS[0])
    shutil.rmtree(tmp_path / "gone")
    (tmp_path / "gone").write_text("in the way")
    with pytest.raises(InputError):
        files.write("")
    assert len(facert.read_take(tmp_path / "in.h5")) == 1


@pytest.mark.parametrize("frames", [WEIGHTS, MARKERS])
def test_what_a_killed_session_recorded_is_there_and_the_next_one_keeps_it(
    recordings, tmp_path, caplog, frames
):
    kind = "markers" if frames is MARKERS else "weights"
    files = recordings(frame_pattern("abcd"[: len(frames[0].values)], kind, "cm"))
    source, poses = files.source(tmp_path / "in.h5"), files.poses(tmp_path / "out.csv")
    for frame in frames:
        source.add(frame)
        poses.send(frame, pose(frame))
    left, _ = files.going_on
    with left.open("ab") as file:
        file.write(b"a row cut")  # no session does, a power cut may
    assert takes_in(tmp_path) == []
    take, posed = (read_take_file(path) for path in files.going_on)
    np.testing.assert_array_equal(take.source.values, [frame.values for frame in frames])
    assert (take.units, posed.controls.names) == ("cm", CONTROLS.names)
    np.testing.assert_array_equal(posed.controls.limits, CONTROLS.limits)
    np.testing.assert_array_equal(posed.params, [frame.values.ravel()[:2] for frame in frames])
    files.close()  # as a process that ends
    assert recordings().source(tmp_path / "in.h5")
    assert "the 8 frames that it recorded are in" in caplog.text
    assert len(facert.read_take(tmp_path / "in-recovered.h5")) == 8


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{}\n",
        b'{"format": "facert-recording"}\n' + bytes(80),
        b'{"format": "facert-recording", "format_version": 1, "kind": "weights", "names": 5}\n',
        b'{"format": "facert-recording", "format_version": 2}\n',
        b'{"format": "facert-recording", "format_version": 1, "kind": "weights", "names": ["a"], '
        b'"controls": null, "limits": null, "units": [], "start_timecode": ""}\n' + bytes(80),
        b"[" * 100_000,
    ],
)
def test_a_damaged_recording_is_an_error_about_it(tmp_path, content):
    path = tmp_path / "in.h5.recording"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"in\.h5\.recording"):
        read_take_file(path)


def test_when_the_disk_is_full_the_frames_before_stay(recordings, tmp_path, caplog):
    files = recordings()
    record = files.source(tmp_path / "in.h5")
    record.add(WEIGHTS[0])
    size = record.recording.stat().st_size
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size + 100, before[1]))
    try:
        for frame in WEIGHTS[1:]:
            record.add(frame)
        with pytest.raises(InputError, match=r"All frames are in .*in\.h5\.recording") as failed:
            files.write("")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert failed.value.where == str(tmp_path / "in.h5")
    assert "recorded no further than 4 frames: File too large" in caplog.text
    files.close()
    assert len(read_take_file(record.recording)) == 4

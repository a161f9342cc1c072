"""Poses from elsewhere become labels of the right frames."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facert.data.corrections import put_in, taken_out
from facert.data.labelling import Poses, labelled, of_character, poses_of, weights_as_poses
from facert.data.rig import Rig
from facert.data.take import Controls, Corrections, Source, Take
from facert.errors import InputError

TAKE = Take(np.arange(10) / 30, Source(np.ones((10, 1, 3)), ("m",)), fps=30.0)
VALUES = np.array([[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]])
NAMES = ("jaw", "smile_L")


def numbered(*frames: int) -> Poses:
    return Poses(NAMES, VALUES[: len(frames)], frames=np.array(frames))


def test_rows_that_name_frames_become_labels() -> None:
    found = labelled(TAKE, numbered(7, 0, 3))
    assert found.labels.tolist() == [0, 3, 7]
    np.testing.assert_array_equal(found.params[[7, 0, 3]], VALUES)
    assert found.controls.names == NAMES


def test_rows_with_times_go_to_the_nearest_frame() -> None:
    found = labelled(TAKE, Poses(NAMES, VALUES, time=np.array([0.0, 0.104, 0.29])))
    assert found.labels.tolist() == [0, 3, 9]


def test_times_and_frame_numbers_say_the_same() -> None:
    by_time = labelled(TAKE, Poses(NAMES, VALUES, time=TAKE.time[[2, 5, 6]]))
    np.testing.assert_array_equal(by_time.params, labelled(TAKE, numbered(2, 5, 6)).params)


def test_new_poses_come_to_those_there_are_whatever_the_order_of_the_controls() -> None:
    first = labelled(TAKE, numbered(1, 2))
    more = Poses(("smile-left", "Jaw"), [[0.9, 0.8]], frames=np.array([2]))
    found = labelled(first, replace(more, values=np.array(more.values)))
    assert found.labels.tolist() == [1, 2]
    np.testing.assert_array_equal(found.params[1:3], [[0.1, 0.2], [0.8, 0.9]])
    assert found.controls.names == NAMES


def test_rows_without_values_are_no_poses() -> None:
    values = VALUES.copy()
    values[1] = np.nan
    assert labelled(TAKE, Poses(NAMES, values, frames=np.arange(3))).labels.tolist() == [0, 2]
    elsewhere = Poses(NAMES, values, time=np.array([0.0, 99.0, 0.1]))
    assert labelled(TAKE, elsewhere).labels.tolist() == [0, 3]


@pytest.mark.parametrize(
    ("poses", "message"),
    [
        (numbered(3, 10), "expected 0 to 9, found 10"),
        (numbered(-1), "found -1"),
        (numbered(4, 4), "two for 4"),
        (Poses(NAMES, VALUES[:1], time=np.array([0.4])), "such as 0.300 s, found 0.400 s"),
        (Poses(NAMES, VALUES[:1], time=np.array([np.nan])), "time of the poses"),
        (Poses(NAMES, VALUES[:1] * np.nan, frames=np.array([0])), "a pose at least"),
        (
            Poses(NAMES, np.array([[1, np.nan]]), frames=np.array([0])),
            "none for 'smile_L'.*known in part",
        ),
        (Poses(("a", "a"), VALUES[:1], frames=np.array([0])), "twice"),
    ],
)
def test_poses_that_fit_no_frame_are_refused(poses: Poses, message: str) -> None:
    with pytest.raises(InputError, match=message):
        labelled(TAKE, poses)


@pytest.mark.parametrize("names", [("jaw", "frown"), ("jaw", "smile_L", "frown")])
def test_a_take_with_other_controls_refuses_them(names: tuple[str, ...]) -> None:
    more = Poses(names, np.ones((1, len(names))), frames=np.array([0]))
    with pytest.raises(InputError, match="names of the poses"):
        labelled(labelled(TAKE, numbered(1)), more)


def test_another_take_gives_its_poses_or_its_weights_with_their_times() -> None:
    posed = labelled(TAKE, numbered(2, 5, 6))
    np.testing.assert_array_equal(labelled(TAKE, poses_of(posed)).params, posed.params)
    weights = Take([0.1, 0.2], Source(VALUES[:2], NAMES))
    assert labelled(TAKE, poses_of(weights)).labels.tolist() == [3, 6]
    with pytest.raises(InputError, match="markers only"):
        poses_of(TAKE)


def test_tracked_weights_pose_a_rig_that_has_their_shapes() -> None:
    rig = Rig(np.eye(3), np.zeros((3, 3, 3)), ("Jaw", "smileLeft", "frown"), [[0, 1, 2]])
    values = np.array([[0.1, 0.2, 9.0], [np.nan, 0.4, 9.0]])
    take = weights_as_poses(Take([0, 1], Source(values, (*NAMES, "headYaw"))), rig)
    assert take.controls.names == NAMES
    np.testing.assert_array_equal(take.params, [[0.1, 0.2], [np.nan, np.nan]])
    with pytest.raises(InputError, match="Give another rig"):
        weights_as_poses(Take([0, 1], Source(values, ("a", "b", "c"))), rig)
    with pytest.raises(InputError, match="gaps in every frame"):
        weights_as_poses(Take([0], Source(values[1:], (*NAMES, "headYaw"))), rig)


def test_times_in_milliseconds_are_thought_of_in_the_message() -> None:
    poses = Poses(NAMES, VALUES, time=np.array([0.0, 100.0, 200.0]))
    with pytest.raises(InputError, match="milliseconds, call the column time_ms"):
        labelled(TAKE, poses)
    with pytest.raises(InputError, match="Count seconds as the take does"):
        labelled(TAKE, replace(poses, time=np.array([0.0, 100.0, 9000.0])))


def test_numbers_and_times_that_name_other_frames_are_warned_of(
    caplog: pytest.LogCaptureFixture,
) -> None:
    kept = np.delete(np.arange(20), [4, 5, 6])
    take = Take(kept / 30, Source(np.ones((17, 1)), ("w",)), fps=30.0, clock_start=100.0)
    poses = replace(numbered(2, 8, 12), time=100 + np.array([2, 8, 12]) / 30, of_clock=True)
    found = labelled(take, poses)
    assert found.labels.tolist() == [2, 8, 12]
    assert "2 poses by number and by time at different frames, such as 8 and 5" in caplog.text
    caplog.clear()
    labelled(take, replace(poses, time=100 + kept[[2, 8, 12]] / 30))
    labelled(take, replace(poses, time=np.array([7.0, 8.0, 12.0])))  # another clock's
    assert not caplog.text


def test_poses_that_a_model_predicted_are_left_out_of_the_labels(caplog) -> None:
    caplog.set_level("INFO", "facert")
    first = labelled(TAKE, numbered(1, 2, 5))
    std = np.where(np.arange(10)[:, None] == 2, np.nan, 0.1) * np.ones(2)
    result = replace(first, std=std)
    assert labelled(result, numbered(7)).labels.tolist() == [2, 7]
    assert "2 poses that a model predicted: left out" in caplog.text


def test_a_corrected_take_gets_the_controls_of_its_character() -> None:
    whole = labelled(TAKE, Poses(NAMES, np.full((10, 2), 0.5), frames=np.arange(10)))
    corrected = put_in(whole, Corrections(np.array([3]), np.array([[0.9, 0.1]]), np.array([0.2])))
    found = of_character(corrected, Controls(("smile_L", "brow", "jaw"), None))
    assert found.params[3].tolist() == [0.1, 0, 0.9]
    assert taken_out(found).params[3].tolist() == [0.5, 0, 0.5]

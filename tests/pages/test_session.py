from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import facert
from facert.data.rig import Rig
from facert.data.take import Controls
from facert.errors import InputError
from facert.io.take import with_recording
from facert.pages.session import PosingSession, character_controls, output_beside

NAMES = ["jaw", "smile", "brow", "blink"]


@pytest.fixture
def session(make_take, tmp_path) -> PosingSession:
    take = make_take(animation=0)
    return PosingSession(take.controls, take, output=tmp_path / "take.posed.h5")


def free_frame(session: PosingSession) -> int:
    return int(np.setdiff1d(np.arange(len(session.take)), session.take.labels)[0])


def test_a_saved_pose_is_a_label_here_and_in_the_file(session) -> None:
    before, frame = session.take, free_frame(session)
    pose = np.array([0.1, 0.2, 0.3, 0.4])
    path = session.save(frame, pose)
    written = facert.read_take(path)
    assert written.params[frame].tolist() == pose.tolist()
    others = np.delete(np.arange(len(before)), frame)
    np.testing.assert_array_equal(written.params[others], before.params[others])
    np.testing.assert_array_equal(written.source.values, before.source.values)
    assert session.pose(frame)[0].tolist() == pose.tolist()
    assert list(path.parent.iterdir()) == [path]


def test_a_pose_is_taken_back_here_and_in_the_file(session) -> None:
    before, frame = session.take.labels, free_frame(session)
    session.save(frame, np.zeros(4))
    assert session.label(frame).pose.tolist() == [0.0] * 4
    session.put(frame, None)
    assert session.label(frame) is None
    assert session.saved == 0
    np.testing.assert_array_equal(facert.read_take(session.output).labels, before)


def test_a_label_counts_only_once_it_is_written(make_take, tmp_path) -> None:
    blocked, take = tmp_path / "file", make_take(animation=0)
    blocked.write_text("no folder")
    session = PosingSession(take.controls, take, output=blocked / "take.posed.h5")
    frame = free_frame(session)
    with pytest.raises(InputError, match="output"):
        session.save(frame, np.zeros(4))
    assert frame not in session.take.labels
    assert session.saved == 0


def test_training_tells_poses_for_all_frames_and_writes_the_model(session) -> None:
    frame = free_frame(session)
    assert session.pose(frame) == (None, None)
    first = session.train()
    assert first.labels == 12
    assert first.change is None
    pose, std = session.pose(frame)
    assert pose.shape == std.shape == (4,)
    session.save(frame, pose + 0.2)
    second = session.train()
    assert second.labels == 13
    assert second.change > 0
    model = facert.load(session.model_path)
    np.testing.assert_allclose(model.retarget(session.take).params, session.result.params)


def test_what_the_first_model_knew_of_poses_is_not_lost(make_take, tmp_path) -> None:
    model = facert.train(make_take(), facert.Settings(method="gpr"))
    bare = make_take(posed=3, animation=0)
    session = PosingSession(model.controls, bare, model, tmp_path / "take.posed.h5")
    assert len(session.known.poses) == len(model.poses) + 3
    session.train()
    assert len(session.model.poses) == len(model.poses) + 3


def test_predicted_poses_are_no_labels(make_take) -> None:
    take = make_take()
    model = facert.train(take, facert.Settings(method="gpr"))
    session = PosingSession(model.controls, model.retarget(take), model)
    assert not len(session.take.labels)


def test_corrections_of_a_result_are_labels(make_take) -> None:
    take = make_take()
    model = facert.train(take, facert.Settings(method="gpr"))
    shot = facert.correct(model.retarget(take), {7: {"jaw": 0.1}}, only=True)
    session = PosingSession(model.controls, shot, model)
    assert session.take.labels.tolist() == [7]
    assert session.take.params[7, 0] == 0.1


def test_controls_are_matched_by_name(make_take) -> None:
    take = make_take()
    turned = Controls(NAMES[::-1])
    session = PosingSession(turned, take)
    frame = int(take.labels[0])
    assert session.pose(frame)[0].tolist() == take.params[frame][::-1].tolist()
    with pytest.raises(InputError, match="ear"):
        PosingSession(Controls(["ear", *NAMES[1:]]), take)


def test_suggestions_are_frames_without_a_pose(session) -> None:
    frames = session.suggestion(4).frames
    assert not set(frames.tolist()) & set(session.take.labels.tolist())
    session.save(int(frames[0]), np.zeros(4))
    assert int(frames[0]) not in session.suggestion(4).frames.tolist()


def test_poses_of_a_character_are_known_from_three_on(make_take, tmp_path) -> None:
    take = replace(make_take(posed=0, animation=0), controls=Controls(NAMES))
    session = PosingSession(take.controls, take, output=tmp_path / "a.posed.h5")
    for frame in range(3):
        assert session.known is None
        session.save(frame, np.full(4, 0.1 * frame))
    assert len(session.known.poses) == 3


def test_without_a_take_nothing_is_saved_or_learned() -> None:
    session = PosingSession(Controls(NAMES))
    for attempt in (lambda: session.save(0, np.zeros(4)), session.train):
        with pytest.raises(InputError, match="--take"):
            attempt()


def test_controls_come_from_the_model_the_take_or_the_rig(make_take) -> None:
    rig = Rig(np.zeros((3, 3)), np.zeros((1, 3, 3)), ("ear",), np.array([[0, 1, 2]]))
    assert character_controls(None, make_take(), rig).names == tuple(NAMES)
    assert character_controls(None, None, rig).limits.tolist() == [[0.0, 1.0]]
    with pytest.raises(InputError, match="the character"):
        character_controls(None, None, None)


@pytest.mark.parametrize(
    ("take", "output"),
    [("a/take.h5", "a/take.posed.h5"), ("take.csv", "take.posed.h5"), ("t.posed.h5", "t.posed.h5")],
)
def test_labels_go_beside_the_take(take: str, output: str, make_take) -> None:
    assert output_beside(Path(take), make_take()) == Path(output)


@pytest.fixture(scope="module")
def model(make_take):
    return facert.train(make_take(), facert.Settings(method="gpr"))


@pytest.fixture
def corrected(make_take, model, tmp_path) -> PosingSession:
    """A session on what retarget wrote."""
    take, path = make_take(posed=0, animation=0), tmp_path / "result.h5"
    result = model.retarget(take)
    assert output_beside(path, result) == path
    return PosingSession(model.controls, result, None, path, ["result.h5"], [take.source])


def test_a_changed_frame_of_a_result_is_a_correction_blended_and_taken_back(corrected) -> None:
    before = corrected.result.params
    pose = before[20] + 0.2
    corrected.save(20, pose, width=0.4)
    written = facert.read_take(corrected.output)
    assert written.corrections.frames.tolist() == [20]
    np.testing.assert_allclose(written.params[20], pose)
    np.testing.assert_array_equal(written.source.values, corrected.result.source.values)
    recorded = with_recording(written, corrected.output).source
    np.testing.assert_array_equal(recorded.values, corrected.part.recording.source.values)
    moved = np.abs(written.params - before).max(axis=1)
    assert 0 < moved[21] < moved[20]
    assert moved[30] == 0
    np.testing.assert_array_equal(corrected.pose(21)[0], written.params[21])
    again = PosingSession(corrected.controls, written, output=corrected.output)
    assert again.label(20).width == 0.4
    np.testing.assert_array_equal(again.result.params, before)
    again.put(20, None)
    bare = facert.read_take(corrected.output)
    assert bare.corrections is None
    np.testing.assert_array_equal(bare.params, before)


def test_corrections_alone_are_not_learned_from(corrected) -> None:
    corrected.save(20, np.zeros(4))
    with pytest.raises(InputError, match="a take that was posed"):
        corrected.train()


def test_takes_are_learned_from_together_and_each_is_saved_beside_itself(
    make_take, model, tmp_path
) -> None:
    posed, other = make_take(animation=0), make_take(seed=5, posed=0, animation=0)
    paths = [tmp_path / "a.posed.h5", tmp_path / "b.posed.h5"]
    session = PosingSession(posed.controls, [posed, other], model, paths, ["a", "b"])
    session.here = 1
    session.save(3, np.full(4, 0.1))
    assert [path.exists() for path in paths] == [False, True]
    assert session.saved_of(1) == session.saved == 1
    found = session.suggestion(4)
    assert set(found.takes.tolist()) <= {0, 1}
    assert (1, 3) not in zip(found.takes.tolist(), found.frames.tolist(), strict=True)
    trained = session.train()
    assert trained.labels == 13
    assert session.model_path == tmp_path / "a.posed.safetensors"
    assert session.pose(7)[0].shape == (4,)
    assert session.verdict().level in ("good", "look at it", "bad")


def test_a_label_is_blended_into_what_was_predicted(make_take, model, tmp_path) -> None:
    take = make_take(animation=0)
    session = PosingSession(take.controls, take, model, tmp_path / "take.posed.h5")
    frame = free_frame(session)
    before = session.result.params[frame]
    session.save(frame, before + 0.3)
    shown = session.part.shown.params
    np.testing.assert_allclose(shown[frame], before + 0.3)
    assert not np.isnan(shown).any()
    assert facert.read_take(session.output).params[frame].tolist() == (before + 0.3).tolist()

"""`facert.complete_pose`: names and values in, a whole pose out."""

from dataclasses import replace

import numpy as np
import pytest

import facert
from facert import Controls, InputError, Settings
from facert.data.arrays import rms

NAMES = ["jawOpen", "mouthSmile_L", "browInnerUp", "cheekPuff"]
QUICK = {"latent_dim": 3, "neighbours": 5, "max_iterations": 5, "unlabelled": 30}
LIMITED = Controls(NAMES, np.tile([-3.0, 3.0], (4, 1)))


@pytest.fixture(scope="module")
def take(make_take):
    """A take of 12 labels and 20 poses of animation."""
    return replace(make_take(), controls=Controls(NAMES))


@pytest.fixture(scope="module")
def trained(take):
    """A retargeter."""
    return facert.train(take, Settings(method="ridge"))


@pytest.mark.parametrize("method", ["ssgpr", "ssgplvm", "nearest"])
def test_a_model_of_any_method_knows_poses_and_keeps_them(take, tmp_path, method):
    path = tmp_path / "model.safetensors"
    trained = facert.train(take, Settings(method=method, **QUICK))
    trained.save(path)
    done = facert.complete_pose(facert.load(path), {"jawOpen": 0.2})
    np.testing.assert_allclose(done.pose, facert.complete_pose(take, {"jawOpen": 0.2}).pose)


def test_names_come_in_any_spelling_and_order(trained):
    done = facert.complete_pose(trained, {"BrowInnerUp": 0.1, "mouth-smile-left": 0.2})
    same = facert.complete_pose(trained, {"mouthSmile_L": 0.2, "browInnerUp": 0.1})
    np.testing.assert_allclose(done.pose, same.pose, atol=1e-9)
    assert done.given == {"browInnerUp": 0.1, "mouthSmile_L": 0.2}
    assert (done.pose[[2, 1]] == [0.1, 0.2]).all()


def test_poses_become_a_take_that_can_be_read_again(trained, tmp_path):
    done = facert.complete_pose(trained, {"jawOpen": 0.2}, samples=3)
    facert.write_take(done.as_take, tmp_path / "poses.h5")
    again = facert.read_take(tmp_path / "poses.h5")
    assert (again.params == np.vstack([done.pose, done.samples])).all()
    assert (again.std[0] == done.std).all()
    assert again.source.names == ("jawOpen",)


@pytest.fixture(scope="module")
def start(trained, take):
    """The first frame, retargeted."""
    one = replace(
        take,
        time=take.time[:1],
        source=replace(take.source, values=take.source.values[:1]),
        params=None,
        animation=None,
    )
    return trained.retarget(one)


def test_a_retargeted_frame_is_corrected(trained, take, start):
    same = facert.complete_pose(trained, {"jawOpen": start.params[0, 0]}, start=start)
    np.testing.assert_allclose(same.pose, start.params[0], atol=1e-9)
    other = facert.complete_pose(trained, {"jawOpen": start.params[0, 0] + 0.1}, start=start)
    assert (np.abs(other.pose - start.params[0]) > 1e-6).sum() > 1
    with pytest.raises(InputError, match="start: expected one frame"):
        facert.complete_pose(trained, {"jawOpen": 0.1}, start=trained.retarget(take))


def test_controls_are_held_by_name_or_pattern_unless_they_are_set(trained, start):
    before = start.params[0]
    given = {"jawOpen": before[0] + 0.1}
    for hold in (["*S*", "jaw*"], ["mouth-smile-left"]):
        done = facert.complete_pose(trained, given, start=start, hold=hold)
        assert done.held == ("mouthSmile_L",)
        assert done.as_dict["held"] == ["mouthSmile_L"]
        assert done.pose[1] == before[1]
        assert done.pose[0] == given["jawOpen"]
    with pytest.raises(InputError, match="Did you mean 'browInnerUp'"):
        facert.complete_pose(trained, given, start=start, hold=["browInner"])
    with pytest.raises(InputError, match="a pattern that some fit, found 'eye"):
        facert.complete_pose(trained, given, start=start, hold=["eye*"])
    with pytest.raises(InputError, match="--from"):
        facert.complete_pose(trained, given, hold=["mouth*"])


@pytest.mark.parametrize("corrected", [False, True])
def test_values_far_from_every_known_pose_are_warned_of(trained, start, caplog, corrected):
    facert.complete_pose(trained, {"jawOpen": 9.0}, start=start if corrected else None)
    assert "no known pose comes near" in caplog.text


@pytest.mark.parametrize(
    ("given", "options", "message"),
    [
        ({}, {}, "given controls: expected at least one"),
        ({"jawOpenn": 0.1}, {}, "Did you mean 'jawOpen'\\?"),
        ({"jawOpen": 3.1}, {}, "jawOpen: expected a value from -3 to 3, found 3.1"),
        ({"jawOpen": np.nan}, {}, "jawOpen: expected a number, found nan"),
        ({"jawOpen": 0.1, "jaw_open": 0.2}, {}, "a name each for 'jawOpen' and 'jaw_open'"),
        ({"jawOpen": 0.1}, {"soft": -1.0}, "soft: expected"),
        ({"jawOpen": 0.1}, {"samples": -1}, "samples: expected"),
    ],
)
def test_what_cannot_be_is_refused(take, given, options, message):
    with pytest.raises(InputError, match=message):
        facert.complete_pose(replace(take, controls=LIMITED), given, **options)


def test_a_model_whose_poses_are_of_another_character_is_not_saved(trained, tmp_path):
    with pytest.raises(InputError, match=r"target\.poses: expected 4 columns"):
        replace(trained, poses=np.zeros((5, 3))).save(tmp_path / "model.safetensors")
    assert not list(tmp_path.iterdir())


def test_a_model_file_of_before_poses_were_kept_still_retargets(trained, take, tmp_path):
    replace(trained, poses=None).save(tmp_path / "model.safetensors")
    loaded = facert.load(tmp_path / "model.safetensors")
    assert (loaded.retarget(take).params == trained.retarget(take).params).all()


def test_without_known_poses_there_is_no_answer(trained, make_take):
    for character in (make_take(posed=0, animation=0), replace(trained, poses=None)):
        with pytest.raises(InputError, match="poses of the character: expected at least 3"):
            facert.complete_pose(character, {"jaw": 0.1})


def test_values_beyond_the_known_poses_are_warned_of(take, caplog):
    facert.complete_pose(replace(take, controls=LIMITED), {"jawOpen": 2.9})
    assert "jawOpen: 2.9 is outside the range of the known poses (-" in caplog.text
    assert "no known pose comes near" in caplog.text


@pytest.mark.real
@pytest.mark.parametrize(("name", "target"), [("utterance_b", "units"), ("rom", "arkit")])
def test_real_poses_are_completed_better_than_by_the_nearest_one(real_data, name, target):
    take = facert.read_take(real_data / "tracks" / f"{name}.npz", target=target)
    order = np.random.default_rng(0).permutation(len(take))
    known, test = take.params[order[:100]], take.params[order[100:160]]
    character = replace(take, params=None, animation=known)
    given = np.argsort(-known.std(axis=0))[:5]
    names = [take.controls.names[index] for index in given]
    done = [
        facert.complete_pose(character, dict(zip(names, row[given], strict=True))) for row in test
    ]
    errors = np.delete(np.array([one.pose for one in done]) - test, given, axis=1)
    std = np.delete(np.array([one.std for one in done]), given, axis=1)
    gaps = ((test[:, None, given] - known[:, given]) ** 2).sum(axis=2)
    nearest = np.delete(known[gaps.argmin(axis=1)] - test, given, axis=1)
    assert rms(errors) < 0.9 * rms(nearest)
    assert 1 / 1.5 < rms(errors) / rms(std) < 1.5

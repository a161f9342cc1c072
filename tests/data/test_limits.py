"""Limits of controls are stated, a rig's, or seen from poses; and say so."""

from __future__ import annotations

import json
import logging
from dataclasses import replace

import numpy as np
import pytest

from facert import Settings, load, train
from facert.data.facts import facts_of
from facert.data.limits import UNLIMITED, bounds_of, parse_limits, rig_controls, with_limits
from facert.data.rig import Rig
from facert.data.take import Controls, Source, Take
from facert.errors import InputError

NAMES = ("jaw", "smile_L", "smile_R", "brow")


@pytest.fixture(autouse=True)
def _logged(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "facert")


def posed(poses: object, limits: object = None) -> Take:
    values = np.array(poses, dtype=float)
    source = Source(np.ones((len(values), 1)), ("w",))
    return Take(np.arange(len(values)) / 30, source, Controls(NAMES, limits), values)


SHARES = [[0.0, 0.2, 0.3, 0], [0.9, 0, 0, 0.1]]


def test_controls_within_0_and_1_may_go_so_far_and_the_log_says_so(caplog) -> None:
    found = with_limits(posed(SHARES)).controls.limits
    assert found.tolist() == [[0, 1]] * 4
    assert "all 4 controls limited to 0..1" in caplog.text
    assert "--limits" in caplog.text


def test_one_that_leaves_them_has_no_limit_but_its_poses() -> None:
    take = with_limits(posed([[25.0, 0.2, 0.3, 0], [-4.0, 0, 0.1, 0.1]]))
    assert take.controls.limits.tolist() == [list(UNLIMITED), [0, 1], [0, 1], [0, 1]]
    bounds = bounds_of(take.controls.limits, take.params)
    assert bounds.tolist() == [[-4, 25], [0, 1], [0, 1], [0, 1]]


def test_a_rig_in_percent_has_none(caplog) -> None:
    take = with_limits(posed(100 * np.array(SHARES) + [[0, 0, 0, 0.5]]))
    assert np.isinf(take.controls.limits).all()
    assert not caplog.text


def test_what_is_stated_counts_for_all_and_then_for_names() -> None:
    stated = parse_limits(["smile*=0..0.8", "-1..1", "jaw = none"])
    found = with_limits(posed(SHARES), stated).controls.limits
    assert found.tolist() == [list(UNLIMITED), [0, 0.8], [0, 0.8], [-1, 1]]
    none = with_limits(posed(SHARES), parse_limits(["none"])).controls.limits
    assert np.isinf(none).all()


def test_limits_that_a_take_has_stay(caplog) -> None:
    assert with_limits(posed(SHARES, [[0, 2]] * 4)).controls.limits.tolist() == [[0, 2]] * 4
    assert not caplog.text


def test_an_overdriven_shape_widens_its_limit_but_no_slip_does(caplog) -> None:
    take = posed([[1.2, 0, 40.0, -0.3], [0.9, 0, -0.2, 50.0]], [[0, 1]] * 4)
    found = with_limits(take).controls.limits
    np.testing.assert_allclose(found, [[0, 1.2], [0, 1], [-0.2, 1], [-0.3, 1]])
    assert "widened to poses beyond them: jaw 0..1.2, smile_R -0.2..1, brow -0.3..1" in caplog.text
    stated = with_limits(take, parse_limits(["0..1"])).controls.limits
    assert stated.tolist() == [[0, 1]] * 4


def test_driven_controls_have_the_same_limit_on_either_side(caplog) -> None:
    rig = Rig(np.eye(3), np.zeros((1, 3, 3)), ("smile",), [[0, 1, 2]])
    controls = rig_controls(rig, ("eyeYaw", "jaw", "turn"))
    assert controls.limits.tolist() == [[0, 1], *[list(UNLIMITED)] * 3]
    values = np.array([[0.1, -0.57, 0.0, 5.0], [0.9, 0.2, 0.7, 30.0]])
    take = posed(values)
    take = replace(take, controls=controls)
    found = with_limits(take, parse_limits(["jaw=0..0.8"]), of_rig=True).controls.limits
    assert found.tolist() == [[0, 1], [-1, 1], [0, 0.8], list(UNLIMITED)]
    assert "driven, and limited to -1..1 by their poses: eyeYaw; --limits" in caplog.text
    assert with_limits(take).controls.limits[1].tolist() == list(UNLIMITED)


def test_a_control_with_several_poses_far_beyond_is_not_widened(caplog) -> None:
    found = with_limits(posed([[1.6, 0, 0, 0], [35, 0, 0, 1], [20, 0, 0, 0]], [[0, 1]] * 4))
    assert found.controls.limits.tolist() == [[0, 1]] * 4
    assert "widened" not in caplog.text


@pytest.mark.parametrize(
    "text", ["", "1..0", "0.5", "jaw=", "=0..1", "a..b", "0..inf", "nan..1", "jaw=0..1e999"]
)
def test_other_words_are_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"--limits: expected LO\.\.HI"):
        parse_limits([text])


def test_a_typo_in_a_stated_name_is_named() -> None:
    with pytest.raises(InputError, match=r"'smille_L'.*Did you mean 'smile_L'"):
        with_limits(posed(SHARES), parse_limits(["smille_L=0..1"]))


def test_a_model_of_controls_without_limits_is_read_again(make_take, tmp_path) -> None:
    take = with_limits(make_take(), parse_limits(["jaw=none", "smile=-9..9"]))
    model = train(take, Settings(method="nearest"))
    model.save(tmp_path / "model.safetensors")
    again = load(tmp_path / "model.safetensors")
    np.testing.assert_array_equal(again.controls.limits, take.controls.limits)
    poses = np.vstack([take.params[take.labels], take.animation])
    assert again.bounds[0].tolist() == [poses[:, 0].min(), poses[:, 0].max()]
    assert again.bounds[1, 1] > poses[:, 1].max()
    free = train(take, Settings(method="nearest", limits="declared"))
    free.save(tmp_path / "free.safetensors")
    free = load(tmp_path / "free.safetensors")
    assert free.bounds[:2].tolist() == [list(UNLIMITED), [-9, 9]]
    facts = json.dumps(facts_of(take), allow_nan=False)
    assert "[null, null], [-9.0, 9.0]" in facts

"""Poses in percent, degrees among shares and clipped poses are warned of; honest rigs are not."""

from __future__ import annotations

import logging

import numpy as np
import pytest

from facert.data.take import Controls, Source, Take
from facert.preprocess.label_checks import warn_of_labels

NAMES = ("jawOpen", "smile_L", "smile_R", "brow_L", "brow_R", "blink_L", "blink_R", "pucker")


@pytest.fixture(name="shares")
def _shares() -> np.ndarray:
    """Poses (16, 8) from 0 to 1, half of whose values are 0."""
    rng = np.random.default_rng(3)
    return rng.random((16, 8)).round(4) * (rng.random((16, 8)) < 0.5)


@pytest.fixture(name="logged")
def _logged(caplog: pytest.LogCaptureFixture):
    """What is logged of poses, a line each; notes begin with a bracket."""

    def logged(poses: np.ndarray, names=NAMES, limits=None) -> list[str]:
        caplog.clear()
        caplog.set_level(logging.INFO, "facert")
        limits = None if limits is None else np.tile(limits, (len(names), 1))
        source = Source(np.ones((len(poses), 1)), ("w",))
        time = np.arange(len(poses)) / 30
        warn_of_labels(Take(time, source, Controls(names, limits), poses))
        notes = caplog.records
        return [("" if r.levelno >= logging.WARNING else "(") + r.getMessage() for r in notes]

    return logged


def test_a_control_in_percent_is_named_with_value_and_fix(shares, logged) -> None:
    shares[:, 0] *= 100
    (line,) = logged(shares)
    assert line.startswith("in percent or degrees")
    assert f"jawOpen up to {shares[:, 0].max():.4g}" in line
    assert "divide" in line
    assert "--limits 'jawOpen=0..100'" in line
    assert len(logged(shares, limits=(0.0, 1.0))) == 1
    assert logged(shares, limits=(0.0, 100.0)) == []


def test_poses_all_in_percent_are_known_by_the_limits_of_the_rig(shares, logged) -> None:
    """Without limits they are a rig that counts so."""
    assert logged(100 * shares) == []
    (line,) = logged(100 * shares, limits=(0.0, 1.0))
    assert line.startswith("in percent, it seems")


@pytest.fixture(name="mostly_shut")
def _mostly_shut(shares) -> np.ndarray:
    """The same with a jaw in percent that is open in three poses."""
    shares[:, 0] = [1.3, 0.7, 0.9, 23.8, 10.4, 35.6, 0, 0.2, 0, 0.2, 0, 0.3, 0.4, 0, 1.6, 2.3]
    return shares


def test_a_jaw_that_is_mostly_shut_is_named_percent_in_one_line(mostly_shut, logged) -> None:
    (line,) = logged(mostly_shut)
    assert line.startswith("in percent or degrees among fractions, it seems: jawOpen up to 35.6;")
    (line,) = logged(mostly_shut, limits=(0.0, 1.0))
    assert line.startswith("in percent, it seems")
    assert "jawOpen up to 35.6; divide by 100" in line
    assert "--limits" not in line
    names = ("mouthRollUpper", *NAMES[1:])
    assert logged(mostly_shut, names=names)[0].startswith("in percent or degrees")


def test_poses_that_are_all_in_percent_are_named_once_where_the_rig_goes_to_1(
    shares, logged
) -> None:
    shares[:, 7] = 0
    shares[3, 7] = 0.02
    (line,) = logged(100 * shares, limits=(0.0, 1.0))
    assert line.startswith("in percent, it seems")
    assert "and 3 more; divide by 100" in line


def test_slips_of_a_control_are_one_line_which_says_what_they_are_as_percent(
    shares, logged
) -> None:
    shares[5, 2], shares[6, 2] = 0.0, 35.0
    (line,) = logged(shares)
    assert "frame 6 has smile_R at 35, " in line
    assert line.endswith("if it is a slip, such as percent for 0.35")
    (line,) = logged(shares, limits=(0.0, 1.0))
    assert "percent for 0.35" in line


def test_a_control_that_hardly_moves_is_not_cut_off(shares, logged) -> None:
    shares[:, 4] = np.minimum(shares[:, 4], 0.4).round(2) / 10
    assert logged(shares) == []


@pytest.mark.parametrize("rows", [[4], [0, 3, 5, 6, 9, 11, 12, 15]])
def test_rows_in_percent_are_named_once(shares, logged, rows) -> None:
    shares[rows] = np.where(shares[rows] > 0.05, 100 * shares[rows], 0)
    (line,) = logged(shares)
    assert f"({', '.join(map(str, rows[:5]))}" in line
    assert "in percent" in line
    assert "divide them by 100" in line


def test_honest_rigs_are_not_warned_of(shares, logged) -> None:
    metahuman = shares * np.where(np.arange(8) % 2, -1, 1)
    jaw = np.linspace(0, 25, 16)[:, None]
    ten, overdriven = shares.copy(), shares.copy()
    ten[:, 3:6] *= 10
    overdriven[3, 4] = 1.4
    for poses in (shares, metahuman, 100 * shares, 10 * shares, ten, overdriven):
        assert logged(poses) == []
    assert logged(jaw, names=("jaw_angle",)) == []
    assert logged(np.hstack([shares[:, :2] * 100, jaw]), names=("a", "b", "jaw")) == []


def test_an_angle_by_its_name_is_a_note(shares, logged) -> None:
    shares[:, 2] = np.linspace(-30, 40, 16)
    names = ("jawOpen", "smile_L", "head_rotateX", *NAMES[3:])
    (line,) = logged(shares, names=("jawOpen", "smile_L", "head.rotX", *NAMES[3:]))
    assert line.startswith("(angles among shares: head.rotX up to 40")
    assert logged(shares, names=names)[0].startswith(("(", "in percent"))


def test_many_poses_at_one_highest_value_were_cut_off(shares, logged) -> None:
    clipped = np.minimum(shares, 0.4)
    (line,) = logged(clipped)
    assert "cut off, it seems" in line
    assert "jawOpen at 0.4 in" in line
    by_hand = np.minimum(np.round(shares * 20) / 20, 0.4)
    assert logged(by_hand) == []
    beyond = np.minimum(2.0 * shares, 1.0)
    (line,) = logged(beyond)
    assert line.startswith("(often exactly where they end")


def test_a_value_beyond_its_limits_is_named(shares, logged) -> None:
    shares[2, 1] = 1.5
    (line,) = logged(shares, limits=(0.0, 1.0))
    assert "frame 2 has smile_L at 1.5, beyond its limits 0..1" in line
    assert "--limits 'smile_L=0..1.5'" in line


def test_controls_that_no_pose_moves_are_named_in_one_line(shares, logged) -> None:
    shares[:, [5, 6]] = 0
    assert logged(shares) == ["(2 controls that no pose moves, and no prediction will: "
                             "blink_L, blink_R"]  # fmt: skip

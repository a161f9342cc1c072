"""Takes are matched to the first: units, names, controls, limits, and old animation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facert.data.matching_takes import as_takes
from facert.data.take import Controls, Source, Take
from facert.data.takes import Takes
from facert.errors import InputError

NAMES = ("a.h5", "b.h5")


@pytest.fixture(name="first")
def _first(make_take) -> Take:
    return make_take(animation=0)


@pytest.fixture(name="second")
def _second(make_take) -> Take:
    return make_take(frames=40, posed=5, animation=0, seed=0)


def with_controls(take: Take, names, limits=None) -> Take:
    return replace(take, controls=Controls(names, limits))


def weights(names, values) -> Take:
    return Take(np.arange(len(values)) / 30.0, Source(np.asarray(values), names))


def test_a_single_take_is_itself(first) -> None:
    assert as_takes(first).joined is as_takes([first]).joined is first


def test_frames_of_all_keep_their_take_and_number(first, second) -> None:
    takes = as_takes([first, second], names=NAMES)
    joined = takes.joined
    assert len(joined) == 100
    assert joined.time[60] - joined.time[59] > 10 / 30
    np.testing.assert_array_equal(joined.params[60:], second.params)
    assert takes.frame_name(0) == "a.h5:0"
    assert takes.frame_name(63) == "b.h5:3"
    places, frames = takes.located(np.array([59, 60, 99]))
    assert places.tolist() == [0, 1, 1]
    assert frames.tolist() == [59, 0, 39]


def test_positions_come_in_the_unit_of_the_first(first, second) -> None:
    in_mm = replace(
        second, units="mm", source=replace(second.source, values=10 * second.source.values)
    )
    found = as_takes([first, in_mm]).parts[1]
    assert found.units == "cm"
    np.testing.assert_allclose(found.source.values, second.source.values)


def test_a_marker_that_a_take_lacks_is_not_observed_there(first, second, caplog) -> None:
    caplog.set_level("INFO")
    source = second.source
    names = ("M4", "extra", *source.names[:3])
    values = np.concatenate(
        [source.values[:, 4:], source.values[:, :1] + 1, source.values[:, :3]], 1
    )
    takes = as_takes([first, replace(second, source=Source(values, names))], names=NAMES)
    one, other = (part.source for part in takes.parts)
    assert one.names == other.names == (*source.names, "extra")
    assert not one.valid[:, 5].any()
    assert not other.valid[:, 3].any()
    np.testing.assert_array_equal(other.values[:, [0, 1, 2, 4]], source.values[:, [0, 1, 2, 4]])
    assert "b.h5: in no take before, where they are taken as not observed: 'extra'" in caplog.text


def test_a_misspelt_marker_is_asked_about(first, second, caplog) -> None:
    def named(take: Take, name: str) -> Take:
        return replace(take, source=Source(take.source.values, (*take.source.names[:4], name)))

    as_takes([named(first, "nose_tip"), named(second, "nose_tpi")], names=NAMES)
    assert "b.h5: 'nose_tpi' is in no take before: did you mean 'nose_tip'?" in caplog.text


def test_another_set_or_kind_is_an_error_with_both_files(first, second) -> None:
    other = replace(second, source=Source(second.source.values, [f"point{i}" for i in range(5)]))
    with pytest.raises(InputError, match=r"b\.h5: /source/names: .*a\.h5"):
        as_takes([first, other], names=NAMES)
    numbers = replace(second, source=Source(second.source.matrix, [f"w{i}" for i in range(15)]))
    with pytest.raises(InputError, match=r"b\.h5: /source: expected markers, as a\.h5 has"):
        as_takes([first, numbers], names=NAMES)


def test_controls_in_another_order_and_spelling_are_those_of_the_first(first, second) -> None:
    order = [2, 0, 3, 1]
    spelled = replace(
        with_controls(second, ["Brow", "JAW", "blink", "Smile"]), params=second.params[:, order]
    )
    found = as_takes([first, spelled]).parts[1]
    assert found.controls.names == first.controls.names
    np.testing.assert_array_equal(found.params, second.params)


@pytest.mark.parametrize("names", [["jaw", "smle", "brow", "blink"]])
def test_a_misspelt_control_is_named_with_its_file(first, second, names) -> None:
    with pytest.raises(InputError, match=r"b\.h5: .*'smile'.*Did you mean 'smle'"):
        as_takes([first, with_controls(second, names)], names=NAMES)


def test_controls_of_a_take_without_a_pose_do_not_matter(first, second) -> None:
    bare = replace(with_controls(second, ["w", "x", "y", "z"]), params=None)
    assert as_takes([bare, first]).joined.controls.names == first.controls.names


def test_limits_are_the_widest_and_hold_what_was_posed(first, second) -> None:
    narrow, wide = ([[low, 1.0]] * 4 for low in (0.0, -1.0))
    both = [
        with_controls(take, first.controls.names, limits)
        for take, limits in ((first, narrow), (second, wide))
    ]
    np.testing.assert_array_equal(as_takes(both).joined.controls.limits, wide)
    found = as_takes([both[0], second]).joined.controls.limits
    lowest = np.nanmin(second.params, axis=0)
    np.testing.assert_array_equal(found[:, 0], np.minimum(0.0, lowest))


def test_old_animation_is_matched_by_name(first, caplog) -> None:
    caplog.set_level("INFO")
    old = weights(["Smile", "tongue", "jaw", "blink", "brow"], np.arange(15.0).reshape(3, 5))
    found = as_takes(first, old, animation_names=["old.glb"])
    np.testing.assert_array_equal(found.animation, old.source.values[:, [2, 0, 4, 3]])
    assert "1 control that the takes do not have, passed over ('tongue')" in caplog.text
    np.testing.assert_array_equal(found.joined.animation, found.animation)


def test_a_control_that_animation_lacks_is_at_rest_and_a_misspelt_one_an_error(
    first, caplog
) -> None:
    values = np.ones((3, 3))
    found = as_takes(first, weights(["jaw", "smile", "brow"], values), animation_names=["old.csv"])
    np.testing.assert_array_equal(found.animation, [[1.0, 1.0, 1.0, 0.0]] * 3)
    assert "taken to be at 0 throughout, as it lacks them: 'blink'" in caplog.text
    typo = weights(["jaw", "smile", "brow", "blnik"], np.ones((3, 4)))
    with pytest.raises(InputError, match=r"old\.csv: .*'blink'.*Did you mean 'blnik'"):
        as_takes(first, typo, animation_names=["old.csv"])


def test_poses_and_animation_of_old_takes_count_and_gaps_do_not(make_take, caplog) -> None:
    caplog.set_level("INFO")
    first, old = make_take(animation=7), make_take(posed=12, animation=20, seed=0)
    predicted = replace(old, std=np.full_like(old.params, 0.1))
    gaps = weights(first.controls.names, [[1.0, np.nan, 1.0, 1.0], [1.0, 1.0, 1.0, 1.0]])
    found = as_takes(first, [predicted, gaps])
    assert len(found.animation) == 7 + 12 + 20 + 1
    assert "a model predicted its poses" in caplog.text


def test_takes_with_a_pose_are_those_to_learn_from(first, second) -> None:
    bare = replace(second, params=None)
    takes = as_takes([bare, first], names=NAMES)
    assert takes.posed.names == ("b.h5",)
    assert as_takes([first, second]).posed.names == ("take 1", "take 2")
    assert isinstance(takes.posed, Takes)


def test_a_first_take_without_a_unit_is_taken_to_be_in_that_of_the_others(first, second) -> None:
    parts = as_takes([replace(first, units=""), replace(second, units="mm")]).parts
    assert [part.units for part in parts] == ["mm", "mm"]


@pytest.mark.parametrize(
    ("poses", "old", "odd"), [(1, 100, True), (100, 1, True), (1, 1, False), (10, 1, False)]
)
def test_animation_in_percent_beside_shares_is_warned_of(first, caplog, poses, old, odd) -> None:
    shares = np.random.default_rng(0).random((30, 4))
    assert first.controls is not None
    take = replace(
        first, params=np.where(np.isnan(first.params), np.nan, poses * shares.max(axis=0))
    )
    as_takes(take, weights(first.controls.names, old * shares))
    warned = [one.getMessage() for one in caplog.records if one.levelname == "WARNING"]
    assert bool(warned) == odd
    assert all("percent" in text for text in warned)

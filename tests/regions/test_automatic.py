"""Regions found in a take."""

from dataclasses import replace

import numpy as np
import pytest

from facert import Controls, InputError, Settings, Source, Take, train
from facert.regions.automatic import BETWEEN, LOWER, UPPER, find_regions, sides_by_name
from facert.regions.bipartition import two_groups
from facert.retarget.options import AS_IT_IS

CONTROLS = ("browInnerUp", "eyeBlink_L", "eyeBlink_R", "jawOpen", "mouthSmile", "mouthPucker")
UPPER_CONTROLS, LOWER_CONTROLS = CONTROLS[:3], CONTROLS[3:]


def make_face(controls=CONTROLS, frames=240, labels=12, seed=0, together=0.0):
    """Six controls move 14 markers: the first three those above, the others those below.

    In the labels, upper controls are so far `together` with the lower ones.
    """
    rng = np.random.default_rng(seed)
    heights = np.linspace(-8.0, 8.0, 14)
    width = rng.uniform(-5.0, 5.0, 14)
    places = np.stack([width, heights, 9.0 - 0.1 * width**2], axis=1)
    shapes = rng.normal(size=(6, 14, 3))
    shapes[:3, heights < 1.0] = 0.0
    shapes[3:, heights > 1.0] = 0.0
    shapes[3:] *= 4.0  # a jaw moves further than a brow
    poses = rng.random((frames, 6))
    params = np.full_like(poses, np.nan)
    chosen = rng.permutation(frames)[:labels]
    poses[chosen, :3] += together * (poses[chosen, 3:] - poses[chosen, :3])
    params[chosen] = poses[chosen]
    markers = places + np.tensordot(poses, shapes, axes=1) * 0.2
    names = [f"m{i:02}" for i in range(14)]
    take = Take(
        np.arange(frames) / 30.0, Source(markers, names), Controls(controls), params, units="cm"
    )
    return take, tuple(np.array(names)[heights > 1.0]), tuple(np.array(names)[heights < 1.0])


def parts(take):
    return {part.name: part for part in find_regions(take).parts}


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("together", [0.0, 0.7])
def test_brows_and_mouth_come_apart(seed, together):
    take, above, below = make_face(seed=seed, together=together)
    found = parts(take)
    assert found[UPPER].markers == above
    assert found[LOWER].markers == below
    assert found[UPPER].controls == UPPER_CONTROLS
    assert found[LOWER].controls == LOWER_CONTROLS
    assert BETWEEN not in found


@pytest.mark.parametrize("controls", [CONTROLS, [f"control{i}" for i in range(6)]])
@pytest.mark.parametrize("brows_move", [1.0, 30.0])
def test_which_group_comes_first_does_not_matter(monkeypatch, controls, brows_move):
    """The groups follow an eigenvector's sign, which differs between machines."""
    take, _, _ = make_face(controls, together=0.95)
    values, params = take.source.values.copy(), take.params.copy()
    values[:, 8:] = values[0, 8:] + brows_move * (values[:, 8:] - values[0, 8:])
    params[:, :3] *= brows_move
    take = replace(take, source=replace(take.source, values=values), params=params)
    found = find_regions(take)
    monkeypatch.setattr("facert.regions.automatic.two_groups", lambda frames: ~two_groups(frames))
    assert find_regions(take) == found


def test_names_without_a_side_leave_it_to_the_labels():
    take, above, _ = make_face([f"control{i}" for i in range(6)], labels=30)
    found = parts(take)
    assert found[UPPER].markers == above  # the calmer ones
    assert set(found[UPPER].controls) <= {f"control{i}" for i in range(3)}
    assert set(found[LOWER].controls) <= {f"control{i}" for i in range(3, 6)}
    assert len(found[UPPER].controls) + len(found[LOWER].controls) >= 5


def test_nose_and_cheeks_see_the_whole_face():
    take, above, below = make_face((*CONTROLS[:4], "noseSneer", "cheekPuff"))
    between = parts(take)[BETWEEN]
    assert between.controls == ("noseSneer", "cheekPuff")
    assert set(between.markers) == {*above, *below}


def test_every_control_is_in_one_region_and_fits_the_take():
    take, _, _ = make_face((*CONTROLS[:4], "noseSneer", "thing"))
    regions = find_regions(take)
    assert regions.matched(take.source.names, take.controls.names) == regions
    named = [control for part in regions.parts for control in part.controls]
    assert sorted(named) == sorted(take.controls.names)


@pytest.mark.parametrize("names", [["jawOpen", *(f"mouth{i}" for i in range(5))], ["brow"] * 0])
def test_a_mouth_alone_is_learned_as_a_whole(names):
    take, _, _ = make_face(names or [f"mouth{i}" for i in range(6)])
    (whole,) = find_regions(take).parts
    assert whole.markers == take.source.names
    assert whole.controls == take.controls.names


def test_controls_that_never_move_make_no_region():
    take, _, _ = make_face((*CONTROLS[:4], "noseSneer", "cheekPuff"))
    still = replace(take, params=take.params * [1, 1, 1, 1, 0, 0])
    found = parts(still)
    assert BETWEEN not in found
    assert {"noseSneer", "cheekPuff"} < set(found[LOWER].controls)
    train(still, Settings(method="ridge", regions="auto", smooth=False, detect=False))


def test_hidden_markers_do_no_harm():
    take, above, _ = make_face()
    values = take.source.values.copy()
    values[np.random.default_rng(0).random(values.shape[:2]) < 0.3] = np.nan
    values[:, 0] = np.nan  # never seen
    found = parts(replace(take, source=replace(take.source, values=values)))
    assert found[UPPER].markers == above
    assert "m00" not in found[LOWER].markers


def test_weights_go_by_their_names():
    weights = ("eyeBlinkLeft", "browDownLeft", "jawOpen", "mouthSmileLeft", "cheekPuff", "extra")
    rng = np.random.default_rng(0)
    take = Take(
        np.arange(50.0),
        Source(rng.random((50, 6)), weights),
        Controls(CONTROLS),
        rng.random((50, 6)),
    )
    found = parts(take)
    assert found[UPPER].markers == ("eyeBlinkLeft", "browDownLeft", "cheekPuff", "extra")
    assert found[LOWER].markers == ("jawOpen", "mouthSmileLeft", "cheekPuff", "extra")


def test_three_weights_are_too_few_to_part():
    rng = np.random.default_rng(0)
    source = Source(rng.random((40, 3)), ["a", "b", "c"])
    take = Take(np.arange(40.0), source, Controls(["d", "e"]), rng.random((40, 2)))
    assert len(find_regions(take).parts) == 1


def test_sides_follow_from_the_groups_of_names():
    names = ["browDown_L", "eyeWide", "cheekPuff", "nose-left-elevation", "jaw_open", "control3"]
    np.testing.assert_array_equal(sides_by_name(names), [1.0, 1.0, 0.0, 0.0, -1.0, np.nan])


def test_a_take_without_poses_is_refused():
    take, _, _ = make_face()
    with pytest.raises(InputError, match="/target: expected poses in some frames"):
        find_regions(replace(take, params=None))


def test_regions_keep_the_brows_still_when_only_the_mouth_moves():
    """Where brows and mouth went together in every label, the whole face learns it as a law."""
    take, _, below = make_face(together=0.95, labels=8)
    values = take.source.values.copy()
    still = ~np.isin(take.source.names, below)
    values[:, still] = values[0, still]
    alone = replace(take, source=replace(take.source, values=values), params=None)

    def moved(regions):
        settings = Settings(method="ridge", regions=regions, smooth=False, detect=False)
        result = train(take, settings).retarget(alone, options=AS_IT_IS)
        return np.ptp(result.params[:, :3], axis=0).max()

    assert moved("auto") < 1e-9
    assert moved(None) > 0.2


@pytest.mark.real
@pytest.mark.parametrize(
    ("track", "target"),
    [("rom", "arkit"), ("utterance_a", "units"), ("optical_eyebrows", "solved")],
)
def test_real_faces_come_apart_below_the_eyes(real_data, track, target):
    from facert import read_take

    take = read_take(real_data / "tracks" / f"{track}.npz", target=target)
    chosen = np.random.default_rng(0).permutation(len(take))[:10]
    params = np.full_like(take.params, np.nan)
    params[chosen] = take.params[chosen]
    found = parts(replace(take, params=params))
    height = dict(zip(take.source.names, np.nanmean(take.source.values, axis=0)[:, 1], strict=True))
    lowest = min(height[name] for name in found[UPPER].markers)
    highest = max(height[name] for name in found[LOWER].markers)
    spread = np.ptp(list(height.values()))
    assert abs(lowest - highest) < 0.1 * spread
    assert 0.25 < (max(height.values()) - lowest) / spread < 0.55

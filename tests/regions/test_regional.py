"""A method a region, behind the interface of one method."""

from dataclasses import replace

import numpy as np
import pytest

import facert
from facert import InputError, Settings
from facert.data.regions import Region, Regions
from facert.methods.registry import REGISTRY
from facert.regions.regional import Regional, RegionLayout
from facert.retarget.options import AS_IT_IS

every_method = pytest.mark.parametrize("name", REGISTRY)
QUICK = {
    "latent_dim": 2,
    "neighbours": 4,
    "max_iterations": 15,
    "unlabelled": 10,
    "smooth": False,
    "detect": False,
}
UPPER = Region("upper", ("m0", "m1", "m2"), ("brow", "blink", "smile"))
LOWER = Region("lower", ("m2", "m3", "m4"), ("jaw", "smile"))
TWO = Regions((UPPER, LOWER))


@pytest.fixture(scope="module")
def take(make_take):
    return make_take(frames=30, posed=8, animation=10)


@pytest.fixture(scope="module")
def trained(take):
    """A retargeter of each method in two regions, trained once."""
    kept = {}

    def train(name):
        if name not in kept:
            kept[name] = facert.train(take, Settings(method=name, regions=TWO, **QUICK))
        return kept[name]

    return train


def retargeted(retargeter, take, mode="offline"):
    """Params, std and cleaned source, frame by frame as they are."""
    result = retargeter.retarget(take, mode, AS_IT_IS)
    return result.params, result.std, result.source.values


def assert_same(one, other, tolerance):
    for a, b in zip(one, other, strict=True):
        assert (a is None) == (b is None)
        if a is not None:
            np.testing.assert_allclose(a, b, rtol=0, atol=tolerance)


def hide(take, share=0.2):
    values = take.source.values.copy()
    values[np.random.default_rng(0).random(values.shape[:2]) < share] = np.nan
    return replace(take, source=replace(take.source, values=values))


@every_method
def test_one_region_of_everything_is_the_method_itself(name, take):
    everything = Regions((Region("face", take.source.names, take.controls.names),))
    plain = facert.train(take, Settings(method=name, **QUICK))
    alone = facert.train(take, Settings(method=name, regions=everything, **QUICK))
    for mode in ("offline", "online"):
        assert_same(retargeted(alone, hide(take), mode), retargeted(plain, hide(take), mode), 1e-12)


@every_method
def test_a_saved_and_loaded_model_predicts_the_same(name, trained, take, tmp_path):
    trained(name).save(tmp_path / "model.safetensors")
    loaded = facert.load(tmp_path / "model.safetensors")
    assert loaded.settings == trained(name).settings
    for mode in ("offline", "online"):
        assert_same(
            retargeted(loaded, hide(take), mode), retargeted(trained(name), hide(take), mode), 1e-10
        )


@every_method
def test_gaps_are_filled_and_every_frame_gets_a_pose(name, trained, take):
    params, std, source = retargeted(trained(name), hide(take, 0.6))
    assert np.isfinite(params).all()
    assert np.isfinite(source).all()
    assert std is None or (std > 0).all()


@every_method
def test_a_region_does_not_depend_on_the_markers_of_others(name, trained, take):
    values = take.source.values.copy()
    values[:, 4] += np.random.default_rng(0).normal(size=values[:, 4].shape)
    shaken = replace(take, source=replace(take.source, values=values))
    before, after = (retargeted(trained(name), t)[0] for t in (take, shaken))
    moved = np.abs(after - before).max(axis=0)
    controls = dict(zip(take.controls.names, moved, strict=True))
    assert controls["brow"] == 0.0
    assert controls["blink"] == 0.0
    assert controls["jaw"] > 0.0
    assert controls["smile"] > 0.0


def test_known_poses_are_recognised_and_poses_completed(trained, take):
    retargeter = trained("ridge")
    assert len(retargeter.without_known(take).labels) == 0
    assert facert.complete_pose(retargeter, {"jaw": 0.1}).pose[0] == 0.1


def test_frames_are_suggested_where_regions_are_uncertain(trained, make_take):
    from facert.posing.suggested_frames import suggest_frames

    assert (
        len(suggest_frames(make_take(frames=30, posed=0, animation=0), 3, trained("auto")).frames)
        == 3
    )


def test_a_shared_control_is_the_weighted_mean_of_its_regions(take):
    apart = [facert.train(take, Settings(method="ridge", regions=TWO)).method for _ in range(3)]
    frames = np.random.default_rng(0).normal(size=(7, 15))
    row = take.controls.names.index("smile")
    layout = apart[0].layout_
    predicted = []
    for method, share in zip(apart, (0.5, 1.0, 0.0), strict=True):
        weights = layout.weights.copy()
        weights[:, row] = share, 1.0 - share
        method.layout_ = replace(layout, weights=weights)
        predicted.append(method.predict(frames).Y[:, row])
    np.testing.assert_allclose(predicted[0], (predicted[1] + predicted[2]) / 2.0, atol=1e-12)


def test_the_region_that_predicts_a_shared_control_weighs_more(take):
    """Where the lower markers are noise, the upper ones are believed."""
    rng = np.random.default_rng(0)
    values = take.source.values.copy()
    values[:, 2:] = rng.normal(size=values[:, 2:].shape)
    noisy = replace(take, source=replace(take.source, values=values))
    two = Regions((replace(UPPER, markers=("m0", "m1")), replace(LOWER, markers=("m3", "m4"))))
    settings = Settings(method="ridge", regions=two, smooth=False, detect=False)
    lower, upper = train_layout(noisy, settings).weights.T[take.controls.names.index("smile")]
    assert lower + upper == pytest.approx(1.0)
    assert upper > 0.9


def train_layout(take, settings):
    return facert.train(take, settings).method.layout_


def test_the_unit_of_a_region_does_not_matter(take):
    """As if it were all there is: its share of the motion of the face is not seen."""
    names, apart = take.source.names, Regions((UPPER, replace(LOWER, markers=("m3", "m4"))))
    small = take.source.values * np.where(np.isin(names, UPPER.markers), 1e-3, 1.0)[:, None]
    settings = Settings(method="gpr", regions=apart, smooth=False, detect=False)
    results = [
        retargeted(facert.train(t, settings), t)[0]
        for t in (take, replace(take, source=replace(take.source, values=small)))
    ]
    np.testing.assert_allclose(results[0], results[1], atol=1e-5)


def test_given_noise_is_that_of_the_capture_in_every_region(take):
    given = Settings(method="ssgplvm", regions=TWO, sigma_c=0.05, **QUICK)
    layout = train_layout(take, given)
    np.testing.assert_allclose(layout.noise[:, 0] * layout.units[:, 0], 0.05)


def test_a_marker_in_no_region_stays_as_it_is(take):
    two = Regions((replace(UPPER, markers=("m0", "m1")), replace(LOWER, markers=("m3",))))
    _, _, source = retargeted(facert.train(take, Settings(method="ridge", regions=two)), take)
    np.testing.assert_allclose(source[:, [2, 4]], take.source.values[:, [2, 4]], atol=1e-12)


def test_a_region_in_which_nothing_moves_is_refused(take):
    params = np.where(np.isin(take.controls.names, ["jaw"]), 0.0 * take.params, take.params)
    still = replace(take, params=params, animation=None)
    alone = Regions((UPPER, replace(LOWER, controls=("jaw",))))
    with pytest.raises(InputError, match=r"regions\.lower\.controls.*merge it with another"):
        facert.train(still, Settings(method="ridge", regions=alone))


def test_figures_of_regions_bear_their_names(trained):
    figures = trained("auto").figures
    assert "upper: weight of factors" in figures
    assert "lower: weight of factors" in figures
    assert figures["unlabelled frames"] == 10  # the same for both: shown once


GOOD = {
    "columns": np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    "weights": np.array([[1.0, 0.5], [0.0, 0.5]]),
    "units": np.ones((2, 2)),
    "noise": np.full((2, 2), 0.1),
}


@pytest.mark.parametrize(
    ("name", "bad"),
    [
        ("columns", np.array([[1.0, 1.0, 1.0], [0.0, 0.0, 0.0]])),
        ("weights", np.array([[1.0, 0.5], [0.0, 0.4]])),
        ("weights", np.array([[2.0, 0.5], [-1.0, 0.5]])),
        ("weights", np.array([[1.0, 1.0], [0.0, 0.0]])),
        ("units", np.array([[1.0, 1.0], [0.0, 1.0]])),
        ("noise", np.ones((3, 2))),
    ],
)
def test_a_damaged_layout_is_refused(name, bad):
    RegionLayout(**GOOD)
    with pytest.raises(InputError, match="train it again"):
        RegionLayout(**{**GOOD, name: bad})


def test_a_damaged_model_is_refused(trained):
    arrays = trained("ridge").method.save()
    settings = trained("ridge").settings
    Regional(settings).load(arrays)
    columns = arrays["layout.columns"].copy()
    columns[0] = columns[0, ::-1]
    columns[0, 5:] = 1.0
    for damage in ({"layout.columns": columns}, {"layout.units": arrays["layout.units"][:1]}):
        with pytest.raises(InputError, match="damaged: train it again"):
            Regional(settings).load({**arrays, **damage})
    del arrays["layout.weights"]
    with pytest.raises(InputError, match=r"layout\.weights"):
        Regional(settings).load(arrays)


def test_errors_of_the_regions_have_the_units_of_the_controls(take, trained):
    percent = replace(take, params=100.0 * take.params, animation=100.0 * take.animation)
    by_percent = facert.train(percent, Settings(method="auto", regions=TWO, **QUICK)).figures
    figures = trained("auto").figures
    errors = [name for name in figures if "cross-validation error" in name]
    assert [name.split(":")[0] for name in errors] == ["lower", "upper"]
    for name in errors:
        assert by_percent[name] == pytest.approx(100.0 * figures[name], rel=1e-6)

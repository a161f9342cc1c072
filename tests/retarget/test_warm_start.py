"""Training that begins at a trained model."""

from dataclasses import replace

import numpy as np
import pytest

import facert
from facert import Settings
from facert.data.arrays import rms
from facert.data.normalisation import Normalisation
from facert.data.regions import Region, Regions

SHARED = Settings(method="ssgplvm", unlabelled=60, latent_dim=4)


def with_labels(take, count):
    """The take with the first of its labels only."""
    params = take.params.copy()
    params[take.labels[count:]] = np.nan
    return replace(take, params=params)


@pytest.fixture(scope="module")
def take(make_take):
    return make_take(frames=120, posed=14, animation=60, seed=3)


@pytest.fixture(scope="module")
def before(take):
    """Before the last label was added."""
    return facert.train(with_labels(take, 13), SHARED)


@pytest.fixture(scope="module")
def after(take, before):
    return facert.train(take, start=before)


def test_after_another_label_a_few_iterations_do(take, before, after):
    anew = facert.train(take, SHARED)
    assert after.figures["status"] == "converged"
    assert after.figures["iterations"] < anew.figures["iterations"] / 2
    poses = [model.retarget(take).params for model in (before, after, anew)]
    assert rms(poses[1] - poses[2]) < 0.5 * take.params[take.labels].std()
    labels = take.labels
    missed = [rms(p[labels[-1]] - take.params[labels[-1]]) for p in poses]
    assert missed[1] < missed[0]


def test_frames_that_stay_in_the_draw_are_known_to_the_start(before, after):
    """All rows of the second training but at most two: what the new label replaced."""
    old, new = before.method.source_, after.method.source_
    in_both = [
        units.undo(view.X).round(6)
        for units, view in ((before.source_units, old), (after.source_units, new))
    ]
    common = {tuple(row) for row in in_both[0]} & {tuple(row) for row in in_both[1]}
    assert len(common) >= len(new.X) - 2


def test_it_keeps_the_settings_of_the_start(before, after):
    assert after.settings == before.settings


def test_begun_at_itself_nothing_is_left_to_do(take, after):
    again = facert.train(take, start=after)
    assert again.figures["iterations"] <= 12
    value, best = again.figures["objective"], after.figures["objective"]
    assert value <= best + 1e-3 * abs(best)


def test_the_unit_of_the_poses_does_not_matter(take, before, after):
    """The start's kernels and latents are taken over into whatever units the new data has."""
    percent = replace(
        take,
        params=100.0 * take.params,
        animation=100.0 * take.animation,
    )
    target = Normalisation(100.0 * before.target_units.mean, 100.0 * before.target_units.scale)
    begun = facert.train(percent, start=replace(before, target_units=target))
    poses = begun.retarget(percent).params / 100.0
    np.testing.assert_allclose(poses, after.retarget(take).params, atol=0.02)


def test_a_method_that_learns_in_one_go_begins_anew(take):
    first = facert.train(with_labels(take, 13), Settings(method="ridge"))
    again = facert.train(take, start=first)
    anew = facert.train(take, first.settings)
    np.testing.assert_array_equal(again.retarget(take).params, anew.retarget(take).params)


def test_regions_begin_each_at_their_own(make_take):
    take = make_take(frames=60, posed=10)
    names, controls = take.source.names, take.controls.names
    half = len(names) // 2, len(controls) // 2
    regions = Regions(
        (
            Region("upper", names[: half[0]], controls[: half[1]]),
            Region("lower", names[half[0] :], controls[half[1] :]),
        )
    )
    settings = replace(SHARED, unlabelled=20, latent_dim=2, max_iterations=60, regions=regions)
    first = facert.train(take, settings)
    moved = []
    again = facert.train(take, replace(first.settings, max_iterations=1), start=first)
    for old, new in zip(first.method.parts_, again.method.parts_, strict=True):
        moved.append(np.abs(new.method.source_.Z - old.method.source_.Z).max())
    assert max(moved) < 0.1  # one iteration from where they were; alignment would be elsewhere


@pytest.mark.parametrize(
    ("changes", "what"),
    [({"method": "sgplvm"}, "method"), ({"latent_dim": 3}, "latent_dim")],
)
def test_a_start_of_other_settings_is_not_used(take, before, changes, what, caplog):
    settings = replace(before.settings, max_iterations=20, **changes)
    begun = facert.train(take, settings, start=before)
    assert f"training begins anew: the start has another {what}" in caplog.text
    assert begun.figures["objective"] == facert.train(take, settings).figures["objective"]


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (lambda take: replace(take, units="mm"), "unit of markers"),
        (
            lambda take: replace(
                take, source=facert.Source(take.source.values[:, ::-1], take.source.names[::-1])
            ),
            "markers or weights",
        ),
        (
            lambda take: replace(
                take, source=facert.Source(take.source.values[..., 0], take.source.names)
            ),
            "kind of source",
        ),
        (
            lambda take: replace(take, controls=replace(take.controls, names=("a", "b", "c", "d"))),
            "controls",
        ),
    ],
)
def test_a_start_of_another_actor_or_character_is_not_used(take, before, change, what, caplog):
    facert.train(change(take), replace(before.settings, max_iterations=3), start=before)
    assert f"training begins anew: the start has another {what}" in caplog.text


def test_regions_of_other_members_begin_anew(make_take, caplog):
    take = make_take(frames=40, posed=8)
    names, controls = take.source.names, take.controls.names

    def split(at):
        parts = (Region("a", names[:at], controls[:2]), Region("b", names[at:], controls[2:]))
        return replace(SHARED, latent_dim=2, max_iterations=3, regions=Regions(parts))

    first = facert.train(take, split(2))
    facert.train(take, split(3), start=first)
    assert "the start has another regions" in caplog.text


def test_more_labels_bring_the_latent_dimensions_that_few_could_not_carry(take):
    few = facert.train(with_labels(take, 4), replace(SHARED, method="sgplvm"))
    more = facert.train(take, start=few)
    assert few.method.source_.Z.shape[1] == 3
    assert more.method.source_.Z.shape[1] == 4
    assert more.figures["objective"] == facert.train(take, more.settings).figures["objective"]

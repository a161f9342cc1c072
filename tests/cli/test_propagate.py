from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import facert as api
from facert.cli.commands import drive, propagate
from facert.data.labelling import predicted_poses
from facert.data.take import Source
from facert.topology import driving, propagation
from facert.topology.propagated_takes import Propagation, propagate_poses


@pytest.fixture
def posed(make_take, tmp_path):
    """A take whose frames are all posed, and its file."""
    take = make_take(posed=60, animation=0)
    api.write_take(take, tmp_path / "take.h5")
    return take, tmp_path / "take.h5"


def test_key_frames_make_the_whole_performance(facert, posed, tmp_path):
    take, path = posed
    done = facert("propagate", path, tmp_path / "out.h5", "--every", 6)
    assert done.code == 0, done.err
    result = api.read_take(tmp_path / "out.h5")
    expected = propagate_poses(take, [*range(0, 60, 6), 59])
    np.testing.assert_allclose(result.params, expected.params, atol=1e-10)
    assert "60 frames from 11 key frames" in done.out
    assert "RMS against the 49 other frames" in done.out


def test_the_posed_frames_are_the_keys_by_default(facert, make_take, tmp_path):
    take = make_take(posed=9)
    api.write_take(take, tmp_path / "take.h5")
    done = facert("propagate", tmp_path / "take.h5", tmp_path / "out.csv")
    assert done.code == 0, done.err
    assert "from 9 key frames" in done.out
    assert "RMS" not in done.out
    assert len((tmp_path / "out.csv").read_text().splitlines()) == 61


def test_keys_method_and_windows_are_options(facert, posed, tmp_path):
    take, path = posed
    out = tmp_path / "out.h5"
    options = ("--keys", "0,12,59,30,40", "--method", "path", "--window", 7, "--dim", 2)
    assert facert("propagate", path, out, *options).code == 0
    expected = propagate_poses(take, [0, 12, 30, 40, 59], Propagation("path", 7, 2))
    np.testing.assert_allclose(api.read_take(out).params, expected.params, atol=1e-10)


def test_what_goes_beyond_the_known_poses_is_kept_when_asked(facert, posed, tmp_path):
    take, path = posed
    keys, ranges = [10, 25, 40, 55], {}
    for limits in ("auto", "none"):
        out = tmp_path / f"{limits}.h5"
        asked = ("--keys", "10,25,40,55", "--limits", limits)
        assert facert("propagate", path, out, *asked).code == 0
        ranges[limits] = np.ptp(api.read_take(out).params, axis=0)
    assert (ranges["auto"] <= np.ptp(take.params[keys], axis=0) + 1e-9).all()
    assert (ranges["none"] > ranges["auto"]).any()


def test_feature_points_of_the_character_in_the_key_frames(facert, posed, tmp_path):
    take, path = posed
    markers = 3.0 * take.source.values
    known = np.full_like(markers, np.nan)
    known[::10] = markers[::10]
    character = replace(
        take, source=Source(known, take.source.names), units="m", params=None, controls=None
    )
    api.write_take(character, tmp_path / "keys.h5")
    out = tmp_path / "out.h5"
    done = facert("propagate", path, out, "--positions", tmp_path / "keys.h5")
    assert done.code == 0, done.err
    result = api.read_take(out)
    assert "from 6 key frames" in done.out
    assert result.units == "m"
    np.testing.assert_allclose(result.source.values, markers, atol=1e-6)


@pytest.mark.parametrize(
    ("options", "code", "word"),
    [
        ((), 3, "--every 10"),
        (("--keys", "0,99"), 3, "frames from 0 to 59"),
        (("--keys", "7"), 3, "2 key frames or more"),
        (("--keys", "a,b"), 2, "0,12,30"),
        (("--keys", "0,5", "--every", "5"), 2, "not both"),
        (("--every", "10", "--method", "magic"), 3, "one of residual"),
        (("--every", "10", "--window", "4"), 3, "odd"),
        (("--every", "10", "--method", "spline", "--dim", "2"), 3, "neither with spline"),
        (("--every", "30", "--method", "laplacian"), 3, "Choose another method"),
    ],
)
def test_bad_options_are_named_and_nothing_is_written(facert, posed, tmp_path, options, code, word):
    _, path = posed
    done = facert("propagate", path, tmp_path / "out.h5", *options)
    assert done.code == code
    assert word in done.err
    assert not (tmp_path / "out.h5").exists()


def test_an_existing_file_is_kept(facert, posed):
    _, path = posed
    assert facert("propagate", path, path, "--every", 10).code == 2
    assert facert("propagate", path, path, "--every", 10, "--overwrite").code == 0


def test_help_names_every_method():
    for module, methods in ((propagate, propagation.METHODS), (drive, driving.METHODS)):
        text = Path(module.__file__).read_text(encoding="utf-8").replace('"\n            "', "")
        for name in methods:
            assert name in text


def test_propagated_poses_are_no_labels_but_key_poses_are(facert, make_take, tmp_path):
    take = make_take(posed=9)
    api.write_take(take, tmp_path / "take.h5")
    whole = tmp_path / "whole.h5"
    assert facert("propagate", tmp_path / "take.h5", whole).code == 0
    result = api.read_take(whole)
    assert predicted_poses(result) == 51
    np.testing.assert_array_equal(result.params[take.labels], take.params[take.labels])
    done = facert("train", whole, "-o", tmp_path / "m.safetensors", "--method", "nearest")
    assert done.code == 0, done.err
    assert "51 poses" in done.err
    assert api.load(tmp_path / "m.safetensors").labels == 9
    done = facert("convert", tmp_path / "take.h5", tmp_path / "again.h5", "--poses", whole)
    assert done.code == 0, done.err
    assert api.read_take(tmp_path / "again.h5").labels.tolist() == sorted(take.labels)

from dataclasses import replace

import h5py
import numpy as np
import pytest

import facert as api
from facert.data.take import Source
from facert.io.take import read_take


@pytest.fixture
def files(make_take, tmp_path):
    """A take with gaps and noise, the truth, and where to write."""
    take = make_take(frames=200, markers=8)
    rng = np.random.default_rng(1)
    markers = take.source.values + 0.05 * rng.normal(size=take.source.values.shape)
    markers[rng.random(markers.shape[:2]) < 0.2] = np.nan
    noisy = replace(take, source=Source(markers, take.source.names))
    api.write_take(noisy, tmp_path / "in.h5")
    return tmp_path / "in.h5", take, noisy, tmp_path / "out.h5"


def beside(path):
    with h5py.File(path) as file:
        return {name: file[f"source/{name}"][()] for name in file["source"]}


def test_gaps_are_filled_and_noise_removed_with_what_is_left_of_both(facert, files):
    path, truth, noisy, output = files
    done = facert("clean", path, output)
    assert done.code == 0, done.err
    hidden = ~noisy.source.valid
    assert f"filled {hidden.sum()} of 1600 markers" in done.out
    assert "capture noise 0.05" in done.out
    found = read_take(output)
    assert found.source.valid.all()
    off = found.source.values - truth.source.values
    assert np.sqrt((off[~hidden] ** 2).mean()) < 0.05 / 2
    assert np.sqrt((off[hidden] ** 2).mean()) < 0.05
    kept = beside(output)
    np.testing.assert_array_equal(kept["filled"], hidden)
    assert (np.abs(off) < 3.0 * kept["std"]).mean() > 0.8
    assert "valid" not in kept


def test_poses_and_clock_are_kept(facert, files):
    path, truth, _, output = files
    facert("clean", path, output)
    found = read_take(output)
    np.testing.assert_array_equal(found.params, truth.params)
    np.testing.assert_array_equal(found.time, truth.time)
    assert (found.units, found.fps) == (truth.units, truth.fps)


def test_bad_markers_are_filled_unless_all_are_taken_as_observed(facert, files):
    path, truth, noisy, output = files
    markers = noisy.source.values.copy()
    markers[100:120, 2] = 0.0
    api.write_take(replace(noisy, source=Source(markers, noisy.source.names)), path, True)
    done = facert("clean", path, output)
    assert "20 zero" in done.err
    assert beside(output)["filled"][100:120, 2].all()
    off = np.linalg.norm(read_take(output).source.values - truth.source.values, axis=2)
    assert off[100:120, 2].max() < 1.0
    facert("clean", path, output, "--no-detect", "--overwrite")
    assert not beside(output)["filled"][100:120, 2].any()


def test_a_marker_lost_for_the_whole_take_stays_open_with_a_warning(facert, files):
    path, _, noisy, output = files
    markers = noisy.source.values.copy()
    markers[:, 3] = np.nan
    api.write_take(replace(noisy, source=Source(markers, noisy.source.names)), path, True)
    done = facert("clean", path, output)
    assert done.code == 0, done.err
    assert "never observed, left open: m3" in done.err
    expected = np.arange(8) != 3
    np.testing.assert_array_equal(read_take(output).source.valid.all(axis=0), expected)
    assert not beside(output)["filled"][:, 3].any()


def test_a_given_noise_is_taken_at_its_word(facert, files):
    path, _, noisy, output = files
    assert "capture noise 0.5 cm" in facert("clean", path, output, "--sigma", "0.5").out
    smooth = read_take(output).source.values
    facert("clean", path, output, "--sigma", "0", "--overwrite")
    exact = read_take(output).source.values
    seen = noisy.source.valid
    assert np.abs(exact - noisy.source.values)[seen].mean() < 0.01
    assert np.abs(np.diff(smooth, 2, axis=0)).mean() < np.abs(np.diff(exact, 2, axis=0)).mean()


def test_a_model_cleans_by_what_it_learned(facert, files, tmp_path):
    path, truth, noisy, output = files
    model = tmp_path / "model.safetensors"
    facert("train", path, "-o", model, "--method", "ridge")
    done = facert("clean", path, output, "--model", model)
    assert done.code == 0, done.err
    found = read_take(output)
    assert found.source.valid.all()
    np.testing.assert_array_equal(beside(output)["filled"], ~noisy.source.valid)
    assert np.isfinite(beside(output)["std"]).all()
    np.testing.assert_array_equal(found.params, truth.params)
    rough = facert("clean", path, output, "--model", model, "--sigma", "9", "--overwrite")
    assert rough.code == 0
    assert np.abs(read_take(output).source.values - found.source.values).max() > 0.1


def test_weights_are_cleaned_as_well(facert, tmp_path, make_take):
    take = make_take(frames=100)
    weights = take.source.matrix + 0.05 * np.random.default_rng(0).normal(size=(100, 15))
    weights[40:45, 3] = np.nan
    api.write_take(
        replace(take, source=Source(weights, [f"w{i}" for i in range(15)])), tmp_path / "w.h5"
    )
    done = facert("clean", tmp_path / "w.h5", tmp_path / "out.h5")
    assert "filled 5 of 1500 weights" in done.out
    assert beside(tmp_path / "out.h5")["std"].shape == (100, 15)


def test_nothing_is_written_over_or_for_a_take_in_which_nothing_moves(facert, files, tmp_path):
    path, _, noisy, output = files
    before = path.read_bytes()
    output.write_bytes(before)
    assert facert("clean", path, output).code == 2
    assert output.read_bytes() == before
    output.unlink()
    still = Source(np.ones_like(noisy.source.values), noisy.source.names)
    api.write_take(replace(noisy, source=still), path, True)
    done = facert("clean", path, output)
    assert done.code == 3
    assert str(path) in done.err
    assert not output.exists()

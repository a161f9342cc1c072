import numpy as np
import pytest

from facert.data.rig import Rig
from facert.io.formats import read_take_file, write_rig_file


@pytest.fixture
def inputs(tmp_path):
    rng = np.random.default_rng(0)
    shapes = rng.normal(size=(2, 50, 3))
    rig = Rig(rng.normal(size=(50, 3)), shapes, ("jawOpen", "smile_L"), np.array([[0, 1, 2]]), "cm")
    write_rig_file(rig, tmp_path / "rig.h5")
    (tmp_path / "weights.csv").write_text("time,JawOpen,SmileLeft\n0,0,1\n0.1,1,0\n0.2,0.5,1\n")
    return tmp_path / "rig.h5", tmp_path / "weights.csv"


def test_a_capture_with_its_truth_is_written(facert, inputs, tmp_path):
    done = facert("simulate", *inputs, tmp_path / "take.h5", "--markers", 12, "--noise", 0.1)
    assert done.code == 0
    assert "3 frames of 12 markers, 2 controls" in done.out
    take = read_take_file(tmp_path / "take.h5")
    assert take.controls.names == ("JawOpen", "SmileLeft")
    assert take.units == "cm"


def test_the_same_seed_gives_the_same_file(facert, inputs, tmp_path):
    options = ("--noise", 0.1, "--missing", 0.1, "--seed", 5)
    for name in ("one.h5", "two.h5"):
        assert facert("simulate", *inputs, tmp_path / name, *options).code == 0
    assert (tmp_path / "one.h5").read_bytes() == (tmp_path / "two.h5").read_bytes()


def test_vertices_can_be_given(facert, inputs, tmp_path):
    assert facert("simulate", *inputs, tmp_path / "take.h5", "--vertices", "3,1,2").code == 0
    assert read_take_file(tmp_path / "take.h5").source.names == ("v3", "v1", "v2")


@pytest.mark.parametrize(
    ("options", "code", "message"),
    [
        (("--vertices", "1,x"), 2, "--vertices"),
        (("--vertices", "50"), 3, "--vertices: expected different vertices from 0 to 49"),
        (("--markers", "60"), 3, "--markers"),
        (("--missing", "1"), 3, "--missing"),
        (("--noise", "-1"), 2, "--noise"),
    ],
)
def test_options_out_of_range_leave_no_file(facert, inputs, tmp_path, options, code, message):
    failed = facert("simulate", *inputs, tmp_path / "take.h5", *options)
    assert failed.code == code
    assert message in failed.err
    assert not (tmp_path / "take.h5").exists()


def test_weights_that_do_not_fit_the_rig_are_named_with_their_file(facert, inputs, tmp_path):
    rig, weights = inputs
    weights.write_text("time,unknown\n0,1\n")
    failed = facert("simulate", rig, weights, tmp_path / "take.h5")
    assert failed.code == 3
    assert f"{weights}: /source/names" in failed.err

"""``facert regions`` and ``facert train --regions``."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from facert import Controls, write_take


@pytest.fixture
def take(make_take, tmp_path):
    """A take whose markers have places, and controls names that speak."""
    made = make_take(markers=8, frames=50)
    places = np.stack([np.zeros(8), np.arange(8.0), np.zeros(8)], axis=1)
    source = replace(made.source, values=places + 0.05 * made.source.values)
    controls = Controls(["jawOpen", "mouthSmile", "browUp", "eyeBlink"])
    write_take(replace(made, source=source, controls=controls), tmp_path / "take.h5")
    return tmp_path / "take.h5"


def test_what_regions_prints_is_what_auto_learns(facert, take, tmp_path):
    printed = facert("-q", "regions", take)
    assert printed.code == 0
    (tmp_path / "regions.toml").write_text(printed.out)
    facts = []
    for name, given in (("a", "auto"), ("b", tmp_path / "regions.toml")):
        model = tmp_path / f"{name}.safetensors"
        assert facert("train", take, "--method", "ridge", "--regions", given, "-o", model).code == 0
        facts.append(json.loads(facert("inspect", model, "--json").out)["settings"])
    assert facts[0] == facts[1]
    assert set(facts[0]["regions"]) == {"brows-and-eyes", "mouth-and-jaw"}


def test_inspect_shows_the_regions(facert, take, tmp_path):
    model = tmp_path / "model.safetensors"
    facert("train", take, "--method", "ridge", "--regions", "auto", "-o", model)
    shown = facert("inspect", model).out
    assert re.search(r"regions brows-and-eyes +\(2\) browUp, eyeBlink", shown)
    assert re.search(r"regions mouth-and-jaw +\(4\) m0, m1, m2, m3", shown)


def test_a_wrong_name_is_reported_with_file_and_nearest_name(facert, take, tmp_path):
    path = tmp_path / "regions.toml"
    path.write_text('[all]\nmarkers = ["m0", "m1"]\ncontrols = ["jawOpn"]\n')
    outcome = facert("train", take, "--regions", path, "-o", tmp_path / "model.safetensors")
    assert outcome.code == 3
    assert f"{path}: regions.all.controls: expected the name 'jawOpn'" in outcome.err
    assert "Did you mean 'jawOpen'?" in outcome.err
    assert not (tmp_path / "model.safetensors").exists()


def test_a_config_file_may_hold_regions(facert, take, tmp_path):
    config = tmp_path / "config.toml"
    controls = '["jawOpen", "mouthSmile", "browUp", "eyeBlink"]'
    config.write_text(
        f'method = "ridge"\n[regions.all]\nmarkers = ["m0", "m1", "m2"]\ncontrols = {controls}\n'
    )
    model = tmp_path / "model.safetensors"
    assert facert("train", take, "--config", config, "-o", model).code == 0
    found = json.loads(facert("inspect", model, "--json").out)["settings"]["regions"]
    assert found["all"]["markers"] == ["m0", "m1", "m2"]


def test_regions_that_are_no_file_are_refused(facert, take):
    outcome = facert("train", take, "--regions", "atuo")
    assert outcome.code == 3
    assert "atuo: file: expected an existing file" in outcome.err


def test_a_shared_model_in_regions_cannot_be_resumed(facert, take, tmp_path):
    model = tmp_path / "model.safetensors"
    config = tmp_path / "quick.toml"
    config.write_text('method = "sgplvm"\nregions = "auto"\nmax_iterations = 5\n')
    outcome = facert("train", take, "--config", config, "--resume", "-o", model)
    assert outcome.code == 0
    assert "sgplvm in regions learns in one go: nothing to do for --resume" in outcome.err

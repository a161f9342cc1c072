import json

import numpy as np
import pytest

from facert import Settings, train
from facert.data.rig import Rig
from facert.data.take import Controls, Source, Take
from facert.io.formats import write_rig_file, write_take_file


@pytest.fixture
def take_file(tmp_path):
    values = np.random.default_rng(0).normal(size=(4, 2, 3))
    values[0, 1] = np.nan
    take = Take(
        time=np.arange(4) / 30,
        source=Source(values, ["nose", "[bold]chin"]),
        controls=Controls(["jawOpen"], [[0, 1]]),
        params=[[0.5], [np.nan], [1.0], [np.nan]],
        units="cm",
    )
    write_take_file(take, tmp_path / "take.h5")
    return tmp_path / "take.h5"


def test_a_take_is_shown_in_a_table(facert, take_file):
    shown = facert("inspect", take_file)
    assert shown.code == 0
    for fact in ("(2) nose, [bold]chin", "12.5%", "[bold]chin 25.0%", "0, 2", "0 to 1", "cm"):
        assert fact in shown.out


def test_json_is_for_programs(facert, take_file):
    facts = json.loads(facert("inspect", take_file, "--json").out)
    assert facts["file"] == str(take_file)
    assert facts["kind"] == "take"
    assert facts["source"]["names"] == ["nose", "[bold]chin"]
    assert facts["source"]["missing"] == 0.125
    assert facts["target"]["first_labels"] == [0, 2]
    assert facts["target"]["limits"] == [[0.0, 1.0]]


def test_a_rig_is_shown(facert, tmp_path):
    rig = Rig(np.eye(3), np.ones((1, 3, 3)), ("jawOpen",), np.array([[0, 1, 2]]))
    write_rig_file(rig, tmp_path / "rig.h5")
    facts = json.loads(facert("inspect", tmp_path / "rig.h5", "--json").out)
    assert (facts["kind"], facts["vertices"], facts["triangles"]) == ("rig", 3, 1)
    assert "jawOpen" in facert("inspect", tmp_path / "rig.h5").out


@pytest.mark.parametrize(("method", "shared"), [("ridge", False), ("sgplvm", True)])
def test_of_a_model_the_settings_are_shown_that_its_method_uses(
    facert, make_take, tmp_path, method, shared
):
    settings = Settings(method=method, latent_dim=2, neighbours=3, max_iterations=3)
    model = tmp_path / "model.safetensors"
    train(make_take(), settings).save(model)
    shown = facert("inspect", model).out
    assert "settings limits" in shown
    assert "labelled frames" in shown
    for name in ("latent dim", "inducing", "sigma c"):
        assert (f"settings {name}" in shown) == shared
    facts = json.loads(facert("inspect", model, "--json").out)
    assert facts["settings"]["latent_dim"] == 2  # programs get everything
    assert facts["figures"]["labelled frames"] == 12


def test_a_missing_file_is_bad_input(facert, tmp_path):
    failed = facert("inspect", tmp_path / "none.h5")
    assert failed.code == 3
    assert "found nothing" in failed.err


def test_of_very_many_names_some_are_shown_and_all_are_in_json(facert, tmp_path):
    path, names = tmp_path / "many.csv", [f"w{i}" for i in range(600)]
    path.write_text(",".join(["time", *names]) + f"\n0{',1' * 600}\n1{',2' * 600}\n")
    shown = " ".join(facert("inspect", path).out.split())
    assert "(600) w0, w1," in shown
    assert "and 100 more: --json lists all" in shown
    assert "w599" not in shown
    assert json.loads(facert("inspect", path, "--json").out)["source"]["names"] == names

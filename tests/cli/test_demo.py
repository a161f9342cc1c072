"""The demo and its pictures, as a user calls them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread
from typer.testing import CliRunner

from facert.cli.app import app
from facert.demo import write_demo
from facert.demo.files import FILES
from facert.errors import InputError, OutputExistsError

RUN = CliRunner()


@pytest.fixture(scope="module", name="demo")
def _demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("demo")
    write_demo(folder)
    return folder


def call(*arguments: object) -> str:
    result = RUN.invoke(app, [str(argument) for argument in arguments])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.stdout


def is_blank(picture: Path) -> bool:
    return float(np.std(imread(picture)[..., :3])) < 0.02


def test_demo_writes_four_files_and_prints_what_next(tmp_path: Path) -> None:
    shown = call("demo", tmp_path / "new")
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == sorted(FILES)
    assert "facert train" in shown
    assert "facert retarget" in shown


def test_demo_keeps_what_is_there(demo: Path) -> None:
    with pytest.raises(OutputExistsError):
        call("demo", demo)


def test_render_draws_faces(demo: Path, tmp_path: Path) -> None:
    take, picture = demo / "performance.h5", tmp_path / "faces.png"
    shown = call("render", take, picture, "--rig", demo / "character.h5", "--frames", "0,200")
    assert "0, 200" in shown
    assert not is_blank(picture)


def test_plot_draws_curves(demo: Path, tmp_path: Path) -> None:
    take, picture = demo / "performance.h5", tmp_path / "curves.png"
    call("plot", take, picture, "--truth", take, "--controls", "smile,jaw_open")
    assert not is_blank(picture)


def test_a_rig_of_somebody_else_is_refused(demo: Path, tmp_path: Path) -> None:
    take, picture = demo / "performance.h5", tmp_path / "faces.png"
    with pytest.raises(InputError, match=r"performance\.h5: /target/names"):
        call("render", take, picture, "--rig", demo / "actor.h5")
    assert not picture.exists()


def test_a_picture_is_not_written_over(demo: Path, tmp_path: Path) -> None:
    picture = tmp_path / "curves.png"
    picture.write_text("mine")
    with pytest.raises(OutputExistsError):
        call("plot", demo / "performance.h5", picture)
    assert picture.read_text() == "mine"


def test_a_picture_has_a_known_ending(demo: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"ends in \.png"):
        call("plot", demo / "performance.h5", tmp_path / "curves.gif")


def test_frames_are_numbers(demo: Path, tmp_path: Path) -> None:
    rig = demo / "character.h5"
    arguments = ["render", demo / "performance.h5", tmp_path / "a.png", "--rig", rig]
    result = RUN.invoke(app, [*map(str, arguments), "--frames", "0,x"])
    assert result.exit_code == 2

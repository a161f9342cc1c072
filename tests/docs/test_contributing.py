"""What CONTRIBUTING adds to facert works: its examples are carried out."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from following import ROOT, blocks_of
from typer.testing import CliRunner

import facert
from facert.cli.app import app
from facert.evaluation import table
from facert.io import registry as formats
from facert.methods.registry import REGISTRY
from facert.models import kernels

BLOCKS = {block.name: block.text for block in blocks_of(ROOT / "CONTRIBUTING.md") if block.name}


@pytest.fixture(name="add")
def _add(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[object]:
    """Puts the file of an example into its package, for one test."""
    added: list[str] = []

    def add(name: str) -> ModuleType:
        package, module = name.removesuffix(".py").replace("/", ".").rsplit(".", 1)
        (tmp_path / f"{module}.py").write_text(BLOCKS[name], encoding="utf-8")
        home = importlib.import_module(package)
        monkeypatch.setattr(home, "__path__", [*home.__path__, str(tmp_path)])
        added.append(f"{package}.{module}")
        return importlib.import_module(added[-1])

    yield add
    for name in added:
        del sys.modules[name]


def test_a_method(add, monkeypatch, make_take, tmp_path) -> None:
    add("facert/methods/three_nearest.py")
    for name, place in eval("{" + BLOCKS["REGISTRY"] + "}").items():
        monkeypatch.setitem(REGISTRY, name, place)
    take, path = make_take(), tmp_path / "model.safetensors"
    facert.train(take, facert.Settings(method="three-nearest")).save(path)
    assert np.isfinite(facert.load(path).retarget(take).params).all()


def test_a_kernel(add, monkeypatch, make_take) -> None:
    kernel = add("facert/models/rational_quadratic.py").RationalQuadratic
    new = eval("{" + BLOCKS["KERNELS"] + "}", {"RationalQuadratic": kernel})
    monkeypatch.setattr(kernels, "KERNELS", {**kernels.KERNELS, **new})
    one, s, step = kernel(1.3, 0.7, 0.1), np.linspace(0.1, 4.0, 9), 1e-5
    ahead, behind, k = one.value(s + step), one.value(s - step), one.value(s)
    slope, curvature = (ahead - behind) / (2 * step), (ahead - 2 * k + behind) / step**2
    np.testing.assert_allclose(one.relative_slope(s), slope / k, rtol=1e-6)
    np.testing.assert_allclose(one.relative_curvature(s), curvature / k, rtol=1e-3)
    settings = facert.Settings(method="ssgplvm", latent_dim=3, source_kernel="rational-quadratic")
    take = make_take()
    assert np.isfinite(facert.train(take, settings).retarget(take).params).all()


def test_a_format(add, monkeypatch, tmp_path) -> None:
    add("facert/io/blanks.py")
    new = eval(BLOCKS["FORMATS"], {"Format": formats.Format})
    monkeypatch.setattr(formats, "FORMATS", (*formats.FORMATS, new))
    path = tmp_path / "take.dat"
    path.write_text("time jaw smile\n0.0 0.1 0.2\n0.1 0.3 0.4\n")
    take = facert.read_take(path)
    assert (take.fps, take.source.names) == (10.0, ("jaw", "smile"))
    assert ".dat with blanks" in formats.listed("read", "take")
    path.write_text("time jaw smile\n0.0 0.1 0.2\n0.1 much 0.4\n")
    with pytest.raises(facert.InputError, match="line 3, column jaw"):
        facert.read_take(path)


def test_a_column(monkeypatch) -> None:
    new = eval(BLOCKS["COLUMNS"], {"Column": table.Column})
    monkeypatch.setattr(table, "COLUMNS", (*table.COLUMNS, new))
    options = ["--labels", "3", "--methods", "nearest", "--repeats", "1"]
    done = CliRunner().invoke(app, ["eval", *options, "-q"])
    assert done.exit_code == 0
    assert "unlabelled" in done.output

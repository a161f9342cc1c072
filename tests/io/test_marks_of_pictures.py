"""Pictures, clips and pages of facert's may be replaced; those of others stay."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from facert.cli.shared.files import save_picture, save_text
from facert.errors import InputError, OutputKeptError
from facert.io.registry import require_free
from facert.io.video import write_clip
from facert.pages.report.page import make_report, to_html


def write(path: Path) -> None:
    """A picture, a clip or a page as a command writes it."""
    if path.suffix in (".gif", ".mp4"):
        pictures = iter(np.random.default_rng(0).integers(0, 255, (3, 64, 64, 3), np.uint8))
        write_clip(pictures, path, 25.0)
    elif path.suffix == ".html":
        save_text(to_html(make_report("a", ())), path, overwrite=False)
    else:
        save_picture(Figure(figsize=(1, 1)), path, overwrite=False)


@pytest.mark.parametrize("ending", [".png", ".svg", ".pdf", ".gif", ".mp4", ".html", ".PNG"])
def test_what_facert_wrote_may_be_replaced(tmp_path: Path, ending: str) -> None:
    write(path := tmp_path / f"own{ending}")
    require_free(path, overwrite=True)


@pytest.mark.parametrize("ending", [".png", ".svg", ".pdf", ".gif", ".mp4", ".html"])
def test_what_others_made_stays(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"theirs{ending}"
    if ending in (".png", ".gif"):
        Image.new("RGB", (9, 9)).save(path)
    elif ending in (".svg", ".pdf"):
        Figure(figsize=(1, 1)).savefig(path)
    else:
        path.write_bytes(b"<title>somebody's</title>")
    with pytest.raises(OutputKeptError, match="not written by facert: it is never replaced"):
        require_free(path, overwrite=True)


def test_a_limit_to_the_size_of_files_is_told_with_its_cure(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, before[1]))
    try:
        for ending in (".png", ".mp4"):
            with pytest.raises(InputError, match=r"File too large\. Raise .* \(ulimit -f\)"):
                write(tmp_path / f"large{ending}")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert not list(tmp_path.iterdir())

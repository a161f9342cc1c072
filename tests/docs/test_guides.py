"""A reader who follows the guides gets what they show."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from following import (
    DOCS,
    ROOT,
    all_options,
    blocks_of,
    check_options,
    follow,
    stand_in,
    unknown_options,
)

import facert
from facert.demo.character import animate

README, DATA = ROOT / "README.md", ROOT / "data" / "README.md"
PAGES = sorted(DOCS.glob("*.md"))
TEXTS = [*sorted(ROOT.glob("*.md")), DATA, *PAGES]
ON_THEIR_OWN = {
    "phone-to-blender.md": "phone-demo/shot.h5",
    "optical-markers.md": "optical-demo/result.h5",
}
GOING_ON = ["posing.md", "key-frames.md", "live.md", "batch.md", "blender.md", "unreal.md"]
LINK = re.compile(r"\]\((?!\w+:)([^)#\s]*)(#([\w-]+))?\)")


@pytest.mark.slow
def test_the_quick_start_works_as_printed(quick_start: Path) -> None:
    made = {path.name for path in quick_start.iterdir()}
    assert {"model.safetensors", "result.h5", "result.csv", "faces.png"} <= made


@pytest.mark.slow
@pytest.mark.parametrize("name", ON_THEIR_OWN)
def test_a_guide_works_as_printed_and_leads_to_the_true_poses(name: str, tmp_path: Path) -> None:
    follow(DOCS / name, tmp_path)
    found = facert.read_take(tmp_path / ON_THEIR_OWN[name]).params
    truth = animate(stand_in()["performed"]("shot"))
    still = truth - truth.mean(axis=0)
    assert np.sqrt(np.mean((found - truth) ** 2)) < 0.65 * np.sqrt(np.mean(still**2))


@pytest.mark.slow
@pytest.mark.parametrize("name", GOING_ON)
def test_a_guide_goes_on_from_the_quick_start(name: str, quick_start: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(quick_start, tmp_path / "copy")
    follow(DOCS / name, folder)
    assert "(quick-start.md)" in (DOCS / name).read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_readme_works_as_printed_with_a_phones_recordings(tmp_path: Path) -> None:
    stand_in()["main"](["phone", str(tmp_path / "phone-demo")])
    follow(README, tmp_path / "phone-demo")
    made = {path.name for path in (tmp_path / "phone-demo").iterdir()}
    assert {"phone.safetensors", "shot.h5", "shot.png", "shot.glb", "result.h5"} <= made


@pytest.mark.slow
def test_own_data_works_as_printed(tmp_path: Path) -> None:
    rows = [f"{frame / 30},{frame / 100},{frame % 7}" for frame in range(100)]
    for name in ("recording.csv", "second.csv"):
        (tmp_path / name).write_text("\n".join(["time,eyeBlinkLeft,jawOpen", *rows]))
    follow(DOCS / "your-data.md", tmp_path)
    made = {path.name for path in tmp_path.iterdir()}
    assert {"take.h5", "result.csv", "curves.png", "posed.h5", "python.h5"} <= made


def test_every_page_with_commands_is_followed() -> None:
    commanding = {page.name for page in PAGES if any(not b.language for b in blocks_of(page))}
    assert commanding == {"quick-start.md", "your-data.md", *ON_THEIR_OWN, *GOING_ON}


@pytest.mark.parametrize("page", TEXTS, ids=lambda page: str(page.relative_to(ROOT)))
def test_commands_that_are_not_followed_have_options_that_exist(page: Path) -> None:
    for block in blocks_of(page):
        if block.language == "sh" or (page == DATA and not block.language):
            for command in block.commands:
                check_options(command)


@pytest.mark.parametrize("page", TEXTS, ids=lambda page: str(page.relative_to(ROOT)))
def test_commands_within_the_text_exist_with_their_options(page: Path) -> None:
    for command in re.findall(r"`(facert [^`]+)`", page.read_text(encoding="utf-8")):
        assert not unknown_options(command), command


@pytest.mark.parametrize("page", TEXTS, ids=lambda page: str(page.relative_to(ROOT)))
def test_options_within_the_text_exist(page: Path) -> None:
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.M)
    spans = [span for span in re.findall(r"`([^`]+)`", text) if not span.startswith("python ")]
    options = {option for span in spans for option in re.findall(r"(?<!\S)--[a-z][\w-]*", span)}
    assert options <= all_options()


@pytest.mark.parametrize("page", TEXTS, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    for target, _, place in LINK.findall(page.read_text(encoding="utf-8")):
        there = page.parent / target if target else page
        assert there.exists(), target
        assert not place or place in places_of(there), f"{target}#{place}"


def places_of(page: Path) -> list[str]:
    """What GitHub calls the headings of a page."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return [re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings]


def test_every_page_is_in_the_index() -> None:
    index = (DOCS / "README.md").read_text(encoding="utf-8")
    assert [page.name for page in PAGES if f"({page.name})" not in index] == ["README.md"]


def test_no_page_names_a_place_of_this_machine() -> None:
    for path in [*TEXTS, DOCS / "stand_in.py"]:
        assert str(ROOT) not in path.read_text(encoding="utf-8")


@pytest.mark.parametrize("page", TEXTS, ids=lambda page: str(page.relative_to(ROOT)))
def test_modules_that_a_page_names_exist(page: Path) -> None:
    for name in re.findall(r"`(facert/[\w/.]+)`", page.read_text(encoding="utf-8")):
        assert (ROOT / name).exists(), name

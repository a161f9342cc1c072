"""Frames bear the numbers by which options name them, and their timecodes or seconds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from facert.data.moments import frame_label
from facert.data.rig import Mesh, MeshSequence
from facert.data.take import Take
from facert.render.clip import draw_clip
from facert.render.faces import Face
from facert.render.plots import plot_controls
from facert.render.sheet import contact_sheet, render_sheet

SQUARE = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
MESH = Mesh(SQUARE, np.array([[0, 1, 2], [0, 2, 3]]))


def face(take: Take) -> Face:
    def fetch(rows):
        return np.tile(SQUARE, (len(rows), 1, 1))

    return Face("face", MeshSequence(MESH, take.time, fetch, take.fps, take.start_timecode))


@pytest.fixture(name="take")
def _take(make_take) -> Take:
    return replace(make_take(frames=40, posed=40), start_timecode="10:00:00:00")


def test_a_label_has_the_number_first(take: Take) -> None:
    assert frame_label(take, 33) == "33   10:00:01:03"
    assert frame_label(replace(take, start_timecode=""), 33) == "33   1.10 s"


def test_sheets_are_labelled(take: Take) -> None:
    titles = [axes.get_title() for axes in render_sheet([face(take)], [3, 33], pixels=32).axes]
    assert titles == ["3   10:00:00:03", "33   10:00:01:03"]


def test_clips_are_labelled(take: Take) -> None:
    first, second = draw_clip([face(take)], np.array([3, 33]), 160)
    changed = np.flatnonzero((first != second).any(axis=(1, 2)))
    assert changed.size
    assert changed.min() > 0.8 * len(first)  # the number stands below the face


def test_a_contact_sheet_says_what_is_drawn(take: Take) -> None:
    legend = contact_sheet(take, [3], ["3"]).texts[0].get_text()
    for part in ("dots: markers", "darker where nearer", "rings", "lines"):
        assert part in legend
    filmed = contact_sheet(take, [3], ["3"], video=lambda _: np.zeros((8, 8, 3), np.uint8))
    assert filmed.texts[0].get_text() == f"the performer's video; {legend}"
    assert [axes.get_title() for axes in filmed.axes] == ["3", ""]


def test_curves_have_frames_above_and_patterns_name_them(take: Take) -> None:
    late = replace(take, time=take.time + 100.0 + (np.arange(40) > 19))  # a second is missing
    figure = plot_controls(late, names=["s*", "Jaw"])
    assert [axes.get_ylabel() for axes in figure.axes] == ["smile", "jaw"]
    figure.draw_without_rendering()
    (top,) = figure.axes[0].child_axes
    assert top.get_xlabel() == "frame"
    shown = top.transData.transform([[0, 0], [19, 0], [20, 0], [39, 0]])
    below = figure.axes[0].transData.transform([[late.time[k], 0] for k in (0, 19, 20, 39)])
    np.testing.assert_allclose(shown[:, 0], below[:, 0], atol=1)

"""The pages in a real browser: what a person sees, moves and clicks."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("viser", reason="viser is not installed")


import facert
from facert.data.rig import Rig
from facert.data.take import Take
from facert.io.video import write_clip
from facert.io.video_frames import open_video
from facert.pages.pose_page import PosePage
from facert.pages.server import address, page_server
from facert.pages.session import PosingSession
from facert.pages.view_data import Performance
from facert.pages.view_page import ViewPage

DATA = Path(__file__).parents[2] / "data"
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def rig() -> Rig:
    return facert.read_rig(DATA / "character.h5")


@pytest.fixture(scope="module")
def recording() -> Take:
    """Two seconds of the performance, posed throughout."""
    take = facert.read_take(DATA / "performance.h5")
    source = replace(take.source, values=take.source.values[:60])
    return replace(take, time=take.time[:60], source=source, params=take.params[:60])


@pytest.fixture(scope="module")
def retargeter():
    take = facert.read_take(DATA / "training.h5")
    return facert.train(take, facert.Settings(method="gpr"))


@pytest.fixture
def view_page(visit, rig, recording, retargeter):
    result = replace(retargeter.retarget(recording), source=recording.source)
    with page_server("performance.h5", port=0) as server:
        page = ViewPage(server, Performance(result, np.array([0, 30]), rig, recording))
        with visit(address(server)) as seen:
            yield page, seen
        page.worker.stop()


@pytest.fixture
def pose_page(visit, rig, recording, retargeter, tmp_path):
    bare = replace(recording, params=None)
    session = PosingSession(retargeter.controls, bare, retargeter, tmp_path / "take.posed.h5")
    with posing(visit, rig, session) as both:
        yield both


@contextmanager
def posing(visit, rig: Rig, session: PosingSession) -> Iterator[tuple]:
    with page_server("take.h5", port=0) as server:
        page = PosePage(server, rig, session)
        with visit(address(server)) as seen:
            yield page, seen
        page.stop()


def test_a_performance_is_looked_at(view_page) -> None:
    page, seen = view_page
    first = seen.picture()
    seen.page.get_by_text("off by").first.click()
    assert seen.until(lambda: page.playback.frame > 0)
    worst = page.playback.frame
    assert worst == int(np.argmax(page.performance.errors))
    assert seen.until(lambda: seen.value("frame") == worst)
    assert seen.until(lambda: np.abs(seen.picture() - first).max() > 0.1)
    plain = seen.picture()
    seen.page.get_by_role("combobox", name="colours").click()
    seen.page.get_by_role("option", name="error").click()
    assert seen.until(lambda: np.abs(seen.picture() - plain).max() > 0.1)
    assert seen.page.locator(".uplot").count() == 3
    seen.page.get_by_text("◂ key").click()
    assert seen.until(lambda: page.playback.frame in (0, 30))
    seen.page.get_by_role("button", name="Play").click()
    stopped = page.playback.frame
    assert seen.until(lambda: page.playback.frame != stopped)
    assert seen.errors == []
    assert seen.hosts <= {"127.0.0.1", ""}


def test_a_frame_is_posed_saved_and_learned_from(pose_page) -> None:
    page, seen = pose_page
    names = page.session.controls.names
    jaw = names.index("jaw_open")
    seen.page.get_by_role("button", name="Start from neutral").click()
    assert seen.until(lambda: not page.editor.pose.any())
    before, pose = seen.picture(), page.editor.pose
    seen.slide("jaw_open", 0.25)
    assert seen.until(lambda: page.editor.pins.get(jaw) == pytest.approx(0.25))
    assert page.worker.finish()
    moved = {name: page.editor.pose[index] for index, name in enumerate(names)}
    others = [name for name in names if abs(moved[name] - pose[names.index(name)]) > 0.02]
    assert len(others) > 3
    for name in others:
        assert seen.until(lambda name=name: abs(seen.value(name) - moved[name]) < 0.011)
    assert seen.until(lambda: np.abs(seen.picture() - before).max() > 0.1)
    assert seen.page.get_by_text("● jaw_open").count() == 1

    seen.page.get_by_role("button", name="Save as this frame's pose").click()
    assert seen.until(lambda: page.session.output.exists())
    assert page.worker.finish()
    label = facert.read_take(page.session.output)
    assert label.labels.tolist() == [0]
    np.testing.assert_allclose(label.params[0], list(moved.values()))
    assert seen.until(lambda: seen.page.get_by_text("Frame 0 saved").count() == 1)
    assert not page.editor.pins
    assert seen.errors == []
    assert seen.hosts <= {"127.0.0.1", ""}


def test_other_poses_are_shown_and_taken_over(pose_page) -> None:
    page, seen = pose_page
    page.seek(5)
    page.pin(page.session.controls.names.index("smile"), 0.7)
    assert page.worker.finish()
    followed = page.editor.pose.copy()
    seen.page.get_by_role("button", name="Other plausible poses").click()
    seen.page.get_by_role("button", name="other 2").click()
    assert seen.until(lambda: np.abs(page.editor.pose - followed).max() > 0.01)
    assert page.editor.pose[page.session.controls.names.index("smile")] == 0.7
    page.seek(6)
    assert page.worker.finish()
    assert not page.editor.pins
    page.seek(5)
    assert page.worker.finish()
    assert list(page.editor.pins.values()) == [0.7]  # what was not saved is there again
    seen.page.get_by_text("smile  0.70").click()
    assert seen.until(lambda: not page.editor.pins)
    assert seen.errors == []


def test_it_is_mirrored_undone_and_saved_by_keys_and_by_the_bar(pose_page) -> None:
    page, seen = pose_page
    keys, names, editor = seen.page.keyboard, page.session.controls.names, page.editor
    left, right = names.index("brow_L"), names.index("brow_R")
    seen.slide("brow_L", 0.6)
    assert seen.until(lambda: editor.pins == {left: 0.6})
    seen.page.get_by_role("button", name="brow_R as brow_L").click()
    assert seen.until(lambda: editor.pins == {left: 0.6, right: 0.6})
    keys.press("Control+z")
    assert seen.until(lambda: editor.pins == {left: 0.6})
    keys.press("m")
    assert seen.until(lambda: editor.pins == {right: 0.6})
    assert seen.until(lambda: seen.value("brow_R") == pytest.approx(0.6))
    mirrored = editor.pose.copy()
    keys.press("Control+s")
    assert seen.until(lambda: page.session.labelled(0))
    np.testing.assert_array_equal(facert.read_take(page.session.output).params[0], mirrored)
    keys.press("ArrowRight")
    assert seen.until(lambda: page.playback.frame == 1)
    keys.press("Control+z")  # of the frame that was left
    assert seen.until(lambda: not page.session.labelled(0))
    assert not len(facert.read_take(page.session.output).labels)
    assert (page.playback.frame, editor.pins) == (0, {right: 0.6})
    keys.press("Control+Shift+z")
    assert seen.until(lambda: page.session.labelled(0))
    keys.press("Shift+ArrowRight")
    assert seen.until(lambda: page.playback.frame == 10)
    seen.page.get_by_role("button", name="nearest").click()
    assert seen.until(lambda: np.array_equal(editor.pose, mirrored))
    save = seen.page.get_by_role("button", name="Save as this frame's pose")
    seen.page.mouse.move(1100, 500)
    seen.page.mouse.wheel(0, 2000)
    save.click()
    assert seen.until(lambda: page.session.labelled(10))
    assert seen.errors == []


def test_keys_are_the_pages_after_a_click_and_do_not_turn_the_camera(pose_page) -> None:
    page, seen = pose_page
    (client,) = page._server.get_clients().values()
    seen._track("jaw_open").locator(".mantine-Slider-trackContainer").click()
    assert seen.until(lambda: len(page.editor.pins) == 1)
    seen.page.wait_for_timeout(300)  # the slider may send its value once more
    before = client.camera.position
    for _ in range(3):
        seen.page.keyboard.press("ArrowRight")
    seen.page.keyboard.press("ArrowLeft")
    assert seen.until(lambda: page.playback.frame == 2)
    assert page.unsaved == [(0, 0)]
    seen.page.get_by_role("button", name="Play").click()
    assert seen.until(lambda: page.playback.playing)
    seen.page.keyboard.press(" ")
    assert seen.until(lambda: not page.playback.playing)
    seen.page.get_by_role("button", name="frame 0").click()
    assert seen.until(lambda: len(page.editor.pins) == 1)
    np.testing.assert_array_equal(client.camera.position, before)
    assert seen.errors == []


def test_two_takes_one_of_them_a_result_are_corrected_and_trained_on(
    visit, rig, recording, retargeter, tmp_path
) -> None:
    labels = np.where(np.arange(60)[:, None] % 6 == 0, recording.params, np.nan)
    takes = [replace(recording, params=labels), retargeter.retarget(recording)]
    paths = [tmp_path / "a.posed.h5", tmp_path / "<b>.h5"]
    names = [path.name for path in paths]
    session = PosingSession(retargeter.controls, takes, retargeter, paths, names)
    with posing(visit, rig, session) as (page, seen):
        button = lambda name: seen.page.get_by_role("button", name=name)  # noqa: E731
        written = lambda: facert.read_take(paths[1]).corrections  # noqa: E731
        # The field that was typed in lets go of the keys a moment after Enter.
        free = lambda: seen.page.evaluate("document.activeElement.tagName") == "BODY"  # noqa: E731
        seen.page.get_by_role("combobox", name="take").click()
        seen.page.get_by_role("option", name="<b>.h5").click()
        assert seen.until(lambda: session.here == 1)
        seen.page.wait_for_timeout(400)
        assert seen.until(free)
        seen.page.keyboard.press("Shift+ArrowRight")
        assert seen.until(lambda: page.playback.frame == 10)
        seen.slide("jaw_open", 0.9)
        assert seen.until(lambda: len(page.editor.pins) == 1)
        button("Save as this frame's pose").click()
        assert seen.until(lambda: seen.page.get_by_text("saved to <b>.h5").count() == 1)
        assert written().frames.tolist() == [10]
        seen.slide("blend over (s)", 1.0)
        assert seen.until(lambda: written().width.tolist() == [1.0])
        assert seen.until(free)
        seen.page.keyboard.press("ArrowRight")
        assert seen.until(lambda: page.playback.frame == 11)
        predicted = session.result.params[11]
        assert np.abs(page.editor.pose - predicted).max() > 0.05  # blended
        seen.page.keyboard.press("ArrowLeft")
        assert seen.until(lambda: seen.page.get_by_text("A corrected frame.").count() == 1)
        button("Take this frame's pose back").click()
        assert seen.until(lambda: written() is None)
        seen.page.keyboard.press("Control+z")
        assert seen.until(lambda: written() is not None)

        button("Train on the labels").click()
        assert seen.until(lambda: seen.page.get_by_text("Learned from 11 labels").count() == 1)
        assert seen.until(lambda: seen.page.get_by_text("labels stand for").count() == 1)
        assert seen.until(lambda: seen.page.get_by_text("Verdict:").count() == 1)
        assert written().frames.tolist() == [10]
        button("<b>.h5:").or_(button("a.posed.h5:")).first.click()
        assert seen.until(lambda: page.playback.frame != 10)
        assert seen.errors == []


def test_a_performers_video_stands_beside_the_character(visit, rig, recording, tmp_path) -> None:
    path = tmp_path / "clip.mp4"
    shades = (np.full((32, 48, 3), 250 * (number > 15), np.uint8) for number in range(60))
    write_clip(shades, path, 30.0)
    session = PosingSession(recording.controls, recording, output=tmp_path / "take.posed.h5")
    video = open_video(path, recording)
    with page_server("take.h5", port=0) as server:
        page = PosePage(server, rig, session, video=video)
        with visit(address(server)) as seen:
            assert seen.until(lambda: (seen.picture().max(axis=2) < 0.1).mean() > 0.02)
            page.seek(30)
            assert seen.until(lambda: (seen.picture().max(axis=2) < 0.1).mean() < 0.01)
            assert seen.errors == []
        page.stop()


def test_from_nothing_to_a_model(visit, rig, recording, tmp_path) -> None:
    """No model and no pose to begin with: what the first day looks like."""
    bare = replace(recording, params=None, animation=None)
    session = PosingSession(recording.controls, bare, None, tmp_path / "take.posed.h5")
    with posing(visit, rig, session) as (page, seen):
        seen.page.get_by_role("button", name="Train on the labels").click()
        assert seen.until(lambda: seen.page.get_by_text("This did not work").count() == 1)
        for frame in range(0, 60, 10):
            session.save(frame, recording.params[frame])
        seen.page.get_by_role("button", name="Train on the labels").click()
        assert seen.until(lambda: seen.page.get_by_text("Learned from 6 labels").count() == 1)
        assert session.model_path.exists()
        page.seek(15)
        assert page.worker.finish()
        assert np.abs(page.editor.pose - recording.params[15]).mean() < 0.2
        assert seen.errors == []


EVIL = (
    "<img src=x onerror=evil()>",
    "[x](javascript:evil())",
    "**b** <script>evil()</script>",
    "![x](x onerror=evil())",
)


@pytest.mark.parametrize("kind", ["view", "pose"])
def test_a_hostile_name_is_text_on_the_page(kind, visit, rig, recording, tmp_path) -> None:
    hostile = replace(rig, names=(*EVIL, *rig.names[len(EVIL) :]))
    controls = facert.Controls((*EVIL, *recording.controls.names[len(EVIL) :]))
    names = (*EVIL, *recording.source.names[len(EVIL) :])
    source = facert.Source(recording.source.values, names)
    take = replace(recording, source=source, controls=controls, start_timecode=EVIL[0])
    with page_server(EVIL[0], port=0) as server:
        if kind == "view":
            page = ViewPage(server, Performance(take, np.array([0]), hostile, take))
            stop = page.worker.stop
        else:
            page = PosePage(server, hostile, PosingSession(controls, take, None, tmp_path / "t.h5"))
            stop = page.stop
        with visit(address(server)) as seen:
            _require_text(seen, kind)
        stop()


def _require_text(seen, kind: str) -> None:
    """What names say stands on the page to be read, and nothing that they ask for was made."""
    shown = seen.page.locator("body")
    assert seen.until(lambda: "onerror=evil()" in shown.inner_text())
    if kind == "pose":
        assert all(name in shown.inner_text() for name in EVIL)
    made = "img[src='x'], img[onerror], a[href^='javascript'], body script:not([src]), strong"
    contents = seen.page.locator(made).evaluate_all("all => all.map(one => one.outerHTML)")
    assert not [one for one in contents if "evil" in one or one.startswith("<strong")]
    assert not [line for line in seen.errors if "evil" in line]

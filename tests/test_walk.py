"""The walk of a take through the package: each room is entered once, from the top down.

``python tests/test_walk.py`` prints it, with the functions by which each room is entered.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from types import FrameType
from typing import Any

import pytest
from test_house import FLOORS

import facert
from facert import Retargeter, Settings, Take

# What everyone uses; and the registry of methods, in which names are looked up.
GROUND = ("models", "mesh", "settings", "data", "errors")
LOOKED_UP = ("facert.methods.registry",)
# Made when a module is imported or an object is created: nothing is entered by it.
PASSING = ("<module>", "__init__", "__post_init__")

# Whether it was the head that moved, when a result has frames that are new.
AFTERWARDS = ("preprocess", ["head_motion.rigid_motion"])

Steps = list[tuple[str, list[str]]]
"""The rooms that are entered in turn, with the functions by which each is entered."""


@cache
def package(module: str) -> str | None:
    parts = module.split(".")
    return parts[1] if parts[0] == "facert" and len(parts) > 1 else None


def room(frame: FrameType) -> str | None:
    """The package of facert in which a function runs; None for others, and at the root."""
    return package(frame.f_globals.get("__name__", ""))


def caller(frame: FrameType) -> FrameType | None:
    """The function of a room that made a call, by way of other libraries or not."""
    back = frame.f_back
    while back is not None and room(back) is None:
        back = back.f_back
    return back


def enters(frame: FrameType) -> bool:
    """Whether a call enters a room: from above, or from outside of the package.

    Calls upwards, as of a monitor that watches the training, enter nothing.
    """
    here = room(frame)
    if here is None or here in GROUND or frame.f_globals["__name__"] in LOOKED_UP:
        return False
    if frame.f_code.co_name in PASSING:
        return False
    back = caller(frame)
    if back is None:
        return True
    from_above = FLOORS.index(str(room(back))) < FLOORS.index(here)
    return from_above and back.f_code.co_name != "<module>"


def walk(what: Callable[[], Any]) -> Steps:
    """The rooms that a call enters in turn."""
    steps: Steps = []

    def profile(frame: FrameType, event: str, _: Any) -> None:
        if event == "call" and enters(frame):
            here, module = str(room(frame)), frame.f_globals["__name__"]
            if not steps or steps[-1][0] != here:
                steps.append((here, []))
            name = f"{module.split('.', 2)[2]}.{frame.f_code.co_qualname}"
            if name not in steps[-1][1]:
                steps[-1][1].append(name)

    threading.setprofile(profile)
    sys.setprofile(profile)
    try:
        what()
    finally:
        sys.setprofile(None)
        threading.setprofile(None)  # type: ignore[arg-type]
    return steps


def rooms(what: Callable[[], Any]) -> list[str]:
    """The rooms in turn, without what looks at a result for frames that are like no posed one."""
    steps = walk(what)
    return [name for name, _ in (steps[:-1] if steps[-1] == AFTERWARDS else steps)]


@pytest.fixture(name="take", scope="module")
def _take(make_take: Callable[..., Take]) -> Take:
    take: Take = make_take(frames=40)
    return take


@pytest.fixture(name="settings", params=["auto", "ssgplvm"])
def _settings(request: pytest.FixtureRequest) -> Settings:
    return Settings(method=request.param, latent_dim=3, max_iterations=1, unlabelled=10)


@pytest.mark.parametrize("regions", [None, "auto"])
def test_training_enters_each_room_once(
    take: Take, settings: Settings, regions: str | None
) -> None:
    steps = rooms(lambda: facert.train(take, replace(settings, regions=regions)))
    assert steps == ["retarget", "preprocess", "regions", "methods"]


@pytest.mark.parametrize("mode", ["offline", "online"])
def test_retargeting_enters_each_room_once(take: Take, settings: Settings, mode: str) -> None:
    """Online, one frame after the other goes the same way."""
    model = facert.train(take, settings)
    steps = rooms(lambda: model.retarget(take, mode))  # type: ignore[arg-type]
    assert steps[:3] == ["retarget", "preprocess", "methods"]
    assert steps[3:] == ["preprocess", "methods"] * ((len(steps) - 3) // 2)
    assert mode == "online" or len(steps) == 3


def test_with_regions_a_performance_goes_through_them(take: Take) -> None:
    model = facert.train(take, Settings(method="ridge", regions="auto"))
    steps = rooms(lambda: model.retarget(take))
    assert steps == ["retarget", "preprocess", "regions", "methods"]


def show(title: str, what: Callable[[], Any]) -> None:
    print(title)
    for number, (name, functions) in enumerate(walk(what), 1):
        print(f"{number}. {name}: {', '.join(functions)}")


if __name__ == "__main__":
    from facert.demo import training_take

    demo = training_take()
    show("train", lambda: facert.train(demo))
    model: Retargeter = facert.train(demo)
    show("retarget", lambda: model.retarget(demo))

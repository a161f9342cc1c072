"""facert: carry a facial performance over to any character's rig, from a handful of poses.

    import facert

    take = facert.read_take("take.h5")
    retargeter = facert.train(take)
    retargeter.save("model.safetensors")
    result = facert.load("model.safetensors").retarget(facert.read_take("new.h5"))
    facert.write_take(result, "result.h5")

The public names are loaded when they are first used: torch takes its time.
"""

from __future__ import annotations

import importlib

from facert.data.version import VERSION

TYPE_CHECKING = False  # as in typing, which takes its time: see facert.cli.shared.signals
if TYPE_CHECKING:
    from typing import Any

    from facert.data.rig import Rig
    from facert.data.take import Controls, Corrections, Source, Take
    from facert.data.verdict import Verdict
    from facert.errors import FacertError, InputError
    from facert.io.formats import read_rig_file as read_rig
    from facert.io.formats import read_take_file as read_take
    from facert.io.formats import write_take_file as write_take
    from facert.posing.completed_pose import complete_pose
    from facert.posing.corrected_take import correct_take as correct
    from facert.posing.suggested_frames import suggest_frames
    from facert.retarget.retargeter import Retargeter, load
    from facert.retarget.training import train
    from facert.retarget.verdict import judge
    from facert.settings import Settings

__version__ = VERSION

__all__ = [
    "Controls",
    "Corrections",
    "FacertError",
    "InputError",
    "Retargeter",
    "Rig",
    "Settings",
    "Source",
    "Take",
    "Verdict",
    "complete_pose",
    "correct",
    "judge",
    "load",
    "read_rig",
    "read_take",
    "suggest_frames",
    "train",
    "write_take",
]

_HOMES = {
    "Controls": ("facert.data.take", "Controls"),
    "Corrections": ("facert.data.take", "Corrections"),
    "FacertError": ("facert.errors", "FacertError"),
    "InputError": ("facert.errors", "InputError"),
    "Retargeter": ("facert.retarget.retargeter", "Retargeter"),
    "Rig": ("facert.data.rig", "Rig"),
    "Settings": ("facert.settings", "Settings"),
    "Source": ("facert.data.take", "Source"),
    "Take": ("facert.data.take", "Take"),
    "Verdict": ("facert.data.verdict", "Verdict"),
    "complete_pose": ("facert.posing.completed_pose", "complete_pose"),
    "correct": ("facert.posing.corrected_take", "correct_take"),
    "judge": ("facert.retarget.verdict", "judge"),
    "load": ("facert.retarget.retargeter", "load"),
    "read_rig": ("facert.io.formats", "read_rig_file"),
    "read_take": ("facert.io.formats", "read_take_file"),
    "suggest_frames": ("facert.posing.suggested_frames", "suggest_frames"),
    "train": ("facert.retarget.training", "train"),
    "write_take": ("facert.io.formats", "write_take_file"),
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'facert' has no attribute {name!r}")
    module, attribute = _HOMES[name]
    return getattr(importlib.import_module(module), attribute)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])

"""Keys the attributes of a Maya node with curves that facert wrote (.json or .csv).

In Maya's script editor (Python): run this once, then, with a blendShape node or a control,

    key_attributes("/shots/010/curves.json", "face_blendShape")

A curve whose name is as ``node.attribute`` goes to that node. Keys are set by time: at another
frame rate than the recording's the motion is as fast.
"""

from __future__ import annotations

import maya.cmds as cmds

from facert.io.importers.shared import find, keys, read_curves

START = 0.0  # seconds of the first key


def key_attributes(path: str, node: str = "") -> None:
    """Key the attributes of a node; warn of the curves that it has no attribute for."""
    curves = read_curves(path)
    there = _attributes(node)
    for control in curves.values:
        own, _, name = control.rpartition(".")
        found = find(name, _attributes(own) if own else there)
        if found is None:
            cmds.warning(f"no attribute for {control!r}")
            continue
        for key in keys(curves, control):
            cmds.setKeyframe(
                own or node,
                attribute=found,
                time=f"{START + key.time - curves.time[0]:.6f}sec",
                value=key.value,
                inTangentType="linear",
                outTangentType="linear",
            )
    print(f"{len(curves.time)} frames at {curves.fps:g} frames/s")


def _attributes(node: str) -> list[str]:
    """Keyable attributes of a node: a blendShape's weights by the names of its targets."""
    if not node or not cmds.objExists(node):
        return []
    return cmds.listAttr(node, keyable=True, multi=True) or []

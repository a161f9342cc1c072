"""Draws `arkit.png` beside this file: each shape of facert's stand-in face at 1."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from facert.demo import arkit_face
from facert.render.shade import Camera, shade

PICTURE = Path(__file__).with_name("arkit.png")
ACROSS, PIXELS, INCHES = 9, 150, 1.25
CAMERA = Camera((0.0, -1.4, 0.0), 8.4, -0.22)


def main() -> None:
    """Draw the face at rest, then all shapes; `mouthClose` closes the lips of an open jaw."""
    rig = arkit_face()
    poses = np.vstack([np.zeros((1, len(rig.names))), np.eye(len(rig.names))])
    poses[1 + rig.names.index("mouthClose"), rig.names.index("jawOpen")] = 1.0
    titles = ["at rest", *rig.names]
    titles[titles.index("mouthClose")] = "mouthClose, jawOpen"
    down = -(-len(poses) // ACROSS)
    figure = Figure((ACROSS * INCHES, down * (INCHES + 0.17)), dpi=PIXELS / INCHES)
    grid = figure.subplots(down, ACROSS)
    figure.subplots_adjust(0, 0, 1, 1 - 0.15 / figure.get_figheight(), 0.02, 0.17 / INCHES)
    for axes in grid.flat:
        axes.set_axis_off()
    for axes, title, pose in zip(grid.flat, titles, poses, strict=False):
        vertices = rig.deform(pose[None])[0]
        axes.imshow(shade(vertices, rig.faces, CAMERA, PIXELS, rig.colours))
        axes.set_title(title, fontsize=6.5, pad=1.5)
    with BytesIO() as drawn:
        figure.savefig(drawn, format="png")
        Image.open(drawn).convert("RGB").quantize(128).save(PICTURE, optimize=True)


if __name__ == "__main__":
    main()

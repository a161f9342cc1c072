"""How long the topology framework takes on a face of 9,409 vertices with 80 feature points.

    python -m experiments.bench.topology [--frames 2000] [--repeats 5]

One thread. Times are CPU time, medians; the last column is the ratio to the first line, which is
measured in the same run, since machines and their neighbours differ.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy import sparse

from experiments.bench.problem import describe  # and one thread
from experiments.topology.recordings import weights_of
from experiments.tracks import DATA
from facert.data.arrays import FloatArray, IntArray
from facert.data.names import shape_drivers
from facert.data.rig import MeshSequence
from facert.io.formats import read_rig_file
from facert.io.mesh_sequence import write_mesh_sequence
from facert.render.shade import frame_mesh, shade
from facert.topology.alignment_matrix import alignment_matrix
from facert.topology.driving import SURFACE, FaceDriver, smooth_energy
from facert.topology.neighbourhoods import Neighbourhoods, mesh_rings
from facert.topology.solution import Elimination
from facert.topology.suggested_points import suggest_points

POINTS = 80


def timed(action: Callable[[], object], repeats: int) -> list[float]:
    """CPU milliseconds of each repeat, after one that warms up."""
    action()
    spent = []
    for _ in range(repeats):
        began = time.process_time()
        action()
        spent.append(1e3 * (time.process_time() - began))
    return spent


def loop_over_points(vertices: FloatArray, rings: Neighbourhoods) -> sparse.csc_array:
    """B as Algorithm 1 is written, a vertex at a time: what the batches are compared with."""
    B = sparse.lil_array((len(vertices), len(vertices)))
    for members in (group[row] for group in rings.by_size() for row in range(len(group))):
        local = vertices[members] - vertices[members].mean(axis=0)
        g = np.linalg.svd(local, full_matrices=False)[0][:, :SURFACE]
        k = len(members)
        B[np.ix_(members, members)] += np.eye(k) - 1.0 / k - g @ g.T
    return B.tocsc()


def stages(vertices: FloatArray, faces: IntArray, points: IntArray, repeats: int) -> None:
    """Print the time of every step from a mesh to its influence matrix."""
    rings = mesh_rings(faces, len(vertices))
    energy = smooth_energy(vertices, faces)
    steps: dict[str, Callable[[], object]] = {
        "B, Algorithm 1": lambda: alignment_matrix(vertices, rings, SURFACE),
        "rings of the mesh": lambda: mesh_rings(faces, len(vertices)),
        "factorisation": lambda: Elimination(energy, points),
        "influence of 80 points": lambda: Elimination(energy, points).influence,
        "all, from the mesh": lambda: FaceDriver(vertices, faces, points),
    }
    base = 0.0
    for name, step in steps.items():
        spent = timed(step, repeats)
        base = base or float(np.median(spent))
        print(f"{name:<34} {describe(spent, 'ms')}   {np.median(spent) / base:.2f}")
    began = time.process_time()
    loop_over_points(vertices, rings)
    spent = 1e3 * (time.process_time() - began)
    print(f"{'B, a Python loop over the vertices':<34} {spent:.0f} ms once   {spent / base:.1f}")


def playback(driver: FaceDriver, positions: FloatArray, sequence: MeshSequence) -> None:
    """Print the time of a frame alone, in batches, and with the writing of the file."""
    alone = [timed(lambda row=row: driver.deform(positions[row : row + 1]), 1)[0]
             for row in range(200)]  # fmt: skip
    print(f"{'a frame, one after the other':<34} {describe(alone, 'ms')}")
    batches = timed(lambda: [None for _ in sequence.batches()], 3)
    per_frame = [spent / len(sequence) for spent in batches]
    print(f"{'a frame, in batches of 64':<34} {describe(per_frame, 'ms')}")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "face.h5"
        wall = []
        for _ in range(3):
            began = time.perf_counter()
            write_mesh_sequence(sequence, path, overwrite=True)
            wall.append(time.perf_counter() - began)
        spent = timed(lambda: write_mesh_sequence(sequence, path, overwrite=True), 3)
        size = path.stat().st_size / 1e6
    print(f"{f'{len(sequence)} frames driven and written':<34} {describe(spent, 'ms')}")
    print(f"{'the same by the clock':<34} {describe(wall, 's')}, {size:.0f} MB")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=2000)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    rig = read_rig_file(DATA / "rigs" / "ict_face.npz")
    points = suggest_points(rig, POINTS)
    weights, names = weights_of("rom", "arkit", slice(0, options.frames))
    settings = weights @ shape_drivers(names, rig.names)
    positions = rig.neutral[points] + np.tensordot(settings, rig.shapes[:, points], 1)
    print(f"{len(rig.neutral)} vertices, {POINTS} points, {options.frames} frames")
    stages(rig.neutral, rig.faces, points, options.repeats)
    driver = FaceDriver(rig.neutral, rig.faces, points)
    time_of = np.arange(options.frames) / 30
    sequence = MeshSequence(rig.mesh, time_of, lambda rows: driver.deform(positions[rows]))
    playback(driver, positions, sequence)
    camera = frame_mesh(rig.neutral)
    spent = timed(lambda: shade(rig.neutral, rig.faces, camera, 300), options.repeats)
    print(f"{'a picture of 300 pixels':<34} {describe(spent, 'ms')}")


if __name__ == "__main__":
    main()

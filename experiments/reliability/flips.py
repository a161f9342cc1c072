"""Every byte of small HDF5 files changed, one at a time: what becomes of reading them.

A take, a rig and a mesh sequence, as facert writes them and as a program with HDF5's newest
structures would. Counted is how often reading is refused, gives the same, or gives other values;
whatever else happens is a fault, and the status is then 1.

    python -m experiments.reliability.flips [--stride 1]
"""

from __future__ import annotations

import argparse
import resource
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from facert.data.rig import Mesh, MeshSequence, Rig
from facert.data.take import Controls, Source, Take
from facert.errors import InputError
from facert.io.mesh_sequence import open_mesh_sequence, write_mesh_sequence
from facert.io.rig import read_rig, write_rig
from facert.io.take import read_take, write_take

PATIENCE = 20  # seconds after which a read is taken for one that never ends
PATTERNS: dict[str, Callable[[int], int]] = {
    "lowest bit": lambda byte: byte ^ 0x01,
    "highest bit": lambda byte: byte ^ 0x80,
    "0": lambda _: 0,
    "255": lambda _: 0xFF,
}


def a_take(path: Path) -> None:
    """Write a small take with all that most takes have."""
    rng = np.random.default_rng(0)
    frames = 8
    values = rng.normal(size=(frames, 3, 3))
    values[2, 1] = np.nan
    params = rng.random((frames, 2))
    take = Take(
        np.arange(frames) / 60, Source(values, ("one", "two", "thrée")),
        Controls(("a", "b"), np.array([[0.0, 1.0]] * 2)), params, std=np.abs(params), fps=60.0,
        units="cm", start_timecode="13:13:04:31", up_axis="Y", model="model.safetensors",
    )  # fmt: skip
    write_take(take, path)


def a_rig(path: Path) -> None:
    """Write a small rig."""
    rng = np.random.default_rng(0)
    faces = np.array([[0, 1, 2], [1, 2, 3]])
    write_rig(Rig(rng.normal(size=(4, 3)), rng.normal(size=(2, 4, 3)), ("a", "b"), faces), path)


def a_mesh_sequence(path: Path) -> None:
    """Write a small mesh sequence."""
    rng = np.random.default_rng(0)
    mesh = Mesh(rng.normal(size=(4, 3)), np.array([[0, 1, 2]]), "cm", rng.random((4, 3)))
    moved = rng.normal(size=(5, 4, 3))
    write_mesh_sequence(MeshSequence(mesh, np.arange(5) / 30, lambda rows: moved[rows]), path)


def newest(write: Callable[[Path], None]) -> Callable[[Path], None]:
    """The same file, in HDF5's newest structures, and with texts of fixed length."""

    def written(path: Path) -> None:
        write(path)
        with h5py.File(path) as old:
            arrays: dict[str, Any] = {}
            old.visititems(
                lambda name, one: (
                    arrays.update({name: one[()]}) if isinstance(one, h5py.Dataset) else None
                )
            )
            attributes = dict(old.attrs)
        with h5py.File(path, "w", libver="latest", track_order=True) as new:
            new.attrs.update(attributes)
            for index, (name, values) in enumerate(arrays.items()):
                if values.dtype.kind == "O":
                    values = values.astype("S")
                limits = (None, *values.shape[1:]) if index % 2 and values.size else None
                packing = {"maxshape": limits, "compression": "gzip"} if limits else {}
                new.create_dataset(name, data=values, **packing)

    return written


def all_of_a_take(path: Path) -> list[bytes]:
    """All of a take."""
    take = read_take(path)
    arrays = [take.time, take.source.values, take.params, take.std]
    texts = [take.source.names, take.controls, take.units, take.start_timecode, take.fps]
    texts += [take.up_axis, take.model, take.created_by]
    return [np.asarray(one).tobytes() for one in arrays] + [repr(texts).encode()]


def all_of_a_rig(path: Path) -> list[bytes]:
    """All of a rig."""
    rig = read_rig(path)
    arrays = [rig.neutral, rig.shapes, rig.faces]
    return [one.tobytes() for one in arrays] + [repr((rig.names, rig.units)).encode()]


def all_frames(path: Path) -> list[bytes]:
    """All frames of a mesh sequence."""
    with open_mesh_sequence(path) as sequence:
        mesh = sequence.neutral
        frames = [one.tobytes() for one in sequence.batches(2)]
        return [mesh.vertices.tobytes(), mesh.faces.tobytes(), repr(sequence.fps).encode(), *frames]


KINDS = {
    "take": (a_take, all_of_a_take),
    "rig": (a_rig, all_of_a_rig),
    "mesh sequence": (a_mesh_sequence, all_frames),
    "take, newest HDF5": (newest(a_take), all_of_a_take),
    "rig, newest HDF5": (newest(a_rig), all_of_a_rig),
    "mesh sequence, newest HDF5": (newest(a_mesh_sequence), all_frames),
}


def outcome(read: Callable[[Path], list[bytes]], path: Path, before: list[bytes]) -> str:
    """What becomes of reading one changed file."""
    signal.alarm(PATIENCE)
    try:
        return "as before" if read(path) == before else "other values"
    except InputError:
        return "refused"
    except BaseException as error:
        return f"TRACEBACK {type(error).__name__}: {error}"[:100]
    finally:
        signal.alarm(0)


def main() -> None:
    """Change each byte in several ways, and count."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n\n")[0])
    parser.add_argument("--stride", type=int, default=1, help="every how many bytes")
    stride = parser.parse_args().stride
    total: Counter[str] = Counter()
    longest = 0.0
    with tempfile.TemporaryDirectory(prefix="flips-") as folder:
        for name, (write, read) in KINDS.items():
            path = Path(folder) / f"{name.replace(' ', '-')}.h5"
            write(path)
            content, before = path.read_bytes(), read(path)
            counts: Counter[str] = Counter()
            for at in range(0, len(content), stride):
                for byte in {change(content[at]) for change in PATTERNS.values()} - {content[at]}:
                    path.write_bytes(content[:at] + bytes([byte]) + content[at + 1 :])
                    begin = time.process_time()
                    counts[outcome(read, path, before)] += 1
                    longest = max(longest, time.process_time() - begin)
            print(f"{name} ({len(content)} bytes): {dict(counts)}", flush=True)
            total += counts
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{total.total()} changes: {dict(total)}")
    print(f"longest {longest:.3f} CPU s, peak {peak:.0f} MiB of the process")
    sys.exit(bool(total.keys() - {"refused", "as before", "other values"}))


if __name__ == "__main__":
    main()

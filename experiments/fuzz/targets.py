"""What is fuzzed: readers of files, and decoders of packets."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from experiments.fuzz.pieces import BORDER, GLB, METADATA, PLAIN, TENSORS, ZIP, Pieces, edits_of
from facert.errors import FacertError

TESTS = Path(__file__).parents[2] / "tests" / "fuzz"
SEEDS, FINDINGS = TESTS / "seeds", TESTS / "findings"


@dataclass(frozen=True)
class Target:
    """A reader, with valid inputs to begin with.

    `run` returns whether an input was accepted, and raises what is a finding.
    """

    name: str
    run: Callable[[bytes], bool]
    seeds: tuple[bytes, ...]

    def findings(self) -> list[Path]:
        """Files with inputs that once were findings of this target."""
        return sorted(FINDINGS.glob(f"{self.name}-*"))


def targets(*names: str) -> list[Target]:
    """The targets with these names, or all."""
    found = {one.name: one for one in (*_of_files(), *_of_packets())}
    unknown = set(names) - set(found)
    if unknown:
        raise SystemExit(f"no target {', '.join(unknown)}; there are {', '.join(found)}")
    return [found[name] for name in names or found]


def _of_files() -> Iterable[Target]:
    from facert.io.formats import read_mesh, read_rig_file, read_take_file
    from facert.io.toml import read_drivers, read_regions
    from facert.retarget.retargeter import load

    def file(
        name: str,
        ending: str,
        read: Callable[[Path], object],
        pieces: Pieces = PLAIN,
        seeds: str | None = None,
    ) -> Target:
        valid = [one.read_bytes() for one in sorted(SEEDS.glob(seeds or f"{name}.*"))]
        run = partial(_read, ending, read, pieces)
        return Target(name, run, tuple(map(pieces.split, valid)))

    def hdf5(name: str, read: Callable[[Path], object]) -> Target:
        original = (SEEDS / f"{name}.h5").read_bytes()
        return file(name, ".h5", read, edits_of(original))

    yield file("csv", ".csv", read_take_file, seeds="csv*.csv")
    yield file("trc", ".trc", read_take_file)
    yield file("facecap", ".txt", read_take_file)
    yield file("json", ".json", read_take_file, seeds="json*.json")
    yield file("c3d", ".c3d", read_take_file)
    yield file("glb-take", ".glb", read_take_file, GLB, "*.glb")
    yield file("glb-rig", ".glb", read_rig_file, GLB, "*.glb")
    yield file("npz-take", ".npz", read_take_file, ZIP)
    yield file("npz-rig", ".npz", read_rig_file, ZIP)
    yield file("zip", ".npz", read_take_file, seeds="npz-take.npz")
    yield hdf5("hdf5-take", read_take_file)
    yield hdf5("hdf5-rig", read_rig_file)
    yield file("tensors", ".safetensors", load, TENSORS, "model.*")
    yield file("metadata", ".safetensors", load, METADATA, "model.*")
    yield file("obj", ".obj", read_mesh)
    yield file("ply", ".ply", read_mesh, seeds="ply*.ply")
    yield file("regions", ".toml", read_regions)
    yield file("drivers", ".toml", read_drivers)


def _read(ending: str, read: Callable[[Path], object], pieces: Pieces, data: bytes) -> bool:
    """Read the file of an input: facert's own errors are what a damaged one should raise."""
    with TemporaryDirectory(dir=_memory()) as folder:
        path = Path(folder) / f"input{ending}"
        path.write_bytes(pieces.join(data))
        try:
            read(path)
        except FacertError:
            return False
    return True


def _memory() -> Path | None:
    """A folder in memory, where there is one."""
    shared = Path("/dev/shm")
    return shared if shared.is_dir() else None


def _of_packets() -> Iterable[Target]:
    from facert.live.ifacialmocap import IFacialMocapDecoder
    from facert.live.livelink_packets import LiveLinkDecoder
    from facert.live.vmc import OscDecoder

    weights = partial(OscDecoder, ("jawOpen", "browInnerUp"), "weights")
    markers = partial(OscDecoder, ("chin", "brow"), "markers", "m")
    for name, decoder in {
        "livelink": LiveLinkDecoder,
        "ifacialmocap": IFacialMocapDecoder,
        "vmc": weights,
        "osc": markers,
    }.items():
        valid = [one.read_bytes() for one in sorted(SEEDS.glob(f"{name}.bin"))]
        yield Target(name, partial(_decode, decoder), tuple(valid))


def _decode(decoder: Callable[[], Any], data: bytes) -> bool:
    """Give all packets of an input to one decoder; whether it took them all."""
    from facert.live.frames import BadPacketError

    one, taken = decoder(), True
    for packet in data.split(BORDER):
        try:
            one.decode(packet)
            one.rehearse(packet)
        except BadPacketError:
            taken = False
    return taken

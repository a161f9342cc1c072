"""Model files of every method, mutated: what loading them and mapping a take with them comes to.

A mutation changes bytes of the file (of its header, its metadata or its arrays), a number of an
array, a value of the metadata, or a shape. Each is loaded and mapped with, in a child process with
a limit of memory and a time-out. Counted are the files that were refused, those that gave the same
poses or other finite ones, and what must not be: poses that are not finite, exceptions other than
facert's, warnings of NumPy, processes that died.

    python -m experiments.reliability.model_mutations [--count 20000] [--seed 0] [--jobs 1]
"""

from __future__ import annotations

import argparse
import json
import logging
import multiprocessing
import resource
import struct
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

import facert
from facert.data.take import Take
from facert.errors import FacertError

MODELS = Path(__file__).parents[2] / "tests" / "retarget" / "models"
FRAMES = 12
SECONDS, MEMORY = 20, 6 << 30
BAD = ("not finite", "exception", "died")
NUMBERS = (0.0, -0.0, -1.0, 1e-320, 1e-160, 1e-12, 1e12, 1e160, 1.7e308, -1.7e308, np.nan, np.inf)
DEEP = "[" * 50_000 + "]" * 50_000
VALUES: tuple[Any, ...] = (
    None, True, -1, 0, 1, 2**63, 10**30, 0.5, 1e308, "", "x", "\ud800", "\x1b[2J", "a" * 5000, [],
    [1], ["a", "a"], {}, {"a": {"b": []}}, [[[[[[]]]]]], {"": 1},
)  # fmt: skip

Rng = np.random.Generator
Mutation = Callable[[bytes, Rng], bytes]


def flip(content: bytes, rng: Rng) -> bytes:
    """One bit of the arrays turned round."""
    return _with_byte(content, rng, 8 + _length(content), len(content), 1 << rng.integers(8))


def flip_in_header(content: bytes, rng: Rng) -> bytes:
    """One bit of the header or its length turned round."""
    return _with_byte(content, rng, 0, 8 + _length(content), 1 << rng.integers(8))


def replace_in_header(content: bytes, rng: Rng) -> bytes:
    """A byte of the header replaced by one that JSON knows."""
    place = rng.integers(8, 8 + _length(content))
    return (
        content[:place]
        + bytes([rng.choice(list(b'0123456789-.e"{}[],:tfn\\ '))])
        + (content[place + 1 :])
    )


def cut(content: bytes, rng: Rng) -> bytes:
    """Some bytes left out, doubled, or cut off."""
    first, last = sorted(rng.integers(0, len(content), 2))
    return rng.choice([content[:first], content[:first] + content[last:],
                       content[:last] + content[first:]])  # fmt: skip


def number(content: bytes, rng: Rng) -> bytes:
    """One number of an array, or a few, replaced by an extreme one."""
    start = 8 + _length(content)
    made = bytearray(content)
    for _ in range(rng.choice([1, 1, 1, 5])):
        place = start + 8 * rng.integers((len(content) - start) // 8)
        struct.pack_into("<d", made, place, rng.choice(NUMBERS))
    return bytes(made)


def whole_array(content: bytes, rng: Rng) -> bytes:
    """One array scaled, or filled with one number."""
    header, data = _parted(content)
    name = rng.choice([n for n in header if n != "__metadata__"])
    first, last = header[name]["data_offsets"]
    values = np.frombuffer(data[first:last])
    with np.errstate(all="ignore"):
        made = np.full_like(values, rng.choice(NUMBERS)) if rng.random() < 0.5 else (
            values * rng.choice(NUMBERS)
        )  # fmt: skip
    return _joined(header, data[:first] + made.tobytes() + data[last:])


def shape(content: bytes, rng: Rng) -> bytes:
    """The shape or the type of an array, its name, or its place changed."""
    header, data = _parted(content)
    names = [n for n in header if n != "__metadata__"]
    name, other = rng.choice(names, 2)
    entry = header[name]
    kind = rng.integers(6)
    if kind == 0:
        entry["shape"] = rng.choice([[], [0], [*entry["shape"], 1], entry["shape"][::-1],
                                     [2**40, 2**40], [-1]], axis=None) if False else (
            [[], [0], [*entry["shape"], 1], entry["shape"][::-1], [2**40, 2**40], [-1]]
        )[rng.integers(6)]  # fmt: skip
    elif kind == 1:
        entry["dtype"] = str(rng.choice(["F32", "I64", "BF16", "", "F64 "]))
    elif kind == 2:
        header[f"{name}x"] = header.pop(name)
    elif kind == 3:
        header[name], header[other] = header[other], header[name]
    elif kind == 4:
        entry["data_offsets"] = header[other]["data_offsets"]
    else:
        header[str(rng.choice(["extra", "method.extra", "motion.extra"]))] = dict(entry)
    return _joined(header, data)


def metadata(content: bytes, rng: Rng) -> bytes:
    """A value anywhere in the metadata replaced, left out, or doubled."""
    header, data = _parted(content)
    document = json.loads(header["__metadata__"]["facert"])
    places = list(_places(document))
    owner, key = places[rng.integers(len(places))]
    if rng.random() < 0.2:
        del owner[key]
    else:
        owner[key] = VALUES[rng.integers(len(VALUES))]
    text = json.dumps(document)
    if rng.random() < 0.02:
        text = text.replace("null", DEEP, 1)
    header["__metadata__"]["facert"] = text
    return _joined(header, data)


MUTATIONS: tuple[Mutation, ...] = (
    flip, flip_in_header, replace_in_header, cut, number, whole_array, shape, metadata, metadata,
)  # fmt: skip


def _with_byte(content: bytes, rng: Rng, start: int, end: int, bits: int) -> bytes:
    place = rng.integers(start, end)
    return content[:place] + bytes([content[place] ^ bits]) + content[place + 1 :]


def _length(content: bytes) -> int:
    return int.from_bytes(content[:8], "little")


def _parted(content: bytes) -> tuple[dict[str, Any], bytes]:
    length = _length(content)
    return json.loads(content[8 : 8 + length]), content[8 + length :]


def _joined(header: dict[str, Any], data: bytes) -> bytes:
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    return struct.pack("<Q", len(text)) + text + data


def _places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Every value inside a document, by what holds it and where."""
    keys = (
        value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    )
    for key in keys:
        yield value, key
        yield from _places(value[key])


def attempt(path: Path, take: Take, expected: np.ndarray, mode: Any) -> str:
    """What loading a file, and mapping a take with it, comes to."""
    try:
        poses = facert.load(path).retarget(take, mode).params
    except FacertError as error:
        return f"refused: exit {error.exit_code}"
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        return f"exception: {error!r:.100} in {Path(last.filename).name}:{last.lineno}"
    if poses is None or not np.isfinite(poses).all():
        return "not finite"
    return "the same poses" if np.array_equal(poses, expected) else "other poses"


def mutant(seeds: Sequence[bytes], index: int, seed: int) -> tuple[int, str, bytes]:
    """The file of an index: which model it was made of, by which mutation, and its bytes."""
    rng = np.random.default_rng((seed, index))
    model, mutate = int(rng.integers(len(seeds))), MUTATIONS[rng.integers(len(MUTATIONS))]
    return model, mutate.__name__, mutate(seeds[model], rng)


def seeds_and_poses(take: Take) -> list[tuple[bytes, dict[str, np.ndarray]]]:
    """The models of all methods as this release writes them, and their poses of a take."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for path in sorted(MODELS.glob("*.safetensors")):
            facert.load(path).save(Path(folder) / path.name)
            again = facert.load(Path(folder) / path.name)
            poses = {mode: again.retarget(take, mode).params for mode in ("offline", "online")}  # type: ignore[arg-type]
            found.append(((Path(folder) / path.name).read_bytes(), poses))
    return found


def short_take() -> Take:
    """A take of a few frames for the models."""
    whole = facert.read_take(MODELS / "take.h5")
    source = whole.source.values[:FRAMES].copy()
    source[3, 1] = np.nan
    return Take(whole.time[:FRAMES], facert.Source(source, whole.source.names), units=whole.units)


def _work(pipe: Connection, indices: Sequence[int], seed: int) -> None:
    """Try files one after the other, and tell of each before and after."""
    logging.disable(logging.CRITICAL)
    warnings.simplefilter("error", RuntimeWarning)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    take = short_take()
    seeds = seeds_and_poses(take)
    files = [content for content, _ in seeds]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.safetensors"
        for index in indices:
            model, name, content = mutant(files, index, seed)
            path.write_bytes(content)
            mode = "online" if index % 4 == 0 else "offline"
            pipe.send((index, name))
            began = time.perf_counter()
            outcome = attempt(path, take, seeds[model][1][mode], mode)
            seconds = time.perf_counter() - began
            pipe.send((outcome, seconds, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss))
    pipe.send(None)


def run(count: int, seed: int) -> Iterator[tuple[str, int, str, float, int]]:
    """Mutation, index, outcome, seconds and kibibytes of each file."""
    waiting = list(range(count))
    while waiting:
        here, there = multiprocessing.Pipe()
        child = multiprocessing.get_context("spawn").Process(
            target=_work, args=(there, waiting, seed)
        )
        child.start()
        there.close()
        index, name = waiting[0], ""
        try:
            while (said := here.recv() if here.poll(60) else None) is not None:
                index, name = said
                waiting = waiting[1:] if waiting[0] == index else waiting
                if not here.poll(SECONDS):
                    raise EOFError
                outcome, seconds, size = here.recv()
                yield name, index, outcome, seconds, size
        except EOFError:
            yield name, index, "died", SECONDS, 0
        child.kill()
        child.join()


def main() -> None:
    """Print what became of all files, and those that must not be."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    outcomes: Counter[str] = Counter()
    bad, longest, peak = 0, (0.0, -1), 0
    for name, index, outcome, seconds, size in run(options.count, options.seed):
        outcomes[outcome.split(":")[0] if outcome.startswith(BAD) else outcome] += 1
        longest, peak = max(longest, (seconds, index)), max(peak, size)
        if outcome.startswith(BAD):
            bad += 1
            print(f"{name} {index}: {outcome}", flush=True)
    for outcome, number_of_files in sorted(outcomes.items()):
        print(f"{number_of_files:7d} {outcome}")
    print(f"longest {longest[0]:.2f} s (file {longest[1]}), peak memory {peak / 1024:.0f} MiB")
    raise SystemExit(bool(bad))


if __name__ == "__main__":
    main()

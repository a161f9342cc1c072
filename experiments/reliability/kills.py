"""Commands that are ended at random moments: what is left, and what the next run makes of it.

    python -m experiments.reliability.kills [KILLS] [COMMAND...]

Each command is ended again and again in one folder, by SIGKILL, SIGTERM and SIGINT in turn, at
moments drawn from the time that it takes. After each end its output is absent or whole, and nothing
that it started lives on. At last it runs to its end: nothing of the ended runs is left, and results
equal those of a run that nothing interrupted. Python itself needs some hundredths of a second until
facert has the word: a signal is sent only after that.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
import uuid
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import facert
from facert.data.take import Take
from facert.demo import training_take

FACERT = (sys.executable, "-c", "from facert.cli.app import main; main()")
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
NOISE = ("Traceback", "Exception ignored", "terminate called", "leaked", "Fatal")
ENDS = 3.0  # seconds within which workers and other programs have to end after facert did
MARK = "FACERT_KILLS"  # environment variable by which all processes of a run are found
FRAMES = 60
FAULTS = ("half-written", "left behind", "orphans", "tracebacks", "status", "other result")


def _read_json(path: Path) -> object:
    """The figures of a file, but for times."""
    found = json.loads(path.read_text(encoding="utf-8"))
    return [{**row, "fit_seconds": 0, "frame_ms": 0} for row in found["rows"]]


def _read_take(path: Path) -> object:
    take = facert.read_take(path)
    return len(take), None if take.params is None else take.params.tobytes()


def _read_model(path: Path) -> object:
    return facert.load(path).figures.get("status") == "interrupted" or path.read_bytes()


def _read_clip(path: Path) -> object:
    from imageio_ffmpeg import count_frames_and_secs

    return count_frames_and_secs(str(path))[0]


def _read_page(path: Path) -> object:
    text = path.read_text(encoding="utf-8")
    assert text.rstrip().endswith("</html>")
    return True


@dataclass(frozen=True)
class Command:
    """A command in a folder that has `take.h5`, `takes/`, `rig.h5` and `ridge.safetensors`."""

    arguments: str
    outputs: str  # Pattern of the files that it writes
    read: Callable[[Path], object]  # What is to be the same; raises where a file is not whole
    recovered: str = ""  # Pattern of the files in which a later run keeps what an ended one has


COMMANDS = {
    "train": Command(
        "train take.h5 -o m.safetensors --config often.toml --resume --overwrite",
        "m.safetensors",
        _read_model,
    ),
    "auto": Command("train take.h5 -o a.safetensors --overwrite", "a.safetensors", _read_model),
    "retarget": Command(
        "retarget take.h5 r.h5 -m ridge.safetensors --overwrite", "r.h5", _read_take
    ),
    "convert": Command("convert take.h5 c.glb --rig rig.h5 --overwrite", "c.glb", _read_take),
    "clean": Command("clean take.h5 k.h5 --overwrite", "k.h5", _read_take),
    "propagate": Command("propagate take.h5 n.h5 --every 10 --overwrite", "n.h5", _read_take),
    "eval": Command(
        "eval take.h5 --methods ridge,nearest --labels 4,5,6 --repeats 4 --unlabelled 4 --jobs 2"
        " --json e.json --overwrite",
        "e.json",
        _read_json,
    ),
    "batch": Command(
        "clean takes --out-dir cleaned --jobs 2 --overwrite", "cleaned/*.h5", _read_take
    ),
    "render": Command("render take.h5 v.mp4 --rig rig.h5 --overwrite", "v.mp4", _read_clip),
    "report": Command("report take.h5 -o p.html --rig rig.h5 --overwrite", "p.html", _read_page),
    "live": Command(
        "live --in take:take.h5 --out h5:l.h5 -m ridge.safetensors --record i.h5 --overwrite",
        "[li].h5",
        _read_take,
        recovered="*-recovered*",
    ),
}


def prepare(folder: Path) -> None:
    """Write what the commands read: small takes, a character and a model."""
    from facert.demo.files import character_rig
    from facert.io.formats import write_rig_file

    take = _shortened(training_take(posed=None))
    facert.write_take(take, folder / "take.h5")
    (folder / "takes").mkdir()
    for name in "abcd":
        facert.write_take(take, folder / "takes" / f"{name}.h5")
    write_rig_file(character_rig(), folder / "rig.h5")
    facert.train(take, facert.Settings(method="ridge")).save(folder / "ridge.safetensors")
    often = 'method = "ssgplvm"\nlabels = 10\nunlabelled = 10\ncheckpoint_seconds = 0.0\n'
    (folder / "often.toml").write_text(f"{often}max_iterations = 100\ntolerance = 0.0\n")


def _shortened(take: Take) -> Take:
    assert take.params is not None
    step = len(take) // FRAMES
    part = slice(0, FRAMES * step, step)
    source = replace(take.source, values=take.source.values[part])
    poses = take.params[part]
    return replace(take, time=take.time[:FRAMES], source=source, params=poses, animation=None)


@dataclass
class Ended:
    """How a run ended."""

    status: int
    text: str
    seconds: float
    orphans: int


def run(
    arguments: str, folder: Path, number: signal.Signals | None = None, after: float = 0.0
) -> Ended:
    """Run a command, and send it a signal so many seconds after its handlers stand."""
    mark = uuid.uuid4().hex
    paths = os.pathsep.join([os.getcwd(), *sys.path])  # noqa: PTH109
    environment = {**os.environ, MARK: mark, "PYTHONPATH": paths}
    with (folder / ".said").open("w+") as said:
        process = subprocess.Popen(
            [*FACERT, *arguments.split()],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=said,
        )
        _wait_for_handlers(process)
        began = time.monotonic()
        if number is not None:
            with suppress(subprocess.TimeoutExpired):
                process.wait(after)
            process.send_signal(number)
        status = process.wait()
        seconds = time.monotonic() - began
        orphans = _orphans(mark)
        said.seek(0)
        text = said.read()
    (folder / ".said").unlink()
    return Ended(status, text, seconds, orphans)


def _wait_for_handlers(process: subprocess.Popen[bytes]) -> None:
    """Wait until the process handles SIGTERM."""
    while process.poll() is None:
        with suppress(OSError):
            lines = Path(f"/proc/{process.pid}/status").read_text().splitlines()
            caught = next((one.split()[1] for one in lines if one.startswith("SigCgt")), "0")
            if int(caught, 16) >> (signal.SIGTERM - 1) & 1:
                return
        time.sleep(0.002)


def _orphans(mark: str) -> int:
    """How many processes of a run live on; the last of them have some time to end."""
    until = time.monotonic() + ENDS
    while True:
        alive = sum(_is_of(process, mark) for process in Path("/proc").glob("[0-9]*"))
        if not alive or time.monotonic() > until:
            return alive
        time.sleep(0.02)


def _is_of(process: Path, mark: str) -> bool:
    try:
        return mark.encode() in (process / "environ").read_bytes()
    except OSError:
        return False


def kill(
    name: str, folder: Path, count: int, rng: random.Random, say: Callable[[str], object] = print
) -> Counter[str]:
    """End a command so many times; the faults that were found, and how often it was ended."""
    command, found = COMMANDS[name], Counter[str]()
    whole = run(command.arguments, folder)
    assert whole.status == 0, whole.text
    seconds = whole.seconds
    expected = _results(command, folder)
    own = set(folder.rglob("*"))
    for output in folder.glob(command.outputs):
        if rng.random() < 0.5:  # else an earlier output is there, and stays whole
            output.unlink()
    for each in range(count):
        number = SIGNALS[each % len(SIGNALS)]
        ended = run(command.arguments, folder, number, rng.uniform(0.0, seconds))
        if not ended.status:  # the first run was slower, as nothing was in memory
            seconds = min(seconds, ended.seconds)
        faults = _faults(command, folder, ended, number)
        found.update(faults)
        found["ended" if ended.status else "done before"] += 1
        for fault in faults:
            say(f"{name}: {number.name}: {fault}: {ended.status}: {ended.text[-1500:]}")
    last = run(command.arguments, folder)
    own |= set(folder.glob(command.recovered)) if command.recovered else set()
    left = [str(path.relative_to(folder)) for path in set(folder.rglob("*")) - own]
    if last.status or left:
        found["left behind"] += 1
        say(f"{name}: at last {last.status} {left}: {last.text[-1500:]}")
    if name != "live" and _results(command, folder) != expected:  # its frames are timed
        found["other result"] += 1
        say(f"{name}: other results than those of a run that nothing interrupted")
    return found


def _faults(command: Command, folder: Path, ended: Ended, number: signal.Signals) -> list[str]:
    """What is wrong after a command was ended."""
    faults = []
    ending = -number if number == signal.SIGKILL else 128 + number
    if ended.status not in (0, ending):  # 0: done before
        faults.append("status")
    if any(noise in ended.text for noise in NOISE):
        faults.append("tracebacks")
    if ended.orphans:
        faults.append("orphans")
    try:
        _results(command, folder)
    except Exception:
        faults.append("half-written")
    return faults


def _results(command: Command, folder: Path) -> list[object]:
    found = sorted(folder.glob(command.outputs))
    return [command.read(path) for path in found if not path.name.startswith(".")]


def main(arguments: Sequence[str]) -> None:
    """Print a line for each command, and one for all."""
    kills = int(arguments[0]) if arguments else 200
    names = arguments[1:] or list(COMMANDS)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background ignores it
    rng, total = random.Random(0), Counter[str]()
    for name in names:
        with TemporaryDirectory() as place:
            prepare(Path(place))
            found = kill(name, Path(place), -(-kills // len(names)), rng)
        total += found
        print(f"{name:10}", _text(found), flush=True)
    print(f"{'all':10}", _text(total))


def _text(found: Counter[str]) -> str:
    return ", ".join(f"{one} {found[one]}" for one in ("ended", "done before", *FAULTS))


if __name__ == "__main__":
    main(sys.argv[1:])

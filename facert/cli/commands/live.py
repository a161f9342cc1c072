"""``facert live``: a performance retargeted while it is played."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from facert.cli.shared import console
from facert.cli.shared.completion import names_in
from facert.cli.shared.interrupt import interruptible
from facert.cli.shared.options import (
    AS_JSON,
    CONTROLS,
    DEFAULT_MODEL,
    NO_DETECT,
    NO_SMOOTH,
    OVERWRITE,
    SIGMA,
    TARGET,
    MappingOptions,
    file_option,
    option,
)

if TYPE_CHECKING:
    from facert.live.endpoints import Address, File
    from facert.live.receivers import Receiver
    from facert.live.senders import UdpSender
    from facert.retarget.retargeter import Retargeter

_Parsed = TypeVar("_Parsed")

PRIORITY = 10
"""Steps of niceness that a session goes before other programs."""


def command(
    source: Annotated[
        str,
        option(
            "livelink:11111 (Live Link Face), vmc:39540, osc:9000, ifacialmocap:49983, "
            "or take:FILE, played in real time.",
            "--in",
            metavar="KIND[:PORT]",
            autocompletion=names_in("facert.live.endpoints.INPUTS"),
        ),
    ],
    outputs: Annotated[
        list[str],
        option(
            "vmc:127.0.0.1:39539, osc:HOST:PORT, livelink:HOST:PORT, csv:FILE or h5:FILE; "
            "again for more.",
            "--out",
            metavar="KIND[:HOST[:PORT]]",
            autocompletion=names_in("facert.live.endpoints.OUTPUTS"),
        ),
    ],
    model: Annotated[
        Path, option("Model file; a new one is taken over when it changes.", "--model", "-m")
    ] = DEFAULT_MODEL,
    listen: Annotated[
        str,
        option(
            "Where to listen: by default to this machine alone; 0.0.0.0 for a phone.",
            metavar="ADDRESS",
        ),
    ] = "127.0.0.1",
    speed: Annotated[float, option("Of a played take.", min=0.01, max=100)] = 1.0,
    target: TARGET = None,
    controls_path: CONTROLS = None,
    no_detect: NO_DETECT = False,
    no_smooth: NO_SMOOTH = False,
    sigma: SIGMA = None,
    neutral: Annotated[
        float | None,
        option(
            "The actor rests for so long at first; that makes up for another day's markers.",
            min=0.1,
            max=60.0,
            metavar="SECONDS",
        ),
    ] = None,
    record: Annotated[
        Path | None, file_option("Take of what comes in: .h5, .csv, .livelink.csv.")
    ] = None,
    frames: Annotated[int | None, option("Stop after so many; else Ctrl-C does.", min=1)] = None,
    seconds: Annotated[float | None, option("Stop after so many.", min=0.1)] = None,
    as_json: AS_JSON = False,
    overwrite: OVERWRITE = False,
) -> None:
    """Retarget frame after frame as they come in, and send each pose at once.

    A status line shows rate, latency, and packets that were dropped or bad. Files are written at
    the end.

    facert live --in take:facert-demo/performance.h5 --out csv:live.csv
    facert live --in livelink:11111 --out vmc:127.0.0.1:39539 --listen 0.0.0.0
    """
    from facert.cli.shared.live_status import Status, print_summary
    from facert.errors import reading
    from facert.live.endpoints import File, parse_input, parse_output
    from facert.live.live_model import LiveModel, ModelFile
    from facert.live.loop import Limits, LiveSession
    from facert.live.recording import Recordings

    begin, ends = _parsed(parse_input, source), [_parsed(parse_output, one) for one in outputs]
    file = ModelFile(model)
    retargeter = file.load()
    with ExitStack() as stack:
        receiver = _open_receiver(begin, listen, retargeter, speed, target)
        stack.callback(receiver.close)
        controls, pattern = retargeter.controls, receiver.pattern
        recordings = Recordings(
            pattern, retargeter.source_names, controls, overwrite, lambda: receiver.start_timecode
        )
        stack.callback(recordings.close)
        kept = recordings.source(record) if record else None
        files = [recordings.poses(end.path) for end in ends if isinstance(end, File)]
        senders = _open_senders(stack, ends, controls.names, receiver)
        with reading(source):
            options = MappingOptions(controls_path, no_detect, no_smooth, sigma)
            mapper = LiveModel(file, retargeter, pattern, receiver.fps, options, neutral)
            stack.enter_context(mapper)
        session = LiveSession(receiver, mapper, senders, files, kept)
        stopped = stack.enter_context(interruptible()).is_set
        stack.enter_context(_loaded_exempt_from_gc())
        stack.enter_context(_raised_priority())
        status = stack.enter_context(Status(session))
        _announce(begin, listen, receiver, ends)
        _announce_recordings(recordings.going_on)
        if neutral is not None:
            _announce_rest(neutral, retargeter)
        try:
            session.run(Limits.of(frames, seconds), stopped, status.show)
        finally:  # a performance is not to be had again
            if session.counters.mapped and mapper.is_uncalibrated:
                console.log.warning("ended before --neutral was over: no pose is calibrated")
            written = recordings.write(receiver.start_timecode)
    print_summary(session, written, as_json)


def _parsed(parse: Callable[[str], _Parsed], text: str) -> _Parsed:
    try:
        return parse(text)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None


def _open_receiver(
    begin: Address | File, listen: str, retargeter: Retargeter, speed: float, target: str | None
) -> Receiver:
    from facert.io.formats import read_take_file
    from facert.live.endpoints import File, open_receiver
    from facert.live.frames import frame_pattern
    from facert.live.receivers import TakeReceiver

    if isinstance(begin, File):
        return TakeReceiver(read_take_file(begin.path, target), speed)
    wanted = frame_pattern(retargeter.source_names, retargeter.source_kind, retargeter.units)
    return open_receiver(begin, listen, wanted)


def _open_senders(
    stack: ExitStack, ends: Sequence[Address | File], controls: tuple[str, ...], receiver: Receiver
) -> list[UdpSender]:
    from facert.live.endpoints import Address, open_sender, refuse_echo
    from facert.live.receivers import UdpReceiver

    senders = []
    for end in ends:
        if isinstance(end, Address):
            senders.append(open_sender(end, controls, receiver.counters))
            stack.callback(senders[-1].close)
            if isinstance(receiver, UdpReceiver):
                refuse_echo(receiver, senders[-1])
    return senders


def _announce(
    begin: Address | File, listen: str, receiver: Receiver, ends: Sequence[Address | File]
) -> None:
    from facert.live.endpoints import LOOPBACK, Address
    from facert.live.receivers import UdpReceiver

    if isinstance(receiver, UdpReceiver):
        alone = " (this machine alone; --listen 0.0.0.0 for others)" if listen == LOOPBACK else ""
        place = f"{listen}:{receiver.port}{alone}"
        console.log.info("listens for %s on %s", begin.kind, place)
    for end in ends:
        if isinstance(end, Address):
            console.log.info("sends %s to %s", end.kind, end.place)


def _announce_recordings(paths: Sequence[Path]) -> None:
    if paths:
        names = ", ".join(map(str, paths))
        text = (
            "until the end all frames are in %s; if facert is killed, convert makes takes of them"
        )
        console.log.info(text, names)


def _announce_rest(seconds: float, retargeter: Retargeter) -> None:
    console.log.info(
        "the actor rests for %g s; poses are sent meanwhile, but are not calibrated yet", seconds
    )
    if retargeter.settings.neutral is None:
        console.log.warning(
            "the model does not know the actor at rest and takes the smallest pose for it: "
            "train with --neutral as well"
        )


@contextmanager
def _raised_priority() -> Iterator[None]:
    """Raise this thread's priority over other programs, where the system allows it.

    A packet that is sent wakes its receiver, which would else go first until the next one is sent.
    """
    taken = False
    if sys.platform != "win32":
        with suppress(OSError):
            os.nice(-PRIORITY)
            taken = True
    try:
        yield
    finally:
        if taken:
            os.nice(PRIORITY)


@contextmanager
def _loaded_exempt_from_gc() -> Iterator[None]:
    """Exempt what was loaded from garbage collection: a pass over it takes milliseconds."""
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()

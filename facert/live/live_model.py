"""The model of a session, replaced without a pause when its file changes."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import facert
from facert.data.rate import nominal_rate
from facert.errors import FacertError, InputError, NumericalError
from facert.live.frames import Frame
from facert.live.opening import PlacementWatch, RestWatch
from facert.preprocess.faults import FaultDetector
from facert.retarget.options import RetargetOptions

if TYPE_CHECKING:
    from facert.data.arrays import FloatArray
    from facert.data.take import Take
    from facert.retarget.retargeter import Retargeter
    from facert.retarget.stream import RetargetStream, Streamed

log = logging.getLogger("facert")

LOOK_EVERY = 0.5
"""Seconds between two looks at the file."""
NEAR = 0.2
_WARMING = 30
_MEASURED = 60
"""Frames after which the rate of a source is known that does not state it."""

Signature = tuple[int, int, int]


@dataclass(frozen=True)
class Loaded:
    """A retargeter with two streams of its own."""

    retargeter: Retargeter
    options: RetargetOptions
    stream: RetargetStream
    """Maps the session's frames, which are taken to come at `fps`."""
    twin: RetargetStream
    """Rehearses them, so that the stream's memory stays what the frames made it."""
    fps: float | None

    def calibrate(self, rest: FloatArray) -> None:
        """Calibrate both streams to the actor at rest."""
        self.stream.calibrate(rest)
        self.twin.calibrate(rest)


class ModelFile:
    """A model file that may change at any time.

    Parameters
    ----------
    path : Path
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._seen: Signature | None = None

    def changed(self) -> bool:
        """Whether the file differs from the one that was last loaded, or tried."""
        found = self._signature()
        return found is not None and found != self._seen

    def load(self) -> Retargeter:
        """Read the file; raises InputError as `facert.load` does."""
        self._seen = self._signature()
        return facert.load(self.path)

    def _signature(self) -> Signature | None:
        """Modification time, size and inode of the file; None while there is none."""
        try:
            found = self.path.stat()
        except OSError:
            return None
        return found.st_mtime_ns, found.st_size, found.st_ino


class LiveModel:
    """Maps frame after frame; while it is entered, it watches its file.

    A new file is loaded beside the running stream and takes its place between two frames. One that
    is broken, or of other controls, is warned about, and the model in use stays.

    Parameters
    ----------
    file : ModelFile
    retargeter : Retargeter
        What was loaded from it.
    pattern : Take
        With the names, kind and units of the frames.
    fps : float, optional
        Nominal frames a second; measured when they are not known.
    options : callable, optional
        What is done about bad markers, noise and single controls, for a model.
    rest_seconds : float, optional
        At the session's start in which the actor rests; from then on frames are calibrated.

    Raises
    ------
    InputError
        When the model needs others.
    """

    def __init__(
        self,
        file: ModelFile,
        retargeter: Retargeter,
        pattern: Take,
        fps: float | None = None,
        options: Callable[[Retargeter], RetargetOptions] | None = None,
        rest_seconds: float | None = None,
    ) -> None:
        self._file, self._pattern, self._fps = file, pattern, fps
        self._options = options or (lambda _: RetargetOptions())
        _require_fit(retargeter, pattern)
        self._columns = retargeter.layout.columns(pattern.source.names)  # of each model to come
        self._loaded = self._prepare(retargeter)
        self._next: Loaded | None = None
        self._times: list[float] = []
        self._rest: FloatArray | None = None
        self._rest_watch = None
        if rest_seconds is not None:
            seen = self._loaded.options.detect and pattern.source.kind == "markers"
            watch = FaultDetector(len(pattern.source.names)) if seen else None
            self._rest_watch = RestWatch(rest_seconds, watch)
        self._placement: PlacementWatch | None = None
        if rest_seconds is None and pattern.source.kind == "markers":
            self._placement = PlacementWatch(retargeter, pattern.source.names)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="facert model", daemon=True)

    def __enter__(self) -> LiveModel:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    @property
    def retargeter(self) -> Retargeter:
        """The retargeter in use."""
        return self._loaded.retargeter

    @property
    def is_uncalibrated(self) -> bool:
        """Whether the actor's neutral face is to be measured and is not known yet."""
        return self._rest_watch is not None

    def step(self, frame: Frame) -> Streamed:
        """The pose of the next frame.

        Raises
        ------
        NumericalError
            When it is not finite.
        FacertError
            When the frame cannot be mapped.
        """
        if self._next is not None:
            loaded, self._next = self._next, None
            self._use(loaded)
            log.info("%s: the new model is in use", self._file.path)
        elif self._fps is None:
            self._measure_rate(frame.time)
        if self._rest_watch is not None:
            self._rest_watch.see(frame)
        if self._placement is not None:
            self._placement.see(frame)
        return _finite(self._loaded.stream, frame)

    def prepare(self) -> None:
        """Calibrate and check placement when it is time, and compute ahead for the next frame."""
        watch = self._rest_watch
        if watch is not None and watch.is_over:
            self._rest = watch.rest(self.retargeter.source_units.scale)
            self._rest_watch = None
            self._loaded.calibrate(self._rest)
            log.info("calibrated: the actor at rest is known")
        if self._placement is not None and self._placement.is_over:
            self._placement.warn()
            self._placement = None
        with suppress(np.linalg.LinAlgError, ArithmeticError):  # the next step meets and reports it
            self._loaded.stream.prepare()

    def rehearse(self, frame: Frame) -> Streamed:
        """Map a frame on the second stream, without effect, so that code and data are cached."""
        return _finite(self._loaded.twin, frame)

    def _measure_rate(self, time: float) -> None:
        """Begin again at the measured rate when there were enough frames."""
        self._times.append(time)
        if len(self._times) == _MEASURED:
            self._fps = nominal_rate(np.array(self._times))
            if _is_near(self._fps, self.retargeter):
                self._loaded = replace(self._loaded, fps=self._fps)
            else:
                self._use(self._with_streams(self.retargeter, self._loaded.options))

    def _use(self, loaded: Loaded) -> None:
        if loaded.fps != self._fps:  # which was measured since
            loaded = self._with_streams(loaded.retargeter, loaded.options)
        self._loaded = loaded
        if self._rest is not None:
            loaded.calibrate(self._rest)

    def _with_streams(self, retargeter: Retargeter, options: RetargetOptions) -> Loaded:
        stream = retargeter.stream(self._columns, self._fps, options)
        fixed_noise, motion = options, retargeter.motion
        if options.sigma is None and motion is not None:  # a twin has no noise to measure
            sigma = motion.sigma * retargeter.source_units.scale
            fixed_noise = replace(options, sigma=sigma)
        twin = retargeter.stream(self._columns, self._fps, fixed_noise)
        return Loaded(retargeter, options, stream, twin, self._fps)

    def _prepare(self, retargeter: Retargeter) -> Loaded:
        """A stream for the session's frames, after one that made all code and caches warm."""
        rest = retargeter.source_units.mean
        if retargeter.source_kind == "markers":
            rest = rest.reshape(-1, 3)
        warming = retargeter.stream(retargeter.source_names, self._fps)
        for _ in range(_WARMING):
            warming.step(rest)
        return self._with_streams(retargeter, self._options(retargeter))

    def _watch(self) -> None:
        while not self._stop.wait(LOOK_EVERY):
            if not self._file.changed():
                continue
            try:
                self._next = self._reload()
            except Exception as error:  # whatever is wrong with the file, the show goes on
                reason = error if isinstance(error, FacertError) else repr(error)
                log.warning("the model in use stays: %s", reason)

    def _reload(self) -> Loaded:
        retargeter = self._file.load()
        same_controls = retargeter.controls.names == self.retargeter.controls.names
        if not same_controls or retargeter.layout != self.retargeter.layout:
            field, what = (
                ("/source/names", "markers or weights that the session began with, in their order")
                if same_controls
                else ("/target/names", "controls that the session began with")
            )
            fix = "Stop, and begin again with this model."
            raise InputError(field, f"the {what}", "others", fix, str(self._file.path))
        _require_fit(retargeter, self._pattern)
        return self._prepare(retargeter)


def _finite(stream: RetargetStream, frame: Frame) -> Streamed:
    """The pose of a frame, checked: raises FacertError when it is not finite."""
    try:
        pose = stream.step(frame.values)
    except (np.linalg.LinAlgError, ArithmeticError) as error:
        raise NumericalError(str(error)) from error
    if not np.isfinite(pose.params).all():
        raise NumericalError("the pose is not finite")
    return pose


def _is_near(fps: float, retargeter: Retargeter) -> bool:
    """Whether the frame rate is close to that of training: then the stream continues."""
    motion = retargeter.motion
    return motion is None or abs(fps * motion.clock[0] - 1.0) < NEAR


def _require_fit(retargeter: Retargeter, pattern: Take) -> None:
    """Refuse frames of another kind, or in other units."""
    retargeter.layout.require_kind(pattern.source.kind)
    if retargeter.units and pattern.units not in ("", retargeter.units):
        raise InputError("units", retargeter.units, pattern.units, "Convert the take to these.")

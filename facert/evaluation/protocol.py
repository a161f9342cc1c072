"""Few-shot problems out of a take whose poses are known, as in section 3 of the paper.

Each repeat draws a few labelled frames, unlabelled frames and unlabelled poses at random, and
tests on other frames. A draw depends on the seed, the repeat and the numbers alone, so that all
methods meet the same data. The draws of one repeat are nested: 20 labels are 10 labels and 10 more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np

from facert.data.arrays import BoolArray, FloatArray, IntArray
from facert.data.labelling import predicted_poses
from facert.data.matching_takes import as_takes
from facert.data.names import match
from facert.data.normalisation import Normalisation
from facert.data.rig import Rig
from facert.data.subject import about
from facert.data.take import Controls, Take
from facert.data.takes import Takes, same_recordings
from facert.data.text import plural
from facert.errors import InputError, reading
from facert.evaluation.metrics import vertex_gram
from facert.preprocess.training_set import MIN_OBSERVED

Split = Literal["random", "block"]

BLOCKS = 10
# A capped test set is made of stretches of so many frames, or jitter could not be measured.
STRETCH = 25
# What a random stream is for; part of its seed.
_FRAMES, _ANIMATION, _NOISE, _GAPS, _TEST = range(5)


@dataclass(frozen=True)
class Protocol:
    """Rules by which the data of a repeat is drawn."""

    # Test frames are any others, or those of other time blocks: the take is cut into ten, every
    # other block is for training, and the two halves change places from repeat to repeat
    split: Split = "random"
    # Standard deviation of the Gaussian noise on all frames, as a share of the largest standard
    # deviation of a source coordinate
    noise: float = 0.0
    # Share of the (frame, marker) entries that are hidden in test frames, 0 up to below 1
    missing: float = 0.0
    test_frames: int | None = None  # Test on so many frames at most; by default on all the others
    seed: int = 0

    def __post_init__(self) -> None:
        _check(self.split in get_args(Split), "split", "random or block", self.split)
        _check(0 <= self.noise < np.inf, "noise", "0 or more", self.noise)
        _check(0 <= self.missing < 1, "missing", "a share from 0 to below 1", self.missing)
        _check(self.seed >= 0, "seed", "0 or more", self.seed)
        if self.test_frames is not None:
            _check(self.test_frames >= 1, "test_frames", "1 or more", self.test_frames)


@dataclass(frozen=True, eq=False)
class Problem:
    """A take with known poses, and how methods are tried on it; made by `make_problem`."""

    # Training data is drawn from it. Where it has an animation, that is the unlabelled target;
    # else poses of its frames may be, see `poses_are_frames`.
    take: Take
    # Test frames are drawn from it: `take` itself, or another one with the same controls
    test: Take
    protocol: Protocol
    gram: FloatArray | None = None  # (P, P): The rig's, for errors of vertices
    # (n - 1,): Where another take begins among the frames of several that `take` consists of
    borders: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))

    @property
    def across(self) -> bool:
        """Whether the test frames are from another take."""
        return self.test is not self.take

    def in_time(self, frames: IntArray) -> IntArray:
        """Numbers of test frames (n,), of which those that follow each other are of one take."""
        if self.across:
            return frames
        return frames + np.searchsorted(self.borders, frames, side="right")

    def blocks(self, frames: IntArray) -> IntArray:
        """The tenth of its take in which each frame (n,) lies, from 0."""
        ends = np.concatenate([[0], self.borders, [len(self.take)]])
        part = np.searchsorted(self.borders, frames, side="right")
        return np.asarray((frames - ends[part]) * BLOCKS // (ends[part + 1] - ends[part]))

    @property
    def controls(self) -> Controls:
        """The character's controls."""
        assert self.take.controls is not None  # make_problem
        return self.take.controls

    @property
    def poses_are_frames(self) -> bool:
        """Whether the unlabelled poses are poses of the take's frames.

        They are where there is no animation and at least half of the frames are posed; in a take
        with fewer each pose is worth more as a label, and there are no unlabelled poses.
        """
        return self.take.animation is None and 2 * len(self.take.labels) >= len(self.take)

    @property
    def ranges(self) -> FloatArray:
        """Range of each control over all known poses of both takes, (P,)."""
        poses = np.vstack([_poses(take)[take.labels] for take in (self.take, self.test)])
        return np.asarray(np.ptp(poses, axis=0))


@dataclass(frozen=True, eq=False)
class Draw:
    """Which data one repeat uses; indices rise."""

    # Frames of the take
    labelled: IntArray
    unlabelled: IntArray
    poses: IntArray  # Rows of the take's animation where it has one, else frames of the take
    test: IntArray  # Frames of the test take


def make_problem(
    take: Take | Sequence[Take] | Takes,
    protocol: Protocol,
    across: Take | None = None,
    rig: Rig | None = None,
) -> Problem:
    """Check that takes and rig fit together.

    Parameters
    ----------
    take : Take, or sequence of Take
        With known poses, best in every frame; of several takes in some of them.
    protocol : Protocol
    across : Take, optional
        Test on this one instead: the same controls, in any order.
    rig : Rig, optional
        With a shape, or a left and a right half of one, for every control.

    Raises
    ------
    InputError
        When a take has no poses, names are absent, or takes do not fit together.
    """
    takes = as_takes(take)
    for part, name in takes.named:
        with about(name):
            _check_true(part)
    _check_different(takes)
    given = takes.joined
    _check_posed(given)
    assert given.controls is not None  # poses come with controls
    test, gram = given, None
    if across is not None:
        with reading("the take to test on"):
            _check_true(across)
            _check_posed(across)
            test = _with_controls(across, given.controls)
    if rig is not None:
        gram = vertex_gram(rig, given.controls)
    return Problem(given, test, protocol, gram, takes.starts[1:-1])


def draw(problem: Problem, labels: int, unlabelled: int, repeat: int) -> Draw:
    """The frames and poses of a repeat.

    Labels come from the front of one random order, unlabelled frames and poses from its back, so
    that each set holds the smaller one. Frames without a known pose serve as unlabelled first.

    Raises
    ------
    InputError
        When the take is too short.
    """
    pool, candidates = pools(problem, repeat)
    order = _rng(problem, repeat, _FRAMES).permutation(pool)
    is_posed = np.isin(order, problem.take.labels)
    posed, unposed = order[is_posed], order[~is_posed]
    labelled, back = posed[:labels], posed[::-1]
    if problem.poses_are_frames:
        frames, poses = _deal(unposed, back, unlabelled)
        used = np.concatenate([labelled, frames, poses])
    else:
        frames = np.concatenate([unposed, back])[:unlabelled]
        count = 0 if problem.take.animation is None else len(problem.take.animation)
        poses = _rng(problem, repeat, _ANIMATION).permutation(count)[:unlabelled]
        used = np.concatenate([labelled, frames])
    if not problem.across:
        candidates = np.setdiff1d(candidates, used)
    test = _capped(problem, candidates, repeat)
    if len(labelled) < labels or len(np.unique(used)) < len(used) or not len(test):
        raise _too_short(labels, unlabelled, problem, len(posed))
    return Draw(np.sort(labelled), np.sort(frames), np.sort(poses), test)


def training_take(problem: Problem, chosen: Draw, repeat: int) -> Take:
    """The data that a method may see: labelled and unlabelled frames, with noise, and poses."""
    take, rows = problem.take, np.union1d(chosen.labelled, chosen.unlabelled)
    params = np.where(np.isin(rows, chosen.labelled)[:, None], _poses(take)[rows], np.nan)
    pool = _poses(take) if take.animation is None else take.animation
    animation = pool[chosen.poses] if len(chosen.poses) else None
    source = _noisy(problem, take, repeat)[rows]
    return _frames_of(take, rows, source, params=params, animation=animation)


def held_out_take(problem: Problem, chosen: Draw, repeat: int) -> Take:
    """The test frames, with noise and gaps and without poses."""
    take, rows = problem.test, chosen.test
    source = _noisy(problem, take, repeat)[rows]
    shape = take.source.values.shape[:2]
    hidden = _rng(problem, repeat, _GAPS).random(shape)[rows] < problem.protocol.missing
    source[np.repeat(hidden, source.shape[1] // shape[1], axis=1)] = np.nan
    return _frames_of(take, rows, source, params=None, animation=None)


def true_poses(problem: Problem, chosen: Draw) -> FloatArray:
    """The known poses of the test frames, (n, P)."""
    return _poses(problem.test)[chosen.test]


def pools(problem: Problem, repeat: int) -> tuple[IntArray, IntArray]:
    """The frames to draw training data from in a repeat, and those to test on."""
    trained = np.flatnonzero(_observed(problem.take))
    if problem.across:
        tested = np.flatnonzero(_observed(problem.test))
    elif problem.protocol.split == "block":
        own = (problem.blocks(trained) + repeat) % 2 == 0
        trained, tested = trained[own], trained[~own]
    else:
        tested = trained
    return trained, np.intersect1d(tested, problem.test.labels)


def _deal(unposed: IntArray, posed: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Unlabelled frames and unlabelled poses in turn from the posed frames, unposed ones first."""
    first, rest = np.split(posed, [min(len(unposed), len(posed))])
    frames, poses = np.concatenate([unposed, rest[0::2]]), np.concatenate([first, rest[1::2]])
    return frames[:count], poses[:count]


def _observed(take: Take) -> BoolArray:
    """The frames that show enough of the source to be of use, (T,)."""
    return np.asarray(take.source.valid.mean(axis=1) >= MIN_OBSERVED)


def _capped(problem: Problem, candidates: IntArray, repeat: int) -> IntArray:
    """Test frames out of the candidates, as many as the protocol allows, in stretches."""
    most = problem.protocol.test_frames
    if most is None or most >= len(candidates):
        return candidates
    starts = _rng(problem, repeat, _TEST).permutation(np.arange(0, len(candidates), STRETCH))
    stretches = [candidates[start : start + STRETCH] for start in starts[: most // STRETCH + 2]]
    return np.sort(np.concatenate(stretches)[:most])


def _frames_of(take: Take, rows: IntArray, source: FloatArray, **poses: Any) -> Take:
    """Some frames of a take, with this source (n, D) and these poses."""
    source_of = take.source.with_matrix(source)
    return replace(
        take, time=take.time[rows], source=source_of, std=None, corrections=None, **poses
    )


def _noisy(problem: Problem, take: Take, repeat: int) -> FloatArray:
    """The source of one of the takes with the noise of a repeat, (T, D)."""
    known = problem.take.source.matrix
    known = known[:, ~np.isnan(known).all(axis=0)]
    std = problem.protocol.noise * Normalisation.of(known, "/source").scale
    rng = _rng(problem, repeat, _NOISE, int(take is not problem.take))
    clean = take.source.matrix
    return clean + std * rng.standard_normal(clean.shape)


def _rng(problem: Problem, repeat: int, *purpose: int) -> np.random.Generator:
    return np.random.default_rng([problem.protocol.seed, repeat, *purpose])


def _with_controls(take: Take, controls: Controls) -> Take:
    """A take with its poses in the order of the controls."""
    assert take.controls is not None  # poses come with controls
    columns = match(controls.names, take.controls.names, "/target/names")
    return replace(
        take, controls=controls, params=_poses(take)[:, columns], std=None, animation=None
    )


def _poses(take: Take) -> FloatArray:
    assert take.params is not None  # make_problem
    return take.params


def _check_posed(take: Take) -> None:
    if not len(take.labels):
        raise InputError(
            "/target/params", "known poses", "none", "Evaluate on a take with the true poses."
        )


def _check_true(take: Take) -> None:
    predicted = predicted_poses(take)
    if predicted:
        found = f"{plural(predicted, 'pose')} that a model predicted"
        raise InputError("/target/std", "true poses", found, "Give the take that was posed.")


def _check_different(takes: Takes) -> None:
    """Refuse a recording that is given twice: what is tested on would be learned from."""
    for one, other in same_recordings(takes):
        found = f"{takes.names[one]} and {takes.names[other]} with the very same frames"
        raise InputError("takes", "different recordings", found, "Give each of them once.")


def _too_short(labels: int, unlabelled: int, problem: Problem, posed: int) -> InputError:
    tested_too = not problem.across and problem.protocol.split == "random"
    if tested_too and labels >= posed > 1:
        expected = f"at most {posed - 1} labels: one pose is needed for the test"
        fix = "Ask for fewer labels, or pose more frames."
        return InputError("/target/params", expected, f"{labels}", fix)
    parts = [f"{labels} labels", f"{unlabelled} unlabelled frames"]
    parts += [f"{unlabelled} unlabelled poses"] if problem.poses_are_frames else []
    return InputError(
        "/target/params",
        f"posed frames for {', '.join(parts)} and a test",
        f"{posed} to draw from",
        "Ask for fewer labels or fewer unlabelled frames (--unlabelled 0), or for none of both: "
        "by default there are as many as the take allows.",
    )


def _check(good: bool, option: str, expected: str, found: object) -> None:
    if not good:
        raise InputError(option, expected, repr(found), "Choose another value.", "the options")

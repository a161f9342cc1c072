"""Default numbers of labels and of unlabelled data that a take is evaluated with."""

from __future__ import annotations

import logging

import numpy as np

from facert.data.text import plural
from facert.errors import InputError
from facert.evaluation.protocol import Problem, pools
from facert.evaluation.run import Grid
from facert.preprocess.training_set import MIN_LABELS

log = logging.getLogger("facert")

MANY = 250
"""With so many posed frames the numbers need no note: they are those of the help."""
LABELS = (10, 20, 30, 40)
UNLABELLED = 100
MOST_CELLS = 2**18
"""Trainings that an evaluation may be: days of them, and each is kept in memory."""
LEAST_TESTED = 10
"""Frames that are tested at least where all of `LABELS` are tried."""


def chosen_grid(
    problem: Problem,
    methods: tuple[str, ...],
    labels: tuple[int, ...] | None,
    unlabelled: tuple[int, ...] | None,
    repeats: int,
) -> Grid:
    """The grid of the given numbers; None stands for those that suit the take.

    Raises
    ------
    InputError
        When too few frames are posed, or more than `MOST_CELLS` are asked for.
    """
    frames = unlabelled or (default_unlabelled(problem),)
    counts = labels or default_labels(problem, max(frames))
    posed = len(problem.take.labels)
    if max(counts) < posed < MANY and None in (labels, unlabelled):
        others = f"{plural(max(frames), 'frame')} without a pose"
        numbers = " or ".join(map(str, counts))
        text = "learns from %s of %d posed frames and %s, tests on the rest"
        log.info(text, numbers, posed, others)
    grid = Grid(methods, counts, frames, repeats)
    if len(grid) > MOST_CELLS:
        expected, fix = f"at most {MOST_CELLS} trainings in all", "Ask for fewer."
        raise InputError("--labels, --repeats", expected, f"{len(grid)}", fix)
    return grid


def default_unlabelled(problem: Problem) -> int:
    """Unlabelled frames, and as many poses where these are drawn from the posed frames too.

    No more than half of the posed frames go there.
    """
    posed, unposed = _frames(problem)
    if problem.poses_are_frames:
        return min(UNLABELLED, posed // 4)
    return min(UNLABELLED, unposed + posed // 2 if problem.take.animation is not None else unposed)


def default_labels(problem: Problem, unlabelled: int) -> tuple[int, ...]:
    """Numbers of labels, 10 to 40; with few posed frames a quarter, half and three quarters.

    Parameters
    ----------
    problem : Problem
    unlabelled : int
        The most unlabelled frames that are asked for.

    Raises
    ------
    InputError
        When too few frames are posed to learn from some and to test on others.
    """
    posed, unposed = _frames(problem)
    left = posed - max(0, unlabelled - unposed)
    if problem.poses_are_frames:
        left -= unlabelled  # unlabelled poses come from posed frames alone
    tested = 0 if problem.across else 1
    if left < MIN_LABELS + tested:
        raise InputError(
            "/target/params",
            f"{MIN_LABELS + tested} posed frames at least, to learn from some and test on others",
            f"{posed}, of which {max(left, 0)} are left for that",
            "Pose 10 to 40 frames, those that facert suggest names, or give --unlabelled 0.",
        )
    if left >= LABELS[-1] + LEAST_TESTED:
        return LABELS
    return tuple(sorted({max(MIN_LABELS, left * quarters // 4) for quarters in (1, 2, 3)}))


def _frames(problem: Problem) -> tuple[int, int]:
    """Numbers of posed frames and of others that every repeat can draw from."""
    parts = [pools(problem, repeat)[0] for repeat in range(2)]  # the halves of a split by blocks
    posed = [int(np.isin(part, problem.take.labels).sum()) for part in parts]
    return min(posed), min(len(part) - count for part, count in zip(parts, posed, strict=True))

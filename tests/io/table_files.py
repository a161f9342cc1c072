"""What tests of tables write: columns by name, a short take of three weights, and its clocks."""

from __future__ import annotations

import numpy as np

FRAMES = 30
rng = np.random.default_rng(1)
WEIGHTS = rng.uniform(0.01, 0.99, size=(FRAMES, 3)).round(4)
NAMES = ["jawOpen", "smile", "browUp"]
SECONDS = np.arange(FRAMES) / 30
START = np.datetime64("2026-05-01T23:59:59.500")
DATES = [str(START + np.timedelta64(round(1e6 * t), "us")) for t in SECONDS]
OF_DAY = [f"{24 * (date[8:10] != '01') * 0 + int(date[11:13]):02d}{date[13:23]}" for date in DATES]


def write(path, columns, separator=","):
    """A table of columns by name."""
    cells = zip(*columns.values(), strict=True)
    lines = [separator.join(map(str, row)) for row in cells]
    path.write_text("\n".join([separator.join(columns), *lines]) + "\n")


def weights(names=NAMES):
    return dict(zip(names, WEIGHTS.T, strict=True))

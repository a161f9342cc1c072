"""What a benchmark measured: figures beside their references, as a table and as JSON."""

from __future__ import annotations

import json
import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import scipy
import torch

from experiments.report import markdown
from facert.io.atomic import replacing

Call = Callable[[], object]


@dataclass(frozen=True)
class Figure:
    """A cost, and how it compares.

    Parameters
    ----------
    what : str
    median, p99 : float
        In the unit.
    unit : str
    reference : str
        What else was measured in the same run, or the paper's figure.
    ratio : float
        Ours by the reference's, medians: below 1 is less.
    """

    what: str
    median: float
    p99: float
    unit: str
    reference: str
    ratio: float

    @classmethod
    def of(
        cls, what: str, ours: Sequence[float], unit: str, reference: str, theirs: Sequence[float]
    ) -> Figure:
        """From repeated measurements of both."""
        median, p99 = np.percentile(ours, [50, 99]).tolist()
        return cls(what, median, p99, unit, reference, median / float(np.median(theirs)))


def cpu_seconds(
    calls: Mapping[str, Call], runs: int, repeats: int = 1, warm: int = 0
) -> dict[str, list[float]]:
    """Of each call in turn, over and over: a busy spell hits all alike.

    In each of the runs, and in one before that does not count, a call is made so often to warm up
    and then measured so often.
    """
    spent: dict[str, list[float]] = {name: [] for name in calls}
    for run in range(runs + 1):
        for name, call in calls.items():
            for repeat in range(warm + repeats):
                began = time.process_time()
                call()
                if run and repeat >= warm:
                    spent[name].append(time.process_time() - began)
    return spent


def machine() -> dict[str, str | int | float]:
    """Where it was measured."""
    lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    models = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    return {
        "processor": models[0] if models else platform.processor(),
        "cores": os.cpu_count() or 0,
        "load": round(os.getloadavg()[0], 1),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "torch": torch.__version__,
    }


def table(figures: Sequence[Figure]) -> str:
    """For people."""
    header = ["what", "reference", "median", "p99", "unit", "ratio"]
    rows = [
        [f.what, f.reference, f"{f.median:.3g}", f"{f.p99:.3g}", f.unit, f"{f.ratio:.3g}"]
        for f in figures
    ]
    return markdown(header, rows, texts=2)


def write_json(path: Path, figures: Sequence[Figure]) -> None:
    """For programs."""
    content = {"machine": machine(), "figures": [asdict(figure) for figure in figures]}
    with replacing(path, overwrite=True) as temporary:
        temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")

"""Files that other libraries write are read with their values; facert's are read by them."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.foreign.command import library_trials
from experiments.foreign.trial import Trial, carried_out

TRIALS = library_trials()


def name_of(trial: Trial) -> str:
    return f"{trial.program}-{trial.file}-{trial.compared}".replace(" ", "_")


@pytest.mark.parametrize("trial", TRIALS, ids=name_of)
def test_values_are_those_that_the_library_wrote(trial: Trial, tmp_path: Path) -> None:
    outcome = carried_out(trial, tmp_path)
    assert outcome.good, f"{outcome.found} (at most {trial.tolerance:g}): {outcome.messages}"


def test_the_libraries_are_there() -> None:
    programs = {trial.program for trial in TRIALS}
    assert {"ezc3d", "trimesh", "pygltflib", "usd-core", "pandas", "numpy", "h5py"} <= programs

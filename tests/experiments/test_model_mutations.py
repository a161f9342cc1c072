"""Mutated model files are refused, or give finite poses: a sample of the experiment's."""

from __future__ import annotations

import logging
import warnings

import facert
from experiments.reliability.model_mutations import BAD, MODELS, attempt, mutant, short_take

FILES = 60


def test_mutated_model_files_are_refused_or_give_finite_poses(tmp_path):
    take, path = short_take(), tmp_path / "model.safetensors"
    models = sorted(MODELS.glob("*.safetensors"))
    seeds = [model.read_bytes() for model in models]
    poses = [facert.load(model).retarget(take).params for model in models]
    logging.getLogger("facert").setLevel(logging.CRITICAL)
    outcomes = {}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for index in range(FILES):
            model, name, content = mutant(seeds, index, seed=7)
            path.write_bytes(content)
            outcomes[index, name] = attempt(path, take, poses[model], "offline")
    assert not {file: outcome for file, outcome in outcomes.items() if outcome.startswith(BAD)}
    assert {"the same poses", "other poses", "refused: exit 3"} <= {*outcomes.values()}

"""Readers of what comes from elsewhere raise facert's errors alone; a short run of the fuzzer."""

from __future__ import annotations

import random

import pytest

from experiments.fuzz.execute import execute
from experiments.fuzz.mutation import mutated
from experiments.fuzz.targets import Target, targets

EXECUTIONS = 60
TARGETS = targets()


@pytest.fixture(name="target", params=TARGETS, ids=[one.name for one in TARGETS])
def _target(request: pytest.FixtureRequest) -> Target:
    return request.param


def test_its_seeds_are_valid(target: Target) -> None:
    assert target.seeds
    assert all(map(target.run, target.seeds))


def test_past_findings_are_mended(target: Target) -> None:
    problems = {path.name: execute(target, path.read_bytes()) for path in target.findings()}
    assert not {name: one.text for name, one in problems.items() if one is not None}


def test_mutated_inputs_are_read_or_refused(target: Target) -> None:
    chance = random.Random(target.name)
    for _ in range(EXECUTIONS):
        data = mutated(chance.choice(target.seeds), chance)
        problem = execute(target, data)
        assert problem is None, f"{problem.text}\ninput: {data!r}"

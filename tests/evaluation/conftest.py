"""A small problem on which methods are tried."""

from __future__ import annotations

import pytest

from facert.evaluation.protocol import Problem, Protocol, make_problem
from facert.settings import Settings


@pytest.fixture
def make(make_take):
    """A problem of 120 posed frames; options go to the protocol."""

    def make_it(take=None, **options) -> Problem:
        take = take or make_take(frames=120, posed=120, animation=0)
        return make_problem(take, Protocol(**options))

    return make_it


@pytest.fixture
def quick() -> Settings:
    """Training that is over soon: what is learned matters little here."""
    return Settings(latent_dim=2, neighbours=4, max_iterations=5)

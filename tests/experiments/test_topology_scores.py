"""Tables of the topology experiments compare with the best baseline, on the same tests."""

from __future__ import annotations

import numpy as np
import pytest

from experiments.topology.scores import Scores

SCORES = Scores(
    {
        "ours": np.array([1.0, 1.0, 4.0]),
        "variant": np.array([0.5, 0.5, 0.5]),
        "weak": np.array([9.0, 9.0, 9.0]),
        "strong": np.array([4.0, 4.0, 4.0]),
    },
    default="ours",
    own=("ours", "variant"),
)


def test_the_best_baseline_is_none_of_our_own() -> None:
    assert SCORES.best_baseline == "strong"


def test_the_table_has_the_best_first_and_ratios_of_means() -> None:
    lines = SCORES.table("error").splitlines()
    assert lines[0].split(" | ")[-1] == "to strong |"
    assert [line.split(" | ")[0] for line in lines[2:]] == [
        "| variant", "| **ours**", "| strong", "| weak",
    ]  # fmt: skip
    assert lines[3] == "| **ours** | 2.0000 | 1.0000 | 0.50 |"


def test_every_test_is_a_row() -> None:
    rows = SCORES.rows(keys=10)
    assert len(rows) == 3
    assert rows[2] == {
        "keys": 10,
        "test": 2,
        "ours": 4.0,
        "variant": 0.5,
        "weak": 9.0,
        "strong": 4.0,
    }


@pytest.mark.real
def test_feature_points_are_different_vertices_on_every_character(real_data) -> None:
    from experiments.topology.characters import ict, makehuman

    for character in (ict(np.zeros(8)), makehuman("unit")):
        assert len(np.unique(character.points)) == 80
        assert character.move(np.zeros((1, len(character.names))), character.points)[0] == (
            pytest.approx(character.mesh.vertices[character.points])
        )

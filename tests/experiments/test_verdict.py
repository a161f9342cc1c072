import numpy as np
import pytest

from experiments.default import groups_of, orders, records, verdicts
from experiments.grid import Case
from experiments.verdict import Cell, common_others, judge, lead

A = Case("utterance_a", "arkit")
B = Case("optical_cheeks", "solved")


def cell(case, labels, **errors):
    return Cell(case, labels, {name: np.array(values) for name, values in errors.items()})


CELLS = [
    cell(A, 10, auto=[0.1, 0.3], ridge=[0.2, 0.2], pls=[0.4, 0.4], svr=[0.1, 0.2]),
    cell(A, 20, auto=[0.1, 0.1], ridge=[0.2, 0.2], pls=[0.1, 0.1]),
    cell(B, 10, auto=[0.3, 0.3], ridge=[0.2, 0.2], pls=[0.6, 0.6]),
]


def test_the_best_single_method_is_the_one_that_the_default_has_least_over():
    found = judge(CELLS)
    assert found.single == "ridge"  # 1, 1/2 and 3/2 on average; pls 1/2, 1 and 1/2
    assert found.against_single == pytest.approx(1.0)


def test_a_method_that_could_not_always_run_is_the_best_of_a_cell_only():
    assert set(common_others(CELLS)) == {"ridge", "pls"}
    assert CELLS[0].others[0] == "svr"


def test_the_best_of_each_cell_is_met_one_by_one():
    found = judge(CELLS)
    assert found.mean == pytest.approx(np.mean([4 / 3, 1.0, 1.5]))
    assert (found.worst, found.worst_beyond) == (pytest.approx(1.5), pytest.approx(1.5))
    assert found.where == "optical_cheeks, solved, 10 labels"
    assert found.beaten == 1  # in the first cell the draws disagree: 0 and 0.1 behind


def test_the_lead_over_a_method_is_a_mean_of_logarithms():
    found = lead(CELLS[1:], "ridge")
    assert found.value == pytest.approx(np.log(0.5 * 1.5) / 2)
    assert found.se == pytest.approx(0.0)


def test_cells_are_grouped_by_what_differs():
    assert list(groups_of(CELLS)) == ["all", "arkit", "solved", "10 labels", "20 labels"]
    assert list(groups_of(CELLS[:1])) == ["all"]


def test_tables_name_every_group_and_problem():
    lines = verdicts(groups_of(CELLS)).splitlines()
    assert lines[2].startswith("| all | 3 | 1.000 (ridge) | 1.278 | 1.500 | 1.500 (optical_cheeks")
    order = orders({"here": CELLS[1:]}).splitlines()[2:]
    assert order[0].startswith("| here | auto < ridge < pls | 0.866 ± 0.000 (ridge)")
    assert order[1].startswith("| all |")


def test_every_method_of_every_cell_has_a_record():
    lines = records(CELLS)
    assert len(lines) == 10
    assert lines[1]["default_over_method"] == pytest.approx(1.0)
    assert lines[1]["default_minus_method_se"] == pytest.approx(0.1)

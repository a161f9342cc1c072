import numpy as np
import pytest

from facert.evaluation.advice import advise
from facert.evaluation.cells import Cell, Outcome
from facert.evaluation.figures import panels, plot_errors
from facert.evaluation.metrics import Scores
from facert.evaluation.protocol import Protocol
from facert.evaluation.table import best, columns_of, summarise


def outcome(method, labels, repeat, rms, unlabelled=100):
    scores = Scores(rms, (rms, rms), 2 * rms, jitter=rms / 10)
    return Outcome(Cell(method, labels, unlabelled, repeat), scores, 0.5, 0.1)


def table(errors, unlabelled=100):
    """Outcomes of ``{method: {labels: [rms of each repeat]}}``."""
    return [
        outcome(method, labels, repeat, rms, unlabelled)
        for method, by_labels in errors.items()
        for labels, values in by_labels.items()
        for repeat, rms in enumerate(values)
    ]


def failed(method, labels, repeat=0):
    return Outcome(Cell(method, labels, 100, repeat), failure="too few labels")


def test_columns_hold_what_rows_have_to_show():
    ran = summarise(table({"a": {10: [0.2, 0.4]}}), Protocol())
    shown = {column.title: column.text(ran[0]) for column in columns_of(ran)}
    assert not {"vertex", "95 %", "draws"} & shown.keys()
    assert (shown["RMS"], shown["of range"]) == ("0.3000", "60.0%")
    partly = summarise([*table({"a": {10: [0.2]}}), failed("a", 10, 1)], Protocol())
    assert {column.title: column.text(partly[0]) for column in columns_of(partly)}["draws"] == "1"
    never = summarise([failed("a", 10)], Protocol())
    assert [column.text(never[0]) for column in columns_of(never)] == ["a", "cannot run"]


def test_rows_hold_means_standard_errors_and_ratios():
    rows = summarise(
        table({"b": {10: [0.2, 0.4]}, "a": {10: [0.1, 0.1]}}), Protocol(noise=0.1, missing=0.2)
    )
    assert [row.method for row in rows] == ["a", "b"]
    row = rows[1]
    assert (row.rms, row.ratio_to_best) == (pytest.approx(0.3), pytest.approx(3.0))
    assert row.rms_se == pytest.approx(np.std([0.2, 0.4], ddof=1) / 2**0.5)
    assert row.per_control == pytest.approx((0.3, 0.3))
    assert (row.rms_normalised, row.jitter) == (pytest.approx(0.6), pytest.approx(0.03))
    assert (row.noise, row.missing, row.repeats, row.fit_seconds) == (0.1, 0.2, 2, 0.5)
    assert row.vertex_rms is None


def test_one_repeat_has_no_standard_error():
    assert summarise([outcome("a", 10, 0, 0.1)], Protocol())[0].rms_se is None


def test_a_method_that_failed_is_last_and_never_best():
    outcomes = [outcome("a", 10, 0, 0.1), failed("a", 10, 1), failed("c", 10, 0)]
    rows = summarise(outcomes + table({"b": {10: [0.2, 0.2]}}), Protocol())
    assert [row.method for row in rows] == ["b", "a", "c"]
    assert best(rows).method == "b"
    assert [row.ratio_to_best for row in rows] == [1.0, pytest.approx(0.5), None]
    assert (rows[1].repeats, rows[2].repeats, rows[2].failure) == (1, 0, "too few labels")


def test_advice_names_the_best_method_and_what_more_labels_bring():
    line = advise(
        table({"a": {10: [0.20, 0.22], 20: [0.10, 0.11]}, "b": {10: [0.3, 0.3], 20: [0.2, 0.2]}})
    )
    assert line.startswith("Use a for this take. RMS 0.21 with 10 labels, 0.105 with 20")
    assert "40 labels would take off another 50%." in line


def test_advice_from_few_draws_warns_of_it():
    few, many = (advise(table({"a": {10: [0.2] * draws}})) for draws in (4, 5))
    assert few.endswith("Draws are few: see --repeats.")
    assert "few" not in many


def test_advice_names_what_does_as_well():
    line = advise(table({"a": {10: [0.1, 0.2]}, "b": {10: [0.21, 0.1]}, "c": {10: [0.3, 0.3]}}))
    assert "Use a for this take (b within one standard error of it)" in line
    assert "evaluate a range" in line


def test_advice_shows_when_labels_are_enough():
    assert "bring little" in advise(table({"a": {10: [0.1], 20: [0.099]}}))


def test_advice_passes_over_methods_that_failed_and_labels_too_few_for_all():
    outcomes = table({"a": {10: [0.2], 20: [0.1]}, "b": {20: [0.01]}})
    failures = [failed("b", 10), failed("a", 2), failed("b", 2)]
    assert advise(outcomes + failures).startswith("Use a for this take. RMS 0.2 with 10 labels")
    assert advise([failed("a", 2)]).startswith("No method could run")


def test_advice_is_for_the_most_unlabelled_data():
    outcomes = table({"a": {10: [0.1]}, "b": {10: [0.2]}}, unlabelled=0)
    outcomes += table({"a": {10: [0.1]}, "b": {10: [0.05]}}, unlabelled=50)
    assert advise(outcomes).startswith("Use b")


def test_advice_and_table_go_by_the_same_number_at_the_most_labels():
    outcomes = table({"a": {10: [0.1] * 5, 20: [0.2] * 5}, "b": {10: [0.5] * 5, 20: [0.1] * 5}})
    named = best([row for row in summarise(outcomes, Protocol()) if row.labels == 20]).method
    assert advise(outcomes).startswith(f"Use {named} for this take.")


def test_one_draw_beats_nothing():
    """A single one has no standard error: the default is named, and what ties it is not known."""
    text = advise(table({"auto": {10: [0.21]}, "b": {10: [0.20]}}))
    assert text.startswith("Use auto for this take. ")


def test_the_default_is_named_unless_it_is_clearly_beaten():
    near = {"auto": {10: [0.11, 0.20]}, "a": {10: [0.10, 0.201]}}
    assert advise(table(near)).startswith("Use auto for this take (a within one standard error")
    far = {"auto": {10: [0.13, 0.23]}, "a": {10: [0.10, 0.201]}}
    assert advise(table(far)).startswith("Use a for this take. ")


def test_advice_tells_what_it_was_tested_on():
    outcomes = table({"a": {10: [0.2] * 5}})
    assert advise(outcomes, 30).endswith("Tested on 30 posed frames a draw.")
    assert "extremes" in advise(outcomes, 30, chosen=True)


def test_a_panel_is_drawn_for_each_number_that_varies():
    labels = table({"a": {10: [0.2], 20: [0.1]}})
    both = labels + table({"a": {10: [0.3], 20: [0.2]}}, unlabelled=0)
    for outcomes, axes in (
        (labels, ["labels"]),
        (both, ["labels", "unlabelled"]),
        (labels[:1], ["labels"]),
        ([*labels, failed("a", 2)], ["labels"]),
    ):
        rows = summarise(outcomes, Protocol())
        assert [part.axis for part in panels(rows)] == axes
        assert all(row.rms is not None for part in panels(rows) for row in part.rows)
        assert len(plot_errors(rows, "title").axes) == len(axes)


def test_curves_show_the_means():
    rows = summarise(table({"a": {10: [0.2, 0.3], 20: [0.1, 0.1]}}), Protocol())
    axes = plot_errors(rows).axes[0]
    line = axes.containers[0].lines[0]
    assert line.get_ydata() == pytest.approx([0.25, 0.1])
    assert line.get_xdata() == pytest.approx([10, 20], abs=0.2)

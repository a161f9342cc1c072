import numpy as np

from experiments.unlabelled import COUNTS, LONGEST, PROBLEMS, Cell, drawn, table, tasks


def test_a_draw_tests_on_frames_that_were_not_learned_from(make_take, monkeypatch):
    monkeypatch.setattr("experiments.unlabelled.TESTED", 20)
    truth = make_take(frames=90, posed=90, animation=0)
    take, test = drawn(truth, labels=10, unlabelled=25, seed=3)
    assert (len(take), len(take.labels), len(take.animation), len(test)) == (35, 10, 25, 20)
    assert not np.isin(truth.time[test], take.time).any()
    seen = (truth.params[test][:, None] == take.animation).all(axis=2)
    assert not seen.any()


def test_fewer_unlabelled_frames_are_some_of_more(make_take, monkeypatch):
    monkeypatch.setattr("experiments.unlabelled.TESTED", 20)
    truth = make_take(frames=90, posed=90, animation=0)
    few, more = (drawn(truth, 10, count, seed=0)[0] for count in (5, 25))
    assert np.isin(few.time, more.time).all()
    np.testing.assert_array_equal(truth.time[np.isin(truth.time, few.time[few.labels])],
                                  more.time[more.labels])  # fmt: skip


def test_every_task_asks_for_no_more_than_its_track_has():
    for (track, _, _), _, _, count in tasks(repeats=1, most=COUNTS[-1]):
        assert count <= LONGEST[track]


def test_the_table_has_a_line_a_learner_and_a_column_a_count():
    track, target, labels = PROBLEMS[0]
    cells = [
        Cell(track, target, labels, draw, "auto", count, 0.1 + 0.02 * draw, 2.0)
        for draw in (0, 1)
        for count in (50, 100)
    ]
    lines = table(cells).splitlines()
    assert lines[0] == "| unlabelled | 50 | 100 |"
    assert lines[-1] == "| auto | 0.1100 ± 0.0100 (2.0 s) | 0.1100 ± 0.0100 (2.0 s) |"

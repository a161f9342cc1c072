import pytest

from facert.errors import InputError
from facert.io.journal import Journal, source_digest


def test_entries_are_there_the_next_time(tmp_path):
    path = tmp_path / "new" / "journal.jsonl"
    journal = Journal(path, "work")
    assert journal.begin() == []
    journal.add({"a": 1})
    journal.add({"b": [None, "é"]})
    assert Journal(path, "work").begin() == [{"a": 1}, {"b": [None, "é"]}]
    journal.remove()
    assert not path.exists()


def test_a_line_cut_off_is_passed_over_and_mended(tmp_path):
    journal = Journal(tmp_path / "journal.jsonl", "work")
    journal.begin()
    journal.add({"a": 1})
    journal.path.write_text(journal.path.read_text() + '{"b": ')
    assert journal.begin() == [{"a": 1}]
    journal.add({"c": 3})
    assert journal.begin() == [{"a": 1}, {"c": 3}]


@pytest.mark.parametrize("text", ["", "no JSON\n", "[1]\n", '{"fingerprint": "other"}\n{"a": 1}\n'])
def test_a_journal_of_other_work_is_begun_anew(tmp_path, text):
    path = tmp_path / "journal.jsonl"
    path.write_text(text)
    assert Journal(path, "work").begin() == []
    assert path.read_text() == '{"fingerprint": "work"}\n'


def test_a_place_that_cannot_be_written_to_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    path = tmp_path / "file" / "journal.jsonl"
    with pytest.raises(InputError, match=r"journal\.jsonl: output: expected a name in a folder"):
        Journal(path, "work").begin()


def test_changed_code_is_other_work(tmp_path):
    (tmp_path / "a.py").write_text("1")
    before = source_digest(tmp_path)
    assert source_digest(tmp_path) == before
    (tmp_path / "a.py").write_text("2")
    assert source_digest(tmp_path) != before

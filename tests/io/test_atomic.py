from pathlib import Path

import pytest

from facert.errors import InputError, OutputExistsError
from facert.io.atomic import replacing


def test_the_file_appears_under_its_name_and_nothing_else_stays(tmp_path):
    path = tmp_path / "new" / "folder" / "take.h5"
    with replacing(path) as temporary:
        temporary.write_text("whole")
        assert not path.exists()
        assert temporary.parent == path.parent
        assert temporary.suffix == path.suffix
    assert path.read_text() == "whole"
    assert list(path.parent.iterdir()) == [path]


def test_an_existing_file_is_kept_unless_overwriting_is_asked_for(tmp_path):
    path = tmp_path / "page.bmp"
    path.write_text("old")
    with pytest.raises(OutputExistsError, match="--overwrite"), replacing(path) as temporary:
        temporary.write_text("new")
    assert path.read_text() == "old"
    with replacing(path, overwrite=True) as temporary:
        temporary.write_text("new")
    assert path.read_text() == "new"


@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt])
def test_a_failing_writer_leaves_no_trace(tmp_path, failure):
    path = tmp_path / "page.bmp"
    path.write_text("old")

    def write_half():
        with replacing(path, overwrite=True) as temporary:
            temporary.write_text("half")
            raise failure

    with pytest.raises(failure):
        write_half()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_place_that_cannot_hold_files_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    path = tmp_path / "file" / "take.h5"
    with pytest.raises(InputError, match=r"take\.h5: output"), replacing(Path(path)) as temporary:
        temporary.write_text("")

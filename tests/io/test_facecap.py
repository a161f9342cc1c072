"""Face Cap recordings become takes of weights."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facert.errors import InputError
from facert.io.facecap import read_facecap

HEAD = "info,version,1\nbs,browInnerUp,eyeBlink_L,mouthSmile_R\n"
POSE = ",".join("0.5" for _ in range(10))
TEXT = f"{HEAD}k,500,{POSE},0.1,0.2,0.3\nk,533,{POSE},0.4,0.5,0.6\nk,566,{POSE},0.7,0.8,1.05\n"


@pytest.fixture(name="path")
def _path(tmp_path: Path) -> Path:
    path = tmp_path / "face.txt"
    path.write_text(TEXT, encoding="utf-8-sig")
    return path


def test_weights_bear_arkits_names_and_time_begins_at_zero(path: Path) -> None:
    take = read_facecap(path)
    assert take.source.names == ("browInnerUp", "eyeBlinkLeft", "mouthSmileRight")
    np.testing.assert_array_equal(
        take.source.values, [[0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [0.7, 0.8, 1.05]]
    )
    np.testing.assert_allclose(take.time, [0, 0.033, 0.066])
    assert take.fps == 30.0


def test_a_comma_at_the_end_of_lines_is_no_column(path: Path) -> None:
    path.write_text("".join(f"{line},\n" for line in TEXT.splitlines()))
    assert read_facecap(path).source.values.shape == (3, 3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "file: expected a Face Cap recording"),
        ("time,jawOpen\n0,1\n", "found no line that begins with 'bs,'.* Give a Face Cap TXT"),
        (HEAD, "expected lines of frames"),
        (f"{HEAD}k,0,{POSE},1,2\n", "line 3: expected 15 cells"),
        (f"{HEAD}k,0,{POSE},1,2,x\n", "line 3, column mouthSmile_R"),
        (f"{HEAD}k,1e999,{POSE},1,2,3\n", "line 3, column milliseconds: .* found '1e999'"),
        (f"{HEAD}k,,{POSE},1,2,3\n", "line 3, column milliseconds: .* found ''"),
        (f"{HEAD}k,5,{POSE},1,2,3\nk,5,{POSE},1,2,3\n", "/time"),
        (f"{HEAD}{HEAD}k,5,{POSE},1,2,3\n", "lines bs: expected one line"),
        (HEAD.replace("eyeBlink_L", "browInnerUp") + f"k,0,{POSE},1,2,3\n", "twice"),
    ],
)
def test_what_is_wrong_is_named(path: Path, text: str, message: str) -> None:
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_facecap(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_a_clock_that_is_set_back_goes_on(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    rows = [(40 * i - (2000 if i >= 30 else 0), i) for i in range(60)]
    path.write_text(HEAD + "".join(f"k,{3000 + t},{POSE},{i},2,3\n" for t, i in rows))
    take = read_facecap(path)
    np.testing.assert_allclose(take.time, np.arange(60) / 25)
    assert "back by 2 s at row 31" in caplog.text

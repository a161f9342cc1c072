from pathlib import Path

import pytest

from facert.errors import InputError
from facert.live.endpoints import Address, File, open_sender, parse_input, parse_output
from facert.live.frames import Counters


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("livelink", Address("livelink", "127.0.0.1", 11111)),
        ("livelink:12345", Address("livelink", "127.0.0.1", 12345)),
        ("vmc", Address("vmc", "127.0.0.1", 39540)),
        ("ifacialmocap", Address("ifacialmocap", "127.0.0.1", 49983)),
        ("take:a/b.h5", File("take", Path("a/b.h5"))),
        ("take:C:b.h5", File("take", Path("C:b.h5"))),
    ],
)
def test_inputs(text, expected):
    assert parse_input(text) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("vmc", Address("vmc", "127.0.0.1", 39539)),
        ("vmc:39539", Address("vmc", "127.0.0.1", 39539)),
        ("osc:10.0.0.7:9001", Address("osc", "10.0.0.7", 9001)),
        ("livelink:unreal.local", Address("livelink", "unreal.local", 11111)),
        ("vmc:[::1]:39539", Address("vmc", "::1", 39539)),
        ("vmc:[::1]", Address("vmc", "::1", 39539)),
        ("csv:take.livelink.csv", File("csv", Path("take.livelink.csv"))),
        ("h5:take.h5", File("h5", Path("take.h5"))),
    ],
)
def test_outputs(text, expected):
    assert parse_output(text) == expected


@pytest.mark.parametrize(
    ("parse", "text"),
    [
        (parse_input, "phone:1"),
        (parse_input, ""),
        (parse_input, "take:"),
        (parse_input, "livelink:70000"),
        (parse_input, "livelink:10.0.0.7:11111"),
        (parse_output, "take:a.h5"),
        (parse_output, "csv:a.h5"),
        (parse_output, "h5"),
        (parse_output, "ifacialmocap:49983"),
    ],
)
def test_what_is_not_understood_is_named(parse, text):
    with pytest.raises(ValueError, match=repr(text)):
        parse(text)


def test_the_example_in_the_message_is_one_that_is_understood():
    for parse in (parse_input, parse_output):
        with pytest.raises(ValueError, match="as in") as caught:
            parse("vmx")
        example = str(caught.value).rpartition(" ")[2]
        assert parse(example).place.endswith(example.partition(":")[2])


@pytest.mark.parametrize("text", ["vmc:127.0.0.1:39539", "vmc:[::1]:39539"])
def test_an_address_is_written_as_it_is_given(text):
    address = parse_output(text)
    assert f"{address.kind}:{address.place}" == text


def test_an_unknown_host_is_an_error_before_the_show():
    with pytest.raises(InputError, match="a host that is known"):
        open_sender(Address("vmc", "nowhere.invalid", 1), ("jaw",), Counters())

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pythonosc.osc_bundle import OscBundle
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message import OscMessage
from pythonosc.osc_message_builder import OscMessageBuilder

from facert.live.frames import BadPacketError
from facert.live.osc import MOST_BYTES, Bundles, Message, message, parse

EMPTY_BUNDLE = b"#bundle\0" + struct.pack(">Q", 1)

texts = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=30)
floats = st.floats(width=32, allow_nan=False, allow_infinity=False)


def foreign_message(address, *arguments):
    builder = OscMessageBuilder(address)
    for argument in arguments:
        builder.add_arg(argument)
    return builder.build()


def element(raw):
    return struct.pack(">i", len(raw)) + raw


@settings(deadline=None, max_examples=50)
@given(texts, floats, st.integers(-(2**31), 2**31 - 1))
def test_another_library_reads_what_is_written(text, number, whole):
    found = OscMessage(message("/a/address", text, number, whole))
    assert found.address == "/a/address"
    assert found.params == [text, number, whole]


@settings(deadline=None, max_examples=50)
@given(texts, floats, st.integers(-(2**31), 2**31 - 1))
def test_what_another_library_writes_is_read(text, number, whole):
    raw = foreign_message("/a/address", text, number, True, whole).dgram
    assert parse(raw) == [Message("/a/address", (text,), (number, 1.0, whole))]


def test_bundles_in_bundles_of_another_library_are_read_in_order():
    inner, outer = OscBundleBuilder(IMMEDIATELY), OscBundleBuilder(IMMEDIATELY)
    inner.add_content(foreign_message("/two", 2.0))
    for content in (foreign_message("/one", 1.0), inner.build(), foreign_message("/three", b"b")):
        outer.add_content(content)
    assert [one.address for one in parse(outer.build().dgram)] == ["/one", "/two", "/three"]


@settings(deadline=None, max_examples=50)
@given(st.lists(st.integers(1, 60), min_size=1, max_size=120), st.data())
def test_bundles_hold_all_messages_in_order_in_packets_that_are_not_cut(lengths, data):
    names = [f"/{'x' * length}" for length in lengths]
    numbers = data.draw(st.lists(floats, min_size=len(names), max_size=len(names)))
    last = message("/last")
    packets = Bundles([message(name, 0.0) for name in names], last=last).filled(numbers)

    found = [one for raw in packets for one in OscBundle(raw)]
    assert [one.address for one in found] == [*names, "/last"]
    assert [one.params[0] for one in found[:-1]] == numbers
    assert all(len(raw) <= MOST_BYTES for raw in packets)


def test_numbers_change_and_nothing_else():
    bundles = Bundles([message("/a", 0.0), message("/b", 0.0)])
    (first,), (second,) = bundles.filled([1.0, 2.0]), bundles.filled([3.0, 4.0])
    assert [one.numbers for one in parse(first)] == [(1.0,), (2.0,)]
    assert [one.numbers for one in parse(second)] == [(3.0,), (4.0,)]


@settings(deadline=None, max_examples=50)
@given(st.binary(max_size=200))
def test_random_bytes_are_refused(raw):
    with pytest.raises(BadPacketError):
        parse(raw)


@settings(deadline=None, max_examples=50)
@given(st.binary(max_size=100), st.sampled_from([b"/a\0\0", EMPTY_BUNDLE, b"/a\0\0,ifsbTd\0"]))
def test_random_bytes_after_a_good_beginning_are_refused_or_read(raw, beginning):
    try:
        found = parse(beginning + raw)
    except BadPacketError:
        return
    assert all(isinstance(one, Message) for one in found)


@pytest.mark.parametrize("size", [-4, -(2**31), 0, 2**31 - 1])
def test_an_element_of_an_impossible_size_is_refused_and_does_not_hang(size):
    with pytest.raises(BadPacketError):
        parse(EMPTY_BUNDLE + struct.pack(">i", size) + b"/a\0\0")


def test_bundles_without_end_are_refused():
    raw = message("/a")
    for _ in range(3000):
        raw = EMPTY_BUNDLE + element(raw)
    with pytest.raises(BadPacketError):
        parse(raw)


@pytest.mark.parametrize(
    "raw",
    [
        b"/\xff\xff\0",
        b"/a",
        b"/a\0\0,f\0\0\0\0",
        b"/a\0\0,b\0\0\xff\xff\xff\xff",
        b"/a\0\0,q\0\0",
        b"/a\0\0abc\0",
        b"",
    ],
)
def test_malformed_messages_are_refused(raw):
    with pytest.raises(BadPacketError):
        parse(raw)
    with pytest.raises(BadPacketError):
        parse(EMPTY_BUNDLE + element(message("/good", 1.0)) + element(raw))

import logging
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pylivelinkface import FaceBlendShape, PyLiveLinkFace

from facert.data.names import ARKIT_NAMES
from facert.errors import InputError
from facert.live.frames import BadPacketError
from facert.live.livelink_packets import PACKET_NAMES, LiveLinkDecoder, LiveLinkEncoder

DECODER = LiveLinkDecoder()
PARAMS = np.linspace(-0.2, 1.0, len(ARKIT_NAMES))


def packet(params=PARAMS, time=1.5, names=ARKIT_NAMES):
    (found,) = LiveLinkEncoder(names).encode(params, time)
    return found


def decoded(raw):
    return DECODER.decode(raw)


def test_another_library_reads_what_is_written_name_by_name():
    seen, face = PyLiveLinkFace.decode(packet())
    assert seen
    for name, value in zip(ARKIT_NAMES, PARAMS, strict=True):
        shape = FaceBlendShape[name[0].upper() + name[1:]]
        assert face.get_blendshape(shape) == pytest.approx(value, abs=1e-6)


def test_what_another_library_writes_is_read_name_by_name():
    foreign = PyLiveLinkFace(name="a phone")
    for shape, value in zip(FaceBlendShape, PARAMS, strict=True):
        foreign.set_blendshape(shape, float(value), no_filter=True)
    values = dict(zip(PACKET_NAMES, decoded(foreign.encode()).values, strict=True))
    for shape, value in zip(FaceBlendShape, PARAMS, strict=True):
        assert values[shape.name[0].lower() + shape.name[1:]] == pytest.approx(value, abs=1e-6)


def test_in_the_packet_left_stands_before_right_unlike_in_the_csv():
    assert set(PACKET_NAMES) == set(ARKIT_NAMES)
    assert PACKET_NAMES.index("jawLeft") < PACKET_NAMES.index("jawRight")
    assert PACKET_NAMES.index("mouthLeft") < PACKET_NAMES.index("mouthRight")
    assert ARKIT_NAMES.index("jawLeft") > ARKIT_NAMES.index("jawRight")


@settings(deadline=None, max_examples=50)
@given(st.floats(0, 3600))
def test_what_is_sent_later_has_a_later_stamp(time):
    encoder = LiveLinkEncoder(ARKIT_NAMES)
    earlier, later = (
        decoded(encoder.encode(PARAMS, moment)[0]).stamp for moment in (time, time + 1 / 240)
    )
    assert later - earlier == pytest.approx(1 / 240, abs=1e-5)


def test_controls_are_matched_in_any_spelling_and_others_are_told_about(caplog):
    raw = packet(np.array([0.5, 0.25, 0.1]), names=["EyeBlink_L", "jaw-open", "hornTwist"])
    values = dict(zip(PACKET_NAMES, decoded(raw).values, strict=True))
    assert (values.pop("eyeBlinkLeft"), values.pop("jawOpen")) == (0.5, 0.25)
    assert not any(values.values())
    assert "hornTwist" in caplog.text


def test_a_shape_that_is_one_in_arkit_gets_the_mean_of_its_halves(caplog):
    caplog.set_level(logging.INFO)
    names = ["browInnerUp_L", "cheek-puff-right", "eyeBlink_L", "brow_inner_up_R", "CheekPuffLeft"]
    raw = packet(np.array([0.5, 0.25, 0.125, 1.0, 0.0]), names=names)
    values = dict(zip(PACKET_NAMES, decoded(raw).values, strict=True))
    found = {name: value for name, value in values.items() if value}
    assert found == {"browInnerUp": 0.75, "cheekPuff": 0.125, "eyeBlinkLeft": 0.125}
    assert "the mean of the left and the right browInnerUp, cheekPuff" in caplog.text
    assert "no place" not in caplog.text


def test_half_a_shape_without_its_other_half_is_not_sent_nor_halves_beside_the_whole(caplog):
    names = ["cheekPuff_L", "browInnerUp", "browInnerUp_L", "browInnerUp_R"]
    values = decoded(packet(np.array([0.5, 0.25, 1.0, 1.0]), names=names)).values
    assert values.sum() == values[PACKET_NAMES.index("browInnerUp")] == 0.25
    assert "no place for cheekPuff_L, browInnerUp_L, browInnerUp_R" in caplog.text


def test_a_character_without_any_shape_of_arkit_cannot_be_sent():
    with pytest.raises(InputError, match="hornTwist"):
        LiveLinkEncoder(["hornTwist"])


def test_a_packet_without_numbers_saw_no_face():
    block = len(packet()) - 1 - 4 * len(PACKET_NAMES)
    for raw in (packet()[:block], packet()[:block] + b"\0"):
        assert np.isnan(decoded(raw).values).all()


def test_two_devices_are_told_apart():
    assert decoded(packet()).sender != decoded(packet()).sender


def test_a_denominator_of_zero_that_one_library_writes_counts_as_one():
    raw = bytearray(packet())
    block = len(raw) - 1 - 4 * len(PACKET_NAMES)
    stamp = decoded(bytes(raw)).stamp
    struct.pack_into("!i", raw, block - 4, 0)
    assert decoded(bytes(raw)).stamp == stamp


@settings(deadline=None, max_examples=50)
@given(st.binary(max_size=400))
def test_random_bytes_are_refused(raw):
    with pytest.raises(BadPacketError):
        decoded(raw)


@settings(deadline=None, max_examples=50)
@given(st.integers(0, len(packet()) - 1))
def test_a_cut_packet_is_refused_or_has_no_face(length):
    try:
        observed = decoded(packet()[:length])
    except BadPacketError:
        return
    assert np.isnan(observed.values).all()


@settings(deadline=None, max_examples=50)
@given(st.integers(0, len(packet()) - 1), st.integers(0, 255))
def test_a_damaged_packet_is_refused_or_holds_plausible_numbers(position, byte):
    raw = bytearray(packet())
    raw[position] = byte
    try:
        observed = decoded(bytes(raw))
    except BadPacketError:
        return
    assert np.isnan(observed.values).all() or (np.abs(observed.values) <= 100).all()
    assert np.isfinite(observed.stamp)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 1e30])
def test_numbers_that_are_no_weights_are_refused(wrong):
    params = PARAMS.copy()
    params[7] = wrong
    with pytest.raises(BadPacketError):
        decoded(packet(params))

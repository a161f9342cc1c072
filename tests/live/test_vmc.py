import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pythonosc.osc_bundle import OscBundle
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder

from facert.live.frames import BadPacketError
from facert.live.osc import message, parse
from facert.live.vmc import OscDecoder, OscEncoder, VmcEncoder

NAMES = ("jawOpen", "mouthSmileLeft", "Brow Up")
CONTROLS = tuple(f"control{index}" for index in range(90))  # more than fit into one packet
POSE = np.linspace(-1.0, 1.0, len(CONTROLS))


def weights(names=NAMES):
    return OscDecoder(names, "weights")


def feed(decoder, *messages):
    """What the last of these packets completes."""
    return [decoder.decode(raw) for raw in messages][-1]


@pytest.mark.parametrize("encoder", [VmcEncoder, OscEncoder])
@settings(deadline=None, max_examples=50)
@given(time=st.floats(0, 1e4))
def test_what_is_sent_is_what_is_received(encoder, time):
    packets = encoder(CONTROLS).encode(POSE, time)
    decoder = weights(CONTROLS)
    *parts, observed = [decoder.decode(raw) for raw in packets]
    assert len(packets) > 1
    assert not any(parts)
    np.testing.assert_allclose(observed.values, POSE, atol=1e-6)
    assert observed.stamp == pytest.approx(time, rel=1e-6)


def test_another_library_reads_a_pose_in_the_order_of_the_protocol():
    packets = VmcEncoder(NAMES).encode(np.array([0.1, 0.2, 0.3]), 2.5)
    found = [(one.address, *one.params) for raw in packets for one in OscBundle(raw)]
    assert found[0] == ("/VMC/Ext/T", 2.5)
    assert [(address, name) for address, name, _ in found[1:-1]] == [
        ("/VMC/Ext/Blend/Val", name) for name in NAMES
    ]
    assert [value for *_, value in found[1:-1]] == pytest.approx([0.1, 0.2, 0.3])
    assert found[-1] == ("/VMC/Ext/Blend/Apply",)


def test_names_that_no_address_can_hold_are_sent_and_found_again():
    packets = OscEncoder(["Brow Up", "a/b#c"]).encode(np.array([0.5, 0.25]), 0.0)
    addresses = [one.address for raw in packets for one in parse(raw)]
    assert addresses == ["/facert/Brow_Up", "/facert/a_b_c", "/facert/frame"]
    observed = feed(weights(), *packets)
    assert observed.values[2] == 0.5


def test_a_performer_that_sends_single_messages_or_bundles_is_understood():
    single, bundled = weights(), weights()
    bundle = OscBundleBuilder(IMMEDIATELY)
    sent = [
        ("/VMC/Ext/OK", 1),
        ("/VMC/Ext/T", 7.25),
        ("/VMC/Ext/Bone/Pos", "Head", *[0.0] * 7),
        ("/VMC/Ext/Blend/Val", "JAW_OPEN", 0.5),
        ("/VMC/Ext/Blend/Val", "mouthSmile_L", 0.25),
        ("/VMC/Ext/Blend/Val", "unknown", 1.0),
        ("/VMC/Ext/Blend/Apply",),
    ]
    for address, *arguments in sent:
        builder = OscMessageBuilder(address)
        for argument in arguments:
            builder.add_arg(argument)
        one = builder.build()
        bundle.add_content(one)
        observed = single.decode(one.dgram)
    for found in (observed, bundled.decode(bundle.build().dgram)):
        np.testing.assert_array_equal(found.values, [0.5, 0.25, np.nan])
        assert found.stamp == 7.25


def test_what_a_frame_does_not_bring_is_not_observed():
    decoder = weights()
    first = feed(decoder, message("/any/jawOpen", 0.5), message("/any/frame", 0.0))
    second = feed(decoder, message("/any/mouthSmileLeft", 0.25), message("/any/frame", 0.1))
    np.testing.assert_array_equal(first.values, [0.5, np.nan, np.nan])
    np.testing.assert_array_equal(second.values, [np.nan, 0.25, np.nan])


def test_markers_have_three_numbers():
    decoder = OscDecoder(("chin", "nose"), "markers")
    observed = feed(
        decoder,
        message("/m/nose", 1.0, 2.0, 3.0),
        message("/m/chin", 1.0),
        message("/m/frame"),
    )
    np.testing.assert_array_equal(observed.values, [[np.nan] * 3, [1.0, 2.0, 3.0]])


@pytest.mark.parametrize("wrong", [float("nan"), float("inf")])
def test_numbers_that_are_none_spoil_nothing_else_of_the_frame(wrong):
    decoder = weights()
    decoder.decode(message("/any/jawOpen", 0.5))
    with pytest.raises(BadPacketError):
        decoder.decode(message("/any/jawOpen", wrong))
    observed = decoder.decode(message("/any/frame"))
    np.testing.assert_array_equal(observed.values, [0.5, np.nan, np.nan])


@settings(deadline=None, max_examples=50)
@given(st.lists(st.binary(max_size=80), max_size=8))
def test_random_bytes_between_good_packets_change_nothing(noise):
    decoder = weights()
    for raw in (message("/any/jawOpen", 0.5), *noise):
        try:
            assert decoder.decode(raw) is None
        except BadPacketError:
            continue
    observed = decoder.decode(message("/any/frame"))
    np.testing.assert_array_equal(observed.values, [0.5, np.nan, np.nan])

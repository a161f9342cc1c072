import math
import struct
import unicodedata

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pythonosc.osc_bundle import OscBundle
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder

from facert.data.names import NameIndex
from facert.live.frames import BadPacketError, Observed
from facert.live.osc import MOST_ALIKE, MOST_LENGTHS, PacketTemplates, message, parse
from facert.live.stream_names import MOST, StreamNames
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


def test_what_a_frame_does_not_bring_is_as_it_was_and_what_never_came_not_observed():
    decoder = weights()
    first = feed(decoder, message("/any/jawOpen", 0.5), message("/any/frame", 0.0))
    second = feed(decoder, message("/any/mouthSmileLeft", 0.25), message("/any/frame", 0.1))
    np.testing.assert_array_equal(first.values, [0.5, np.nan, np.nan])
    np.testing.assert_array_equal(second.values, [0.5, 0.25, np.nan])
    third = feed(decoder, message("/any/frame", 0.2))
    np.testing.assert_array_equal(third.values, second.values)
    np.testing.assert_array_equal(first.values, [0.5, np.nan, np.nan])  # a frame is its own
    decoder.forget()
    assert np.isnan(feed(decoder, message("/any/frame", 0.3)).values).all()


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


NUMBER = st.floats(-2.0, 2.0, width=32)
ONE = st.one_of(
    st.tuples(st.just("/VMC/Ext/Blend/Val"), st.sampled_from([*NAMES, "unknown"]), NUMBER),
    st.tuples(st.sampled_from(["/VMC/Ext/T", "/facert/jawOpen", "/facert/Brow_Up"]), NUMBER),
    st.tuples(st.sampled_from(["/facert/jawOpen", "/VMC/Ext/Bone/Pos"]), NUMBER, NUMBER, NUMBER),
    st.tuples(st.sampled_from(["/VMC/Ext/OK", "/VMC/Ext/T"]), st.integers(0, 3)),
    st.tuples(st.just("/VMC/Ext/T")),
    st.tuples(st.just("/facert/frame"), NUMBER),
    st.tuples(st.just("/VMC/Ext/Blend/Apply")),
)
LONG = message("/padding/that/makes/a/datagram/long/enough/to/be/remembered", *["text"] * 40)


@settings(deadline=None, max_examples=100)
@given(
    shapes=st.lists(st.lists(ONE, max_size=5), min_size=1, max_size=3),
    order=st.lists(st.tuples(st.integers(0, 2), st.integers(-2, 2)), max_size=12),
    bad=st.sampled_from([1.0, math.inf, math.nan]),
    kind=st.sampled_from(["weights", "markers"]),
)
def test_datagrams_that_came_before_are_understood_as_at_first(shapes, order, bad, kind):
    """Whatever their numbers are now; the other decoder has never seen any of them."""
    decoder, forgetful = OscDecoder(NAMES, kind), OscDecoder(NAMES, kind)
    for which, shift in order:
        messages = [LONG]
        for address, *arguments in shapes[which % len(shapes)]:
            moved = [bad * (a + shift) if isinstance(a, float) else a for a in arguments]
            messages.append(message(address, *moved))
        packet = bundle(*messages)
        forgetful._templates = PacketTemplates()
        results = []
        for one in (decoder, forgetful):
            try:
                results.append(one.decode(packet))
            except BadPacketError:
                results.append("bad")
        assert type(results[0]) is type(results[1])
        if isinstance(results[0], Observed):
            np.testing.assert_array_equal(results[0].values, results[1].values)
            assert results[0].stamp == results[1].stamp
            assert results[0].identity == results[1].identity


def test_a_rehearsal_leaves_a_frame_in_parts_as_it_is():
    decoder, packets = weights(CONTROLS), VmcEncoder(CONTROLS).encode(POSE, 1.0)
    feed(decoder, *packets)
    first, *_, last = VmcEncoder(CONTROLS).encode(POSE + 1.0, 2.0)
    decoder.decode(first)
    decoder.rehearse(last)
    values = feed(decoder, message("/VMC/Ext/Blend/Apply")).values
    np.testing.assert_allclose(values[[0, -1]], POSE[[0, -1]] + [1.0, 0.0], atol=1e-6)


def bundle(*messages):
    elements = [struct.pack(">i", len(raw)) + raw for raw in messages]
    return b"#bundle\0" + struct.pack(">Q", 1) + b"".join(elements)


def test_a_performers_datagrams_are_remembered_and_a_flood_of_others_is_not():
    decoder, encoder = weights(CONTROLS), VmcEncoder(CONTROLS)
    for time in range(3):
        packets = encoder.encode(POSE + time, float(time))
        observed = feed(decoder, *packets)
        np.testing.assert_allclose(observed.values, POSE + time, atol=1e-6)
        assert observed.stamp == time
    known = decoder._templates._known
    assert sum(map(len, known.values())) == len(packets)
    for number in range(200):
        decoder.decode(bundle(LONG, message("/x" * (number + 1), float(number))))
        decoder.decode(bundle(LONG, message(f"/flood{number:03}", float(number))))
    assert len(known) == MOST_LENGTHS
    assert max(map(len, known.values())) == MOST_ALIKE


PREFIXES = ["Face1:blendShape1.", "blendShapes.", "BS_", "CTRL_expressions_", "Anna/"]
APPLY = message("/VMC/Ext/Blend/Apply")
MANY = ("jawOpen", "mouthSmileLeft", "browInnerUp", "eyeBlink_R")


def values(names, number=0.0):
    return [message("/VMC/Ext/Blend/Val", name, k / 4 + number) for k, name in enumerate(names)]


@pytest.mark.parametrize("prefix", PREFIXES)
@pytest.mark.parametrize("bundled", [True, False])
def test_a_prefix_of_a_stream_is_seen_through_from_the_first_frame_on(prefix, bundled, caplog):
    caplog.set_level("INFO")
    names = [f"{prefix}{name}" for name in (*MANY, "tongueOut")]
    for decoder in (weights(MANY), weights([f"Kopf_{name}" for name in MANY])):
        for number in (0.0, 1.0, 2.0):
            sent = [*values(names, number), APPLY]
            observed = feed(decoder, bundle(LONG, *sent)) if bundled else feed(decoder, *sent)
            np.testing.assert_array_equal(observed.values, np.arange(4) / 4 + number)
            assert observed.known
    lines = [record.getMessage() for record in caplog.records if "prefix" in record.getMessage()]
    assert len(lines) == 2
    assert all(f"the prefix '{prefix}'" in line for line in lines)


def test_names_of_a_prefix_may_come_one_by_one():
    decoder = weights(MANY)
    for count in range(1, 5):
        sent = values([f"ref_{name}" for name in MANY])[count - 1]
        observed = feed(decoder, sent, APPLY)
    np.testing.assert_array_equal(observed.values, np.arange(4) / 4)


def test_names_that_nobody_knows_are_named_once(caplog):
    decoder = weights(MANY)
    for _ in range(3):
        observed = feed(decoder, *values([f"{letter}{letter}" for letter in "abcdefgh"]), APPLY)
        assert not observed.known
        assert np.isnan(observed.values).all()
    expected = "names unknown: aa, bb, cc, dd, ee and 3 more; the model knows jawOpen, mouthSmile"
    assert caplog.text.count(expected) == 1
    assert feed(weights(MANY), APPLY).known  # it brings nothing: no face


@pytest.mark.parametrize("first", ["Anna:", "/Anna/"])
def test_two_subjects_in_a_stream_are_never_mixed(first, caplog):
    decoder = weights(MANY)
    if first == "Anna:":
        anna, ben = (values([f"{who}:{name}" for name in MANY], k) for k, who in enumerate("AB"))
    else:
        anna, ben = (
            [message(f"/{who}/{name}", k / 4 + number) for k, name in enumerate(MANY)]
            for number, who in enumerate("AB")
        )
    one = feed(decoder, *anna, APPLY)
    two = feed(decoder, *ben, APPLY)
    np.testing.assert_array_equal(one.values, np.arange(4) / 4)
    np.testing.assert_array_equal(two.values, one.values)
    assert caplog.text.count("WARNING") == 1
    both = feed(weights(MANY), *anna, *ben, APPLY)
    assert not both.known
    two = "'A:*' and 'B:*'" if first == "Anna:" else "'/A/*' and '/B/*'"
    assert f"those of two, {two}: send those of one" in caplog.text
    decoder.forget()
    np.testing.assert_array_equal(feed(decoder, *ben, APPLY).values, np.arange(4) / 4 + 1.0)


@pytest.mark.parametrize("form", ["NFC", "NFD"])
def test_forms_of_unicode_in_a_stream_are_one_name(form):
    names = ["sourcilLevéGauche", "Ärger", "眉上"]
    sent = values([unicodedata.normalize(form, name) for name in names])
    np.testing.assert_array_equal(feed(weights(names), *sent, APPLY).values, [0.0, 0.25, 0.5])


@settings(deadline=None, max_examples=50)
@given(st.data())
def test_a_sender_on_change_is_read_as_one_that_sends_all(data):
    """In any order, in any packets, for weights and for markers."""
    kind = data.draw(st.sampled_from(["weights", "markers"]))
    size = 3 if kind == "markers" else 1
    frames = data.draw(st.lists(st.lists(st.integers(0, 2), min_size=4, max_size=4), min_size=1))
    decoder, last = OscDecoder(MANY, kind), [None] * 4
    for frame in frames:
        changed = [k for k in range(4) if frame[k] != last[k]]
        sent = [
            message(f"/x/{MANY[k]}", *[float(frame[k])] * size)
            for k in data.draw(st.permutations(changed))
        ]
        cut = data.draw(st.integers(0, len(sent)))
        packets = [bundle(*part) for part in (sent[:cut], sent[cut:]) if part]
        observed = feed(decoder, *packets, message("/x/frame"))
        np.testing.assert_array_equal(observed.values.reshape(4, size)[:, 0], frame)
        last = frame


def test_a_marker_that_is_not_sent_is_held():
    decoder = OscDecoder(("chin", "nose"), "markers")
    feed(decoder, message("/m/nose", 1.0, 2.0, 3.0), message("/m/chin", 4.0, 5.0, 6.0))
    observed = feed(decoder, message("/m/chin", 7.0, 8.0, 9.0), message("/m/frame"))
    np.testing.assert_array_equal(observed.values, [[7.0, 8.0, 9.0], [1.0, 2.0, 3.0]])


def test_values_that_no_message_completes_are_reported(caplog):
    decoder = weights(MANY)
    for number in range(300):
        feed(decoder, *values(MANY, float(number)))
    assert caplog.text.count("nothing completes a frame") == 1


def test_a_flood_of_names_is_bounded():
    decoder = weights(MANY)
    for number in range(6000):
        decoder.decode(message(f"/x/y{number}", 1.0))
        if number % 100 == 0:
            feed(decoder, *values(MANY), APPLY)
    assert decoder._names.count == MOST
    np.testing.assert_array_equal(feed(decoder, *values(MANY), APPLY).values, np.arange(4) / 4)


def test_a_name_may_stand_inside_an_address():
    sent = [message(f"/face/{name}/weight", k / 4) for k, name in enumerate(MANY)]
    np.testing.assert_array_equal(feed(weights(MANY), *sent, APPLY).values, np.arange(4) / 4)


def test_a_few_names_that_come_twice_are_those_that_came_first(caplog):
    sent = [message(f"/face/{name}", k / 4) for k, name in enumerate(MANY)]
    observed = feed(weights(MANY), *sent, message("/debug/jawOpen", 9.0), APPLY)
    np.testing.assert_array_equal(observed.values, np.arange(4) / 4)
    assert "/face/jawOpen and /debug/jawOpen are one name: the first counts" in caplog.text


@pytest.mark.parametrize("wrong", [math.nan, math.inf])
def test_a_number_that_is_none_spoils_no_other_value_of_its_packet(wrong, caplog):
    decoder = weights(MANY)
    for turn, value in enumerate([0.5, wrong, wrong, 0.75]):
        sent = values(MANY[1:], float(turn))
        observed = decoder.decode(
            bundle(LONG, message("/x/jawOpen", value), *sent, message("/x/frame", wrong))
        )
        expected = 0.75 if turn == 3 else 0.5
        np.testing.assert_array_equal(observed.values, [expected, *(np.arange(3) / 4 + turn)])
        assert observed.stamp is None
    assert caplog.text.count("NaN or infinity") == 1
    markers = OscDecoder(("chin", "nose"), "markers")
    bad = [message("/m/chin", 1.0, wrong, 2.0), message("/m/nose", 1.0, 2.0, 3.0)]
    observed = markers.decode(bundle(*bad, message("/m/frame")))
    np.testing.assert_array_equal(observed.values, [[math.nan] * 3, [1.0, 2.0, 3.0]])


def test_names_of_a_stream_go_to_the_log_as_text(caplog):
    feed(weights(MANY), *values(["\x1b[31mjaw", "two\nlines"]), APPLY)
    assert "\\x1b[31mjaw, two\\nlines" in caplog.text
    caplog.clear()
    feed(weights(MANY), *values(["jawOpen", "JawOpen"]), APPLY)
    assert "jawOpen and JawOpen are one name" in caplog.text
    assert "/jawOpen" not in caplog.text


def test_in_a_flood_of_names_each_is_looked_up_once(monkeypatch):
    sought = []
    find = NameIndex.find
    monkeypatch.setattr(
        NameIndex, "find", lambda self, name: sought.append(name) or find(self, name)
    )
    names = StreamNames(("jawOpen",))
    for number in range(200):
        names.row(f"x{number}")
        names.settle()
    assert len([name for name in sought if name != "jawOpen"]) <= 400

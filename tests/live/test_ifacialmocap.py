import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from facert.data.names import ARKIT_SHAPES
from facert.live.frames import BadPacketError
from facert.live.ifacialmocap import IFacialMocapDecoder


def packet(separator="-", order=ARKIT_SHAPES):
    spelled = [
        name.removesuffix("Left") + "_L"
        if name.endswith("Left") and name not in ("jawLeft", "mouthLeft")
        else name
        for name in order
    ]
    weights = [
        f"{name}{separator}{ARKIT_SHAPES.index(of)}"
        for name, of in zip(spelled, order, strict=True)
    ]
    return ("|".join(weights) + "|=head#-21.4,-6.0,-6.6,-0.03,-0.1,-0.6|rightEye#1,2,3|").encode()


@pytest.mark.parametrize("separator", ["-", "&"])
def test_weights_are_hundredths_in_any_order(separator):
    observed = IFacialMocapDecoder().decode(packet(separator, ARKIT_SHAPES[::-1]))
    np.testing.assert_allclose(observed.values, np.arange(52) / 100)


def test_a_shape_that_is_not_sent_is_not_observed():
    observed = IFacialMocapDecoder().decode(packet(order=ARKIT_SHAPES[1:]))
    assert np.isnan(observed.values[0])
    assert np.isfinite(observed.values[1:]).all()


@settings(deadline=None, max_examples=50)
@given(st.binary(max_size=300) | st.text(max_size=300).map(str.encode))
def test_random_bytes_are_refused(raw):
    with pytest.raises(BadPacketError):
        IFacialMocapDecoder().decode(raw)


def test_what_a_packet_does_not_bring_is_as_it_was_until_the_face_is_lost():
    decoder = IFacialMocapDecoder()
    decoder.decode(packet())
    observed = decoder.decode(b"trackingStatus-1|jawOpen-77|=head#1,2,3|")
    expected = np.arange(52) / 100
    expected[ARKIT_SHAPES.index("jawOpen")] = 0.77
    np.testing.assert_allclose(observed.values, expected)
    with pytest.raises(BadPacketError):
        decoder.decode(b"no such thing")
    lost = decoder.decode(b"trackingStatus-0|jawOpen-77|=head#1,2,3|")
    assert np.isnan(lost.values).all()
    with pytest.raises(BadPacketError):  # too few to be sure that it is iFacialMocap
        decoder.decode(b"jawOpen-77|=head#1,2,3|")

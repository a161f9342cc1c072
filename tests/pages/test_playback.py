import numpy as np
import pytest

from facert.pages.playback import Playback

TIME = np.array([0.0, 0.1, 0.2, 0.5])


def test_time_stands_until_it_plays() -> None:
    playback = Playback(TIME)
    assert not playback.advance(1.0)
    assert playback.frame == 0


@pytest.mark.parametrize(
    ("passed", "speed", "frame"),
    [(0.05, 1, 0), (0.15, 1, 1), (0.4, 1, 2), (0.4, 0.25, 1), (9, 1, 0)],
)
def test_the_frame_is_the_last_that_has_begun_and_the_end_leads_to_the_start(
    passed: float, speed: float, frame: int
) -> None:
    playback = Playback(TIME, playing=True, speed=speed)
    playback.advance(passed)
    assert playback.frame == frame


def test_small_steps_come_to_the_same_as_a_large_one() -> None:
    playback = Playback(TIME, playing=True)
    changes = [playback.advance(0.01) for _ in range(30)]
    assert playback.frame == 2
    assert sum(changes) == 2


def test_seeking_stops_at_the_ends() -> None:
    playback = Playback(TIME)
    for wanted, there in ((2, 2), (-5, 0), (99, 3)):
        playback.seek(wanted)
        assert playback.frame == there

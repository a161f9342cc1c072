from facert.errors import MOST, InputError


def test_a_message_is_one_line_that_names_all():
    error = InputError("/time", "seconds,\n rising", "a step back", "Sort.", where="take.h5")
    assert str(error) == "take.h5: /time: expected seconds, rising, found a step back. Sort."


def test_a_message_is_bounded_and_keeps_its_end():
    error = InputError("f" * 10_000, "e" * 10_000, "x" * 10_000, "Mend it.")
    assert len(str(error)) < 4 * MOST
    assert str(error).endswith("x[...]. Mend it.")


def test_a_message_cannot_upset_a_terminal():
    error = InputError("column \x1b[31m\ud800", "a number", "text", "Mend it.")
    assert str(error).startswith(r"column \x1b[31m\ud800: ")

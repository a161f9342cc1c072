"""Regions as a person writes them, and as a take spells them."""

import pytest

from facert import InputError, Settings
from facert.data.regions import MOST, Region, Regions

TABLES = {
    "brows": {"markers": ["browL", "browR"], "controls": ["browUp", "sneer"]},
    "mouth": {"markers": ["lip", "chin"], "controls": ["jawOpen", "sneer"]},
}
MARKERS, CONTROLS = ["chin", "lip", "browR", "browL", "nose"], ["jawOpen", "sneer", "browUp"]


def test_tables_come_back_as_they_were():
    assert Regions.of(TABLES).tables == TABLES


def test_regions_are_in_the_order_of_their_names():
    assert Regions.of(dict(reversed(TABLES.items()))) == Regions.of(TABLES)
    assert Regions.of(TABLES).names == ("brows", "mouth")


def test_names_are_spelled_as_in_the_take():
    found = Regions.of(TABLES).matched(MARKERS, ["JawOpen", "Sneer", "brow_up"])
    assert found.parts[0].controls == ("brow_up", "Sneer")
    assert found.parts[1].markers == ("lip", "chin")


@pytest.mark.parametrize(
    ("markers", "controls", "message"),
    [
        (["chin", "lips", "browR", "browL"], CONTROLS, "mouth.markers.*'lip'.*Did you mean 'lips'"),
        (
            MARKERS,
            ["jawOpn", "sneer", "browUp"],
            "mouth.controls.*'jawOpen'.*Did you mean 'jawOpn'",
        ),
        (MARKERS, [*CONTROLS, "blink", "wink"], "every control.*'blink' and 1 more in none"),
    ],
)
def test_what_does_not_fit_the_take_is_named(markers, controls, message):
    with pytest.raises(InputError, match=message):
        Regions.of(TABLES).matched(markers, controls)


def test_a_marker_that_no_frame_shows_is_left_out():
    assert Regions.of(TABLES).seen_by(["lip", "browL", "browR"]).parts[1].markers == ("lip",)
    with pytest.raises(InputError, match=r"regions\.mouth\.markers: expected at least one name"):
        Regions.of(TABLES).seen_by(["browL", "browR"])


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({}, f"expected 1 to {MOST} regions, found 0"),
        ({"a": 3}, "expected a table a region, found int 'a'"),
        ({"a": {"marker": ["lip"]}}, "expected markers and controls, found 'marker'"),
        ({"a": {"markers": "lip"}}, "expected a list of names, found 'lip'"),
        ({"a": {"markers": ["lip", 3]}}, "expected a list of names"),
        ({"a": {"markers": ["lip"]}}, r"a\.controls: expected at least one name, found none"),
        ({"a": {"markers": ["lip", "lip"], "controls": ["c"]}}, "'lip' twice"),
    ],
)
def test_what_is_no_region_is_refused(tables, message):
    with pytest.raises(InputError, match=message):
        Regions.of(tables)


def test_a_model_file_holds_so_many_regions_at_most():
    with pytest.raises(InputError, match=f"1 to {MOST} regions"):
        Regions(tuple(Region(f"{i}", ("m",), ("c",)) for i in range(MOST + 1)))


def test_settings_keep_regions_through_a_file():
    settings = Settings(regions=Regions.of(TABLES))
    assert settings.as_dict()["regions"] == TABLES
    assert Settings().with_changes(settings.as_dict()) == settings


@pytest.mark.parametrize("regions", ["none", 3, ["brows"]])
def test_settings_refuse_other_regions(regions):
    with pytest.raises(InputError, match="regions: expected"):
        Settings().with_changes({"regions": regions})

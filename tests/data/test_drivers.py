"""Tables of what controls do to nodes."""

import pytest

from facert import InputError
from facert.data.drivers import Driver, Drivers
from facert.io.toml import read_drivers

TOML = """
[[eyeLookInLeft]]
node = "eye_L"
rotate = [0, 25, 0]

[[jawOpen]]
node = "jaw"
rotate = [18, 0, 0]
translate = [0, -0.002, 0.5e-3]

[[jawOpen]]
node = "jaw_ctrl"
property = "open"
factor = 10
"""


def test_a_table_a_driver(tmp_path):
    (tmp_path / "drivers.toml").write_text(TOML)
    found = read_drivers(tmp_path / "drivers.toml")
    assert found.controls == ("eyeLookInLeft", "jawOpen")
    assert found.nodes == ("eye_L", "jaw")
    assert found.entries[1] == Driver("jawOpen", "jaw", (18, 0, 0), (0, -0.002, 0.0005))
    assert Drivers.of(found.tables) == found
    assert found.tables["jawOpen"][1] == {"node": "jaw_ctrl", "property": "open", "factor": 10}


def test_a_single_table_needs_no_list():
    single = Drivers.of({"jawOpen": {"node": "jaw", "rotate": [18, 0, 0]}})
    assert single.entries == (Driver("jawOpen", "jaw", (18, 0, 0)),)


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({}, "expected a control at least, found none"),
        ({"jawOpen": 3}, r"\[\[jawOpen\]\]: expected a table, found 3"),
        ({"jawOpen": {"rotate": [1, 0, 0]}}, "expected keys node, .* found no node"),
        ({"jawOpen": {"node": "jaw", "rotation": [1, 0, 0]}}, "expected keys .* found 'rotation'"),
        ({"jawOpen": {"node": "jaw", "rotate": [1, 0]}}, "rotate: expected three numbers"),
        ({"jawOpen": {"node": "jaw", "rotate": [1, 0, float("nan")]}}, "three numbers"),
        ({"jawOpen": {"node": "jaw", "translate": ["1", 0, 0]}}, "translate: expected three"),
        ({"jawOpen": {"node": "", "rotate": [1, 0, 0]}}, "node: expected a name"),
        ({"jawOpen": {"node": "jaw"}}, "jaw: expected rotate, translate or property, found"),
        ({"jawOpen": {"node": "jaw", "rotate": [0, 0, 0]}}, "found 'none, or zeros'"),
        ({"jawOpen": {"node": "jaw", "property": "a", "factor": True}}, "factor: expected a n"),
        ({"jawOpen": {"node": "jaw", "property": "a", "factor": 0}}, "a number other than 0"),
        ({"jawOpen": {"node": "jaw", "property": "a", "factor": 10**400}}, "expected a number"),
        ({"jawOpen": {"node": "jaw", "rotate": [10**400, 0, 0]}}, "expected three numbers"),
    ],
)
def test_what_is_no_driver_is_named(tables, message):
    with pytest.raises(InputError, match=message):
        Drivers.of(tables)

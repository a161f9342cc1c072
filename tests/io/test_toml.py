"""Regions in TOML: what is written for editing is what is read."""

import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from facert import InputError
from facert.data.regions import Region, Regions
from facert.io.toml import WIDTH, read_regions, read_toml, regions_text

NAMES = st.lists(
    st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=30),
    min_size=1,
    max_size=20,
    unique=True,
)


@given(NAMES, NAMES, st.text(st.characters(exclude_categories=["Cs"]), max_size=10))
def test_whatever_the_names_they_come_back(tmp_path_factory, markers, controls, name):
    regions = Regions((Region(name, tuple(markers), tuple(controls)),))
    path = tmp_path_factory.mktemp("regions") / "regions.toml"
    path.write_text(regions_text(regions), encoding="utf-8", newline="")
    assert read_regions(path) == regions


def test_long_lists_fit_a_terminal():
    names = tuple(f"marker with a name {i}" for i in range(40))
    text = regions_text(Regions((Region("brows", names, names),)))
    assert max(map(len, text.splitlines())) <= WIDTH
    assert text.startswith("[brows]\nmarkers = [\n    ")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[brows\n", r"expected TOML such as \[brows\] with markers = .* and controls = "),
        ("brows = 3", r"regions\.toml: regions: expected a table a region"),
        ("[brows]\nmarkers = ['a']", r"regions\.toml: regions\.brows\.controls: expected at least"),
    ],
)
def test_a_file_of_something_else_is_refused_by_name(tmp_path, text, message):
    path = tmp_path / "regions.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_regions(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InputError, match=r"none\.toml: file: expected an existing file"):
        read_regions(tmp_path / "none.toml")


@pytest.mark.parametrize("part", ["a", '"b \\" c"', "'d.'"])
def test_a_key_of_very_many_parts_is_refused_at_once(tmp_path, part):
    path = tmp_path / "deep.toml"
    path.write_text(f"{' . '.join([part] * 40_000)} = 1\n")
    began = time.process_time()
    with pytest.raises(InputError, match="a key of more than 32 parts"):
        read_toml(path)
    assert time.process_time() - began < 1
    path.write_text(f'{".".join(["a"] * 20)} = "{"." * 100}" # {"." * 100}\n')
    assert list(read_toml(path)) == ["a"]


def test_a_file_of_a_hundred_thousand_tables_is_refused_before_it_is_parsed(tmp_path):
    path = tmp_path / "regions.toml"
    path.write_text("".join(f'[t{i}]\nmarkers=["a"]\n' for i in range(100_000)))
    with pytest.raises(InputError, match="more than 1048576 characters"):
        read_regions(path)

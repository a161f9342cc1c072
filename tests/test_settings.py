import re

import pytest

from facert.errors import InputError
from facert.io.toml import read_toml
from facert.methods.registry import REGISTRY, method_class
from facert.settings import Settings


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("latent_dim", 0, "at least 1"),
        ("latent_dim", 2.5, "int"),
        ("latent_dim", "8", "int"),
        ("latent_dim", True, "int"),
        ("labels", -1, "at least 0"),
        ("unlabelled", -1, "at least 0"),
        ("unlabelled", 0.5, "int"),
        ("seed", -1, "at least 0"),
        ("sigma_c", 0.0, "above 0"),
        ("sigma_c", float("nan"), "finite"),
        ("sigma_t", float("inf"), "finite"),
        ("tolerance", float("inf"), "finite"),
        ("target_noise_floor", -1.0, "at least 0"),
        ("optimizer", "adam", "one of lbfgs, scg"),
        ("likelihood", "dtc", "one of auto, exact, vfe, fitc"),
        ("inducing", 0, "at least 1"),
        ("device", 1, "str"),
    ],
)
def test_a_value_that_cannot_be_is_named(name, value, expected):
    with pytest.raises(InputError, match=rf"^{name}: expected .*{expected}.*found"):
        Settings(**{name: value})


def test_by_default_the_method_decides_how_much_unlabelled_data_it_uses():
    assert Settings().unlabelled is None
    most = {name: method_class(name).most_unlabelled for name in REGISTRY}
    assert {name for name, count in most.items() if count is not None} == {"ssgplvm", "sgplvm"}


def test_neighbours_and_latent_dimensions_are_the_papers():
    """Section 2.2: "k = 8 nearest neighbors for LLE and 8 dimensions for the latent space"."""
    assert (Settings().neighbours, Settings().latent_dim) == (8, 8)


def test_poses_are_meant_less_exactly_than_a_capture_and_more_so_than_their_own_motion():
    """A variance, of normalised poses, whose largest is 1."""
    assert 0.1**2 < Settings().target_noise_floor < 0.3**2


def test_an_integer_will_do_where_a_number_is_due():
    assert Settings(sigma_c=1).sigma_c == 1


def test_changes_leave_the_rest_as_it_was():
    changed = Settings(seed=3).with_changes({"latent_dim": 4})
    assert (changed.seed, changed.latent_dim) == (3, 4)


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match=r"whiskers: expected one of .*latent_dim"):
        Settings().with_changes({"whiskers": 4})
    with pytest.raises(InputError, match=r"metod: .*Did you mean method\?"):
        Settings().with_changes({"metod": "gpr"})


def test_settings_survive_the_way_through_a_dictionary():
    settings = Settings(labels=5, optimizer="scg", source_noise_floor=0.5)
    assert Settings().with_changes(settings.as_dict()) == settings


def test_settings_are_read_from_toml(tmp_path):
    path = tmp_path / "settings.toml"
    path.write_text('latent_dim = 4\noptimizer = "scg"\n')
    assert read_toml(path) == {"latent_dim": 4, "optimizer": "scg"}


@pytest.mark.parametrize("content", [b"latent_dim = ", b"\xff\xfe", b"a=" + b"[" * 5000, None])
def test_a_file_that_is_no_toml_is_refused(tmp_path, content):
    path = tmp_path / "settings.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(
        InputError,
        match=r"settings\.toml: (file: expected (TOML|an existing file)|line 1: expected UTF-8)",
    ):
        read_toml(path)


def test_a_file_that_is_no_toml_is_answered_with_an_example(tmp_path):
    (tmp_path / "a.toml").write_text("[jaw")
    for example in ("latent_dim = 8", '["jaw*"] gain = 1.2'):
        with pytest.raises(InputError, match=re.escape(f"TOML such as {example}, found")):
            read_toml(tmp_path / "a.toml", example)

from facert.data.names import ARKIT_SHAPES, control_groups
from facert.pages.widgets import UNFOLDED, unfolded_groups


def test_of_the_standard_shapes_all_groups_are_open():
    groups = control_groups(ARKIT_SHAPES)
    assert unfolded_groups(groups) == set(groups)


def test_of_a_large_rig_the_short_groups_are_open_the_jaw_among_them():
    names = [*ARKIT_SHAPES, *(f"mouthCorrective{i}" for i in range(99)), "eyeBrow", "headTurn"]
    names += [f"squash{i}" for i in range(UNFOLDED)]
    groups = control_groups(names)
    unfolded = unfolded_groups(groups)
    assert {"jaw", "brows", "nose", "cheeks", "head"} <= unfolded
    assert "mouth" not in unfolded

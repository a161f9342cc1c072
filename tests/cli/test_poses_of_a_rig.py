"""``facert convert --poses``: names and limits of the rig, targets, and what is odd about poses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from facert.data.rig import Rig
from facert.io.formats import read_take_file, write_rig_file

SHAPES = ("jawOpen", "browDown_L", "browDown_R", "mouthSmile_L", "tongueOut")
POSES = "frame,mouth_smile_left,JawOpen,browDown\n2,0.5,0.25,1\n0,0,0,0\n5,0.7,0.3,0.2\n"


@pytest.fixture(name="files")
def _files(tmp_path: Path) -> tuple[Path, Path, Path]:
    """A recording, poses for it, and the rig of the character."""
    paths = tuple(tmp_path / name for name in ("capture.csv", "poses.csv", "rig.h5"))
    rows = "".join(f"{i / 50},{i},2,3\n" for i in range(8))
    paths[0].write_text(f"time,a.x,a.y,a.z\n{rows}")
    paths[1].write_text(POSES)
    write_rig_file(Rig(np.eye(3), np.zeros((5, 3, 3)), SHAPES, [[0, 1, 2]]), paths[2])
    return paths


def test_poses_have_the_names_the_order_and_the_limits_of_the_rig(facert, files) -> None:
    capture, poses, rig = files
    output = capture.with_name("posed.h5")
    done = facert("convert", capture, output, "--poses", poses, "--rig", rig)
    assert done.code == 0, done.err
    take = read_take_file(output)
    assert take.controls.names == SHAPES
    np.testing.assert_array_equal(take.params[2], [0.25, 1, 1, 0.5, 0])
    assert take.controls.limits.tolist() == [[0, 1]] * 5
    said = " ".join(done.err.split())
    assert "poses.csv: 1 control of the character are not in it" not in said
    assert "poses.csv: 1 control of the character is not in it, and taken as 0" in said
    assert "no pose moves, and no prediction will: tongueOut" in said
    more = capture.with_name("more.h5")
    poses.write_text("frame,tongueOut\n4,1\n")
    done = facert("convert", output, more, "--poses", poses, "--rig", rig)
    assert done.code == 0, done.err
    assert read_take_file(more).params[4].tolist() == [0, 0, 0, 0, 1]


def test_a_typo_and_a_control_that_the_rig_lacks_are_refused(facert, files) -> None:
    capture, poses, rig = files
    command = ("convert", capture, capture.with_name("posed.h5"), "--poses", poses)
    poses.write_text(POSES.replace("JawOpen", "JawOpne"))
    refused = facert(*command, "--rig", rig)
    assert refused.code == 3
    assert f"{poses}: names of the poses" in refused.err
    assert "'JawOpne'" in refused.err
    assert "Did you mean 'jawOpen'?" in refused.err
    assert facert(*command).code == 0
    poses.write_text(POSES.replace("JawOpen", "ears"))
    refused = facert(*command, "--rig", rig, "--overwrite")
    assert refused.code == 3
    assert "'ears', which it has not" in refused.err
    poses.write_text(POSES.replace("JawOpen", "browDown_L"))
    refused = facert(*command, "--rig", rig, "--overwrite")
    assert "'browDown_L' and 'browDown' for 'browDown_L'" in refused.err


def test_a_pose_known_in_part_stays_an_error(facert, files) -> None:
    capture, poses, rig = files
    poses.write_text(POSES.replace("0.5,0.25,1", "0.5,,1"))
    refused = facert("convert", capture, capture.with_name("p.h5"), "--poses", poses, "--rig", rig)
    assert refused.code == 3
    assert "known in part" in refused.err


def test_limits_are_logged_and_overruled(facert, files) -> None:
    capture, poses, rig = files
    output = capture.with_name("posed.h5")
    command = ("convert", capture, output, "--poses", poses, "--overwrite")
    done = facert(*command)
    assert "all 3 controls limited to 0..1" in done.err
    assert read_take_file(output).controls.limits.tolist() == [[0, 1]] * 3
    done = facert(*command, "--limits", "none", "--limits", "brow*=0..2")
    assert "limited" not in done.err
    assert read_take_file(output).controls.limits[2].tolist() == [0, 2]
    assert facert(*command, "--rig", rig, "--limits", "-1..1").code == 0
    assert read_take_file(output).controls.limits.tolist() == [[-1, 1]] * 5
    again = capture.with_name("again.h5")
    assert facert("convert", output, again, "--limits", "jawOpen=0..3").code == 0
    assert read_take_file(again).controls.limits.tolist() == [[0, 3], *[[-1, 1]] * 4]
    refused = facert(*command, "--limits", "jawOpne=0..1")
    assert (refused.code, "Did you mean 'JawOpen'" in refused.err) == (3, True)
    refused = facert("convert", capture, again, "--limits", "0..1", "--overwrite")
    assert (refused.code, "a take with controls" in refused.err) == (3, True)


def test_poses_in_percent_are_warned_of_when_they_come_in(facert, files) -> None:
    capture, poses, rig = files
    poses.write_text(POSES.replace("0.5,0.25", "50,0.25").replace("0.7,0.3", "70,0.3"))
    output = capture.with_name("posed.h5")
    done = facert("convert", capture, output, "--poses", poses, "--rig", rig)
    assert done.code == 0
    assert "warning: in percent, it seems" in done.err
    assert "mouthSmile_L up to 70" in done.err


def test_the_target_reaches_the_poses(facert, files) -> None:
    capture, _, _ = files
    track, output = capture.with_name("track.npz"), capture.with_name("posed.h5")
    one, two = np.full((2, 1), 0.25), np.array([[0.5, 0.1], [0.75, 0.2]])
    np.savez(track, markers=np.ones((2, 1, 3)), marker_names=["a"], time=[0.02, 0.1],
             one=one, one_names=["x"], two=two, two_names=["y", "z"])  # fmt: skip
    refused = facert("convert", capture, output, "--poses", track)
    assert refused.code == 3
    assert f"{track}: --target: expected one of: one, two" in refused.err
    done = facert("convert", capture, output, "--poses", track, "--target", "two")
    assert done.code == 0, done.err
    take = read_take_file(output)
    assert (take.controls.names, take.labels.tolist()) == (("y", "z"), [1, 5])
    table = capture.with_name("table.csv")
    table.write_text("frame,w\n1,0.5\n0,0.25\n")
    done = facert("convert", track, capture.with_name("b.h5"), "--poses", table)
    assert done.code == 0, done.err
    assert "of its targets none is read" in done.err
    assert read_take_file(capture.with_name("b.h5")).controls.names == ("w",)

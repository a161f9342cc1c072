"""JSON of trackers is read by its shape."""

from __future__ import annotations

import json
import logging

import numpy as np
import pytest

from facert.data.names import ARKIT_SHAPES
from facert.data.take import Controls, Source, Take
from facert.errors import InputError
from facert.io.curves import write_curves
from facert.io.formats import read_take_file

FRAMES, NAMES = 12, ARKIT_SHAPES[:11]
rng = np.random.default_rng(3)
VALUES = rng.uniform(0.01, 0.99, (FRAMES, len(NAMES))).round(5)
SECONDS = (np.arange(FRAMES) / 30).round(6)
ROWS = [dict(zip(NAMES, row, strict=True)) for row in VALUES.tolist()]
STAMPS = list(zip(SECONDS.tolist(), ROWS, strict=True))


def categories(row, key="categoryName"):
    first = {"index": 0, "score": 0.5, key: "_neutral", "displayName": ""}
    return [first, *({"index": 1, "score": v, key: name} for name, v in row.items())]


def rotated(t):
    return {"x": t, "y": 2 * t, "z": 0.0}


COLUMNS = {"time": SECONDS.tolist(), **dict(zip(NAMES, VALUES.T.tolist(), strict=True))}
LAYOUTS = {
    "BEAT": {
        "names": list(NAMES),
        "frames": [
            {"weights": list(row.values()), "time": t, "rotation": [0, 0, 0]} for t, row in STAMPS
        ],
    },
    "objects under a key": [{"time": t, "blendshapes": row} for t, row in STAMPS],
    "flat objects": [{"timestamp": t, **row} for t, row in STAMPS],
    "milliseconds": [{"t_ms": round(1000 * t), **row, "confidence": 0.9} for t, row in STAMPS],
    "numbers as text": [{n: str(v) for n, v in {"time": t, **row}.items()} for t, row in STAMPS],
    "MediaPipe": [
        {"timestamp_ms": 1000 * t, "face_blendshapes": [categories(row, "category_name")]}
        for t, row in STAMPS
    ],
    "MediaPipe of the web": {
        "frames": [
            {
                "timestamp": 1000 * t,
                "faceLandmarks": [[{"x": 0.1, "y": 0.2, "z": 0.3}] * 20],
                "faceBlendshapes": [{"categories": categories(row), "headIndex": -1}],
                "facialTransformationMatrixes": [{"rows": 4, "columns": 4, "data": [0.5] * 16}],
            }
            for t, row in STAMPS
        ]
    },
    "lists of categories": {"fps": 30, "results": [categories(row) for row in ROWS]},
    "nested": {
        "version": 2,
        "animation": {"frameRate": 30, "frames": [{"face": {"shapes": row}} for row in ROWS]},
    },
    "names once": {"fps": 30, "blendshapes": list(NAMES), "data": VALUES.tolist()},
    "columns": COLUMNS,
    "a matrix with times": {
        "names": list(NAMES),
        "timestamps_ms": (1000 * SECONDS).tolist(),
        "weights": VALUES.tolist(),
    },
    "pairs": [{"time": t, "blendshapes": [[n, v] for n, v in row.items()]} for t, row in STAMPS],
    "an object a weight": [
        {"time": t, "blendshapes": [{n: v} for n, v in row.items()]} for t, row in STAMPS
    ],
    "scores below names": [
        {"time": t, "blendshapes": {n: {"value": v, "min": 0} for n, v in row.items()}}
        for t, row in STAMPS
    ],
    "columns under a key": {
        "timestamps": SECONDS.tolist(),
        "blendshapes": dict(zip(NAMES, VALUES.T.tolist(), strict=True)),
    },
    "pandas split": {
        "columns": ["time", *NAMES],
        "index": list(range(FRAMES)),
        "data": np.column_stack([SECONDS, VALUES]).tolist(),
    },
    "pandas columns": {
        name: {str(i): v for i, v in enumerate(column)} for name, column in COLUMNS.items()
    },
    "a key a frame": {str(i): {"time": t, **row} for i, (t, row) in enumerate(STAMPS)},
    "a key a time": {f"{t:.6f}": row for t, row in STAMPS},
    "texts of time": [
        {"time": f"2026-01-01T10:00:00.{round(1e6 * t):06d}Z", "id": "a1", **row}
        for t, row in STAMPS
    ],
    "the head as well": [
        {"time": t, "head": rotated(t), "headPose": {"pitch": t}, "blendShapes": row}
        for t, row in STAMPS
    ],
    "parts of the face": [
        {
            "time": t,
            "eyes": {n: v for n, v in row.items() if n.startswith("eye")},
            "jaw": {n: v for n, v in row.items() if n.startswith("jaw")},
        }
        for t, row in STAMPS
    ],
}  # fmt: skip
LINES = {
    "lines": [{"time": t, "blendshapes": row} for t, row in STAMPS],
    "lines below one about them": [
        {"fps": 30, "device": "phone"},
        *({"blendshapes": row} for row in ROWS),
    ],
    "flat lines": [{"frame_time": t, **row} for t, row in STAMPS],
}


@pytest.fixture(name="path")
def _path(tmp_path, caplog):
    caplog.set_level(logging.INFO, "facert")
    return tmp_path / "face.json"


def check(take):
    assert take.source.names == NAMES
    np.testing.assert_allclose(take.source.values, VALUES)
    np.testing.assert_allclose(take.time, SECONDS, atol=6e-4)
    assert take.fps == 30


@pytest.mark.parametrize("layout", LAYOUTS)
def test_frames_are_found_in_any_layout(path, layout):
    path.write_text(json.dumps(LAYOUTS[layout]))
    check(read_take_file(path))


@pytest.mark.parametrize("layout", LINES)
def test_frames_may_be_one_a_line(path, layout):
    path.write_text("\n".join(map(json.dumps, LINES[layout])) + "\n\n")
    check(read_take_file(path))


@pytest.mark.parametrize("of", [list, lambda xyz: dict(zip("xyz", xyz, strict=True))])
def test_markers_may_be_lists_or_objects(path, of):
    chin = 50 + VALUES[:, :3]
    frames = [
        {"time": t, "markers": {"chin": of(xyz), "lip": of([1.0, 2.0, 3.0])}}
        for t, xyz in zip(SECONDS.tolist(), chin.tolist(), strict=True)
    ]
    path.write_text(json.dumps(frames))
    source = read_take_file(path).source
    assert source.names == ("chin", "lip")
    np.testing.assert_array_equal(source.values[:, 0], chin)


def test_what_is_left_out_is_named(path, caplog):
    path.write_text(json.dumps(LAYOUTS["MediaPipe of the web"]))
    read_take_file(path)
    path.write_text(json.dumps(LAYOUTS["BEAT"]))
    read_take_file(path)
    for name in ("_neutral", "faceLandmarks", "facialTransformationMatrixes", "rotation"):
        assert f"'{name}'" in caplog.text


@pytest.mark.parametrize("missing", [{}, None, []])
def test_a_frame_without_a_face_is_not_observed(path, missing):
    frames = [
        {"time": t, "blendshapes": missing if i == 4 else row} for i, (t, row) in enumerate(STAMPS)
    ]
    path.write_text(json.dumps(frames))
    seen = read_take_file(path).source.valid.all(axis=1)
    assert seen.tolist() == [i != 4 for i in range(FRAMES)]


def test_a_flag_hides_the_frame(path, caplog):
    frames = [
        {"time": t, "tracked": i > 2, "blendshapes": row} for i, (t, row) in enumerate(STAMPS)
    ]
    path.write_text(json.dumps(frames))
    take = read_take_file(path)
    assert take.source.valid.all(axis=1).sum() == FRAMES - 3
    assert "3 rows without a face by 'tracked'" in caplog.text
    assert read_take_file(path, keep=["tracked"]).source.names == ("tracked", *NAMES)


def test_without_times_and_rate_one_must_be_given(path):
    path.write_text(json.dumps(ROWS))
    with pytest.raises(InputError, match="--in-fps"):
        read_take_file(path)
    assert read_take_file(path, fps=24).fps == 24


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ([], "frames of weights"),
        ({}, "frames of weights"),
        ("text", "frames of weights"),
        ([1, 2], "frames of weights"),
        ({"names": ["a", "b"], "frames": [{"time": 0, "weights": [1]}]}, "2 numbers, one a name"),
        ([{"time": 0}, {"time": 1}], "names|numbers"),
        ([{"time": 0, "a": 1}, {"time": None, "a": 1}], "frame 2"),
        ([{f"name{i}": 1.0, "time": i} for i in range(1500)], "the same names"),
        ([{"time": 0, "a": 10**400}], "numbers|number"),
        ([{"time": i, "jaw": float("inf")} for i in range(3)], "finite"),
    ],
)
def test_what_is_wrong_is_named(path, document, message):
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=message) as caught:
        read_take_file(path)
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize("text", ["{", '{"a": 1}\n{"b"', "[" * 100_000, "x\ny", ""])
def test_other_text_is_refused(path, text):
    path.write_text(text)
    with pytest.raises(InputError, match=r"face\.json"):
        read_take_file(path)


def test_deep_objects_end_somewhere(path):
    path.write_text('{"a":' * 500 + "1" + "}" * 500)
    with pytest.raises(InputError, match="frames of weights"):
        read_take_file(path)


@pytest.mark.parametrize("names", [["frame", "confidence"], ["a.x", "blendShapes.jawOpen"]])
def test_curves_of_facert_keep_all_of_their_names(path, names):
    values = np.column_stack([np.arange(FRAMES), VALUES[:, 0]])
    take = Take(SECONDS, Source(values, ["u", "v"]), Controls(names), values)
    write_curves(take, path)
    assert read_take_file(path).source.names == tuple(names)
    document = json.loads(path.read_text())
    path.write_text(
        json.dumps({"fps": 30, "names": ["jawOpen", "time"], "weights": document["weightMat"]})
    )
    assert read_take_file(path).source.names == ("jawOpen",)


def points_of(values, **more):
    """A list of points {x, y, z} of values (M, 3)."""
    return [{**dict(zip("xyz", xyz, strict=True), **more)} for xyz in values.tolist()]


POINTS = 50 + VALUES[:, :6].reshape(FRAMES, 2, 3)
LANDMARKS = {
    "objects": points_of,
    "with a visibility": lambda values: points_of(values, visibility=0.9),
    "of several faces": lambda values: [points_of(values), points_of(values + 9)],
    "lists": lambda values: values.tolist(),
    "beside a head": points_of,
}


@pytest.mark.parametrize("kind", LANDMARKS)
def test_landmarks_in_a_list_are_markers(path, kind):
    head = {"head": {"pitch": 0.1, "yaw": 0.2}, "roll": 0.3} if "head" in kind else {}
    frames = [
        {"time": t, "landmarks": LANDMARKS[kind](values), **head}
        for t, values in zip(SECONDS.tolist(), POINTS, strict=True)
    ]
    path.write_text(json.dumps(frames))
    source = read_take_file(path).source
    assert source.names == ("0", "1")
    np.testing.assert_array_equal(source.values, POINTS)


@pytest.mark.parametrize("key", ["blendshapes", ""])
def test_landmarks_beside_weights_are_left_out(path, key, caplog):
    frames = [
        {"time": t, "landmarks": points_of(POINTS[0]), **({key: row} if key else row)}
        for t, row in STAMPS
    ]
    path.write_text(json.dumps(frames))
    check(read_take_file(path))
    assert "'landmarks'" in caplog.text


def test_points_in_a_plane_are_no_weights(path):
    path.write_text(json.dumps([{"time": t, "landmarks": [{"x": 1, "y": t}]} for t, _ in STAMPS]))
    with pytest.raises(InputError, match="weights or markers"):
        read_take_file(path)


def test_frames_without_a_face_are_counted_and_no_list_is_said_to_be_left_out(path, caplog):
    caplog.set_level(logging.INFO)
    faces = [{"categories": [{"categoryName": "jawOpen", "score": i / 40}]} for i in range(30)]
    frames = [
        {"timestamp": i / 30, "faceBlendshapes": [] if i in (7, 8) else [face]}
        for i, face in enumerate(faces)
    ]
    path.write_text(json.dumps(frames))
    take = read_take_file(path)
    assert np.flatnonzero(np.isnan(take.source.values[:, 0])).tolist() == [7, 8]
    assert "2 frames without a face" in caplog.text
    assert "left out" not in caplog.text


def test_a_frame_of_very_many_names_is_refused_before_it_is_parsed(tmp_path):
    names = ", ".join(f'"w{i}": 0' for i in range(60_000))
    path = tmp_path / "wide.json"
    path.write_text(f"[{{{names}}}, nobody reads on")
    with pytest.raises(InputError, match="at most 49216 columns, found 60000"):
        read_take_file(path)
    curve = ", ".join(f'"{i / 30:.6f}": 0.5' for i in range(60_000))
    path.write_text(f'[{{"Name": "jawOpen", {curve}}}]')
    assert len(read_take_file(path)) == 60_000

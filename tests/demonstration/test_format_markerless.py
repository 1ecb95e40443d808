"""Points of bodies that cameras see: MediaPipe, OpenPose, COCO, depth cameras, FreeMoCap, NumPy."""

import io
import json

import numpy as np
import pytest
from takes import read_as, refused_as, steps

from armdesign.demonstration import Hints, read_recording, read_take
from armdesign.demonstration.files.body_names import COCO, HUMAN36M, MEDIAPIPE, SMPL
from armdesign.demonstration.files.formats import body_json, coco_json, mediapipe, npz, openpose
from armdesign.demonstration.files.keypoints import names_of
from armdesign.demonstration.points.guess import find_arms

RNG = np.random.default_rng(3)
BODY = RNG.normal(size=(4, 33, 3))
BODY[:, 24] = -BODY[:, 23]  # the hips, about the origin


def wide(first: int, names: str = "{axis}{i}") -> list[str]:
    """A table of 33 landmarks whose numbers begin with ``first``."""
    parts = [("x", 0), ("y", 1), ("z", 2), ("v", 3)]
    head = [names.format(axis=axis, i=i + first) for i in range(33) for axis, _ in parts]
    rows = [",".join([f"{v:.9g}" for k in range(33) for v in (*frame[k], 0.9)]) for frame in BODY]
    return [",".join(["class", *head]), *(f"lift,{row}" for row in rows)]


@pytest.mark.parametrize(("first", "names"), [(0, "{axis}{i}"), (1, "{axis}{i}"), (0, "landmark_{i}_{axis}")])
def test_mediapipe_by_number(tmp_path, first, names):
    take = read_as(mediapipe, tmp_path, wide(first, names))
    assert set(take.points) == set(MEDIAPIPE)
    np.testing.assert_allclose(take.points["right_wrist"], BODY[:, 16], rtol=1e-8)
    assert (take.units, take.up, take.timed) == ("m", "-y", False)
    assert "base-mode" in steps(take)["hips"]


def frames(kind: str) -> object:
    """The body as scripts write it."""
    marks = [[{**dict(zip("xyz", p.tolist(), strict=True)), "visibility": 0.8} for p in frame] for frame in BODY]
    match kind:
        case "landmarks":
            return [{"frame": i, "landmarks": each} for i, each in enumerate(marks)]
        case "rows":
            return {"fps": 30, "frames": [{"pose_world_landmarks": [[*p, 0.8] for p in f]} for f in BODY.tolist()]}
        case "people":
            return [{"timestamp": 0.033 * i, "pose_world_landmarks": [each, marks[0]]} for i, each in enumerate(marks)]
        case "both":
            image = [{"x": 0.5, "y": 0.5, "z": 0.0, "visibility": 0.8}] * 33
            return [{"poseLandmarks": image, "poseWorldLandmarks": each} for each in marks]
    return [{"timestamp_ms": 33 * i, "landmarks": dict(zip(MEDIAPIPE, m, strict=True))} for i, m in enumerate(marks)]


@pytest.mark.parametrize("kind", ["landmarks", "rows", "both", "people", "by name"])
def test_mediapipe_as_json(tmp_path, kind):
    take = read_as(mediapipe, tmp_path, json.dumps(frames(kind)))
    np.testing.assert_allclose(take.points["left_elbow"], BODY[:, 13])
    np.testing.assert_allclose(take.confidence["left_elbow"], 0.8)
    assert take.timed == (kind in ("by name", "people"))
    if take.timed:
        np.testing.assert_allclose(take.time, 0.033 * np.arange(4))


def test_json_lines_and_frames_without_anybody(tmp_path):
    lines = [json.dumps(each) for each in frames("landmarks")]
    lines[1] = '{"frame": 1, "landmarks": []}'
    take = read_as(mediapipe, tmp_path, "\n".join(lines))
    assert np.isnan(take.points["nose"][:, 0]).tolist() == [False, True, False, False]


def test_landmarks_in_the_image_are_no_places(tmp_path):
    rows = [[{"x": 0.4, "y": 0.6, "z": -0.2, "visibility": 0.9}] * 33] * 3
    text = json.dumps([{"pose_landmarks": row} for row in rows])
    assert "world landmarks" in refused_as(mediapipe, tmp_path, text)


def person(table: np.ndarray, key: str = "pose_keypoints_3d") -> dict:
    return {"person_id": [-1], "pose_keypoints_2d": [1, 2, 0.5] * 25, key: np.ravel(table).tolist()}


def test_openpose_reads_all_files_of_a_take_in_their_order(tmp_path):
    tables = RNG.normal(size=(12, 25, 4))
    tables[..., 3] = 0.9
    for i in range(12):
        content = {"version": 1.3, "people": [] if i == 5 else [person(tables[i]), person(tables[i] + 1)]}
        (tmp_path / f"take_{i + 95}_keypoints.json").write_text(json.dumps(content))
    (tmp_path / "other_97_keypoints.json").write_text('{"people": []}')
    take = read_take(tmp_path / "take_98_keypoints.json", Hints(rate=30.0))
    np.testing.assert_allclose(take.time, np.arange(12) / 30.0)
    wanted = tables[:, 4, :3].copy()
    wanted[5] = np.nan
    np.testing.assert_allclose(take.points["RWrist"], wanted)
    assert "people" in steps(take)
    (tmp_path / "other_97_keypoints.json").unlink()
    np.testing.assert_array_equal(read_take(tmp_path, Hints(rate=30.0)).points["RWrist"], take.points["RWrist"])


def test_keypoints_in_the_image_are_refused(tmp_path):
    flat = {"version": 1.3, "people": [{"pose_keypoints_2d": [1, 2, 0.5] * 25}]}
    assert "pose_keypoints_3d" in refused_as(openpose, tmp_path, json.dumps(flat))
    people = [{"image_id": i, "keypoints": [[1.0, 2.0]] * 17, "keypoint_scores": [0.5] * 17} for i in range(3)]
    assert "image" in refused_as(coco_json, tmp_path, json.dumps(people))


def test_coco_in_a_flat_list_with_names(tmp_path):
    table = RNG.normal(size=(3, 2, 4))
    people = [{"image_id": f"{i}.jpg", "keypoints": table[i].ravel().tolist(), "score": 1.0} for i in range(3)]
    content = {"keypoint_names": ["RElbow", "RWrist"], "annotations": people}
    take = read_as(coco_json, tmp_path, json.dumps(content))
    np.testing.assert_allclose(take.points["RWrist"][:, 0], np.where(table[:, 1, 3] < 0.5, np.nan, table[:, 1, 0]))


def test_seventeen_points_are_told_apart():
    coco = RNG.normal(size=(5, 17, 3))
    assert names_of(coco) == COCO
    coco[:, 0] = 0.5 * (coco[:, 1] + coco[:, 4])
    assert names_of(coco) == HUMAN36M
    assert names_of(coco[:, :3]) == ("point 1", "point 2", "point 3")
    holistic = names_of(np.zeros((1, 553, 3)))  # body, hands and face of FreeMoCap
    assert (len(holistic), holistic[:33], holistic[33]) == (553, MEDIAPIPE, "point 34")


def test_a_camera_without_confidence_and_with_names_of_its_own(tmp_path):
    bodies = [{"bodies": [{"body_id": 1, "joint_positions": [[i, 2.0, None]] * 2}]} for i in range(3)]
    content = {"bone_list": [], "frames": bodies, "joint_names": ["A", "A"]}
    take = read_as(body_json, tmp_path, json.dumps(content))
    assert list(take.points) == ["A", "A#2"]
    assert np.isnan(take.points["A"][:, 2]).all()
    assert not take.timed


@pytest.mark.parametrize("text", ['{"body_list": [', '{"body_list": {"a": 1}}', '{"frames": [], "bone_list": []}'])
def test_damaged_json_is_refused(tmp_path, text):
    refused_as(body_json, tmp_path, text)


def saved(**arrays: object) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


def test_npz_without_names_is_known_by_its_number(tmp_path):
    joints = RNG.normal(size=(5, 22, 3)).astype(np.float32)
    content = saved(poses=np.zeros((5, 156)), joints=np.asfortranarray(joints), mocap_framerate=120.0)
    take = read_as(npz, tmp_path, content)
    assert tuple(take.points) == SMPL
    np.testing.assert_array_equal(take.points["right_wrist"], joints[:, 21])
    np.testing.assert_allclose(take.time, np.arange(5) / 120.0)
    assert {arm.roles["wrist"] for arm in find_arms(take.points)} == {("right_wrist",), ("left_wrist",)}


def test_npy_of_freemocap(tmp_path):
    stream = io.BytesIO()
    np.save(stream, BODY)
    take = read_as(npz, tmp_path, stream.getvalue())
    np.testing.assert_array_equal(take.points["left_wrist"], BODY[:, 15])
    assert not take.timed


def test_npz_with_everything(tmp_path):
    turns = np.tile([0.5, 0.1, 0.2, 0.3], (3, 2, 1))
    content = saved(
        positions=1000 * BODY[:3, :2], names=np.array(["a", "b"]), time=[0.0, 0.1, 0.3], units="mm", up="y",
        quaternions=turns, confidence=[[1, 0.1], [1, 1], [1, 1]],
    )  # fmt: skip
    take = read_as(npz, tmp_path, content)
    assert (take.units, take.up, list(take.points)) == ("mm", "y", ["a", "b"])
    assert np.isnan(take.points["b"][:, 0]).tolist() == [True, False, False]
    np.testing.assert_allclose(take.orientations["a"], turns[:, 0])
    np.testing.assert_allclose(take.time, [0.0, 0.1, 0.3])


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (saved(poses=np.zeros((5, 156)), betas=np.zeros(16), trans=np.zeros((5, 3))), "body model"),
        (saved(a=np.zeros((5, 4))), "positions"),
        (saved(positions=np.zeros((3, 1, 3)), rate=0.0), "rate"),
        (saved(positions=np.full((3, 1, 3), np.inf), rate=1.0), "infinite"),
        (saved(positions=np.zeros((3, 1, 3)), time=[0.0, 0.0, 1.0]), "increase"),
        (saved(positions=np.array([{"a": 1}], dtype=object)), "positions"),
        (saved(positions=np.zeros((3, 1, 3)))[:-40], "damaged"),
    ],
)
def test_npz_that_is_refused(tmp_path, content, said):
    assert said in refused_as(npz, tmp_path, content)


def test_a_skeleton_upside_down_is_put_upright(tmp_path):
    points = np.zeros((5, 33, 3))
    points[:, [MEDIAPIPE.index(name) for name in ("left_ankle", "right_ankle")], 1] = 0.9
    points[:, [MEDIAPIPE.index(name) for name in ("left_shoulder", "right_shoulder")], 1] = -0.5
    (tmp_path / "take.npz").write_bytes(saved(positions=points, rate=30.0, units="m"))
    recording = read_recording(tmp_path / "take.npz")
    assert recording.points["right_shoulder"][0, 2] == pytest.approx(0.5)
    assert {step.name: step for step in recording.about.steps}["up"].details["axis"] == "-y"

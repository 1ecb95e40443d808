"""One moving arm, made by us, in the exact layout of every format.

``python tests/demonstration/made_recordings.py`` writes the files into ``tests/data/recordings``. There they stand for
all tests that need a recording; ``test_formats.py`` holds each against the arm that it was made of, and the fuzz tests
damage them.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import motive_files
import numpy as np
from bvh_files import Joint, bvh_text
from c3d_bytes import DEC, MIPS, c3d_bytes
from scipy.spatial.transform import Rotation

from armdesign.demonstration.files.body_names import AZURE_KINECT, MEDIAPIPE

DATA = Path(__file__).resolve().parents[1] / "data" / "recordings"
FRAMES, RATE = 40, 50.0
NAMES = ("shoulder", "elbow", "wrist", "hand")
HIDDEN = slice(17, 20)  # frames in which the elbow is not seen

_time = np.arange(FRAMES) / RATE
_turns = [  # of upper arm, forearm and hand, about axes fixed in the room
    Rotation.from_rotvec(np.stack([0.2 * np.sin(3 * _time), speed * np.sin(2 * _time) - 0.6, 0.3 * _time], axis=1))
    for speed in (0.4, 0.7, 0.9)
]
_SHOULDER = np.array([0.1, -0.2, 1.4]) + 0.01 * np.sin(2 * _time)[:, None] * [1.0, 0.5, 0.2]
_links = [turn.apply([length, 0.0, 0.0]) for turn, length in zip(_turns, (0.3, 0.25, 0.08), strict=True)]
ARM = np.cumsum(np.stack([_SHOULDER, *_links]), axis=0).transpose(1, 0, 2)
"""Where the arm is, shape (T, 4, 3) [m], z up."""
HAND = _turns[2]
"""How the hand is turned, z up."""
SEEN = ARM.copy()
SEEN[HIDDEN, 1] = np.nan
_Y_UP = Rotation.from_matrix([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # (x, y, z) with z up is (x, z, -y) with y up


@dataclass(frozen=True)
class Made:
    """A recording of the arm.

    Attributes:
        name: Of the file.
        form: What the format calls itself, or the beginning of it.
        write: Gives the content.
        units: Unit of length that the file states; None where it states none.
        points: What each of the four points is called; None where the file lacks it.
        turned: What has the hand's orientation; None where nothing has.
        gap: Whether the elbow has a gap.
        digits: How exact the numbers are [m].
        text: Whether it is text in an encoding of any kind.
    """

    name: str
    form: str
    write: Callable[[], bytes]
    units: str | None = "mm"
    points: tuple[str | None, ...] = NAMES
    turned: str | None = None
    gap: bool = True
    digits: float = 1e-6
    text: bool = True


def _cells(values: np.ndarray, digits: int = 3, hidden: str = "") -> list[str]:
    return [hidden if np.isnan(value) else f"{value:.{digits}f}" for value in np.ravel(values)]


def _y_up(positions: np.ndarray) -> np.ndarray:
    return _Y_UP.apply(positions.reshape(-1, 3)).reshape(positions.shape)


def _lines(rows: list, mark: str, end: str = "\r\n") -> bytes:
    return "".join((row if isinstance(row, str) else mark.join(row)) + end for row in rows).encode()


def trc() -> bytes:
    """TRC, in mm with y up."""
    keys = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame OrigNumFrames"
    rows = [["PathFileType", "4", "(X/Y/Z)", "arm.trc"], keys.split()]
    rows += [f"{RATE}\t{RATE}\t{FRAMES}\t4\tmm\t{RATE}\t1\t{FRAMES}"]
    rows += [["Frame#", "Time", *(cell for name in NAMES for cell in (name, "", ""))]]
    rows += [["", "", *(f"{axis}{i}" for i in (1, 2, 3, 4) for axis in "XYZ")], ""]
    rows += [[str(i + 1), f"{_time[i]:.5f}", *_cells(row)] for i, row in enumerate(1000 * _y_up(SEEN))]
    return _lines(rows, "\t", "\n")


def vicon() -> bytes:
    """Vicon Nexus CSV, in mm with z up, with a block of model outputs above the trajectories."""
    rows = ["Model Outputs", "50", ",,S:RElbowAngles,,", "Frame,Sub Frame,X,Y,Z", ",,deg,deg,deg", "1,0,10,20,30", ""]
    rows += ["Trajectories", "50", ",," + ",,,".join(f"S:{name}" for name in NAMES) + ",,"]
    rows += ["Frame,Sub Frame" + ",X,Y,Z" * 4, "," + ",mm" * 12]
    rows += [[str(i + 1), "0", *_cells(row)] for i, row in enumerate(1000 * SEEN)]
    return _lines(rows, ",")


def qualisys() -> bytes:
    """Qualisys TSV of markers."""
    head = _qualisys("3D", ["NO_OF_MARKERS", "4"], ["MARKER_NAMES", *NAMES], ["TRAJECTORY_TYPES", *["Measured"] * 4])
    columns = ["Frame", "Time", *(f"{name} {axis}" for name in NAMES for axis in "XYZ")]
    rows = [[str(i + 1), f"{_time[i]:.5f}", *_cells(row, hidden="nan")] for i, row in enumerate(1000 * SEEN)]
    return _lines([*head, columns, *rows], "\t")


def qualisys_6d() -> bytes:
    """Qualisys TSV of one rigid body: position, angles, residual, matrix column by column."""
    head = _qualisys("6D", ["NO_OF_BODIES", "1"], ["BODY_NAMES", "hand"])
    columns = ["hand X", "Y", "Z", "Roll", "Pitch", "Yaw", "Residual", *(f"Rot[{i}]" for i in range(9))]
    angles, matrices = HAND.as_euler("xyz", degrees=True), HAND.as_matrix().transpose(0, 2, 1).reshape(FRAMES, 9)
    table = np.hstack([1000 * ARM[:, 3], angles, np.full((FRAMES, 1), 0.4), matrices])
    rows = [[str(i + 1), f"{_time[i]:.5f}", *_cells(row, 6)] for i, row in enumerate(table)]
    return _lines([*head, ["Frame", "Time", *columns], *rows], "\t")


def _qualisys(included: str, *more: list[str]) -> list[list[str]]:
    rows = [["NO_OF_FRAMES", str(FRAMES)], ["NO_OF_CAMERAS", "8"], ["FREQUENCY", "50"], ["NO_OF_ANALOG", "0"]]
    return [*rows, ["TIME_STAMP", "2019-09-18, 16:30:02"], ["DATA_INCLUDED", included], *more]


def motive(version: str, kind: str = "Rigid Body", rotation: str = "Quaternion") -> bytes:
    """OptiTrack Motive CSV, in m with y up: the hand as a body or bone, the points as markers."""
    turned = (_Y_UP * HAND).as_quat()
    items = [motive_files.Item(kind, "Hand", _y_up(ARM[:, 3]), turned)]
    items += [motive_files.Item("Marker", name, _y_up(ARM[:, i])) for i, name in enumerate(NAMES)]
    hidden = {("elbow", frame) for frame in range(FRAMES)[HIDDEN]}
    text = motive_files.motive_text(items, version, rate=RATE, rotation=rotation, hidden=hidden, end="\r\n")
    return (("\ufeff" if version == "1.25" else "") + text).encode()


def bvh() -> bytes:
    """BVH in cm with y up, no gap, as angles have none."""
    channels = "Zrotation Yrotation Xrotation"
    hand = Joint("RightHand", (25.0, 0.0, 0.0), channels, [(8.0, 0.0, 0.0)])
    forearm = Joint("RightForeArm", (30.0, 0.0, 0.0), channels, [hand])
    root = Joint("RightArm", (0.0, 0.0, 0.0), f"Xposition Yposition Zposition {channels}", [forearm])
    above = [_Y_UP * turn for turn in _turns]
    local = [above[0], above[0].inv() * above[1], above[1].inv() * above[2]]
    table = np.hstack([100 * _y_up(_SHOULDER), *(turn.as_euler("ZYX", degrees=True) for turn in local)])
    return bvh_text([root], table, step=f"{1 / RATE:g}").encode()


def bone() -> bytes:
    """The hand alone: position, quaternion, times."""
    table = np.hstack([_time[:, None], ARM[:, 3], HAND.as_quat()])
    return _lines(["time,x,y,z,qx,qy,qz,qw", *(_cells(row, 9) for row in table)], ",", "\n")


def plain() -> bytes:
    """Plain CSV."""
    head = ["time", *(f"{name}_{axis}" for name in NAMES for axis in "xyz"), *(f"hand_q{axis}" for axis in "xyzw")]
    rows = [_cells(row, 9) for row in np.hstack([_time[:, None], SEEN.reshape(FRAMES, 12), HAND.as_quat()])]
    return _lines([head, *rows], ",", "\n")


def c3d(**how: object) -> bytes:
    """C3D in mm with z up; a marker that is not seen has a negative residual."""
    groups = {"POINT": {"LABELS": [f"S:{name}" for name in NAMES], "X_SCREEN": "+X", "Y_SCREEN": "+Z"}}
    groups["TRIAL"] = {"ACTUAL_START_FIELD": [1, 0], "ACTUAL_END_FIELD": [FRAMES, 0]}
    residual = np.where(np.isnan(SEEN[..., 0]), -1.0, 0.5)
    return c3d_bytes(np.nan_to_num(1000 * SEEN), residual=residual, rate=RATE, groups=groups, **how)


def c3d_poses() -> bytes:
    """C3D of a big-endian machine with the hand's pose, whose last offset is little-endian."""
    pose = np.tile(np.eye(4), (FRAMES, 1, 1, 1, 1))
    pose[:, 0, 0, :3, :3], pose[:, 0, 0, :3, 3] = HAND.as_matrix(), 1000 * ARM[:, 3]
    content = c3d(rotations=pose, processor=MIPS)
    at = content.rindex(b"LABELS") + 6  # of the last group, ROTATION
    return content[:at] + content[at : at + 2][::-1] + content[at + 2 :]


def vicon_segments() -> bytes:
    """Segments of Vicon Nexus: the arm's as bodies, turned by helical angles in degrees."""
    vectors = np.degrees(HAND.as_rotvec())
    rows = ["Segments", "50", ",," + ",,,,,,".join(f"S:{name}" for name in NAMES) + ",,,,,"]
    rows += ["Frame,Sub Frame" + ",RX,RY,RZ,TX,TY,TZ" * 4, "," + ",deg,deg,deg,mm,mm,mm" * 4]
    for i in range(FRAMES):
        cells = [cell for place in 1000 * SEEN[i] for cell in _cells([*(vectors[i] + 0 * place[0]), *place], 6)]
        rows.append([str(i + 1), "0", *cells])
    return _lines(rows, ",")


def qualisys_skeleton() -> bytes:
    """A skeleton of Qualisys: a place and a quaternion for each segment, its name in a column of its own."""
    rows = [["NO_OF_FRAMES", str(FRAMES)], ["FREQUENCY", "50"], ["REFERENCE", "GLOBAL"], ["SCALE", "1.00000"]]
    rows += [["Frame", "Time", *(cell for name in NAMES for cell in (name, *"XYZ", "QX", "QY", "QZ", "QW"))]]
    for i in range(FRAMES):
        table = [np.concatenate([1000 * SEEN[i, k], HAND.as_quat()[i] + 0 * SEEN[i, k, 0]]) for k in range(4)]
        rows.append([str(i + 1), f"{_time[i]:.5f}", *(cell for each in table for cell in ("", *_cells(each, 9)))])
    return _lines(rows, "\t")


def storage() -> bytes:
    """OpenSim storage of body positions, in m with y up, with angles beside them."""
    rows = ["Positions", "version=1", f"nRows={FRAMES}", "nColumns=17", "inDegrees=no", "", "endheader"]
    rows += [["time", *(f"{name}_{axis}" for name in NAMES for axis in "XYZ"), "hand_Ox", "hand_Oy", "hand_Oz"]]
    for i, row in enumerate(_y_up(SEEN)):
        rows.append([f"{_time[i]:.8f}", *_cells(row, 8, "nan"), "0.1", "0.2", "0.3"])
    return _lines(rows, "\t", "\n")


def mvnx() -> bytes:
    """Xsens MVNX, in m with z up, after a pose for calibration."""
    labels = ("RightUpperArm", "RightForeArm", "RightHand", "RightToe")
    turned = HAND.as_quat()[:, [3, 0, 1, 2]]
    head = f'<?xml version="1.0"?>\n<mvnx version="4"><subject frameRate="{RATE:g}" segmentCount="4"><segments>'
    rows = [head + "".join(f'<segment label="{label}" id="{i + 1}"/>' for i, label in enumerate(labels))]
    rows += ['</segments><frames><frame type="tpose"><position>' + "0 " * 12 + "</position></frame>"]
    for i in range(FRAMES):
        turns = " ".join(_cells([*np.tile([1.0, 0, 0, 0], 2), *turned[i], 1.0, 0, 0, 0], 8))
        places = " ".join(_cells(ARM[i], 8))
        rows.append(
            f'<frame time="{round(1000 * _time[i])}" index="{i}" type="normal"><orientation>{turns}</orientation>'
            f"<position>{places}</position></frame>"
        )
    return _lines([*rows, "</frames></subject></mvnx>"], "", "\n")


def npz() -> bytes:
    """NumPy arrays by name."""
    stream = io.BytesIO()
    np.savez(stream, positions=SEEN, names=np.array(NAMES), rate=RATE, units="m", up="z")
    return stream.getvalue()


def _camera(positions: np.ndarray) -> np.ndarray:
    """Places in a camera's axes: x right, y down, z ahead."""
    return _y_up(positions) * [1.0, -1.0, -1.0]


_LANDMARKS = ("right_shoulder", "right_elbow", "right_wrist", "right_index")
_POSED = np.stack([*_camera(ARM).transpose(1, 0, 2), *np.tile([[[-0.1, 0, 0]], [[0.1, 0, 0]]], (1, FRAMES, 1))], axis=1)
_POSED_NAMES = (*_LANDMARKS, "right_hip", "left_hip")
_VISIBLE = np.where(np.isnan(SEEN[..., 0]), 0.1, 0.9)


def _sight(frame: int, index: int) -> float:
    return float(_VISIBLE[frame, index]) if index < 4 else 1.0


def mediapipe() -> bytes:
    """MediaPipe's world landmarks in wide form, without times."""
    rows = [["frame", *(f"{name}_{part}" for name in _POSED_NAMES for part in ("x", "y", "z", "visibility"))]]
    for i in range(FRAMES):
        cells = [cell for k in range(6) for cell in _cells([*_POSED[i, k], _sight(i, k)], 8)]
        rows.append([str(i), *cells])
    return _lines(rows, ",", "\n")


def mediapipe_long() -> bytes:
    """The same with a line for each landmark, by its number, and times in ms."""
    rows = ["frame,timestamp_ms,landmark_id,x,y,z,visibility"]
    numbers = [MEDIAPIPE.index(name) for name in _POSED_NAMES]
    for i in range(FRAMES):
        for k, number in enumerate(numbers):
            rows.append([str(i), f"{1000 * _time[i]:.3f}", str(number), *_cells([*_POSED[i, k], _sight(i, k)], 8)])
    return _lines(rows, ",", "\n")


def mediapipe_json() -> bytes:
    """The same as JSON, all 33 landmarks."""
    frames = []
    for i in range(FRAMES):
        marks = [{"x": 0.0, "y": 0.0, "z": 0.0, "visibility": 0.0} for _ in MEDIAPIPE]
        for k, name in enumerate(_POSED_NAMES):
            place = dict(zip("xyz", _POSED[i, k].tolist(), strict=True))
            marks[MEDIAPIPE.index(name)] = {**place, "visibility": _sight(i, k)}
        frames.append({"timestamp": round(_time[i], 6), "pose_world_landmarks": [marks]})
    return json.dumps(frames).encode()


def freemocap() -> bytes:
    """FreeMoCap's body, in mm with z up, without times; the left arm was never seen."""
    left = ("left_shoulder", "left_elbow", "left_wrist", "nose")
    rows = [[f"{name}_{axis}" for name in (*_LANDMARKS, *left) for axis in "xyz"]]
    rows += [[*_cells(row), *[""] * 12] for row in 1000 * SEEN]
    return _lines(rows, ",", "\n")


def rokoko() -> bytes:
    """Rokoko Studio, in m with y up, with an angle beside the segments."""
    names = ("RightUpperArm", "RightForeArm", "RightHand", "RightDigit3Middle")
    parts = [f"{name}_position_{axis}" for name in names for axis in "xyz"]
    rows = [["Timestamp", *parts, *(f"RightHand_rotation_{axis}" for axis in "xyzw"), "RightElbow_flexion"]]
    turned = (_Y_UP * HAND).as_quat()
    rows += [[f"{_time[i]:.5f}", *_cells(row, 8), *_cells(turned[i], 8), "12.5"] for i, row in enumerate(_y_up(ARM))]
    return _lines(rows, ",")


def tracker() -> bytes:
    """A logger's table, separated by semicolons with decimal commas, times in ms and lengths in mm."""
    places = [f"{name} {axis} (mm)" for name in NAMES for axis in "xyz"]
    rows = [["Time (ms)", *places, *(f"hand.q{axis}" for axis in "wxyz")]]
    turned = HAND.as_quat()[:, [3, 0, 1, 2]]
    for i, row in enumerate(1000 * SEEN):
        cells = [f"{1000 * _time[i]:.3f}", *_cells(row), *_cells(turned[i], 8)]
        rows.append([cell.replace(".", ",") for cell in cells])
    return _lines(rows, ";")


def coco() -> bytes:
    """3D keypoints in the manner of COCO, of MMPose: lists in lists, scores, in m with z up."""
    people = []
    for i in range(FRAMES):
        places, scores = np.zeros((17, 3)), np.zeros(17)
        for k, index in enumerate((6, 8, 10)):  # RShoulder, RElbow, RWrist
            places[index], scores[index] = ARM[i, k], _VISIBLE[i, k]
        person = {"keypoints": places.tolist(), "keypoint_scores": scores.tolist()}
        people.append({"frame_id": i, "instances": [person]})
    return json.dumps({"meta_info": {"dataset_name": "coco"}, "instance_info": people}).encode()


def openpose() -> bytes:
    """Frames of OpenPose in one list; it writes each into a file of its own."""
    frames = []
    for i in range(FRAMES):
        table = np.zeros((25, 4))
        for k, index in enumerate((2, 3, 4)):  # RShoulder, RElbow, RWrist
            table[index] = [*ARM[i, k], _VISIBLE[i, k]]
        frames.append({"version": 1.3, "people": [{"person_id": [-1], "pose_keypoints_3d": table.ravel().tolist()}]})
    return json.dumps(frames).encode()


def zed() -> bytes:
    """Body tracking of a ZED, 38 points, in m with z up, what was not seen at zero; a second body now and then."""
    frames = {}
    for i in range(FRAMES):
        places = np.zeros((38, 3))
        for k, index in enumerate((13, 15, 17, 35)):  # shoulder, elbow, wrist, middle finger of the right
            places[index] = np.nan_to_num(SEEN[i, k])
        body = {
            "id": 3,
            "keypoint": places.tolist(),
            "keypoint_confidence": np.where(places.any(axis=1), 90, 0).tolist(),
        }
        other = {**body, "id": 7, "keypoint": (places + 1).tolist()}
        time = 1_700_000_000_000_000_000 + round(1e9 * _time[i])
        frames[str(time)] = {"is_new": True, "timestamp": time, "body_list": [other, body] if i < 5 else [body]}
    return json.dumps(frames).encode()


def kinect() -> bytes:
    """Body tracking of an Azure Kinect, in mm in the camera's axes."""
    frames = []
    turned = (Rotation.from_euler("x", 180, degrees=True) * _Y_UP * HAND).as_quat()[:, [3, 0, 1, 2]]
    for i in range(FRAMES):
        places, levels, turns = np.zeros((32, 3)), np.zeros(32), np.tile([1.0, 0, 0, 0], (32, 1))
        for k, index in enumerate((12, 13, 14, 15)):
            places[index] = 1000 * _camera(ARM)[i, k]
            levels[index] = 1 if np.isnan(SEEN[i, k, 0]) else 2
        turns[15] = turned[i]
        body = {"body_id": 1, "joint_positions": places.tolist(), "joint_orientations": turns.tolist()}
        body |= {"confidence_levels": levels.tolist()}
        frames.append({"bodies": [body], "frame_id": i, "timestamp_usec": round(1e6 * _time[i]), "num_bodies": 1})
    return json.dumps({"bone_list": [], "frames": frames, "joint_names": AZURE_KINECT}).encode()


_SUBJECT = tuple(f"S:{name}" for name in NAMES)
_BONES = ("RightArm", "RightForeArm", "RightHand", "RightHand (end)")
_ROKOKO = ("RightUpperArm", "RightForeArm", "RightHand", "RightDigit3Middle")
_SUIT = ("RightUpperArm", "RightForeArm", "RightHand", "RightToe")
_COCO = ("RShoulder", "RElbow", "RWrist", None)
_ZED = ("RIGHT_SHOULDER", "RIGHT_ELBOW", "RIGHT_WRIST", "RIGHT_HAND_MIDDLE_4")
_KINECT = ("SHOULDER_RIGHT", "ELBOW_RIGHT", "WRIST_RIGHT", "HAND_RIGHT")
_HAND_ALONE = (None, None, None, "hand")
MADE = (
    Made("arm.c3d", "C3D", lambda: c3d(analog=np.ones((FRAMES, 4, 2))), points=_SUBJECT, text=False),
    Made("arm_vax.c3d", "C3D", lambda: c3d(scale=0.1, processor=DEC), points=_SUBJECT, digits=6e-5, text=False),
    Made("arm_poses.c3d", "C3D", c3d_poses, points=_SUBJECT, turned="s0", text=False),
    Made("arm.trc", "TRC", trc),
    Made("arm_motive_121.csv", "OptiTrack Motive CSV 1.21", lambda: motive("1.21"), "m", turned="Hand"),
    Made("arm_motive_123.csv", "OptiTrack Motive CSV 1.23", lambda: motive("1.23", rotation="XYZ"), "m", turned="Hand"),
    Made("arm_motive_125.csv", "OptiTrack Motive CSV 1.25", lambda: motive("1.25", "Bone"), "m", turned="Hand"),
    Made("arm_vicon.csv", "Vicon Nexus CSV", vicon, points=_SUBJECT),
    Made("arm_qualisys.tsv", "Qualisys TSV 3D", qualisys),
    Made("arm_qualisys_6d.tsv", "Qualisys TSV 6D", qualisys_6d, points=_HAND_ALONE, turned="hand", gap=False),
    Made("arm.bvh", "BVH", bvh, None, points=_BONES, turned="RightHand", gap=False),
    Made("hand.csv", "bone CSV", bone, None, points=_HAND_ALONE, turned="hand", gap=False, digits=1e-9),
    Made("arm_segments.csv", "Vicon Segments CSV", vicon_segments, points=_SUBJECT, turned="S:hand"),
    Made("arm_skeleton.tsv", "Qualisys skeleton TSV", qualisys_skeleton, turned="hand"),
    Made("arm.sto", "OpenSim storage", storage, "m", digits=1e-7),
    Made("arm.mvnx", "Xsens MVNX", mvnx, "m", points=_SUIT, turned="RightHand", gap=False, digits=1e-7, text=False),
    Made("arm.npz", "NumPy NPZ", npz, "m", text=False),
    Made("arm_mediapipe.csv", "MediaPipe landmarks", mediapipe, "m", points=_LANDMARKS, digits=1e-7),
    Made("arm_mediapipe_long.csv", "MediaPipe landmarks", mediapipe_long, "m", points=_LANDMARKS, text=False),
    Made("arm_mediapipe.json", "MediaPipe landmarks", mediapipe_json, "m", points=_LANDMARKS, text=False),
    Made("arm_freemocap.csv", "FreeMoCap CSV", freemocap, None, points=_LANDMARKS),
    Made("arm_rokoko.csv", "Rokoko CSV", rokoko, "m", points=_ROKOKO, turned="RightHand", gap=False, digits=1e-7),
    Made("arm_tracker.csv", "tracker CSV", tracker, turned="hand"),
    Made("arm_coco.json", "COCO keypoints JSON", coco, None, points=_COCO, text=False),
    Made("arm_openpose.json", "OpenPose JSON", openpose, None, points=_COCO, text=False),
    Made("arm_zed.json", "body tracking JSON of a ZED", zed, None, points=_ZED, text=False),
    Made(
        "arm_kinect.json",
        "body tracking JSON of an Azure Kinect",
        kinect,
        "mm",
        points=_KINECT,
        turned="HAND_RIGHT",
        text=False,
    ),
    Made("arm.csv", "plain CSV", plain, "m", turned="hand", digits=1e-9),
)


def by_name() -> dict[str, Made]:
    """Every recording by the name of its file."""
    return {made.name: made for made in MADE}


if __name__ == "__main__":
    DATA.mkdir(parents=True, exist_ok=True)
    for made in MADE:
        (DATA / made.name).write_bytes(made.write())

"""The two example recordings: their generator repeats itself, and what they show is a person's arm doing the job."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from armdesign.demonstration.files.readers import read_recording

Array = NDArray[np.float64]

EXAMPLES = Path(__file__).parents[2] / "examples"
SCENES = ("packaging", "welding")
LIMBS = (("EPICL", "EPICM"), ("STYLR", "STYLU"), ("MCP2", "MCP5"))
BANDS = ("shoulder", "upper_arm", "forearm", "hand")


def load_generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_recordings", EXAMPLES / "make_recordings.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


generator = load_generator()


def header(scene: str) -> list[str]:
    return (EXAMPLES / f"{scene}.csv").read_text(encoding="ascii").splitlines()[0].split(",")


def table(scene: str) -> Array:
    return np.genfromtxt(EXAMPLES / f"{scene}.csv", delimiter=",", skip_header=1)


def band(scene: str, name: str) -> Array:
    first = header(scene).index(f"{name}_x")
    return table(scene)[:, first : first + 3]


def orientation() -> Rotation:
    return Rotation.from_quat(table("welding")[:, -4:])


def path_length(points: Array) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def true_motion(scene: str) -> tuple[Array, dict[str, Array], Rotation]:
    """Joint angles, points in the world and hand orientation without sway or noise."""
    t = generator.STEP * np.arange(generator.FRAMES[scene])
    shoulder = np.tile(generator.SHOULDER, (len(t), 1))
    q = generator.packaging_angles(t) if scene == "packaging" else generator.welding_angles(t, shoulder)
    points, hand = generator.arm_points(q)
    return q, {name: value + shoulder for name, value in points.items()}, hand


def along_arm(points: dict[str, Array], first: str, pieces: int = 20) -> Array:
    """Points on the arm from the joint `first` to the fingertips, (T, k, 3)."""
    points = {**points, "fingertips": points["wrist"] + 2.1 * (points["hand"] - points["wrist"])}
    names = ["shoulder", "elbow", "wrist", "fingertips"]
    corners = [points[name] for name in names[names.index(first) :]]
    share = np.linspace(0.0, 1.0, pieces)[:, None]
    limbs = [a[:, None] + share * (b - a)[:, None] for a, b in pairwise(corners)]
    return np.concatenate(limbs, axis=1)


def distance_to_box(points: Array, box: Array) -> Array:
    return np.asarray(np.linalg.norm(points - np.clip(points, box[0], box[1]), axis=-1))


# The generator


def test_regenerating_gives_the_same_bytes(tmp_path: Path) -> None:
    script = str(EXAMPLES / "make_recordings.py")
    subprocess.run([sys.executable, script, "--out", str(tmp_path / "new")], check=True, capture_output=True)
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == ["packaging.csv", "welding.csv"]
    for scene in SCENES:
        assert (tmp_path / "new" / f"{scene}.csv").read_bytes() == (EXAMPLES / f"{scene}.csv").read_bytes()


def test_box_lift_is_made_again_byte_for_byte_and_its_arm_is_known_by_its_names(tmp_path: Path) -> None:
    again = tmp_path / "again.c3d"
    script = str(EXAMPLES / "make_box_lift.py")
    subprocess.run([sys.executable, script, "--out", str(again)], check=True, capture_output=True)
    assert again.read_bytes() == (EXAMPLES / "box_lift.c3d").read_bytes()
    recording = read_recording(again)
    assert [name for name, p in recording.points.items() if np.isnan(p).any()] == ["MCP5"]
    middle = {pair: (recording.points[pair[0]] + recording.points[pair[1]]) / 2 for pair in LIMBS}
    lengths = [np.linalg.norm(b - a, axis=1) for a, b in pairwise(middle.values())]
    for length, expected in zip(lengths, (0.26, 0.08), strict=True):
        np.testing.assert_allclose(length[np.isfinite(length)], expected, atol=0.003)
    np.testing.assert_allclose(recording.points["ACR"].mean(axis=0), generator.SHOULDER, atol=0.003)


def test_inverse_kinematics_undoes_forward_kinematics() -> None:
    rng = np.random.default_rng(0)
    low, high = np.radians(np.array(list(generator.JOINT_LIMITS.values()), dtype=float)).T
    low[3], low[0], high[0] = 0.2, -0.3, 1.2  # an elbow that bends, and Euler angles short of their singularity
    q = rng.uniform(low, high, (200, 7))
    q[:, 1] = np.clip(q[:, 1], -1.2, 1.2)
    points, hand = generator.arm_points(q)
    axis = generator.unit(points["wrist"])
    down = generator.unit(axis[:, 2:] * axis - [0.0, 0.0, 1.0])
    swivel = np.arctan2(np.sum(points["elbow"] * np.cross(down, axis), axis=1), np.sum(points["elbow"] * down, axis=1))
    np.testing.assert_allclose(generator.joint_angles(points["hand"], hand, swivel), q, atol=1e-7)


def test_minimum_jerk_is_the_quintic_of_flash_and_hogan() -> None:
    t = np.linspace(0.0, 2.0, 21)
    s = t / 2.0
    np.testing.assert_allclose(
        generator.minimum_jerk([0.0, 2.0], [1.0, 4.0], t), 1.0 + 3.0 * (10 * s**3 - 15 * s**4 + 6 * s**5), atol=1e-12
    )


def test_hanging_arm_has_the_world_frame() -> None:
    points, hand = generator.arm_points(np.zeros((1, 7)))
    np.testing.assert_allclose(points["hand"], [[0.0, 0.0, -0.64]], atol=1e-12)
    np.testing.assert_allclose(hand.as_matrix()[0], np.eye(3), atol=1e-12)


@pytest.mark.parametrize(
    ("joint", "hand_goes"),
    [
        ("shoulder flexion", [1.0, 0.0, 0.0]),
        ("shoulder abduction", [0.0, -1.0, 0.0]),
        ("elbow flexion", [1.0, 0.0, 0.0]),
        ("wrist deviation", [1.0, 0.0, 0.0]),
        ("wrist flexion", [0.0, 1.0, 0.0]),
    ],
)
def test_positive_angles_of_the_right_arm_go_the_way_they_are_named(joint: str, hand_goes: list[float]) -> None:
    q = np.zeros((1, 7))
    q[0, list(generator.JOINT_LIMITS).index(joint)] = 0.01
    points, _ = generator.arm_points(q)
    moved = points["hand"][0] - [0.0, 0.0, -0.64]
    np.testing.assert_allclose(generator.unit(moved), hand_goes, atol=0.01)


def test_out_of_reach_and_twisted_arms_are_refused() -> None:
    with pytest.raises(ValueError, match="this arm cannot do that"):
        generator.elbow_position(np.array([[0.0, 0.6, 0.0]]), np.zeros(1))
    with pytest.raises(ValueError, match="elbow flexion is -6 deg in frame 1"):
        generator.check_posture(np.array([np.zeros(7), np.eye(7)[3] * -0.1]))


# The files


@pytest.mark.parametrize("scene", SCENES)
def test_columns_come_from_the_shoulder_to_the_hand(scene: str) -> None:
    expected = ["time", *(f"{name}_{axis}" for name in BANDS for axis in "xyz")]
    if scene == "welding":
        expected += [f"hand_q{axis}" for axis in "xyzw"]
    assert header(scene) == expected


@pytest.mark.parametrize(("scene", "fewest", "most"), [("packaging", 100, 100), ("welding", 100, 150)])
def test_every_cell_is_there(scene: str, fewest: int, most: int) -> None:
    values = table(scene)
    assert fewest <= len(values) <= most
    assert values.shape[1] == len(header(scene))
    assert np.isfinite(values).all()


@pytest.mark.parametrize("scene", SCENES)
def test_time_runs_in_exact_steps_of_20_ms(scene: str) -> None:
    lines = (EXAMPLES / f"{scene}.csv").read_text(encoding="ascii").splitlines()[1:]
    assert [line.split(",")[0] for line in lines] == [f"{k // 50}.{2 * k % 100:02d}" for k in range(len(lines))]


@pytest.mark.parametrize("scene", SCENES)
def test_file_is_the_true_motion_with_noise_and_sway(scene: str) -> None:
    _, points, _ = true_motion(scene)
    for name in BANDS:
        error = np.linalg.norm(band(scene, name) - points[name], axis=1)
        assert 0.0003 < error.mean() < 0.003
        assert error.max() < 0.006


@pytest.mark.parametrize("scene", SCENES)
def test_shoulder_stands_still_but_for_sway(scene: str) -> None:
    assert np.ptp(band(scene, "shoulder"), axis=0).max() < 0.006


# The person


@pytest.mark.parametrize("scene", SCENES)
def test_limbs_keep_their_length(scene: str) -> None:
    _, points, _ = true_motion(scene)
    for a, b, length in (("shoulder", "elbow", 0.30), ("elbow", "wrist", 0.26), ("wrist", "hand", 0.08)):
        np.testing.assert_allclose(np.linalg.norm(points[b] - points[a], axis=1), length, atol=1e-12)
    recorded = np.linalg.norm(band(scene, "upper_arm") - band(scene, "shoulder"), axis=1)
    np.testing.assert_allclose(recorded, 0.15, atol=0.002)


@pytest.mark.parametrize("scene", SCENES)
def test_recorded_bands_lie_on_an_arm(scene: str) -> None:
    shoulder, upper, fore, hand = (band(scene, name) for name in BANDS)
    elbow = 2 * upper - shoulder
    wrist = 2 * fore - elbow
    assert np.std(np.linalg.norm(fore - elbow, axis=1)) < 0.001
    assert np.mean(np.linalg.norm(fore - elbow, axis=1)) == pytest.approx(0.13, abs=0.001)
    assert np.std(np.linalg.norm(hand - wrist, axis=1)) < 0.002
    assert np.mean(np.linalg.norm(hand - wrist, axis=1)) == pytest.approx(0.08, abs=0.001)


@pytest.mark.parametrize("scene", SCENES)
def test_joints_stay_within_a_healthy_arm(scene: str) -> None:
    q, _, _ = true_motion(scene)
    low = np.radians([-60.0, -30.0, -80.0, 0.0, -80.0, -35.0, -60.0])
    high = np.radians([170.0, 120.0, 80.0, 145.0, 80.0, 20.0, 75.0])
    assert (q >= low).all()
    assert (q <= high).all()
    assert np.abs(np.diff(q, axis=0)).max() / generator.STEP < np.radians(200.0)


@pytest.mark.parametrize("scene", SCENES)
def test_hand_moves_at_a_human_pace_and_rests_at_both_ends(scene: str) -> None:
    speed = np.linalg.norm(np.diff(band(scene, "hand"), axis=0), axis=1) / generator.STEP
    assert speed.max() < 2.0
    true_speed = np.linalg.norm(np.diff(true_motion(scene)[1]["hand"], axis=0), axis=1) / generator.STEP
    assert max(true_speed[0], true_speed[-1]) < 0.02


@pytest.mark.parametrize(("scene", "least", "most"), [("packaging", 0.6, 0.9), ("welding", 0.3, 0.4)])
def test_hand_goes_a_long_enough_way(scene: str, least: float, most: float) -> None:
    assert least < path_length(true_motion(scene)[1]["hand"]) < most
    assert path_length(band(scene, "hand")[::5]) > least


@pytest.mark.parametrize("scene", SCENES)
def test_hand_is_within_reach_of_arms_of_0_6_to_1_2_m(scene: str) -> None:
    reach = np.linalg.norm(band(scene, "hand") - band(scene, "shoulder"), axis=1)
    assert reach.max() < 0.6


# Scene I


def test_item_travels_from_the_belt_into_the_carton() -> None:
    _, points, _ = true_motion("packaging")
    hand, times = points["hand"], [row[0] for row in generator.PACKAGING]
    taken, put = (round(times[row] / generator.STEP) for row in (1, 4))
    assert hand[taken, 2] - generator.GRIP_HEIGHT == pytest.approx(generator.BELT_HEIGHT, abs=1e-6)
    assert hand[put, 2] - generator.GRIP_HEIGHT == pytest.approx(generator.CARTON[0, 2], abs=1e-6)
    sideways = hand[put, :2] + np.array([[-1.0], [1.0]]) * generator.ITEM_HALF_WIDTH
    assert (sideways > generator.CARTON[0, :2]).all()
    assert (sideways < generator.CARTON[1, :2]).all()


def widened_obstacle() -> Array:
    """The obstacle, grown sideways by the item's half width: the centre of the item's bottom has to stay outside."""
    half = generator.ITEM_HALF_WIDTH
    return np.asarray(generator.OBSTACLE + np.array([[-half, -half, 0.0], [half, half, 0.0]]))


def test_arm_and_item_clear_the_obstacle() -> None:
    _, points, _ = true_motion("packaging")
    assert distance_to_box(along_arm(points, "shoulder"), generator.OBSTACLE).min() > 0.10
    assert distance_to_box(band("packaging", "hand"), generator.OBSTACLE).min() > 0.10
    bottom = points["hand"] - [0.0, 0.0, generator.GRIP_HEIGHT]
    assert distance_to_box(bottom, widened_obstacle()).min() > 0.03


def test_obstacle_is_in_the_straight_way_of_the_item() -> None:
    taken, put = (np.array(generator.PACKAGING[row][1]) for row in (2, 4))
    share = np.linspace(0.0, 1.0, 200)[:, None]
    bottom = taken + share * (put - taken) - [0.0, 0.0, generator.GRIP_HEIGHT]
    assert distance_to_box(bottom, widened_obstacle()).min() == 0.0


def test_item_enters_the_carton_through_its_opening() -> None:
    _, points, _ = true_motion("packaging")
    low, high = generator.CARTON
    taken = round(generator.PACKAGING[2][0] / generator.STEP)
    bottom = points["hand"][taken:] - [0.0, 0.0, generator.GRIP_HEIGHT]
    beyond_guard = bottom[:, 1] < generator.OBSTACLE[0, 1]
    below_the_rim = bottom[beyond_guard & (bottom[:, 2] < high[2]), :2]
    assert len(below_the_rim) > 0
    assert (below_the_rim > low[:2] + generator.ITEM_HALF_WIDTH).all()
    assert (below_the_rim < high[:2] - generator.ITEM_HALF_WIDTH).all()


def test_hand_and_forearm_enter_the_carton_through_its_opening() -> None:
    _, points, _ = true_motion("packaging")
    low, high = generator.CARTON
    arm = along_arm(points, "elbow")
    inside = ((arm[..., :2] > low[:2]) & (arm[..., :2] < high[:2])).all(axis=-1)
    below_the_rim = arm[..., 2] < high[2]
    assert inside[below_the_rim].all()
    assert below_the_rim.any()


# Scene II


def test_quaternions_are_unit_and_keep_their_sign() -> None:
    quaternions = table("welding")[:, -4:]
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1.0, atol=1e-7)
    assert np.sum(quaternions[1:] * quaternions[:-1], axis=1).min() > 0.999


def test_orientation_follows_the_seam() -> None:
    turned = np.degrees((orientation()[0].inv() * orientation()).magnitude())
    assert 30.0 < turned[-1] < 50.0
    assert turned.max() < 50.0


def test_recorded_z_axis_points_along_the_hand() -> None:
    shoulder, upper, fore, hand = (band("welding", name) for name in BANDS)
    wrist = 2 * fore - (2 * upper - shoulder)
    along = np.sum(generator.unit(hand - wrist) * orientation().apply([0.0, 0.0, 1.0]), axis=1)
    assert np.degrees(np.arccos(along.clip(-1.0, 1.0))).max() < 3.0


def test_torch_tip_stays_on_the_seam() -> None:
    _, points, hand = true_motion("welding")
    share = generator.minimum_jerk(
        2.48 * np.array([0.0, 0.15, 0.85, 1.0]), [0.0, 0.08, 0.92, 1.0], generator.STEP * np.arange(125)
    )
    seam = generator.seam(share)
    tip_in_hand = hand.inv().apply(seam - points["hand"])
    np.testing.assert_allclose(tip_in_hand, np.tile(tip_in_hand[0], (125, 1)), atol=1e-9)
    assert np.linalg.norm(tip_in_hand[0]) == pytest.approx(generator.TORCH, abs=1e-9)
    recorded = band("welding", "hand") + (orientation() * Rotation.from_euler("x", np.pi)).apply(tip_in_hand)
    assert np.linalg.norm(recorded - seam, axis=1).max() < 0.003
    np.testing.assert_allclose(np.linalg.norm(seam - generator.DOME_CENTRE, axis=1), generator.DOME_RADIUS, atol=1e-12)


def test_torch_goes_at_an_even_pace_and_never_back() -> None:
    _, points, hand = true_motion("welding")
    tip = points["hand"] + hand.apply(hand[0].inv().apply(generator.seam(np.zeros(1))[0] - points["hand"][0]))
    speed = np.linalg.norm(np.diff(tip, axis=0), axis=1) / generator.STEP
    middle = speed[30:95]
    assert middle.max() < 1.5 * middle.min()
    assert (np.diff(tip[:, 1]) < 0).all()

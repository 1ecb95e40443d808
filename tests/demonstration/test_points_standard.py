"""Units, up axis and mirror: laws, and what is said about them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from armdesign.demonstration.files.quaternions import rotation_matrices
from armdesign.demonstration.points.handedness import handed_steps
from armdesign.demonstration.points.standard import is_mirrored, mirrored, to_recording, unit_factor
from armdesign.demonstration.points.units_and_up import CMU
from armdesign.demonstration.recording import Step, Take
from armdesign.errors import RecordingError, SettingsError

RNG = np.random.default_rng(3)
TURNS = {
    "x": np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]]),
    "y": np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]),
    "z": np.eye(3),
}


def unit(values):
    return values / np.linalg.norm(values, axis=-1, keepdims=True)


def take(points=None, turns=None, **more):
    points = {"a": RNG.normal(size=(5, 3)), "b": RNG.normal(size=(5, 3))} if points is None else points
    frames = len(next(iter(points.values())))
    given = {"units": "m", "up": "z", "source": "here.c3d", "format": "C3D"} | more
    return Take(np.arange(frames) / 100.0, points, turns or {}, **given)


def arm(length, axis=2):
    """An arm straight down that is so long from shoulder to wrist, standing far from any floor at 0."""
    down = np.zeros(3)
    down[axis] = -length / 2
    start = np.array([10.0, 10.0, 10.0]) * length
    return {name: np.tile(start + i * down, (4, 1)) for i, name in enumerate(("RightArm", "RightForeArm", "RightHand"))}


def sentences(recording):
    return " ".join(step.sentence for step in recording.about.steps)


@pytest.mark.parametrize("axis", "xyz")
def test_the_axis_that_points_up_becomes_z_by_a_proper_rotation(axis):
    turns = {"a": unit(RNG.normal(size=(5, 4)))}
    before = take(turns=turns, up=axis)
    after = to_recording(before)
    T = TURNS[axis]
    assert np.linalg.det(T) == pytest.approx(1.0)
    np.testing.assert_array_equal(T["xyz".index("z"), "xyz".index(axis)], 1.0)
    np.testing.assert_allclose(after.points["b"], before.points["b"] @ T.T, atol=1e-15)
    R = rotation_matrices(after.orientations["a"])
    np.testing.assert_allclose(R, T @ rotation_matrices(turns["a"]), atol=1e-14)


@pytest.mark.parametrize(("units", "factor"), [("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("in", 0.0254), ("0.5", 0.5)])
def test_lengths_become_metres(units, factor):
    before = take(units=None)
    after = to_recording(before, units=units)
    np.testing.assert_allclose(after.points["a"], factor * before.points["a"], rtol=1e-15)
    assert unit_factor(f" {units.upper()} ") == factor


def test_a_finished_recording_in_metres_stays_to_the_last_bit_and_nothing_is_said():
    before = take(captured=False)
    after = to_recording(before)
    assert after.points["a"].tobytes() == before.points["a"].tobytes()
    assert after.about.steps == ()


def test_what_the_file_tells_goes_along():
    step = Step("odd", "Something is odd.")
    after = to_recording(take(rate=100.0, bodies={"c": ("a", "b")}, steps=(step,)))
    about = after.about
    assert (about.format, about.captured, about.rate, about.bodies) == ("C3D", True, 100.0, {"c": ("a", "b")})
    assert [s.name for s in about.steps] == ["odd", "units", "up"]
    assert about.steps[1].details["metres_per_unit"] == 1.0


def test_mirroring_twice_changes_nothing():
    recording = to_recording(take(turns={"a": unit(RNG.normal(size=(5, 4)))}))
    once, twice = mirrored(recording), mirrored(mirrored(recording))
    np.testing.assert_array_equal(twice.points["a"], recording.points["a"])
    np.testing.assert_array_equal(twice.orientations["a"], recording.orientations["a"])
    assert is_mirrored(once)
    assert not is_mirrored(twice)
    assert not is_mirrored(recording)


def test_the_mirror_is_the_plane_of_x_and_z():
    before = to_recording(take(turns={"a": unit(RNG.normal(size=(5, 4)))}))
    after = mirrored(before)
    S = np.diag([1.0, -1.0, 1.0])
    np.testing.assert_array_equal(after.points["b"], before.points["b"] @ S)
    R = rotation_matrices(before.orientations["a"])
    np.testing.assert_allclose(rotation_matrices(after.orientations["a"]), S @ R @ S, atol=1e-14)


@pytest.mark.parametrize("factor", [1.0, 0.01, 0.001, 0.0254, CMU])
def test_the_unit_is_the_one_that_makes_a_human_arm(factor):
    after = to_recording(take(arm(0.55 / factor), units=None, format="BVH"))
    upper = np.linalg.norm(after.points["RightArm"] - after.points["RightForeArm"], axis=1)
    np.testing.assert_allclose(upper, 0.275, rtol=1e-12)
    assert "the file does not say" in sentences(after)


@pytest.mark.parametrize("factor", [1.0, 0.01, 0.001])
def test_without_an_arm_the_extent_tells_the_unit(factor):
    points = {name: values / factor for name, values in arm(0.6).items()}
    after = to_recording(take(dict(zip("abc", points.values(), strict=True)), units=None))
    np.testing.assert_allclose(np.ptp([p[0, 2] for p in after.points.values()]), 0.6)


def test_a_size_that_fits_nothing_asks_for_the_unit():
    with pytest.raises(RecordingError, match=r"here.c3d: .* does not say its unit .* units; allowed: m, cm"):
        to_recording(take(arm(3e6), units=None))
    with pytest.raises(RecordingError, match="Say it with --units"):
        to_recording(take({"a": np.full((5, 3), np.nan)}, units=None))


@pytest.mark.parametrize("units", ["km", "0", "-1", "nan", "inf", ""])
def test_units_that_are_none(units):
    with pytest.raises(SettingsError, match=r"units is '.*'; allowed: m, cm, mm, in, or metres per unit"):
        to_recording(take(), units=units)


def test_an_axis_that_is_none():
    with pytest.raises(SettingsError, match="up is 'w'; allowed: x, y, z"):
        to_recording(take(), up="w")


@pytest.mark.parametrize(
    ("name", "axis"), [("TRC", "y"), ("OptiTrack Motive CSV 1.23", "y"), ("BVH", "y"), ("C3D", "z"), ("Vicon", "z")]
)
def test_where_nothing_tells_the_format_s_custom_counts(name, axis):
    after = to_recording(take(format=name, up=None))
    assert after.about.steps[-1].details["axis"] == axis
    assert f"as is usual for {name}" in sentences(after)


@pytest.mark.parametrize("axis", "xyz")
@pytest.mark.parametrize(
    ("high", "low", "rise"), [("RHEE", "C7", -1.4), ("S:LSHO", "S:LANK", 1.4), ("T1", "ASISr", 0.4)]
)
def test_heads_are_above_feet_and_shoulders_above_the_pelvis(axis, high, low, rise):
    below = RNG.normal(scale=0.01, size=(9, 3)) + 5.0
    above = below.copy()
    above[:, "xyz".index(axis)] += rise
    after = to_recording(take({high: above, low: below}, up=None))
    assert after.about.steps[-1].details["axis"] == axis
    assert "along it" in sentences(after)


def test_what_the_user_says_goes_before_the_file_and_the_file_before_the_data():
    below = np.full((4, 3), 5.0)
    points = {"head": below + np.array([0, 0, 1.5]), "heel": below}
    said = to_recording(take(points, up="y"))
    assert said.about.steps[-1].name == "up-doubt"
    assert "use --up z" in sentences(said)
    assert to_recording(take(points, up="y"), up="x").about.steps[-1].details["axis"] == "x"


def test_an_arm_below_the_floor_stands_on_another_axis():
    hand = np.array([[-0.5, -0.3, 0.9]] * 4) + RNG.normal(scale=0.01, size=(4, 3))
    after = to_recording(
        take({"RHand": hand, "RUArm": hand + np.array([0, 0, 0.4])}, up=None, format="OptiTrack Motive CSV 1.25")
    )
    assert after.about.steps[-1].details["axis"] == "z"
    assert "below 0 along y, although y is usual" in sentences(after)


BODY = {  # of somebody who faces +x, with z up
    "RightShoulder": (0.0, -0.2, 1.4), "LeftShoulder": (0.0, 0.2, 1.4), "RightToe": (0.2, -0.1, 0.0),
    "LeftToe": (0.2, 0.1, 0.0), "RightHeel": (0.0, -0.1, 0.0), "LeftHeel": (0.0, 0.1, 0.0),
}  # fmt: skip


@pytest.mark.parametrize("turn", [0.0, 1.0, 3.0])
def test_people_in_left_handed_axes_are_seen_by_their_feet(turn):
    around = Rotation.from_euler("z", turn).as_matrix()
    points = {name: np.tile(around @ place, (5, 1)) for name, place in BODY.items()}
    mirrored_points = {name: values * [1.0, -1.0, 1.0] for name, values in points.items()}
    assert handed_steps(points) == []
    (step,) = handed_steps(mirrored_points)
    assert "--mirror" in step.sentence
    assert handed_steps({name: points[name] for name in ("RightShoulder", "LeftShoulder")}) == []
    body = Take(np.arange(5) / 100.0, mirrored_points, {}, "take", "TRC", "m", "z")
    assert "handed" in [step.name for step in to_recording(body).about.steps]
    assert "handed" not in [step.name for step in to_recording(body, mirror=True).about.steps]

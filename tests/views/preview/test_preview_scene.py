"""What MeshCat is told: every pose of the animation is the one of Pinocchio or of the recording."""

import numpy as np
import pinocchio as pin
import pytest

from armdesign.demonstration.files.quaternions import rotation_matrices
from armdesign.export.urdf import result_urdf
from armdesign.kinematics.models import arm_model
from armdesign.views.preview.colours import Scale, scale_for
from armdesign.views.preview.human import motion_of
from armdesign.views.preview.preview_scene import build_scene, side_by_side
from armdesign.views.preview.shapes import trace, turns_from_y
from armdesign.views.skeleton import places

TOLERANCE = 1e-6


def tracks(scene):
    """Times and values of the animation by (node, property)."""
    found = {}
    for entry in scene.commands[-1]["animations"]:
        for track in entry["clip"]["tracks"]:
            times = np.frombuffer(track["times"].data, "<f4")
            values = np.frombuffer(track["values"].data, "<f4").reshape(len(times), -1)
            found[entry["path"].removeprefix("/meshcat/"), track["name"]] = times, values
    return found


def still_poses(scene):
    """The last pose each node is given outside the animation."""
    moved = [command for command in scene.commands if command["type"] == "set_transform"]
    return {command["path"].removeprefix("/meshcat/"): np.array(command["matrix"]).reshape(4, 4).T for command in moved}


@pytest.mark.parametrize("dof", [1, 4, 8])
def test_solids_stand_where_pinocchio_has_them_at_every_keyframe(any_run, dof):
    run = any_run(dof, dof)
    scene = build_scene([run])
    moving, still = tracks(scene), still_poses(scene)
    urdf = result_urdf(run)
    model, solids = arm_model(run.table), pin.buildGeomFromUrdfString(
        pin.buildModelFromXML(urdf), urdf, pin.GeometryType.VISUAL
    )  # fmt: skip
    data = model.createData()
    for k, q in enumerate(run.evaluation.path.q):
        pin.forwardKinematics(model, data, q)
        for solid in solids.geometryObjects:
            exact = (data.oMi[solid.parentJoint] * solid.placement).homogeneous
            node = f"design_1/arm/visuals/{solid.name}"
            pose = still[node].copy()
            if (node, ".position") in moving:
                pose[:3, 3] = moving[node, ".position"][1][k]
                pose[:3, :3] = rotation_matrices(moving[node, ".quaternion"][1][k : k + 1].astype(float))[0]
            np.testing.assert_allclose(pose, exact, rtol=0.0, atol=TOLERANCE)


def test_only_the_base_stands_still(any_run):
    scene = build_scene([any_run(3, 4)])
    moving = {node for node, _ in tracks(scene) if "/arm/" in node}
    solids = {node for node in still_poses(scene) if "/arm/visuals/" in node}
    assert {node.split("/")[-1][:4] for node in solids - moving} == {"base"}


def test_times_and_points_are_the_recording_s_own(any_run):
    run = any_run(1, 3, frames=37, duration=1.7)
    scene = build_scene([run])
    assert scene.duration == pytest.approx(1.7)
    for i in range(3):
        times, values = tracks(scene)[f"design_1/demonstrator/point_{i + 1}", ".position"]
        np.testing.assert_allclose(times, run.problem.task.time - 3.0, atol=TOLERANCE)
        np.testing.assert_allclose(values, run.problem.task.P[:, i], atol=TOLERANCE)


def test_rods_reach_from_point_to_place_as_long_as_the_distance(any_run):
    run = any_run(2, 5)
    moving, motion = tracks(build_scene([run])), motion_of(run)
    for i in range(3):
        node = f"design_1/distances/distance_{i + 1}"
        centre, turn, stretch = (moving[node, name][1] for name in (".position", ".quaternion", ".scale"))
        half = rotation_matrices(turn.astype(float))[:, :, 1] * stretch[:, 1:2] / 2.0
        np.testing.assert_allclose(centre - half, motion.points[:, i], atol=TOLERANCE)
        np.testing.assert_allclose(centre + half, motion.places[:, i], atol=TOLERANCE)
        np.testing.assert_allclose(stretch[:, 1], run.evaluation.path.distance[:, i], atol=TOLERANCE)


@pytest.mark.parametrize("dof", [1, 2, 4, 8])
def test_places_are_as_far_from_the_points_as_the_fitness_says(any_run, dof):
    run = any_run(10 + dof, dof)
    motion, path = motion_of(run), run.evaluation.path
    np.testing.assert_allclose(np.linalg.norm(motion.points - motion.places, axis=2), path.distance, atol=1e-9)
    tips = np.array([run.table.frames(q)[-1, :3, 3] for q in path.q])
    np.testing.assert_allclose(motion.tip, tips, atol=1e-12)
    np.testing.assert_allclose(run.table.skeleton(path.q)[:, -1], tips, atol=1e-12)


def test_places_move_along_the_skeleton_at_unit_speed(any_run):
    run = any_run(5, 4)
    q = np.tile(run.evaluation.path.q[0], (1001, 1))
    line = places(run.table, q, np.linspace(0.0, 1.0, 1001)[:, None])[:, 0]
    np.testing.assert_allclose(line[0], 0.0, atol=1e-15)
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    assert steps.max() <= run.table.length / 1000.0 * (1.0 + 1e-9)
    assert np.median(steps) == pytest.approx(run.table.length / 1000.0, rel=1e-9)


def test_orientations_are_shown_where_the_task_has_them(example_runs):
    assert not any("hand_frame" in node for node, _ in tracks(build_scene([example_runs["packaging"]])))
    run = example_runs["welding"]
    moving = tracks(build_scene([run]))
    for name in ("hand_frame", "tool_frame"):
        turns = rotation_matrices(moving[f"design_1/orientations/{name}", ".quaternion"][1].astype(float))
        angle = np.arccos(np.clip((np.einsum("tij,tij->t", turns, run.problem.task.R) - 1.0) / 2.0, -1.0, 1.0))
        allowed = run.evaluation.path.orientation_error if name == "tool_frame" else 0.0
        np.testing.assert_allclose(angle, allowed, atol=2e-3)


def test_designs_keep_apart(any_run):
    runs = [any_run(seed, 3) for seed in range(3)]
    scene = build_scene(runs)
    for left, right in zip(scene.designs, scene.designs[1:], strict=False):
        assert left.bounds[1, 1] < right.bounds[0, 1]
    np.testing.assert_allclose(scene.designs[0].pose[:3, 3], 0.0)
    assert len(side_by_side([scene.designs[0].bounds])) == 1


def test_every_clip_lasts_as_long_as_the_longest_task(any_run):
    scene = build_scene([any_run(0, 2, duration=1.0), any_run(1, 2, duration=2.5)])
    assert {entry["clip"]["duration"] for entry in scene.commands[-1]["animations"]} == {2.5}
    assert scene.duration == pytest.approx(2.5)


def test_colours_go_from_bright_to_dark_and_end_at_a_round_distance():
    lightness = Scale(0.05).rgb(np.linspace(0.0, 0.05, 50)) @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(lightness) < 0.0).all()
    np.testing.assert_array_equal(Scale(0.05).rgb(np.array([0.05])), Scale(0.05).rgb(np.array([9.0])))
    tops = [scale_for(np.array([0.0, largest])).top for largest in (0.0, 0.0011, 0.02, 0.021, 0.05, 0.4, 0.9)]
    np.testing.assert_allclose(tops, [0.001, 0.002, 0.02, 0.05, 0.05, 0.5, 1.0])


def test_turns_take_y_to_any_direction():
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(200, 3))
    directions[:3] = [(0, 1, 0), (0, -1, 0), (1, 0, 0)]
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    turns = turns_from_y(directions)
    np.testing.assert_allclose(rotation_matrices(turns)[:, :, 1], directions, atol=1e-9)
    assert (np.sum(turns[1:] * turns[:-1], axis=1) >= 0.0).all()


def test_traces_keep_to_their_path_and_paths_that_stay_have_none():
    s = np.linspace(0.0, 6.0, 80)
    path = np.stack([np.cos(s), np.sin(s), 0.2 * s], axis=1)
    shape = trace(path, 0.01)
    rings = shape.vertices.reshape(80, -1, 3)
    np.testing.assert_allclose(rings.mean(axis=1), path, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(rings - path[:, None], axis=2), 0.01, atol=1e-6)
    assert trace(np.zeros((5, 3)), 0.01) is None
    there_and_back = np.array([(0.0, 0, 0), (1, 0, 0), (0, 0, 0)])
    assert np.isfinite(trace(there_and_back, 0.01).vertices).all()

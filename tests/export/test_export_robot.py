"""The robot of a finished run: limits that hold its motion, room for it, options that arrive, names made safe."""

from __future__ import annotations

import io
import subprocess
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy
from export_designs import CHECK_URDF, random_robot

from armdesign.bodies.loads import joint_torques
from armdesign.errors import SettingsError
from armdesign.export.joints import narrowed
from armdesign.export.limits import peak_limits
from armdesign.export.mjcf import robot_mjcf
from armdesign.export.options import LimitOptions, RobotOptions, SimulationOptions, TagOptions, assumptions
from armdesign.export.robot_file import finished_robot
from armdesign.export.urdf import result_urdf, robot_urdf
from armdesign.kinematics.motion import smooth_motion
from armdesign.settings import Body

TAGS = RobotOptions(tags=TagOptions(ros2_control="mock", transmissions=True))


def robot_of(finished, options=None):
    return finished_robot(finished.run, options)


def with_task(run, task):
    """The run with another task."""
    demonstration = replace(run.problem.first, task=task)
    return replace(run, problem=replace(run.problem, demonstrations=(demonstration,)))


def test_the_urdf_of_a_run_is_the_default_export(each):
    assert (each.folder / "arm.urdf").read_text() == robot_urdf(robot_of(each))
    assert result_urdf(each.run) == robot_urdf(robot_of(each))


def test_links_that_touch_along_the_demonstration_are_named(each):
    robot = robot_of(each)
    text = robot_urdf(robot)
    model = pin.buildModelFromXML(text)
    shapes = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
    shapes.addAllCollisionPairs()
    data, room = model.createData(), pin.GeometryData(shapes)
    touching = set()
    assert len(shapes.collisionPairs) > 5
    for q in each.run.evaluation.path.q:
        pin.computeCollisions(model, data, shapes, room, q, False)
        hits = [
            pair for pair, hit in zip(shapes.collisionPairs, room.collisionResults, strict=True) if hit.isCollision()
        ]
        touching |= {
            tuple(sorted(shapes.geometryObjects[k].parentJoint for k in (pair.first, pair.second))) for pair in hits
        }
    assert touching == set(robot.touching)
    assert len([note for note in robot.notes if " touch in " in note]) == len(touching)


def test_mujoco_sees_no_contact_along_the_demonstration(each):
    mujoco = pytest.importorskip("mujoco")
    robot = robot_of(each)
    for text in (robot_mjcf(robot), robot_urdf(robot)):
        model = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(model)
        for q in each.run.evaluation.path.q:
            data.qpos[:] = q
            mujoco.mj_forward(model, data)
            assert data.ncon == 0


def test_the_limits_hold_the_motion_with_its_payload(each):
    ideal = SimulationOptions(joint_damping=0.0, joint_armature=0.0)
    limits = LimitOptions(payload=2.0, margin=1.0, velocity_floor=1e-6, effort_floor=1e-6)
    options = RobotOptions(limits=limits, simulation=ideal)
    robot, task, q = robot_of(each, options), each.run.problem.task, each.run.evaluation.path.q
    motion = smooth_motion(task.time, q)
    torque = joint_torques(robot.arm, motion, 2.0)
    np.testing.assert_array_equal(robot.limits.effort, np.abs(torque).max(axis=0))
    np.testing.assert_array_equal(robot.limits.velocity, np.abs(motion.v).max(axis=0))
    np.testing.assert_array_equal(robot.limits.position, each.run.limits)


def test_body_options_reach_mass_and_torque(each):
    heavy = Body(joint_mass=2.0, tube_diameter=0.05, tube_wall=0.01)
    options = LimitOptions(margin=2.0)
    light, loaded = robot_of(each), robot_of(each, RobotOptions(body=heavy, limits=options))
    for one, other in zip(light.bodies[1:], loaded.bodies[1:], strict=True):
        assert other.inertial.mass > one.inertial.mass + 1.39
    moved = [smooth_motion(each.run.problem.task.time, each.run.evaluation.path.q, loaded.arm.limits)]
    _, effort = peak_limits(loaded.arm, moved, RobotOptions(limits=options), each.run.base_pose)
    np.testing.assert_array_equal(loaded.limits.effort, effort)


def test_the_body_is_that_of_the_search_unless_another_is_asked_for(each):
    assert robot_of(each).arm.options == each.run.problem.settings.body
    wide = replace(each.run.problem.settings.body, joint_diameter=0.08)
    assert robot_of(each, RobotOptions(body=wide)).arm.options == wide


def test_limits_are_those_of_the_actuator_or_of_the_task(each):
    limits = robot_of(each).limits
    assert (limits.velocity == np.pi).all()
    assert (limits.effort == 50.0).all()
    settings = each.run.problem.settings.replace({"needs": {"max_speed": [90.0], "max_torque": [30.0]}})
    asked = replace(each.run, problem=replace(each.run.problem, settings=settings))
    limits = finished_robot(asked, RobotOptions(limits=LimitOptions(actuator_speed=400.0, velocity_floor=0.1))).limits
    np.testing.assert_allclose(limits.velocity, np.pi / 2)
    assert (limits.effort == 30.0).all()
    floors = RobotOptions(limits=LimitOptions(velocity_floor=6.0, effort_floor=70.0))
    assert (robot_of(each, floors).limits.velocity == 6.0).all()
    assert (robot_of(each, floors).limits.effort == 70.0).all()


@pytest.mark.parametrize("margin", [1.0, 20.0, 360.0])
def test_narrowed_ranges_hold_the_motion_zero_and_the_margin(each, margin):
    robot, q = robot_of(each, RobotOptions(limits=LimitOptions(narrow_limits=margin))), each.run.evaluation.path.q
    lower, upper = robot.limits.position.T
    room = np.radians(margin)
    assert (lower <= np.minimum(q.min(axis=0), 0)).all()
    assert (upper >= np.maximum(q.max(axis=0), 0)).all()
    assert (lower >= each.run.limits[:, 0]).all()
    assert (upper <= each.run.limits[:, 1]).all()
    assert (lower >= np.minimum(q.min(axis=0) - room, 0) - 1e-15).all()
    assert (upper <= np.maximum(q.max(axis=0) + room, 0) + 1e-15).all()
    if margin == 1.0:
        assert any("reaches to 0" in note for note in robot.notes)


def test_narrowing_by_hand():
    ranges = np.array([[-1.0, 2.0], [-3.0, 3.0], [0.0, 3.0]])
    q = np.array([[-0.9, 1.0, 0.2], [0.5, 2.0, 0.1]])
    np.testing.assert_allclose(narrowed(ranges, q, 0.3), [[-1.0, 0.8], [0.0, 2.3], [0.0, 0.5]])


def test_points_are_named_for_every_reader(finished):
    run = finished["packaging"].run
    odd = replace(run.problem.task, points=("Ellbogen (außen)", "ellbogen auen", "<hand & wrist>"))
    robot = finished_robot(with_task(run, odd))
    assert list(robot.paths) == ["Ellbogen_auen", "ellbogen_auen", "hand_wrist"]
    same = replace(odd, points=("手", "手 ", "P"))
    assert list(finished_robot(with_task(run, same)).paths) == ["point", "point_2", "P"]
    assert ElementTree.fromstring(robot_mjcf(robot)) is not None


@pytest.mark.parametrize("n", [1, 5, 8])
def test_tags_bother_no_reader(n, tmp_path):
    robot, rng = random_robot(n, 1, TAGS)
    text, q = robot_urdf(robot), rng.uniform(*robot.limits.position.T)
    tool = robot.table.frames(q)[-1]
    model = pin.buildModelFromXML(text)
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    np.testing.assert_allclose(data.oMf[model.getFrameId("tool0")].homogeneous, tool, atol=1e-12)
    loaded = yourdfpy.URDF.load(io.BytesIO(text.encode()), load_meshes=False)
    loaded.update_cfg(dict(zip(loaded.actuated_joint_names, q, strict=True)))
    np.testing.assert_allclose(loaded.get_transform("tool0", "base_link"), tool, atol=1e-12)
    if CHECK_URDF is not None:
        path = tmp_path / "arm.urdf"
        path.write_text(text)
        subprocess.run([CHECK_URDF, str(path)], check=True, capture_output=True)


def test_tags_name_every_joint_with_its_limits():
    robot, _ = random_robot(4, 2, TAGS)
    root = ElementTree.fromstring(robot_urdf(robot))
    joints = [f"joint_{i + 1}" for i in range(4)]
    control = root.find("ros2_control")
    assert control.find("hardware/plugin").text == "mock_components/GenericSystem"
    assert [joint.get("name") for joint in control.findall("joint")] == joints
    for joint, bounds, start in zip(control.findall("joint"), robot.limits.position, robot.start, strict=True):
        found = [float(joint.find(f"command_interface/param[@name='{name}']").text) for name in ("min", "max")]
        assert found == bounds.tolist()
        assert float(joint.find("state_interface[@name='position']/param").text) == start
    assert [item.find("joint").get("name") for item in root.findall("transmission")] == joints
    plain = ElementTree.fromstring(robot_urdf(random_robot(4, 2)[0]))
    assert plain.find("ros2_control") is None
    assert plain.find("transmission") is None


@pytest.mark.parametrize(
    ("wanted", "plugin"), [("gazebo", "gz_ros2_control/GazeboSimSystem"), ("my_arm/Hardware", "my_arm/Hardware")]
)
def test_hardware_can_be_named(wanted, plugin):
    options = RobotOptions(tags=TagOptions(ros2_control=wanted))
    root = ElementTree.fromstring(robot_urdf(random_robot(2, 0, options)[0]))
    assert root.find("ros2_control/hardware/plugin").text == plugin


@pytest.mark.parametrize("bad", ["<x/>", "${1+1}", "", "a b", "$(find x)"])
def test_hardware_that_is_no_name_is_refused(bad):
    with pytest.raises(SettingsError, match="ros2_control"):
        TagOptions(ros2_control=bad)


def test_every_assumption_is_told_with_its_flag():
    told = {item.name: item for item in assumptions(RobotOptions(body=Body(joint_mass=0.9)))}
    for section in (Body, LimitOptions, SimulationOptions):
        assert set(section.names()) - {"kind", "modules", "inertials"} <= set(told)
    assert told["joint_mass"].value == 0.9
    assert told["tube_wall"].flag == "--tube-wall"
    assert all(item.doc.endswith(".") for item in told.values())


def test_modules_of_single_joints_are_parts_and_no_assumption():
    told = {item.name for item in assumptions(RobotOptions(body=Body(modules=[(0.05, 0.04, 0.3)])))}
    assert not told & {"modules", "joint_mass", "joint_diameter", "joint_length"}

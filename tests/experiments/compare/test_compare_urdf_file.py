"""URDFs are read as other readers read them, and what is no URDF of an arm is refused in a sentence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from compare_arms import LIMIT, frames_at, urdf

from armdesign.errors import DesignError
from armdesign.experiments.compare.polyline_arm import PolylineChain
from armdesign.experiments.compare.ready_made import CATALOGUE, open_ready_made, robots_folder
from armdesign.experiments.compare.serial_arm import read_arm
from armdesign.experiments.compare.urdf_file import read_urdf

NAMES = [arm.name for arm in CATALOGUE]


def reduced(arm):
    """Pinocchio's own reading of the file, with every joint that is not the arm's held at 0."""
    text = Path(arm.source).read_text().replace('name="gripper" type', 'name="hand" type')  # no joint named as a link
    model = pin.buildModelFromXML(text)
    others = [model.getJointId(name) for name in model.names[1:] if name not in arm.joints]
    return pin.buildReducedModel(model, others, pin.neutral(model))


def as_configuration(model, q):
    """Angles as Pinocchio wants them: cosine and sine for continuous joints."""
    configuration = pin.neutral(model)
    for joint, angle in zip(model.joints[1:], q, strict=True):
        configuration[joint.idx_q : joint.idx_q + joint.nq] = angle if joint.nq == 1 else (np.cos(angle), np.sin(angle))
    return configuration


@pytest.mark.parametrize("name", NAMES)
def test_frames_masses_and_torques_are_those_of_pinocchio(name):
    arm = open_ready_made(name)
    model = reduced(arm)
    data, own = model.createData(), arm.model()
    assert list(model.names)[1:] == list(arm.joints)
    assert arm.moving_mass == pytest.approx(sum(inertia.mass for inertia in model.inertias[1:]), abs=1e-12)
    rng = np.random.default_rng(0)
    turned = None
    for q, v, a in rng.uniform(-2.0, 2.0, (5, 3, arm.dof)):
        configuration = as_configuration(model, q)
        pin.framesForwardKinematics(model, data, configuration)
        found = data.oMf[model.getFrameId(arm.tool, pin.BODY)].homogeneous
        base = found @ np.linalg.inv(frames_at(arm, q)[-1])  # constant: the robot's root to the arm's base
        turned = base if turned is None else turned
        np.testing.assert_allclose(base, turned, atol=1e-9)
        model.gravity.linear = base[:3, :3] @ own.gravity.linear
        expected = pin.rnea(model, data, configuration, v, a)
        np.testing.assert_allclose(pin.rnea(own, own.createData(), q, v, a), expected, atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_limits_are_those_of_the_file(name):
    arm = open_ready_made(name)
    model = reduced(arm)
    for joint, limits in zip(model.joints[1:], arm.limits, strict=True):
        if joint.nq == 2:
            assert np.isinf(limits).all()
        else:
            found = model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]
            np.testing.assert_allclose(limits, found, atol=1e-12)


def test_poses_turn_by_roll_pitch_yaw(tmp_path):
    text = urdf(("j", "continuous", "a", "b", '<origin xyz="1 2 3" rpy="0.3 -0.4 2"/>')).replace(
        '<origin xyz="0 0 0.2"/>', ""
    )
    (tmp_path / "a.urdf").write_text(text)
    pose = read_urdf(tmp_path / "a.urdf").joints["b"].pose
    np.testing.assert_allclose(pose.rotation, pin.rpy.rpyToMatrix(0.3, -0.4, 2.0), atol=1e-15)
    np.testing.assert_allclose(pose.translation, [1, 2, 3])


TWO_PARENTS = urdf(("j1", "revolute", "a", "b"), ("j2", "revolute", "a", "c"), ("loop", "revolute", "c", "b"))
BROKEN = {
    "<robot": "not valid XML",
    "<mujoco/>": "first element is <mujoco>",
    "<!DOCTYPE r><robot/>": "document type definition",
    "<robot name='r'/>": "holds no links",
    "<robot name='r'><link name='a'/></robot>": "0 joints that can turn",
    "<robot xmlns:xacro='http://ros.org/wiki/xacro'><xacro:macro/></robot>": "xacro",
    TWO_PARENTS: "link 'b' hangs on two joints, 'j1' and 'loop'",
    urdf(("j", "revolute", "a", "a")): "every link hangs on another",
    urdf(("j", "revolute", "a", "b"), ("k", "revolute", "c", "c")): "hangs on itself",
    urdf(("j", "revolute", "a", "b"), links=["a", "b", "c"]): "the links 'a', 'c' hang on no joint",
    urdf(("j", "revolute", "a", "b"), links=["a"]): "a link 'b' that is not there",
    urdf(("j", "screw", "a", "b")): "of type 'screw'",
    urdf(("j", "revolute", "a", "b", "<!-- none -->")): "has no limit",
    urdf(("j", "revolute", "a", "b", LIMIT.replace("-2", "2"))): "turns from 2 to 2 rad",
    urdf(("j", "revolute", "a", "b", LIMIT.replace("-2", "low"))): "limit lower is 'low'",
    urdf(("j", "revolute", "a", "b")).replace("0 1 0", "0 0 0"): "axis of no length",
    urdf(("j", "revolute", "a", "b")).replace("0 0 0.2", "0 0 nan"): "origin xyz is '0 0 nan'",
    urdf(("j", "revolute", "a", "b")).replace("0 0 0.2", "0 0"): "3 finite numbers",
    urdf(("j", "revolute", "a", "b")).replace("0 0 0.2", "0 0 0"): "has no length",
    urdf(
        ("slide", "prismatic", "a", "b"), ("j", "revolute", "b", "c")
    ): "joint 'slide', on the way to 'c', is prismatic",
    urdf(("fly", "floating", "a", "b"), ("j", "revolute", "b", "c")): "joint 'fly', on the way to 'c', is floating",
    urdf(*((f"j{i}", "revolute", f"l{i}", f"l{i + 1}") for i in range(11))): "11 joints that can turn",
    urdf(*((f"j{i}", "revolute", f"l{i}", f"l{i + 1}") for i in range(10))): "9 where the first stands away",
    urdf(("j", "revolute", "a", "b"), ("k", "revolute", "b", "c", LIMIT + '<mimic joint="j"/>')): "copies joint 'j'",
    urdf(
        *((f"{arm}{i}", "revolute", f"{arm}{i}" if i else "body", f"{arm}{i + 1}") for arm in "lr" for i in range(4))
    ): ("several arms behind 'body', with 'l1', 'r1'"),
}


@pytest.mark.parametrize("text", BROKEN)
def test_what_is_no_arm_is_refused_in_a_sentence(text, tmp_path):
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    with pytest.raises(DesignError) as caught:
        PolylineChain(read_arm(path))
    assert BROKEN[text] in str(caught.value)
    assert "robot.urdf" in str(caught.value)


def test_a_missing_file_is_said(tmp_path):
    with pytest.raises(DesignError, match=r"cannot read the URDF .*No such file"):
        read_arm(tmp_path / "none.urdf")


def test_meshes_are_not_needed(tmp_path):
    mesh = '<visual><geometry><mesh filename="package://nowhere/none.stl"/></geometry></visual>'
    text = urdf(("j", "revolute", "a", "b"), ("k", "fixed", "b", "tool")).replace(
        'name="a"/>', f'name="a">{mesh}</link>', 1
    )
    (tmp_path / "a.urdf").write_text(text)
    assert read_arm(tmp_path / "a.urdf").tool == "tool"


def test_the_catalogue_is_all_there():
    folder = robots_folder()
    assert folder is not None
    assert [arm.name for arm in CATALOGUE if not (folder / arm.path).is_file()] == []

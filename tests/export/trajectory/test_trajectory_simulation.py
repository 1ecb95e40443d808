"""The exported arm in MuJoCo: its kinematics, its servos' laws, how well it tracks."""

import re
import sys

import numpy as np
import pytest

from armdesign.errors import DesignError, MissingExtraError, SettingsError
from armdesign.export.options import LimitOptions, RobotOptions
from armdesign.export.robot_file import finished_robot
from armdesign.export.trajectory.exporting import TrajectoryOptions
from armdesign.export.trajectory.scaling import timing_of
from armdesign.export.trajectory.simulated_arm import Servo, SimulatedArm
from armdesign.export.trajectory.simulation import simulate
from armdesign.export.trajectory.tool_poses import tool_poses
from armdesign.export.urdf import result_urdf, robot_urdf
from armdesign.kinematics.motion import fit_path

mujoco = pytest.importorskip("mujoco")
STIFF = Servo(frequency=20.0)


def simulated(run, servo, urdf=None):
    path = fit_path(run.problem.task.time, run.evaluation.path.q, run.limits)
    return path, SimulatedArm(urdf or result_urdf(run), path, servo)


def test_a_slow_trajectory_is_tracked_to_a_few_millimetres(run):
    tracking = simulate(run, options=TrajectoryOptions(speed=0.3))
    assert tracking.servo_error.max() < 5e-3
    assert tracking.servo_error.mean() < 4e-3


def test_the_hand_is_followed_as_well_as_the_design_follows_it(run):
    tracking = simulate(run, servo=STIFF, options=TrajectoryOptions(speed=0.5))
    missed = np.linalg.norm(tool_poses(run.table, run.evaluation.path.q)[:, :3, 3] - run.problem.task.P[:, -1], axis=1)
    assert tracking.error.mean() < missed.mean() + 2e-3
    assert tracking.error.max() < missed.max() + 3e-3


def test_errors_are_distances_of_what_is_given(run):
    tracking = simulate(run, servo=STIFF)
    np.testing.assert_allclose(tracking.tip, tool_poses(run.table, tracking.q)[:, :3, 3], atol=1e-12)
    np.testing.assert_allclose(tracking.error, np.linalg.norm(tracking.tip - tracking.target, axis=1), atol=1e-12)
    meant = tool_poses(run.table, tracking.wanted)[:, :3, 3]
    np.testing.assert_allclose(tracking.servo_error, np.linalg.norm(tracking.tip - meant, axis=1), atol=1e-12)


def test_the_target_is_the_demonstrated_hand(run):
    tracking, task = simulate(run, options=TrajectoryOptions(ramp=0.0)), run.problem.task
    np.testing.assert_allclose(tracking.target, task.P[:, -1], atol=1e-6)
    np.testing.assert_allclose(tracking.demonstrated, task.time, atol=1e-9)


def test_the_simulated_arm_has_the_kinematics_of_the_design(run):
    path, arm = simulated(run, Servo())
    for q in path.at(path.time[::20]):
        arm.data.qpos[:] = q
        mujoco.mj_forward(arm.model, arm.data)
        np.testing.assert_allclose(arm.data.body("tool0").xpos, run.table.frames(q)[-1, :3, 3], atol=1e-9)


def test_at_rest_an_arm_sags_by_its_torque_over_its_stiffness(run):
    path, arm = simulated(run, Servo(settling=3.0))
    q, torque = arm.follow(path, timing_of(path))
    kp = arm.model.actuator_gainprm[:, 0]
    np.testing.assert_allclose(path.at(path.start)[None][0] - q[0], torque[0] / kp, rtol=1e-3, atol=1e-6)


def test_stiffness_grows_with_the_square_of_the_frequency_and_sag_falls(run):
    arms = [simulated(run, Servo(frequency=frequency))[1] for frequency in (8.0, 16.0)]
    gains = [arm.model.actuator_gainprm[:, 0] for arm in arms]
    np.testing.assert_allclose(gains[1], 4.0 * gains[0], rtol=1e-12)
    soft, stiff = (
        simulate(run, servo=Servo(frequency=f), options=TrajectoryOptions(speed=0.5)).servo_error.mean()
        for f in (8.0, 16.0)
    )
    assert stiff == pytest.approx(soft / 4.0, rel=0.1)


def test_without_gravity_a_slow_arm_is_where_it_should_be(run):
    tracking = simulate(run, servo=Servo(gravity_compensation=True), options=TrajectoryOptions(speed=0.2, rate=20.0))
    assert tracking.servo_error.max() < 2e-4


def test_a_smaller_step_changes_little(runs):
    coarse, fine = (simulate(runs["welding"], servo=Servo(step=step)) for step in (1e-3, 2.5e-4))
    np.testing.assert_allclose(coarse.tip, fine.tip, atol=2e-4)


def test_torques_keep_the_effort_limits(run):
    weak = robot_urdf(finished_robot(run, RobotOptions(limits=LimitOptions(margin=1.5))))
    tracking = simulate(run, options=TrajectoryOptions(speed=3.0), urdf=weak)
    _, arm = simulated(run, Servo(), weak)
    assert (np.abs(tracking.torque) <= arm.effort * (1 + 1e-9)).all()
    assert tracking.saturated.max() > 0.0


def test_the_notes_state_the_errors(run):
    tracking = simulate(run)
    stated = [float(x) for x in re.findall(r"([\d.]+) mm", tracking.notes[0])]
    errors = [f(e) for e in (tracking.error, tracking.servo_error) for f in (np.mean, np.max)]
    assert stated == pytest.approx(1e3 * np.array(errors), abs=0.051)


def test_links_that_touch_are_named(run):
    tracking = simulate(run)
    links = {"base_link", "tool0", *(f"link_{i + 1}" for i in range(run.table.dof))}
    for pair, share in tracking.touching.items():
        assert set(pair) <= links
        assert 0.0 < share <= 1.0


def test_an_arm_without_such_joints_is_refused(run):
    with pytest.raises(DesignError, match="'joint_1'"):
        simulate(run, urdf=result_urdf(run).replace('"joint_1"', '"elbow"'))


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"frequency": 0.0}, "servo's frequency is 0.0 Hz"),
        ({"frequency": 101.0}, "allowed: 0.1 to 100 Hz"),
        ({"step": 0.0}, "servo's step is 0.0 s"),
        ({"damping": np.nan}, "servo's damping is nan"),
        ({"armature": 0.0}, "servo's armature is 0.0 kg m^2"),
    ],
)
def test_servos_that_cannot_be_are_refused(settings, told):
    with pytest.raises(SettingsError) as caught:
        Servo(**settings)
    assert told in str(caught.value)


def test_without_mujoco_the_pip_line_is_told(runs, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'armdesign\[sim\]'"):
        simulate(runs["packaging"])

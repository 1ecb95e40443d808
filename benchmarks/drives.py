"""Exported arms driven on their exported trajectories in physics engines: how well they follow, saturation, contacts.

    python benchmarks/drives.py RUN... [--export ARGS]

exports each run folder as a user would, loads the files in every engine of MuJoCo, PyBullet, Drake and DART that is
installed, and drives them from the start pose. A line each: largest joint error [deg; mm of joints that slide],
largest tool error [mm], share of the time that a joint is at its effort limit [%], share with a contact [%].
"""

from __future__ import annotations

import argparse
import importlib
import shlex
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from typer.testing import CliRunner

from armdesign.bodies.loads import base_gravity
from armdesign.cli import app
from armdesign.export.trajectory.tool_poses import tool_poses
from armdesign.runs.reading import read_result

STEP = 1e-3
STIFF = 200.0
"""Angular frequency of the control loop in DART [1/s]."""
AT_LIMIT = 0.999
"""Share of the effort limit from which on a joint counts as saturated."""


@dataclass
class Drive:
    """What is driven: a folder of exported files, and the trajectory at every step.

    Attributes:
        folder: The files.
        time: Shape (N,) [s].
        q: Joint positions, shape (N, n) [rad; m].
        v: Joint velocities, shape (N, n).
        base: Where the base stands as a file without world has it: the gravity it feels, shape (3,) [m/s^2].
    """

    folder: Path
    time: np.ndarray
    q: np.ndarray
    v: np.ndarray
    gravity: np.ndarray

    @property
    def names(self) -> list[str]:
        """Names of the joints."""
        return [f"joint_{i + 1}" for i in range(self.q.shape[1])]


@dataclass
class Followed:
    """What an engine did.

    Attributes:
        q: Joint positions at every step, shape (N, n) [rad; m].
        saturated: Share of the steps in which a joint is at its limit.
        touching: Share of the steps with a contact.
    """

    q: np.ndarray
    saturated: float
    touching: float


def in_mujoco(drive: Drive, ahead: bool = False) -> Followed:
    """The MJCF with its own actuators; ``ahead`` adds the lag that the file states times the velocity."""
    mujoco = importlib.import_module("mujoco")
    model = mujoco.MjModel.from_xml_path(str(drive.folder / "arm.xml"))
    data, q = mujoco.MjData(model), np.empty_like(drive.q)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    lag = model.numeric("lag").data if ahead else 0.0
    steps = round(STEP / model.opt.timestep)
    at_limit = touching = 0
    for k in range(len(q)):
        data.ctrl[:] = drive.q[k] + lag * drive.v[k]
        q[k] = data.qpos
        for _ in range(steps):
            mujoco.mj_step(model, data)
        at_limit += bool((np.abs(data.actuator_force) >= AT_LIMIT * model.actuator_forcerange[:, 1]).any())
        touching += data.ncon > 0
    return Followed(q, at_limit / len(q), touching / len(q))


def in_mujoco_ahead(drive: Drive) -> Followed:
    """The same with the velocity fed forward."""
    return in_mujoco(drive, ahead=True)


def in_pybullet(drive: Drive) -> Followed:
    """The URDF with Bullet's motors and self-collision."""
    bullet = importlib.import_module("pybullet")
    client = bullet.connect(bullet.DIRECT)
    bullet.setTimeStep(STEP)
    bullet.setGravity(*drive.gravity)
    flags = bullet.URDF_USE_INERTIA_FROM_FILE | bullet.URDF_USE_SELF_COLLISION
    arm = bullet.loadURDF(str(drive.folder / "arm.urdf"), useFixedBase=True, flags=flags)
    joints = {bullet.getJointInfo(arm, j)[1].decode(): j for j in range(bullet.getNumJoints(arm))}
    order, q = [joints[name] for name in drive.names], np.empty_like(drive.q)
    effort = np.array([bullet.getJointInfo(arm, j)[10] for j in order])
    for j, start in zip(order, drive.q[0], strict=True):
        bullet.resetJointState(arm, j, start)
    at_limit = touching = 0
    for k in range(len(q)):
        q[k] = [state[0] for state in bullet.getJointStates(arm, order)]
        bullet.setJointMotorControlArray(
            arm, order, bullet.POSITION_CONTROL, targetPositions=drive.q[k].tolist(),
            targetVelocities=drive.v[k].tolist(), forces=effort.tolist(), positionGains=[0.5] * len(order),
            velocityGains=[1.0] * len(order),
        )  # fmt: skip
        bullet.stepSimulation()
        forces = np.abs([state[3] for state in bullet.getJointStates(arm, order)])
        at_limit += bool((forces >= AT_LIMIT * effort).any())
        touching += len(bullet.getContactPoints()) > 0
    bullet.disconnect(client)
    return Followed(q, at_limit / len(q), touching / len(q))


def in_drake(drive: Drive) -> Followed:
    """The MJCF in Drake, which takes its actuators' gains and force ranges."""
    parsing, framework = (importlib.import_module(f"pydrake.{name}") for name in ("multibody.parsing", "all"))
    builder = framework.DiagramBuilder()
    plant, _ = framework.AddMultibodyPlantSceneGraph(builder, STEP)
    parsing.Parser(plant).AddModels(str(drive.folder / "arm.xml"))
    plant.mutable_gravity_field().set_gravity_vector(drive.gravity)
    plant.Finalize()
    names = [
        plant.get_joint(plant.get_joint_actuator(i).joint().index()).name() for i in plant.GetJointActuatorIndices()
    ]
    order = [names.index(name) for name in drive.names]
    instance = plant.get_joint_actuator(plant.GetJointActuatorIndices()[0]).model_instance()
    effort = np.array([plant.get_joint_actuator(i).effort_limit() for i in plant.GetJointActuatorIndices()])
    path = np.concatenate([drive.q[:, np.argsort(order)], drive.v[:, np.argsort(order)]], axis=1)
    source = builder.AddSystem(
        framework.TrajectorySource(framework.PiecewisePolynomial.FirstOrderHold(drive.time, path.T))
    )
    builder.Connect(source.get_output_port(), plant.get_desired_state_input_port(instance))
    diagram = builder.Build()
    simulator = framework.Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetPositions(context, drive.q[0])
    q, at_limit, touching = np.empty_like(drive.q), 0, 0
    for k, t in enumerate(drive.time):
        simulator.AdvanceTo(t)
        q[k] = plant.GetPositions(context)
        torque = plant.get_net_actuation_output_port().Eval(context)
        at_limit += bool((np.abs(torque) >= AT_LIMIT * effort).any()) and k > 0
        touching += plant.get_contact_results_output_port().Eval(context).num_point_pair_contacts() > 0
    return Followed(q, at_limit / len(q), touching / len(q))


def in_dart(drive: Drive) -> Followed:
    """The URDF in DART under computed torques, M (w^2 e + 2 w de/dt) + C v + g, cut off at the limits."""
    dart = importlib.import_module("dartpy")
    options = dart.utils.DartLoaderOptions()
    options.mDefaultRootJointType = dart.utils.DartLoaderRootJointType.FIXED
    loader = dart.utils.DartLoader()
    loader.setOptions(options)
    arm, world = loader.parseSkeleton(str(drive.folder / "arm.urdf")), dart.simulation.World()
    world.setTimeStep(STEP)
    world.setGravity(drive.gravity)
    world.addSkeleton(arm)
    arm.enableSelfCollisionCheck()
    arm.disableAdjacentBodyCheck()
    dofs = [arm.getDof(name) for name in drive.names]
    effort = np.array([dof.getForceUpperLimit() for dof in dofs])
    arm.setPositions(drive.q[0])
    q, at_limit, touching = np.empty_like(drive.q), 0, 0
    for k in range(len(q)):
        q[k] = arm.getPositions()
        wanted = STIFF**2 * (drive.q[k] - q[k]) + 2.0 * STIFF * (drive.v[k] - arm.getVelocities())
        torque = arm.getMassMatrix() @ wanted + arm.getCoriolisAndGravityForces()
        arm.setForces(np.clip(torque, -effort, effort))
        world.step()
        at_limit += bool((np.abs(torque) >= AT_LIMIT * effort).any())
        touching += world.getLastCollisionResult().getNumContacts() > 0
    return Followed(q, at_limit / len(q), touching / len(q))


ENGINES: dict[str, tuple[str, Callable[[Drive], Followed]]] = {
    "MuJoCo": ("mujoco", in_mujoco),
    "MuJoCo, fed forward": ("mujoco", in_mujoco_ahead),
    "PyBullet": ("pybullet", in_pybullet),
    "Drake": ("pydrake", in_drake),
    "DART": ("dartpy", in_dart),
}


def main() -> None:
    """Drive every run in every engine."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--export", default="", help="More arguments of 'armdesign export'.")
    parser.add_argument("--only", default="", help="Engines, by commas.")
    given = parser.parse_args()
    for run in given.runs:
        with tempfile.TemporaryDirectory() as folder:
            drive = exported(run, Path(folder), shlex.split(given.export))
            table = read_result(run).table
            wanted = tool_poses(table, drive.q)[:, :3, 3]
            for name, (module, follow) in ENGINES.items():
                if given.only and name not in given.only.split(","):
                    continue
                try:
                    importlib.import_module(module)
                except ImportError:
                    continue
                try:
                    done = follow(drive)
                except Exception as error:  # an engine that fails is a finding
                    print(f"{run.name:12} {name:20} {' '.join(str(error).split())[:150]}", flush=True)
                    continue
                off = np.abs(done.q - drive.q).max(axis=0)
                tool = np.linalg.norm(tool_poses(table, done.q)[:, :3, 3] - wanted, axis=1)
                print(
                    f"{run.name:12} {name:20} {np.degrees(off.max()):7.2f} deg (joint_{off.argmax() + 1}) "
                    f"{1e3 * tool.max():7.2f} mm  at limit {100 * done.saturated:5.1f} %  touching "
                    f"{100 * done.touching:5.1f} %", flush=True,
                )  # fmt: skip


def exported(run: Path, folder: Path, more: list[str]) -> Drive:
    """A run's files, and its trajectory at every step."""
    asked = ["export", run, "--format", "urdf,mjcf", "--trajectory", "npz", "--rate", 1.0 / STEP, "--out", folder]
    outcome: Any = CliRunner().invoke(app, [str(each) for each in [*asked, *more]])
    if outcome.exit_code:
        raise SystemExit(outcome.output)
    print("\n".join(line for line in outcome.output.splitlines() if line.endswith(".")), flush=True)
    motion = np.load(folder / "joint_trajectory.npz")
    return Drive(folder, motion["time"], motion["q"], motion["v"], base_gravity(read_result(run).base_pose))


if __name__ == "__main__":
    main()

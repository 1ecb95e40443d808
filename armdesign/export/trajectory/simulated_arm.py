"""A serial arm in MuJoCo with a position servo at every joint.

The servos have velocity feed-forward, tau = kp (q_d - q) + kv (v_d - v), cut off at the joint's effort limit. The gains
make each joint alone, with the largest inertia I it sees along the motion, an oscillator of the frequency and damping
asked for: kp = I w^2, kv = 2 zeta I w with w = 2 pi frequency. Gravity is not compensated unless asked for, so an arm
sags by about its torque over kp, as one with such servos does. The rotors' inertia, seen through the gears, is the
armature; it also keeps joints that turn next to no mass from being too light for the step.

Everything here needs the extra ``sim``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from armdesign._types import Array
from armdesign.errors import DesignError, MissingExtraError, SettingsError
from armdesign.export.trajectory.scaling import Timing, motion_at
from armdesign.export.trajectory.trajectory_files import joint_names
from armdesign.kinematics.motion import SmoothPath

Pairs = dict[tuple[str, str], float]
"""A share for each pair of links."""
_POSES = 100  # poses along the path at which inertias are looked up


@dataclass(frozen=True)
class Servo:
    """The joints' servos and the simulation's step.

    Attributes:
        frequency: Natural frequency of a joint's position loop [Hz].
        damping: Its damping ratio; 1 is critical.
        armature: Inertia of a motor's rotor seen through its gear [kg m^2].
        gravity_compensation: Whether gravity is taken off the arm.
        contacts: Whether links that touch push each other.
        step: Time step [s].
        settling: How long the arm holds its first pose before the motion begins [s].
    """

    frequency: float = 10.0
    damping: float = 1.0
    armature: float = 0.01
    gravity_compensation: bool = False
    contacts: bool = False
    step: float = 1e-3
    settling: float = 0.5

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            SettingsError: One is out of range.
        """
        ranges = {
            "step": (1e-5, 5e-3, "s"),
            "frequency": (0.1, 0.1 / self.step if self.step > 0.0 else np.inf, "Hz"),
            "damping": (0.1, 10.0, ""),
            "armature": (1e-6, 10.0, "kg m^2"),
            "settling": (0.0, 60.0, "s"),
        }
        for name, (low, high, unit) in ranges.items():
            value = getattr(self, name)
            if not low <= value <= high:
                allowed = f"{low:g} to {high:g} {unit}".rstrip()
                raise SettingsError(f"the servo's {name} is {value} {unit}".rstrip(), value=value, allowed=allowed)


def load_mujoco() -> Any:  # noqa: ANN401 (a module)
    """MuJoCo.

    Raises:
        MissingExtraError: It is not installed.
    """
    try:
        import mujoco  # noqa: PLC0415, an extra
    except ImportError as error:
        raise MissingExtraError(
            "a simulation needs MuJoCo, which is not installed", fix="Run: pip install 'armdesign[sim]'"
        ) from error
    return mujoco


class SimulatedArm:
    """An arm in MuJoCo with a position servo at every joint.

    Attributes:
        model: The compiled model.
        data: Its state.
        effort: Effort limits, shape (n,) [N m].
    """

    def __init__(self, urdf: str, path: SmoothPath, servo: Servo) -> None:
        """Compile the model.

        Args:
            urdf: Text of the URDF, with joints joint_1..joint_n.
            path: The path it will follow, for the gains.
            servo: The servos.

        Raises:
            MissingExtraError: MuJoCo is not installed.
            DesignError: MuJoCo does not take the URDF, or its joints are others.
        """
        self._mujoco, self._servo = load_mujoco(), servo
        self.model = self._compiled(urdf, path.dof)
        self.data = self._mujoco.MjData(self.model)
        self.effort = np.where(self.model.jnt_actfrclimited, self.model.jnt_actfrcrange[:, 1], np.inf)
        self._set_gains(path)

    def follow(self, path: SmoothPath, timing: Timing) -> tuple[Array, Array]:
        """Hold the first pose until it has settled, then follow the path step by step.

        Returns:
            Joint angles [rad] and torques of the servos [N m], shape (N, n) each, one row a step from time 0 on.

        Raises:
            SettingsError: The simulation does not stay finite.
        """
        model, data, servo = self.model, self.data, self._servo
        before = round(servo.settling / servo.step)
        count = int(np.ceil(timing.total / servo.step)) + 1
        motion = motion_at(path, timing, np.arange(count) * servo.step)
        # kp (c - q) - kv v with c = q_d + (kv / kp) v_d
        targets = motion.q + motion.v * servo.damping / (np.pi * servo.frequency)
        self._mujoco.mj_resetData(model, data)
        data.qpos[:] = motion.q[0]
        q, torque = np.empty_like(motion.q), np.empty_like(motion.q)
        for k in range(-before, count):
            data.ctrl[:] = targets[k] if k >= 0 else motion.q[0]
            q[max(k, 0)] = data.qpos
            self._mujoco.mj_step(model, data)
            torque[max(k, 0)] = data.qfrc_actuator
        if not (np.isfinite(q).all() and np.isfinite(torque).all()) or data.warning.number.any():
            raise SettingsError("the simulation did not stay finite", value=servo, fix="Take a smaller step")
        return q, torque

    def touching(self, q: Array) -> Pairs:
        """Pairs of links that touch, with the share of the poses they do so in.

        Args:
            q: Joint angles, shape (N, n) [rad].
        """
        model, data = self.model, self.data
        flags, counts = int(model.opt.disableflags), Pairs()
        model.opt.disableflags = flags & ~int(self._mujoco.mjtDisableBit.mjDSBL_CONTACT)
        for angles in q:
            data.qpos[:] = angles
            self._mujoco.mj_kinematics(model, data)
            self._mujoco.mj_comPos(model, data)
            self._mujoco.mj_collision(model, data)
            for pair in {self._links(contact.geom) for contact in data.contact}:
                counts[pair] = counts.get(pair, 0.0) + 1.0
        model.opt.disableflags = flags
        return {pair: number / len(q) for pair, number in counts.items()}

    def _links(self, geoms: Array) -> tuple[str, str]:
        """Names of the links that two shapes belong to, in order."""
        names = (str(self.model.body(self.model.geom_bodyid[geom]).name) for geom in geoms)
        first, second = sorted(names)
        return first, second

    def _compiled(self, urdf: str, dof: int) -> Any:  # noqa: ANN401 (MuJoCo's own type)
        """The model with its actuators, which get their gains later."""
        mujoco, servo = self._mujoco, self._servo
        try:
            spec = mujoco.MjSpec.from_string(urdf)
            self._set_options(spec)
            for name in joint_names(dof):
                joint_of = {"trntype": mujoco.mjtTrn.mjTRN_JOINT, "biastype": mujoco.mjtBias.mjBIAS_AFFINE}
                spec.add_actuator(name=name, target=name, **joint_of)
            model = spec.compile()
        except ValueError as error:
            reason = " ".join(str(error).split())
            raise DesignError(f"MuJoCo does not take the arm: {reason}", fix="Export it again") from error
        if model.nv != dof:
            raise DesignError(f"the exported arm has {model.nv} joints, its path {dof}", value=model.nv, allowed=dof)
        model.opt.timestep = servo.step
        return model

    def _set_options(self, spec: Any) -> None:  # noqa: ANN401 (MuJoCo's own type)
        """What the servos ask of the model before it is compiled."""
        mujoco, servo = self._mujoco, self._servo
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        if not servo.contacts:
            spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        for joint in spec.joints:
            joint.armature = servo.armature
        if servo.gravity_compensation:
            for body in spec.bodies[1:]:
                body.gravcomp = 1.0

    def _set_gains(self, path: SmoothPath) -> None:
        """Give every servo the gains for the largest inertia its joint sees along the path."""
        inertia = np.zeros(path.dof)
        for q in path.at(np.linspace(path.start, path.start + path.duration, _POSES)):
            inertia = np.maximum(inertia, self._inertias(q))
        w = 2.0 * np.pi * self._servo.frequency
        kp, kv = inertia * w**2, 2.0 * self._servo.damping * inertia * w
        self.model.actuator_gainprm[:, 0] = kp
        self.model.actuator_biasprm[:, 1], self.model.actuator_biasprm[:, 2] = -kp, -kv

    def _inertias(self, q: Array) -> Array:
        """Diagonal of the joint-space inertia, armatures included, shape (n,) [kg m^2]: M e_j by columns."""
        model, data = self.model, self.data
        data.qpos[:] = q
        self._mujoco.mj_forward(model, data)
        columns = np.empty((model.nv, model.nv))
        for j, unit in enumerate(np.eye(model.nv)):
            self._mujoco.mj_mulM(model, data, columns[j], unit)
        return np.diag(columns).copy()

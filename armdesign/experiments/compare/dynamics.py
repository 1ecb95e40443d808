"""What it takes to move an arm along its path: inverse dynamics with gravity."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from armdesign._types import Array
from armdesign.experiments.compare.serial_arm import SerialArm
from armdesign.kinematics.motion import SmoothMotion


def ready_made_model(arm: SerialArm, payload: float = 0.0) -> pin.Model:
    """A ready-made arm with its file's masses, and a point mass at the tool [kg]."""
    model = arm.model()
    load = pin.Inertia(payload, np.zeros(3), np.zeros((3, 3)))
    model.appendBodyToJoint(arm.dof, load, pin.SE3(arm.placements[-1]))
    return model


def peak_torques(model: pin.Model, motion: SmoothMotion) -> Array:
    """Largest inverse-dynamics torque of each joint along a motion, shape (n,) [N m].

    Args:
        model: The arm, with gravity as its base feels it.
        motion: The motion.
    """
    data = model.createData()
    states = zip(motion.q, motion.v, motion.a, strict=True)
    return np.asarray(np.abs([pin.rnea(model, data, *state) for state in states]).max(axis=0))

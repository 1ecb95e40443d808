"""What is asked of the joints, in the units of the code, and the actuators that are assumed where nothing is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armdesign._types import Array
from armdesign.errors import SettingsError, counted
from armdesign.settings import Settings

TURNING = float(np.pi)
"""Speed of the actuator that is assumed for a joint that turns [rad/s]: 180 deg/s, that of many collaborative arms."""
SLIDING = 0.5
"""Speed of the actuator that is assumed for a joint that slides [m/s]."""
UNITS = {"max_speed": ("deg/s", "m/s"), "max_acceleration": ("deg/s^2", "m/s^2"), "max_torque": ("N m", "N")}
"""Units of joints that turn and of joints that slide, as the settings have them."""


@dataclass(frozen=True, eq=False)
class JointNeeds:
    """Limits of the n joints; of prismatic joints in m and N.

    Attributes:
        prismatic: Which joints slide, shape (n,).
        speed: Shape (n,) [rad/s]; None where none is stated.
        acceleration: Shape (n,) [rad/s^2]; None where none is stated.
        torque: Shape (n,) [N m]; None where none is stated.
    """

    prismatic: Array
    speed: Array | None = None
    acceleration: Array | None = None
    torque: Array | None = None

    @property
    def actuator_speed(self) -> Array:
        """The stated speeds, else those of the assumed actuators, shape (n,) [rad/s]."""
        return np.where(self.prismatic, SLIDING, TURNING) if self.speed is None else self.speed


def joint_needs(settings: Settings) -> JointNeeds:
    """The stated limits of every joint.

    Raises:
        SettingsError: There are neither one nor as many as joints.
    """
    n, prismatic = settings.design.dof, np.array(settings.design.prismatic)
    limits = {}
    mixed = 0 < prismatic.sum() < n
    for name, (turning, sliding) in UNITS.items():
        given = getattr(settings.needs, name)
        if given is not None and len(given) not in (1, n):
            raise SettingsError(
                f"setting 'needs.{name}' has {counted(len(given), 'number')} for {counted(n, 'joint')}", value=given,
                allowed="one number" if n == 1 else f"1 or {n} numbers",
            )  # fmt: skip
        if given is not None and len(given) == 1 < n and mixed:
            raise SettingsError(
                f"setting 'needs.{name}' has one number for joints that turn and joints that slide", value=given,
                allowed=f"{n} numbers, {turning} of joints that turn and {sliding} of those that slide",
            )  # fmt: skip
        values = None if given is None else np.array(np.broadcast_to(given, n), dtype=float)
        if values is not None and name != "max_torque":
            values = np.where(prismatic, values, np.deg2rad(values))
        limits[name] = values
    return JointNeeds(prismatic, limits["max_speed"], limits["max_acceleration"], limits["max_torque"])


def check_needs(settings: Settings, *, oriented: bool) -> None:
    """See that what is asked for can be judged.

    Args:
        settings: The settings, those left to the recording filled in.
        oriented: Whether the task follows an orientation.

    Raises:
        SettingsError: Limits that do not fit the joints, an angle where no orientation is followed, obstacles for an
            arm without a body.
    """
    joint_needs(settings)
    angle = settings.needs.tolerance_angle
    if angle is not None and not oriented:
        raise SettingsError(
            f"a tolerance of {angle:g} deg is asked for the orientation, but the task follows none", value=angle,
            fix="Leave --tolerance-angle out, or follow the hand's orientation (--scenario welding, --weights)",
        )  # fmt: skip
    check_bodies(settings)


def check_bodies(settings: Settings) -> None:
    """See that there is a body where something asks for one.

    Raises:
        SettingsError: Obstacles or an envelope for an arm without a body.
    """
    cell = settings.cell
    if settings.body.kind == "thin":
        for flag, given in (("--obstacles", cell.obstacles), ("--stay-within", cell.stay_within)):
            if given:
                raise SettingsError(
                    f"{flag} is given, but a thin arm has no body that could touch anything", value=given,
                    allowed=f"{flag} with --body tube", fix="Leave one of the two out",
                )  # fmt: skip

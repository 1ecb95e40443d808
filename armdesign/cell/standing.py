"""What a base stands on, and whether a cell makes sense with its obstacles, the hand's path and the base's places."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armdesign._types import Array
from armdesign.cell.obstacles import Obstacle, Obstacles, Plane
from armdesign.errors import ObstacleError, SettingsError
from armdesign.kinematics.base_pose import placed_base
from armdesign.settings.place import Site

TOUCHING = 1e-3
"""A hand that comes no deeper than this into an obstacle only touches it [m]."""
ON_THE_SURFACE = 2e-3
"""A base so near to an obstacle's surface stands on it [m]."""
STEPS = 9
"""Places along each edge of a region that are looked at."""


def standing_surface(stand: str | None, sites: Sequence[Site]) -> Obstacles:
    """The half space behind the floor, the wall or the ceiling that a base stands on; none where it stands on none.

    Args:
        stand: floor, wall or ceiling; None for none.
        sites: Where the base may stand, all in one plane.

    Raises:
        SettingsError: The places do not lie in one plane, so that the surface is not known.
    """
    if stand is None or not sites:
        return Obstacles()
    planes = []
    for site in sites:
        base = placed_base(site.box[0], site.yaw[0], site.mounted)
        normal, corner = base.rotation[:, 2], base.translation
        turned = stand == "wall" and site.yaw[0] != site.yaw[1]
        if turned or abs(normal @ (site.box[1] - site.box[0])) > 1e-9:
            free = "a yaw" if turned else "a range across it"
            raise SettingsError(
                f"the base is to stand on the {stand}, but the region '{site}' has {free}", value=str(site),
                allowed="a fixed z on floor and ceiling; on a wall a fixed yaw, where it faces, and no range across it",
                fix="Fix it, or say how the base is mounted with --mounted instead of --stand",
            )  # fmt: skip
        planes.append((normal, float(normal @ corner), corner))
    normal, height, corner = planes[0]
    for other, at, _ in planes[1:]:
        if np.linalg.norm(other - normal) > 1e-9 or abs(at - height) > 1e-9:
            raise SettingsError(
                f"the base is to stand on the {stand}, but its regions are not in one plane", value=stand
            )
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = placed_base(corner, sites[0].yaw[0], stand).rotation, corner
    return Obstacles((Obstacle(stand, Plane(), pose, source=f"--stand {stand}"),))


def check_hand(obstacles: Obstacles, hand: Array, time: Array) -> None:
    """Refuse obstacles that the demonstrated hand itself goes through.

    Args:
        obstacles: What stands in the room.
        hand: Path of the hand in the room, shape (T, 3) [m].
        time: Frame times, shape (T,) [s].

    Raises:
        ObstacleError: It goes through one; the message says which, when and how deep.
    """
    for one in obstacles.each:
        distance = one.distances(hand)
        frame = int(np.argmin(distance))
        if distance[frame] < -TOUCHING:
            raise ObstacleError(
                f"the demonstrated hand goes through '{one.name}': at {time[frame] - time[0]:.2f} s it is "
                f"{-1e3 * distance[frame]:.0f} mm deep in it, in {int((distance < -TOUCHING).sum())} of {len(hand)} "
                "frames", value=one.name, fix="Check where the obstacle stands, its size and unit",
            )  # fmt: skip


def check_places(obstacles: Obstacles, sites: Sequence[Site]) -> None:
    """Refuse places for the base that lie inside obstacles altogether.

    Args:
        obstacles: What stands in the room.
        sites: Where the base may stand.

    Raises:
        SettingsError: No point of a region is free; the message says what it lies in.
    """
    for site in sites:
        axes = [np.unique(np.linspace(low, high, STEPS)) for low, high in (site.x, site.y, site.z)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        still = [one for one in obstacles.each if one.pose.ndim == 2]
        inside = [one.distances(points) < -ON_THE_SURFACE for one in still]
        if still and np.any(inside, axis=0).all():
            names = ", ".join(f"'{one.name}'" for one, within in zip(still, inside, strict=True) if within.any())
            raise SettingsError(
                f"the base cannot stand in the region '{site}': it lies inside {names}", value=str(site),
                fix="Move the region or the obstacle; a base on a surface stands no deeper than 2 mm in it",
            )  # fmt: skip

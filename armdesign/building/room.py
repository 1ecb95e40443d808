"""The room that motors and their brackets take, as entries of the section Body for a search that leaves it."""

from __future__ import annotations

import math

from armdesign.bodies.loads import GRAVITY
from armdesign.building.catalogue import find_catalogue
from armdesign.building.shop import envelope, shop_of
from armdesign.settings.sections import Body

MARGIN = 1.2
"""Factor on the torques that are needed."""
LITTLE = 2e-3
"""Room that no search is repeated for [m]."""
TUBES = {"tube_diameter": 0.025, "tube_wall": 0.002, "tube_density": 2700.0}
"""Thin enough that flanges and brackets have room between motors [m, kg/m^3]."""


def room_for_motors(family: str, reach: float, payload: float) -> dict[str, float]:
    """Entries of the section Body by which a search leaves room for a family's motors and their brackets [m, kg/m^3].

    The shoulder's motor has to hold load, tubes and further motors on part of the arm's reach; the room is that of the
    widest and the longest of those no heavier, since any of them may be chosen further out.

    Args:
        family: A family that is shipped, or a catalogue file.
        reach: Of the arm [m].
        payload: What it carries [kg].

    Raises:
        CatalogueError: There is no such family, or the file is at fault.
    """
    catalogue = find_catalogue(family)
    sizes = sorted(catalogue.actuators, key=lambda a: a.mass)
    able = [a for a in sizes if a.rated_torque >= -MARGIN * GRAVITY[2] * reach / 3.0 * (payload + 0.4 + 1.5 * a.mass)]
    most = able[0].mass if able else sizes[-1].mass
    shop = shop_of(Body(**TUBES), None, printed=True)  # type: ignore[arg-type]
    taken = [envelope(a, shop) if catalogue.kit is None else (a.diameter, a.length) for a in sizes if a.mass <= most]
    across, along = (round(max(each), 3) for each in zip(*taken, strict=True))
    tubes = TUBES if catalogue.kit is None else catalogue.kit.body
    return {"joint_diameter": across, "joint_length": along, "module_slide": 0.0, **tubes}


def room_of_parts(body: Body) -> dict[str, float]:
    """Entries of the section Body by which a search leaves the room that the parts of a build take [m].

    Args:
        body: The build's.
    """
    sizes = [(module.diameter, module.length) for module in body.modules_of(len(body.modules or (None,)))]
    across, along = (math.ceil(1e3 * max(each) - 1e-6) / 1e3 for each in zip(*sizes, strict=True))
    return {
        "joint_diameter": across, "joint_length": along, "module_slide": 0.0, "tube_diameter": body.tube_diameter,
        "tube_wall": body.tube_wall,
    }  # fmt: skip


def leaves_room(searched: Body, built: Body) -> bool:
    """Whether the body that an arm was searched with has left the room already that the parts of a build take."""
    return all(getattr(searched, name) >= size - LITTLE for name, size in room_of_parts(built).items())


def room_flags(body: Body) -> str:
    """The same as flags."""
    return " ".join(f"--{name.replace('_', '-')} {value:g}" for name, value in room_of_parts(body).items())

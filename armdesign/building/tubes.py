"""Tubes out of stock: which there are, and how far the tool sags under the payload.

A stock file is TOML; lengths in metres, moduli in pascal:

    cut = 0.001                   # what tubes are cut to
    source = "catalogue of the shop, 2026"
    [[tube]]
    name = "tube 40 x 2"
    diameter = 0.04
    wall = 0.002
    density = 2700.0
    youngs_modulus = 70e9
    shear_modulus = 27e9
    price = 12.0                  # per metre, optional, with 'currency' beside 'cut'
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from armdesign._types import Array
from armdesign.bodies.arm_body import ArmBody
from armdesign.building.catalogue import read_toml
from armdesign.errors import CatalogueError
from armdesign.files import is_number

FIELDS = ("diameter", "wall", "density", "youngs_modulus", "shear_modulus")
SIMPSON = ((0.0, 1.0 / 6.0), (0.5, 4.0 / 6.0), (1.0, 1.0 / 6.0))
"""Places and weights: exact for what is integrated here, quadratic along a tube."""


@dataclass(frozen=True)
class Tube:
    """A tube that can be had.

    Attributes:
        name: What it is called.
        diameter: Outer diameter [m].
        wall: [m].
        density: [kg/m^3].
        youngs_modulus: [Pa].
        shear_modulus: [Pa].
        price: Per metre; None where it is not known.
    """

    name: str
    diameter: float
    wall: float
    density: float
    youngs_modulus: float
    shear_modulus: float
    price: float | None = None

    @property
    def area(self) -> float:
        """Of its section [m^2]."""
        return float(np.pi / 4.0 * (self.diameter**2 - (self.diameter - 2.0 * self.wall) ** 2))

    @property
    def second_moment(self) -> float:
        """I of its section about a diameter [m^4]; twice that about the axis."""
        return float(np.pi / 64.0 * (self.diameter**4 - (self.diameter - 2.0 * self.wall) ** 4))


@dataclass(frozen=True)
class Stock:
    """Tubes that can be had.

    Attributes:
        cut: What they are cut to [m].
        source: Where the figures come from.
        currency: Of the prices.
        tubes: The tubes.
    """

    cut: float
    source: str
    currency: str
    tubes: tuple[Tube, ...]


def find_stock(name: str) -> Stock:
    """The stock of a file, or "aluminium" that comes with the package.

    Raises:
        CatalogueError: There is none, or it is faulty.
    """
    own = Path(str(resources.files("armdesign.building"))) / "stock" / f"{name}.toml"
    path = own if name == "aluminium" else Path(name)
    content = read_toml(path, "the stock", "aluminium, or a TOML file")
    fault = next(stock_faults(content), None)
    if fault is not None:
        raise CatalogueError(f"{path.name}: {fault}", value=name)
    tubes = tuple(Tube(**each) for each in content["tube"])
    return Stock(float(content["cut"]), content["source"], content.get("currency", ""), tubes)


def stock_faults(content: dict[str, Any]) -> Iterator[str]:
    """What is wrong with a stock file."""
    for name in content:
        if name not in ("cut", "source", "currency", "tube"):
            yield f"unknown entry '{name}'; allowed: cut, source, currency, tube"
    if not is_number(content.get("cut")) or not 0.0 < content["cut"] <= 1.0:
        yield f"'cut' is {content.get('cut')!r}; allowed: above 0, at most 1 m"
    if not isinstance(content.get("source"), str) or not content["source"]:
        yield "'source' is missing: where the figures come from"
    tubes = content.get("tube")
    if not isinstance(tubes, list) or not tubes or not all(isinstance(each, dict) for each in tubes):
        yield "there are no tubes: [[tube]] is missing"
        return
    for each in tubes:
        name = each.get("name")
        if not isinstance(name, str) or not name:
            yield "a tube has no 'name'"
        for field in each:
            if field not in ("name", "price", *FIELDS):
                yield f"tube '{name}': unknown figure '{field}'; allowed: name, price, {', '.join(FIELDS)}"
        for field in (*FIELDS, *(["price"] if "price" in each else [])):
            if not is_number(each.get(field)) or each[field] <= 0.0:
                yield f"tube '{name}': '{field}' is {each.get(field, 'missing')!r}; allowed: a number above 0"
                return
        if each["wall"] > each["diameter"] / 2.0:
            yield f"tube '{name}': its wall of {each['wall']!r} m is more than half its diameter"
        if each["diameter"] > 1.0:
            yield f"tube '{name}': its diameter of {each['diameter']!r} m looks as if it were in mm, not in m"
        if each["youngs_modulus"] < 1e8:
            yield f"tube '{name}': its modulus of {each['youngs_modulus']!r} Pa looks as if it were in MPa or GPa"


def deflections(arm: ArmBody, poses: Array, force: Array, tube: Tube) -> Array:
    """How far the tool gives way to a force by the tubes alone, joints and modules stiff, shape (T, 3) [m].

    With a force of 1 in the direction e at the tool, unit load (Castigliano):

        e . delta = sum over tubes of int (M_b . m_b / EI + M_t m_t / 2GI + N n / EA) dx,

    M = (p - x) x F, m = (p - x) x e, the parts across the tube bending, along it torsion, N and n along it.

    Args:
        arm: The arm.
        poses: Its poses, shape (T, n) [rad].
        force: On the tool, in the base's frame, shape (3,) [N].
        tube: What its tubes are.
    """
    frames = np.stack([arm.table.frames(q) for q in poses])
    tool, given = frames[:, -1, :3, 3], np.zeros((len(poses), 3))
    bend, twist = tube.youngs_modulus * tube.second_moment, 2.0 * tube.shear_modulus * tube.second_moment
    loads = np.vstack([force, np.eye(3)])  # F, and the three directions e
    for part in arm.parts:
        if part.solid.material != "tube":
            continue
        # base_link's own frame is the base, before the table's yaw
        pose = np.broadcast_to(np.eye(4), (len(poses), 4, 4)) if part.link == 0 else frames[:, part.link - 1]
        start, end = np.moveaxis(part.solid.ends @ np.swapaxes(pose[:, :3, :3], 1, 2) + pose[:, None, :3, 3], 1, 0)
        length = float(np.linalg.norm(end[0] - start[0]))
        u = (end - start) / length
        for place, weight in SIMPSON:
            lever = tool - (start + place * (end - start))
            moments = np.cross(lever[:, None], loads)
            torsion = np.einsum("tij,tj->ti", moments, u)
            across = moments - torsion[:, :, None] * u[:, None]
            given += weight * length * (
                np.einsum("tij,tj->ti", across[:, 1:], across[:, 0]) / bend + torsion[:, 1:] * torsion[:, :1] / twist
                + (u @ force)[:, None] * u / (tube.youngs_modulus * tube.area)
            )  # fmt: skip
    return given


def worst_deflection(arm: ArmBody, paths: Sequence[Array], force: Array, tube: Tube) -> float:
    """The largest deflection of the tool over joint paths, shape (T, n) each [m]."""
    return float(np.linalg.norm(deflections(arm, np.concatenate(paths), force, tube), axis=1).max())

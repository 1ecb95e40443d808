"""Which actuator every joint gets: the lightest or cheapest choice that meets the margins, and the proof that it is.

With the geometry of an arm and its motion fixed, torques are linear in the inertial parameters pi_k of the modules:

    tau(t) = tau_0(t) + sum_k Y_k(t) pi_k,

tau_0 that of all else, Y_k the columns of Pinocchio's joint torque regressor. A module loads its own joint and those
before it, so once the modules of joints j..n are chosen tau_j is known. Joint j may have an actuator whose

    peak     margin max_t |tau_j| <= peak torque,
    rms      margin rms_t tau_j <= rated torque,
    speed    |v_j(t)| <= no-load speed - slope margin |tau_j(t)| at all t,
    housing  its angle range holds the motion.

**Branch and bound** goes from the last joint to the first. Of joints that are still open, every choice of those behind
puts tau_j(t) between bounds; the distance of these from 0 bounds peak, rms and speed from below, and the cheapest
actuator that meets them bounds the cost. What is not better than the best choice so far is cut off, nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from armdesign._types import Array
from armdesign.bodies.arm_body import ArmBody
from armdesign.bodies.cylinder import Cylinder
from armdesign.bodies.loads import base_gravity, dynamic_model, joint_torques
from armdesign.building.catalogue import Actuator
from armdesign.building.supply import alike
from armdesign.errors import CatalogueError
from armdesign.kinematics.base_pose import BasePose
from armdesign.kinematics.motion import SmoothMotion

BRIM = 1.0 + 1e-9
"""Share of a limit that may be used, so that rounding decides nothing."""


class Shortfall(NamedTuple):
    """What an actuator lacks at a joint: shares of its limits that are used, of which more than 1 is too much.

    Attributes:
        peak: Of its peak torque.
        rms: Of its rated torque.
        speed: Of its speed at the torque, the worst frame.
        turn: Of its angle range.
    """

    peak: float
    rms: float
    speed: float
    turn: float

    @property
    def met(self) -> bool:
        """Whether it lacks nothing."""
        return max(self) <= BRIM

    @property
    def worst(self) -> str:
        """What it lacks most, in words."""
        words = ("peak torque", "rated torque", "speed", "angle range")
        return words[self.index(self.most)]

    @property
    def most(self) -> float:
        """The share that is used most; where none of the speed is left, that of another limit if it is too much."""
        finite = max((share for share in self if np.isfinite(share)), default=np.inf)
        return finite if finite > BRIM else max(self)


@dataclass(frozen=True)
class Choice:
    """An actuator for every joint.

    Attributes:
        actuators: From the base on, n of them.
        cost: Sum of what was minimised.
        shortfalls: What each uses of its limits.
        nodes: Partial choices that were looked at; 0 where choices went in a circle, and this is the best of it.
    """

    actuators: tuple[Actuator, ...]
    cost: float
    shortfalls: tuple[Shortfall, ...]
    nodes: int


@dataclass(frozen=True, eq=False)
class Duty:
    """What an arm's joints do on a motion, by what is chosen for them.

    Attributes:
        sizes: Actuators to choose from, K of them.
        margin: Factor on torques.
        speed: Absolute speeds, shape (T, n) [rad/s].
        turn: Range of every angle, shape (n,) [rad].
        fixed: Torques of all but the modules, shape (T, n) [N m].
        share: Torques of the module of joint k in size s, shape (n, K, T, n): (k, s, t, j) [N m].
        heights: What the actuators' heights have to be, n of them [m]; none where any will do.
    """

    sizes: tuple[Actuator, ...]
    margin: float
    speed: Array
    turn: Array
    fixed: Array
    share: Array
    heights: tuple[float, ...] = ()

    @property
    def dof(self) -> int:
        """Number of joints n."""
        return int(self.speed.shape[1])

    def among(self, sizes: Sequence[int]) -> Duty:
        """The same with some of the sizes alone, by their places."""
        return replace(self, sizes=tuple(self.sizes[s] for s in sizes), share=self.share[:, list(sizes)])

    @cached_property
    def range_behind(self) -> tuple[Array, Array]:
        """Least and largest torque that the modules from joint k on add, whatever they are, (n + 1, T, n) each."""
        low, high = (np.zeros((self.dof + 1, *self.fixed.shape)) for _ in range(2))
        for k in range(self.dof - 1, -1, -1):
            low[k] = low[k + 1] + self.share[k].min(axis=0)
            high[k] = high[k + 1] + self.share[k].max(axis=0)
        return low, high

    def torque(self, chosen: Sequence[int]) -> Array:
        """Torques where every joint's size is chosen, shape (T, n) [N m]."""
        total: Array = self.fixed + sum(self.share[k, s] for k, s in enumerate(chosen))
        return total

    def shortfall(self, joint: int, size: int, torque: Array) -> Shortfall:
        """What a size uses of its limits.

        Args:
            joint: The joint, from 0.
            size: The size.
            torque: The joint's torque or what it is at least, shape (T,) [N m].
        """
        actuator, load = self.sizes[size], self.margin * np.abs(torque)
        if self.heights and actuator.height != self.heights[joint]:
            return Shortfall(np.inf, np.inf, np.inf, np.inf)
        left = actuator.no_load_speed - actuator.slope * load
        speed = self.speed[:, joint]
        used = np.where(speed > 0.0, np.divide(speed, left, out=np.full_like(speed, np.inf), where=left > 0.0), 0.0)
        return Shortfall(
            float(load.max() / actuator.peak_torque),
            float(np.sqrt(np.mean(load**2)) / actuator.rated_torque),
            float(used.max()),
            0.0 if actuator.angle_range is None else float(self.turn[joint] / actuator.angle_range),
        )


class Load(NamedTuple):
    """What an arm carries, and is made of, for its choice.

    Attributes:
        payload: Point mass at the tool [kg].
        margin: Factor on torques.
        held: The actuators that the mass properties of its links are with, n of them; none for its modules.
        heights: What the actuators' heights should be, n of them [m]; none where any will do.
    """

    payload: float
    margin: float
    held: Sequence[Actuator] = ()
    heights: tuple[float, ...] = ()


def duty_of(
    arm: ArmBody, motions: Sequence[SmoothMotion], sizes: Sequence[Actuator], base: BasePose, load: Load
) -> Duty:  # fmt: skip
    """What the joints of an arm do on motions.

    Args:
        arm: The arm; its modules only say where they sit.
        motions: What it does.
        sizes: Actuators to choose from.
        base: Where it stands.
        load: What it carries.

    Raises:
        CatalogueError: A joint slides, for which no family has an actuator.
    """
    if any(arm.table.prismatic):
        joint = arm.table.prismatic.index(True) + 1
        raise CatalogueError(
            f"joint {joint} slides, and the catalogues have no linear actuators", value=arm.table.joints,
            allowed="arms whose joints all turn",
        )  # fmt: skip
    n, gravity = arm.table.dof, base_gravity(base)
    model = dynamic_model(arm, load.payload)
    model.gravity.linear = gravity
    data = model.createData()
    q, v, a = (np.concatenate([getattr(each, name) for each in motions]) for name in ("q", "v", "a"))
    Y = np.stack([pin.computeJointTorqueRegressor(model, data, *state) for state in zip(q, v, a, strict=True)])
    Y = Y.reshape(len(q), n, 10 * n)  # Pinocchio gives a single row without its axis
    whole = np.concatenate([joint_torques(arm, motion, load.payload, gravity) for motion in motions])
    share = np.zeros((n, len(sizes), len(q), n))
    for k, module in enumerate(part.solid for part in arm.parts if part.module):
        columns = Y[:, :, 10 * k : 10 * k + 10]
        held = of_actuator(module, load.held[k]) if load.held else module
        whole = whole - columns @ dynamic_parameters(held)
        for s, size in enumerate(sizes):
            share[k, s] = columns @ dynamic_parameters(of_actuator(module, size))
            share[k, s, :, k] += size.reflected_inertia * a[:, k]
    return Duty(tuple(sizes), load.margin, np.abs(v), q.max(axis=0) - q.min(axis=0), whole, share)


def of_actuator(module: Cylinder, actuator: Actuator) -> Cylinder:
    """An actuator's own cylinder in the place of a module."""
    return replace(module, radius=actuator.diameter / 2.0, length=actuator.length, mass=actuator.mass)


def dynamic_parameters(solid: Cylinder) -> Array:
    """Mass properties of a solid in its link's frame, as Pinocchio orders them, shape (10,)."""
    inertial = solid.inertial
    return np.asarray(pin.Inertia(inertial.mass, inertial.com, inertial.inertia).toDynamicParameters())


def choose(duty: Duty, costs: Sequence[float]) -> Choice | None:
    """The choice of least cost, by branch and bound; None where there is none.

    Args:
        duty: What the joints do.
        costs: Of every size, K of them.
    """
    price, n = np.asarray(costs, dtype=float), duty.dof
    order = np.argsort(price, kind="stable")
    low, high = duty.range_behind
    best: list[float | tuple[int, ...]] = [np.inf, ()]
    nodes = 0

    def cheapest(joint: int, known: Array, behind: int) -> float:
        """The least cost of a joint whose torque is known but for the modules of joints ``joint``..``behind`` - 1."""
        least = known[:, joint] + low[joint, :, joint] - low[behind, :, joint]
        most = known[:, joint] + high[joint, :, joint] - high[behind, :, joint]
        away = np.maximum(np.maximum(least, -most), 0.0)
        met = (s for s in order if duty.shortfall(joint, int(s), away).met)
        return next((float(price[s]) for s in met), np.inf)

    def descend(joint: int, known: Array, chosen: tuple[int, ...], spent: float) -> None:
        """Choose for the joints 0..``joint``, the torques of those behind known."""
        nonlocal nodes
        if joint < 0:
            if spent < float(best[0]):  # type: ignore[arg-type]
                best[:] = [spent, chosen]
            return
        rest = sum(cheapest(i, known, joint + 1) for i in range(joint))
        for s in order:
            if spent + price[s] + rest >= float(best[0]):  # type: ignore[arg-type]
                return
            nodes += 1
            torque = known + duty.share[joint, s]
            if duty.shortfall(joint, int(s), torque[:, joint]).met:
                descend(joint - 1, torque, (int(s), *chosen), spent + float(price[s]))

    descend(n - 1, duty.fixed, (), 0.0)
    cost, chosen = best
    if not isinstance(chosen, tuple) or not chosen:
        return None
    torque = duty.torque(chosen)
    used = tuple(duty.shortfall(j, s, torque[:, j]) for j, s in enumerate(chosen))
    return Choice(tuple(duty.sizes[s] for s in chosen), float(cost), used, nodes)  # type: ignore[arg-type]


def choose_alike(duty: Duty, costs: Sequence[float]) -> Choice | None:
    """The choice of least cost that one supply and one bus serve; where there is none, that of any; None for none.

    Args:
        duty: What the joints do.
        costs: Of every size, K of them.
    """
    each = (choose(duty.among(places), [costs[s] for s in places]) for places in alike(duty.sizes))
    found = [choice for choice in each if choice is not None]
    if not found:
        return choose(duty, costs)
    return replace(min(found, key=lambda choice: choice.cost), nodes=sum(choice.nodes for choice in found))


def weakest(duty: Duty) -> tuple[int, Shortfall, Actuator]:
    """The joint for which no size is enough even with the best modules behind it, what the best size lacks, and which.

    The joint is the one that lacks most; where single joints could all be served, but not together, the one that does
    with the lightest modules behind it, or with the lightest of those that are enough for the joints behind it.

    Args:
        duty: What the joints do.
    """
    low, high = duty.range_behind
    lightest = min(range(len(duty.sizes)), key=lambda s: duty.sizes[s].mass)
    bounds = np.maximum(np.maximum(duty.fixed + low[0], -(duty.fixed + high[0])), 0.0)
    real = duty.torque([lightest] * duty.dof)
    for torque in (bounds, real):
        found = []
        for j in range(duty.dof):
            each = [duty.shortfall(j, s, torque[:, j]) for s in range(len(duty.sizes))]
            s = min(range(len(each)), key=lambda s: (max(each[s]), each[s].most))
            found.append((j, each[s], duty.sizes[s]))
        worst = max(found, key=lambda one: max(one[1]))
        if not worst[1].met:
            return worst
    known = duty.fixed
    for j in range(duty.dof - 1, -1, -1):
        tried = [(s, duty.shortfall(j, s, (known + duty.share[j, s])[:, j])) for s in range(len(duty.sizes))]
        met = [s for s, short in tried if short.met]
        if not met:
            s, short = min(tried, key=lambda one: (max(one[1]), one[1].most))
            return j, short, duty.sizes[s]
        known = known + duty.share[j, min(met, key=lambda s: duty.sizes[s].mass)]
    return worst

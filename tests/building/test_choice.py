"""The choice of actuators against brute force, inverse dynamics and torques by hand; what the tool sags."""

from dataclasses import replace
from importlib import resources
from itertools import product

import numpy as np
import pytest

from armdesign.bodies.arm_body import arm_body
from armdesign.bodies.loads import joint_torques
from armdesign.building.catalogue import Actuator, find_catalogue
from armdesign.building.choice import Load, choose, choose_alike, duty_of, weakest
from armdesign.building.supply import supply_of
from armdesign.building.tubes import Tube, deflections, find_stock
from armdesign.errors import CatalogueError
from armdesign.kinematics.base_pose import BasePose
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.motion import SmoothMotion
from armdesign.settings import Body

TABLE = DHTable.from_rows([(0, 0, 0.2), (np.pi / 2, 0, 0), (0, 0.3, 0.0), (np.pi / 2, 0.2, 0.1)])


def motion_of(rng, n=3, frames=60):
    t = np.linspace(0.0, 2.0, frames)[:, None]
    size, rate = rng.uniform(0.2, 0.8, n), rng.uniform(1.0, 3.0, n)
    return SmoothMotion(size * np.sin(rate * t), size * rate * np.cos(rate * t), -size * rate**2 * np.sin(rate * t))


def sizes_of(rng, count):
    strong = np.sort(rng.uniform(0.3, 6.0, count))
    return tuple(
        Actuator("f", f"A{k}", s, 3.0 * s, rng.uniform(2.0, 12.0), None, 0.1 * s * rng.uniform(0.5, 2.0) + 0.05,
                 0.04 + 0.01 * rng.random(), 0.05, price=float(rng.uniform(50, 500)))
        for k, s in enumerate(strong)
    )  # fmt: skip


def with_modules(arm, actuators):
    body = replace(arm.options, modules=[(a.diameter, a.length, a.mass) for a in actuators])
    return arm_body(arm.table, body, arm.slides, arm.limits)


def test_torques_are_those_of_inverse_dynamics_with_the_modules_in_place():
    rng = np.random.default_rng(0)
    arm, motion, sizes = arm_body(TABLE, Body(), [0.25, 0.05, -0.02]), motion_of(rng), sizes_of(rng, 4)
    duty = duty_of(arm, [motion], sizes, BasePose(), Load(0.7, 1.0))
    for chosen in ((0, 1, 2), (3, 3, 0)):
        built = with_modules(arm, [sizes[s] for s in chosen])
        assert duty.torque(chosen) == pytest.approx(joint_torques(built, motion, 0.7), abs=1e-9)


@pytest.mark.parametrize("seed", range(12))
def test_choice_is_that_of_brute_force(seed):
    rng = np.random.default_rng(seed)
    arm, sizes = arm_body(TABLE, Body(), [0.25, 0.05, -0.02]), sizes_of(rng, 5)
    duty = duty_of(arm, [motion_of(rng)], sizes, BasePose(), Load(0.4 * rng.random(), 1.2))
    costs = [a.mass if seed % 2 else a.price for a in sizes]
    feasible = []
    for chosen in product(range(5), repeat=3):
        torque = duty.torque(chosen)
        if all(duty.shortfall(j, s, torque[:, j]).met for j, s in enumerate(chosen)):
            feasible.append(sum(costs[s] for s in chosen))
    found = choose(duty, costs)
    if not feasible:
        assert found is None
        assert max(weakest(duty)[1]) > 1.0
        return
    assert found.cost == pytest.approx(min(feasible))
    assert all(used.met for used in found.shortfalls)
    assert found.nodes <= 5 + 25 + 125


@pytest.mark.parametrize("seed", range(6))
def test_one_supply_and_one_bus_where_the_sizes_allow(seed):
    rng = np.random.default_rng(seed)
    arm, sizes = arm_body(TABLE, Body(), [0.25, 0.05, -0.02]), sizes_of(rng, 5)
    sizes = tuple(replace(a, voltage=v, max_voltage=h, interface=bus) for a, v, h, bus in zip(
        sizes, (12.0, 12.0, 24.0, 11.1, 24.0), (14.8, 12.0, 24.0, 12.0, 24.0),
        ("RS-485", "TTL", "RS-485", "RS-485 or TTL", "RS-485 or TTL"), strict=True))  # fmt: skip
    duty = duty_of(arm, [motion_of(rng)], sizes, BasePose(), Load(0.4 * rng.random(), 1.2))
    costs, single, any_ = [a.mass for a in sizes], [], []
    for chosen in product(range(5), repeat=3):
        torque = duty.torque(chosen)
        if all(duty.shortfall(j, s, torque[:, j]).met for j, s in enumerate(chosen)):
            used = [sizes[s] for s in chosen]
            shared = set.intersection(*(set(a.buses) for a in used))
            one = shared and max(a.voltage for a in used) <= min(a.max_voltage for a in used)
            (single if one else any_).append(sum(costs[s] for s in chosen))
    found = choose_alike(duty, costs)
    assert (found is None) == (not single and not any_)
    if found is not None:
        assert found.cost == pytest.approx(min(single or any_))
        needs = supply_of(found.actuators)
        assert (len(needs.voltages) == len(needs.buses) == 1) == bool(single)


def test_supply_of_dynamixels():
    sizes = {a.name: a for a in find_catalogue("dynamixel-x").actuators}
    small, middle, high = (sizes[name] for name in ("XL430-W250", "XM430-W350", "XH430-V350"))
    needs = supply_of([middle, small, small])
    assert (needs.voltages, needs.buses) == ((12.0,), ("TTL",))
    assert needs.current == pytest.approx(2.3 + 2 * 1.3)
    assert [name for name, _ in needs.open_items if "supply" in name] == [
        "power supply 12 V, 4.9 A were all at their peak torque at once"
    ]
    mixed = supply_of([middle, high])
    assert mixed.voltages == (12.0, 24.0)
    assert "destroys" in mixed.words
    assert "destroys" not in needs.words
    assert sum("destroys" in name for name, _ in mixed.open_items) == 1
    assert supply_of([high, middle]).buses == ("RS-485",)
    assert supply_of([high, small]).buses == ("RS-485", "TTL")
    unknown = replace(small, voltage=None, max_voltage=None, interface="", peak_current=None)
    assert supply_of([unknown]).voltages == supply_of([unknown]).buses == ()
    assert "not published" in supply_of([unknown]).words
    assert [needs.ordered(a) for a in (small, middle)] == ["XL430-W250-T", "XM430-W350-T"]
    assert supply_of([high, middle]).ordered(middle) == "XM430-W350-R"
    free = [replace(high, order={}, interface="EtherCAT or CAN")] * 2
    assert (supply_of(free).buses, supply_of(free).bus(free[0])) == (("EtherCAT or CAN",), "EtherCAT or CAN")
    assert (needs.volts(small), supply_of([unknown]).volts(unknown)) == (12.0, None)


def test_torque_by_hand():
    """One joint that holds a payload at arm's length: m g l, and half of the tube's weight."""
    table = DHTable.from_rows([(np.pi / 2, 0, 0), (0, 0.5, 0)])
    arm = arm_body(table, Body(), side=None)
    still = SmoothMotion(*(np.zeros((5, 1)) for _ in range(3)))
    size = Actuator("f", "A", 12.0, 24.0, 3.0, None, 0.5, 0.06, 0.06)
    duty = duty_of(arm, [still], [size], BasePose(), Load(2.0, 1.0))
    tube = next(part.solid.mass for part in arm.parts if part.solid.material == "tube")
    expected = 9.81 * (2.0 * 0.5 + tube * 0.25 + 1e-4 * 0.5)
    used = duty.shortfall(0, 0, duty.torque([0])[:, 0])
    assert used.rms == pytest.approx(expected / 12.0)
    assert used.peak == pytest.approx(expected / 24.0)
    assert choose(duty, [1.0]).actuators == (size,)
    heavy = duty_of(arm, [still], [size], BasePose(), Load(4.0, 1.0))
    joint, short, best = weakest(heavy)
    assert (choose(heavy, [1.0]), joint, short.worst, best) == (None, 0, "rated torque", size)


def test_speed_counts_at_the_torque():
    size = Actuator("f", "A", 1.0, 2.0, 4.0, None, 0.5, 0.06, 0.06)
    arm = arm_body(DHTable.from_rows([(0, 0, 0), (0, 0.5, 0)]), Body(), side=None)
    turning = SmoothMotion(np.zeros((5, 1)), np.full((5, 1), 1.5), np.zeros((5, 1)))
    duty = duty_of(arm, [turning], [size], BasePose(), Load(0.0, 1.0))
    assert duty.shortfall(0, 0, np.full(5, 1.0)).speed == pytest.approx(1.5 / 2.0)
    assert not duty.shortfall(0, 0, np.full(5, 1.5)).met


def test_arm_with_a_slide_is_refused():
    arm = arm_body(DHTable.from_rows([(0, 0, 0.1), (0, 0, 0.1)], joints="P"), Body())
    with pytest.raises(CatalogueError, match="joint 1 slides"):
        duty_of(arm, [], [], BasePose(), Load(0.0, 1.0))


def test_deflection_of_a_cantilever_and_of_a_bent_arm():
    tube = Tube("t", 0.03, 0.002, 2700.0, 70e9, 27e9)
    EI, GJ = tube.youngs_modulus * tube.second_moment, 2.0 * tube.shear_modulus * tube.second_moment
    force = np.array([0.0, 0.0, -10.0])
    straight = arm_body(DHTable.from_rows([(0, 0, 0), (0, 0.4, 0)]), Body(), side=None)
    assert deflections(straight, np.zeros((1, 1)), force, tube)[0] == pytest.approx([0, 0, -10.0 * 0.4**3 / (3 * EI)])
    # an L in the floor's plane: both legs bend, and the first is twisted by the second
    bent = arm_body(DHTable.from_rows([(0, 0.0, 0), (0, 0.4, 0), (0, 0.3, 0)]), Body(), side=None)
    expected = 10.0 * (0.4**3 / (3 * EI) + 0.3**3 / (3 * EI) + 0.3**2 * 0.4 / GJ)
    assert deflections(bent, np.array([[0.0, np.pi / 2]]), force, tube)[0, 2] == pytest.approx(-expected)
    stretched = deflections(straight, np.zeros((1, 1)), np.array([10.0, 0, 0]), tube)[0]
    assert stretched == pytest.approx([10.0 * 0.4 / (70e9 * tube.area), 0, 0])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [("diameter = 0.016", "diameter = 16", "in mm"), ("wall = 0.0015", "wall = 0.02", "more than half"),
     ("cut = 0.001", "cut = 0", "'cut' is 0"), ("density = 2700.0", "densty = 1", "densty")],
)  # fmt: skip
def test_stock_is_checked(tmp_path, old, new, words):
    text = (resources.files("armdesign.building") / "stock" / "aluminium.toml").read_text()
    file = tmp_path / "stock.toml"
    file.write_text(text.replace(old, new, 1))
    with pytest.raises(CatalogueError, match=words):
        find_stock(str(file))
    assert len(find_stock("aluminium").tubes) > 5


def test_what_lacks_is_more_than_all_there_is():
    for seed in range(12):  # near the limit, where single joints could be served, but not together
        rng = np.random.default_rng(seed)
        arm, sizes = arm_body(TABLE, Body(), [0.25, 0.05, -0.02]), sizes_of(rng, 5)
        duty = duty_of(arm, [motion_of(rng)], sizes, BasePose(), Load(0.3, 1.0))
        for margin in np.geomspace(0.2, 20.0, 30):
            scaled = replace(duty, margin=margin)
            if choose(scaled, [a.mass for a in sizes]) is None:
                assert max(weakest(scaled)[1]) > 1.0

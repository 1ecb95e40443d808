"""The penalty in the search: what counts in it, its gradient, and that a feasible arm's r is the paper's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from obstacle_scenes import at, columns, random_arms

from armdesign.bodies.capsules import capsule_about
from armdesign.cell.obstacles import Box, Obstacle, Obstacles, Plane
from armdesign.feasibility.clearance import MARGIN, Posed
from armdesign.feasibility.motion_limits import Design, Load, peak_excess, speed_excess, torque_excess
from armdesign.feasibility.needs import joint_needs
from armdesign.feasibility.penalty import (
    JUMP,
    PER_METRE,
    Requirements,
    Shown,
    choose_slides,
    make_penalty,
)
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.motion import Smoothing, smooth_motion
from armdesign.settings import Body, Settings

N, T = 3, 40
TIME = np.linspace(0.0, 2.0, T)


def required(n=N, **sections):
    """Requirements of settings by section, for one demonstration of a hand that moves half a metre."""
    settings = Settings().replace({"design": {"dof": n}, **sections})
    arm = np.zeros((T, 3, 3))
    arm[:, 1] = (0.2, 0.0, 0.1)
    arm[:, 2] = np.stack([0.4 + 0.0 * TIME, 0.25 * TIME, 0.1 + 0.0 * TIME], axis=1)
    limits = np.tile([-4.0, 4.0], (n, 1))
    return Requirements(settings, limits, (False,) * n, (Shown(TIME, arm),))


def arms(count, seed=0):
    """Candidates (rows, bases, paths) and random derivatives of the paths."""
    rng = np.random.default_rng(seed)
    rows, bases, paths = random_arms(rng, count, N, T)
    return rows, bases, paths, rng.normal(size=(count, T, N, 3 * N + 4))


def test_nothing_is_asked_of_a_thin_arm_without_limits():
    assert make_penalty(required(body={"kind": "thin"})) is None


def test_penalty_is_0_for_clear_arms_and_a_jump_and_a_slope_for_others():
    rows, bases, paths, turns = arms(40)
    penalty = make_penalty(required())
    excess, gradient = penalty(rows, bases, [paths], [turns])
    found = penalty.parts.clearance(rows, bases, [paths], [turns])
    assert (excess == np.where(found.violation > 0.0, JUMP + PER_METRE * found.violation, 0.0)).all()
    assert np.array_equal(gradient, PER_METRE * found.slopes)
    assert not gradient[excess == 0.0].any()
    assert 0 < (excess > 0.0).sum() < 40
    assert np.array_equal(penalty(rows, bases, [paths], None)[0], excess)


def test_chosen_slides_of_a_finished_arm_are_those_of_the_search():
    rows, bases, paths, _ = arms(30, seed=1)
    bases[:] = columns((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    wanted = required()
    found = make_penalty(wanted).parts.clearance(rows, bases, [paths])
    slid = np.flatnonzero((found.slides != rows[:, :N, 2]).any(axis=1))
    assert len(slid) > 2
    for k in slid[:3]:
        assert np.array_equal(
            choose_slides(wanted, DHTable.from_rows(rows[k, :, :3]), None, [paths[k]]), found.slides[k]
        )


def test_speeds_are_those_of_the_motion_and_have_their_gradient():
    _, _, paths, turns = arms(6, seed=2)
    wanted = required(needs={"max_speed": [20.0], "max_acceleration": [60.0]})
    needs, smooth = joint_needs(wanted.settings), Smoothing(TIME)
    for k in range(6):
        motion = smooth_motion(TIME, paths[k])
        excess, slope = speed_excess(needs, smooth, paths[k], turns[k])
        shares = np.abs(motion.v).max() / np.deg2rad(20.0), np.abs(motion.a).max() / np.deg2rad(60.0)
        assert excess == pytest.approx(max(max(shares) - 1.0, 0.0), abs=1e-7)
        for e in (0, 5, 12):
            ahead, _ = speed_excess(needs, smooth, paths[k] + 1e-7 * turns[k, :, :, e], None)
            behind, _ = speed_excess(needs, smooth, paths[k] - 1e-7 * turns[k, :, :, e], None)
            assert slope[e] == pytest.approx((ahead - behind) / 2e-7, rel=1e-5, abs=1e-6)


def test_torques_of_a_horizontal_arm_in_closed_form_and_their_gradient():
    table = DHTable([0.0, np.pi / 2.0], [0.0, 0.5], [0.0, 0.0])  # a joint about z, tube of 0.5 m along x
    rows = np.stack([table.alpha, table.a, table.d, 0.0 * table.d], axis=1)
    base = columns((np.pi / 2.0, 0.0, 0.0), (0.0, 0.0, 0.0))  # its axis level, so that gravity turns it
    body = Body()
    settings = Settings().replace({"design": {"dof": 1}, "needs": {"max_torque": [4.0]}})
    needs, smooth, load = (
        joint_needs(settings),
        Smoothing(TIME),
        Load(body, 2.0, placed=False, limits=np.array([[-3.0, 3.0]]), prismatic=(False,)),
    )
    path = np.zeros((T, 1))
    inner = body.tube_diameter / 2.0 - body.tube_wall
    tube = body.tube_density * np.pi * ((body.tube_diameter / 2.0) ** 2 - inner**2) * 0.5
    design = Design(rows, base, np.zeros(1))
    torque = 9.81 * (0.25 * tube + 0.5 * (2.0 + body.tool_mass))
    assert torque_excess(needs, load, smooth, design, path) == pytest.approx(torque / 4.0 - 1.0, rel=1e-6)
    turns = np.zeros((T, 1, 7))
    _, slope = peak_excess(needs, load, smooth, design, path, turns)
    assert slope[4] == pytest.approx(9.81 * (tube + 2.0 + body.tool_mass) / 4.0, rel=1e-3)  # by the tube's length


def test_staying_within_the_swept_volume_has_its_gradient():
    rows, bases, paths, turns = arms(12, seed=3)
    wanted = required(cell={"stay_within": 0.1})
    penalty = make_penalty(wanted)
    excess, gradient = penalty(rows, bases, [paths], [turns])
    assert (excess > JUMP).all()  # random arms are far from there
    slides = penalty.parts.clearance(rows, bases, [paths]).slides
    for e in (0, 4, 7, 12):
        moved = []
        for step in (1e-6, -1e-6):
            there, joints = rows.copy(), paths + step * turns[..., e]
            base = bases.copy()
            if e < 12:
                there[:, e // 3, e % 3] += step
            else:
                cos, sin = np.cos(step), np.sin(step)
                for c in range(0, 9, 3):
                    x, y = bases[:, c].copy(), bases[:, c + 1].copy()
                    base[:, c], base[:, c + 1] = cos * x - sin * y, sin * x + cos * y
            clear, _, _ = penalty.parts.clearance.at_slides(there, base, slides, [joints])
            away, _ = penalty.parts.clearance.beyond(penalty.parts.envelope, Posed(there, base, slides), [joints], None)
            moved.append(JUMP + PER_METRE * (clear + 0.1 * away))
        ahead, behind = moved
        difference = (ahead - behind) / 2e-6
        smooth = np.abs(ahead + behind - 2.0 * excess) < 1e-7
        assert smooth.sum() > 6
        assert np.allclose(gradient[smooth, e], difference[smooth], rtol=1e-4, atol=1e-3)


def test_what_the_base_stands_on_is_for_link_0_alone():
    rows, bases, paths, _ = arms(30, seed=4)
    bases[:, 9:] = (0.1, 0.2, 0.0)
    floor = Obstacles((Obstacle("floor", Plane(), np.eye(4)),))
    wanted = required(cell={"base_at": [0.1, 0.2, 0.0]})
    standing = make_penalty(replace(wanted, demonstrations=(replace(wanted.demonstrations[0], obstacles=floor),)))
    excess, above = standing(rows, bases, [paths], None)[0], make_penalty(wanted)(rows, bases, [paths], None)[0]
    assert (excess >= above - 1e-12).all()
    assert (excess > above).any()
    sunk = bases - np.r_[np.zeros(11), 0.01]
    assert (standing(rows, sunk, [paths], None)[0] > JUMP).all()  # then the base is in the floor


def test_base_region_with_one_feasible_corner_and_the_gradient_leads_there():
    # an upright post of an arm: plate, tube, module, tool, all about one vertical axis; its plate is the widest
    rows = np.zeros((1, 2, 4))
    rows[0, 0, 2], rows[0, 1, 2] = 0.2, 0.1
    left = Obstacle("left", Box(np.array([0.3, 2.0, 2.0])), at(0.15, 0.0, 0.5)[0])
    near = Obstacle("near", Box(np.array([2.0, 0.3, 2.0])), at(0.0, 0.15, 0.5)[0])
    walls = Obstacles((left, near))
    settings = Settings().replace({"design": {"dof": 1}, "cell": {"place": ["x=0..0.4 y=0..0.4 z=0"]}})
    shown = Shown(TIME, np.zeros((T, 1, 3)), walls)
    penalty = make_penalty(Requirements(settings, np.array([[-3.0, 3.0]]), (False,), (shown,)))
    _, plate = capsule_about(settings.body.base_diameter / 2.0, settings.body.base_height)
    free = 0.3 + plate + settings.body.clearance + MARGIN  # from here on both walls are far enough
    places = np.linspace(0.0, 0.4, 21)
    bases = np.array([columns((0, 0, 0), (x, y, 0.0)) for x in places for y in places])
    path = np.zeros((len(bases), T, 1))
    excess, _ = penalty(np.repeat(rows, len(bases), axis=0), bases, [path], None)
    assert np.array_equal(excess == 0.0, (bases[:, 9:11] >= free).all(axis=1))
    assert 0 < (excess == 0.0).sum() < 12
    base = columns((0, 0, 0), (0.28, 0.29, 0.0))[None]
    for _ in range(60):
        cost, gradient = penalty(rows, base, [path[:1]], [np.zeros((1, T, 1, 10))])
        base[:, 9:11] -= 5e-3 * np.sign(gradient[:, 7:9])
        if cost[0] == 0.0:
            break
    assert cost[0] == 0.0


def test_a_base_under_a_box_that_stands_on_the_same_floor_does_not_stand_on_it():
    rows, bases, paths, _ = arms(5, seed=6)
    bases[:] = columns((0, 0, 0), (0, 0, 0))
    wanted = required(cell={"base_at": [0.0, 0.0, 0.0]})
    box = Obstacles((Obstacle("box", Box(np.array([0.4, 0.4, 0.15])), at(0.0, 0.0, 0.075)[0]),))
    penalty = make_penalty(replace(wanted, demonstrations=(replace(wanted.demonstrations[0], obstacles=box),)))
    short = penalty(rows, bases, [paths], None)[0] - JUMP
    assert (short > PER_METRE * 2.0 * 0.03).all()  # the tube of link 0 is inside

"""Every setting can be set, and whatever is set, what a search finds fits together."""

import dataclasses

import numpy as np
import pytest

from armdesign.feasibility.penalty import JUMP
from armdesign.search.search import search
from armdesign.settings.kinds import Choice
from armdesign.settings.sections import SECTIONS, Settings

OPTIONS = [
    ("packaging", {"search": {"algorithm": "pso", "inertia": 0.6, "c1": 1.2, "c2": 0.9, "time_limit": 1000.0},
                   "fitness": {"tie_hand": False, "delta": 0.003}}),
    ("packaging", {"search": {"algorithm": "multibasin", "budget": 150, "effort": "quick", "coarse": 20},
                   "solver": {"start_paths": 3}}),
    ("packaging", {"search": {"algorithm": "rapso", "angle_interval": 1, "c_range": (-0.1, 1.0)},
                   "fitness": {"lambda_f": 1.0, "lambda_E": 0.0}}),
    ("packaging", {"search": {"angle_interval": 7, "range": "box", "seed": 2**63 - 1},
                   "fitness": {"continuity": 2.0}}),
    ("packaging", {"search": {"patience": 1}, "fitness": {"continuity_speed": 60.0}}),
    ("packaging", {"search": {"target": 100.0}, "fitness": {"reach_tolerance": 0.05}}),
    *(("welding", {"fitness": {"orientation_metric": metric, "mount": mount}})
      for metric, mount in (("geodesic", "start"), ("euler", "start"), ("axis", "start"), ("axis", "identity"))),
    ("welding", {"fitness": {"weights": (0.1, 0.1, 0.3), "orientation_weight": 0.5, "mount": "identity"},
                 "solver": {"second_order": False}}),
    ("welding", {"fitness": {"tie_hand": False, "orientation_metric": "euler", "mount": "identity"},
                 "task": {"orientation": "hand"}}),
    ("packaging", {"fitness": {"reach_frames": "all", "reach_tolerance": 0.3},
                   "task": {"outliers": True, "repeats": True, "low_pass": "off"}}),
    ("packaging", {"design": {"base_yaw": (-180.0, 180.0), "joint_limits": ((-120.0, 120.0),)}}),
    ("packaging", {"design": {"base_yaw": (30.0, 30.0), "coaxial_twist": 20.0, "coaxial_offset": 0.2},
                   "task": {"scale": 1.1}}),
    ("packaging", {"design": {"bounds": {"alpha_0": (-80.0, -10.0), "a_1": (0.1, 0.1), "d_tool": (0.05, 0.2)}}}),
    ("packaging", {"design": {"bounds": {"a_tool": (0.0, 0.1), "a_0": (0.0, 0.1), "base_yaw": (-10.0, 20.0)}},
                   "task": {"base_mode": "fixed"}}),
    ("packaging", {"design": {"alpha": (-180.0, 180.0), "a": (0.0, 0.3), "d": (0.0, 0.1), "tool_length": 0.02}}),
    ("packaging", {"design": {"length": (0.7, 0.8), "joint_limits": ((-180.0, 180.0),) * 3 + ((-90.0, 10.0),)}}),
    ("packaging", {"solver": {"starts": 32, "descents": 4, "finalists": 2},
                   "task": {"start": 0.5, "stop": 1.0}}),
    ("packaging", {"solver": {"tolerance": 1e-3, "floor": 1e-6, "max_steps": 5}, "task": {"points": ("hand",)}}),
    ("packaging", {"task": {"low_pass": 6.0, "rate": 25.0, "max_gap": 0.1, "base": "shoulder",
                            "points": ("upper_arm", "hand")}}),
    ("packaging", {"body": {"kind": "thin"}}),
    ("packaging", {"body": {"tube_diameter": 0.03, "tube_wall": 0.002, "tube_density": 1500.0, "joint_mass": 0.3,
                            "joint_diameter": 0.05, "joint_length": 0.04, "base_diameter": 0.08, "base_height": 0.01,
                            "base_mass": 0.5, "tool_mass": 0.1, "tool_inertia": 1e-5, "module_slide": 0.2,
                            "clearance": 0.002},
                   "needs": {"hand_tolerance": 0.01, "tolerance_percentile": 95.0, "max_speed": (500.0,),
                             "max_acceleration": (1e5,), "max_torque": (50.0,), "payload": 0.5}}),
    ("welding", {"needs": {"tolerance_angle": 5.0}}),
    ("packaging", {"cell": {"place": ("x=-0.2..0.4 y=-0.6..0.2 z=0.8..1.1",), "mounted": "any", "stay_within": 0.5}}),
    ("packaging", {"cell": {"base_at": (0.0, -0.3, 0.9), "stand": "floor"}}),
    ("packaging", {"cell": {"place": ("x=-0.3 y=-0.6..0.2 z=0.8..1.2 yaw=0",), "stand": "wall"}}),
    ("packaging", {"cell": {"place": ("x=0..0.3 y=-0.4..0 z=1.8",), "stand": "ceiling"}}),
    *(("packaging", {"cell": {"base_at": (0.0, -0.3, 1.0), "mounted": mounted}})
      for mounted in ("floor", "wall", "ceiling")),
]  # fmt: skip


ELSEWHERE = ("scenario", "effort", "up", "time_unit", "quaternions", "demonstrations", "obstacle_units")
"""Choices that other tests go through."""


def name_of(option):
    scenario, changes = option
    entries = [f"{name}={value}" for table in changes.values() for name, value in table.items()]
    return f"{scenario}-{','.join(entries)}"[:80]


def test_every_parameter_is_tried():
    """Whoever adds a parameter adds a search with another value than the default."""
    tried = {(title, name) for _, changes in OPTIONS for title, table in changes.items() for name in table}
    elsewhere = {
        *(("task", name) for name in ("recording", "files", "file_rate", "units", "up", "mirror", "cut")),
        *(("task", name) for name in ("time_unit", "quaternions", "confidence")),
        ("task", "more_recordings"), ("task", "holdouts"), ("fitness", "demonstrations"),
        ("design", "auto_dof"), ("search", "first"),
        ("design", "dof"), ("fitness", "scenario"), ("search", "particles"),
        ("search", "iterations"), ("search", "prune"),
        ("cell", "obstacles"), ("cell", "obstacle_units"), ("design", "joints"), ("design", "travel"),
        ("body", "modules"), ("body", "inertials"), ("body", "post"),
    }  # fmt: skip
    every = {(kind.title(), name) for kind in SECTIONS for name in kind.names()}
    assert every == tried | elsewhere


def test_every_word_is_tried():
    defaults = Settings().to_dict()
    for kind in SECTIONS:
        for entry in dataclasses.fields(kind):
            if isinstance(entry.metadata["kind"], Choice) and entry.name not in ELSEWHERE:
                values = {changes.get(kind.title(), {}).get(entry.name) for _, changes in OPTIONS}
                values.add(defaults[kind.title()].get(entry.name))
                assert set(entry.metadata["kind"].options) <= values, entry.name


@pytest.mark.parametrize("option", OPTIONS, ids=map(name_of, OPTIONS))
def test_what_comes_out_fits_together(prepared_for, outside, option):
    scenario, changes = option
    prepared = prepared_for(scenario, **changes)
    result = search(prepared)
    check_search(result)
    check_design(result)
    check_path(result)
    check_errors(result, outside)


def check_search(result):
    settings, best = result.problem.settings, result.evaluation
    assert best.fitness == settings.fitness.lambda_f * best.path_fitness + settings.fitness.lambda_E * best.area
    # the search has added at least JUMP to an arm that touches something
    assert best.fitness == result.history.best[-1] or best.fitness <= result.history.best[-1] - JUMP + 1e-12
    length = "budget" if settings.search.algorithm == "multibasin" else "iterations"
    rules = {length} | {rule for rule in ("patience", "target") if getattr(settings.search, rule) is not None}
    assert result.facts.stopped_by in rules
    assert result.facts.stopped_by != "iterations" or len(result.history.best) == settings.search.iterations
    assert result.facts.stopped_by != "target" or best.fitness <= settings.search.target


def check_design(result):
    design, table, space = result.problem.settings.design, result.evaluation.table, result.problem.space
    Phi = space.phi(table)
    assert (space.bounds[0] <= Phi).all()
    assert (space.bounds[1] >= Phi).all()
    assert design.length[0] < table.length < design.length[1]
    coaxial = (np.abs(table.alpha[1:-1]) < np.deg2rad(design.coaxial_twist)) & (table.a[1:-1] < design.coaxial_offset)
    assert not coaxial.any()
    yaw = np.deg2rad(design.bounds.get("base_yaw", design.base_yaw))
    assert yaw[0] <= table.base_yaw <= yaw[1]


def check_path(result):
    settings, task, path = result.problem.settings, result.problem.task, result.evaluation.path
    limits = np.deg2rad(np.broadcast_to(settings.design.joint_limits, (4, 2)))
    assert path.q.shape == (len(task.time), 4)
    assert (path.q >= limits[:, 0] - 1e-12).all()
    assert (path.q <= limits[:, 1] + 1e-12).all()
    speed, step = settings.fitness.continuity_speed, np.deg2rad(settings.fitness.continuity)
    radius = step if speed is None else np.deg2rad(speed) * task.dt
    assert np.linalg.norm(np.diff(path.q, axis=0), axis=1).max() <= radius * (1 + 1e-9)
    assert (np.diff(path.sigma, axis=1) >= 0).all()
    assert ((path.sigma >= 0) & (path.sigma <= 1)).all()
    assert path.start_error <= settings.fitness.reach_tolerance
    assert not settings.fitness.tie_hand or (path.sigma[:, -1] == 1).all()


def check_errors(result, outside):
    """Distances, g, E_t and e_R out of joint angles and sigma alone."""
    fitness, task = result.problem.settings.fitness, result.problem.task
    path, table = result.evaluation.path, result.evaluation.table
    weights, m = np.array(fitness.weights), len(task.points)
    for t in range(0, len(path.q), 7):
        line = outside.corners(table, path.q[t])
        distance = outside.errors(line, path.sigma[t], task.P[t])
        np.testing.assert_allclose(path.distance[t], distance, rtol=0, atol=1e-9)
        e_R = 0.0
        if fitness.orientation_weight:
            e_R = turn_error(
                fitness.orientation_metric, table.frames(path.q[t])[-1][:3, :3] @ path.mount, task.R[t], outside
            )
            assert path.orientation_error[t] == pytest.approx(e_R, abs=1e-7)
        g = np.sqrt(np.sum(weights * distance**2)) / m + (fitness.orientation_weight or 0.0) * path.orientation_error[t]
        assert path.g[t] == pytest.approx(g, abs=1e-9)
        assert path.area[t] == pytest.approx(outside.areas(line, path.sigma[t], task.P[t], fitness.delta), abs=1e-8)
    assert result.evaluation.path_fitness == pytest.approx(path.g.mean(), abs=1e-12)
    assert result.evaluation.area == pytest.approx(path.area.mean(), abs=1e-12)
    if fitness.orientation_weight and fitness.mount == "start":
        assert path.orientation_error[0] < 1e-7
    if fitness.mount == "identity":
        np.testing.assert_array_equal(path.mount, np.eye(3))


def turn_error(metric, R, wanted, outside):
    """e_R in the method's three metrics."""
    if metric == "geodesic":
        return outside.turn(R.T @ wanted)
    if metric == "axis":
        return float(np.arctan2(np.linalg.norm(np.cross(R[:, 2], wanted[:, 2])), R[:, 2] @ wanted[:, 2]))
    difference = roll_pitch_yaw(R) - roll_pitch_yaw(wanted)
    return float(np.linalg.norm(np.pi - (np.pi - difference) % (2 * np.pi)))


def roll_pitch_yaw(R):
    """R = Rz(yaw) Ry(pitch) Rx(roll)."""
    return np.array([np.arctan2(R[2, 1], R[2, 2]), np.arcsin(-R[2, 0]), np.arctan2(R[1, 0], R[0, 0])])

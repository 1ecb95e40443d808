"""HRDF: a reader of the published format finds the tool where the DH table has it, and the kit's pieces in it."""

import ast
import csv
import operator
import re
import xml.etree.ElementTree as ET
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import armdesign
from armdesign.bodies.arm_body import arm_body
from armdesign.building.catalogue import find_catalogue
from armdesign.building.hrdf import hrdf
from armdesign.building.kit import kit_arm
from armdesign.building.record import recorded_build
from armdesign.cli import app
from armdesign.errors import CatalogueError
from armdesign.kinematics.dh import DHTable
from armdesign.runs.reading import read_result
from armdesign.runs.writing import write_result
from armdesign.search.evaluation import evaluate_design
from armdesign.settings import Body

EXAMPLE = Path(__file__).parents[2] / "examples" / "packaging.csv"

OPERATORS = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv}
HEIGHTS = {"X5": 0.03105, "X8": 0.0451, "R8": 0.051, "T5": 0.034, "T8": 0.0475}
BRACKETS = {
    "LightLeft": (-1, 0.043, 0.04), "LightRight": (1, -0.043, 0.04),
    "HeavyLeftInside": (-1, -0.0225, 0.055), "HeavyLeftOutside": (-1, 0.0375, 0.055),
    "HeavyRightInside": (1, 0.0225, 0.055), "HeavyRightOutside": (1, -0.0375, 0.055),
}  # fmt: skip
"""Turn about x in right angles, y and z of the output."""


def formula(text):
    """A floating point formula of the format: numbers, pi, + - * / and parentheses."""

    def value(node):
        match node:
            case ast.Constant(value=float() | int() as number):
                return float(number)
            case ast.Name(id="pi"):
                return np.pi
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return -value(inner)
            case ast.BinOp(left=left, op=op, right=right):
                return OPERATORS[type(op)](value(left), value(right))
        raise ValueError(text)

    return value(ast.parse(text.strip(), mode="eval").body)


def turn(axis, angle):
    i, j = [(1, 2), (2, 0), (0, 1)]["xyz".index(axis)]
    R = np.eye(4)
    R[i, i] = R[j, j] = np.cos(angle)
    R[i, j], R[j, i] = -np.sin(angle), np.sin(angle)
    return R


def rotation(text):
    """A rotation matrix of the format: nine numbers, row by row, or a product of Rx, Ry, Rz."""
    R = np.eye(4)
    if "R" not in text:
        R[:3, :3] = np.reshape([float(x) for x in text.split()], (3, 3))
        return R
    for axis, angle in re.findall(r"R([xyz])\(([^()]*)\)", text):
        R = R @ turn(axis, formula(angle))
    return R


def pose(attributes, prefix):
    """A frame given by ``PREFIXrot`` and ``PREFIXtrans``."""
    T = rotation(attributes.get(f"{prefix}rot", "1 0 0 0 1 0 0 0 1"))
    T[:3, 3] = [float(x) for x in attributes.get(f"{prefix}trans", "0 0 0").split()]
    return T


def output(tag, attributes):
    """The output frame of an element that does not move, in that of its input."""
    if tag in ("rigid-body", "end-effector"):
        return pose(attributes, "output_")
    T = np.eye(4)
    if tag == "bracket":
        turns, T[1, 3], T[2, 3] = BRACKETS[attributes["type"][2:]]
        return T @ turn("x", turns * np.pi / 2.0)
    assert tag == "link"
    x, twist, c = formula(attributes["extension"]), formula(attributes["twist"]), 0.02
    ends = (attributes.get("input", "RightAngle"), attributes.get("output", "RightAngle"))
    if ends == ("RightAngle", "RightAngle"):
        T[:3, 3] = [x, -c * np.sin(twist), c * (1.0 + np.cos(twist))]
        return T @ turn("x", twist)
    if ends == ("Inline", "RightAngle"):
        T[:3, 3] = [-c * np.cos(twist), -c * np.sin(twist), x]
        T[:3, :3] = [[0, -np.sin(twist), -np.cos(twist)], [0, np.cos(twist), -np.sin(twist)], [1, 0, 0]]
        return T
    assert ends == ("RightAngle", "Inline")
    T[:3, 3] = [x, 0.0, c]
    T[:3, :3] = [[0, 0, 1], [np.sin(twist), np.cos(twist), 0], [-np.cos(twist), np.sin(twist), 0]]
    return T


def tool_of(text, q):
    """Pose of the end effector by the published format, angles in the order of the actuators, n of them [rad]."""
    robot = ET.fromstring(text)
    assert (robot.tag, robot.get("version")) == ("robot", "1.6.0")
    T, angles = pose(robot.attrib, ""), list(q)
    for element in robot:
        if element.tag == "actuator":
            T = T @ turn("z", angles.pop(0))
            T[:3, 3] += HEIGHTS[element.get("type")[:2]] * T[:3, 2]
        else:
            T = T @ output(element.tag, element.attrib)
    assert not angles
    return T


def fits(text):
    """Whether neighbours have matching interfaces; a rigid body fits anything."""
    kinds = [element.tag for element in ET.fromstring(text)]
    joined = {("actuator", "link"), ("actuator", "bracket"), ("link", "actuator"), ("bracket", "actuator")}
    free = {"rigid-body", "end-effector"}
    return all(pair in joined or free & set(pair) for pair in pairwise(kinds))


def same_tool(table, catalogue, rng):
    actuators = [catalogue.actuators[i] for i in rng.integers(len(catalogue.actuators), size=table.dof)]
    made = kit_arm(table, [each.height for each in actuators], catalogue.kit)
    text = hrdf(arm_body(table, Body()), actuators, catalogue.kit, "<arm & co>")
    assert fits(text)
    for _ in range(5):
        q = rng.uniform(-np.pi, np.pi, table.dof)
        assert tool_of(text, np.array(made.signs) * q) == pytest.approx(table.frames(q)[-1], abs=1e-9)


@pytest.mark.parametrize("family", ["hebi", "hebi-x"])
def test_any_arm_reads_back_with_the_same_tool(family):
    rng, catalogue = np.random.default_rng(3), find_catalogue(family)
    for n in (1, 2, 3, 5, 7):
        rows = rng.uniform(-1.0, 1.0, (n + 1, 4)) * [np.pi, 0.4, 0.4, np.pi]
        same_tool(DHTable.from_rows(rows, float(rng.uniform(-3, 3))), catalogue, rng)


@pytest.mark.parametrize("family", ["hebi", "hebi-x"])
def test_arms_of_the_kit_are_made_of_it_alone(family):
    """Random pieces put together: the kit is found again in their DH table, and reads back with the same tool."""
    rng, catalogue = np.random.default_rng(4), find_catalogue(family)
    kit = catalogue.kit
    for n in (2, 3, 4, 6):
        for _ in range(6):
            actuators = [catalogue.actuators[i] for i in rng.integers(len(catalogue.actuators), size=n)]
            table, pieces = put_together(rng, kit, [each.height for each in actuators])
            made = kit_arm(table, [each.height for each in actuators], kit)
            assert made.whole
            text = hrdf(arm_body(table, Body()), actuators, kit)
            q = rng.uniform(-np.pi, np.pi, n)
            assert tool_of(text, np.array(made.signs) * q) == pytest.approx(table.frames(q)[-1], abs=1e-9)
            masses = [float(x.get("mass")) for x in ET.fromstring(text).iter("rigid-body")]
            assert sum(masses) == 0.0
            assert sum(1 for x in ET.fromstring(text) if x.tag in ("link", "bracket")) == len(pieces) == n - 1


def put_together(rng, kit, heights):
    """A DH table of random pieces, turned round joints among them, and the pieces."""
    n, pieces = len(heights), [kit.pieces[i] for i in rng.integers(len(kit.pieces), size=len(heights) - 1)]
    rows = np.zeros((n + 1, 4))
    u, w = [], []
    for k, piece in enumerate(pieces):
        x = rng.uniform(kit.shortest, 0.4)
        rows[k + 1, 0] = rng.choice([-1, 1]) * np.pi / 2 if piece.square else rng.uniform(-np.pi, np.pi)
        rows[k + 1, 1] = x if piece.extends == "a" else 0.0
        u.append(x if piece.extends == "u" else piece.u)
        w.append(x if piece.extends == "w" else piece.w)
    rows[:n, 2] = np.array(heights) + np.r_[u, 0.1] + np.r_[0.2, w]
    rows[n, 2] = 0.15
    for i in range(1, n - 1):
        if rng.random() < 0.5:  # a joint's axis may as well point the other way
            rows[i, 2] *= -1.0
            rows[i : i + 2, 0] += np.pi
    return DHTable.from_rows(rows), pieces


def test_what_cannot_be_written():
    catalogue = find_catalogue("hebi")
    table = DHTable.from_rows(np.full((3, 3), 0.2), joints="RP")
    with pytest.raises(CatalogueError) as error:
        hrdf(arm_body(table, Body()), catalogue.actuators[:2], catalogue.kit)
    assert error.value.value == "RP"


@pytest.fixture(scope="module")
def kit_build(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kit")
    write_result(folder / "run", armdesign.design(EXAMPLE, dof=3, budget=300))
    flags = ["--catalogue", "hebi", "--payload", "0.3", "--speed", "auto"]
    flags += ["--out", str(folder / "arm"), "--quiet"]
    outcome = CliRunner().invoke(app, ["build", str(folder / "run"), *flags])
    assert outcome.exit_code == 0, outcome.stderr
    return folder / "arm"


def test_build_snaps_to_the_kit_and_is_exported(kit_build, tmp_path):
    outcome = CliRunner().invoke(app, ["export", str(kit_build), "--format", "hrdf", "--out", str(tmp_path)])
    assert outcome.exit_code == 0, outcome.stderr
    text, built = (tmp_path / "arm.hrdf").read_text(), read_result(kit_build)
    made = recorded_build(built).pieces
    assert made.whole
    assert fits(text)
    for q in np.random.default_rng(1).uniform(-2.0, 2.0, (5, 3)):
        assert tool_of(text, np.array(made.signs) * q) == pytest.approx(built.table.frames(q)[-1], abs=1e-9)
    assert evaluate_design(built.table, built.problem).fitness == pytest.approx(built.fitness, abs=1e-9)
    parts = list(csv.DictReader((kit_build / "parts.csv").open()))
    assert sum(row["source"] == "hebi" and row["part"].startswith(("link", "bracket")) for row in parts) == 2
    links = [each for each in made.placed if each.piece.extends]
    cuts = [float(row["length [mm]"]) for row in csv.DictReader((kit_build / "cuts.csv").open())]
    assert cuts == pytest.approx([each.extension * 1e3 - 25.4 for each in links], abs=0.06)
    modules = built.problem.settings.body.modules
    actuators = {a.name: a for a in find_catalogue("hebi").actuators}
    names = [x.get("type") for x in ET.fromstring(text).iter("actuator")]
    assert [m[2] for m in modules] == pytest.approx([actuators[name].mass + 0.214 for name in names])


def test_other_builds_have_no_hrdf(kit_build, tmp_path):
    run = str(kit_build.parent / "run")
    flags = ["--catalogue", "rmd", "--payload", "0.3", "--no-snap", "--out", str(tmp_path / "rmd"), "--quiet"]
    assert CliRunner().invoke(app, ["build", run, *flags]).exit_code in (0, 3)  # whether or not its parts fit
    outcome = CliRunner().invoke(app, ["export", str(tmp_path / "rmd"), "--format", "hrdf", "--out", str(tmp_path)])
    assert (outcome.exit_code, "hebi" in outcome.stderr) == (2, True)

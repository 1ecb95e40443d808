"""Builds: run folders like any other, with the masses and limits of their parts, and the lists of what they take."""

import csv
import json
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from functools import cache
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import armdesign
from armdesign.bodies.loads import base_gravity, joint_torques
from armdesign.building import RECORD, tubes
from armdesign.building.assembly import assemble
from armdesign.building.assembly_steps import HUNG, base_place, base_turn, holding, screw_words, surface
from armdesign.building.build import build, settled_parts, thinner
from armdesign.building.build_options import BuildOptions
from armdesign.building.catalogue import find_catalogue, shipped
from armdesign.building.clocking import clock_of, clock_words, mark_of
from armdesign.building.part_dimensions import part_dimensions
from armdesign.building.part_drawing import part_sheet
from armdesign.building.part_lists import GROUPS, grouped_bill, part_lists
from armdesign.building.part_tolerances import link_deviations
from armdesign.building.parts import Assembly, file_name
from armdesign.building.parts_clearance import PartsGap
from armdesign.building.record import build_record, recorded_build, recorded_origin
from armdesign.building.room import room_of_parts
from armdesign.building.settling import candidates, changed
from armdesign.building.sheet import number
from armdesign.building.shop import FLOOR, TOOL, shop_of
from armdesign.cli import app
from armdesign.cli.tolerance_command import part_deviations
from armdesign.errors import CatalogueError, SettingsError
from armdesign.export.mjcf import robot_mjcf
from armdesign.export.robot_file import finished_robot
from armdesign.feasibility.violations import figure
from armdesign.kinematics.motion import SmoothMotion
from armdesign.runs.reading import read_result
from armdesign.runs.writing import write_result
from armdesign.search.evaluation import evaluate_design
from armdesign.search.result import Result

EXAMPLE = Path(__file__).parents[2] / "examples" / "packaging.csv"


@pytest.fixture(scope="module")
def design():
    return armdesign.design(EXAMPLE, dof=3, budget=300, seed=3)  # whose parts fit without snapping


@pytest.fixture(scope="module")
def folder(design, tmp_path_factory):
    place = tmp_path_factory.mktemp("build") / "run"
    write_result(place, design)
    return place


@pytest.fixture(scope="module")
def built(design):
    """Builds of the design by their options, each made once."""
    return cache(lambda options: build(design, options))


@pytest.fixture(scope="module")
def made(built):
    return built(BuildOptions("rmd", payload=0.5, stock="aluminium", snap=False))


def test_the_built_arm_follows_the_task_within_the_torques_of_its_data_sheets(made):
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(robot_mjcf(finished_robot(made.result)))
    peaks = np.array([a.peak_torque for a in made.choice.actuators])
    assert model.actuator_forcerange == pytest.approx(np.stack([-peaks, peaks], axis=1))
    data, time, q = mujoco.MjData(model), made.result.problem.task.time, made.result.evaluation.path.q
    data.qpos[:] = q[0]
    off, step = [], model.opt.timestep
    for now in np.arange(time[0] - 0.5, time[-1], step):  # half a second to settle
        wanted = np.array([np.interp(now, time, angle) for angle in q.T])
        data.ctrl[:] = wanted
        mujoco.mj_step(model, data)
        if now > time[0]:
            off.append(np.linalg.norm(data.body("tool0").xpos - made.result.table.frames(wanted)[-1, :3, 3]))
            assert (np.abs(data.actuator_force) <= peaks * (1 + 1e-9)).all()
    assert np.mean(off) < 3e-3
    assert np.max(off) < 8e-3


def test_build_is_a_run_folder_with_the_parts_in_it(folder, design, tmp_path):
    out = tmp_path / "arm"
    flags = ["--catalogue", "rmd", "--payload", "0.5", "--stock", "aluminium", "--no-snap", "--out", str(out)]
    outcome = CliRunner().invoke(app, ["build", str(folder), *flags])
    built = read_result(out)
    fault = recorded_build(built).fault  # the same said of it where it cannot be built, with exit code 3
    assert outcome.exit_code == (3 if fault else 0), outcome.stderr
    assert fault in " ".join(outcome.stderr.split())
    again = evaluate_design(built.table, built.problem)
    assert built.fitness == pytest.approx(design.fitness, abs=1e-9)
    assert again.fitness == pytest.approx(built.fitness, abs=1e-9)
    by_name = {a.name: a for a in find_catalogue("rmd").actuators}
    parts = unwarned(out / "parts.csv", "part", "quantity", fault)
    pieces = [by_name[row["part"]] for row in parts if row["part"] in by_name for _ in range(int(row["quantity"]))]
    modules = built.problem.settings.body.modules
    assert sorted(m[2] for m in modules) == sorted(a.mass for a in pieces)
    assembly = recorded_build(built).assembly
    assert float(parts[-1]["mass [kg]"]) == pytest.approx(sum(p.part.mass for p in assembly.placed), rel=1e-3)
    screws = sum(int(row["quantity"]) for row in parts if row["part"].startswith("screw "))
    assert screws == sum(each.count for each in assembly.screws)
    nuts = sum(int(row["quantity"]) for row in parts if row["part"].startswith("locking nut"))
    assert nuts == 2 * sum(each.part.kind == "tube" for each in assembly.placed)
    limits = [
        joint.find("limit") for joint in ET.parse(out / "arm.urdf").iter("joint") if joint.find("limit") is not None
    ]
    assert sorted(float(x.get("effort")) for x in limits) == sorted(a.peak_torque for a in pieces)
    assert part_deviations(built) == link_deviations(assembly, built.table.dof)
    assert part_deviations(design) == ()
    cuts = unwarned(out / "cuts.csv", "mark", "length [mm]", fault)
    tubes = {each.mark: each.part.sizes["length"] for each in assembly.placed if each.part.kind == "tube"}
    assert {row["mark"]: float(row["length [mm]"]) for row in cuts} == pytest.approx(
        {mark: 1e3 * length for mark, length in tubes.items()}, abs=0.006
    )
    lines = [line for group in grouped_bill(recorded_build(built)).values() for line in group]
    assert sum(line.quantity for line in lines) == pytest.approx(sum(float(row["quantity"]) for row in parts[:-1]))
    assert sum(line.mass for line in lines if line.mass is not None) == pytest.approx(
        float(parts[-1]["mass [kg]"]), rel=1e-3
    )
    assert [line.mass for line in lines if "screw" in line.part] == [None] * sum("screw" in x.part for x in lines)
    assert recorded_origin(built).error == design.verdict.hand_error.max
    listed = {row["part"]: (row["group"], int(row["quantity"])) for row in parts if row["group"] == "made"}
    counted = {name: ("made", len(each)) for name, (part, each) in assembly.counted().items()
               if not part.bought and part.kind != "tube"}  # fmt: skip
    assert listed == counted
    groups = [row["group"] for row in parts[:-1]]
    assert groups == sorted(groups, key=list(GROUPS).index)
    assert set(groups) == {"bought", "cut", "made", "screws", "not chosen"}
    assert any(row["part"].startswith("not chosen: power supply") for row in parts)
    page = (out / "assembly.html").read_text()
    assert all(f"× {name} (" in page for name in counted)
    for joint in range(1, built.table.dof + 1):  # on the bench: later a flange may cover the screws
        first = page.index(f"J{joint} to J{joint}-L{joint - 1}:")
        assert first < page.index(f"Link {joint - 1}<" if joint > 1 else "Base<")
    assert all(f">{each.mark}<" in page for each in assembly.placed if "flange" not in each.part.kind)
    plate = next(each for each in assembly.placed if each.mark == "B")
    foot = plate.pose @ [0.0, 0.0, -plate.part.sizes["thickness"] / 2.0, 1.0]
    tool = 1e3 * (built.table.frames(np.zeros(3))[-1, :3, 3] - foot[:3])
    assert all(f"<td>{number(x)}</td>" in page for x in tool)
    for command in (["check"], ["export", "--format", "mjcf,drawing", "--out", str(tmp_path / "x")]):
        assert CliRunner().invoke(app, [command[0], str(out), *command[1:]]).exit_code in (0, 3)
    made = [name for name, (part, _) in assembly.counted().items() if not part.bought]
    drawn = tmp_path / "x" / "drawing"
    assert {path.stem for path in drawn.glob("*.svg")} == {"arm", "overview", *(file_name(name) for name in made)}
    assert (drawn / "drawings.pdf").read_bytes().count(b"/Type /Page ") == len(made) + 2
    for name, (part, places) in assembly.counted().items():
        if part.bought:
            continue
        sheet = part_sheet(places, assembly.screws, "arm", "1 of 1")
        boxes = [(words.text, words.box) for words in sheet.words]
        assert not [(a[0], b[0]) for a, b in combinations(boxes, 2) if a[1].overlaps(b[1])], name
        left, bottom, right, top = sheet.extent
        assert (left, bottom, right, top) == pytest.approx((20.0, 10.0, 410.0, 287.0)), name
        texts = [words.text for words in sheet.words]
        assert {dimension.text for dimension in part_dimensions(part)} <= set(texts), name
        for holes in part.circles.values():
            assert any(f"{holes.count} ×" in text and holes.thread in text for text in texts) or holes.maker
            assert not holes.maker or any(f"maker's drawing of the {holes.maker}" in text for text in texts)


def unwarned(path, first, number, fault):
    """The rows of a list; of a build that is not to be made without its first, which says so and counts nothing."""
    rows = list(csv.DictReader(path.open()))
    if fault:
        assert (rows[0][first], float(rows[0][number])) == (f"NOT TO BE MADE: {fault}", 0.0)
    return rows[1:] if fault else rows


def test_lists_of_what_is_not_to_be_made_say_so_first(made, tmp_path):
    for wrong in (replace(made, assembly=None, misfit="why"),
                  replace(made, measured=(PartsGap(0.0, ("J2-L1", "J2-L2"), np.zeros(3), 2),))):  # fmt: skip
        for name, text in part_lists(wrong).items():
            (tmp_path / name).write_text(text)
        unwarned(tmp_path / "parts.csv", "part", "quantity", wrong.fault)
        assert len(unwarned(tmp_path / "cuts.csv", "mark", "length [mm]", wrong.fault)) > 1
        assert wrong.warning == f"NOT TO BE MADE: {wrong.fault}"


def test_gaps_of_a_recorded_build_are_measured_when_asked_for(made, tmp_path, monkeypatch):
    place = tmp_path / "arm"
    write_result(place, made.result)
    (place / RECORD).write_text(build_record(made, made.result))
    calls = []
    monkeypatch.setattr("armdesign.building.build.parts_gap", lambda *given: calls.append(given))
    again = recorded_build(read_result(place))
    assert (again.assembly is not None, calls) == (True, [])
    assert (again.gap, again.fits, len(calls)) == (None, 2, 1)
    assert again.choice.actuators == made.choice.actuators


def test_check_measures_the_parts_of_a_build(made, tmp_path, monkeypatch):
    place = tmp_path / "arm"
    write_result(place, made.result)
    (place / RECORD).write_text(build_record(made, made.result))
    for value, code in ((0.00237, 0), (0.0005, 3)):
        gap = PartsGap(value, ("J2-L1", "J2-L2"), np.zeros(3), 2)
        monkeypatch.setattr("armdesign.building.build.parts_gap", lambda *_, gap=gap: gap)
        outcome = CliRunner().invoke(app, ["check", str(place)])
        assert outcome.exit_code == code
        lines = outcome.output.splitlines()
        assert f"{figure(1e3 * value)} mm" in outcome.output
        assert "bracket J2-L1" in " ".join(outcome.output.split())
        if code == 0:  # nothing comes nearer, so it is told before what does not
            told = [k for k, line in enumerate(lines) if line.startswith("On the ")]
            assert lines[told[0]].startswith("On the motion bracket J2-L1")
        assert ("NOT TO BE MADE" in outcome.output) == (code == 3)
        said = json.loads(CliRunner().invoke(app, ["check", str(place), "--json"]).stdout)
        assert (said["parts"]["gap"], bool(said["parts"]["fault"]), said["feasible"]) == (value, code == 3, code == 0)
    assert not armdesign.check(place).passed  # the last gap is too small
    assert not armdesign.check(made).passed
    assert armdesign.check(made.result).passed


def test_what_the_base_is_screwed_to_is_named(made):
    screws = next(each for each in made.assembly.screws if each.joins == ("B", FLOOR))
    words = " ".join(screw_words([screws], "ceiling"))
    assert words.startswith("B to ceiling: 4 × M6 x ")
    assert surface(made) == HUNG[made.result.plate_side][1]
    assert all(word in base_place(made) for word in (surface(made), f"mm {HUNG[made.result.plate_side][0]} the point"))
    deep = replace(screws, joins=("L1-T1", TOOL), most=0.0145)
    assert "at most 14.5 mm under the head" in screw_words([deep])[0]
    own = replace(screws, joins=("J2", "J2-L1"))
    assert "holes of J2" in screw_words([own])[0]


def test_how_the_bracket_on_the_base_is_turned_is_said(made):
    (words,) = base_turn(made)
    turn = np.radians(float(re.search(r"points ([\d.]+)° counterclockwise", words)[1]))
    base, bracket = (next(each for each in made.assembly.placed if each.mark == mark) for mark in ("B", "B-L0"))
    way = bracket.pose[:3, :3] @ np.diff(bracket.part.scribes[0], axis=0)[0]
    line = base.pose[:3, :2] @ [np.cos(turn), np.sin(turn)]
    assert line @ way == pytest.approx(np.linalg.norm(way - way @ base.pose[:3, 2] * base.pose[:3, 2]), rel=1e-4)


def test_a_pose_that_asks_more_than_an_actuator_bears_for_long_is_said(made):
    pose = made.result.evaluation.path.q[0]
    still = SmoothMotion(*(np.stack([each]) for each in (pose, 0.0 * pose, 0.0 * pose)))
    needed = np.abs(joint_torques(made.result.body, still, gravity=base_gravity(made.result.base_pose))[0])
    for share, heavy in ((0.99, True), (1.01, False)):
        sizes = tuple(replace(a, rated_torque=share * x) for a, x in zip(made.choice.actuators, needed, strict=True))
        said = holding(replace(made, choice=replace(made.choice, actuators=sizes)), pose)
        assert bool(said) == heavy
        assert all(f"J{joint} " in said for joint in range(1, len(pose) + 1)) == heavy


def test_actuators_are_in_their_middle_where_the_task_has_its_own(made):
    for joint, actuator in enumerate(made.choice.actuators, start=1):
        clock = clock_of(made, joint)
        assert abs(clock.middle - (clock.low + clock.high) / 2.0) <= np.radians(2.5) + 1e-12
        assert clock.low <= made.result.evaluation.path.q[:, joint - 1].min() + 1e-9
        assert clock.reading(clock.middle, np.pi) == np.pi
        assert clock.spare(2.0 * np.pi) == pytest.approx(
            min(min(x, 2.0 * np.pi - x) for x in (clock.reading(q, np.pi) for q in (clock.low, clock.high)))
        )
        # the joint turned on by 10 degrees, its bracket is there, seen against the axis or along it
        pose = {each.mark: each for each in made.assembly.placed}[f"J{joint}"].pose
        words = " ".join(clock_words(made, joint))
        assert f"J{joint} turns from" in words
        assert ("own zero" in words) == (not actuator.position)
        assert clock.way == np.sign(pose[2, 2])


def test_bracket_turns_about_the_output_as_the_joint_does(made):
    placed = {each.mark: each for each in made.assembly.placed}
    for joint in range(1, made.result.table.dof + 1):
        clock, name = clock_of(made, joint), f"J{joint}"
        q = np.zeros(made.result.table.dof)
        seen = []
        for q[joint - 1] in (clock.middle, clock.middle + 0.1):
            poses = {each.mark: pose for each, pose in made.assembly.posed(made.result.table, q)}
            out = -poses[name][:3, 2]  # towards who looks at the output
            first, last = (
                poses[f"{name}-L{k}"][:3, :3] @ mark_of(placed[f"{name}-L{k}"])[1] for k in (joint - 1, joint)
            )
            seen.append(np.arctan2(np.cross(first, last) @ out, first @ last))
        assert np.cos(seen[0] - clock.between) == pytest.approx(1.0)
        # the output turns the other way about against its housing, and reads more where that is anticlockwise
        assert np.sin(seen[1] - seen[0]) == pytest.approx(-np.sin(0.1) * clock.way, abs=2e-3)
        assert clock.reading(clock.middle + 0.1, 0.0) == pytest.approx(0.1 * clock.way)


def test_what_is_wrong_with_a_build_is_said(made):
    made = replace(made, assembly=Assembly((), ()))
    apart = replace(made, measured=(PartsGap(0.004, ("J2-L1", "J2-L2"), np.zeros(3), 2),))
    assert (apart.fault, apart.fits) == ("", 2) == (apart.remedy("runs/a"), 2)
    met = replace(made, measured=(PartsGap(0.0, ("J2-L1", "J2-L2"), np.zeros(3), 2),))
    assert all(word in met.fault for word in ("J2-L1 meets J2-L2", "joint 2"))
    words, command = met.remedy("runs/a").split("\n")
    assert command.startswith("  armdesign search --config runs/a/settings.toml --joint-diameter 0.")
    assert words.endswith(":")
    spacious = {"body": room_of_parts(made.result.problem.settings.body)}
    again = replace(met, before=Result(made.result.problem.with_settings(spacious), made.result.evaluation, name="b"))
    assert "--seed 4 --out runs/a-again" in again.remedy("runs/a")
    assert "do not fit" in replace(made, assembly=None, misfit="why").fault
    just = PartsGap(0.0009999999999999937, ("J1-L0", "J1-L1"), np.zeros(3), 1)  # 1 mm by design, less rounding
    assert not just.met
    assert just._replace(value=0.999e-3).met
    strict = made.result.problem.with_settings({"needs": {"hand_tolerance": 1e-6}})
    missed = replace(apart, result=Result(strict, made.result.evaluation, name="strict"))
    assert "hand misses" in missed.fault
    assert replace(missed, before=None).remedy("runs/a") == replace(missed, before=missed.result).remedy("runs/a") == ""
    assert "armdesign search" in replace(missed, before=made.result).remedy("runs/a")  # its parts have cost it the task


def test_only_actuators_of_known_holes_where_asked(design):
    sizes = find_catalogue("dynamixel-x").actuators
    known = candidates(sizes, BuildOptions("dynamixel-x", known_holes=True))
    assert known == tuple(a for a in sizes if a.name.startswith(("XM", "XH")))
    assert candidates(sizes, BuildOptions("dynamixel-x")) == sizes
    with pytest.raises(CatalogueError, match="bolt patterns"):
        build(design, BuildOptions("rmd", known_holes=True))


def test_thinner_tubes_are_tried_where_no_actuator_bears_the_assumed_ones(design, tmp_path):
    known = ("axis_from_end", "horn", "side_holes", "back_holes", "output_")  # it has room for round actuators alone
    lines = shipped()["dynamixel-x"].read_text().splitlines()
    (tmp_path / "round.toml").write_text("\n".join(line for line in lines if not line.startswith(known)))
    options = BuildOptions(str(tmp_path / "round.toml"), snap=False)
    with pytest.raises(CatalogueError, match="joint 1"):
        settled_parts(design, options)
    made = build(design, options)
    assert made.tube in thinner(design, options)
    body = made.result.problem.settings.body
    assert body.tube_diameter == made.tube.diameter < design.problem.settings.body.tube_diameter
    assert (made.fits, body.post) == (2, pytest.approx(0.06))  # the plate stands so far away that brackets fit between
    assert replace(body, post=0.01).reach == pytest.approx(body.reach - 0.05)
    near = changed(made.result, {"body": {"post": 0.0}}).body
    with pytest.raises(CatalogueError, match="link 0"):
        assemble(near, made.choice.actuators, shop_of(body, made.tube, printed=False))
    assert all(used.met for used in made.choice.shortfalls)
    assert thinner(design, replace(options, payload=100.0)) == []
    assert thinner(design, replace(options, payload=1.0, stock="aluminium")) == []
    own = design.problem.with_settings({"body": {"tube_diameter": 0.03}})
    assert thinner(Result(own, design.evaluation, name="own"), options) == []


def test_slower_where_asked(design, built):
    with pytest.raises(CatalogueError) as error:
        build(design, BuildOptions("dynamixel-p", payload=40.0))
    assert "joint" in str(error.value)
    assert error.value.value > 1.0
    fast = build(design, BuildOptions("rmd", payload=1.0, speed=0.5, snap=False))
    task, before = fast.result.problem.task, design.problem.task
    assert np.ptp(task.time) == pytest.approx(2.0 * np.ptp(before.time))
    assert np.asarray(fast.result.verdict.peak_speed) == pytest.approx(
        np.asarray(built(BuildOptions("rmd", payload=1.0, snap=False)).result.verdict.peak_speed) / 2.0, rel=0.1
    )


def test_cheapest_is_no_dearer_than_the_lightest(design, built):
    light = built(BuildOptions("rmd", payload=1.0, snap=False)).choice.actuators
    cheap = build(design, BuildOptions("rmd", payload=1.0, least="price", snap=False)).choice
    assert all(a.price is not None for a in cheap.actuators)
    if all(a.price is not None for a in light):
        assert cheap.cost <= sum(a.price for a in light)


@pytest.mark.parametrize("printed", [True, False])  # the next test shares the last build
def test_snapped_lengths_are_whole_cuts_and_twists_those_of_brackets(built, printed, tmp_path):
    made = built(BuildOptions("rmd", payload=0.5, printed=printed))
    table, before = made.result.table, made.before
    free = np.r_[table.a[1:-1], table.d[1:-1]] * 1e3
    assert free == pytest.approx(np.round(free), abs=1e-9)
    turns = table.alpha / (np.pi / 2.0)
    assert printed or turns == pytest.approx(np.round(turns), abs=1e-12)
    # any twist cannot be much worse than the design: lengths move by half a millimetre, and all is fitted again
    assert not printed or made.result.fitness < 1.1 * before.fitness
    rounded = built(BuildOptions("rmd", payload=0.5, snap=False)).result
    assert before.fitness == rounded.fitness
    write_result(tmp_path / "arm", made.result)
    again = read_result(tmp_path / "arm")
    assert evaluate_design(again.table, again.problem).fitness == pytest.approx(made.result.fitness, abs=1e-9)


def test_snapping_beats_rounding_alone(design, built):
    made = built(BuildOptions("rmd", payload=0.5))
    table, space = design.table, design.problem.space
    rows = np.stack(
        [np.round(table.alpha / (np.pi / 2)) * np.pi / 2, np.round(table.a, 3), np.round(table.d, 3)], axis=1
    )
    rounded = armdesign.DHTable.from_rows(rows, table.base_yaw)
    scores, _ = made.before.problem.objective().evaluate(space.phi(rounded)[None])
    assert made.result.fitness < scores.fitness[0]


def test_bad_input(design, folder, tmp_path):
    coarse = tmp_path / "coarse.toml"  # what is cut to half a metre leaves these arms no length
    text = (Path(tubes.__file__).parent / "stock" / "aluminium.toml").read_text()
    coarse.write_text(text.replace("cut = 0.001", "cut = 0.5"))
    with pytest.raises(CatalogueError, match="steps of 500 mm"):
        build(design, BuildOptions("rmd", payload=0.3, stock=str(coarse)))
    with pytest.raises(CatalogueError, match="even at 2 %") as error:
        build(design, BuildOptions("dynamixel-p", payload=400.0, speed="auto"))
    assert error.value.value > 1.0
    for bad, value in (({"least": "size"}, "size"), ({"margin": 0.5}, 0.5), ({"speed": 2.0}, 2.0)):
        with pytest.raises(SettingsError) as error:
            BuildOptions("rmd", **bad)
        assert error.value.value == value
    with pytest.raises(CatalogueError, match="no price is known"):
        build(design, BuildOptions("dynamixel-x", least="price"))
    with pytest.raises(CatalogueError, match=r"joint \d.* times its (peak|rated) torque.*a payload of") as error:
        build(design, BuildOptions("rmd", payload=900.0))
    assert 1.0 < error.value.value < 1e3
    with pytest.raises(CatalogueError, match="sags"):
        build(design, BuildOptions("rmd", payload=1.0, stock="aluminium", deflection=1e-6))
    with pytest.raises(CatalogueError, match="there is none"):
        build(design, BuildOptions("rmd", stock="aluminium"))
    outcome = CliRunner().invoke(app, ["build", str(folder), "--catalogue", "rmd", "--speed", "fast"])
    assert (outcome.exit_code, "--speed" in outcome.stderr) == (2, True)
    assert json.loads((folder / "result.json").read_text())["dof"] == 3

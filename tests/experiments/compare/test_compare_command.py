"""``armdesign compare``: the table, its files, and what it says to bad input."""

from __future__ import annotations

import csv
import io
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from compare_arms import EXAMPLES, LIMIT, urdf
from typer.testing import CliRunner

from armdesign.cli import app
from armdesign.runs.reading import read_result

PACKAGING, WELDING = EXAMPLES / "packaging.csv", EXAMPLES / "welding.csv"
QUICK = ("--evaluations", "20")
THREE = "alpha,a,d\n-1.571,0,0\n0.86,0.074,0\n0.364,0.382,0.071\n-0.938,0,0.1\n"
FOUR = "alpha,a,d\n-1.571,0,0\n0.86,0.074,0\n0.364,0.2,0.071\n0.9,0.2,0\n-0.938,0,0.1\n"


def run(*args):
    return CliRunner().invoke(app, ["compare", *map(str, args)])


def refused(*args):
    """The sentence that a command ends with."""
    outcome = run(*args)
    assert outcome.exit_code == 2, outcome.output
    assert isinstance(outcome.exception, SystemExit)
    assert "Traceback" not in outcome.output
    sentence = outcome.output.splitlines()[-1]
    assert sentence.startswith("armdesign: ")
    return sentence


@pytest.fixture(scope="module")
def scored(tmp_path_factory):
    """The run folders of two arms on the packaging task, of 3 and 4 joints and with bodies of their own."""
    place = tmp_path_factory.mktemp("runs")
    for name, table, across in (("n3", THREE, 0.08), ("n4", FOUR, 0.06)):
        (place / f"{name}.csv").write_text(table)
        arguments = ["evaluate", place / f"{name}.csv", PACKAGING, "--out", place / name, "--quiet",
                     "--joint-diameter", across]  # fmt: skip
        outcome = CliRunner().invoke(app, [str(argument) for argument in arguments])
        assert outcome.exit_code == 0, outcome.output
    return place


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("task", [(), ("--task", PACKAGING), ("--task", "n4"), ("--task", "n3/task.csv")])
def test_designs_keep_the_fitness_of_their_own_task(task, scored, tmp_path, monkeypatch):
    monkeypatch.chdir(scored)
    outcome = run("n3", "n4", *task, "--json", tmp_path / "out.json")
    assert outcome.exit_code == 0, outcome.output
    arms = json.loads((tmp_path / "out.json").read_text())["arms"]
    for arm in arms:
        result = json.loads((scored / arm["name"] / "result.json").read_text())
        for name in ("fitness", "path_fitness", "area", "length", "start_error"):
            assert arm[name] == pytest.approx(result[name], abs=1e-12), name
        assert arm["worst_error"] == max(point["max"] for point in result["point_error"].values())
        verdict = result["verdict"]
        gaps = [gap["value"] for name in ("self", "obstacle") if (gap := verdict[f"{name}_clearance"]) is not None]
        assert arm["clearance"] == pytest.approx(min(gaps), abs=1e-9)
        assert arm["base"] is None
        assert arm["start_reached"] is True
        assert arm["peak_torque"] == max(arm["joint_torques"]) == pytest.approx(max(verdict["peak_torque"]), rel=1e-9)
        assert arm["moving_mass"] == pytest.approx(read_result(scored / arm["name"]).body.moving_mass, abs=1e-12)


def test_the_table_holds_designs_and_ready_made_arms(place):
    Path("arm.csv").write_text(THREE)
    outcome = run("arm.csv", "ur3", "--task", PACKAGING, *QUICK, "--json", "a.json", "--csv", "a.csv")
    assert outcome.exit_code == 0, outcome.output
    assert max(map(len, outcome.output.splitlines())) <= 80
    assert "Fewest joints: arm.csv, 3 joints." in " ".join(outcome.output.split())
    assert "Smallest r" not in outcome.output
    said = " ".join(outcome.output.split())
    assert "Minimised is r = 15 f + 5 E, not the error" in said
    assert "only its base is sought, with 20 poses" in said
    assert "arm.csv of assumed joint modules and tubes; ur3 as their makers' URDFs have them" in said
    assert "-: not known" in said
    content = json.loads(Path("a.json").read_text())
    rows = list(csv.DictReader(io.StringIO(Path("a.csv").read_text())))
    assert [row["name"] for row in rows] == [arm["name"] for arm in content["arms"]] == ["arm.csv", "ur3"]
    for row, arm in zip(rows, content["arms"], strict=True):
        assert row["name"] in outcome.output
        assert int(row["joints"]) == arm["joints"]
        for name in ("length", "fitness", "path_fitness", "area", "worst_error", "moving_mass", "peak_torque"):
            assert (float(row[name]) if row[name] else None) == arm[name]
        r = None if arm["fitness"] is None else 15.0 * arm["path_fitness"] + 5.0 * arm["area"]
        assert arm["fitness"] == pytest.approx(r, abs=1e-12)
    ur3 = content["arms"][1]
    assert set(ur3["base"]) == {"x", "y", "z", "yaw"}
    assert ur3["evaluations"] == 20
    assert ur3["clearance"] is None is not content["arms"][0]["clearance"]
    assert content["task"] | {"frames": 100, "points": ["upper_arm", "forearm", "hand"]} == content["task"]


def test_a_speed_beyond_an_arm_s_own_is_marked(scored, tmp_path):
    for limit, fast in ((1.0, True), (1e4, False)):
        arm = tmp_path / f"limit{limit:g}"
        shutil.copytree(scored / "n3", arm)
        content = json.loads((arm / "result.json").read_text())
        content["settings"]["needs"]["max_speed"] = [limit]
        (arm / "result.json").write_text(json.dumps(content))
        outcome = run(arm, "--task", scored / "n3")
        said = " ".join(outcome.output.split())
        assert outcome.exit_code == 0, outcome.output
        assert bool(re.search(r"limit1 .* \d+! ", said)) is fast
        assert bool(re.search(r"!: faster .* limit1, joint \d, \d+ of 1 deg/s \(stated\)", said)) is fast


def test_a_payload_raises_torques_and_nothing_else(place):
    run("ur3", "--task", PACKAGING, *QUICK, "--json", "a.json")
    run("ur3", "--task", PACKAGING, *QUICK, "--json", "b.json", "--payload", "2")
    empty, loaded = (json.loads(Path(name).read_text())["arms"][0] for name in ("a.json", "b.json"))
    assert loaded["peak_torque"] > empty["peak_torque"]
    names = set(empty) - {"peak_torque", "joint_torques"}
    assert {name: empty[name] for name in names} == {name: loaded[name] for name in names}


def test_an_arm_that_misses_the_start_stays_in_the_table(place):
    outcome = run("so100", "ur3", "--task", PACKAGING, *QUICK, "--box", "0", "--json", "a.json")
    assert outcome.exit_code == 0, outcome.output
    arm = json.loads(Path("a.json").read_text())["arms"][0]
    assert (arm["start_reached"], arm["fitness"], arm["worst_error"], arm["peak_torque"]) == (False, None, None, None)
    assert arm["start_error"] > 1e-3
    assert "so100 does not reach the start" in outcome.output


def test_a_urdf_by_path_with_a_named_tool(place):
    joints = [(f"j{i}", "revolute", f"l{i}", f"l{i + 1}") for i in range(4)]
    Path("my.urdf").write_text(urdf(*joints, ("f", "fixed", "l4", "probe"), ("g", "fixed", "l4", "tool0")))
    for tool, named in (((), "tool0"), (("--tool", "probe"), "probe"), (("--tool", "my.urdf=probe"), "probe")):
        outcome = run("my.urdf", "--task", PACKAGING, *QUICK, *tool, "--json", "a.json", "--overwrite")
        assert outcome.exit_code == 0, outcome.output
        arm = json.loads(Path("a.json").read_text())["arms"][0]
        assert (arm["name"], arm["tool"], arm["moving_mass"], arm["peak_torque"]) == ("my", named, None, None)


def test_the_orientation_counts_where_it_has_a_weight(place):
    outcome = run("ur3", "--task", WELDING, "--scenario", "welding", *QUICK, "--json", "a.json")
    assert outcome.exit_code == 0, outcome.output
    arm = json.loads(Path("a.json").read_text())["arms"][0]
    assert arm["orientation_error"]["max"] > 0.0
    assert arm["worst_point"] != "upper_arm"  # its weight is 0


def test_quiet_prints_nothing(place):
    outcome = run("ur3", "--task", PACKAGING, *QUICK, "--quiet", "--csv", "a.csv")
    assert (outcome.exit_code, outcome.output) == (0, "")
    assert Path("a.csv").is_file()


def test_the_list_names_the_arms():
    outcome = run("--list")
    assert outcome.exit_code == 0
    assert [line.split()[0] for line in outcome.output.splitlines()][:4] == ["ur3", "ur5", "ur10", "panda"]


def test_what_cannot_be_is_said(place):
    Path("arm.csv").write_text(THREE)
    Path("empty").mkdir()
    slide = urdf(("slide", "prismatic", "a", "b", LIMIT), ("turn", "revolute", "b", "c"))
    Path("slide.urdf").write_text(slide)
    cases = {
        ("--task", PACKAGING): "no arm is given",
        ("ur6", "--task", PACKAGING): "ready-made arm 'ur6'; allowed: ur3, ur5",
        ("ur5", "ur5", "--task", PACKAGING): "'ur5' is given twice",
        ("ur5",): "no task is given",
        ("ur5", "--task", "none.csv"): "none.csv",
        ("runs/none", "--task", PACKAGING): "there is no run folder or file runs/none",
        ("empty", "--task", PACKAGING): "result.json is missing",
        ("ur5", "--task", "empty"): "holds no run",
        ("none.urdf", "--task", PACKAGING): "cannot read the URDF none.urdf",
        ("slide.urdf", "--task", PACKAGING): "joint 'slide', on the way to 'c', is prismatic",
        ("ur5", "--task", PACKAGING, "--tool", "tool0"): "--tool tool0 is for none",
        ("ur5", "--task", PACKAGING, "--tool", "ur5=none"): "no link 'none'",
        ("arm.csv", "--task", PACKAGING, "--tool", "arm.csv=x"): "'arm.csv' is none",
        ("ur5", "--task", PACKAGING, "--points", "nose"): "nose",
        ("ur5", "--task", PACKAGING, "--scenario", "welding"): "orientation",
        ("ur5", "--task", PACKAGING, "--evaluations", "0"): "0 base poses",
        ("ur5", "--task", PACKAGING, "--box", "-1"): "allowed: 0 to 10 m",
        ("ur5", "--task", PACKAGING, "--payload", "-1"): "--payload is -1 kg",
        ("ur5", "--task", PACKAGING, "--json", "empty"): "is a folder",
        ("ur5", "--task", PACKAGING, "--json", "arm.csv"): "is there already",
        ("ur5", "--task", PACKAGING, "--csv", "nowhere/a.csv"): "there is no folder nowhere",
        ("ur5", "--task", PACKAGING, "--csv", "a", "--json", "a"): "are both a",
    }  # fmt: skip
    for args, words in cases.items():
        assert words in refused(*args), args


def test_flags_do_not_go_with_a_runs_own_task(scored):
    sentence = refused(scored / "n3", "--points", "hand", "--weights", "1")
    assert "--weights, --points would not be used" in sentence


def test_a_broken_result_is_said(scored, place):
    Path("broken").mkdir()
    Path("broken/result.json").write_text('{"dh": {"rows": [[0,')
    assert "not valid JSON" in refused("broken", "--task", PACKAGING)


def test_a_task_with_other_points_is_refused(scored, place):
    head, rest = PACKAGING.read_text().split("\n", 1)
    Path("other.csv").write_text(head.replace("upper_arm", "biceps") + "\n" + rest)
    assert "upper_arm" in refused(scored / "n3", "--task", "other.csv")
    assert run(scored / "n3", "--task", "other.csv", "--points", "biceps,forearm,hand").exit_code == 0


def test_settings_that_are_none_are_said_with_their_file(scored, place):
    content = json.loads((scored / "n3/result.json").read_text())
    content["settings"]["fitness"]["delta"] = -1
    Path("bad.json").write_text(json.dumps(content))
    assert refused("bad.json", "--task", PACKAGING).startswith("armdesign: bad.json: setting 'fitness.delta'")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ur3", "ur5", "ur10", "panda", "kinova", "xarm7", "z1", "so100", "so101"])
def test_every_arm_does_the_packaging_task(name, place):
    outcome = run(name, "--task", PACKAGING, "--json", "a.json")
    assert outcome.exit_code == 0, outcome.output
    arm = json.loads(Path("a.json").read_text())["arms"][0]
    assert arm["start_reached"]
    assert 0.05 < arm["fitness"] < 1.0
    assert np.isfinite(arm["peak_torque"])

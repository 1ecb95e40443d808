"""Other arms of a run's folder: which are found, and who wins what."""

import dataclasses
import json
import shutil

import numpy as np
import pytest

from armdesign.runs.reading import read_result
from armdesign.views.report import report_html
from armdesign.views.report.answers import next_steps
from armdesign.views.report.others import OTHERS, OtherArm, other_arms, winners


@pytest.fixture
def folder(folders, tmp_path):
    return shutil.copytree(folders["packaging"], tmp_path / "run")


def comparison(run, **more):
    task = run.problem.task
    row = {
        "name": "<ur5>", "kind": "ready-made", "joints": 6, "length": 1.3, "moving_mass": 17.0, "peak_torque": 99.0,
        "peak_speed": 2.0,
        "point_error": {task.points[-1]: {"mean": 0.002, "max": 0.004}},
    }  # fmt: skip
    design = row | {"name": "run", "kind": "design"}
    return {"task": {"points": list(task.points), "frames": len(task.time)}, "arms": [design, row | more]}


def test_arms_of_the_folder_and_of_a_comparison_are_shown_once(folder, folders, take_apart):
    run = read_result(folder)
    assert other_arms(run) == []
    shutil.copytree(folders["packaging"], folder / "alternatives" / "1")  # the arm itself
    shutil.copytree(folders["welding"], folder / "alternatives" / "2")
    (folder / OTHERS).write_text(json.dumps(comparison(run)))
    own, second, bought = other_arms(run)
    assert (own.name, own.joints, own.error) == ("this arm", 3, run.verdict.hand_error.max)
    assert own.mass == pytest.approx(sum(link.inertial.mass for link in run.body.links[1:]))
    assert (second.name, second.joints) == ("alternative 2", 5)
    assert bought == OtherArm("<ur5>", "ready-made", 6, 0.004, 1.3, 17.0, 99.0, speed=2.0)
    assert own.assumed
    page = take_apart(report_html(run))
    assert any(row[0] == "<ur5>" and row[2] == "4.0" for row in page.rows)
    assert any(row[0] == "<ur5>" and "115" in row for row in page.rows)  # 2 rad/s
    assert "Beside other arms" in "".join(page.text)
    assert "with a payload" not in "".join(page.text)  # all carry the same
    (folder / OTHERS).write_text(json.dumps(comparison(run) | {"payload": 1.5}))
    assert [arm.payload for arm in other_arms(run)] == [0.0, 0.0, 1.5]


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"task": {"points": ["a"], "frames": 3}, "arms": []}'])
def test_a_comparison_of_another_task_or_none_at_all_is_left_out(folder, text):
    (folder / OTHERS).write_text(text)
    assert other_arms(read_result(folder)) == []


def test_winners_are_told_apart_by_what_they_win():
    arms = [
        OtherArm("a", "", 3, 0.010, 0.8, 4.0, 20.0),
        OtherArm("b", "", 5, 0.002, 0.8, 5.0, 30.0),
        OtherArm("c", "", 6, 0.004, 1.3, None, 10.0),
        OtherArm("d", "", 2, None, 0.1, 0.1, 0.1),  # does not reach the task
    ]
    found = {what: (value, names) for what, value, names in winners(arms)}
    assert found["Smallest error"] == ("2.0 mm", ("b",))
    assert found["Fewest joints"] == ("3 joints", ("a",))
    assert found["Shortest"] == ("800 mm", ("a", "b"))
    assert found["Lightest"] == ("4.00 kg", ("a",))
    assert found["Least torque"] == ("10.0 N m", ("c",))
    assert winners(arms[:1]) == []
    heavy = [*arms[:3], arms[2]._replace(name="e", payload=1.0)]
    assert "Least torque" not in {what for what, *_ in winners(heavy)}  # with other payloads
    assert np.all([what != "Shortest" for what, *_ in winners(arms[:2])])


def test_an_alternative_that_keeps_the_tolerance_is_the_first_thing_to_take(invented):
    run = invented()
    settings = run.problem.settings.replace({"needs": {"hand_tolerance": 0.005}})
    run = dataclasses.replace(
        run,
        problem=dataclasses.replace(run.problem, settings=settings),
        known_verdict=dataclasses.replace(run.verdict, feasible=True, tolerance_met=False),
    )
    near, far = (
        OtherArm(f"alternative {k}", "searched for", 3, 1e-3 * k, 0.8, place=f"alternatives/{k}") for k in (3, 9)
    )
    assert "alternative 3" in next_steps(run, [far, near])[0].text
    assert not any("keeps" in step.text for step in next_steps(run, [far]))

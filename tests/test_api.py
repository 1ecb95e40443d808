"""What ``import armdesign`` offers: names, types, the whole way in one call, and how things show themselves."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import armdesign
from armdesign.export.trajectory.exporting import TrajectoryOptions
from armdesign.settings.sections import SECTIONS

EXAMPLE = Path(__file__).parent.parent / "examples" / "packaging.csv"
COMMANDS = (
    "search", "evaluate", "export", "preview", "report", "alternatives", "convert", "compare", "auto_dof", "sweep",
)  # fmt: skip


@pytest.fixture(scope="module")
def result():
    """A small search."""
    return armdesign.design(EXAMPLE, dof=4, budget=300)


def test_dir_shows_the_api_and_nothing_else():
    names = dir(armdesign)
    assert names == sorted(armdesign.__all__)
    assert {"Settings", "Task", "Design", "Fitness", "Solver", "Search", "DHTable", "ArmDesignError"} <= set(names)
    assert {*COMMANDS, "read_recording", "prepare", "design", "read_result", "write_result", "__version__"} <= set(
        names
    )
    for name in names:
        assert getattr(armdesign, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'numpy'"):
        armdesign.numpy  # noqa: B018


def test_import_loads_nothing_heavy():
    heavy = ["numpy", "numba", "pinocchio", "matplotlib"]
    code = f"import sys, armdesign; dir(armdesign); sys.exit(any(name in sys.modules for name in {heavy}))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_every_function_is_documented_and_typed():
    for name in armdesign.__all__:
        thing = getattr(armdesign, name)
        if inspect.isfunction(thing):
            assert len(inspect.getdoc(thing)) > 40, name
            parameters = inspect.signature(thing).parameters.values()
            assert all(each.annotation is not inspect.Parameter.empty for each in parameters), name


@pytest.mark.parametrize("room", ["search", "export"])
def test_room_of_the_name_of_a_function_is_called_like_it(room):
    module = import_module(f"armdesign.{room}")
    assert getattr(armdesign, room) in (module, module.function)  # whichever was first
    assert module.function.__name__ == room
    assert inspect.signature(module) == inspect.signature(module.function)


def test_steps_give_what_the_one_call_gives(result):
    settings = armdesign.Settings(design=armdesign.Design(dof=4), search=armdesign.Search(budget=300))
    problem = armdesign.prepare(armdesign.read_recording(EXAMPLE), settings)
    assert armdesign.search(problem).fitness == result.fitness
    assert armdesign.evaluate(result.table, problem).fitness == result.fitness


def test_what_is_given_to_the_one_call_may_be_read_already_or_several(result):
    recording = armdesign.read_recording(EXAMPLE)
    settings = armdesign.Settings(design=armdesign.Design(dof=4))
    assert armdesign.design(recording, settings, budget=300).fitness == result.fitness
    two = armdesign.design([recording, EXAMPLE], settings, holdouts=[recording], budget=300)
    assert (len(two.problem.demonstrations), len(two.problem.holdouts)) == (2, 1)
    assert two.fitness == pytest.approx(two.evaluation.holdouts[0].fitness)
    named = settings.with_entries(recording=str(EXAMPLE), search=armdesign.Search(budget=300))
    assert armdesign.design(settings=named).fitness == result.fitness


def test_result_survives_its_run_folder(result, tmp_path):
    armdesign.write_result(tmp_path / "run", result)
    read = armdesign.read_result(tmp_path / "run")
    assert read.fitness == result.fitness
    assert armdesign.read_settings(tmp_path / "run" / "settings.toml") == result.problem.settings
    assert np.array_equal(armdesign.read_design(tmp_path / "run").alpha, result.table.alpha)
    arms = armdesign.alternatives(result, count=2)
    assert [arm.fitness for arm in armdesign.alternatives(read, count=2)] == [arm.fitness for arm in arms]
    assert arms[0].fitness == pytest.approx(result.fitness)


def test_files_for_other_tools_and_for_people(result, tmp_path):
    done = armdesign.export(result, tmp_path, ["urdf", "dh-csv"], "csv", timing=TrajectoryOptions(speed=0.5))
    assert [path.name for path in done.paths] == ["arm.urdf", "dh.csv", "joint_trajectory.csv"]
    armdesign.preview(result, tmp_path / "preview.html")
    assert armdesign.report(result, tmp_path / "report.html") == (tmp_path / "report.html",)
    for again in (
        lambda: armdesign.export(result, tmp_path),
        lambda: armdesign.preview(result, tmp_path / "preview.html"),
        lambda: armdesign.report(result, tmp_path / "report.html"),
    ):
        with pytest.raises(armdesign.ArmDesignError, match="already"):
            again()


def test_number_of_joints_and_comparison(result, tmp_path):
    settings = armdesign.Settings(design=armdesign.Design(auto_dof=(3, 4)), search=armdesign.Search(budget=300))
    recording = armdesign.read_recording(EXAMPLE)
    choice = armdesign.auto_dof(lambda n: armdesign.prepare(recording, settings.with_entries(dof=n)), tmp_path / "auto")
    assert armdesign.read_result(tmp_path / "auto").table.dof == choice.verdict.dof
    comparison = armdesign.compare([result], result.problem)
    assert comparison.rows[0].fitness == pytest.approx(result.fitness)


def test_sweep_runs_every_combination_once(result, tmp_path):
    settings = armdesign.Settings(search=armdesign.Search(budget=300))
    one = armdesign.sweep(EXAMPLE, tmp_path / "sweep", settings, dof=[4])
    assert [row["fitness"] for row in one.rows.values()] == [result.fitness]
    more = armdesign.sweep([EXAMPLE], tmp_path / "sweep", settings, dof=[3, 4], seeds=[0, 1])
    assert len(more.rows) == 4
    assert set(one.rows) < set(more.rows)


@pytest.mark.parametrize(
    ("entries", "value"),
    [({"doff": 3}, "doff"), ({"dof": 0}, 0), ({"design": 3}, 3), ({"workers": 0}, 0), ({"recordings": []}, None)],
)
def test_what_is_not_allowed_is_said(entries, value):
    with pytest.raises(armdesign.ArmDesignError) as refused:
        armdesign.design(**{"recordings": EXAMPLE} | entries)
    assert refused.value.value == value
    assert refused.value.allowed or refused.value.fix


def test_no_two_sections_have_an_entry_of_one_name():
    names = [name for kind in SECTIONS for name in kind.names()]
    assert len(set(names)) == len(names)
    assert not {kind.title() for kind in SECTIONS} & set(names)


def test_things_show_what_counts_first(result):
    recording = armdesign.read_recording(EXAMPLE)
    frames = recording.frames
    assert repr(recording) == f"Recording 'packaging.csv': {frames} frames, 50 Hz, 4 points"
    hand = 1e3 * result.evaluation.path.distance[:, -1]
    shown = repr(result)
    first = shown.splitlines()[0]
    assert first.startswith("arm of 4 joints, hand error ")
    assert [float(x) for x in re.findall(r"([0-9.]+) mm", first)] == pytest.approx(
        [hand.mean(), np.percentile(hand, 95, method="inverted_cdf"), hand.max()], rel=5e-3
    )
    assert f"r {result.fitness:.4f} m" in shown
    for thing in (result.problem, result.problem.first, result.problem.task):
        assert f"{frames} frames" in repr(thing)
    rows = repr(result.table).splitlines()
    assert len(rows) == 2 + result.table.dof + 1
    assert [float(x) for x in rows[3].split()[1:]] == pytest.approx(
        [np.degrees(result.table.alpha[1]), 1e3 * result.table.a[1], 1e3 * result.table.d[1]], abs=0.05
    )
    assert max(len(line) for thing in (result, result.table, recording) for line in repr(thing).splitlines()) <= 120


def test_notebooks_get_a_picture_and_names_as_text(result):
    names = {"<b>&": np.zeros((5, 3)), "hand": np.random.default_rng(0).random((5, 3))}
    recording = armdesign.Recording(np.arange(5.0), names, source="<i>.csv")
    for thing in (recording, result, result.table, result.problem, result.problem.first, result.problem.task):
        page = ET.fromstring(thing._repr_html_())
        assert len(page.findall("{*}svg")) == 2
        assert page.find("pre").text.startswith(repr(thing).splitlines()[0])
    assert "<b>" not in recording._repr_html_()

"""The page as text: whole, closed, its own, and its numbers are those of the run."""

import dataclasses
import re
import shlex
from types import SimpleNamespace

import matplotlib as mpl
import numpy as np
import pytest
from typer.testing import CliRunner

from armdesign.cli import app
from armdesign.export.options import LimitOptions, RobotOptions
from armdesign.feasibility.violations import figure, share
from armdesign.kinematics.base_pose import BasePose
from armdesign.kinematics.dh import DHTable
from armdesign.runs.reading import read_result
from armdesign.settings import Body, Settings
from armdesign.swarm.agreement import Agreement
from armdesign.views.report import report_html, words
from armdesign.views.report.answers import next_steps, plain_verdict, worst_frame
from armdesign.views.report.facts import joint_loads
from armdesign.views.report.report_page import command

ALWAYS = 1 + 1 + 2 + 3 + 3 + 1
"""Figures: the shaded picture, the drawing, errors, cell with clearance, joints, fitness."""
HOSTILE = ('<script>alert("1")</script>', "a & b $x^2$ $", '_"quoted" id="x" <!-- --> ]]>')


@pytest.fixture(scope="module")
def pages(folders):
    return {name: report_html(read_result(folder)) for name, folder in folders.items()}


@pytest.fixture(params=["packaging", "welding"])
def both(request, folders, pages):
    return read_result(folders[request.param]), pages[request.param]


def row_of(page, head):
    return next(row for row in page.rows if row[0].strip() == head)


def check_whole(text, take_apart):
    """What has to hold for every page."""
    page = take_apart(text)
    identifiers = page.all("id")
    assert len(set(identifiers)) == len(identifiers)
    for name in ("href", "src", "action", "data", "xlink:href"):
        assert all(value.startswith(("#", "data:image/png;base64,")) for value in page.all(name))
    within = {value[1:] for value in page.all("href") if value.startswith("#")} | set(
        re.findall(r"url\(#([^)]+)\)", text)
    )
    described = {
        part for name in ("aria-labelledby", "aria-describedby") for value in page.all(name) for part in value.split()
    }
    assert within | described <= set(identifiers)
    assert "script" not in page.tags
    assert not re.search(r"@import|url\((?!#)", text)
    assert not [name for _, name, _ in page.attributes if name.startswith("on")]
    assert ("html", "lang", "en") in page.attributes
    assert page.tags.count("h1") == page.tags.count("main") == 1
    assert (
        page.tags.count("svg") - page.all("class").count("half")
        == page.tags.count("figure")
        == page.all("role").count("img")
    )
    assert not re.search(r"\b(nan|inf|None|Undefined)\b", "".join(page.text))
    return page


def test_a_page_is_whole_and_needs_no_network(both, take_apart):
    page = check_whole(both[1], take_apart)
    assert page.tags.count("figure") == ALWAYS + 1
    assert len(both[1].encode()) < 3e6


def test_the_dh_tables_are_those_of_the_arm(both, take_apart, numbers):
    run, text = both
    page, table = take_apart(text), run.table
    for i in range(table.dof + 1):
        row = row_of(page, "tool" if i == table.dof else str(i))
        wanted = [np.rad2deg(table.alpha[i]), 1e3 * table.a[i], 1e3 * table.d[i]]
        assert numbers(" ".join(row[1:4])) == pytest.approx(wanted, abs=0.0051)
    rows = [row for row in page.rows if len(row) == 5 and row[1].startswith("q")]
    for (alpha, a, d, theta), row in zip(table.to_classic().rows, rows, strict=True):
        assert theta == 0.0
        assert numbers(" ".join(row[2:])) == pytest.approx([1e3 * d, 1e3 * a, np.rad2deg(alpha)], abs=0.0051)


def test_the_errors_are_those_of_the_path(both, take_apart, numbers):
    run, text = both
    page = take_apart(text)
    for name, errors in zip(run.problem.task.points, 1e3 * run.evaluation.path.distance.T, strict=True):
        wanted = [errors.mean(), np.median(errors), share(errors, 95.0), errors.max()]
        assert row_of(page, f"{name} [mm]")[1:] == [figure(value) for value in wanted]  # as the summary has them


def test_the_fitness_and_its_parts_are_those_of_the_result(both, take_apart, numbers):
    run, text = both
    page = take_apart(text)
    total = numbers(row_of(page, "r")[2])[0]
    assert total == pytest.approx(1e3 * run.fitness, abs=0.0051)
    names = [*run.problem.task.points, "area E"]
    names += ["orientation"] if run.problem.settings.fitness.orientation_weight else []
    assert sum(numbers(row_of(page, name)[2])[0] for name in names) == pytest.approx(total, abs=0.0051 * len(names))


def test_limits_are_those_of_the_urdf_in_the_folder(both, take_apart, numbers):
    run, text = both
    urdf = (run.folder / "arm.urdf").read_text(encoding="utf-8")
    limits = re.findall(r'effort="([^"]+)" velocity="([^"]+)"', urdf)
    rows = [row for row in take_apart(text).rows if len(row) == 6 and row[0].isdigit()]
    assert len(limits) == run.table.dof
    for (effort, velocity), row in zip(limits, rows[-run.table.dof :], strict=True):
        assert numbers(row[2])[0] == pytest.approx(np.rad2deg(float(velocity)), abs=0.051)
        assert numbers(row[5])[0] == pytest.approx(float(effort), abs=0.00051)


def test_the_search_is_told(both):
    run, text = both
    for part in (f"seed {run.facts.seed}", "60 candidate arms", "all iterations were done", "3 of 3 iterations"):
        assert part in text
    for note in run.problem.notes:
        assert note.replace("'", "&#39;") in text
    assert "interrupted" not in text


def test_the_same_run_gives_the_same_page_whatever_matplotlib_is_set_to(folders, pages):
    run, text = read_result(folders["welding"]), pages["welding"]
    with mpl.rc_context({"font.size": 20, "axes.facecolor": "red", "svg.fonttype": "path"}):
        before = dict(mpl.rcParams)
        assert report_html(run) == text
        assert dict(mpl.rcParams) == before


def test_names_are_text_whatever_they_hold_and_an_interrupted_search_says_so(invented, take_apart):
    text = report_html(invented(names=HOSTILE, name='</title><img src="http://x">&amp;', stopped_by="interrupted"))
    page = check_whole(text, take_apart)
    said = "".join(page.text)
    assert said.count(HOSTILE[0]) >= 4
    assert all(part in said for part in (HOSTILE[1], HOSTILE[2][:8], '</title><img src="http://x">&amp;'))
    assert not {"img", "script", "input"} & set(page.tags)
    assert "This search was interrupted" in said
    assert "--resume" in said


@pytest.mark.parametrize(("dof", "scenario"), [(1, "packaging"), (8, "welding")])
def test_any_number_of_joints(invented, take_apart, dof, scenario):
    page = check_whole(report_html(invented(dof, scenario, seed=dof)), take_apart)
    assert row_of(page, f"link_{dof}")
    assert page.tags.count("figure") == ALWAYS + 1


def test_an_arm_that_was_given_has_no_search_but_its_offsets(invented, take_apart, numbers):
    rows = [(0.1, 0.05, 0.1, 0.2), (0.3, -0.2, 0.1, -0.4), (0.5, 0.2, -0.1, 0.6), (0.7, 0.1, 0.1, 0.8)]
    table = DHTable.from_rows(rows, base_yaw=0.9)
    text = report_html(invented(table=table, stopped_by=None))
    page = check_whole(text, take_apart)
    for i, (alpha, a, d, theta) in enumerate(rows):
        row = row_of(page, "tool" if i == 3 else str(i))
        wanted = [np.rad2deg(alpha), 1e3 * a, 1e3 * d, np.rad2deg(theta)]
        assert numbers(" ".join(row[1:5])) == pytest.approx(wanted, abs=0.0051)
    assert "Rz(51.566 deg)" in "".join(page.text)
    assert page.tags.count("figure") == ALWAYS
    assert 'id="search"' not in text
    assert "given and scored" in text


def test_assumptions_are_those_that_were_made(invented):
    run = invented()
    heavier = RobotOptions(Body(joint_mass=1.25), LimitOptions(payload=2.0, margin=2.0))
    for options, values in ((RobotOptions(), ("0.6 kg", None, None)), (heavier, ("1.25 kg", "2 kg", "2"))):
        said = {each.flag: each.value for each in words.assumptions(options, run.base_pose)}
        assert tuple(said.get(flag) for flag in ("--joint-mass", "--payload", "--margin")) == values
    motors = run.problem.settings.replace({"needs": {"max_torque": [9.0], "max_speed": [500.0]}})
    built = dataclasses.replace(run, problem=dataclasses.replace(run.problem, settings=motors))
    used = {each.flag for each in words.assumptions(heavier, run.base_pose, words.unused(built, built=True))}
    assert "--payload" in used
    assert not used & {"--joint-mass", "--base-mass", "--actuator-speed", "--actuator-torque", "--slide-speed"}
    light, heavy = (joint_loads(run, options) for options in (RobotOptions(), heavier))
    assert heavy.masses[1:] - light.masses[1:] == pytest.approx([0.65] * 3)
    assert (np.abs(heavy.torque).max(axis=0) > np.abs(light.torque).max(axis=0)).all()
    softer = joint_loads(run, RobotOptions(Body(joint_mass=1.25), LimitOptions(payload=2.0, margin=1.5)))
    assert heavy.limits.velocity == pytest.approx(2.0 / 1.5 * softer.limits.velocity)
    assert light.limits.velocity == pytest.approx(np.pi)  # of the stated actuator, 180 deg/s


def test_settings_at_their_defaults_are_left_out(invented):
    assert words.changed_settings(invented(3).problem.settings) == []
    names = {each.name: each for each in words.changed_settings(invented(4, "welding").problem.settings)}
    assert set(names) == {"design.dof", "fitness.scenario"}
    assert names["design.dof"][1:3] == ("4", "3")


def test_a_long_recording_makes_a_small_page(invented, longer):
    run = longer(invented(6), 10)
    assert len(run.problem.task.time) == 1000
    assert len(report_html(run).encode()) < 6e5  # 5.1e5 with the 100 frames of one repetition


def test_the_first_screen_says_the_verdict_in_words_and_what_to_do_next(both, take_apart):
    run, text = both
    head = "".join(take_apart(text[text.index("<header>") : text.index("</header>") + 9]).text)
    worst, loads = worst_frame(run), joint_loads(run, RobotOptions())
    for part in (
        plain_verdict(run, worst, loads.miss)[1],
        f"{figure(1e3 * worst.error)} mm",
        f"{figure(1e3 * loads.error)} mm",
        f"at {worst.time:.2f} s",
        "What to do next",
    ):
        assert part in head
    assert not re.search(r"swarm|fitness|particle|\br\b =", head, re.IGNORECASE)
    for step in next_steps(run, []):
        assert step.code in head
    assert 1 <= len(next_steps(run, [])) <= 4


def test_commands_of_the_first_screen_are_commands(both):
    for step in next_steps(both[0], []):
        program, command, *words = shlex.split(step.code)
        assert program == "armdesign"
        help_text = CliRunner().invoke(app, [command, "--help"]).output
        assert all(f"{word} " in help_text for word in words if word.startswith("--"))
        assert command != "build" or "--catalogue" in words  # which it cannot do without


def test_a_build_is_not_told_to_pick_motors_but_to_have_its_parts_made(both):
    run = both[0]
    sound = SimpleNamespace(fault="", remedy=lambda _: "")
    faulty = SimpleNamespace(
        fault="parts meet", remedy=lambda run: f"Take another:\n  armdesign search --out {run}-again"
    )
    designed, built, wrong = ([step.code for step in next_steps(run, [], made)] for made in (None, sound, faulty))
    assert any("armdesign build" in code for code in designed)
    assert not any("armdesign build" in code for code in [*built, *wrong])
    assert any("--format drawing,step" in code for code in built)
    assert any("armdesign tolerance" in code for code in built)
    assert wrong[0] == "armdesign search --out RUN-again"
    assert not any("drawing" in code for code in wrong)


def test_the_least_sure_search_is_told_to_go_on_however_good_its_arm(invented):
    run = invented()
    good = dataclasses.replace(run.verdict, feasible=True, tolerance_met=True)
    for agreeing, first in ((0, True), (1, True), (2, False)):
        facts = dataclasses.replace(run.facts, agreement=Agreement(agreeing, agreeing, 1.0, 0, 0))
        steps = next_steps(dataclasses.replace(run, facts=facts, known_verdict=good), [])
        assert ("--resume" in steps[0].code) is first


def test_the_fault_of_a_build_is_its_headline_and_a_missed_tolerance_does_not_sound_like_parts(invented):
    run = invented()
    missed = dataclasses.replace(run.verdict, feasible=True, tolerance_met=False)
    run = dataclasses.replace(run, known_verdict=missed)
    assert "built" not in plain_verdict(run, worst_frame(run), np.zeros(1))[1]
    made = SimpleNamespace(fault="parts meet", warning="NOT TO BE MADE: parts meet")
    assert plain_verdict(run, worst_frame(run), np.zeros(1), made) == ("bad", "NOT TO BE MADE: parts meet.")


def test_the_lag_of_the_drives_and_every_word_is_said(both, take_apart):
    run, text = both
    said = "".join(take_apart(text).text)
    assert joint_loads(run, RobotOptions()).lag in said
    assert "lag by" in said
    for term, meaning in words.TERMS:
        assert term in said
        assert meaning in said


def test_what_is_for_few_is_folded(both):
    folded = re.findall(r"<details>.*?</details>", both[1], re.DOTALL)
    assert len(folded) == 4
    assert "r = " in folded[2]
    assert "--joint-mass" in folded[3]
    assert "--joint-mass" not in both[1].replace(folded[3], "")


def test_a_joint_beyond_its_limit_is_told_with_both_figures(invented):
    run = invented()
    loads = joint_loads(run, RobotOptions())
    q = np.zeros_like(loads.motion.q)
    q[3, 1] = np.deg2rad(180.2)
    position = np.tile([-np.pi, np.pi], (3, 1))
    limits = dataclasses.replace(loads.limits, position=position)
    beyond = dataclasses.replace(loads, motion=dataclasses.replace(loads.motion, q=q), limits=limits)
    said = words.limit_sentences(run, beyond)[0]
    assert said.startswith("Joint 2 goes to 180.2 deg against a limit of 180 deg")
    within = dataclasses.replace(beyond, motion=dataclasses.replace(loads.motion, q=0.5 * q))
    assert words.limit_sentences(run, within)[0] == "Every joint stays well within its range."


def test_settings_are_shown_without_folders_and_what_rounding_leaves():
    settings = Settings().replace(
        {"cell": {"obstacles": ["/home/me/cell.toml"]}, "needs": {"max_speed": [461.99999999999994, 180.0, 90.0]}}
    )
    shown = {each.name: each.value for each in words.changed_settings(settings)}
    assert shown["cell.obstacles"] == '["cell.toml"]'
    assert shown["needs.max_speed"] == "[462, 180.0, 90.0]"


def test_assumptions_name_a_command_that_has_the_option():
    rows = {each.flag: each.command for each in words.assumptions(RobotOptions(), BasePose())}
    assert rows["--module-slide"] == "armdesign search"
    assert "--post" not in rows
    assert rows["--tube-wall"] == ""


def test_how_sure_a_search_is_depends_on_its_independent_starts(invented):
    facts = invented().facts
    assert "multibasin" in words.trust(facts)
    none, alike = Agreement(0, 0, 1.0, 0, 0), Agreement(3, 3, 0.09, 9, 1)
    assert "too early to say how good" in words.trust(dataclasses.replace(facts, agreement=none))
    assert "3 of 3 independent starts" in words.trust(dataclasses.replace(facts, agreement=alike))


def test_no_line_of_a_command_ends_within_an_option():
    said = command("armdesign check 'a <b>' --hand-tolerance 10mm\narmdesign export --format x")
    assert said.count('<span class="option">--') == 2
    assert "&lt;b&gt;" in said
    assert (
        re.sub("<[^>]*>", "", said)
        == "armdesign check &#39;a &lt;b&gt;&#39; --hand-tolerance 10mm\narmdesign export --format x"
    )

"""What the page is made of, without a browser: takes, arms, plots, the cell, the guard."""

import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest

from armdesign.building import BILL, part_lists
from armdesign.building.build_options import BuildOptions
from armdesign.building.catalogue import find_catalogue
from armdesign.building.room import room_for_motors
from armdesign.cell.obstacle_file import read_obstacles
from armdesign.demonstration import Recording, resolve
from armdesign.demonstration.recording import About
from armdesign.errors import CatalogueError, RecordingError, SearchError, SettingsError
from armdesign.experiments.compare.base_pose import BaseSearch
from armdesign.experiments.compare.comparison import compare
from armdesign.kinematics.dh import DHTable
from armdesign.runs.listing import RunStatus
from armdesign.runs.reading import read_result
from armdesign.search.evaluation import evaluate_design
from armdesign.search.prepare import prepare
from armdesign.search.result import Result
from armdesign.settings.place import sites
from armdesign.settings.sections import Cell, Settings
from armdesign.studio import download_panel, motors, redesign_panel, server
from armdesign.studio.arms import (
    ASSUMED_LOAD,
    SORTS,
    arms_table,
    design_arm,
    job_words,
    load_words,
    ordered,
    ready_made_arm,
)
from armdesign.studio.arms_panel import ALL, ArmsPanel, CancelledError, by_reach, needed_reach
from armdesign.studio.download_panel import MOST_JOINTS, ROOM, SEED, DownloadPanel, built_html, packed, ways_on
from armdesign.studio.motors import buildable, families, family_of
from armdesign.studio.page import Page
from armdesign.studio.plots import LEFT, RIGHT, Curve, gap_picture, plot, thinned, ticks
from armdesign.studio.redesign_panel import AGAIN, CHANGED, RedesignPanel, gradient_words, plain_name, scale_of
from armdesign.studio.room_panel import Solid, cell_text, hand_first, longest_link, pedestal, reach_from_floor, region
from armdesign.studio.search_panel import SearchPanel, judged_words, progress_words
from armdesign.studio.takes import Shot, bridged, chosen_points, keep_upload, nearest, roles_of


def reach(frames=60):
    """An arm that reaches forward, with one gap in its wrist."""
    time = np.linspace(0.0, 1.0, frames)
    way = 0.15 * np.sin(np.pi * time)
    still = np.zeros(frames)
    wrist = np.stack([0.35 + way, still, 1.0 + way], axis=1)
    wrist[20:24] = np.nan
    points = {
        "RSHO": np.tile([0.0, 0.0, 1.3], (frames, 1)),
        "RELB": np.stack([0.2 + way / 2, still - 0.1, 1.1 + way / 2], axis=1),
        "RWRA": wrist,
        "RFIN": np.stack([0.42 + way, still, 1.0 + 1.1 * way], axis=1),
    }
    return Recording(time, points, source="reach", about=About(captured=True, format="C3D"))


@pytest.fixture(scope="module")
def result():
    settings = Settings().replace(
        {"design": {"dof": 3, "bounds": {"a_tool": (0.0, 0.5)}}, "needs": {"hand_tolerance": 0.01}}
    )
    problem = prepare(reach(), settings)
    rows = [(0.0, 0.0, 0.0), (1.5, 0.0, 0.0), (0.2, 0.3, 0.0), (-0.2, 0.25, 0.1)]
    return Result(problem, evaluate_design(DHTable.from_rows(rows), problem), name="three")


def test_an_upload_keeps_its_last_name_alone(tmp_path):
    for name in ("take.c3d", "../../take.c3d", "C:\\takes\\take.c3d"):
        assert keep_upload(tmp_path / "in", name, b"x") == tmp_path / "in" / "take.c3d"
    for name in ("", ".hidden", "a\nb"):
        with pytest.raises(RecordingError):
            keep_upload(tmp_path / "in", name, b"x")


def test_gaps_are_seen_and_bridged_for_the_picture_only():
    recording = reach()
    shot = Shot(recording, resolve(recording, None, (), None))
    names, seen = shot.gaps()
    assert seen.shape[0] == len(names) == 4
    assert (seen < 1.0).any(axis=1).tolist() == [False, False, True, False]
    assert np.isfinite(shot.chain).all()
    assert np.isnan(shot.at(recording.time[21])).any()
    line = np.stack([recording.time] * 3, axis=1)
    holed = np.where(np.isnan(recording.points["RWRA"]), np.nan, line)
    np.testing.assert_allclose(bridged(recording.time, holed), line, atol=1e-12)


def test_a_long_take_makes_a_small_picture():
    frames = 60_000
    points = {f"m{k}": np.full((frames, 3), float(k)) for k in range(60)}
    points["m7"][::3] = np.nan
    shot = Shot(Recording(np.arange(frames) / 100.0, points, source="long"))
    names, seen = shot.gaps()
    assert seen.shape == (60, 240)
    assert len(gap_picture(names, seen, shot.recording.time)) < 100_000


def test_roles_name_what_the_guess_has_found():
    recording = reach()
    roles = roles_of(resolve(recording, None, (), None))
    assert list(roles) == ["shoulder", "elbow", "wrist", "hand"]
    again = resolve(recording, roles["shoulder"], list(roles.values())[1:], None)
    assert again.points == ("elbow", "wrist", "hand")
    assert chosen_points(["a+b", "", "x=c+d"], ("a+b", "c", "d")) == {"base": '"a+b"', "points": ("x=c+d",)}


def test_frames_by_time():
    times = np.array([0.0, 0.1, 0.2])
    assert [nearest(times, t) for t in (-1.0, 0.0, 0.1, 0.19, 5.0)] == [0, 0, 1, 1, 2]


def test_the_links_of_an_arm_end_at_its_tool(result):
    arm = design_arm(result)
    q = result.evaluation.path.q
    tool = result.base_pose.matrix @ result.table.frames(q[7])[-1]
    last = np.linalg.inv(result.table.frames(q[7])[-2]) @ result.table.frames(q[7])[-1]
    np.testing.assert_allclose(arm.at(arm.time[7])[-1] @ last, tool, atol=1e-12)


def test_a_ready_made_arm_is_drawn_as_far_from_the_hand_as_it_is_scored(result):
    row = compare(["ur5"], result.problem, BaseSearch(30)).rows[0]
    arm, task = ready_made_arm(row, result), result.problem.task
    places = np.array([arm.place(k)[-1][:3, 3] for k in range(len(arm.time))])
    np.testing.assert_allclose(np.linalg.norm(places - task.P[:, -1], axis=1), arm.error, atol=1e-9)


def test_arms_are_sorted_and_what_is_not_known_comes_last(result):
    arm = design_arm(result)
    light, heavy, unknown = (
        replace(arm, name=name, mass=mass) for name, mass in (("light", 1.0), ("heavy", 2.0), ("<b>unknown</b>", None))
    )
    assert [each.name for each in ordered([unknown, heavy, light], "mass")] == ["light", "heavy", "<b>unknown</b>"]
    for by in SORTS:
        assert len(ordered([unknown, heavy, light], by)) == 3
    assert "<b>unknown" not in arms_table([unknown], ["#000000"])


def test_ready_made_arms_that_reach_come_first():
    assert by_reach({"tiny": 0.5, "long": 2.0, "fits": 1.1, "small": 0.9}, 1.0) == (
        "fits (1.10 m)", "long (2.00 m)", "small (0.90 m, too short)", "tiny (0.50 m, too short)",
    )  # fmt: skip


def test_what_the_hand_does_needs_an_arm_as_long_as_half_its_way(result):
    hand = result.problem.task.P[:, -1]
    half = np.linalg.norm(np.ptp(hand, axis=0)) / 2.0
    assert half <= needed_reach(result.problem) + 1e-9 <= 2.0 * half


def test_a_longer_arm_may_have_longer_links():
    assert longest_link(Settings().design.length[1]) == Settings().design.a[1] == Settings().design.d[1]
    assert longest_link(1.9) == pytest.approx(1.2)
    assert longest_link(0.6) == 0.5


def test_a_thinned_curve_keeps_its_peak():
    x = np.arange(10_000.0)
    y = np.where(x == 4321, 9.0, 1.0)
    few, kept = thinned(x, y)
    assert len(few) <= 400
    assert kept.max() == 9.0
    assert few[np.argmax(kept)] == 4321


def test_a_plot_says_where_a_click_is():
    text = plot([Curve(np.array([2.0, 4.0]), np.array([0.0, 1.0]), "red", "<a>")], "t", "s", timed=True)
    assert f'data-start="2.0" data-end="4.0" data-left="{LEFT}" data-right="{RIGHT}"' in text
    assert "<a>" not in text
    assert plot([], "t", "s") == ""
    for top in (1e-6, 0.3, 7.0, 123.0, 4e5):
        marks = ticks(top)
        assert 2 <= len(marks) <= 5
        assert marks[-1] <= top


def test_solids_are_read_back_from_their_cell_file(tmp_path):
    solids = [
        Solid("table", "box", (0.1, -0.2, 0.4), (0.5, 0.6, 0.8), 30.0),
        Solid("pole", "cylinder", (1.0, 0, 1), (0.1, 0.1, 2)),
    ]
    (tmp_path / "cell.toml").write_text(cell_text(solids))
    box, pole = read_obstacles([tmp_path / "cell.toml"]).each
    np.testing.assert_allclose(box.shape.size, solids[0].size)
    np.testing.assert_allclose(box.pose[:3, 3], solids[0].center)
    np.testing.assert_allclose(np.rad2deg(np.arctan2(box.pose[1, 0], box.pose[0, 0])), 30.0)
    assert (pole.shape.radius, pole.shape.length) == (0.05, 2.0)


def test_a_box_for_the_base_is_a_region():
    (site,) = sites(Cell(place=(region((0.5, 0.0, 0.1), (0.6, 0.2, 0.0)),)))
    np.testing.assert_allclose(site.box, [[0.2, -0.1, 0.1], [0.8, 0.1, 0.1]])


def test_gradients_say_which_way():
    assert "less" in gradient_words(0.5, angular=False)
    assert "more" in gradient_words(-0.5, angular=True)
    assert gradient_words(1e-6, angular=False) == gradient_words(float("nan"), angular=True) == "at its best"
    names = {plain_name(name) for name in ("alpha_0", "a_1", "d_tool", "base_x", "base_yaw")}
    assert len(names) == 5
    assert [scale_of(name) > 1.0 for name in ("alpha_0", "a_1", "base_x", "base_yaw")] == [True, False, False, True]


def test_downloads_are_packed_only_where_there_are_several():
    assert packed({"arm.urdf": b"x"}, "robot.zip", "lift") == ("lift-arm.urdf", b"x")
    assert packed({"a": b"x", "b": b"y"}, "robot.zip", "lift")[0] == "lift-robot.zip"


@pytest.mark.parametrize(
    ("path", "headers", "passes"),
    [
        ("/?token={t}", {}, True),
        ("/", {"Cookie": "{c}={t}"}, True),
        ("/", {"Cookie": "{c}={t}", "Origin": "http://127.0.0.1:8123"}, True),
        ("/", {}, False),
        ("/?token=other", {}, False),
        ("/", {"Cookie": "{c}=other"}, False),
        ("/?token={t}", {"Host": "evil.example:8123"}, False),
        ("/", {"Cookie": "{c}={t}", "Origin": "http://evil.example"}, False),
        ("/", {"Cookie": "{c}={t}", "Origin": "null"}, False),
    ],
)
def test_the_guard_wants_token_host_and_origin(path, headers, passes):
    guard = server.Guard(8123)
    filled = {key: text.format(t=guard.token, c=guard.cookie) for key, text in headers.items()}
    assert guard.permits(path.format(t=guard.token), {"Host": "127.0.0.1:8123", **filled}) is passes


def test_a_port_that_is_taken_is_refused():
    with server.socket.socket() as taken:
        taken.bind((server.HOST, 0))
        taken.listen()
        with pytest.raises(SettingsError):
            server.free_port(taken.getsockname()[1])


def test_an_arm_on_the_floor_may_be_long_enough_to_get_to_what_the_hand_does():
    path = np.tile([0.4, 0.0, 0.5], (3, 1))
    path[1, 2], path[2] = 1.4, np.nan
    assert reach_from_floor(Recording(np.arange(3.0), {"hand": path})) == pytest.approx(1.9)


def told(*_):
    """Somebody who waits."""


@pytest.mark.parametrize(
    ("ways", "rank", "error"),
    [
        ([(True, 0.01), (True, 0.001)], 1, 0.01),
        ([(False, 0.03), (True, 0.04)], 1, 0.04),
        ([(False, 0.03), None, None, (True, 0.05)], 2, 0.05),
        ([None, None, (False, 0.03), (True, 0.05)], 2, 0.05),
        ([(False, 0.03), (False, 0.02), (False, 0.01), None], 1, 0.02),
        ([None, (False, 0.02)], 1, 0.02),
    ],
)
def test_the_first_arm_whose_parts_fit_is_taken(monkeypatch, ways, rank, error):
    """What printed brackets, then those of 0 and 90 degrees, of each arm become: whether they fit, and the error."""

    def build(arm, options):
        made = ways[2 * arm + (not options.printed)]
        if made is None:
            raise CatalogueError("no such arm")
        verdict = SimpleNamespace(hand_error=SimpleNamespace(max=made[1]))
        return SimpleNamespace(result=SimpleNamespace(verdict=verdict), fault="" if made[0] else "parts meet", fits=2)

    monkeypatch.setattr(motors, "build", build)
    found = buildable(range(len(ways) // 2), BuildOptions("dynamixel-p"), told)
    assert (found.rank, found.build.result.verdict.hand_error.max) == (rank, error)
    assert bool(found.why) == (rank > 1)


def test_where_nothing_can_be_built_it_is_said_and_who_does_not_wait_is_heard(monkeypatch):
    def build(*_):
        raise CatalogueError("no such arm")

    def cancel(*_):
        raise CancelledError("enough")

    monkeypatch.setattr(motors, "build", build)
    with pytest.raises(CatalogueError):
        buildable([1, 2], BuildOptions("dynamixel-p"), told)
    with pytest.raises(CancelledError):
        buildable([1, 2], BuildOptions("dynamixel-p"), cancel)


def made_of(result, fault="", speed=1.0, body=None):
    """A build as far as the page looks at it."""
    settings = SimpleNamespace(body=body or result.problem.settings.body)
    problem, body = SimpleNamespace(settings=settings), result.body
    built = SimpleNamespace(problem=problem, verdict=result.verdict, body=body, placed=True, base_pose=result.base_pose)
    options = BuildOptions("rmd", printed=True)
    warning = fault and f"NOT TO BE MADE: {fault}"
    made = SimpleNamespace(result=built, fault=fault, warning=warning, speed=speed, kit=None, options=options)
    made.assembly = SimpleNamespace(screws=(SimpleNamespace(maker="the output of X4"),))
    made.choice, made.currency = SimpleNamespace(actuators=(SimpleNamespace(name="X4"),)), "USD"
    return made


def test_an_arm_that_cannot_be_built_has_a_way_on(result):
    plain = design_arm(result)
    passed = replace(plain, result=SimpleNamespace(verdict=SimpleNamespace(passed=True)))
    failed = replace(plain, result=SimpleNamespace(verdict=SimpleNamespace(passed=False)))
    assert ways_on(passed) == []
    assert ways_on(failed) == ["Search an arm of 4 joints"]
    assert ways_on(replace(failed, joints=MOST_JOINTS)) == []
    assert ways_on(passed, refused=True) == ["Search an arm of 4 joints", SEED]
    body = result.problem.settings.body
    wider = replace(body, joint_diameter=body.joint_diameter + 0.02)
    built = replace(plain, built=made_of(result), design=result)
    assert ways_on(built) == []
    assert ways_on(replace(built, built=made_of(result, "parts meet"))) == ["Search an arm of 4 joints", SEED]
    assert ways_on(replace(built, built=made_of(result, "parts meet", body=wider)))[0] == ROOM
    hardly = replace(body, joint_diameter=body.joint_diameter + 0.0006)  # a rounding is no reason to search again
    assert ways_on(replace(built, built=made_of(result, "parts meet", body=hardly)))[1] == SEED


def test_an_arm_is_called_good_only_once_its_parts_fit_at_the_speed_shown(result):
    arm = design_arm(result)
    arm = replace(arm, error=np.full(len(arm.time), 0.004))
    words, mark = job_words(arm)
    assert (mark, "does the job" in words.lower()) == ("", False)
    words, mark = job_words(replace(arm, built=made_of(result, speed=0.166)))
    assert (mark, "16 %" in words, "not checked" in words) == ("part", True, True)
    stands = replace(arm, result=SimpleNamespace(located=True))
    assert job_words(replace(stands, built=made_of(result)))[1] == "good"
    assert job_words(replace(stands, built=made_of(result, speed=0.166)))[1] == "part"
    words, mark = job_words(replace(arm, built=made_of(result, "J1 meets J2")))
    assert (mark, "J1 meets J2" in words) == ("bad", True)
    assert job_words(replace(arm, error=np.full(len(arm.time), 0.04)))[1] == "bad"


def test_a_search_leaves_the_room_that_motors_and_brackets_take():
    for words in families():
        room = room_for_motors(family_of(words), 1.5, 0.5)
        sizes = find_catalogue(family_of(words)).actuators
        assert min(a.diameter for a in sizes) <= room["joint_diameter"] <= max(a.diameter for a in sizes) + 0.05
        heavier = room_for_motors(family_of(words), 2.5, 5.0)
        assert heavier["joint_diameter"] >= room["joint_diameter"]
        changes = {"body": room, "design": {"bounds": pedestal(room["joint_length"], 0.5)}, "fitness": hand_first(3)}
        settings = Settings().replace(changes)
        assert settings.design.bounds["d_0"][0] > room["joint_length"] / 2.0
        assert sum(settings.fitness.weights) == pytest.approx(1.0)


def test_progress_counts_all_numbers_of_joints_that_may_be_tried():
    run = RunStatus(Path("n4"), "running", iterations=1000, planned=4000, dof=4)
    words, share = progress_words(run, (3, 4, 5, 6))
    assert share == pytest.approx((1 + 0.25) / 4)
    assert "joints 4 of 3..6" in words
    assert progress_words(run, ())[1] == pytest.approx(0.25)


def test_parts_are_listed_by_how_one_comes_by_them(result, monkeypatch):
    screws = [part_lists.Row(f"screws into the output of X4, J{k}-L{k - 1}", 1, "set", "screws") for k in (1, 2, 3)]
    rows = [
        part_lists.Row("X4", 3, "piece", "bought", price=1000.0),
        part_lists.Row("<flange>", 2, "piece", "printed"),
        *screws,
    ]
    monkeypatch.setattr(part_lists, "bill_rows", lambda _: rows)
    text = built_html(made_of(result))
    assert all(word in text for word in ("To be bought", "To be printed", "&lt;flange&gt;", "<td>3 set</td>"))
    assert text.count("output of X4") == 1
    assert "<td>Joint 1</td><td>X4</td>" in text
    assert "3,000 USD in all for the lines with a price; 2 have none" in text
    assert "The base is at x" in text
    assert "maker&#x27;s drawing" in text
    assert "<details>" not in text
    faulty = built_html(made_of(result, "parts meet"))
    assert faulty.index("parts meet") < faulty.index("<details>") < faulty.index("X4")  # folded away


def test_arms_that_are_added_for_comparison_do_not_become_the_chosen_one(result):
    seen = []
    chosen = SimpleNamespace(arm=None)
    chosen.begin = lambda arm, run: setattr(chosen, "arm", arm)
    redesign = SimpleNamespace(begin=seen.append)
    page = SimpleNamespace(panels={"Parts": chosen, "Redesign": redesign}, set_html=lambda *_: None)
    page.show_arms = lambda *shown: setattr(page, "shown", [arm.name for arm, _ in shown])
    handles = {name: SimpleNamespace(value=SORTS[0], options=()) for name in ("which", "sort")}
    best = design_arm(result, "best arm")
    panel = SimpleNamespace(page=page, run=None, chosen=None, arms=[best], note=None, table=None, **handles)
    panel.show = lambda choose=None: ArmsPanel.show(panel, choose)
    panel.show()
    better = replace(best, name="alternative 2", error=best.error / 2.0)
    ArmsPanel.put(panel, [better])
    assert panel.which.value == ALL
    assert (chosen.arm, page.shown[0], len(page.shown)) == (best, "best arm", 2)  # the headline is about the first
    panel.which.value = "alternative 2"
    panel.show()
    assert (chosen.arm, page.shown, len(seen)) == (better, ["alternative 2"], 2)
    built = replace(better, name="alternative 2, as built", design=result)
    ArmsPanel.put(panel, [built], built)
    assert (chosen.arm, page.shown, seen[-1]) == (built, [built.name], built)


def test_parts_that_were_chosen_before_are_shown_again_unless_the_search_has_gone_on(result, tmp_path, monkeypatch):
    arm, run, kept = design_arm(result, "best arm"), tmp_path / "runs" / "a", tmp_path / "build" / "a"
    shown = []
    page = SimpleNamespace(work=lambda _, wish: wish())
    panel = SimpleNamespace(arm=arm, run=run, place=kept, page=page, show_built=lambda *made: shown.append(made))
    monkeypatch.setattr(download_panel, "read_result", lambda place: place)
    monkeypatch.setattr(download_panel, "recorded_build", lambda place: SimpleNamespace(of=place, gap=None))
    for file in (kept / download_panel.RECORD, run / download_panel.RESULT):
        download_panel.DownloadPanel.read_kept(panel)
        assert shown == []
        file.parent.mkdir(parents=True)
        file.touch()
    os.utime(run / download_panel.RESULT, (0, 0))
    download_panel.DownloadPanel.read_kept(panel)
    ((before, design, made, why),) = shown
    assert (before, design.result, made.of, why) == (arm, result, kept, "")
    os.utime(kept / download_panel.RECORD, (0, 0))
    os.utime(run / download_panel.RESULT, (1, 1))
    download_panel.DownloadPanel.read_kept(panel)
    assert len(shown) == 1


def test_the_time_of_an_arm_that_is_slowed_down_ends_at_a_round_number():
    page = SimpleNamespace(time=SimpleNamespace(min=0.0, max=2.4, value=2.0))
    Page.span(page, 0.0, 2.4 / 0.57)
    assert (page.time.min, page.time.max, page.time.value) == (0.0, 4.22, 2.0)
    Page.span(page, 1.2, 1.2)
    assert (page.time.min, page.time.max) == pytest.approx((1.2, 1.22))


def test_the_report_of_a_built_arm_is_that_of_its_folder(result, tmp_path, monkeypatch):
    monkeypatch.setattr(download_panel, "report_html", lambda run: f"{run.folder} {run.table.dof}")
    arm = design_arm(result)
    panel = SimpleNamespace(arm=arm, place=tmp_path / "build" / "a")
    assert DownloadPanel.report_page(panel, result) == {"report.html": b"None 3"}
    panel.arm = replace(arm, built=made_of(result), design=result)
    monkeypatch.setattr(download_panel, "part_lists", lambda _: {BILL: "part"})
    monkeypatch.setattr(download_panel, "build_record", lambda *_: "{}")
    DownloadPanel.keep(panel, SimpleNamespace(result=result), result)
    assert (panel.place / BILL).read_text() == "part"
    assert DownloadPanel.report_page(panel, result) == {"report.html": f"{panel.place} 3".encode()}


def test_the_sliders_are_those_of_the_arm_as_it_is_built(result):
    space = result.problem.space
    Phi = np.round(0.75 * space.bounds[0] + 0.25 * space.bounds[1], 3)
    built = SimpleNamespace(problem=result.problem, table=space.table(Phi))
    gui = SimpleNamespace(add_slider=lambda name, low, high, step, value: SimpleNamespace(value=value))
    page = SimpleNamespace(gui=gui, set_html=lambda *_: None, watch=lambda *_: None)
    handles = {name: SimpleNamespace(visible=False) for name in ("back", "take")}
    panel = SimpleNamespace(page=page, sliders=[], solve=None, state=None, gradient=None, folder=MagicMock(), **handles)
    RedesignPanel.begin(panel, replace(design_arm(result), result=built, design=result))
    shown = [each.value / scale_of(name) for each, name in zip(panel.sliders, space.free_names, strict=True)]
    np.testing.assert_allclose(shown, Phi, atol=1e-3)


@pytest.fixture
def studio_page(result, tmp_path):
    """Arms, Redesign and Parts of a real page over stand-ins for viser's handles, with one arm that was found."""

    def handle(label, options=("",), **more):
        kept = {"label": label, "options": options, "value": options[0], "visible": True, "disabled": False}
        return MagicMock(**kept | more)

    gui = MagicMock()
    for name in ("add_html", "add_button", "add_dropdown", "add_progress_bar"):
        getattr(gui, name).side_effect = handle
    gui.add_slider.side_effect = lambda name, low, high, step, value: MagicMock(value=value, min=low, max=high)
    viser = SimpleNamespace(gui=gui, scene=MagicMock(), on_client_connect=lambda _: None, get_clients=dict)
    page = Page(viser, tmp_path)
    page.work = page.slow = lambda _, wish: None
    page.work.wishes = {}
    room, search = MagicMock(), SimpleNamespace(run=None, changed=lambda: "")
    room.motors.value = families()[0]
    page.panels = {"Room": room, "Search": search}
    page.panels |= {"Arms": ArmsPanel(page), "Redesign": RedesignPanel(page), "Parts": DownloadPanel(page)}
    run = tmp_path / "runs" / "reach-n3-seed0"
    page.panels["Arms"].begin(replace(result, name=run.name), run)
    return page


def test_an_arm_that_is_changed_by_hand_is_not_sold_as_the_one_before(studio_page):
    page = studio_page
    arms, redesign, parts = (page.panels[name] for name in ("Arms", "Redesign", "Parts"))
    found = page.arm
    assert (parts.doubt.visible, parts.parts.color) == (False, "green")
    slider = redesign.sliders[3]
    slider.value = before = slider.value + 0.02 * (slider.max - slider.min)
    redesign.solve()
    assert page.arm is redesign.changed is not found
    assert "changed by hand" in parts.doubt.content
    assert (parts.doubt.visible, parts.built.visible) == (True, False)
    assert "as changed" in parts.parts.label
    redesign.go_back()  # a wrong click
    assert (page.arm, parts.doubt.visible, redesign.back.label) == (found, False, AGAIN)
    redesign.go_back()
    assert (redesign.sliders[3].value, page.arm is redesign.changed) == (before, True)
    redesign.keep()
    kept = page.folder / "runs" / "reach-n3-seed0-changed"
    assert (parts.arm.name, parts.run, parts.doubt.visible) == (CHANGED, kept, False)
    np.testing.assert_allclose(read_result(kept).table.d, parts.arm.result.table.d, atol=1e-9)
    assert found.name in [arm.name for arm in arms.arms]


def test_an_arm_that_reaches_nothing_says_what_to_press(studio_page, monkeypatch):
    def miss(*_):
        raise SearchError("the arm does not reach the first frame", fix="Raise fitness.reach_tolerance")

    monkeypatch.setattr(redesign_panel, "evaluate_candidate", miss)
    redesign, before = studio_page.panels["Redesign"], studio_page.arm
    redesign.solve()
    assert "The arm does not reach" in redesign.state.content
    assert "reach_tolerance" not in redesign.state.content
    assert (studio_page.arm, redesign.back.disabled) == (before, False)


def test_what_has_changed_on_the_page_since_the_search_is_said_before_anything_good(studio_page):
    page, asked = studio_page, {"the load": 0.5, "the tolerance": 20.0}
    search, parts = page.panels["Search"], page.panels["Parts"]
    search.asked, search.asks = dict(asked), lambda: asked
    search.changed = lambda: SearchPanel.changed(search)
    page.say_next()
    assert (search.changed(), parts.parts.color, parts.doubt.visible) == ("", "green", False)
    asked["the load"] = 3.0
    page.say_next()
    head = page.headline.content
    assert "the load" in head
    assert "the tolerance" not in head
    assert head.index("search again") < head.index("furthest off")
    assert (parts.parts.color, parts.doubt.visible) == ("gray", True)
    search.asked = {}  # of a run whose recording is gone nothing is known
    assert search.changed() == ""


def test_a_searched_arm_is_not_judged_as_if_it_had_motors(result):
    words = judged_words(result)
    assert "before motors are chosen" in words[1]
    assert words[-1].startswith("Motors are not chosen yet. Their speed is assumed")
    assert "(assumed)" in load_words(ASSUMED_LOAD)
    assert "(assumed)" not in load_words(3.0)

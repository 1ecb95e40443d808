"""The flags from a recording to a task: the same for every command, all of them settings as well."""

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from armdesign.cli.screen import CompilationBar, SearchBar, SweepBar
from armdesign.cli.setting_flags import flagged
from armdesign.search.search import Progress
from armdesign.settings.sections import Task as TaskSettings

SHARED = Path(__file__).resolve().parents[3] / "shared" / "recordings"
BOX = ("--base", "ACRO_tip", "--points", "elbow=EPICl+EPICm,wrist=STYLr+STYLu,hand=INDEX+LASTC+MEDH+LATH")
real = pytest.mark.skipif(not SHARED.is_dir(), reason="the shared recordings are not at hand")

FLAGS = {
    "--base": ("shoulder", "base", "shoulder"),
    "--points": ("elbow=A+B, hand", "points", ["elbow=A+B", "hand"]),
    "--orientation": ("hand", "orientation", "hand"),
    "--base-mode": ("fixed", "base_mode", "fixed"),
    "--units": ("mm", "units", "mm"),
    "--up": ("y", "up", "y"),
    "--time-unit": ("ms", "time_unit", "ms"),
    "--quaternions": ("wxyz", "quaternions", "wxyz"),
    "--confidence": ("0.3", "confidence", 0.3),
    "--max-gap": ("0.4", "max_gap", 0.4),
    "--low-pass": ("8", "low_pass", 8.0),
    "--from": ("0.5", "start", 0.5),
    "--to": ("1.5", "stop", 1.5),
    "--cut": ("0.7:0.9", "cut", [[0.7, 0.9]]),
    "--rate": ("25", "rate", 25.0),
    "--scale": ("1.5", "scale", 1.5),
    "--mirror": (None, "mirror", True),
    "--no-mirror": (None, "mirror", False),
    "--outliers": (None, "outliers", True),
    "--no-repeats": (None, "repeats", False),
}


def settings(run, *flags):
    outcome = run("search", "--write-config", *flags)
    assert outcome.exit_code == 0, outcome.output
    return tomllib.loads(outcome.stdout)["task"]


@pytest.mark.parametrize("flag", FLAGS)
def test_a_flag_is_a_setting(run, flag):
    text, name, value = FLAGS[flag]
    assert settings(run, flag, *([] if text is None else [text]))[name] == value


def test_flags_go_over_the_file(run, place):
    (place / "mine.toml").write_text("[task]\nmirror = true\nlow_pass = 3\ncut = [[1, 2]]\nscale = 2\n")
    task = settings(run, "--config", "mine.toml", "--no-mirror", "--low-pass", "off", "--cut", "3:4", "--cut", "5:6")
    assert (task["mirror"], task["low_pass"], task["cut"], task["scale"]) == (False, "off", [[3, 4], [5, 6]], 2.0)


def test_every_task_setting_but_the_files_has_a_flag():
    assert set(TaskSettings.names()) - set(flagged(TaskSettings)) == {
        *("recording", "files", "file_rate"),  # which files: arguments, or the settings
        *("more_recordings", "holdouts"),
    }


@pytest.mark.parametrize("command", [("search",), ("evaluate",), ("sweep",), ("recording", "convert")])
def test_every_command_has_all_of_them(run, command):
    outcome = run(*command, "--help")
    assert outcome.exit_code == 0
    for flag in FLAGS:
        assert re.search(rf"{flag}\b.*\w{{3,}}", outcome.output), flag


def test_the_ways_out_work(run, place, packaged, packaging, welding, small):
    for flags in (("--weights", "1"), ("--scenario", "packaging")):
        assert run("evaluate", packaged[0], packaging, "--points", "hand", *flags).exit_code == 0
    flags = ("--scenario", "welding", "--weights", "0.2,0,0.1,0.7")
    assert run("search", welding, *flags, *small, "--out", "run").exit_code == 0


def test_a_recording_in_millimetres_is_the_same_task(run, place, packaging, small):
    lines = packaging.read_text(encoding="utf-8").splitlines()
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    table[:, 1:] *= 1000.0
    (place / "mm.csv").write_text("\n".join([lines[0], *(",".join(map(repr, row)) for row in table.tolist())]))
    assert run("search", "mm.csv", "--units", "mm", *small, "--out", "mm").exit_code == 0
    assert run("search", packaging, *small, "--out", "m").exit_code == 0
    one, other = (np.loadtxt(place / name / "task.csv", delimiter=",", skiprows=1) for name in ("mm", "m"))
    np.testing.assert_allclose(one, other, atol=1e-12)
    told = json.loads((place / "mm" / "task.json").read_text())
    assert (told["units"], told["up"]) == ("mm", "z")
    again = run("evaluate", "mm", "mm/task.csv", "--base", "origin")  # which is in metres
    assert again.exit_code == 0, again.output
    assert "not used: units" in again.output


def test_a_run_is_evaluated_on_its_own_recording_where_none_is_named(run, place, packaged):
    folder, _ = packaged
    outcome = run("evaluate", folder, "--out", "again")
    assert outcome.exit_code == 0, outcome.output
    one, other = (json.loads((place / path / "result.json").read_text()) for path in (folder, "again"))
    assert one["fitness"] == other["fitness"]
    (place / "arm.csv").write_text("alpha,a,d\n0.5,0,0\n1.0,0.3,0.1\n0.5,0.1,0.1\n")
    assert "no recording given. Write 'armdesign evaluate DESIGN RECORDING'" in run("evaluate", "arm.csv").output


@real
def test_a_capture_is_searched_with_names_of_its_own(run, place, small):
    box = SHARED / "pyomeca" / "box_lift.c3d"
    outcome = run("search", box, *BOX, "--orientation", "hand", "--scenario", "welding", *small, "--out", "run")
    assert outcome.exit_code == 0, outcome.output
    for said in ("Took out 1 outlier", "Filled ", "Smoothed by", "Distances: ACRO_tip to elbow 308 +- 12 mm"):
        assert said in outcome.output
    result = json.loads((place / "run" / "result.json").read_text())
    assert result["points"] == ["elbow", "wrist", "hand"]
    assert "elbow=Daphnee:EPICl+Daphnee:EPICm" in result["settings"]["task"]["points"]
    told = json.loads((place / "run" / "task.json").read_text())
    assert told["format"] == "C3D"
    assert told["sources"] == [result["recording"]]
    for recording in ((), (box,), ("run/task.csv", "--base", "origin")):
        again = run("evaluate", "run", *recording, "--out", "again", "--overwrite")
        assert again.exit_code == 0, again.output
        assert json.loads((place / "again" / "result.json").read_text())["fitness"] == result["fitness"]


@real
def test_several_files_are_one_recording_through_the_config(run, place, small):
    folder = SHARED / "kth_handover"
    files = {name: str((folder / f"giver_{name}_pose_saved.csv").resolve()) for name in ("RUArm", "RFArm", "RHand")}
    table = ", ".join(f'{name} = "{path}"' for name, path in files.items())
    (place / "kth.toml").write_text(f"[task]\nfile_rate = 120\nfiles = {{ {table} }}\n")
    outcome = run("search", "--config", "kth.toml", *small)
    assert outcome.exit_code == 0, outcome.output
    assert "Interpolated 76 frames that repeat the one before" in outcome.output
    (told,) = (place / "runs").glob("kth_handover-*/task.json")
    sources = json.loads(told.read_text())["sources"]
    assert [source["path"] for source in sources] == list(files.values())
    assert all(source["sha256"] for source in sources)


@real
def test_sweeps_take_captures_of_several_formats(run, place, small):
    recordings = [SHARED / "pyomeca" / "box_lift_vicon.csv", SHARED / "pyomeca" / "box_lift.c3d"]
    outcome = run("sweep", *recordings, *BOX, *small, "--seeds", "1", "--low-pass", "8", "--out", "sweep")
    assert outcome.exit_code == 0, outcome.output
    told = [json.loads(path.read_text()) for path in (place / "sweep").glob("box_lift*/task.json")]
    assert {content["format"] for content in told} == {"C3D", "Vicon Nexus CSV"}
    assert all(content["settings"]["low_pass"] == 8.0 for content in told)


class Terminal:
    """Where standard error goes to if it is a terminal."""

    def __init__(self):
        self.text = ""

    def write(self, text):
        self.text += text

    def flush(self):
        pass

    def isatty(self):
        return True


def test_what_follows_a_bar_begins_on_a_line_of_its_own(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    for iteration in (1, 9):
        with SearchBar() as bar:
            bar(Progress(iteration, 9, 1.0, 0.1, 0.1, 1, 1, 1.0))
        shown = re.sub(r"\x1b\[[?\d;]*[a-zA-Z]", "", terminal.text)
        assert shown.splitlines()[-1].endswith("left")
        assert shown.endswith("\n")
    before = terminal.text
    with SearchBar(), SweepBar():
        pass
    assert terminal.text == before


@pytest.mark.parametrize(("patience", "said"), [(0.0, 1), (60.0, 0)])
def test_compiling_is_announced_once_where_it_takes_a_while(monkeypatch, capsys, patience, said):
    monkeypatch.setattr("armdesign.cli.screen.PATIENCE", patience)
    with CompilationBar() as bar:
        for done in (1, 5, 9):
            bar(done, 9)
    assert capsys.readouterr().err.count("Compiling the kernels") == said
    with CompilationBar() as bar:
        bar(9, 9)  # all of it comes from the disk cache
    assert capsys.readouterr().err == ""


LENGTHS = {"5mm": 0.005, "0.5cm": 0.005, "0.005": 0.005, "5e-3 m": 0.005, "2in": 0.0508, "35 mm": 0.035, "1/200": 0.005}


@pytest.mark.parametrize("text", LENGTHS)
def test_lengths_are_metres_or_have_their_unit(run, text):
    outcome = run("search", "--write-config", "--tolerance", text, "--clearance", text)
    assert outcome.exit_code == 0, outcome.output
    settings = tomllib.loads(outcome.stdout)
    assert settings["needs"]["hand_tolerance"] == settings["body"]["clearance"] == LENGTHS[text]


@pytest.mark.parametrize("text", ["0", "0mm", "5 miles", "mm", "-1mm", "nan"])
def test_a_length_that_is_none_is_refused(run, text):
    outcome = run("search", "--write-config", "--tolerance", text)
    assert outcome.exit_code == 2
    assert len(outcome.stderr.splitlines()) == 1
    assert "olerance" in outcome.stderr
    assert "above 0" in outcome.stderr


def test_regions_and_obstacles_may_be_several(run, place):
    flags = (
        "--place",
        "x=0..1,y=0.5,z=0",
        "--place",
        "x=2 y=0..1 z=0",
        "--obstacles",
        "a.toml,b.stl",
        "--obstacles",
        "c.stl",
    )
    outcome = run("search", "--write-config", *flags, "--mounted", "floor")
    assert outcome.exit_code == 0, outcome.output
    cell = tomllib.loads(outcome.stdout)["cell"]
    assert cell["place"] == ["x=0..1,y=0.5,z=0", "x=2 y=0..1 z=0"]
    assert cell["obstacles"] == [str((place / name).resolve()) for name in ("a.toml", "b.stl", "c.stl")]


def test_what_is_asked_of_bodies_is_not_asked_of_a_thin_arm(run):
    outcome = run("search", "--write-config", "--body", "thin", "--clearance", "5mm")
    assert outcome.exit_code == 2
    assert "--clearance" in outcome.stderr
    assert run("search", "--write-config", "--body", "tube", "--clearance", "5mm").exit_code == 0

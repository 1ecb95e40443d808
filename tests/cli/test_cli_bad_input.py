"""Bad input to any command: one sentence with the value, what is allowed and the way out; exit code 2; no file written.

What a single reader, settings section or formula refuses is tested in its own room; here is one of every kind.
"""

import re
import shlex

import pytest

from armdesign.cli import COMMANDS

SETTINGS = {
    "section.toml": "[robot]\ndof = 3\n",
    "entry.toml": "[design]\ndegrees = 3\n",
    "range.toml": "[design]\ndof = 11\n",
    "huge.toml": f"[design]\ndof = {10**400}\n",
    "type.toml": "[search]\nseed = 'zero'\n",
    "bounds.toml": "[design]\na = [0.5, 0.1]\n",
    "lengths.toml": "[design]\nlength = [8, 9]\n",
    "name.toml": "[design]\nbounds = { a_9 = [0, 1] }\n",
    "fixed.toml": "[design]\nalpha = [0, 0]\na = [0.2, 0.2]\nd = [0.1, 0.1]\n",
    "limits.toml": "[design]\njoint_limits = [[-10, 10], [-20, 20]]\n",
    "weights.toml": "[fitness]\nweights = [0.5, 0.5]\n",
    "hand.toml": "[fitness]\nweights = [0.5, 0.5, 0.0]\n",
    "crop.toml": "[task]\nstart = 5.0\n",
    "filter.toml": "[task]\nlow_pass = 25.0\n",
    "cut.toml": "[design\ndof = 3\n",
    "both.toml": "[task]\nrecording = 'take.csv'\nfiles = { hand = 'hand.csv' }\n",
}
DESIGNS = {
    "cut.json": '{"dh": {"rows": [[0, 0, 0',
    "none.json": '{"dh": {}}',
    "word.json": '{"rows": [["x", 0, 0]]}',
    "huge.json": f'{{"rows": [[{10**400}, 0, 0]]}}',
    "endless.json": f'{{"rows": [[{"1" * 5000}, 0, 0]]}}',
    "yaw.json": '{"base_yaw": "x", "rows": [[0, 0, 0], [0, 0.5, 0.1]]}',
    "eleven.json": f'{{"rows": {[[1, 0.1, 0]] * 12}}}',
    "point.json": '{"rows": [[0, 0, 0], [0, 0, 0]]}',
    "header.csv": "alpha,a\n1,2\n",
    "comma.csv": "alpha,a,d\n0,0,0\n1,57,0,3,0,1\n",
    "far.csv": "alpha,a,d\n0,0,0\n0,0.1,0\n0,0,0.1\n",
    "odd.json": '{"rows": [[1, 0.3, 0], [0, 0.3, 0]], "settings": {"design": {"colour": "red"}}}',
}
RECORDINGS = {
    "empty.csv": lambda text: "",
    "prose.csv": lambda text: "Dear diary,\ntoday I moved my arm.\n",
    "headless.csv": lambda text: text.split("\n", 1)[1],
    "mm.csv": lambda text: re.sub(r",(-?\d+\.\d+)", lambda cell: f",{1000 * float(cell[1])}", text),
    "still.csv": lambda text: re.sub(r"(\n0\.06,.*)\n[^,]*,", r"\1\n0.06,", text),
    "word.csv": lambda text: re.sub(r"\n(0\.08),[^,]*,", r"\n\1,oops,", text),
    "lone.csv": lambda text: re.sub(r"(?m)^((?:[^,]*,){3}[^,]*).*$", r"\1", text),
    "gap.csv": lambda text: re.sub(r"(?m)^((?:0\.[89]|1\.0)\d*),(.*),[^,]*$", r"\1,\2,NaN", text),
    "far-off.csv": lambda text: re.sub(r"(?m)^(\d.*),[^,]*,([^,]*),([^,]*)$", r"\1,1.5,\2,\3", text),
    "two.csv": lambda text: text.replace("forearm", "elbow"),
}
CASES = [
    # the studio
    ("studio missing.c3d", "missing.c3d", "does not exist"),
    # parts
    ("catalogue show nobody", "'nobody'", "dynamixel-x", "rmd"),
    ("catalogue check prose.csv", "prose.csv lacks key", "MGDB"),
    ("build runs/none --catalogue rmd", "runs/none"),
    ("build runs/none --catalogue rmd --speed fast", "--speed", "fast"),
    ("build runs/none --catalogue rmd --deflection much", "--deflection", "1mm"),
    ("build runs/none --catalogue rmd --margin 0.5", "--margin", "1 to 100"),
    ("tolerance runs/none --samples 1", "--samples", "10 to 1000000"),
    ("importance runs/none", "runs/none"),
    # the recording
    ("search", "no recording", "armdesign search RECORDING"),
    ("search nothing.csv", "nothing.csv", "does not exist"),
    ("recording info {place}", "is a folder"),
    ("search binary.csv", "binary.csv", "known format", "C3D"),
    ("search {long}", "name too long"),
    ("search empty.csv", "empty.csv", "is empty"),
    ("search prose.csv", "line 1", "'time'", "allowed: time, NAME_x"),
    ("search headless.csv", "line 1", "no header"),
    ("search mm.csv", r"57\d\.\d m", "allowed: 0.1 to 2 m", "--units mm"),
    ("search {packaging} --units mm", r"0\.000\d+ m", "allowed: 0.1 to 2 m"),
    ("search still.csv", "line 6", "'time'", "0.06 s"),
    ("search word.csv", "line 6", "'oops'"),
    ("search lone.csv", "'shoulder'", "no point to follow"),
    ("search gap.csv", "'hand'", "0.2 s", r"--to 0\.\d+", r"--from 1\.\d+", "--max-gap"),
    ("search far-off.csv", "from the base", "L_max = 1.2 m", "design.length"),
    ("search 'bad\udcff.csv'", "not UTF-8"),
    ("search --config both.toml", "task.recording", "task.files"),
    # its points
    ("search {packaging} --points elbow,hand", "'elbow'", "allowed: shoulder, upper_arm, forearm, hand"),
    ("search {packaging} --base hip", "'hip'", "allowed: shoulder, upper_arm, forearm, hand"),
    ("search {packaging} --points hand,hand", "'hand'", "twice"),
    ("search {packaging} --points shoulder,hand", "'shoulder'", "base"),
    ("search {packaging} --scenario welding", "orientation of 'hand'", "w_0 = 0"),
    ("search {welding} --scenario welding --orientation forearm", "'forearm'", "allowed: hand"),
    ("recording convert {packaging} out.csv --points R.Elbw", "'R.Elbw'", "allowed: shoulder"),
    # several demonstrations
    ("search {packaging} two.csv", r"packaging.csv has .*forearm", r"two.csv has .*elbow", "--points"),
    ("search {packaging} --holdout two.csv", "two.csv has", "--points"),
    ("search {packaging} {packaging}", "packaging.csv", "twice"),
    ("search {packaging} --holdout {packaging}", "packaging.csv", "held out"),
    ("search {packaging} --demonstrations mean", "--demonstrations", "one demonstration"),
    ("search {welding} {packaging} --scenario welding", "packaging.csv", "orientation of 'hand'"),
    ("sweep {packaging} packaging.csv", "one name"),
    # settings files
    ("search {packaging} --config nothing.toml", "nothing.toml"),
    ("search {packaging} --config {place}", "cannot read"),
    ("search {packaging} --config binary.csv", "not UTF-8"),
    ("search {packaging} --config cut.toml", "cut.toml", "line 1", "--write-config"),
    ("search {packaging} --config section.toml", "robot", "allowed: task, design, cell, body, needs, "),
    ("search {packaging} --config entry.toml", "design.degrees", "allowed: dof, alpha"),
    ("search {packaging} --config range.toml", "range.toml", "design.dof.* 11;", "allowed: .*1 to 10"),
    ("search {packaging} --config huge.toml", "design.dof", "allowed: .*1 to 10"),
    ("search {packaging} --config type.toml", "search.seed.* 'zero';", "allowed: a whole number"),
    ("search {packaging} --config bounds.toml", r"\[0.5, 0.1\]", r"\[0.1, 0.5\]"),
    ("search {packaging} --config lengths.toml", "0.1 to 2.1 m", "8 to 9 m"),
    ("search {packaging} --config name.toml", "a_9", "allowed: alpha_0"),
    ("search {packaging} --config fixed.toml", "fixed", "armdesign evaluate"),
    ("search {packaging} --config limits.toml", "2 pairs for 3 joints", "allowed: 1 or 3 pairs"),
    ("search {packaging} --config weights.toml", "2 weights", "3 points", "allowed: 3 weights"),
    ("search {packaging} --config hand.toml", "hand", "no weight"),
    ("search {packaging} --config crop.toml", "5.0 s", "0 frames"),
    ("search {packaging} --config filter.toml", "25.0 Hz", "allowed: .*25 Hz"),
    # what the arm must do
    ("search {packaging} --tolerance 0", "hand_tolerance.* 0.0;", "above 0"),
    ("search {packaging} --tolerance-angle 3", "3 deg", "--tolerance-angle"),
    ("search {packaging} --max-speed 90,90", "max_speed.* 2 numbers", "allowed: 1 or 3 numbers"),
    ("search {packaging} --max-torque 0", "max_torque.* 0.0", "above 0"),
    ("search {packaging} --body thin --clearance 5mm", "--clearance", "allowed: .*--body tube"),
    ("search {packaging} --body thin --obstacles cell.toml", "--obstacles", "allowed: .*--body tube"),
    ("search {packaging} --body thin --stay-within 80mm", "--stay-within", "allowed: .*--body tube"),
    ("check nothing", "nothing", "Check the path"),
    ("check {place}", "holds no result"),
    # options
    *((f"search {{packaging}} --dof={n}", "allowed: a whole number from 1 to 10") for n in ("0", "11", "x", "''")),
    ("search {packaging} --iterations 1000000000000", "search.iterations", "allowed: a whole number from 1"),
    ("search {packaging} --workers 0", "--workers is 0", "allowed: a whole number of at least 1"),
    ("search {packaging} --seed=-1", "search.seed.* -1;", "allowed: a whole number from 0"),
    ("search {packaging} --algorithm cma", "'cma'", "allowed: rapso, pso"),
    ("search {packaging} --weights 1/6,1/3,1/3", "0.83", "allowed: a sum of 1"),
    ("search {packaging} --weights 0,0.1,0.7", "0.8", "--weights 0.2,0,0.1,0.7"),
    ("search {packaging} --weights 0.5,1/0,0.5", "--weights", "0.5,1/0,0.5", "allowed: a list"),
    ("search {packaging} --weights 0.5,1e400,0.5", "inf", "allowed: a number from 0 to 1"),
    ("search {packaging} --scenario welding --points forearm,hand", "three points", "--points", "--weights"),
    ("search {packaging} --low-pass often", "'often'", "allowed: .*off"),
    ("search {packaging} --cut a:b", "'a:b'", "allowed: two numbers A:B"),
    ("search {packaging} --cut 0.5:1.0", r"\d+ mm", "allowed: at most 5 mm"),
    ("search {packaging} --up w", "'w'", "allowed: x, y, z"),
    ("search {packaging} --time-limit soon", "'soon'", "90s"),
    # options that contradict each other, or have no effect
    ("search {packaging} --budget 500 --particles 9", "--budget", "multibasin"),
    ("search {packaging} --algorithm multibasin --iterations 5", "--iterations", "rapso, pso"),
    ("search {packaging} --overwrite", "--overwrite", "--out"),
    ("search {packaging} --within 3", "--within", "--dof auto"),
    ("search --resume {place} --seed 3", "--seed", "--out"),
    ("search {packaging} --resume {place}", "the recording", "--out"),
    ("sweep {packaging} --algorithm pso --budget 500", "--budget", "multibasin"),
    ("sweep {packaging} --algorithm pso --d 2", "--d", "rapso"),
    ("export {run} --rate 50", "--rate", "--trajectory"),
    ("export {run} --trajectory csv --payload 2", "--payload", "--format"),
    ("preview {run} --html a.html --port 80", "--port", "--html"),
    ("compare {run} ur5 --overwrite", "--overwrite", "--json"),
    # outputs
    ("search {packaging} --out binary.csv", "binary.csv is a file", "--out"),
    ("search {packaging} --out binary.csv/run", "binary.csv/run", "--out"),
    *((f"{each} {{packaging}} --out {{long}}", "cannot write to the output folder")
      for each in ("search", "search --dof auto", "sweep", "study designs")),
    ("search {packaging} --out {run}", "already holds a run", "--overwrite"),
    ("evaluate {run} {packaging} --out {run}", "already holds a run", "--overwrite"),
    ("recording plot {packaging} --out take.gif", "'.gif'", "allowed: .png, .svg, .pdf"),
    ("recording convert {packaging} out.trc", "out.trc", "armdesign recording convert"),
    ("report {run} --out page.pdf", "page.pdf", "page.html --pdf"),
    # given arms
    ("evaluate nothing.json {packaging}", "nothing.json", "No such file"),
    ("evaluate far.csv", "armdesign evaluate DESIGN RECORDING"),
    ("evaluate binary.csv {packaging}", "not text", "allowed: JSON, TOML or CSV"),
    ("evaluate cut.json {packaging}", "cut.json", "line 1, column"),
    ("evaluate none.json {packaging}", "rows", "allowed: rows like"),
    ("evaluate word.json {packaging}", r"rows\[0\].alpha.* 'x';", "allowed: a finite number"),
    ("evaluate huge.json {packaging}", r"huge.json: rows\[0\].alpha"),
    ("evaluate endless.json {packaging}", "endless.json"),
    ("evaluate yaw.json {packaging}", "base_yaw", "'x'"),
    ("evaluate eleven.json {packaging}", "11 joints", "allowed: 1 to 10"),
    ("evaluate point.json {packaging}", "length"),
    ("evaluate header.csv {packaging}", "'alpha, a'", "allowed: alpha,a,d"),
    ("evaluate comma.csv {packaging}", r"rows\[1\]", "more cells"),
    ("evaluate far.csv {packaging}", "does not reach the first frame"),
    ("evaluate odd.json {packaging}", "odd.json", "design.colour"),
    ("evaluate {run} {packaging} --convention craig", "'craig'", "allowed: modified, classic"),
    ("evaluate {run} {packaging} --convention classic", "modified", "classic"),
    ("evaluate {run} {packaging} --points hand", "3 weights", "1 point", "--weights", "--scenario packaging"),
    # sweeps and studies
    ("sweep {packaging} --dof 6-3", "6-3", "Write 3-6"),
    ("sweep {packaging} --dof three", "'three'", "allowed: whole numbers"),
    ("sweep {packaging} --seeds 0", "--seeds is 0"),
    ("sweep {packaging} --d 0", "angle_interval.* 0;", "allowed: a whole number from 1"),
    ("sweep --resume .", "sweep.toml"),
    ("sweep {packaging} --out s --resume s", "the recording, --out", "repeat"),
    ("study temporal --reps 0", "--reps is 0", "allowed: 1 or more"),
    ("study temporal --dof 3-11", "11 joints", "allowed: 1 to 10"),
    ("study temporal --algorithm newton", "'newton'", "allowed: ga, pso, woa"),
    ("study temporal --algorithm ,", "--algorithm is empty"),
    ("study temporal --budget 120", "120 evaluations", "Raise --budget"),
    ("study temporal --seed 4294967295 --reps 2", "4294967296", "allowed: .*2.32"),
    ("study temporal nowhere.toml", "nowhere.toml"),
    ("study temporal packaging {packaging}", "one name"),
    ("study temporal --resume .", "holds no study"),
    ("study robot --algorithm de", "'de'"),
    ("study robot --particles 40 --iterations 3", "120 evaluations"),
    ("study rapso --range ''", "--range"),
    ("study designs --scenario painting", "painting", "allowed: packaging, welding"),
    # the other commands
    ("recording info", "armdesign recording info RECORDING"),
    ("recording info nothing.c3d", "nothing.c3d", "does not exist"),
    ("recording info {packaging} --units parsec", "'parsec'", "allowed: m, cm"),
    ("recording plot nothing.c3d", "nothing.c3d", "does not exist"),
    ("recording convert a b c.csv", "3 paths", "allowed: FILE OUT.csv"),
    ("recording convert out.csv", "armdesign recording convert RECORDING"),
    ("recording convert a.c3d out.csv --base-mode fixed", "base mode", "--base-mode"),
    ("runs nowhere", "nowhere", "does not exist"),
    ("runs binary.csv", "is a file"),
    ("alternatives {run} --count 0", "0 alternatives", "allowed: .*1"),
    ("export {run} --format step", "is no build", "armdesign build"),
    ("export {run} --package My-Arm", "'My-Arm'", "lower-case letters"),
    ("catalogue show nothing", "'nothing'", "allowed: dynamixel-p"),
    ("search {packaging} --joints RXP", "'RXP'", "3 letters R or P"),
    ("search {packaging} --joints RPR --max-speed 90", "max_speed", "3 numbers"),
    ("report nowhere", "nowhere", "does not exist"),
    ("preview {run} --speed 0", "speed", "allowed"),
    ("compare {run} ur6", "ur6"),
    ("compare {run} ur5 --payload=-1", "--payload is -1 kg", "allowed: 0 to 10000 kg"),
]  # fmt: skip


@pytest.fixture(scope="session")
def bad_files(packaging, tmp_path_factory):
    """A folder of files that cannot be used."""
    folder, text = tmp_path_factory.mktemp("bad"), packaging.read_text()
    for name, content in (SETTINGS | DESIGNS).items():
        (folder / name).write_text(content)
    for name, change in RECORDINGS.items():
        (folder / name).write_text(change(text))
    for name, content in (("binary.csv", bytes(range(256)) * 40), ("packaging.csv", text.encode())):
        (folder / name).write_bytes(content)
    (folder / "bad\udcff.csv").write_bytes(text.encode())
    return folder


@pytest.mark.parametrize(("line", "parts"), [(line, parts) for line, *parts in CASES], ids=[case[0] for case in CASES])
def test_bad_input_is_refused_in_one_sentence(
    refused, bad_files, packaging, welding, packaged, monkeypatch, line, parts
):
    monkeypatch.chdir(bad_files)
    names = {"packaging": packaging, "welding": welding, "run": packaged[0], "place": bad_files, "long": "x" * 300}
    sentence = refused(*(part.format(**names) for part in shlex.split(line)))
    for part in parts:
        assert re.search(part, sentence), sentence
    assert len(sentence) < 5000


def test_every_command_is_among_them():
    assert {line.split()[0] for line, *_ in CASES} == set(COMMANDS)


@pytest.mark.parametrize("args", [("serach",), ("search", "--dofs", "3"), ("evaluate",)])
def test_words_that_are_none_are_refused_without_a_traceback(run, args):
    outcome = run(*args)
    assert outcome.exit_code == 2
    assert "Traceback" not in outcome.output
    assert "Error" in outcome.output


def test_search_that_finds_nothing_says_how_near_it_came(run, place, packaging):
    outcome = run("search", packaging, "--dof", 2, "--particles", 4, "--iterations", 1, "--out", "deep/run")
    assert outcome.exit_code == 4
    sentence = outcome.output.splitlines()[-1]
    assert re.search(r"within 1 mm .* \d+\.\d mm short", sentence)
    assert "more joints" in sentence
    assert not (place / "deep" / "run" / "result.json").exists()

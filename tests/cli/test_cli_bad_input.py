"""Bad input: one sentence that says what, where, what is allowed and what to do; exit code 2; nothing written."""

import re

import numpy as np
import pytest


def lines_of(path):
    return path.read_text(encoding="utf-8").splitlines()


def cells(lines, change):
    """The lines with every number but the times changed."""
    rows = [[float(cell) for cell in line.split(",")] for line in lines[1:]]
    return [lines[0], *(",".join([repr(row[0]), *(repr(change(x)) for x in row[1:])]) for row in rows)]


def replaced(lines, row, column, text):
    parts = lines[row].split(",")
    parts[lines[0].split(",").index(column)] = text
    return [*lines[:row], ",".join(parts), *lines[row + 1 :]]


def blanked(lines, point):
    """A point that was never seen."""
    for row in range(1, len(lines)):
        for axis in "xyz":
            lines = replaced(lines, row, f"{point}_{axis}", "")
    return lines


RECORDINGS = {
    "empty file": (lambda lines: [], "is empty. Export it again"),
    "prose": (
        lambda lines: ["Dear diary,", "today I moved my arm."],
        r"line 1: .* has no column 'time' .*; allowed: time, NAME_x",
    ),
    "semicolons": (
        lambda lines: [line.replace(",", ";") for line in lines],
        "looks separated by semicolons, not commas",
    ),
    "no header": (lambda lines: lines[1:], r"line 1: there is no header, the first line holds numbers"),
    "no y column": (
        lambda lines: [line.rsplit(",", 2)[0] + "," + line.rsplit(",", 1)[1] for line in lines],
        "there is 'hand_x', 'hand_z', but no 'hand_y'. Add what is missing or remove the whole point",
    ),
    "two frames": (lambda lines: lines[:3], "has two frames, but a motion takes at least three"),
    "millimetres": (
        lambda lines: cells(lines, lambda x: 1000 * x),
        r"the arm measures 57\d\.\d m; allowed: 0.1 to 2 m. This looks like millimetres: read it with --units mm",
    ),
    "kilometres": (
        lambda lines: cells(lines, lambda x: x / 1000),
        r"the arm measures 0.00057\d+ m; allowed: 0.1 to 2 m",
    ),
    "time stands still": (
        lambda lines: replaced(lines, 5, "time", lines[4].split(",")[0]),
        "line 6, column 'time': the time does not increase, 0.06 s comes after 0.06 s",
    ),
    "no time": (lambda lines: replaced(lines, 5, "time", ""), "line 6, column 'time': the time is missing"),
    "a word": (lambda lines: replaced(lines, 5, "hand_x", "oops"), "line 6, column 'hand_x': 'oops' is not a number"),
    "infinity": (
        lambda lines: replaced(lines, 5, "hand_x", "inf"),
        "line 6, column 'hand_x': 'inf' is not a finite number",
    ),
    "point never seen": (lambda lines: blanked(lines, "forearm"), "point 'forearm' was not seen in any frame"),
    "point twice": (lambda lines: [lines[0].replace("forearm", "hand"), *lines[1:]], "'hand_x' stands twice"),
    "only the base": (
        lambda lines: [",".join(line.split(",")[:4]) for line in lines],
        "beside the base 'shoulder' there is no point to follow",
    ),
    "comma in a name": (
        lambda lines: [
            ",".join(f'"{name}"' for name in lines[0].replace("hand", "hand;left").split(",")).replace(";", ","),
            *lines[1:],
        ],
        "point 'hand,left' has a comma or a quotation mark in its name.*Rename it",
    ),
}


@pytest.mark.parametrize("name", RECORDINGS)
def test_recordings_that_cannot_be_used(refused, place, packaging, name):
    make, message = RECORDINGS[name]
    (place / "bad.csv").write_text("".join(f"{line}\n" for line in make(lines_of(packaging))))
    assert re.search(message, refused("search", "bad.csv", "--out", "run"))


def test_long_gap_is_named_with_the_ways_out(refused, place, packaging):
    lines = lines_of(packaging)
    for row in range(40, 60):
        lines = replaced(lines, row, "hand_x", "NaN")  # a lone NaN makes the whole position unseen
    (place / "gap.csv").write_text("\n".join(lines))
    sentence = refused("search", "gap.csv")
    assert "point 'hand' is not seen from 0.76 s to 1.18 s, longer than the 0.2 s that may be filled" in sentence
    assert "--to 0.76 or less, or --from 1.18 or more" in sentence
    assert "raise --max-gap" in sentence


def test_files_that_are_none(refused, place):
    assert "nothing.csv does not exist. Check the path" in refused("search", "nothing.csv")
    assert "is a folder" in refused("search", place)
    (place / "picture.csv").write_bytes(bytes(range(256)) * 40)
    assert "picture.csv is not a recording of a known format; allowed: C3D, " in refused("search", "picture.csv")
    assert "File name too long" in refused("search", "x" * 300)
    assert "no recording given. Write 'armdesign search RECORDING'" in refused("search")


def test_points_that_there_are_not_list_those_there_are(refused, packaging):
    there = "shoulder, upper_arm, forearm, hand"
    assert f"no point 'elbow'; allowed: {there}" in refused("search", packaging, "--points", "elbow,hand")
    assert f"no point 'hip' for the base; allowed: {there}" in refused("search", packaging, "--base", "hip")
    assert "'hand' is given twice" in refused("search", packaging, "--points", "hand,hand")
    assert "'shoulder' is the base and cannot be among the points" in refused(
        "search", packaging, "--points", "shoulder,hand"
    )


def test_orientations_that_there_are_not_list_those_there_are(refused, packaging, welding):
    sentence = refused("search", packaging, "--scenario", "welding")
    assert "an orientation is to be followed (w_0 > 0), but" in sentence
    assert "there is no orientation of 'hand'" in sentence
    assert "nor of any other point" in sentence
    assert "w_0 = 0" in sentence
    sentence = refused("search", welding, "--scenario", "welding", "--orientation", "forearm")
    assert "orientation of 'forearm'" in sentence
    assert "allowed: hand" in sentence


def test_task_out_of_reach_says_how_far_and_how_long_arms_may_be(refused, place, packaging):
    lines = lines_of(packaging)
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    table[:, 10:13] = table[:, 1:4] + [1.3, 0.0, 0.0]
    (place / "far.csv").write_text("\n".join([lines[0], *(",".join(map(repr, row)) for row in table.tolist())]))
    sentence = refused("search", "far.csv")
    assert "at the start the hand is 1.300 m from the base, and no arm may be longer than L_max = 1.2 m" in sentence
    assert "Raise design.length" in sentence


SETTINGS = {
    "no section": ("[robot]\ndof = 3\n", r"unknown section \[robot\]; allowed: task, design, fitness, solver, search"),
    "no such entry": ("[design]\ndegrees = 3\n", "unknown setting 'design.degrees'; allowed: dof, alpha, a, d, "),
    "outside of sections": ("dof = 3\n", "'?dof'?.*allowed: task, design, fitness, solver, search"),
    "value for a section": ("search = 3\n", r"'search' is a section, not a value. Write \[search\]"),
    "out of range": ("[design]\ndof = 11\n", "'design.dof' is 11; allowed: a whole number from 1 to 10"),
    "wrong type": ("[search]\nseed = 'zero'\n", "'search.seed' is 'zero'; allowed: a whole number from 0 to"),
    "not whole": ("[search]\nseed = 0.5\n", "'search.seed' is 0.5; allowed: a whole number"),
    "not finite": ("[fitness]\nlambda_f = inf\n", "'fitness.lambda_f' is inf; allowed: a number from 0 to"),
    "huge": (f"[design]\ndof = {10**400}\n", "'design.dof' is 10+; allowed: a whole number from 1 to 10"),
    "endless": (f"[search]\nseed = {'1' * 5000}\n", "settings.toml"),
    "word": ("[search]\nalgorithm = 'ga'\n", "'search.algorithm' is 'ga'; allowed: rapso, pso"),
    "bounds upside down": (
        "[design]\na = [0.5, 0.1]\n",
        r"\[0.5, 0.1\]: its bounds are upside down; .*Write \[0.1, 0.5\]",
    ),
    "single bounds upside down": ("[design]\nbounds = { d_1 = [0.5, 0.1] }\n", "'design.bounds.d_1' .*upside down"),
    "lengths upside down": ("[design]\nlength = [1.2, 0.6]\n", "'design.length' .*upside down"),
    "no length left": ("[design]\nlength = [1.0, 1.0]\n", "'design.length' is .*; allowed: L_min below L_max"),
    "lengths nobody has": (
        "[design]\nlength = [8, 9]\n",
        "make arms of 0.1 to 2.1 m, but design.length asks for 8 to 9 m",
    ),
    "no such bounds": (
        "[design]\nbounds = { a_9 = [0, 1] }\n",
        "'design.bounds.a_9'; allowed: alpha_0, a_0, d_0, .*base_yaw",
    ),
    "negative length": ("[design]\nbounds = { a_1 = [-0.1, 1] }\n", "'design.bounds.a_1' .*allowed: lengths from 0 up"),
    "nothing free": (
        "[design]\nalpha = [0, 0]\na = [0.2, 0.2]\nd = [0.1, 0.1]\n",
        "every entry of the design is fixed. Free one in .design., or use 'armdesign evaluate'",
    ),
    "joint limits for others": (
        "[design]\njoint_limits = [[-10, 10], [-20, 20]]\n",
        "'design.joint_limits' has 2 pairs for 3 joints; allowed: 1 or 3 pairs",
    ),
    "joint limits without 0": (
        "[design]\njoint_limits = [[1, 90]]\n",
        "'design.joint_limits' .*allowed: lower <= 0 <= upper",
    ),
    "weights for others": (
        "[fitness]\nweights = [0.5, 0.5]\n",
        r"2 weights \(0.5, 0.5\) for 3 points; allowed: 3 weights",
    ),
    "weights of another sum": (
        "[fitness]\nweights = [0.5, 0.5, 0.5]\n",
        "the weights w_0 = 0 and 0.5, 0.5, 0.5 sum to 1.5; allowed: a sum of 1",
    ),
    "hand without weight": ("[fitness]\nweights = [0.5, 0.5, 0.0]\n", "the hand, the last point, has no weight"),
    "cropped away": ("[task]\nstart = 5.0\n", r"start \(--from\) is 5.0 s: that leaves 0 frames"),
    "filter too fast": ("[task]\nlow_pass = 25.0\n", "low_pass is 25.0 Hz at 50 frames/s; allowed: .*25 Hz"),
    "not TOML": ("[design\ndof = 3\n", "not valid TOML: .*line 1.*--write-config"),
}


@pytest.mark.parametrize("name", SETTINGS)
def test_settings_that_are_not_allowed_are_named_with_what_is(refused, place, packaging, name):
    content, message = SETTINGS[name]
    (place / "settings.toml").write_text(content)
    assert re.search(message, refused("search", packaging, "--config", "settings.toml", "--out", "run"))


def test_settings_file_is_named_where_it_is_wrong(refused, place, packaging):
    (place / "mine.toml").write_text("[design]\ndof = 0\n")
    assert refused("search", packaging, "--config", "mine.toml").startswith("armdesign: mine.toml: ")


def test_settings_files_that_are_none(refused, place, packaging):
    assert "cannot read the settings nothing.toml" in refused("search", packaging, "--config", "nothing.toml")
    assert "cannot read the settings" in refused("search", packaging, "--config", place)
    (place / "binary.toml").write_bytes(b"\xff\xfe\x00")
    assert "binary.toml are not UTF-8 text" in refused("search", packaging, "--config", "binary.toml")


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        (("--dof", 0), "'design.dof' is 0; allowed: a whole number from 1 to 10"),
        (("--dof", 20), "'design.dof' is 20; allowed: a whole number from 1 to 10"),
        (("--particles", 0), "'search.particles' is 0; allowed: a whole number from 1 to"),
        (("--iterations", 10**30), "'search.iterations' is 10+; allowed: a whole number from 1 to"),
        (("--workers", 0), "--workers is 0; allowed: a whole number of at least 1"),
        (("--seed", -1), "'search.seed' is -1; allowed: a whole number from 0 to"),
        (("--algorithm", "cma"), "'search.algorithm' is 'cma'; allowed: rapso, pso"),
        (("--scenario", "gluing"), "'fitness.scenario' is 'gluing'; allowed: packaging, welding"),
        (("--weights", "1/6,1/3"), "2 weights .* for 3 points; allowed: 3 weights w_1..w_3, or 4 with"),
        (("--weights", "1/6,1/3,1/3"), "sum to 0.83.*; allowed: a sum of 1"),
        (
            ("--weights", "0.5,1/0,0.5"),
            "--weights is '0.5,1/0,0.5'; allowed: a list of 0 to 12 entries, each a number",
        ),
        (("--weights", "0.5,half,0.5"), "--weights is '0.5,half,0.5'; allowed: a list"),
        (("--weights", "0.5,1e400,0.5"), "'fitness.weights.1.' is inf; allowed: a number from 0 to 1"),
        (("--weights", "-0.5,1,0.5"), r"'fitness.weights\[0\]' is -0.5; allowed: a number from 0 to 1"),
    ],
)
def test_flags_that_are_not_allowed_are_named_with_what_is(refused, packaging, flags, message):
    assert re.search(message, refused("search", packaging, *flags))


def test_outputs_that_cannot_be_written(refused, place, packaging, small):
    (place / "file").write_text("precious")
    assert "the output file is a file. Name a folder" in refused("search", packaging, "--out", "file")
    sentence = refused("search", packaging, "--out", "file/run")
    assert "cannot write to the output folder file/run" in sentence
    assert "--out" in sentence
    assert "cannot write to the output folder" in refused("search", packaging, *small, "--out", "x" * 300)
    for command in (("search", "--dof", "auto"), ("sweep",), ("study", "designs")):
        assert "cannot write to the output folder" in refused(*command, packaging, "--out", "x" * 300)
    assert (place / "file").read_text() == "precious"


def test_search_that_finds_nothing_says_how_near_it_came(run, place, packaging):
    outcome = run("search", packaging, "--dof", 2, "--particles", 4, "--iterations", 1, "--out", "deep/run")
    assert outcome.exit_code == 4
    sentence = outcome.output.splitlines()[-1]
    assert re.search(r"within 1 mm of the hand's first point: the nearest stopped \d+\.\d mm short", sentence)
    assert "Use more joints" in sentence
    assert not (place / "deep" / "run" / "result.json").exists()


def test_file_name_that_is_not_utf8_is_refused_before_the_search(refused, place, packaging, small):
    (place / "bad\udcff.csv").write_bytes(packaging.read_bytes())
    assert "not UTF-8" in refused("search", "bad\udcff.csv", *small, "--out", "run")

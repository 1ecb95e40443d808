"""``armdesign check``: the verdict on a run, by its exit code, as JSON and in words."""

import json
import re

import pytest

import armdesign


@pytest.fixture(scope="module")
def thin(run, packaging, tmp_path_factory):
    """The run folder of a thin arm, found by a small search."""
    folder = tmp_path_factory.mktemp("thin") / "run"
    flags = (
        "--dof",
        "4",
        "--body",
        "thin",
        "--budget",
        "300",
        "--to",
        "0.8",
        "--workers",
        "1",
        "--quiet",
        "--no-report",
    )
    outcome = run("search", packaging, *flags, "--out", folder)
    assert outcome.exit_code == 0, outcome.output
    return folder


def verdict(run, *args):
    outcome = run("check", *args, "--json")
    return outcome.exit_code, json.loads(outcome.stdout)


def test_without_flags_it_is_the_verdict_of_the_run(run, thin):
    written = json.loads((thin / "result.json").read_text(encoding="utf-8"))["verdict"]
    code, judged = verdict(run, thin)
    assert (code, judged["feasible"], judged["tolerance_met"]) == (0, True, None)
    assert set(judged) == set(written)
    assert judged["hand_error"] == pytest.approx(written["hand_error"], abs=1e-9)
    assert judged["self_clearance"] is judged["obstacle_clearance"] is None
    assert verdict(run, thin / "result.json") == (code, judged)


def test_the_exit_code_says_whether_the_tolerance_is_met(run, thin):
    largest = verdict(run, thin)[1]["hand_error"]["max"]
    assert verdict(run, thin, "--tolerance", f"{1.01e3 * largest}mm")[0] == 0
    code, judged = verdict(run, thin, "--tolerance", f"{0.99e3 * largest}mm")
    assert (code, judged["feasible"], judged["tolerance_met"]) == (3, True, False)
    assert len(judged["reasons"]) == 1


def test_a_speed_that_is_not_kept_makes_it_infeasible(run, thin):
    peaks = [57.29578 * peak for peak in verdict(run, thin)[1]["peak_speed"]]
    assert verdict(run, thin, "--max-speed", ",".join(str(1.01 * peak) for peak in peaks))[0] == 0
    code, judged = verdict(run, thin, "--max-speed", f"{0.5 * max(peaks)}")
    assert (code, judged["feasible"]) == (3, False)
    assert judged["speed_fraction"] == pytest.approx(0.5, rel=1e-6)


def test_in_words_the_hand_comes_first_and_80_columns_hold_it(run, thin):
    outcome = run("check", thin, "--tolerance", "0.01mm", "--max-speed", "1")
    lines = outcome.output.splitlines()
    assert outcome.exit_code == 3
    assert lines[1].startswith("Hand error")
    assert "not feasible" in lines[2]
    assert re.search(r"0\.01 mm are allowed", " ".join(lines))
    assert max(map(len, lines)) <= 80


def test_from_python(thin):
    assert armdesign.check(thin).passed
    assert not armdesign.check(armdesign.read_result(thin), hand_tolerance=1e-6).passed
    with pytest.raises(armdesign.ArmDesignError) as refused:
        armdesign.check(thin, dof=5)
    assert refused.value.value == "dof"

"""The choice of the number of joints against its definition, and that a verdict cannot be overturned."""

import math

import numpy as np
import pytest

from armdesign.errors import SettingsError
from armdesign.experiments.auto_dof.dof_rule import (
    LOOK_AHEAD,
    DofResult,
    Rule,
    choose_dof,
    decide,
    decide_by_tolerance,
    explain,
    explain_by_tolerance,
    rule_of,
)

JOINTS = tuple(range(2, 8))


def cases(count=300):
    """Random path fitness by n, falling or not, some without a valid arm."""
    rng = np.random.default_rng(5)
    for _ in range(count):
        f = 0.02 * rng.random(len(JOINTS)) ** rng.choice([1, 3]) * rng.choice([0.3, 1.0]) ** np.arange(len(JOINTS))
        f[rng.random(len(JOINTS)) < 0.1] = math.inf
        yield dict(zip(JOINTS, f.tolist(), strict=True)), Rule(rng.choice([0.0, 0.04, 0.3]), rng.choice([0.0, 0.003]))


def searched(f, rule):
    """What is searched one after the other until the rule is decided, and the verdict."""
    seen = {}
    for n in JOINTS:
        seen[n] = f[n]
        verdict = decide(seen, JOINTS, rule)
        if verdict is not None:
            return seen, verdict
    return seen, None


def test_choice_is_the_papers_rule():
    for f, rule in cases():
        good = [
            n for n in JOINTS
            if f[n] < math.inf
            and all(f[n] <= max((1 + rule.within) * f[k], rule.enough) for k in JOINTS if k > n and f[k] < math.inf)
        ]  # fmt: skip
        assert choose_dof(f, rule) == min(good, default=None)


def test_paper_prefers_three_joints():
    assert choose_dof({3: 17.59, 4: 17.0, 5: 17.1, 6: 16.95}, Rule(0.04, 0.0)) == 3
    assert choose_dof({3: 17.59, 4: 16.5, 5: 16.6}, Rule(0.04, 0.0)) == 4


def test_verdict_of_enough_holds_whatever_comes_after():
    for f, rule in cases():
        seen, verdict = searched(f, rule)
        if verdict is not None and verdict.reason in ("enough", "all"):
            assert verdict.dof == choose_dof(f, rule)
            for later in (0.0, 1.0):
                assert choose_dof({n: seen.get(n, later) for n in JOINTS}, rule) == verdict.dof


def test_enough_is_the_first_that_is_enough_and_nothing_larger_is_searched():
    rule = Rule(0.04, 0.003)
    seen, verdict = searched(dict(zip(JOINTS, [math.inf, 0.0086, 0.0029, 0.0, 0.0, 0.0], strict=True)), rule)
    assert (verdict.dof, verdict.reason, max(seen)) == (4, "enough", 4)


def test_level_fitness_stops_after_the_look_ahead():
    seen, verdict = searched(dict.fromkeys(JOINTS, 0.02), Rule())
    assert (verdict.dof, verdict.reason, max(seen)) == (2, "level", 2 + LOOK_AHEAD)


def test_one_larger_arm_that_is_worse_does_not_stop():
    f = dict(zip(JOINTS, [0.02, 0.01, 0.011, 0.002, 0.0, 0.0], strict=True))
    seen, verdict = searched(f, Rule())
    assert (verdict.dof, max(seen)) == (5, 5)


def test_no_valid_arm_gives_no_verdict():
    assert searched(dict.fromkeys(JOINTS, math.inf), Rule())[1] is None


def test_choice_does_not_depend_on_the_unit():
    for f, rule in cases(100):
        scaled = {n: 1000.0 * value for n, value in f.items()}
        assert choose_dof(scaled, Rule(rule.within, 1000.0 * rule.enough)) == choose_dof(f, rule)


def test_more_tolerance_never_asks_for_more_joints():
    for f, rule in cases(100):
        tolerant = Rule(2 * rule.within + 0.01, 2 * rule.enough + 0.001)
        assert (choose_dof(f, tolerant) or 0) <= (choose_dof(f, rule) or 0)


def test_explanation_is_two_sentences_with_the_figures():
    for f, rule in cases():
        seen, verdict = searched(f, rule)
        if verdict is None:
            continue
        text = explain(verdict, seen, JOINTS, rule)
        assert text.count(". ") == 1
        assert text.endswith(".")
        assert f"{1e3 * seen[verdict.dof]:.2f} mm" in text or "less than 0.01 mm" in text
        assert "inf" not in text
        assert "nan" not in text


@pytest.mark.parametrize(("within", "enough"), [(-1.0, None), (None, -0.1), (math.nan, None), (None, math.inf)])
def test_figures_that_make_no_rule_are_refused(within, enough):
    with pytest.raises(SettingsError, match="allowed"):
        rule_of(within, enough)


GOOD = DofResult(4, passed=True, feasible=True, hand_max=4e-3)
FAR, TOUCHES = DofResult(4, feasible=True, hand_max=9e-3), DofResult(3, hand_max=2e-3)
NONE = DofResult(2)


def test_with_a_tolerance_the_fewest_joints_that_meet_it_are_taken_at_once():
    joints = (2, 3, 4, 5)
    assert decide_by_tolerance({2: NONE, 3: FAR}, joints) is None
    chosen = decide_by_tolerance({2: NONE, 3: FAR, 4: GOOD}, joints)
    assert (chosen.dof, chosen.reason) == (4, "tolerance")
    text = explain_by_tolerance(chosen, {2: NONE, 3: FAR, 4: GOOD}, "5 mm")
    assert text.startswith("4 joints suffice for the tolerance of 5 mm")
    assert "4.00 mm" in text
    assert "9.00 mm" in text


def test_where_no_arm_meets_it_the_nearest_feasible_one_is_kept_and_nothing_suffices():
    judged = {2: NONE, 3: TOUCHES, 4: FAR, 5: DofResult(5, feasible=True, hand_max=8e-3)}
    chosen = decide_by_tolerance(judged, (2, 3, 4, 5))
    assert (chosen.dof, chosen.reason) == (5, "missed")
    text = explain_by_tolerance(chosen, judged, "5 mm")
    assert text.startswith("No arm of 2, 3, 4 or 5 joints")
    assert "suffice" not in text
    assert "not feasible" in text
    assert decide_by_tolerance({2: NONE, 3: NONE}, (2, 3)) is None


def test_without_a_tolerance_nothing_suffices():
    for f, rule in cases():
        seen, verdict = searched(f, rule)
        assert verdict is None or "suffice" not in explain(verdict, seen, JOINTS, rule)

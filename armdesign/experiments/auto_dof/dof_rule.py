"""How many joints an arm needs: the paper's rule, and when it is decided.

The paper takes n = 3 for its first task because no larger n has a path fitness f that is better by more than 4 %. Taken
by itself the rule asks for ever more joints: f keeps halving with every joint until it is a fraction of a millimetre.
So a second figure goes with it, `enough`: the f below which a better one means nothing.

Where a tolerance is stated, it decides instead: the fewest joints whose arm is feasible and meets it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from armdesign.errors import SettingsError, counted

WITHIN, ENOUGH = 0.04, 0.005
LOOK_AHEAD = 2
"""How many larger arms have to bring nothing before larger ones still are taken to bring nothing either."""
JOINTS = (2, 7)

Reason = Literal["enough", "level", "all", "tolerance", "missed"]


@dataclass(frozen=True)
class Rule:
    """When an arm is as good as one with more joints.

    Attributes:
        within: By which part a path fitness may be larger and still count as equal; the paper's 4 %.
        enough: Path fitness below which a better one means nothing [m]. The f of eq. 5 has the 1/m outside the root:
            with three points 5 mm are a weighted distance of 15 mm (root mean square), about what a hand's path
            differs from one time to the next and markers on skin slide over the bone. Where an orientation is
            followed, f also holds w_0 times its error in rad: with w_0 = 0.2, 5 mm are 1.4 deg.
        tolerance: The stated tolerance in words, such as ``5 mm``, which then decides alone; empty where none is.
    """

    within: float = WITHIN
    enough: float = ENOUGH
    tolerance: str = ""

    def __post_init__(self) -> None:
        """Check the figures.

        Raises:
            SettingsError: One is negative or no number.
        """
        if not 0.0 <= self.within < math.inf:
            raise SettingsError(f"--within is {100 * self.within:g} %", value=self.within, allowed="0 % or more")
        if not 0.0 <= self.enough < math.inf:
            raise SettingsError(f"--enough is {1e3 * self.enough:g} mm", value=self.enough, allowed="0 mm or more")


@dataclass(frozen=True)
class Verdict:
    """The number of joints, and why no more searches are needed."""

    dof: int  # the chosen n
    # ``enough``: its f is at most `Rule.enough`; ``level``: LOOK_AHEAD larger arms bring nothing that counts;
    # ``all``: every n was searched; ``tolerance``: its arm is the first to be feasible and meet the stated
    # tolerance; ``missed``: none is, and this one comes nearest
    reason: Reason


@dataclass(frozen=True)
class DofResult:
    """The best arm of a number of joints."""

    dof: int  # number of joints n
    path_fitness: float = math.inf  # its f [m]; infinite where none is valid
    fitness: float = math.inf  # its r [m]
    area: float = math.inf  # its E [m]
    length: float = math.inf  # its L [m]
    hand_error: float = math.inf  # mean distance of the end-effector from the hand [m]
    evaluations: int = 0  # candidates of the search
    wall_time: float = 0.0  # duration of the search [s]
    begun_from: int = 0  # designs of its first generation that came from the smaller arm
    reason: str = ""  # why there is no arm
    # what the distance of the end-effector from the hand stays below in 95 % of the frames [m]
    hand_p95: float = math.inf
    hand_max: float = math.inf  # its largest [m]
    feasible: bool = False  # whether the arm is feasible, by its verdict
    passed: bool = False  # whether it meets the stated tolerance, too, where one is stated
    # its mean f on the demonstrations that the search did not see [m]; infinite where there are none
    held_out: float = math.inf

    @property
    def valid(self) -> bool:
        """Whether there is an arm."""
        return math.isfinite(self.path_fitness)


def rule_of(within: float | None, enough: float | None) -> Rule:
    """The rule of what a user gives, in % and mm; None for the default."""
    return Rule(WITHIN if within is None else within / 100.0, ENOUGH if enough is None else enough / 1e3)


def choose_dof(f: Mapping[int, float], rule: Rule) -> int | None:
    """The smallest n whose path fitness is as good as every larger n's best.

    Args:
        f: Best path fitness by number of joints [m]; infinite where no arm is valid.
        rule: What counts as as good.

    Returns:
        n, or None where there is no valid arm at all.
    """
    known = {n: value for n, value in sorted(f.items()) if math.isfinite(value)}
    for n, value in known.items():
        if all(value <= max((1.0 + rule.within) * other, rule.enough) for k, other in known.items() if k > n):
            return n
    return None


def decide(f: Mapping[int, float], joints: Sequence[int], rule: Rule) -> Verdict | None:
    """Whether the rule is decided by what has been searched, from few joints to many, and how.

    The path fitness need not fall with n: a search may miss the best arm of a larger n. So that larger arms brought
    nothing so far does not say that none would. What does decide:

    * f <= enough: f is never negative, so whatever a larger arm reaches, this one counts as as good. And the smaller
      ones are out: each is worse than a larger arm by more than the rule forgives. No further search can change it.
    * All n are searched.
    * LOOK_AHEAD larger arms, every one begun from the best smaller arm with a joint more, bring nothing that counts.
      This alone is a judgement: a still larger arm is taken to bring nothing, either.

    Args:
        f: Best path fitness by number of joints searched so far [m]; infinite where no arm is valid.
        joints: All n to choose from, ascending.
        rule: What counts as as good.

    Returns:
        The verdict; None as long as the next n has to be searched, or where there is no valid arm.
    """
    n = choose_dof(f, rule)
    if n is None:
        return None
    if f[n] <= rule.enough:
        return Verdict(n, "enough")
    if all(k in f for k in joints):
        return Verdict(n, "all")
    larger = [k for k, value in f.items() if k > n and math.isfinite(value)]
    return Verdict(n, "level") if len(larger) >= LOOK_AHEAD else None


def decide_by_tolerance(judged: Mapping[int, DofResult], joints: Sequence[int]) -> Verdict | None:
    """The fewest joints whose arm is feasible and meets the stated tolerance; where none does, the nearest to it.

    Args:
        judged: What the verdict says by number of joints searched so far, from few to many.
        joints: All n to choose from, ascending.

    Returns:
        The verdict; None as long as the next n has to be searched, or where there is no valid arm.
    """
    met = [n for n, each in judged.items() if each.passed]
    if met:
        return Verdict(min(met), "tolerance")
    known = [n for n, each in judged.items() if math.isfinite(each.hand_max)]
    if not known or any(n not in judged for n in joints):
        return None
    return Verdict(min(known, key=lambda n: (not judged[n].feasible, judged[n].hand_max)), "missed")


def explain_by_tolerance(verdict: Verdict, judged: Mapping[int, DofResult], tolerance: str) -> str:
    """Why this many joints, where a tolerance was stated."""
    n, others = verdict.dof, {k: found(each) for k, each in sorted(judged.items()) if k != verdict.dof}
    if verdict.reason == "tolerance":
        word = "suffices" if n == 1 else "suffice"
        fewer = f" Fewer do not: {told(others)}." if others else ""
        return f"{counted(n, 'joint')} {word} for the tolerance of {tolerance}: {found(judged[n])}.{fewer}"
    rest = f" The others: {told(others)}." if others else ""
    return (
        f"No arm of {listed(sorted(judged), 'or')} joints is feasible and within the tolerance of {tolerance}. The one "
        f"of {n} comes nearest and is kept: {found(judged[n])}.{rest}"
    )


def found(each: DofResult) -> str:
    """What was found with a number of joints: ``largest hand error 3.21 mm, not feasible``."""
    if not math.isfinite(each.hand_max):
        return "no valid arm"
    return f"largest hand error {millimetres(each.hand_max)}{'' if each.feasible else ', not feasible'}"


def told(others: Mapping[int, str]) -> str:
    """What was found by number of joints, one after the other."""
    return "; ".join(f"with {k} {words}" for k, words in others.items())


def explain(verdict: Verdict, f: Mapping[int, float], joints: Sequence[int], rule: Rule) -> str:
    """Why this many joints, in two sentences with the figures."""
    n = verdict.dof
    larger = {k: value for k, value in sorted(f.items()) if k > n and math.isfinite(value)}
    untried = [k for k in joints if k not in f]
    rest = f", so {listed(untried)} joints were not tried" if untried else ""
    head = (
        f"{counted(n, 'joint')} {'is chosen: its' if n == 1 else 'are chosen: their'} path fitness f of "
        f"{millimetres(f[n])}"
    )
    if verdict.reason == "enough":
        why = f" is at most {millimetres(rule.enough)} (--enough), below which a better one means nothing"
    elif larger:
        why = f" is within {100 * rule.within:g} % (--within) of what more joints reach, {figures(larger)}"
    else:
        head = f"{counted(n, 'joint')}, the most that were to be tried, reach a path fitness f of "
        why = f"{millimetres(f[n])}, more than the {millimetres(rule.enough)} that would be enough (--enough)"
    return f"{head}{why}{rest}. {about_fewer(n, f)}"


def about_fewer(n: int, f: Mapping[int, float]) -> str:
    """What fewer joints reach, as a sentence."""
    worse = {k: value for k, value in sorted(f.items()) if k < n and math.isfinite(value)}
    invalid = [k for k in sorted(f) if k < n and k not in worse]
    parts = [f"reach {figures(worse)}"] if worse else []
    if invalid:
        parts.append(f"no arm of {listed(invalid, 'or')} was found that comes to the start")
    return (
        f"Fewer {'; '.join(parts)}." if worse else f"{'; '.join(parts) or 'fewer were not to be tried'}.".capitalize()
    )


def figures(f: Mapping[int, float]) -> str:
    """Path fitness with numbers of joints: ``8.59 mm with 3 and 4.01 mm with 4``."""
    return listed([f"{millimetres(value)} with {n}" for n, value in f.items()])


def millimetres(value: float) -> str:
    """A length of [m] in mm; what is next to nothing as such."""
    return "less than 0.01 mm" if 0.0 < value < 5e-6 else f"{1e3 * value:.2f} mm"


def listed(items: Sequence[object], word: str = "and") -> str:
    """``2``, ``2 and 3``, ``2, 3 and 4``."""
    words = [str(item) for item in items]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} {word} {words[-1]}"

"""What the steps of a task say, and whether what was recorded can be a human arm at work.

A size that no arm has is an error; other doubts, about lengths, speeds and order, are warnings.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.cleaning.gaps import seconds
from armdesign.demonstration.recording import Recording, Step
from armdesign.errors import TaskError

_STILL = 0.01  # [m] a base that moves less counts as standing
_LONGEST_ARM, _SHORTEST_ARM = 2.0, 0.1  # [m]
JOINTS = ("shoulder", "elbow", "wrist", "hand")
# Upper arm 0.186, forearm 0.146 and hand 0.108 of the height (Drillis and Contini 1966), for people of 1.2 to 2.2 m,
# with room for markers beside the joints; the hand's point may be anywhere on it.
HUMAN = {
    ("shoulder", "elbow"): ("upper arm", 0.2, 0.42),
    ("elbow", "wrist"): ("forearm", 0.17, 0.34),
    ("wrist", "hand"): ("hand", 0.02, 0.22),
}
"""What lies between two joints, and the lengths it has in people, markers on the skin included [m]."""
LONGEST = 1.1  # [m] from the shoulder over all points; 0.44 of a height of 2.2 m is 0.97 m
FASTEST = 8.0  # [m/s] a hand at work stays far below
SLOWEST, BEYOND = 1e-3, 20.0  # [m/s] nine tenths of the time; beyond, times are in another unit
_STEADY, _LEAST_SPREAD = 0.05, 0.008  # standard deviation of a bone's length: share of it, and [m]
_SHORTER, _ALWAYS, _SAMPLE, _MOST = 0.05, 0.99, 400, 6
_MOVES, _MORE = 0.05, 1.5  # [m]; how much more a base may move than the hand
_PARTS = r"(?:sho|elb|wr[ai]|fin|upa|frm|fra|uarm|farm|arm|upper|fore|hand)"
_LEFT = re.compile(rf"left|(?<![a-z])l[._ ]?{_PARTS}\w*", re.IGNORECASE)
_RIGHT = re.compile(rf"right|(?<![a-z])r[._ ]?{_PARTS}\w*", re.IGNORECASE)


def recording_step(recording: Recording) -> Step:
    """How much was recorded."""
    rate = f"{recording.rate:.0f}" if recording.rate >= 10 else f"{recording.rate:.2g}"
    form = f" ({recording.about.format})" if recording.about.captured and recording.about.format else ""
    duration = float(recording.time[-1] - recording.time[0])
    sentence = f"The recording{form} has {recording.frames} frames over {seconds(duration)}, about {rate} frames/s."
    details = {"frames": recording.frames, "duration": duration, "rate": recording.rate}
    return Step("recording", sentence, {**details, "captured": recording.about.captured})


def points_step(base: str, points: Sequence[str], orientation: str | None, expressions: Mapping[str, str]) -> Step:
    """Which points of the recording are used, under the expressions behind their names."""
    shown = {name: expressions.get(name, name) for name in (base, *points)}
    turns = "no orientation" if orientation is None else f"orientation of {orientation}"
    path = ", ".join(shown[name] for name in points)
    sentence = f"Base {shown[base]}; points from there to the hand: {path}; {turns}."
    details = {"base": shown[base], "points": [shown[name] for name in points], "orientation": orientation}
    return Step("points", sentence, details)


def base_steps(path: Array, base: str, base_mode: str) -> tuple[Step, ...]:
    """A step where the base, path of shape (T, 3) [m], moves by more than 10 mm: what that means in this mode."""
    reach = float(np.linalg.norm(path - path.mean(axis=0), axis=1).max())
    if reach <= _STILL:
        return ()
    moved = f"The base {base} moves up to {1e3 * reach:.0f} mm from its mean; with base_mode '{base_mode}'"
    meaning = {
        "shoulder": "all paths are measured from the moving base, so that what stands still in the room moves by as "
        "much in the task. Use --base-mode fixed where places in the room matter.",
        "fixed": "the robot stands at that mean and the paths are those in the room, so that the arm's first part does "
        "not begin at the robot's base in every frame.",
    }
    return (Step("base", f"{moved} {meaning[base_mode]}", {"mode": base_mode, "moves": reach}),)


def task_step(recording: Recording, length: float | None = None) -> Step:
    """How long the task is, and the demonstrator's arm [m] where the base point is known."""
    duration = float(recording.time[-1] - recording.time[0])
    frames = f"The task has {recording.frames} frames over {seconds(duration)}"
    if length is None:
        return Step("task", f"{frames}.", {"frames": recording.frames, "duration": duration})
    sentence = f"{frames}; the demonstrator's arm measures {1e3 * length:.0f} mm."
    return Step("task", sentence, {"frames": recording.frames, "duration": duration, "arm_length": length})


def arm_length(P: Array) -> float:
    """Length of the demonstrator's arm: the median over the frames of |p_1| + |p_2 - p_1| + ... [m].

    Args:
        P: Shape (T, m, 3) [m], relative to the base in each frame; frames with NaN do not count.
    """
    links = np.linalg.norm(np.diff(P, axis=1, prepend=0.0), axis=2).sum(axis=1)
    seen = links[~np.isnan(links)]
    return float(np.median(seen)) if len(seen) else float("nan")


def check_arm_length(P: Array, source: str, scale: float = 1.0) -> float:
    """Turn away an arm that no human has, which mostly means another unit than metres.

    Args:
        P: Shape (T, m, 3) [m], relative to the base in each frame.
        source: Where it comes from, for the message.
        scale: The factor already applied, for the message.

    Returns:
        The arm's length [m]; NaN where it is never seen as a whole.
    """
    length = arm_length(P)
    if _SHORTEST_ARM <= length <= _LONGEST_ARM or np.isnan(length):
        return length
    scaled = "" if scale == 1.0 else f" after scaling by {scale:g}"
    message = f"{source}: from the base over the points the arm measures {length:.4g} m{scaled}"
    allowed = f"{_SHORTEST_ARM:g} to {_LONGEST_ARM:g} m"
    raise TaskError(message, value=length, allowed=allowed, fix=_length_fix(length, scale))


def _length_fix(length: float, scale: float) -> str:
    """What an arm of the wrong length seems to be, and what to do."""
    if scale < 1.0 and _SHORTEST_ARM <= length / scale <= _LONGEST_ARM:
        return "The recording looks like metres already: leave out --scale"
    for unit, word, least in (("mm", "millimetres", 100.0), ("cm", "centimetres", 10.0)):
        if length > least:
            return f"This looks like {word}: read it with --units {unit} (task.units in a settings file)"
    if length > _LONGEST_ARM:
        return "Choose --base and --points along one arm, from the shoulder to the hand, or set --units or --scale"
    return "Choose --base at the shoulder and --points along the arm up to the hand, or set --units or --scale"


def sanity_steps(recording: Recording, base: str, points: Sequence[str]) -> tuple[Step, ...]:
    """Lengths, path and speed of the arm, and a warning for everything that a human arm does not do.

    Args:
        recording: Cleaned, in metres.
        base: Name of the base.
        points: Names of the points from there to the hand.
    """
    chain = [base, *points]
    places = np.stack([recording.points[name] for name in chain])  # (m + 1, T, 3) [m]
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=2)  # (m, T) [m]
    speed = np.linalg.norm(np.diff(places, axis=1), axis=2) / np.diff(recording.time)  # (m + 1, T - 1) [m/s]
    return (
        _segments_step(chain, lengths),
        _motion_step(chain[-1], recording.time, speed[-1]),
        *_length_warnings(recording.time, chain, lengths),
        *_speed_warnings(recording.time, chain, speed),
        *_time_warnings(chain[-1], speed[-1]),
        *_order_warnings(recording.time, chain, places),
        *_base_warnings(chain, places),
    )


def side_steps(expressions: Iterable[str], mirrored: bool) -> tuple[Step, ...]:
    """What the names of the points say about left and right, where it goes against what is done."""
    text = ", ".join(expressions)
    left, right = _LEFT.search(text), _RIGHT.search(text)
    if left and not right and not mirrored:
        sentence = f"The names ({left.group()}) tell of a left arm, and it stays one; --mirror makes it a right one."
        return (Step("side", sentence, {"side": "left"}),)
    if right and not left and mirrored:
        return (warning(f"the names ({right.group()}) tell of a right arm, and --mirror made it a left one", {}),)
    return ()


def warning(what: str, details: dict[str, object]) -> Step:
    """A doubt in words, without the full stop, and the figures behind it."""
    return Step("warning", f"Warning: {what}.", details)


def _segments_step(chain: Sequence[str], lengths: Array) -> Step:
    """Mean and standard deviation of every length from point to point."""
    mean, sd = lengths.mean(axis=1), lengths.std(axis=1)
    pairs = list(itertools.pairwise(chain))
    shown = [f"{a} to {b} {1e3 * m:.0f} +- {_spread(s)} mm" for (a, b), m, s in zip(pairs, mean, sd, strict=True)]
    found = zip(pairs, mean, sd, strict=True)
    details = [{"from": a, "to": b, "mean": float(m), "sd": float(s)} for (a, b), m, s in found]
    return Step("segments", f"Distances: {', '.join(shown)}.", {"segments": details})


def _motion_step(hand: str, time: Array, speed: Array) -> Step:
    """How far the hand travels, and when it is fastest."""
    length = float((speed * np.diff(time)).sum())
    k = int(np.argmax(speed))
    sentence = f"{hand} travels {length:.3g} m in the room, at most at {speed[k]:.3g} m/s, at {seconds(time[k])}."
    return Step("motion", sentence, {"path_length": length, "top_speed": float(speed[k]), "time": float(time[k])})


def _length_warnings(time: Array, chain: Sequence[str], lengths: Array) -> list[Step]:
    """Segments of no human length, and bones that change theirs."""
    steps = []
    for (a, b), values in zip(itertools.pairwise(chain), lengths, strict=True):
        human = HUMAN.get((_joint(a), _joint(b)))
        mean, sd = float(values.mean()), float(values.std())
        if human is None:
            continue
        what, least, most = human
        if not least <= mean <= most:
            text = f"'{a}' to '{b}', the {what}, measures {1e3 * mean:.0f} mm; people's measure"
            steps.append(warning(f"{text} {1e3 * least:.0f} to {1e3 * most:.0f} mm", {"of": [a, b], "mean": mean}))
        if sd > max(_STEADY * mean, _LEAST_SPREAD):
            k = int(np.argmax(np.abs(values - np.median(values))))
            lengths_are = f"{1e3 * mean:.0f} +- {_spread(sd)} mm and {1e3 * values[k]:.0f} mm at {seconds(time[k])}"
            text = f"the distance from '{a}' to '{b}' is not steady, {lengths_are}: one of the two slides on the arm"
            details = {"of": [a, b], "mean": mean, "sd": sd, "worst": float(values[k]), "time": float(time[k])}
            steps.append(warning(text, details))
    total = float(np.median(lengths.sum(axis=0)))
    if total > LONGEST:
        text = f"from '{chain[0]}' over all points the arm measures {1e3 * total:.0f} mm, longer than people's"
        steps.append(warning(text, {"length": total}))
    return steps


def _speed_warnings(time: Array, chain: Sequence[str], speed: Array) -> list[Step]:
    """Points that are faster than a hand at work."""
    steps = []
    for name, values in zip(chain, speed, strict=True):
        k = int(np.argmax(values))
        if values[k] > FASTEST:
            text = f"'{name}' moves at {values[k]:.3g} m/s at {seconds(time[k])}, faster than a hand at work"
            details = {"of": name, "speed": float(values[k]), "time": float(time[k])}
            steps.append(warning(f"{text}; it may jump there", details))
    return steps


def _time_warnings(hand: str, speed: Array) -> list[Step]:
    """A warning where the hand is so slow or so fast all the time that the times are in another unit."""
    usual = float(np.quantile(speed, 0.9))
    if usual == 0 or SLOWEST <= usual <= BEYOND:
        return []
    slow = usual < SLOWEST
    moves = f"'{hand}' moves at {usual:.2g} m/s and less" if slow else f"'{hand}' mostly moves at {usual:.3g} m/s"
    units = "as if the times were in ms, us or ns: say --time-unit ms, us or ns (a factor of 1e-3, 1e-6, 1e-9)"
    text = units if slow else "as no hand does: check the times (--time-unit, --rate) and the unit of length (--units)"
    return [warning(f"{moves}, {text}", {"of": hand, "speed": usual})]


def _order_warnings(time: Array, chain: Sequence[str], places: Array) -> list[Step]:
    """A warning where the points in another order make a shorter and steadier arm all the time."""
    if not 2 < len(chain) <= _MOST:
        return []
    frames = np.unique(np.linspace(0, len(time) - 1, _SAMPLE).astype(int))
    distance = np.linalg.norm(places[:, None, frames] - places[None, :, frames], axis=3)  # (m + 1, m + 1, F)
    given = tuple(range(1, len(chain)))
    links = _links(distance, given)
    best, arm = given, links.sum(axis=0)
    for order in itertools.permutations(given):
        other = _links(distance, order)
        length = other.sum(axis=0)
        steadier = other.std(axis=1).sum() < links.std(axis=1).sum()
        always = (length < links.sum(axis=0)).mean() >= _ALWAYS
        if steadier and always and np.median(length) < (1.0 - _SHORTER) * np.median(arm):
            best, arm = order, length
    if best == given:
        return []
    names = ", ".join(chain[k] for k in best)
    lengths = f"{1e3 * np.median(arm):.0f} instead of {1e3 * np.median(links.sum(axis=0)):.0f} mm"
    text = (
        f"'{next(chain[a] for a, b in zip(given, best, strict=True) if a != b)}' may be out of place: in the order "
        f"{names} the points make a shorter and steadier arm all the time from {seconds(time[0])} on, {lengths}"
    )
    return [warning(f"{text}; give them from the shoulder to the hand", {"order": [chain[k] for k in best]})]


def _links(distance: Array, order: Sequence[int]) -> Array:
    """Distances from the base over the points in an order, shape (m, F) [m]."""
    return np.stack([distance[a, b] for a, b in itertools.pairwise((0, *order))])


def _base_warnings(chain: Sequence[str], places: Array) -> list[Step]:
    """A warning where the base moves much more than the hand, as if the arm were given from the hand on."""
    base, hand = (float(np.sqrt(place.var(axis=0).sum())) for place in (places[0], places[-1]))
    if base < _MOVES or base < _MORE * hand:
        return []
    moves = f"{1e3 * base:.0f} and {1e3 * hand:.0f} mm about their means"
    text = f"the base '{chain[0]}' moves more than the last point '{chain[-1]}' ({moves})"
    return [warning(f"{text}: is the arm given from the shoulder to the hand?", {})]


def _spread(sd: float) -> str:
    """A standard deviation in millimetres, small ones to a tenth."""
    return f"{1e3 * sd:.0f}" if sd >= 1e-3 else f"{round(1e3 * sd, 1):g}"


def _joint(name: str) -> str:
    """The joint a point is called after; empty if none."""
    found = [joint for joint in JOINTS if joint in name.lower()]
    return found[0] if len(found) == 1 else ""

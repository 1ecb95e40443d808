"""Shoulder, elbow, wrist and hand by the names that laboratories give them.

Each naming scheme says by which names a part of the arm goes, ``{s}`` being the side. A part may be the mean of
several points, such as the elbow between its two epicondyles.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.points.expressions import quoted
from armdesign.demonstration.recording import median_seen

ROLES = ("shoulder", "elbow", "wrist", "hand")
_NEEDED = ROLES[:3]
_ON_WRIST = 0.05  # of the upper arm; a hand nearer to the wrist is no point of its own
_RIGID = 3  # markers that make a body

Parts = Mapping[str, tuple[str, ...]]


@dataclass(frozen=True)
class Scheme:
    """How one community names the points of an arm; names are compared in small letters without blanks and marks."""

    name: str
    # side to the letters or words for it; both before and behind a name if behind
    sides: Mapping[str, str]
    # part of the arm to the ways of naming it, the best first, each of one or more points
    roles: Mapping[str, tuple[tuple[str, ...], ...]]
    behind: bool = False  # whether the side may also follow the name
    whole: bool = False  # whether the hand is needed, too
    oriented: str = "hand"  # the part whose orientation is the hand's
    names: Mapping[str, str] | None = None  # name of each part in the task; the parts' own where not given


_LETTERS = {"right": "r", "left": "l"}
_WORDS = {"right": "right", "left": "left"}


def _ways(shoulder: str, elbow: str, wrist: str, hand: str) -> Mapping[str, tuple[tuple[str, ...], ...]]:
    """The ways of naming each part of the arm, blanks between them; one of several points has a + between these."""
    texts = zip(ROLES, (shoulder, elbow, wrist, hand), strict=True)
    return {role: tuple(tuple(way.split("+")) for way in text.split()) for role, text in texts}


_BONES = _ways("{s}uarm", "{s}farm", "{s}hand", "{s}middle1 {s}index1")
_JOINTS = _ways(
    "{s}arm {s}upperarm {s}uparm {s}shldr",
    "{s}forearm {s}lowerarm {s}lowarm",
    "{s}hand",
    "{s}handmiddle1 {s}fingerbase {s}handindex1 {s}fingers {i}fingers",
)
# as in upperarm_r, Unreal's and Unity's way
_ENGINE = _ways("upperarm", "lowerarm forearm", "hand", "middle01 middle1 index01 index1")
_THEIA = _ways("{s}uarm", "{s}larm", "{s}hand", "")
_PLUG_IN = _ways("{s}sho", "{s}elb+{s}elbm {s}elb+{s}mel {s}elb", "{s}wra+{s}wrb {s}wri {s}wra {s}wrb", "{s}fin")
_CENTRES = _ways("{s}sjc", "{s}ejc", "{s}wjc", "{s}fin")
_ISB = _ways(
    "gh acrotip acromion acromium acro acr ac saj",
    "epicl+epicm el+em lel+mel elbl+elbm lelb+melb hle+hme lateralepicondyle+medialepicondyle "
    "epicl lateralepicondyle hle",
    "stylr+stylu faradius+faulna rs+us rsp+usp wrr+wru radialstyloid+ulnarstyloid styloidradius+styloidulna "
    "radiusstyloid+ulnastyloid stylr stylu radialstyloid ulnarstyloid rsp usp",
    "index+lastc+medh+lath mcp2+mcp3+mcp5 mcp2+mcp5 mc2+mc5 mh2+mh5 mcp3 mc3 mh3",
)
_LANDMARKS = _ways("{s}shoulder", "{s}elbow", "{s}wrist", "{s}index+{s}pinky")
_BANDS = _ways("shoulder", "upperarm", "forearm", "hand")
_ANY_SIDE = _LETTERS | {"": ""}

SCHEMES = (
    Scheme("Motive skeleton", _LETTERS, _BONES, oriented="wrist"),
    Scheme("BVH skeleton", _WORDS, _JOINTS, oriented="wrist"),
    Scheme("skeleton", _LETTERS, _JOINTS, oriented="wrist"),
    Scheme("game engine skeleton", _LETTERS, _ENGINE, behind=True, oriented="wrist"),
    Scheme("Theia segments", _LETTERS, _THEIA, oriented="wrist"),
    Scheme("Plug-in Gait joint centres", _LETTERS, _CENTRES),
    Scheme("Plug-in Gait", _LETTERS, _PLUG_IN),
    Scheme("MediaPipe landmarks", _WORDS, _LANDMARKS, whole=True),
    Scheme("ISB markers", _ANY_SIDE, _ISB, behind=True),
    Scheme(
        "bands on shoulder, upper arm, forearm and hand",
        {"": ""},
        _BANDS,
        names={"shoulder": "Shoulder", "elbow": "UpperArm", "wrist": "Forearm", "hand": "Hand"},
    ),
)
"""Asked in this order."""

_SIDE_WORDS = {"right": "right", "r": "right", "rt": "right", "left": "left", "l": "left", "lt": "left"}
_ROLE_WORDS = {
    "shoulder": {"shoulder", "shldr", "sho", "acromion", "acromium", "acr"},
    "elbow": {"elbow", "elb"},
    "wrist": {"wrist", "wri"},
    "hand": {"hand", "palm"},
}
_PLAIN_WORDS = {"joint", "jnt", "center", "centre", "jc", "marker", "mid"}
_QUALIFIERS = {
    "lat", "lateral", "med", "medial", "rad", "radial", "radius", "uln", "ulnar", "ulna", "in", "out", "inner",
    "outer", "inside", "outside", "front", "back", "ant", "post", "anterior", "posterior", "a", "b", "1", "2", "3", "4",
}  # fmt: skip
_MARKS = re.compile(r"[_ ]")
_SUFFIX = re.compile(r"(?:joint|jnt|bend)$")  # of ARKit, DeepMotion and Daz, in small letters
_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")


@dataclass(frozen=True)
class Arm:
    """An arm found by the names of a recording's points."""

    scheme: str
    subject: str  # the subject prefix; empty where there is none
    side: str  # right, left, or empty where the names do not say
    roles: Parts  # shoulder, elbow, wrist and perhaps hand to the points whose mean they are
    oriented: str = "hand"  # the part whose orientation would be the hand's
    names: Mapping[str, str] | None = None

    @property
    def base(self) -> str:
        """The shoulder as an expression."""
        return self._expression("shoulder")

    @property
    def points(self) -> tuple[str, ...]:
        """Elbow, wrist and, if there is one, hand as expressions."""
        return tuple(self._expression(role) for role in ROLES[1:] if role in self.roles)

    def orientation(self, oriented: Iterable[str]) -> str | None:
        """Name of the point with the hand's orientation; None where there is none.

        Args:
            oriented: The points of the recording with an orientation.
        """
        turns = set(oriented)
        for role in ("hand", "wrist") if self.oriented == "wrist" else ("hand",):
            places = self.roles.get(role, ())
            if len(places) >= _RIGID or (len(places) == 1 and places[0] in turns):
                return self._name(role)
        return None

    def __str__(self) -> str:
        who = f" of '{self.subject}'" if self.subject else ""
        return f"the {self.side + ' ' if self.side else ''}arm{who} ({self.scheme})"

    def _name(self, role: str) -> str:
        return (self.names or {}).get(role, role)

    def _expression(self, role: str) -> str:
        places = self.roles[role]
        name = self._name(role)
        return quoted(name) if places == (name,) else f"{name}={'+'.join(quoted(place) for place in places)}"


@dataclass(frozen=True)
class Guess:
    """What was guessed."""

    arm: Arm | None  # None where there is none, or where several subjects have one
    arms: tuple[Arm, ...]  # all that come into question
    sentence: str  # what was guessed, in words


def guess_arm(points: Mapping[str, Array], *, side: str = "right", base: str | None = None) -> Guess:
    """The arm to follow: of one subject, the right one if both are there.

    Args:
        points: Name to positions, shape (T, 3); those never seen are left out.
        side: The side to prefer, ``right`` or ``left``.
        base: A point that has to be (part of) the shoulder; None for any.
    """
    arms = find_arms({name: values for name, values in points.items() if not np.isnan(values).all()})
    if base is not None:
        arms = [arm for arm in arms if base in arm.roles["shoulder"]] or arms
    if not arms:
        return Guess(None, (), "No arm is known by the names of the points")
    subjects = list(dict.fromkeys(arm.subject for arm in arms))
    if len(subjects) > 1:
        listed = ", ".join(f"'{subject}'" for subject in subjects)
        return Guess(None, tuple(arms), f"Several subjects have an arm: {listed}")
    order = [side, "", "left" if side == "right" else "right"]
    arm = min(arms, key=lambda arm: order.index(arm.side))
    other = [str(each) for each in arms if each is not arm]
    also = f" There is also {', and '.join(other)}." if other else ""
    chosen = f"base {arm.base}, points {', '.join(arm.points)}"
    sentence = f"By the names of the points, {arm} was chosen: {chosen}.{also}"
    return Guess(arm, tuple(arms), f"{sentence} Use --base and --points to choose otherwise.")


def find_arms(names: Iterable[str] | Mapping[str, Array]) -> list[Arm]:
    """All arms found by the names of their points, one for each subject and side, by the first scheme that fits.

    Args:
        names: The names; with positions, of shape (T, 3), a hand that lies on the wrist is passed over.
    """
    places = names if isinstance(names, Mapping) else {}
    found: dict[tuple[str, str], Arm] = {}
    names = list(names)
    for subject, local in _subjects(names).items():
        for scheme in SCHEMES:
            for side, letter in scheme.sides.items():
                roles = _roles(scheme, letter, local, places)
                if roles is not None:
                    arm = Arm(scheme.name, subject, side, roles, scheme.oriented, scheme.names)
                    found.setdefault((subject, side), arm)
    for arm in _by_words(names, places):
        found.setdefault((arm.subject, arm.side), arm)
    sided = {subject for subject, side in found if side}
    return [arm for (subject, side), arm in found.items() if side or subject not in sided]


def _subjects(names: Iterable[str]) -> dict[str, dict[str, str]]:
    """Subject to its points: their names in the form that is compared, to those in the recording.

    What is before the last colon is the subject; if there is no colon, before an underscore or blank it may be one.
    """
    subjects: dict[str, dict[str, str]] = {}
    for name in names:
        subject, _, local = name.rpartition(":")
        subjects.setdefault(subject, {}).setdefault(_plain(local), name)
        subjects[subject].setdefault(_SUFFIX.sub("", _plain(local)), name)
        for mark in list(_MARKS.finditer(local))[:2] if not subject else ():
            first, rest = local[: mark.start()], local[mark.end() :]
            if not any(word.lower() in _SIDE_WORDS for word in _MARKS.split(first)):
                subjects.setdefault(first, {}).setdefault(_plain(rest), name)
    return subjects


def _plain(name: str) -> str:
    """A name in small letters without blanks, points and lines."""
    return re.sub(r"[ ._\-]", "", name.lower())


def _roles(scheme: Scheme, letter: str, local: Mapping[str, str], positions: Mapping[str, Array]) -> Parts | None:
    """The parts of an arm in a scheme; None unless shoulder, elbow and wrist are there."""
    roles: dict[str, tuple[str, ...]] = {}
    for role, ways in scheme.roles.items():
        for way in ways:
            forms = [_forms(pattern, letter, scheme) for pattern in way]
            places = [next((local[form] for form in each if form in local), None) for each in forms]
            known = tuple(place for place in places if place is not None)
            if len(known) == len(way) and not (role == "hand" and _lies_on_wrist(known, roles, positions)):
                roles[role] = known
                break
    needed = ROLES if scheme.names or scheme.whole else _NEEDED
    return roles if all(role in roles for role in needed) else None


def _lies_on_wrist(hand: tuple[str, ...], roles: Parts, positions: Mapping[str, Array]) -> bool:
    """Whether a hand is at the wrist's place, so that following both would count one place twice."""
    parts = [roles.get(role, ()) for role in _NEEDED]
    if not all(parts) or not all(name in positions for names in (*parts, hand) for name in names):
        return False
    shoulder, elbow, wrist, tip = (np.mean([positions[name] for name in names], axis=0) for names in (*parts, hand))
    upper, beyond = (median_seen(np.linalg.norm(a - b, axis=1)) for a, b in ((elbow, shoulder), (tip, wrist)))
    return bool(beyond < _ON_WRIST * upper)


def _forms(pattern: str, letter: str, scheme: Scheme) -> list[str]:
    """The names that a pattern means on one side."""
    if "{s}" in pattern:
        return [pattern.format(s=letter)]
    if "{i}" in pattern:
        return [pattern.format(i=letter[:1])]
    if not scheme.behind or not letter:
        return [letter + pattern]
    word = {"r": "right", "l": "left"}.get(letter, letter)
    return [letter + pattern, pattern + letter, word + pattern, pattern + word]


def _by_words(names: Iterable[str], positions: Mapping[str, Array]) -> list[Arm]:
    """Arms by the words shoulder, elbow, wrist and hand, whatever the spelling of the side."""
    found: dict[tuple[str, str], dict[str, list[tuple[bool, str]]]] = {}
    for name in names:
        subject, _, local = name.rpartition(":")
        read = _read_words(local)
        if read is not None:
            role, side, plain = read
            found.setdefault((subject, side), {}).setdefault(role, []).append((plain, name))
    arms = []
    for (subject, side), places in found.items():
        roles = {role: _best(places[role]) for role in ROLES if role in places}
        if "hand" in roles and _lies_on_wrist(roles["hand"], roles, positions):
            del roles["hand"]
        if all(role in roles for role in ROLES[:2]) and len(roles) > 2:  # a suit may know the hand, and no wrist
            arms.append(Arm("by name", subject, side, roles))
    return arms


def _read_words(local: str) -> tuple[str, str, bool] | None:
    """Part, side and whether nothing else is in a name, such as ``R.Elbow.Lat``; None if it is no part of an arm."""
    words = [part for word in _WORD.findall(local) for part in _parted(word.lower())]
    roles = [role for role, known in _ROLE_WORDS.items() for word in words if word in known]
    sides = {_SIDE_WORDS[word] for word in words if word in _SIDE_WORDS}
    every = set().union(*_ROLE_WORDS.values())
    others = [word for word in words if word not in _SIDE_WORDS and word not in every and word not in _PLAIN_WORDS]
    if len(roles) != 1 or len(sides) > 1 or any(word not in _QUALIFIERS for word in others):
        return None
    return roles[0], next(iter(sides), ""), not others


def _parted(word: str) -> tuple[str, ...]:
    """A word, the side in front of it apart, as in ``rshoulder`` and ``leftelbow``."""
    every = set().union(*_ROLE_WORDS.values())
    sides = [side for side in ("right", "left", "r", "l") if word.startswith(side) and word[len(side) :] in every]
    return (sides[0], word[len(sides[0]) :]) if sides and word not in every else (word,)


def _best(places: list[tuple[bool, str]]) -> tuple[str, ...]:
    """The point that is named plainly, else all of them."""
    plain = [name for is_plain, name in places if is_plain]
    return (plain[0],) if plain else tuple(name for _, name in places)

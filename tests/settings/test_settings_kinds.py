"""What each kind of parameter takes, refuses and says of itself."""

import math
import tomllib

import numpy as np
import pytest

from armdesign.errors import SettingsError
from armdesign.settings.kinds import Choice, Interval, Number, Several, Switch, Table, Text, toml_string, toml_value

ANY = (None, True, "x", 1, 1.5, [1.0, 2.0], {"a": 1}, math.nan, math.inf, -math.inf, [], [1, "x"], b"x", 10**400)

ACCEPTED = [
    (Number(0.0, 1.0), 0, 0.0),
    (Number(0.0, 1.0), 1, 1.0),
    (Number(), -1e300, -1e300),
    (Number(0.0, 1.0, above=True), 1e-300, 1e-300),
    (Number(1, 10, integer=True), 3.0, 3),
    (Number(0, 2**63 - 1, integer=True), 2**63 - 1, 2**63 - 1),
    (Number(0.0, 1.0), np.float64(0.5), 0.5),
    (Choice(("a", "b")), "b", "b"),
    (Switch(), False, False),
    (Text(), "ü \" ' \\", "ü \" ' \\"),
    (Several(Number(), 0, 2), [], ()),
    (Several(Number(), 0, 2), [1, 2], (1.0, 2.0)),
    (Several(Several(Number(), 1, 1), 1, 1), [[3]], ((3.0,),)),
    (Interval(Number(0.0, 5.0)), [1, 1], (1.0, 1.0)),
    (Interval(Number(0.0, 5.0)), (0, 5), (0.0, 5.0)),
    (Table(Number()), {"a": 1}, {"a": 1.0}),
    (Table(Interval(Number())), {"a": [1, 2]}, {"a": (1.0, 2.0)}),
]


@pytest.mark.parametrize(("kind", "value", "normal"), ACCEPTED)
def test_value_comes_back_in_its_normal_form(kind, value, normal):
    checked = kind.check("x.y", value)
    assert checked == normal
    assert type(checked) is type(normal)
    assert kind.check("x.y", checked) == checked  # the normal form is its own


REFUSED = [
    (Number(0.0, 1.0), (-1e-9, 1.0 + 1e-9, True, False, "0.5", None, [0.5], math.nan, math.inf, 10**400)),
    (Number(0.0, 1.0, above=True), (0, 0.0, -0.0)),
    (Number(1, 10, integer=True), (0, 11, 2.5, "3", math.nan)),
    (Choice(("a", "b")), ("c", "", None, 1, ["a"], "A")),
    (Switch(), (0, 1, "true", None)),
    (Text(), ("", 3, None, ["x"], "\udcff")),
    (Several(Number(), 1, 2), ([], [1, 2, 3], 1.0, "ab", None, {"a": 1}, [True], [[1]])),
    (Interval(Number(0.0, 5.0)), ([1], [1, 2, 3], [2, 1], [0, 6], ["a", "b"], 1.0, "ab", None)),
    (Table(Number()), ([1], 1.0, None, {"a": "x"})),
]


@pytest.mark.parametrize(("kind", "values"), REFUSED)
def test_other_values_are_refused_by_name(kind, values):
    for value in values:
        with pytest.raises(SettingsError, match=r"'x\.y"):
            kind.check("x.y", value)


@pytest.mark.parametrize("kind", [kind for kind, _ in REFUSED])
def test_whatever_comes_only_settings_errors_go(kind):
    for value in ANY:
        try:
            kind.check("x.y", value)
        except SettingsError as error:
            assert "x.y" in str(error)  # noqa: PT017
            assert error.allowed or error.fix  # noqa: PT017


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        (Number(0.0, 10.0, "m"), "a number from 0 to 10 m"),
        (Number(0.0, 1e-3, above=True), "a number above 0 up to 0.001"),
        (Number(1, 10**6, integer=True), "a whole number from 1 to 1000000"),
        (Number(0, 2**63 - 1, integer=True), "a whole number from 0 to 9223372036854775807"),
        (Number(0.0), "a number of at least 0"),
        (Number(0.0, above=True, unit="Hz"), "a number above 0 Hz"),
        (Number(), "a number"),
        (Number(unit="s"), "a number [s]"),
        (Choice(("a", "b")), "a, b"),
        (Switch(), "true, false"),
        (Text("a path"), "a path"),
        (Several(Number(), 1, 3), "a list of 1 to 3 entries, each a number"),
        (Several(Number(), 3, 3), "a list of 3 entries, each a number"),
        (Interval(Number(0.0, 1.0)), "a pair [lower, upper], lower <= upper, each a number from 0 to 1"),
        (Table(Switch()), "a table of entries, each true, false"),
    ],
)
def test_every_kind_says_what_it_takes(kind, words):
    assert kind.describe() == words
    assert kind.refuse("x.y", 0).allowed == words


def test_interval_upside_down_shows_the_right_way():
    with pytest.raises(SettingsError, match=r"'x\.y' is \[2\.0, 1\.0\]: its bounds are upside down; .*Write \[1, 2\]"):
        Interval(Number()).check("x.y", [2, 1])


def test_wrong_entry_of_a_list_is_named_by_its_place():
    with pytest.raises(SettingsError, match=r"'x\.y\[1\]' is 'b'; allowed: a number"):
        Several(Number()).check("x.y", [1, "b"])
    with pytest.raises(SettingsError, match=r"'x\.y\.b' is 'c'"):
        Table(Number()).check("x.y", {"a": 1, "b": "c"})


TEXTS = (
    "plain",
    "",
    'quo"te',
    "apo'strophe",
    "back\\slash",
    "C:\\new\\table",
    "line\nbreak\ttab\r",
    "\x00\x1f\x7f",
    "ü 手 🦾",
    "#[x]=",
    "\\u0041",
)


@pytest.mark.parametrize("text", TEXTS)
def test_any_text_survives_toml(text):
    assert tomllib.loads(f"x = {toml_string(text)}")["x"] == text
    assert "\n" not in toml_string(text)


@pytest.mark.parametrize(
    "value",
    [
        0.1,
        1 / 3,
        5e-324,
        1.7976931348623157e308,
        -0.0,
        2**63 - 1,
        True,
        "x",
        [],
        [1, [2.5, "y"]],
        {},
        {'a "b"': [1, 2], "c": {"d": 0.1}},
    ],
)
def test_any_value_survives_toml(value):
    read = tomllib.loads(f"x = {toml_value(value)}")["x"]
    assert read == value
    assert repr(read) == repr(value)

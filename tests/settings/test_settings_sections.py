"""Settings: the published defaults, changes, and files of them."""

import dataclasses

import pytest

from armdesign.errors import SettingsError
from armdesign.fitness.problem import SCENARIOS
from armdesign.settings import Design, Fitness, Search, Settings, Solver, Task, read_settings
from armdesign.settings.kinds import Number
from armdesign.settings.sections import SECTIONS

PUBLISHED = {
    "design": {
        "dof": 3, "alpha": (-90.0, 90.0), "a": (0.0, 0.5), "d": (0.0, 0.5), "tool_length": 0.1, "base_yaw": (0.0, 0.0),
        "length": (0.6, 1.2), "joint_limits": ((-180.0, 180.0),), "coaxial_twist": 1.0, "coaxial_offset": 0.001,
    },
    "fitness": {
        "lambda_f": 15.0, "lambda_E": 5.0, "delta": 0.01, "continuity": 10.0, "reach_tolerance": 0.001,
        "orientation_metric": "geodesic", "mount": "start", "tie_hand": True,
    },
    "search": {
        "particles": 400, "iterations": 200, "inertia": 0.8, "c1": 0.4, "c2": 0.6,
        "c_range": (-0.5, 0.5), "range": "valid", "angle_interval": 2, "prune": True,
    },
    "task": {"base_mode": "shoulder", "scale": 1.0},
}  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "algorithm"),
    [
        ([{"seed": 1}], "multibasin"),
        ([{"particles": 40}], "rapso"),
        ([{"seed": 1}, {"angle_interval": 3}], "rapso"),
        ([{"algorithm": "pso"}, {"particles": 40}], "pso"),
        ([{"algorithm": "multibasin", "particles": 40}], "multibasin"),
        ([{"particles": None, "budget": 500}], "multibasin"),
    ],
)
def test_what_only_a_swarm_has_asks_for_one(changes, algorithm):
    settings = Settings()
    for entries in changes:
        settings = settings.replace({"search": {name: value for name, value in entries.items() if value is not None}})
    assert settings.search.algorithm == algorithm


@pytest.mark.parametrize(
    ("entries", "algorithm"),
    [
        ({"seed": 1}, "multibasin"),
        ({"budget": 500}, "multibasin"),
        ({"particles": 40}, "rapso"),
        ({"particles": 400}, "rapso"),  # also where the value is the default
        ({"algorithm": "pso", "particles": 40}, "pso"),
        ({"algorithm": "multibasin", "particles": 40}, "multibasin"),
    ],
)
def test_section_made_by_hand_has_the_algorithm_that_a_file_would_mean(entries, algorithm):
    made = Settings(search=Search(**entries))
    assert made.search.algorithm == algorithm
    assert made == Settings().replace({"search": entries})
    assert dataclasses.replace(made.search, iterations=7).algorithm == algorithm


MADE = [
    Task(recording="a.csv", points=("x", "y")),
    Design(dof=4, bounds={"d_tool": (0.2, 0.2)}),
    Fitness(),
    Solver(starts=8),
    Search(budget=10_000),
    Search(particles=400),
    Search(algorithm="multibasin", particles=40),
]


@pytest.mark.parametrize("section", MADE, ids=repr)
def test_shown_as_one_would_write_it_without_the_defaults(section):
    names = {kind.__name__: kind for kind in (*SECTIONS, Settings)}
    assert eval(repr(section), names) == section  # noqa: S307
    whole = Settings(**{section.title(): section})
    assert eval(repr(whole), names) == whole  # noqa: S307
    assert repr(Settings()) == "Settings()"


@pytest.mark.parametrize("kind", SECTIONS)
def test_help_of_a_section_lists_every_entry_as_it_is_declared(kind):
    text = " ".join(kind.__doc__.split())
    for entry in dataclasses.fields(kind):
        assert f" {entry.name}: {' '.join(entry.metadata['doc'].split())}" in text
        assert entry.metadata["kind"].describe() in text


@pytest.mark.parametrize("value", [{"dof": 3}, 3, None, Search()])
def test_section_of_another_type_is_refused(value):
    with pytest.raises(SettingsError, match="'design'") as refused:
        Settings(design=value)
    assert refused.value.value == value


def test_change_checks_only_the_sections_that_change(monkeypatch):
    checked = []
    monkeypatch.setattr(Number, "check", lambda kind, name, value: checked.append(name) or value)
    settings = Settings()
    checked.clear()
    changed = settings.replace({"search": {"seed": 3}})
    assert {name.partition(".")[0] for name in checked} == {"search"}
    assert all(getattr(changed, each) is getattr(settings, each) for each in ("task", "design", "fitness", "solver"))


@pytest.mark.parametrize(("section", "name"), [(s, name) for s, entries in PUBLISHED.items() for name in entries])
def test_defaults_are_the_published_values(section, name):
    assert getattr(getattr(Settings(), section), name) == PUBLISHED[section][name]


def test_scenarios_have_the_published_weights():
    assert SCENARIOS["packaging"] == (0.0, (1 / 6, 1 / 3, 1 / 2))
    assert SCENARIOS["welding"] == (0.2, (0.0, 0.1, 0.7))


@pytest.mark.parametrize("kind", SECTIONS)
def test_every_entry_is_documented_and_takes_its_default(kind):
    for entry in dataclasses.fields(kind):
        assert len(entry.metadata["doc"]) > 5, entry.name
        assert len(entry.metadata["kind"].describe()) > 3, entry.name
        value = getattr(kind(), entry.name)
        assert value is None or entry.metadata["kind"].check("x", value) == value


@pytest.mark.parametrize("kind", SECTIONS)
def test_what_may_be_left_out_may_be_unset_and_nothing_else(kind):
    for entry in dataclasses.fields(kind):
        if entry.metadata["optional"]:
            assert getattr(kind(**{entry.name: None}), entry.name) is None
        else:
            with pytest.raises(SettingsError, match=f"'{kind.title()}.{entry.name}' is None"):
                kind(**{entry.name: None})


CHANGED = {
    "task": {
        "recording": "/a \"b\"/c\\d.csv", "base": "ü", "points": ("x", "y z"), "orientation": "y z", "max_gap": 0.1,
        "base_mode": "fixed", "low_pass": 6.0, "rate": 50.0, "scale": 1 / 3, "start": -1.0, "stop": 2.0,
    },
    "design": {
        "dof": 2, "joint_limits": ((-1.0, 2.0), (-3.0, 4.0)),
        "bounds": {"alpha_0": (-1 / 3, 0.1), "d_tool": (0.2, 0.2)},
    },
    "fitness": {"weights": (1 / 6, 5 / 6), "orientation_weight": 0.0, "continuity_speed": 100.0, "tie_hand": False},
    "search": {"seed": 2**63 - 1, "patience": 3, "target": 0.1, "time_limit": 60.0},
}  # fmt: skip


@pytest.mark.parametrize("comments", [False, True])
@pytest.mark.parametrize("changes", [{}, CHANGED], ids=["defaults", "changed"])
def test_settings_survive_a_file(tmp_path, comments, changes):
    settings = Settings().replace(changes)
    (tmp_path / "settings.toml").write_text(settings.to_toml(comments=comments), encoding="utf-8")
    assert read_settings(tmp_path / "settings.toml") == settings


def test_settings_survive_a_dictionary():
    settings = Settings().replace(CHANGED)
    assert Settings().replace(settings.to_dict()) == settings
    assert Settings().to_dict()["task"].keys().isdisjoint({"recording", "base", "low_pass"})


def test_change_leaves_the_rest_and_the_original_alone():
    settings = Settings()
    changed = settings.replace({"search": {"seed": 3}})
    assert (settings.search.seed, changed.search.seed) == (0, 3)
    assert changed.design == settings.design
    assert changed.replace({}) == changed
    with pytest.raises(dataclasses.FrozenInstanceError):
        changed.search.seed = 4


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"desing": {"dof": 3}},
            r"unknown section \[desing\]; allowed: task, design, cell",
        ),
        ({"design": {"doff": 3}}, "unknown setting 'design.doff'; allowed: dof, alpha, a, d, "),
        ({"design": 3}, r"'design' is a section, not a value. Write \[design\]"),
        ({"dof": 3}, r"'dof' stands outside of any section; .*Move it below \[design\]"),
        ({"design": {"dof": 0}}, "'design.dof' is 0; allowed: a whole number from 1 to 10"),
    ],
)
def test_change_that_is_not_allowed_is_named(changes, message):
    with pytest.raises(SettingsError, match=message):
        Settings().replace(changes)


def test_missing_entries_keep_their_defaults(tmp_path):
    (tmp_path / "settings.toml").write_text("[search]\nseed = 3\n")
    assert read_settings(tmp_path / "settings.toml") == Settings().replace({"search": {"seed": 3}})
    (tmp_path / "empty.toml").write_text("")
    assert read_settings(tmp_path / "empty.toml") == Settings()
    (tmp_path / "marked.toml").write_bytes(b"\xef\xbb\xbf[search]\r\nseed = 3\r\n")  # as some editors save it
    assert read_settings(tmp_path / "marked.toml").search.seed == 3


def test_relative_recording_counts_from_the_file(tmp_path):
    (tmp_path / "settings.toml").write_text('[task]\nrecording = "data/arm.csv"\n')
    assert read_settings(tmp_path / "settings.toml").task.recording == str(tmp_path / "data" / "arm.csv")
    (tmp_path / "settings.toml").write_text('[task]\nrecording = "/data/arm.csv"\n')
    assert read_settings(tmp_path / "settings.toml").task.recording == "/data/arm.csv"


def test_file_may_be_given_as_text(tmp_path):
    (tmp_path / "settings.toml").write_text("[search]\nseed = 3\n")
    assert read_settings(str(tmp_path / "settings.toml")).search.seed == 3


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"[design\n", "not valid TOML: .*line 1.*--write-config"),
        (b"\xff\xfe", "are not UTF-8 text"),
        (b"[design]\ndof = 99\n", r"settings\.toml: setting 'design.dof' is 99"),
        (b"[design]\ndof = " + b"1" * 5000, "settings.toml"),
    ],
)
def test_file_that_cannot_be_used_is_named(tmp_path, content, message):
    (tmp_path / "settings.toml").write_bytes(content)
    with pytest.raises(SettingsError, match=message):
        read_settings(tmp_path / "settings.toml")


def test_file_that_is_none_is_named(tmp_path):
    for path in (tmp_path / "absent.toml", tmp_path):
        with pytest.raises(SettingsError, match="cannot read the settings"):
            read_settings(path)

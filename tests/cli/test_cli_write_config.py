import tomllib

from armdesign.building.room import room_for_motors
from armdesign.settings.sections import SECTIONS, Settings, read_settings


def printed(run, *flags):
    outcome = run("search", "--write-config", *flags)
    assert outcome.exit_code == 0
    return outcome.stdout


def test_printed_settings_are_toml_and_equal_the_defaults(run, place):
    text = printed(run)
    (place / "settings.toml").write_text(text)
    assert read_settings(place / "settings.toml") == Settings()
    assert set(tomllib.loads(text)) == {kind.title() for kind in SECTIONS}


def test_every_entry_is_there_and_documented(run):
    lines = printed(run).splitlines()
    for kind in SECTIONS:
        begin = lines.index(f"[{kind.title()}]")
        for name in kind.names():
            row = next(i for i in range(begin, len(lines)) if lines[i].lstrip("# ").startswith(f"{name} ="))
            assert lines[row - 1].startswith("# Allowed: ")
            assert len(lines[row - 2]) > 5
            assert lines[row - 2].startswith("# ")


def test_descriptions_read_like_sentences(run):
    for line in printed(run).splitlines():
        assert not line.startswith("#  "), line
        assert "a number s" not in line
        assert "e+" not in line, line
        assert len(line) <= 120


def test_entries_not_set_can_be_set_by_taking_the_mark_away(run, place):
    text = printed(run).replace("# start =   (not set)", "start = 0.5")
    (place / "settings.toml").write_text(text)
    assert read_settings(place / "settings.toml").task.start == 0.5


def test_flags_and_files_go_into_what_is_printed(run, place, packaging):
    (place / "mine.toml").write_text("[fitness]\nlambda_E = 2.5\n")
    text = printed(
        run, packaging, "--config", "mine.toml", "--dof", 5, "--weights", "0.1,0.2,0.3,0.4", "--base", "shoulder"
    )
    settings = tomllib.loads(text)
    assert settings["fitness"]["lambda_E"] == 2.5
    assert settings["fitness"]["weights"] == [0.1, 0.2, 0.3, 0.4]  # one more than points: w_0 comes first
    assert "orientation_weight" not in settings["fitness"]
    assert settings["design"]["dof"] == 5
    assert settings["task"]["base"] == "shoulder"
    assert settings["task"]["recording"] == str(packaging.resolve())
    assert [path.name for path in place.iterdir()] == ["mine.toml"]


def test_motors_of_a_family_set_what_room_a_search_leaves_where_nothing_else_is_given(run):
    wanted = room_for_motors("rmd", Settings().design.length[1], 0.5)
    body = tomllib.loads(printed(run, "--motors", "rmd", "--payload", 0.5, "--joint-length", 0.2))["body"]
    assert {name: body[name] for name in wanted} == wanted | {"joint_length": 0.2}
    unknown = run("search", "--motors", "mrd", "--write-config")
    assert unknown.exit_code == 2
    assert "'mrd'" in unknown.output
    assert "rmd" in unknown.output

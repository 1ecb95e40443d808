import json
import re

import pytest

from armdesign._version import __version__
from armdesign.cli import app

COMMANDS = ("search", "evaluate")


@pytest.mark.parametrize(
    "command", [(), *((name,) for name in COMMANDS)], ids=lambda command: " ".join(command) or "root"
)
def test_help_as_a_real_process(process, command):
    outcome = process(*command, "--help")
    assert outcome.returncode == 0
    assert outcome.stderr == ""
    assert "Usage: " in outcome.stdout
    assert "--help" in outcome.stdout


def test_help_of_the_root_names_every_command(run):
    outcome = run("--help")
    assert outcome.exit_code == 0
    registered = [command.name or command.callback.__name__ for command in app.registered_commands]
    assert set(registered) >= set(COMMANDS)
    for name in registered:
        assert re.search(rf"^ +{name} +\w", outcome.output, re.MULTILINE)


@pytest.mark.parametrize(
    ("command", "options"),
    [
        (
            "search",
            "--dof --algorithm --scenario --config --base --points --orientation --weights --particles --iterations "
            "--seed --out --quiet --overwrite --write-config --holdout --demonstrations --within --enough",
        ),
        (
            "evaluate",
            "--convention --scenario --config --base --points --orientation --weights --out --overwrite --quiet",
        ),
    ],
)
def test_help_documents_every_option(run, command, options):
    outcome = run(command, "--help")
    assert outcome.exit_code == 0
    for option in options.split():
        assert re.search(rf"{option}\b.*\w{{3,}}", outcome.output), option


def test_command_without_help_text_does_not_exist():
    for command in app.registered_commands:
        assert command.callback.__doc__


def test_version_as_a_real_process(process):
    outcome = process("--version")
    assert (outcome.returncode, outcome.stdout, outcome.stderr) == (0, f"armdesign {__version__}\n", "")


def test_no_command_shows_the_help(run):
    assert "Usage:" in run().output


@pytest.mark.parametrize("args", [("serach",), ("search", "--dofs", "3"), ("evaluate",)])
def test_wrong_words_are_refused_without_a_traceback(run, args):
    outcome = run(*args)
    assert outcome.exit_code == 2
    assert "Traceback" not in outcome.output
    assert "Error" in outcome.output


HEAVY = {"numpy", "scipy", "numba", "pinocchio", "matplotlib", "yourdfpy", "meshcat", "jinja2"}
LOADED = "import json, sys; print(json.dumps(sorted({name.split('.')[0] for name in sys.modules})))"


def loaded(process, code):
    outcome = process(code=f"{code}\n{LOADED}")
    assert outcome.returncode == 0, outcome.stderr
    return set(json.loads(outcome.stdout.splitlines()[-1]))


def test_import_of_the_package_and_of_the_commands_is_light(process):
    assert not HEAVY & loaded(process, "import armdesign, armdesign.cli")


def test_version_and_settings_are_printed_without_loading_anything_heavy(process):
    code = "from armdesign.cli import app\nimport contextlib, io\nwith contextlib.redirect_stdout(io.StringIO()):\n"
    for args in (["--version"], ["search", "--write-config"], ["search", "--help"]):
        assert not HEAVY & loaded(process, f"{code}    app({args!r}, standalone_mode=False)")


def test_public_names_come_from_where_they_live(process):
    code = "import armdesign\nassert all(getattr(armdesign, name) is not None for name in armdesign.__all__)"
    assert process(code=code).returncode == 0
    with pytest.raises(AttributeError, match="nonsense"):
        __import__("armdesign").nonsense  # noqa: B018

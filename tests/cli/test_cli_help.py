"""The help: every command is listed at once, and everything fits 80 columns."""

import inspect
import json
import time

import pytest
from typer.main import get_command

from armdesign._version import __version__
from armdesign.cli import COMMANDS, app, load_command

GROUPS = ("catalogue", "recording", "study")
WAYS = [
    (),
    *((name,) for name in COMMANDS),
    *((group, name) for group in GROUPS for name in load_command(group).commands),
]
HEAVY = {"numpy", "scipy", "numba", "pinocchio", "matplotlib", "yourdfpy", "meshcat", "jinja2", "distributed"}
LOADED = "import json, sys; print(json.dumps(sorted({name.split('.')[0] for name in sys.modules})))"


def loaded(process, code):
    outcome = process(code=f"{code}\n{LOADED}")
    assert outcome.returncode == 0, outcome.stderr
    return set(json.loads(outcome.stdout.splitlines()[-1]))


def command_at(way):
    if not way:
        return get_command(app)
    command = load_command(way[0])
    return command.commands[way[1]] if len(way) == 2 else command


@pytest.mark.parametrize("way", WAYS, ids=" ".join)
def test_help_is_whole_and_fits_80_columns(run, way):
    outcome, short = run(*way, "--help"), run(*way, "-h")
    assert (outcome.exit_code, short.output) == (0, outcome.output)
    lines = outcome.output.splitlines()
    assert max(map(len, lines)) <= 80
    assert not any(
        line.endswith("...") and not line.endswith(",...") for line in lines if not line.startswith("Usage: ")
    )
    assert "\x1b" not in outcome.output
    for parameter in command_at(way).params:
        if parameter.param_type_name == "option":
            assert parameter.help, parameter.name
            assert max(parameter.opts, key=len) in outcome.output


@pytest.mark.parametrize("name", COMMANDS)
def test_line_in_the_list_is_the_first_of_the_command_s_own_help(name):
    command = load_command(name)
    assert COMMANDS[name][1] == inspect.cleandoc(command.help).splitlines()[0]


def test_root_lists_every_command_with_its_line(run):
    output = run("--help").output
    assert output == run().output
    for name, (_, line) in COMMANDS.items():
        assert f"  {name:<12}  {line}\n" in output


def test_help_and_version_as_real_processes_load_nothing_heavy_and_are_quick(process):
    begun = time.process_time()
    outcome = process("--help")
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert "Usage: " in outcome.stdout
    outcome = process("--version")
    assert (outcome.returncode, outcome.stdout, outcome.stderr) == (0, f"armdesign {__version__}\n", "")
    code = "from armdesign.cli import app\nimport contextlib, io\nwith contextlib.redirect_stdout(io.StringIO()):\n"
    for args in (["--version"], ["--help"]):
        assert not HEAVY & loaded(process, f"{code}    app({args!r}, standalone_mode=False)")
    assert time.process_time() - begun < 10.0


def test_completion_knows_commands_options_and_choices(process, environment):
    def completed(words):
        asked = {"_ARMDESIGN_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(words.count(" "))}
        outcome = process(env=environment | asked)
        return outcome.stdout.split()

    assert "search" in completed("armdesign sea")
    assert completed("armdesign search --algorithm r") == ["rapso"]

"""The code blocks of the README and of the pages that it leads to run as they stand."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from armdesign.cli import app

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = ("long-searches", "robot-files")
"""Pages in docs with shell blocks, in the order in which they run, behind the README's."""


def blocks(language: str, text: str = README) -> list[str]:
    """Code blocks of one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def shell_lines() -> list[str]:
    """The armdesign commands of all shell blocks; installing and testing is what runs this."""
    pages = [README, *((ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8") for name in PAGES)]
    lines = [line for page in pages for block in blocks("bash", page) for line in block.splitlines()]
    return [part.strip() for line in lines for part in line.split("&&") if part.strip().startswith("armdesign")]


@pytest.fixture(scope="module")
def workplace(tmp_path_factory):
    """A folder that looks like a checkout to the commands."""
    folder = tmp_path_factory.mktemp("readme")
    shutil.copytree(ROOT / "examples", folder / "examples")
    return folder


def test_first_screen_has_both_commands():
    first_screen = "\n".join(README.splitlines()[:30])
    assert "pip install . && armdesign search examples/packaging.csv" in first_screen
    assert "pip install '.[test]' && pytest" in first_screen


@pytest.mark.views
def test_shell_blocks_run_in_order(workplace, monkeypatch):
    """All in this process, with small budgets: the arms need not be good; the first search writes what one looks at."""
    monkeypatch.chdir(workplace)
    for k, line in enumerate(shell_lines()):
        words, _, file = line.partition(" > ")
        words = shlex.split(words, comments=True)[1:]
        if words[0] == "search" and len(words) == 2:
            words += ["--budget", "400"]
        if "--budget" in words:
            place = words.index("--budget") + 1
            words[place] = str(min(int(words[place]), 400))
        if words[0] == "search" and k:
            words.append("--no-report")
        if words[0] == "sweep":
            words += ["--workers", "1"]
        outcome = CliRunner().invoke(app, words)
        allowed = (0, 3) if words[0] == "check" else (0,)  # so few candidates need not meet the tolerance
        assert outcome.exit_code in allowed, (line, outcome.stderr)
        if file:
            (workplace / file.strip()).write_text(outcome.stdout, encoding="utf-8")
    assert (workplace / "runs" / "weld" / "arm.urdf").is_file()
    assert "[design]" in (workplace / "settings.toml").read_text(encoding="utf-8")


def test_python_blocks_run(workplace, monkeypatch):
    monkeypatch.chdir(workplace)
    for block in blocks("python"):
        exec(block.replace("budget=2000", "budget=300"), {})  # noqa: S102
    assert (workplace / "my_run" / "result.json").is_file()


def test_linked_files_exist():
    for page in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")):
        for target in re.findall(r"\]\((?!https?://)([^)#]+)\)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), (page.name, target)


def test_files_and_functions_that_the_architecture_names_are_there():
    package = ROOT / "armdesign"
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    text += (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = {name for name in re.findall(r"`([\w/]+\.(?:py|j2))`", text) if "NAME" not in name}
    there = [path.relative_to(ROOT).as_posix() for path in (*package.rglob("*"), *(ROOT / "tests").rglob("*.py"))]
    assert [name for name in named if not any(f"/{path}".endswith(f"/{name}") for path in there)] == []
    for name, thing in re.findall(r"`([\w/]+\.py)`: `(\w+)", text):
        (path, *_) = [ROOT / path for path in there if path.endswith(f"/{name}")]
        assert re.search(rf"^(def|class) {thing}\b", path.read_text(encoding="utf-8"), re.MULTILINE), (name, thing)

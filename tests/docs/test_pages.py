"""Every block of the site's pages runs, is parsed, or says why not: tutorial and how-tos as a reader goes."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import re
import shlex
import shutil
import tomllib
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from typer.testing import CliRunner

from armdesign.cli import app
from armdesign.runs.folder import RESULT_SCHEMA

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))


def load(path: Path):
    """A module by its file."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


SITE = load(DOCS / "pages.py")
RUN_ELSEWHERE = ("long-searches", "robot-files")
"""Pages whose blocks tests/test_readme.py runs behind those of the README."""
PLUG_INS = "plug-ins"
"""The page that test_plugins_page.py runs."""
RUN_HERE = [page for page in PAGES if page.stem not in RUN_ELSEWHERE and "```bash" in page.read_text(encoding="utf-8")]
BLOCK = re.compile(r"(?P<before>[^\n]*)\n```(?P<language>\w+)\n(?P<text>.*?)^```", re.MULTILINE | re.DOTALL)
NOT_RUN = re.compile(r"<!-- not run: .{8,} -->")
QUICK = {"--budget": "300"}
"""What makes the commands of the pages quick; the arms need not be good."""
VERDICTS = ("check", "build")
"""Commands that may end with the exit code of an arm that is not feasible."""


def blocks(page: Path) -> list[re.Match[str]]:
    """The code blocks of a page, each with the line before it."""
    return list(BLOCK.finditer(page.read_text(encoding="utf-8")))


@pytest.mark.parametrize("page", [*PAGES, *(ROOT / name for name in SITE.COPIES)], ids=lambda page: page.stem)
def test_every_block_is_run_or_says_why_not(page):
    found = blocks(page)
    fences = re.findall(r"^\s*```", page.read_text(encoding="utf-8"), re.MULTILINE)
    assert 2 * len(found) == len(fences), f"{page.name} has a block without a language, or one that is indented"
    for block in found:
        language, text = block["language"], block["text"]
        if NOT_RUN.search(block["before"]):
            continue
        assert language in ("bash", "toml", "json", "text", "math", "python"), (page.name, text)
        if language in ("bash", "python"):
            assert page in RUN_HERE or page.stem in (*RUN_ELSEWHERE, PLUG_INS), (
                f"{page.name} has {language} that no test runs"
            )
        if language == "bash":
            lines = text.replace("\\\n", " ").splitlines()
            assert [line for line in lines if line and not line.startswith("armdesign ")] == [], "no test runs these"
        if language == "toml":
            tomllib.loads(text)
        if language == "json":
            json.loads(text)


def commands(page: Path) -> list[list[str]]:
    """The words of the armdesign commands of a page's blocks, made quick where nothing has to come of the arm."""
    shell = "".join(block["text"] for block in blocks(page) if block["language"] == "bash").replace("\\\n", " ")
    found = [shlex.split(line, comments=True)[1:] for line in shell.splitlines() if line.startswith("armdesign ")]
    if any(words[0] == "build" for words in found):
        return found
    for words in found:
        for flag, value in QUICK.items():
            with contextlib.suppress(ValueError):
                words[words.index(flag) + 1] = value
        if words[0] == "search":
            words += ["--workers", "1", "--effort", "budget", "--rate", "25"]
    return found


@pytest.fixture(scope="module")
def workplace(tmp_path_factory):
    """A folder that looks like a checkout to the commands."""
    folder = tmp_path_factory.mktemp("pages")
    shutil.copytree(ROOT / "examples", folder / "examples")
    (folder / "benchmarks").mkdir()
    shutil.copytree(ROOT / "benchmarks" / "tasks", folder / "benchmarks" / "tasks")
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("page", RUN_HERE, ids=lambda page: page.stem)
def test_blocks_of_a_page_run_in_order(workplace, monkeypatch, page):
    monkeypatch.chdir(workplace)
    for words in commands(page):
        outcome = CliRunner().invoke(app, words)
        assert outcome.exit_code in ((0, 3) if words[0] in VERDICTS else (0,)), (words, outcome.output[-600:])
    exec("".join(block["text"] for block in blocks(page) if block["language"] == "python"), {})  # noqa: S102
    if page.stem == "tutorial":  # whose run this page of the code reads
        (block,) = re.findall(r"```python\n(.*?)```", SITE.result_page(), re.DOTALL)
        exec(block, {})  # noqa: S102
    strict = Draft202012Validator(json.loads(RESULT_SCHEMA.read_text(encoding="utf-8")))
    for result in workplace.rglob("result.json"):
        strict.validate(json.loads(result.read_text(encoding="utf-8")))


def test_pages_that_run_here_are_found():
    assert {"tutorial", "markers", "place-the-base", "model-the-cell", "tolerance"} <= {page.stem for page in RUN_HERE}


def test_page_of_commands_has_every_option_and_argument():
    page = SITE.commands_page()
    sections = dict(re.findall(r"^#{2,3} (armdesign [^\n]+)\n(.*?)(?=^#{2,3} |\Z)", page, re.MULTILINE | re.DOTALL))
    for name in SITE.COMMANDS:
        command = SITE.load_command(name)
        inner = getattr(command, "commands", None)
        for path, each in [(name, command)] if inner is None else [(f"{name} {sub}", inner[sub]) for sub in inner]:
            section = sections[f"armdesign {path}"]
            for parameter in each.params:
                shown = max(parameter.opts, key=len) if parameter.param_type_name == "option" else parameter.metavar
                assert (shown or parameter.name.upper()).strip("[].") in section, (path, shown)


def test_pages_of_the_code_have_every_setting_entry_and_function():
    page = SITE.settings_page()
    for kind in SITE.SECTIONS:
        assert all(f"| `{name}` |" in page for name in kind.names())
    schema = json.loads(RESULT_SCHEMA.read_text(encoding="utf-8"))
    assert [name for name, _, meaning in SITE.entries(schema, schema) if not meaning] == []
    assert "`verdict.self_clearance.value`" in SITE.result_page()
    assert "::: armdesign.search.search.search" in SITE.api_page()


def test_navigation_has_every_page():
    named = re.findall(r": ([\w/-]+\.md)$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.MULTILINE)
    there = {page.relative_to(DOCS).as_posix() for page in PAGES} | {*SITE.GENERATED} | {*SITE.COPIES.values()}
    assert sorted(named) == sorted(there)


@pytest.mark.slow
def test_notebook_runs(workplace, monkeypatch):
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    notebook = nbformat.read(ROOT / "examples" / "tutorial.ipynb", as_version=4)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    client = nbclient.NotebookClient(
        notebook, timeout=600, resources={"metadata": {"path": str(workplace / "examples")}}
    )
    client.execute()

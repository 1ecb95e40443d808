"""The plug-in package of docs/how-to/plug-ins.md, installed and used as it stands there."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from armdesign import plugins
from armdesign.demonstration.files.formats import known_formats
from armdesign.demonstration.files.readers import read_recording
from armdesign.errors import PluginError, RecordingError, SettingsError
from armdesign.settings.sections import ALGORITHM_SETTINGS
from armdesign.swarm import ALGORITHMS, Box, SearchSpace, algorithm_from_state, make_algorithm

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "how-to" / "plug-ins.md").read_text(encoding="utf-8")
(PROJECT,) = (tomllib.loads(text) for text in re.findall(r"^```toml\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL))
MODULE = "\n\n".join(re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL))
SPACE = SearchSpace(Box([0.0, 0.0], [1.0, 2.0], [False, False]))


def install(folder: Path, module: str = MODULE) -> Path:
    """Put the page's package into a folder as pip would."""
    project = PROJECT["project"]
    about = folder / f"armdesign_example-{project['version']}.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    groups = project["entry-points"].items()
    lines = [line for group, entries in groups for line in (f"[{group}]", *(f"{k} = {v}" for k, v in entries.items()))]
    (about / "entry_points.txt").write_text("\n".join(lines) + "\n")
    (folder / "armdesign_example.py").write_text(module)
    return folder


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Installs a module as the page's package, in this process, for one test."""

    def put(module: str = MODULE) -> Path:
        monkeypatch.syspath_prepend(install(tmp_path / "site", module))
        plugins.installed.cache_clear()
        return tmp_path

    yield put
    sys.modules.pop("armdesign_example", None)
    monkeypatch.undo()
    plugins.installed.cache_clear()


def acme(path: Path) -> Path:
    """A recording of the page's format: a hand on its way round a shoulder."""
    t = np.linspace(0.0, 2.0, 41)
    hand = np.stack([400 + 60 * np.cos(3 * t), 200 * np.sin(t), 1100 + 100 * t], axis=1)
    rows = np.column_stack([t, np.tile([0.0, 0.0, 1400.0], (len(t), 1)), hand])
    path.write_text("ACME\nshoulder hand\n" + "\n".join(" ".join(map(repr, row)) for row in rows.tolist()) + "\n")
    return path


def test_format_of_the_page_is_read(installed):
    folder = installed()
    recording = read_recording(acme(folder / "take.acme"))
    assert list(recording.points) == ["shoulder", "hand"]
    assert recording.points["shoulder"][0] == pytest.approx([0.0, 0.0, 1.4])
    assert known_formats()[0].name == "Acme tracker"


def searched(budget: int, stop: int | None = None) -> tuple[float, ...]:
    """Best fitness, its position and the evaluations of a search by the page's algorithm, resumed after a batch."""
    search = make_algorithm("random", SPACE, np.random.default_rng(3), {"budget": budget})
    while not search.done:
        X, state = search.ask(), search.state()
        if search.iteration == stop:
            search = algorithm_from_state(state, SPACE)
        search.tell(np.sum((X - 0.5) ** 2, axis=1), np.ones(len(X), dtype=bool))
    return search.best_fitness, *search.best_position, search.evaluations


def test_algorithm_of_the_page_searches_and_resumes(installed):
    installed()
    assert [*ALGORITHMS][-1] == [*ALGORITHM_SETTINGS][-1] == "random"
    assert ALGORITHM_SETTINGS["random"] == ("budget",)
    runs = [searched(450, stop) for stop in (None, 3)]
    assert runs[0] == runs[1]
    assert runs[0][0] < 0.01
    assert runs[0][-1] == 450


@pytest.mark.parametrize(
    ("module", "word"),
    [
        ("import nothing_of_this_name", "nothing_of_this_name"),
        ("AcmeTracker = RandomSearch = 3", "'matches'"),
        (MODULE.replace("return Take", "return str"), "TypeError"),
        (MODULE.replace("return Take(rows[:, 0]", "return Take(rows[1:, 0]"), "(40, 3)"),
        (MODULE.replace('up="z"', 'up="w"'), "'w'"),
        (MODULE.replace("names = path", "names = paths"), "paths"),
        (MODULE.replace("head.startswith", "head.begins"), "begins"),
    ],
)
def test_broken_format_is_named_with_its_package(installed, module, word):
    folder = installed(module)
    with pytest.raises(PluginError, match=re.escape(word)) as error:
        read_recording(acme(folder / "take.acme"))
    assert "armdesign-example 1.0" in str(error.value)
    assert error.value.fix == "Mend or uninstall armdesign-example"


def test_errors_of_bad_recordings_go_through(installed):
    folder = installed(MODULE.replace("names = path", "raise RecordingError('7 is odd')\n        names = path"))
    sys.modules.pop("armdesign_example", None)
    import armdesign_example  # noqa: PLC0415 (found only now)

    armdesign_example.RecordingError = RecordingError
    with pytest.raises(RecordingError, match="7 is odd"):
        read_recording(acme(folder / "take.acme"))


@pytest.mark.parametrize(
    ("module", "word"),
    [
        ("RandomSearch = int", "Algorithm"),
        (MODULE.replace("def _take", "def take"), "_take"),
        (MODULE.replace("budget: int", "bread: int"), "budget"),
    ],
)
def test_broken_algorithm_is_named_with_its_package(installed, module, word):
    installed(module)
    with pytest.raises(PluginError, match=word) as error:
        print(ALGORITHMS["random"], ALGORITHM_SETTINGS["random"])
    assert "armdesign-example 1.0" in str(error.value)


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ("return self.space.draw(", "raise KeyError('lost')\n        return self.space.draw(", "KeyError: 'lost'"),
        ("return self.space.draw(", "return 3 + self.space.draw(", "_next"),
        ("if values.min()", "if values.mim()", "mim"),
        ("return self.best_fitness", "return 'good'", "good"),
        ("return self.evaluations >=", "return self.evaluated >=", "evaluated"),
        ('"fitness": self.basins[1]', '"fitness": self.valleys', "valleys"),
        (
            "    budget: int = 50_000\n",
            "    budget: int = 50_000\n\n    def __post_init__(self):\n        1 / 0\n",
            "Zero",
        ),
    ],
)
def test_algorithm_that_fails_in_a_search_is_named_with_its_package_and_line(installed, old, new, word):
    assert old in MODULE
    installed(MODULE.replace(old, new))
    with pytest.raises(PluginError, match=re.escape(word)) as error:
        searched(200)
    assert "armdesign-example 1.0" in str(error.value)
    assert ("armdesign_example.py, line" in str(error.value)) is (word not in ("_next", "good"))


def test_algorithm_that_is_not_installed_is_an_error_with_the_way_out():
    with pytest.raises(SettingsError, match="multibasin"):
        make_algorithm("random", SPACE, np.random.default_rng(3))


def command(folder: Path, words: str) -> subprocess.CompletedProcess[str]:
    """Run armdesign with the package that is installed in a folder's site."""
    return subprocess.run(
        [sys.executable, "-m", "armdesign", *shlex.split(words)],
        cwd=folder, capture_output=True, text=True, check=False,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(folder / "site"), str(ROOT)])},
    )  # fmt: skip


@pytest.mark.slow
def test_command_line_and_workers_see_the_package(tmp_path):
    acme(tmp_path / "take.acme")
    install(tmp_path / "site")
    flags = "--base shoulder --points hand --algorithm random --budget 200 --seeds 2 --workers 2 --out s"
    outcome = command(tmp_path, f"sweep take.acme {flags}")
    assert outcome.returncode == 0, outcome.stderr
    assert len(list(tmp_path.glob("s/*/result.json"))) == 2


@pytest.mark.slow
def test_search_whose_plugin_failed_goes_on_once_it_is_mended(tmp_path):
    breaks = "if self.iteration == 1 and Path('broken').exists():\n            raise ValueError('7 is odd')\n        "
    module = MODULE.replace("if values.min()", breaks + "if values.min()")
    install(tmp_path / "site", f"from pathlib import Path\n{module}")
    acme(tmp_path / "take.acme")
    begin = (
        "search take.acme --base shoulder --points hand --algorithm random --dof 3 --budget 300 --workers 1 -q --out"
    )
    outcome = command(tmp_path, f"{begin} whole")
    assert outcome.returncode == 0, outcome.stderr
    (tmp_path / "broken").touch()
    outcome = command(tmp_path, f"{begin} run")
    assert outcome.returncode == 2
    assert re.fullmatch(r"armdesign: .*armdesign-example 1\.0.*7 is odd.*\n", outcome.stderr)
    assert not (tmp_path / "run" / "result.json").exists()
    (tmp_path / "broken").unlink()
    outcome = command(tmp_path, "search --resume run -q")
    assert outcome.returncode == 0, outcome.stderr
    assert (tmp_path / "run" / "history.csv").read_bytes() == (tmp_path / "whole" / "history.csv").read_bytes()

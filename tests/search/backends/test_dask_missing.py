import subprocess
import sys
from pathlib import Path

from typer.testing import CliRunner

from armdesign.cli import app

PACKAGING = Path(__file__).resolve().parents[3] / "examples" / "packaging.csv"


def test_without_the_extra_the_pip_line_is_named(monkeypatch, tmp_path):
    for name in ("dask_workers", "dask_connection"):
        monkeypatch.delitem(sys.modules, f"armdesign.search.backends.{name}", raising=False)
    monkeypatch.setitem(sys.modules, "distributed", None)
    command = ["search", str(PACKAGING), "--cluster", "tcp://127.0.0.1:8786", "--out", str(tmp_path / "run")]
    outcome = CliRunner().invoke(app, command)
    assert outcome.exit_code == 2
    assert outcome.output.splitlines()[-1].endswith("not installed. Run: pip install 'armdesign[cluster]'")


def test_dask_and_what_is_slow_of_scipy_are_not_loaded_unless_asked_for():
    code = (
        "import armdesign.search.backends.parallel, sys\n"
        "sys.exit(bool({'distributed', 'scipy.spatial', 'scipy.signal', 'scipy.sparse'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0

"""Make the pictures of the README and of the documentation from what the package does now.

``python docs/make_pictures.py`` runs the searches of the examples, some minutes on a core, and replaces the pictures
beside this file. ``--budget 400 --out FOLDER`` is quick, to see that it works; ``--only report.png`` makes one of them.
Those of pages, preview and report, need a Chromium browser.
"""

from __future__ import annotations

import argparse
import base64
import re
import shlex
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from armdesign.runs.reading import read_result
from armdesign.views.report.cell_rendering import cell_rendering
from armdesign.views.report.pdf import find_browser
from armdesign.views.writing import preview, report

DOCS = Path(__file__).resolve().parent
EXAMPLES = DOCS.parent / "examples"
CELLS = {
    "packaging_cell": (
        50_000,
        "packaging.csv --obstacles packaging_cell.toml --place 'x=0.72..1.0 y=-0.5..0.2 z=0.95' --dof 5 "
        "--weights 0.02,0.03,0.95 --tolerance 15mm",
    ),
    "welding_cell": (
        50_000,
        "welding.csv --scenario welding --obstacles welding_cell.toml "
        "--place 'x=1.0 y=-0.6..0.2 z=1.1..1.7 yaw=180' --mounted wall --dof 6 --tolerance 15mm",
    ),
    "tutorial_arm": (
        4000,
        "box_lift.c3d --obstacles box_lift_cell.toml --place 'x=0.3..0.8 y=-0.75..-0.45 z=0.8' --dof 4 "
        "--weights 0.02,0.03,0.95 --tolerance 10mm --motors rmd --payload 0.5",
    ),
}
"""Searches by their picture: candidates at most, and options as in ``examples/README.md`` and the tutorial."""
RECORDING = "tutorial_recording.png"
"""Picture of a recording, without a search."""
PAGES = {"preview.png": "packaging_cell", "welding_cell.png": "welding_cell", "report.png": "packaging_cell"}
"""Pictures of pages, by the search that they show."""
WIDTH, HEIGHT = 1280, 860
"""Of the browser's window [pixels]."""


def search(name: str, folder: Path, budget: int | None) -> Path:
    """The run folder of a search, made where it is not there yet.

    Args:
        name: Which of ``CELLS``.
        folder: Where run folders are kept.
        budget: Candidates at most; by default those of ``CELLS``.
    """
    most, options = CELLS[name]
    run = folder / name
    if not (run / "result.json").is_file():
        words = ["search", *shlex.split(options), "--budget", str(budget or most), "--out", str(run), "--overwrite"]
        armdesign(words)
    return run


def armdesign(words: list[str]) -> None:
    """Run a command in the folder of the examples.

    Args:
        words: The command with its options.
    """
    code = "import sys; from armdesign.cli import app; app()"
    subprocess.run([sys.executable, "-c", code, *words], cwd=EXAMPLES, check=True)


def draw_arm(run: Path, picture: Path) -> None:
    """Write the picture that the report of a run begins with.

    Args:
        run: The run folder.
        picture: The PNG to write.
    """
    found = re.search(r"base64,([^\"]*)", cell_rendering(read_result(run)).svg)
    if found is None:
        raise SystemExit("the report's picture holds no PNG any more: this script has to change with it")
    picture.write_bytes(base64.b64decode(found.group(1)))


def shoot(page: str, picture: Path) -> None:
    """Write what a browser shows of a page.

    Args:
        page: Its address.
        picture: The PNG to write.
    """
    browser = find_browser()
    if browser is None:
        raise SystemExit(f"{picture.name} needs a browser of the Chromium family, and none is on PATH")
    size = f"--window-size={WIDTH},{HEIGHT}"
    flags = ["--headless", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader", "--hide-scrollbars", size]
    waits = "--virtual-time-budget=4000"
    subprocess.run(
        [browser, *flags, waits, f"--screenshot={picture}", page], check=True, timeout=120, capture_output=True
    )


def main() -> None:
    """Make the pictures that are asked for."""
    names = [*dict.fromkeys([*(f"{name}.png" for name in CELLS), *PAGES]), RECORDING]
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=DOCS, help="folder of the pictures (default: that of this file)")
    parser.add_argument("--runs", type=Path, help="folder that keeps the searches, for the next time (default: none)")
    parser.add_argument("--budget", type=int, help="candidates at most of every search")
    parser.add_argument("--only", choices=names, action="append", help="a picture to make; all by default")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as room:
        kept = Path(given.runs or room).resolve()
        for name in given.only or names:
            picture = (given.out / name).resolve()
            if name == RECORDING:
                armdesign(["recording", "plot", "box_lift.c3d", "--out", str(picture), "--overwrite"])
                continue
            run = search(PAGES.get(name, picture.stem), kept, given.budget)
            if name in ("preview.png", "welding_cell.png"):  # the preview draws walls, the report none
                preview(read_result(run), Path(room) / "page.html", overwrite=True)
                shoot(f"{(Path(room) / 'page.html').as_uri()}#t=0.9", picture)
            elif name == "report.png":
                shown = replace(read_result(run), folder=Path("runs") / run.name)  # what its commands name
                report(shown, Path(room) / "page.html", overwrite=True)
                shoot((Path(room) / "page.html").as_uri(), picture)
            else:
                draw_arm(run, picture)
            print(picture)


if __name__ == "__main__":
    main()

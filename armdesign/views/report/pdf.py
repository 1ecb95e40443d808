"""Print a page as PDF with a browser of the Chromium family, where one is there."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from armdesign.errors import ArmDesignError, RunFolderError
from armdesign.files import write_whole

BROWSERS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "msedge",
    "microsoft-edge",
    "microsoft-edge-stable",
    "brave-browser",
)
"""Names on PATH, tried in this order."""
PLACES = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    "C:/Program Files/Google/Chrome/Application/chrome.exe",
    "C:/Program Files (x86)/Google/Chrome/Application/chrome.exe",
    "C:/Program Files (x86)/Microsoft/Edge/Application/msedge.exe",
    "C:/Program Files/Microsoft/Edge/Application/msedge.exe",
)
"""Where browsers lie on systems that do not have them on PATH."""
TIME_LIMIT = 90.0
"""A browser that has not printed by then is stopped [s]."""


def find_browser() -> str | None:
    """A browser that can print, or None."""
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    return found or next((place for place in PLACES if Path(place).is_file()), None)


def print_pdf(page: str, target: Path, *, browser: str | None = None, time_limit: float = TIME_LIMIT) -> None:
    """Print a page; the browser gets a profile of its own that is thrown away.

    Args:
        page: The HTML.
        target: PDF file to write.
        browser: Program to print with; by default the one that is found.
        time_limit: How long it may take [s].

    Raises:
        ArmDesignError: There is no browser, or it does not print.
        RunFolderError: The PDF cannot be written.
    """
    program = browser or find_browser()
    if program is None:
        fix = f"Open the HTML file in any browser and print it, or install one of {', '.join(BROWSERS[:3])}"
        raise ArmDesignError("the PDF needs a browser to print it, and none is on PATH", fix=fix)
    try:
        with tempfile.TemporaryDirectory(prefix="armdesign-", ignore_cleanup_errors=True) as room:
            write_whole(target, printed(program, page, Path(room), time_limit))
    except OSError as error:
        raise RunFolderError(f"there is no room for temporary files: {error.strerror}", value=str(target)) from error


def printed(program: str, page: str, room: Path, time_limit: float) -> bytes:
    """The PDF of a page, printed in a temporary folder.

    Raises:
        ArmDesignError: The browser does not print.
    """
    source, output = room / "report.html", room / "report.pdf"
    source.write_text(page, encoding="utf-8", newline="")
    try:
        subprocess.run(
            command(program, source, output, room / "profile"),
            check=False, timeout=time_limit,
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
    except subprocess.TimeoutExpired as error:
        fix = "Open the HTML file in a browser and print it"
        raise ArmDesignError(f"{program} has not printed within {time_limit:g} s", value=program, fix=fix) from error
    except OSError as error:
        raise ArmDesignError(f"{program} cannot be started: {error.strerror}", value=program) from error
    content = output.read_bytes() if output.is_file() else b""
    if not content.startswith(b"%PDF"):
        raise ArmDesignError(f"{program} has printed nothing", value=program, fix="Open the HTML file and print it")
    return content


def command(program: str, source: Path, output: Path, profile: Path) -> list[str]:
    """The browser's command line; it has no sandbox where root runs it, since it refuses to start with one there."""
    root = sys.platform != "win32" and os.geteuid() == 0
    return [
        program,
        "--headless",
        *(["--no-sandbox"] if root else []),
        "--disable-gpu",
        "--disable-extensions",
        "--disable-background-networking",
        "--disable-dev-shm-usage",
        "--no-first-run",
        "--no-default-browser-check",
        "--no-pdf-header-footer",
        f"--user-data-dir={profile}",
        f"--print-to-pdf={output}",
        source.as_uri(),
    ]

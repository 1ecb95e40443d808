"""The studio in a real browser: the system's Chromium, driven by Playwright."""

import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import sync_playwright

sys.path.append(str(Path(__file__).resolve().parents[1] / "demonstration"))
from c3d_bytes import c3d_bytes

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1",
)
"""The last: nothing outside this machine can be had, as offline."""


@pytest.fixture
def take(tmp_path):
    """A C3D of an arm that reaches forward, its wrist hidden for a moment."""
    time = np.linspace(0.0, 1.0, 60)
    way, still = 0.15 * np.sin(np.pi * time), np.zeros(60)
    wrist = np.stack([0.35 + way, still, 1.0 + way], axis=1)
    wrist[20:24] = np.nan
    elbow = np.stack([0.2 + way / 2, still - 0.1, 1.1 + way / 2], axis=1)
    hand = np.stack([0.42 + way, still, 1.0 + 1.1 * way], axis=1)
    points = np.stack([np.tile([0.0, 0.0, 1.3], (60, 1)), elbow, wrist, hand], axis=1)
    groups = {"POINT": {"LABELS": ["RSHO", "RELB", "RWRA", "RFIN"], "UNITS": "mm"}}
    path = tmp_path / "reach.c3d"
    residual = np.where(np.isnan(points[:, :, 0]), -1.0, 0.0)
    path.write_bytes(c3d_bytes(np.nan_to_num(1e3 * points), residual=residual, rate=60.0, groups=groups))
    return path


@pytest.fixture
def studio(tmp_path):
    """Start ``armdesign studio`` in an empty folder: (its address, the folder)."""
    processes = []

    def start(*given):
        process = subprocess.Popen(
            [sys.executable, "-m", "armdesign", "studio", "--no-open", *map(str, given)],
            cwd=tmp_path, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )  # fmt: skip
        processes.append(process)
        for line in process.stdout:
            if found := re.search(r"http://\S+", line):
                return found[0], tmp_path
        raise AssertionError("the studio has not started")

    yield start
    for process in processes:
        process.send_signal(signal.SIGINT)
        assert process.wait(20) == 0


@pytest.fixture
def browser():
    """Chromium without a window."""
    command = next(filter(None, map(shutil.which, BROWSERS)), None)
    if command is None:
        pytest.skip("no Chromium here")
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=command, args=list(FLAGS))
        yield running
        running.close()


@pytest.fixture
def open_page(browser):
    """Open an address: (the page, what went wrong on it, which is filled as it happens)."""

    def opened(address, width=1280, height=800):
        page, faults = browser.new_page(viewport={"width": width, "height": height}), []
        page.on("console", lambda message: message.type == "error" and faults.append(message.text))
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.set_default_timeout(120_000)  # software draws the scene
        page.goto(address)
        page.locator(".ad h4").first.wait_for()  # the headline
        return page, faults

    return opened

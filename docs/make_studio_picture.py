"""Make the picture of the studio in its documentation from a run folder.

``python docs/make_studio_picture.py RUN PICTURE.png``, with Playwright and Chromium. Make the run in the studio from
``examples/box_lift.c3d``, with nothing changed on the page.
"""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import sync_playwright

from armdesign.studio.server import open_server
from armdesign.studio.studio import PANELS, Page

FLAGS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def main() -> None:
    """Open the run, choose its parts, go to the moment of the largest error, and take the picture."""
    run, picture = map(Path, sys.argv[1:3])
    picture, room = picture.resolve(), Path(tempfile.mkdtemp())  # where no parts are kept yet
    shutil.copytree(run, room / "runs" / run.name)
    os.chdir(room)
    server, guard = open_server()
    studio = Page(server, Path())
    studio.lay_out(PANELS)
    studio.panels["Search"].open_run(Path("runs") / run.name)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=list(FLAGS))
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.set_default_timeout(120_000)  # software draws the scene
        page.goto(guard.address)
        page.get_by_text("Follows the hand to").first.wait_for(timeout=60_000)
        page.get_by_role("tab", name="Parts", exact=True).click()
        page.get_by_role("button", name="Choose the parts").click()
        page.get_by_text("its parts fit").first.wait_for(timeout=400_000)
        page.get_by_role("button", name="Download its parts list").wait_for(timeout=200_000)
        studio.time.value = studio.arm.worst
        page.get_by_text("Software WebGL").wait_for(state="hidden")
        page.get_by_text("Received").wait_for(state="hidden")
        page.wait_for_timeout(3000)
        page.screenshot(path=picture)
        browser.close()
    server.stop()


if __name__ == "__main__":
    main()

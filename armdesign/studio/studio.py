"""The studio as a whole: the server, the page with its panels, and what it begins with."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from armdesign.runs.folder import settings_file
from armdesign.studio.arms_panel import ArmsPanel
from armdesign.studio.download_panel import DownloadPanel
from armdesign.studio.page import Page
from armdesign.studio.recording_panel import RecordingPanel
from armdesign.studio.redesign_panel import RedesignPanel
from armdesign.studio.room_panel import RoomPanel
from armdesign.studio.search_panel import SearchPanel
from armdesign.studio.server import open_server
from armdesign.views.preview.server import open_browser

PANELS = {
    "Recording": RecordingPanel, "Room": RoomPanel, "Search": SearchPanel, "Arms": ArmsPanel, "Redesign": RedesignPanel,
    "Parts": DownloadPanel,
}  # fmt: skip
"""In their order on the page."""


def serve(
    given: Path | None, *, port: int | None, browse: bool, say: Callable[[str], None], folder: Path | None = None
) -> None:
    """Serve the studio until Ctrl-C.

    Args:
        given: A recording or a run folder to begin with.
        port: TCP port on 127.0.0.1; a free one by default.
        browse: Whether to open the browser.
        say: Called with sentences for the terminal.
        folder: Where takes, cells and runs are written; by default where the command was given.

    Raises:
        ArmDesignError: What was given cannot be used, viser is missing, or the port cannot be had.
    """
    server, guard = open_server(port)
    try:
        page = Page(server, folder or Path())
        page.lay_out(PANELS)
        if given is not None and (settings_file(given).is_file() or (given / "auto.json").is_file()):
            page.panels["Search"].open_run(given)
        elif given is not None:
            page.panels["Recording"].open_take(given)
        page.begin()
        say(f"The studio is at {guard.address}")
        say("It is for this machine only, and only with this address. End with Ctrl-C; searches go on.")
        if browse:
            open_browser(guard.address, say)
        while True:
            time.sleep(3600.0)
    except KeyboardInterrupt:
        say("")
    finally:
        server.stop()

"""``armdesign preview``: finished runs in the browser, or as one HTML file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from armdesign import views
from armdesign.cli.command_errors import one_sentence_errors, refuse_existing, refuse_without
from armdesign.cli.command_options import option
from armdesign.cli.screen import compiling
from armdesign.errors import RunFolderError, SettingsError
from armdesign.files import write_whole
from armdesign.runs.reading import read_result


@one_sentence_errors
def preview(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN", help="Run folders with a result, shown side by side.")],
    html: Annotated[
        Path | None, option("--html", "FILE", "Write the page to this file, which needs no others, and end.")
    ] = None,
    overwrite: Annotated[bool, option("--overwrite", None, "Replace the file of --html.")] = False,
    browse: Annotated[bool, option("--open/--no-open", None, "Open the page in the browser.")] = True,
    port: Annotated[int | None, option("--port", "N", "Port on 127.0.0.1; default: a free one.")] = None,
    speed: Annotated[float, option("--speed", "X", "Playback speed as a multiple of the real one.")] = 1.0,
    title: Annotated[
        str | None, option("--title", "TEXT", "Title of the page (default: the names of the runs).")
    ] = None,
) -> None:
    """Show arms performing their task in the browser.

    The demonstrator is shown beside them, in MeshCat. Without --html the page is served on 127.0.0.1, for this machine
    only, until Ctrl-C.
    """
    views.preview.check_speed(speed)
    if html is not None:
        if port is not None:
            raise SettingsError("--port is of no use with --html: a file needs no server", fix="Leave one of them out")
        if html.is_dir():
            raise RunFolderError(f"cannot write {html}: it is a folder", value=str(html), fix="Give the name of a file")
        refuse_existing(html, overwrite=overwrite)
        page = draw(runs, speed, title)
        write_whole(html, page)
        typer.echo(f"Written: {html} ({len(page.encode()) / 1e6:.1f} MB)")
        return
    refuse_without("--html", {"--overwrite": overwrite})
    with views.preview.PageServer(port) as server:
        server.show(draw(runs, speed, title), browse=browse, say=typer.echo)


def draw(runs: list[Path], speed: float, title: str | None = None) -> str:
    """The page of run folders.

    Args:
        runs: The folders.
        speed: Times true speed.
        title: What the page is called; the names of the runs by default.
    """
    with compiling(quiet=False):
        finished = [read_result(folder) for folder in runs]
    return views.preview.preview_html(finished, speed, title=title)

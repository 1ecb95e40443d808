"""``armdesign studio``: the way from the take to the arm on one local page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from armdesign.cli.command_errors import one_sentence_errors
from armdesign.cli.command_options import option
from armdesign.studio.studio import serve


@one_sentence_errors
def studio(
    given: Annotated[
        Path | None,
        typer.Argument(
            metavar="[RECORDING|RUN]", show_default=False, help="A recording or a run folder to begin with."
        ),
    ] = None,
    browse: Annotated[bool, option("--open/--no-open", None, "Open the page in the browser.")] = True,
    port: Annotated[int | None, option("--port", "N", "Port on 127.0.0.1; default: a free one.")] = None,
) -> None:
    """Go from a recording to an arm on one page in the browser.

    Take, cell, search, comparison, redesign and downloads. The page is for this machine only and ends with Ctrl-C;
    searches run in processes of their own and go on. All that is done there can be done by the other commands, which
    the page shows.
    """
    serve(given, port=port, browse=browse, say=typer.echo)

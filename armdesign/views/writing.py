"""What people look at after a search: the preview and the report, written beside the result."""

from __future__ import annotations

from pathlib import Path

from armdesign.files import write_whole
from armdesign.search.result import Result
from armdesign.views.preview import preview_html
from armdesign.views.report import report_html


def write_views(folder: str | Path, result: Result, urdf: str | None = None) -> tuple[str, ...]:
    """Write preview.html and report.html of a result, each whole or not at all.

    Args:
        folder: The run folder.
        result: The result.
        urdf: The arm's URDF where it is known, such as a run folder's arm.urdf.

    Returns:
        The names of the files.

    Raises:
        RunFolderError: A file cannot be written.
    """
    pages = {"preview.html": preview_html([result], urdfs=urdf and [urdf]), "report.html": report_html(result)}
    for name, page in pages.items():
        write_whole(Path(folder) / name, page)
    return tuple(pages)

"""What people look at after a search: the preview and the report, written beside the result."""

from __future__ import annotations

from pathlib import Path

from armdesign.files import write_whole
from armdesign.runs.folder import VIEWS
from armdesign.runs.reading import read_finished


def write_views(folder: str | Path) -> tuple[str, ...]:
    """Write preview.html and report.html of a run that has a result, each whole or not at all.

    Args:
        folder: The run folder.

    Returns:
        The names of the files.

    Raises:
        RunFolderError: The folder holds no result, or a file cannot be written.
    """
    from armdesign.views.preview import preview_html  # noqa: PLC0415 (MeshCat)
    from armdesign.views.report import report_html  # noqa: PLC0415 (Matplotlib)

    place = Path(folder)
    run = read_finished(place)
    for name, page in zip(VIEWS, (preview_html([run]), report_html(run)), strict=True):
        write_whole(place / name, page)
    return VIEWS

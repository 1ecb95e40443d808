"""What people look at after a search, the preview and the report, as files or in the browser."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from armdesign.errors import RunFolderError
from armdesign.export.options import RobotOptions
from armdesign.export.robot_file import finished_robot
from armdesign.export.trajectory.simulation import Tracking
from armdesign.export.trajectory.simulation import simulate as simulate_tracking
from armdesign.export.urdf import robot_urdf
from armdesign.files import write_whole
from armdesign.search.result import Result
from armdesign.views.preview import PageServer, preview_html
from armdesign.views.report import print_pdf, report_html


def preview(
    results: Result | Sequence[Result],
    page: str | Path | None = None,
    *,
    speed: float = 1.0,
    overwrite: bool = False,
    browse: bool = True,
    port: int | None = None,
    title: str | None = None,
) -> None:
    """Show arms performing their task beside the demonstrator, in the browser or as one HTML file.

    Args:
        results: The arms, shown side by side.
        page: HTML file to write; without it the page is served on 127.0.0.1, for this machine only, until Ctrl-C.
        speed: Times true speed to play at.
        overwrite: Whether a file of that name is replaced.
        browse: Whether a page that is served is opened in the browser.
        port: Where it is served; a free one by default.
        title: What the page is called; the names of the arms by default.

    Raises:
        RunFolderError: There is a file already, or it cannot be written.
        SettingsError: The speed or the port is none, or there are too many arms.
    """
    shown = [results] if isinstance(results, Result) else list(results)
    if page is None:
        with PageServer(port) as server:
            server.show(preview_html(shown, speed, title=title), browse=browse)
        return
    refuse_existing(Path(page), overwrite=overwrite)
    write_whole(page, preview_html(shown, speed, title=title))


def report(
    result: Result,
    page: str | Path,
    *,
    options: RobotOptions | None = None,
    simulate: bool = False,
    pdf: bool = False,
    overwrite: bool = False,
) -> tuple[Path, ...]:
    """Write the report of a result as one HTML page that needs no network and prints well.

    Args:
        result: The arm, its errors and its search.
        page: HTML file to write.
        options: What the arm is assumed to be built of and to carry.
        simulate: Whether to add how the arm follows the hand in MuJoCo.
        pdf: Whether to print it as PDF beside the page, too.
        overwrite: Whether files of these names are replaced.

    Returns:
        What was written: the page, then the PDF.

    Raises:
        RunFolderError: A file is there already, or cannot be written.
        MissingExtraError: MuJoCo is not installed.
        ArmDesignError: There is no browser to print with.
    """
    targets = (Path(page), Path(page).with_suffix(".pdf"))[: 2 if pdf else 1]
    for target in targets:
        refuse_existing(target, overwrite=overwrite)
    html = report_html(result, options=options, tracking=simulated(result, options) if simulate else None)
    write_whole(targets[0], html)
    if pdf:
        print_pdf(html, targets[1])
    return targets


def simulated(result: Result, options: RobotOptions | None = None) -> Tracking:
    """The exported arm on its trajectory in a physics simulation.

    Args:
        result: The arm with its motion.
        options: What the arm is assumed to be built of and to carry.

    Raises:
        MissingExtraError: MuJoCo is not installed.
    """
    return simulate_tracking(result, urdf=robot_urdf(finished_robot(result, options)))


def refuse_existing(target: Path, *, overwrite: bool) -> None:
    """Turn away an output that is there already.

    Args:
        target: The file.
        overwrite: Whether it may be replaced.

    Raises:
        RunFolderError: It exists and may not be replaced.
    """
    if target.exists() and not overwrite:
        fix = "Give another name, or overwrite=True to replace it"
        raise RunFolderError(f"{target} is there already", value=str(target), fix=fix)


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

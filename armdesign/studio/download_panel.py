"""Panel 6, download: the report, robot files, the trajectory and the parts as downloads, and as commands."""

from __future__ import annotations

import csv
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import replace
from html import escape
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

from armdesign.building.build import Build, BuildOptions, build
from armdesign.building.catalogue import find_catalogue, shipped
from armdesign.building.part_lists import BILL, part_lists
from armdesign.building.snapping import room_of_parts
from armdesign.errors import ArmDesignError, CatalogueError, SettingsError
from armdesign.export.export_files import export
from armdesign.export.formats import FORMATS
from armdesign.export.trajectory.exporting import FILES
from armdesign.feasibility.words import pace
from armdesign.runs.folder import RESULT
from armdesign.search.result import Result
from armdesign.studio.arms import verdict_lines
from armdesign.studio.commands import shown
from armdesign.studio.page import Page, command_html, link
from armdesign.views.report import report_html

WAITING = "Search an arm first; here are its parts list, report and files."
NAMES = {
    "urdf": "URDF (most tools)", "xacro": "xacro (ROS)", "mjcf": "MJCF (MuJoCo)", "sdf": "SDF (Gazebo)",
    "srdf": "SRDF (MoveIt)", "moveit": "MoveIt settings", "controllers": "ros2_control", "dh-csv": "DH table, CSV",
    "dh-toml": "DH table, TOML",
}  # fmt: skip


def packed(files: dict[str, bytes], archive_name: str) -> tuple[str, bytes]:
    """A download of files: one as it is, several as a ZIP archive.

    Args:
        files: Content by name.
        archive_name: What an archive is called.

    Returns:
        Name and content.
    """
    if len(files) == 1:
        return next(iter(files.items()))
    buffer = BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return archive_name, buffer.getvalue()


def robot_downloads(result: Result, kind: str) -> dict[str, bytes]:
    """Robot files or trajectory of a result by their names.

    Args:
        result: The arm.
        kind: One of the formats of ``armdesign export``, or a kind of trajectory.
    """
    with tempfile.TemporaryDirectory() as place:
        if kind in FORMATS:
            export(result, place, (kind,))
        else:
            export(result, place, (), (kind,))
        folder = Path(place)
        return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def families() -> tuple[str, ...]:
    """The families of motors with their makers."""
    return tuple(f"{name} ({find_catalogue(name).maker})" for name in shipped())


def best_build(result: Result, options: BuildOptions) -> Build:
    """An arm built with brackets that are sold, or with printed ones where only that does the task, or does it better.

    Args:
        result: The arm.
        options: What it is built of.

    Raises:
        CatalogueError: Neither can be.
    """
    found: list[Build] = []
    for printed in (False, True):
        try:
            made = build(result, replace(options, printed=printed))
        except CatalogueError:
            if printed and not found:
                raise
            continue
        if not made.fault:
            return made
        found.append(made)
    return min(found, key=lambda made: (-made.fits, made.result.verdict.hand_error.max))


def built_html(made: Build, bill: str) -> str:
    """What an arm of parts does, and the parts.

    Args:
        made: The arm.
        bill: Its bill of materials, as CSV.
    """
    result = made.result
    _, lines = verdict_lines(result.verdict, result.problem.settings, result.base_pose)
    lines = [lines[0], f"It moves at {pace(made.speed)}.", f"What moves weighs {result.body.moving_mass:.1f} kg."]
    if made.options.printed:
        lines.append("Its brackets are printed: with those that are sold it does the task worse, or not at all.")
    mark = "bad" if result.verdict.tolerance_met is False else "good"
    said = "".join(f"<li{'' if k else f' class={mark}'}>{escape(line)}</li>" for k, line in enumerate(lines))
    if made.fault:
        said = f"<li class=bad><b>{escape(made.warning)}.</b></li>{said}"
    rows = [row for row in csv.reader(StringIO(bill)) if row][1:-1]
    cells = "".join(f"<tr><th>{escape(row[0])}</th><td>{escape(row[1])} {escape(row[2])}</td></tr>" for row in rows)
    return f"<b>As it is built</b><ul>{said}</ul><table>{cells}</table>"


class DownloadPanel:
    """Downloads."""

    def __init__(self, page: Page) -> None:
        """Lay out the panel."""
        self.page, gui = page, page.gui
        self.result: Result | None = None
        self.run: Path | None = None
        self.note = page.html(WAITING)
        with gui.add_folder("What it is built of", visible=False) as parts:
            self.family = gui.add_dropdown("Motors", families())
            self.parts = gui.add_button("Parts list and cut list")
            self.built = page.html("")
            self.again = gui.add_button("Search again with room for these motors", visible=False)
        with gui.add_folder("Report", visible=False) as reading:
            self.report = gui.add_button("Report (HTML)")
        with gui.add_folder("For simulators and controllers", visible=False) as tools:
            self.format = gui.add_dropdown("Robot file", tuple(NAMES[kind] for kind in FORMATS))
            self.robot = gui.add_button("Download the robot file")
            self.motion = gui.add_dropdown("Motion", tuple(kind for kind in FILES if kind != "ros2-bag"))
            self.trajectory = gui.add_button("Download the motion")
        self.folders = (parts, reading, tools)
        self.room: dict[str, float] = {}  # that the parts take
        self.again.on_click(lambda _: page.work("start", self.search_again))
        self.command = page.html("")
        jobs: list[tuple[Any, str, Callable[[Result], dict[str, bytes]]]] = [
            (self.report, "", lambda result: {"report.html": report_html(result).encode()}),
            (self.robot, "robot.zip", lambda result: robot_downloads(result, self.kind)),
            (self.trajectory, "motion.zip", lambda result: robot_downloads(result, self.motion.value)),
            (self.parts, "parts.zip", self.part_files),
        ]
        for button, name, job in jobs:
            button.on_click(
                lambda event, name=name, job=job: page.slow(
                    "out", lambda: self.send(event.target, event.client, name, job)
                )
            )
        for handle in (self.format, self.motion, self.family):
            handle.on_update(lambda _: page.work("out", self.show_command))

    def forget(self) -> None:
        """There is no arm any more."""
        self.result, self.run = None, None
        for folder in self.folders:
            folder.visible = False
        self.page.set_html(self.note, WAITING)
        self.page.set_html(self.command, "")

    @property
    def kind(self) -> str:
        """The format of the robot file."""
        return next(kind for kind, name in NAMES.items() if name == self.format.value)

    def begin(self, result: Result, run: Path) -> None:
        """An arm to take home."""
        self.result, self.run = result, run
        for folder in self.folders:
            folder.visible = True
        self.page.set_html(self.built, "")
        self.again.visible = False
        where = f"All of it lies in <b>{escape(str(run))}</b>, too." if (run / RESULT).is_file() else "The best so far."
        self.page.set_html(self.note, f"<h4>{escape(result.name)}</h4>{where}")
        self.show_command()

    def show_command(self) -> None:
        """Show the downloads as one would type them."""
        if self.run is None or not (self.run / RESULT).is_file():
            return
        lines = [
            shown(["report", self.run]),
            shown(["export", self.run, "--format", self.kind, "--out", "robot"]),
            shown(["export", self.run, "--trajectory", self.motion.value, "--out", "robot"]),
            shown(["build", self.run, "--catalogue", self.family.value.split()[0]]),
        ]
        self.page.set_html(self.command, command_html(*lines))

    def send(self, button: Any, client: Any, name: str, job: Callable[[Result], dict[str, bytes]]) -> None:  # noqa: ANN401
        """Make files and send them to who asked.

        Args:
            button: What was pressed; it says meanwhile that it is at work.
            client: viser's handle of who asked.
            name: What an archive of them is called.
            job: What makes them.

        Raises:
            ArmDesignError: They cannot be made.
        """
        if self.result is None:
            raise SettingsError("there is no arm yet", fix="Search one first")
        label = button.label
        button.label, button.disabled = "Working ...", True
        try:
            file, content = packed(job(self.result), name)
        finally:
            button.label, button.disabled = label, False
        client.send_file_download(file, content, save_immediately=True)

    def part_files(self, result: Result) -> dict[str, bytes]:
        """Bill of materials and cut list, which are shown on the page, too."""
        self.again.visible = False
        try:
            made = best_build(result, BuildOptions(self.family.value.split()[0], speed="auto"))
        except ArmDesignError as error:
            self.page.set_html(self.built, f'<b class="bad">{escape(str(error))}</b>')
            raise
        lists = part_lists(made)
        self.page.set_html(self.built, built_html(made, lists[BILL]))
        self.room = room_of_parts(made.result.problem.settings.body)
        self.again.visible = bool(made.fault)
        return {name: text.encode() for name, text in lists.items()}

    def search_again(self) -> None:
        """Search an arm whose joints are as large as these motors.

        Raises:
            ArmDesignError: The recording is gone.
        """
        self.page.settings = self.page.settings.replace({"body": self.room})
        self.page.panels["Search"].begin()
        see = link("Search", "see how far it is")
        words = f"Searching again, with room for these motors: {see}. The arm before stays under Earlier runs."
        self.page.set_html(self.note, words)

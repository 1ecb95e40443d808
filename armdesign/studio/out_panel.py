"""Panel 6, out: the report, robot files, the trajectory and the parts as downloads, and as commands."""

from __future__ import annotations

import tempfile
import zipfile
from collections.abc import Callable
from html import escape
from io import BytesIO
from pathlib import Path
from typing import Any

from armdesign.building.build import BuildOptions, build
from armdesign.building.catalogue import shipped
from armdesign.building.part_lists import part_lists
from armdesign.errors import SettingsError
from armdesign.export.export_files import export
from armdesign.export.formats import FORMATS
from armdesign.export.trajectory.exporting import FILES
from armdesign.search.result import Result
from armdesign.studio.commands import shown
from armdesign.studio.page import Page
from armdesign.views.report import report_html

NAMES = {
    "urdf": "URDF (most tools)", "xacro": "xacro (ROS)", "mjcf": "MJCF (MuJoCo)", "sdf": "SDF (Gazebo)",
    "srdf": "SRDF (MoveIt)", "moveit": "MoveIt settings", "controllers": "ros2_control", "dh-csv": "DH table, CSV",
    "dh-toml": "DH table, TOML",
}  # fmt: skip


def packed(files: dict[str, bytes]) -> tuple[str, bytes]:
    """A download of files: one as it is, several as a ZIP archive.

    Args:
        files: Content by name.

    Returns:
        Name and content; the name of an archive is ``arm.zip``.
    """
    if len(files) == 1:
        return next(iter(files.items()))
    buffer = BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return "arm.zip", buffer.getvalue()


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


class OutPanel:
    """Downloads."""

    def __init__(self, page: Page) -> None:
        """Lay out the panel."""
        self.page, gui = page, page.gui
        self.result: Result | None = None
        self.run: Path | None = None
        self.note = page.html("Search an arm first; here it is taken home.")
        self.report = gui.add_button("Report (HTML)")
        self.format = gui.add_dropdown("Robot file", tuple(NAMES[kind] for kind in FORMATS))
        self.robot = gui.add_button("Download the robot file")
        self.motion = gui.add_dropdown("Trajectory", tuple(kind for kind in FILES if kind != "ros2-bag"))
        self.trajectory = gui.add_button("Download the trajectory")
        self.family = gui.add_dropdown("Actuators", tuple(shipped()))
        self.parts = gui.add_button("Parts and cut list")
        self.command = page.html("")
        jobs: list[tuple[Any, Callable[[Result], dict[str, bytes]]]] = [
            (self.report, lambda result: {"report.html": report_html(result).encode()}),
            (self.robot, lambda result: robot_downloads(result, self.kind)),
            (self.trajectory, lambda result: robot_downloads(result, self.motion.value)),
            (self.parts, self.part_files),
        ]
        for button, job in jobs:
            button.on_click(lambda event, job=job: page.slow("out", lambda: self.send(event.client, job)))
        for handle in (self.format, self.motion, self.family):
            handle.on_update(lambda _: page.work("out", self.show_command))

    @property
    def kind(self) -> str:
        """The format of the robot file."""
        return next(kind for kind, name in NAMES.items() if name == self.format.value)

    def begin(self, result: Result, run: Path) -> None:
        """An arm to take home."""
        self.result, self.run = result, run
        self.page.set_html(
            self.note, f"<h4>{escape(result.name)}</h4>All of it lies in <b>{escape(str(run))}</b>, too."
        )
        self.show_command()

    def show_command(self) -> None:
        """Show the downloads as one would type them."""
        if self.run is None:
            return
        lines = [
            shown(["report", self.run]),
            shown(["export", self.run, "--format", self.kind, "--out", "robot"]),
            shown(["export", self.run, "--trajectory", self.motion.value, "--out", "robot"]),
            shown(["build", self.run, "--catalogue", self.family.value]),
        ]
        self.page.set_html(self.command, f"The same on the command line:<code>{'<br>'.join(map(escape, lines))}</code>")

    def send(self, client: Any, job: Callable[[Result], dict[str, bytes]]) -> None:  # noqa: ANN401 (viser's client)
        """Make files and send them to who asked.

        Args:
            client: Who.
            job: What makes them.

        Raises:
            ArmDesignError: They cannot be made.
        """
        if self.result is None:
            raise SettingsError("there is no arm yet", fix="Search one first")
        name, content = packed(job(self.result))
        client.send_file_download(name, content, save_immediately=True)

    def part_files(self, result: Result) -> dict[str, bytes]:
        """Bill of materials and cut list."""
        made = build(result, BuildOptions(self.family.value, speed="auto"))
        return {name: text.encode() for name, text in part_lists(made).items()}

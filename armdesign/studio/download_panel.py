"""Panel 6, download: the report, robot files, the trajectory and the parts as downloads, and as commands."""

from __future__ import annotations

import csv
import tempfile
import zipfile
from collections.abc import Callable
from html import escape
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

from armdesign.building.assembly_steps import ASSEMBLY, assembly_page
from armdesign.building.build import Build, BuildOptions
from armdesign.building.part_lists import BILL, part_lists
from armdesign.building.room import room_of_parts
from armdesign.errors import ArmDesignError, SettingsError
from armdesign.export.export_files import export
from armdesign.export.formats import FORMATS
from armdesign.export.trajectory.exporting import FILES
from armdesign.feasibility.words import hand_words, pace, sentence
from armdesign.runs.folder import RESULT
from armdesign.search.result import Result
from armdesign.studio.arms import design_arm
from armdesign.studio.commands import shown
from armdesign.studio.motors import best_build, families, family_of
from armdesign.studio.page import Page, command_html, link
from armdesign.studio.scene import COLOURS
from armdesign.views.report import report_html

WAITING = "Search an arm first; here its parts are chosen, and there are lists, report and files."
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


GROUPS = {
    "bought": "To be bought", "cut": "Tubes to be cut", "made": "To be made", "printed": "To be printed",
    "screws": "Screws and nuts", "not chosen": "Still to be chosen",
}  # fmt: skip
"""How one comes by parts, by the words of the bill of materials."""


def built_html(made: Build, bill: str) -> str:
    """What an arm of parts does, and the parts.

    Args:
        made: The arm.
        bill: Its bill of materials, as CSV.
    """
    result = made.result
    how = "are printed, each for its angle" if made.options.printed else "are made of aluminium, of 0 and 90 degrees"
    lines = [
        f"{sentence(hand_words(result.verdict))}.",
        f"It moves at {pace(made.speed)}.",
        f"What moves weighs {result.body.moving_mass:.1f} kg.",
    ]
    lines += [] if made.kit else [f"Its brackets {how}."]
    said = "".join(f"<li>{escape(line)}</li>" for line in lines)
    if made.fault:
        said = f"<li class=bad><b>{escape(made.warning)}.</b></li>{said}"
    cells, last = "", ""
    for row in csv.DictReader(StringIO(bill)):
        if row["part"] == "sum" or row["quantity"] == "0":  # a warning has none
            continue
        group = GROUPS[row["group"]]
        cells += f'<tr><th colspan="2">{group}</th></tr>' if group != last else ""
        part, count = row["part"].removeprefix("not chosen: "), f"{row['quantity']} {row['unit'].replace('piece', '')}"
        cells, last = f"{cells}<tr><td>{escape(part)}</td><td>{count}</td></tr>", group
    return f'<b>As it is built</b><ul>{said}</ul><table class="parts">{cells}</table>'


class DownloadPanel:
    """Downloads."""

    def __init__(self, page: Page) -> None:
        """Lay out the panel."""
        self.page, gui = page, page.gui
        self.result: Result | None = None
        self.run: Path | None = None
        self.note = page.html(WAITING)
        self.made: Build | None = None
        with gui.add_folder("What it is built of", visible=False) as parts:
            self.family = gui.add_dropdown("Motors", families())
            self.parts = gui.add_button("Choose the parts (a minute), then download the lists", color="green")
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
        self.again.on_click(lambda _: page.work("start", self.search_again))
        self.command = page.html("")
        jobs: list[tuple[Any, str, Callable[[Result], dict[str, bytes]]]] = [
            (self.report, "", lambda result: {"report.html": report_html(result).encode()}),
            (self.robot, "robot.zip", lambda result: robot_downloads(result, self.kind)),
            (self.trajectory, "motion.zip", lambda result: robot_downloads(result, self.motion.value)),
            (self.parts, "parts.zip", self.part_files),
        ]
        for button, name, job in jobs:
            button.on_click(lambda event, name=name, job=job: page.slow("out", lambda: self.send(event, name, job)))
        for handle in (self.format, self.motion, self.family):
            handle.on_update(lambda _: page.work("out", self.show_command))

    def forget(self) -> None:
        """There is no arm any more."""
        self.result, self.run, self.made = None, None, None
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
        self.result, self.run, self.made = result, run, None
        self.family.value = self.page.panels["Room"].motors.value
        for folder in self.folders:
            folder.visible = True
        self.page.set_html(self.built, "")
        self.again.visible = False
        where = f"Its search lies in <b>{escape(str(run))}</b>." if (run / RESULT).is_file() else "The best so far."
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
            shown(["build", self.run, "--catalogue", family_of(self.family.value)]),
        ]
        self.page.set_html(self.command, command_html(*lines))

    def send(self, event: Any, name: str, job: Callable[[Result], dict[str, bytes]]) -> None:  # noqa: ANN401 (viser's)
        """Make files of the arm, as it is built once that is known, and send them to who asked.

        Args:
            event: The button, which says meanwhile that it is at work, and who has pressed it.
            name: What an archive of them is called.
            job: What makes them.

        Raises:
            ArmDesignError: They cannot be made.
        """
        if self.result is None:
            raise SettingsError("there is no arm yet", fix="Search one first")
        button, label = event.target, event.target.label
        button.label, button.disabled = "Working: the download comes by itself ...", True
        try:
            file, content = packed(job(self.result if self.made is None else self.made.result), name)
        finally:
            button.label, button.disabled = label, False
        event.client.send_file_download(file, content, save_immediately=True)

    def part_files(self, _: Result) -> dict[str, bytes]:
        """Bill of materials, cut list and assembly steps; what is bought and made is shown on the page, too."""
        self.again.visible = False
        result = self.result
        try:
            if result is None:
                raise SettingsError("there is no arm any more", fix="Search one first")
            made = best_build(result, BuildOptions(family_of(self.family.value), speed="auto"))
        except ArmDesignError as error:
            self.page.set_html(self.built, f'<b class="bad">{escape(str(error))}</b>')
            raise
        files = part_lists(made)
        self.page.set_html(self.built, built_html(made, files[BILL]))
        if made.assembly is not None:
            files[ASSEMBLY] = assembly_page(made)
        if made.fault:
            files["DO NOT ORDER.txt"] = f"{made.warning}.\n{made.remedy(self.run or 'RUN')}\n"
        self.again.visible = bool(made.fault)
        self.page.work("built", lambda: self.show_built(made, result))
        return {name: text.encode() for name, text in files.items()}

    def show_built(self, made: Build, result: Result) -> None:
        """Show the arm as it is built, in the scene and in the headline, unless another is there by now.

        Args:
            made: The arm.
            result: What it was built after.
        """
        if self.result is result:
            self.made = made
            self.page.show_arms((design_arm(made.result, f"{result.name}, as it is built"), COLOURS[0]))

    def search_again(self) -> None:
        """Search an arm whose joints are as large as these motors.

        Raises:
            ArmDesignError: The recording is gone.
        """
        if self.made is not None:
            room = self.page.panels["Room"]
            room.motors.value = self.family.value
            room.room = (self.family.value, room_of_parts(self.made.result.problem.settings.body))
        self.page.panels["Search"].begin()
        see = link("Search", "see how far it is")
        words = f"Searching again, with room for these motors: {see}. The arm before stays under Earlier runs."
        self.page.set_html(self.note, words)

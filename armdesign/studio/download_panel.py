"""Panel 6, download: the report, robot files, the trajectory and the parts as downloads, and as commands."""

from __future__ import annotations

import tempfile
import zipfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from html import escape
from io import BytesIO
from pathlib import Path
from typing import Any

from armdesign.building import RECORD
from armdesign.building.assembly_steps import ASSEMBLY, assembly_page
from armdesign.building.build import Build
from armdesign.building.build_files import drawings, step_files, stl_files
from armdesign.building.build_options import BuildOptions
from armdesign.building.part_lists import grouped_bill, part_lists
from armdesign.building.record import build_record, recorded_build
from armdesign.building.room import leaves_room, room_of_parts
from armdesign.errors import ArmDesignError, CatalogueError, MissingExtraError, SettingsError
from armdesign.export.export_files import export
from armdesign.export.formats import FORMATS
from armdesign.export.trajectory.exporting import FILES
from armdesign.feasibility.words import base_words, hand_words, pace, sentence
from armdesign.runs.folder import RESULT
from armdesign.runs.reading import read_result
from armdesign.runs.writing import write_files, write_result
from armdesign.search.result import Result
from armdesign.studio.arms import BUILT, Arm, built_arm, design_arm, millimetres
from armdesign.studio.arms_panel import CancelledError
from armdesign.studio.commands import shown
from armdesign.studio.motors import arms_at_hand, buildable, families, family_of
from armdesign.studio.page import Page, bad, command_html, link
from armdesign.views.report import report_html

WAITING = "Search an arm first; here its parts are chosen, and there are lists, report and files."
FAULT, NOT_TO_BE_MADE = "DO NOT ORDER.txt", "parts-NOT-TO-BE-MADE.zip"
ROOM, SEED = "Search again with room for these motors", "Search again, for another arm"
MOST_JOINTS = 8
"""Joints of an arm that can be searched on the page."""
NAMES = {
    "urdf": "URDF (most tools)", "xacro": "xacro (ROS)", "mjcf": "MJCF (MuJoCo)", "sdf": "SDF (Gazebo)",
    "srdf": "SRDF (MoveIt)", "moveit": "MoveIt settings", "controllers": "ros2_control", "dh-csv": "DH table, CSV",
    "dh-toml": "DH table, TOML",
}  # fmt: skip


def packed(files: dict[str, bytes], archive_name: str, stem: str) -> tuple[str, bytes]:
    """A download of files: one as it is, several as a ZIP archive.

    Args:
        files: Content by name.
        archive_name: What an archive is called.
        stem: What either name begins with: which arm it is of.

    Returns:
        Name and content.
    """
    if len(files) == 1:
        ((name, content),) = files.items()
        return f"{stem}-{name}", content
    buffer = BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return f"{stem}-{archive_name}", buffer.getvalue()


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


def built_html(made: Build) -> str:
    """What an arm of parts does, and the parts."""
    result = made.result
    how = "are printed, each for its angle" if made.options.printed else "are made of aluminium, of 0 and 90 degrees"
    lines = [
        f"{sentence(hand_words(result.verdict))}.",
        f"It moves at {pace(made.speed)} of the demonstrated speed.",
        f"What moves weighs {result.body.moving_mass:.1f} kg.",
    ]
    lines += [base_words(result.base_pose)] if result.placed else []
    lines += [] if made.kit else [f"Its brackets {how}."]
    if made.assembly is not None and any(each.maker for each in made.assembly.screws):
        lines.append("Where a motor is bolted on they are not drilled: its maker's drawing says how.")
    said = "".join(f"<li>{escape(line)}</li>" for line in lines)
    if made.fault:
        said = f"<li class=bad><b>{escape(made.warning)}.</b></li>{said}"
    cells = '<tr><th colspan="2">Motors by joint</th></tr>'
    for k, motor in enumerate(made.choice.actuators, start=1):
        cells += f"<tr><td>Joint {k}</td><td>{escape(motor.name)}</td></tr>"
    known, unknown = 0.0, 0
    for title, group in grouped_bill(made).items():
        cells += f'<tr><th colspan="2">{title}</th></tr>'
        for line in group:
            price = "" if line.price is None else f", {line.price:,.0f} {escape(made.currency)}"
            known, unknown = known + (line.price or 0.0), unknown + (line.price is None)
            cells += f"<tr><td>{escape(line.part)}</td><td>{line.quantity:g} {line.unit}{price}</td></tr>"
    price = f"{known:,.0f} {made.currency} in all for the lines with a price; {unknown} have none" if known else ""
    said += f"<li>{escape(price or 'No prices are known')}.</li>"
    table = f'<table class="parts">{cells}</table>'
    if made.fault:
        table = f"<details><summary>Its parts, not to be ordered</summary>{table}</details>"
    return f"<b>As it is built</b><ul>{said}</ul>{table}"


def all_files(made: Build, run: Path, told: Callable[[str], None]) -> dict[str, bytes]:
    """All that an arm is made by: lists, assembly steps, drawings, and solids where Open CASCADE is there.

    Of one that is not to be made there are no drawings and solids, but what is wrong with it.

    Args:
        made: The arm.
        run: The folder of its search.
        told: Called with what is made next.
    """
    told("lists and steps, 1 of 4")
    files: dict[str, str | bytes] = dict(part_lists(made))
    if made.assembly is not None:
        files[ASSEMBLY] = assembly_page(made)
    if made.fault:
        files[FAULT] = f"{made.warning}.\n{made.remedy(run)}\n"
    elif made.assembly is not None:
        told("drawings, 2 of 4")
        files |= {name: sheets for name, sheets in drawings(made).items() if name.endswith(".pdf")}
        with suppress(MissingExtraError):
            told("STL, 3 of 4")
            files |= stl_files(made)
            told("STEP, 4 of 4")
            files |= step_files(made)
    return {name: text if isinstance(text, bytes) else text.encode() for name, text in files.items()}


def ways_on(arm: Arm, *, refused: bool = False) -> list[str]:
    """What to do about an arm that cannot be built or does not do its task, best first; nothing where it can.

    Args:
        arm: A design, or an arm as it is built.
        refused: Whether nothing can be built after the design, not even with a fault.
    """
    result, made = arm.design or arm.result, arm.built
    if result is None or not (refused or (made.fault if made else not result.verdict.passed)):
        return []
    more = [f"Search an arm of {arm.joints + 1} joints"] if arm.joints < MOST_JOINTS else []
    if refused or made is None:
        return [*more, SEED] if refused else more
    left = made.kit or leaves_room(result.problem.settings.body, made.result.problem.settings.body)
    return [*more, SEED] if left else [ROOM, *more]


class DownloadPanel:
    """Downloads."""

    def __init__(self, page: Page) -> None:
        """Lay out the panel."""
        self.page, gui = page, page.gui
        self.arm: Arm | None = None
        self.run: Path | None = None
        self.ways: list[str] = []
        self.kept: Build | None = None  # what lies in the build's folder
        self.cancelled = False
        self.note = page.html(WAITING)
        self.doubt = page.html("", visible=False)
        with gui.add_folder("What it is built of", visible=False) as parts:
            self.family = gui.add_dropdown("Motors", families())
            self.parts = gui.add_button("", color="green")
            self.halt = gui.add_button("Cancel", visible=False)
            self.again = gui.add_button("", visible=False)
            self.built = page.html("")
        with gui.add_folder("Report", visible=False) as reading:
            self.report = gui.add_button("Report (HTML)")
        with gui.add_folder("For simulators and controllers", visible=False) as tools:
            self.format = gui.add_dropdown("Robot file", tuple(NAMES[kind] for kind in FORMATS))
            self.robot = gui.add_button("Download the robot file")
            self.motion = gui.add_dropdown("Motion", tuple(kind for kind in FILES if kind != "ros2-bag"))
            self.trajectory = gui.add_button("Download the motion")
        self.folders = (parts, reading, tools)
        self.halt.on_click(lambda _: setattr(self, "cancelled", True))
        self.again.on_click(lambda _: page.work("start", lambda: self.go(1)))
        self.command = page.html("")
        jobs: list[tuple[Any, str, Callable[[Result], dict[str, bytes]]]] = [
            (self.report, "", self.report_page),
            (self.robot, "robot.zip", lambda result: robot_downloads(result, self.kind)),
            (self.trajectory, "motion.zip", lambda result: robot_downloads(result, self.motion.value)),
            (self.parts, "parts.zip", self.part_files),
        ]
        for button, name, job in jobs:
            button.on_click(lambda event, name=name, job=job: page.work("ask", lambda: self.ask(event, name, job)))
        for handle in (self.format, self.motion, self.family):
            handle.on_update(lambda _: page.work("out", self.show_choice))

    def forget(self) -> None:
        """There is no arm any more."""
        self.arm, self.run, self.ways, self.doubt.visible = None, None, [], False
        for folder in self.folders:
            folder.visible = False
        self.page.set_html(self.note, WAITING)
        self.page.set_html(self.command, "")

    @property
    def kind(self) -> str:
        """The format of the robot file."""
        return next(kind for kind, name in NAMES.items() if name == self.format.value)

    @property
    def place(self) -> Path:
        """The run folder of what is built after the arm of a search."""
        return self.page.folder / "build" / (self.run or Path("arm")).name

    def begin(self, arm: Arm, run: Path) -> None:
        """An arm to take home.

        Args:
            arm: It, as it is built where its parts are chosen.
            run: The folder of its search.
        """
        if run != self.run:
            self.family.value = self.page.panels["Room"].motors.value
        self.arm, self.run = arm, run
        if arm.built is not None and arm.built is not self.kept:
            self.keep(arm.built, arm.design)
        self.offer(arm, ways_on(arm))
        if arm.built is not None:
            known = {family_of(words): words for words in families()}  # but a file of somebody's own
            self.family.value = known.get(arm.built.options.catalogue, self.family.value)
        self.page.set_html(self.built, "" if arm.built is None else built_html(arm.built))
        where = f"Its search lies in <b>{escape(str(run))}</b>" if (run / RESULT).is_file() else "The best so far"
        where += "." if arm.built is None else f", and what is chosen in <b>{escape(str(self.place))}</b>."
        self.page.set_html(self.note, f"<h4>Arm: {escape(arm.name)}</h4>{where}")
        self.show_choice()
        for folder in self.folders:
            folder.visible = True

    def offer(self, arm: Arm, ways: list[str]) -> None:
        """Offer what helps an arm, the first below the headline, unless another is chosen by now.

        Args:
            arm: The arm.
            ways: As of ``ways_on``.
        """
        if arm is self.arm:
            self.ways, self.again.visible = ways, len(ways) > 1
            self.again.label = ways[-1] if ways else ""
            self.page.say_next()

    def fitting(self) -> Build | None:
        """The build that is shown, where it is of the motors that are chosen."""
        made = None if self.arm is None else self.arm.built
        return made if made is not None and made.options.catalogue == family_of(self.family.value) else None

    def show_choice(self) -> None:
        """Show what the button for parts does, and the downloads as one would type them."""
        redesign, doubt = self.page.panels["Redesign"], ""
        changed = self.arm is not None and self.page.arm is not None and self.page.arm is redesign.changed
        if changed:
            doubt = "The arm shown is changed by hand, and its parts are not chosen yet. What you ask for here is made "
            doubt += f"for it: {link('Redesign', 'or go back')}."
        elif self.arm is not None and self.page.arm is not self.arm:
            doubt = f"This is of {escape(self.arm.name)}, not of the arm shown: {link('Arms', 'choose another')}."
        elif self.arm is not None and (doubt := self.page.panels["Search"].changed()):
            doubt += f". What is here is for what was asked before: {link('Search', 'search again')}."
        self.page.set_html(self.doubt, f'<b class="bad">{doubt}</b>')
        self.doubt.visible = bool(doubt)
        for handle in (self.note, self.built, self.command):
            handle.visible = not changed
        self.parts.color = "gray" if doubt and not changed else "green"
        if self.parts.disabled:  # at work
            pass
        elif changed:
            self.parts.label = "Choose the parts of the arm as changed (a minute), then download all files"
        elif self.fitting() is None:
            self.parts.label = "Choose the parts (a minute), then download all files"
        else:
            self.parts.label = "Download its parts list, drawings and steps"
        if self.run is None or self.arm is None or not (self.run / RESULT).is_file():
            return
        place = self.run if self.arm.built is None else self.place
        lines = [
            shown(["build", self.run, "--catalogue", family_of(self.family.value), "--printed", "--speed", "auto"]),
            shown(["report", place]),
            shown(["export", place, "--format", self.kind, "--out", "robot"]),
            shown(["export", place, "--trajectory", self.motion.value, "--out", "robot"]),
        ]
        self.page.set_html(self.command, command_html(*lines))

    def ask(self, event: Any, name: str, job: Callable[[Result], dict[str, bytes]]) -> None:  # noqa: ANN401 (viser's)
        """Have files made, of the arm as it is changed where that is shown; arguments as of ``send``."""
        if self.page.arm is self.page.panels["Redesign"].changed:
            self.page.panels["Redesign"].keep()
        self.page.slow("out", lambda: self.send(event, name, job))

    def send(self, event: Any, name: str, job: Callable[[Result], dict[str, bytes]]) -> None:  # noqa: ANN401 (viser's)
        """Make files of the arm, as it is built once that is known, and send them to who asked.

        Args:
            event: The button, which says meanwhile that it is at work, and who has pressed it.
            name: What an archive of them is called.
            job: What makes them.

        Raises:
            ArmDesignError: They cannot be made.
        """
        if self.arm is None or self.arm.result is None:
            raise SettingsError("there is no arm yet", fix="Search one first")
        button, label = event.target, event.target.label
        button.label, button.disabled = "Working: the download comes by itself ...", True
        try:
            files = job(self.arm.result)
        finally:
            button.label, button.disabled = label, False
            self.page.work("out", self.show_choice)
        arm, run = self.arm.result, "arm" if self.run is None else self.run.name
        stem = f"{run}-{self.arm.joints}-joints-{arm.problem.settings.needs.payload:g}-kg"
        file, content = packed(files, NOT_TO_BE_MADE if FAULT in files else name, stem)
        event.client.send_file_download(file, content, save_immediately=True)

    def keep(self, made: Build, design: Result | None) -> None:
        """Write what is built into its folder, which the commands name.

        Args:
            made: What is built.
            design: The arm that it is built after.
        """
        write_result(self.place, made.result)
        write_files(self.place, {**part_lists(made), RECORD: build_record(made, design)})
        self.kept = made

    def report_page(self, result: Result) -> dict[str, bytes]:
        """The report as ``armdesign report`` writes it, of an arm as it is built that of its folder.

        Args:
            result: The arm.
        """
        built = self.arm is not None and self.arm.built is not None
        return {"report.html": report_html(read_result(self.place) if built else result).encode()}

    def say(self, what: str) -> None:
        """Say which of the files are made."""
        self.parts.label = f"Working: {what} ..."

    def part_files(self, result: Result) -> dict[str, bytes]:
        """All that the arm is made by; its parts are chosen where they are not yet, and shown and kept.

        Args:
            result: The arm.

        Raises:
            ArmDesignError: It cannot be built of these motors, or somebody does not want to wait.
        """
        arm, made, run = self.arm, self.fitting(), self.run
        if arm is None or run is None:
            raise SettingsError("there is no arm any more", fix="Search one first")
        if made is not None:
            return all_files(made, run, self.say)
        arms = arms_at_hand(arm.design or result)
        self.cancelled, self.halt.visible = False, True

        def told(rank: int, how: str) -> None:
            if self.cancelled:
                raise CancelledError("the choice of parts was cancelled")
            counted = f"{('1st', '2nd', '3rd', '4th')[rank - 1]} arm of {len(arms)}" if len(arms) > 1 else "The arm"
            self.page.set_html(self.built, f"{counted}, {how} ...")

        try:
            rank, made, why = buildable(arms, BuildOptions(family_of(self.family.value), speed="auto"), told)
        except ArmDesignError as error:
            self.page.set_html(self.built, bad(error))
            if isinstance(error, CatalogueError):
                self.page.work("built", lambda: self.offer(arm, ways_on(arm, refused=True)))
            raise
        finally:
            self.halt.visible = False
        self.keep(made, arms[rank - 1])
        design = design_arm(arms[rank - 1], arm.name.removesuffix(BUILT) if rank == 1 else f"alternative {rank}")
        self.page.work("built", lambda: self.show_built(arm, design, made, why))
        return all_files(made, run, self.say)  # drawings take some seconds, so it is shown before

    def show_built(self, before: Arm, design: Arm, made: Build, why: str) -> None:
        """Show the arm as it is built, in the scene and in the headline, unless another is chosen by now.

        Args:
            before: The arm whose parts were asked for.
            design: That which is built.
            made: Its parts.
            why: What is wrong with the parts of the first, where it is another.
        """
        if self.arm is not before or design.result is None:
            return
        new = built_arm(made, design.name, design.result)
        self.page.panels["Arms"].put([new] if (before.design or before.result) is design.result else [design, new], new)
        if why:
            now, then = (millimetres(float(arm.error.max())) for arm in (new, before))
            words = f"The {before.name.removesuffix(BUILT)} cannot be built: {why}. "
            words += f"{design.name.capitalize()} can, to {now} instead of {then}."
            self.built.content = f'<div class="ad"><b>{escape(words)}</b></div>{self.built.content}'

    def read_kept(self) -> None:
        """Show parts again that were chosen for this search before, unless it has gone on since."""
        arm, run, place = self.arm, self.run, self.place
        if arm is None or run is None or not ((place / RECORD).is_file() and (run / RESULT).is_file()):
            return
        if (place / RECORD).stat().st_mtime < (run / RESULT).stat().st_mtime:
            return
        made, design = recorded_build(read_result(place)), replace(arm, name="chosen earlier")
        self.kept = made
        _ = made.gap  # measured here, since that takes its time
        self.page.work("built", lambda: self.show_built(arm, design, made, ""))

    def go(self, way: int) -> None:
        """Start the search that is offered for an arm that cannot be built.

        Args:
            way: Which of ``ways_on``.

        Raises:
            ArmDesignError: The recording is gone.
        """
        arm, search, room = self.arm, self.page.panels["Search"], self.page.panels["Room"]
        if arm is None or way >= len(self.ways):
            return
        if self.ways[way] == ROOM and arm.built is not None:
            room.motors.value = self.family.value
            room.room = (self.family.value, room_of_parts(arm.built.result.problem.settings.body))
        elif self.ways[way] != SEED:
            search.joints.value = str(arm.joints + 1)
        search.begin()
        words = f"Searching again: {link('Search', 'see how far it is')}. The arm before stays under Earlier runs."
        self.page.set_html(self.note, words)

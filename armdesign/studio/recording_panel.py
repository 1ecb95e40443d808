"""Panel 1, the take: a file in, which of its points are the arm, which part of it counts, what was cleaned."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Any

from armdesign.demonstration import resolve
from armdesign.demonstration.cleaning.cleaning import settled_cleaning
from armdesign.errors import ArmDesignError, counted
from armdesign.search.design_arm import recording_of
from armdesign.search.prepare import prepare
from armdesign.settings import Settings
from armdesign.studio.commands import shown
from armdesign.studio.page import Page, bad, command_html, link
from armdesign.studio.plots import gap_picture
from armdesign.studio.takes import ROLES, Shot, chosen_points, keep_upload, roles_of

NONE = "(none)"
CLEANED = ("outliers", "gaps", "repeats", "low_pass", "hidden-markers", "cut", "crop")
"""Steps that say what cleaning did."""
UNSAID = "as the file says"


def four(texts: list[str]) -> tuple[str, ...]:
    """Expressions for shoulder, elbow, wrist and hand out of as many as there are, the first and the last kept."""
    if len(texts) < 2:
        return (*texts, *[NONE] * (len(ROLES) - len(texts)))
    middle = texts[1:-1][: len(ROLES) - 2]
    return (texts[0], *middle, *[NONE] * (len(ROLES) - 2 - len(middle)), texts[-1])


class RecordingPanel:
    """The take."""

    def __init__(self, page: Page) -> None:
        """Lay out the panel."""
        self.page, gui = page, page.gui
        self.guess: tuple[str, ...] = ()
        self.filling = False
        upload = gui.add_upload_button("Choose a recording, or drop it on the page")
        upload.on_upload(lambda event: self.uploaded(event.target.value.name, event.target.value.content))
        self.about = page.html('<span class="soft">C3D, TRC, CSV, BVH, MVNX, JSON, ROS bags and more.</span>')
        with gui.add_folder("The arm's points, and the time") as self.arm_folder:
            self.points = [gui.add_dropdown(role.capitalize(), (NONE,)) for role in ROLES]
            self.target = gui.add_dropdown("A clicked point becomes", tuple(role.capitalize() for role in ROLES))
            self.part = gui.add_multi_slider("From, to [s]", 0.0, 1.0, 0.01, (0.0, 1.0))
        self.done = page.html("")
        with gui.add_folder("Cleaning", expand_by_default=False) as self.cleaning_folder:
            self.outliers = gui.add_checkbox("Remove stray points", False)
            self.repeats = gui.add_checkbox("Bridge repeated frames", False)
            self.low_pass = gui.add_number("Smooth above [Hz], 0: off", 0.0, min=0.0, max=1000.0, step=0.5)
            self.max_gap = gui.add_number("Bridge gaps up to [s]", 0.2, min=0.0, max=60.0, step=0.05)
        with gui.add_folder("If the file does not say", expand_by_default=False):
            self.rate = gui.add_number("Frames per second, 0: as it says", 0.0, min=0.0, max=1e5)
            self.units = gui.add_dropdown("Unit of length", (UNSAID, "m", "cm", "mm", "in"))
            self.up = gui.add_dropdown("Axis that points up", (UNSAID, "x", "y", "z", "-x", "-y", "-z"))
        self.command = page.html("")
        cleaning = (self.part, self.outliers, self.repeats, self.low_pass, self.max_gap)
        page.watch(self, "take", self.settle, *self.points, *cleaning)
        page.watch(self, "open", self.reopen, self.rate, self.units, self.up)
        self.show_choices(visible=False)

    def show_choices(self, *, visible: bool) -> None:
        """Show what can be chosen of a take, or hide it while there is none."""
        self.arm_folder.visible = self.cleaning_folder.visible = visible

    def uploaded(self, name: str, content: bytes) -> None:
        """A file has come."""

        def wish() -> None:
            self.open_take(keep_upload(self.page.folder / "takes", name, content))

        self.page.work("open", wish)

    def reopen(self) -> None:
        """Read the take again, as what the file does not say was given."""
        if self.page.take is not None:
            self.open_take(self.page.take)

    def open_take(self, path: Path, known: Settings | None = None) -> None:
        """Read a take, guess its arm, and show it.

        Args:
            path: Its file.
            known: The settings of a run that is opened with it; by default those on the page.

        Raises:
            ArmDesignError: It cannot be read.
        """
        page = self.page
        said = {"units": self.units.value, "up": self.up.value}
        task = {name: None if value == UNSAID else value for name, value in said.items()}
        task |= {"recording": str(path), "rate": self.rate.value or None}
        settings = Settings().replace({"task": task}) if known is None else known
        recording = recording_of(settings)
        page.take, page.recording, page.settings = path, recording, settings
        page.panels["Search"].leave()
        captured = recording.about.captured
        how = settled_cleaning(settings.task, recording)
        try:
            found = guess = roles_of(resolve(recording, None, (), None))
            if known is not None:
                found = roles_of(resolve(recording, known.task.base, known.task.points, None))
        except ArmDesignError as error:
            found = guess = {}
            page.notify("Which points are the arm?", str(error), "yellow", None)
        self.filling = True
        names = tuple(recording.points)
        self.guess = four(list(guess.values()))
        texts = four(list(found.values()))
        for handle, text in zip(self.points, texts, strict=True):
            handle.options = tuple(dict.fromkeys((NONE, *found.values(), *guess.values(), *names)))
            handle.value = text
        start, end = float(recording.time[0]), float(recording.time[-1])
        part = (how.start or start, how.stop or end)
        self.part.min, self.part.max, self.part.value = start, end, part
        self.outliers.value, self.repeats.value = bool(how.outliers), bool(how.repeats)
        self.low_pass.value = 0.0 if how.low_pass in (None, "off") else float(how.low_pass)
        self.max_gap.value = how.max_gap
        page.span(start, end)
        page.panels["Room"].fresh(known, captured=captured)
        self.filling = False
        facts = f"{counted(recording.frames, 'frame')}, {end - start:.1f} s, {counted(len(names), 'point')}"
        about = f"<b>{escape(path.name)}</b>: {facts}"
        about += f" ({escape(recording.about.format)})" if recording.about.format else ""
        page.set_html(self.about, about)
        page.set_html(self.command, command_html(shown(["recording", "info", path])))
        self.show_choices(visible=True)
        self.settle()
        page.look()

    def clicked(self, name: str) -> None:
        """A point was clicked: it becomes what was chosen, and the next one's turn comes."""
        k = self.target.options.index(self.target.value)
        self.points[k].value = name  # calls for settle
        self.target.value = self.target.options[(k + 1) % len(ROLES)]

    @property
    def followed(self) -> int:
        """How many points of the person's arm are followed, the base aside."""
        return max(len(self.points) - [handle.value for handle in self.points].count(NONE) - 1, 1)

    def chosen(self) -> dict[str, Any]:
        """Entries of the section Task as they stand on the page; what is as guessed or usual is left out."""
        page, recording = self.page, self.page.recording
        task: dict[str, Any] = {"base": None, "points": (), "start": None, "stop": None}
        texts = tuple(handle.value for handle in self.points)
        if recording is None:
            return task
        if texts != self.guess:
            task |= chosen_points(["" if text == NONE else text for text in texts], tuple(recording.points))
        start, end = self.part.value
        task["start"] = start if start > recording.time[0] + 1e-3 else None
        task["stop"] = end if end < recording.time[-1] - 1e-3 else None
        usual = settled_cleaning(Settings().task, recording)
        switches = {"outliers": self.outliers.value, "repeats": self.repeats.value}
        switches["low_pass"] = self.low_pass.value or "off"
        task |= {name: None if value == getattr(usual, name) else value for name, value in switches.items()}
        task["max_gap"] = self.max_gap.value
        page.settings = page.settings.replace({"task": task})
        return task

    def settle(self) -> None:
        """Make the task of what stands on the page, and show it with what cleaning did."""
        page, recording = self.page, self.page.recording
        if recording is None:
            return
        self.chosen()
        selection, notes = None, ""
        try:
            task = page.settings.task
            selection = resolve(recording, task.base, task.points, None)
            settings = page.panels["Room"].over(page.settings)
            page.problem, page.trouble = prepare(recording, settings), ""
            said = [step for step in page.problem.first.steps if step.name in CLEANED or step.name == "warning"]
            items = "".join(f"<li>{escape(step.sentence)}</li>" for step in said)
            notes = f"<b>What cleaning did</b><ul>{items or '<li>Nothing.</li>'}</ul>"
            notes += link("Room", "Next: where the arm may stand")
        except ArmDesignError as error:
            page.problem, page.trouble = None, str(error)
            notes = f"<b>This cannot be used yet</b><br>{bad(error)}"
        shot = Shot(recording, selection)
        page.scene.show_take(shot)
        names, seen = shot.gaps()
        page.set_html(self.done, gap_picture(names, seen, recording.time) + notes)
        page.panels["Room"].show()
        page.panels["Search"].show_command()
        page.say_next()

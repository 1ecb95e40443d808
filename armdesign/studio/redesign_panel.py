"""Panel 5, redesign: change a dimension and see path, error and clearance solved again at once, with the gradient."""

from __future__ import annotations

import dataclasses
from html import escape
from typing import Any

import numpy as np

from armdesign._types import Array
from armdesign.errors import ArmDesignError, SettingsError
from armdesign.feasibility.words import sentence, summary
from armdesign.fitness.objective import Objective
from armdesign.runs.writing import write_result
from armdesign.search.design_problem import DesignProblem
from armdesign.search.evaluation import evaluate_candidate
from armdesign.search.result import Result
from armdesign.studio import commands
from armdesign.studio.arms import CHANGED_RUN, Arm, design_arm, millimetres
from armdesign.studio.page import Page
from armdesign.studio.room_panel import longest_link
from armdesign.studio.scene import COLOURS

WAITING = "Search an arm first; here it is changed by hand."
CHANGED = "changed by hand"
BACK, AGAIN = "Back to the arm before the change", "Make the change again"
STEP_LENGTH, STEP_ANGLE = 0.01, np.deg2rad(5.0)
"""What the gradient is said for: 1 cm, 5 degrees."""


def plain_name(name: str) -> str:
    """What an entry of the design is, in words: ``a_1`` is how far joint 2 is from the axis of joint 1."""
    kind, _, row = name.rpartition("_")
    if kind == "base":
        return f"Base: {'turned by [deg]' if row == 'yaw' else f'{row} [m]'}"
    number = "Tool" if row == "tool" else f"Joint {int(row) + 1}"
    words = {"alpha": "axis tilted by [deg]", "a": "away from the axis before [m]", "d": "shifted along its axis [m]"}
    return f"{number}: {words[kind]}"


def scale_of(name: str) -> float:
    """What an entry of the design in radians or metres is multiplied by to show it."""
    return float(np.rad2deg(1.0)) if plain_name(name).endswith("[deg]") else 1.0


def gradient_words(slope: float, *, angular: bool) -> str:
    """Which way an entry has to go for a better arm, and how much that brings.

    Args:
        slope: Derivative of the score r by the entry [m/rad] or [m/m].
        angular: Whether the entry is an angle.
    """
    gain = abs(slope) * (STEP_ANGLE if angular else STEP_LENGTH)
    if not np.isfinite(gain) or gain < 5e-5:
        return "at its best"
    return f"{'&larr; less' if slope > 0.0 else '&rarr; more'}: {1e3 * gain:.1f} per {'5 deg' if angular else 'cm'}"


class RedesignPanel:
    """Live redesign."""

    def __init__(self, page: Page) -> None:
        """Lay out the panel."""
        self.page, gui = page, page.gui
        self.problem: DesignProblem | None = None  # its task, before a base was chosen
        self.found: Arm | None = None  # what is changed, as it is built where that is known
        self.changed: Arm | None = None  # what the sliders have made of it; None while they are at it
        self.left: list[float] = []  # where the sliders were before somebody went back
        self.objective: Objective | None = None  # its task, for gradients
        self.Phi = np.zeros(0)
        self.sliders: list[Any] = []
        self.filling = False
        self.back = gui.add_button(BACK, visible=False, disabled=True)
        self.take = gui.add_button("Search from this arm on", visible=False)
        self.folder = gui.add_folder("Dimensions", visible=False)
        self.state = page.html(WAITING)  # below what is moved and pressed, which keeps its place so
        self.gradient = page.html("")
        self.back.on_click(lambda _: page.work("redesign", self.go_back))
        self.take.on_click(lambda _: page.work("start", self.search_from_here))

    def begin(self, arm: Arm) -> None:
        """An arm to change: a design, or an arm as it is built.

        Args:
            arm: The arm.
        """
        result = arm.result
        if result is None:
            return
        design = result.problem.settings.design
        most = longest_link(design.length[1])
        links = {name: (low, max(high, most)) for name, (low, high) in (("a", design.a), ("d", design.d))}
        self.problem = result.problem.in_room.with_settings({"design": links})
        self.found, self.changed, self.left = arm, None, []
        self.back.label, self.back.disabled = BACK, True
        self.objective = self.problem.objective(1)
        space = self.problem.space
        base = result.problem.first.base
        self.Phi = space.phi(result.table, base)
        self.filling = True
        for slider in self.sliders:
            slider.remove()
        self.sliders = []
        low, high = space.bounds
        with self.folder:
            for k, name in enumerate(space.free_names):
                scale = scale_of(name)
                ends = np.round(scale * np.array([low[k], high[k]]), 3)
                value = float(np.clip(round(scale * self.Phi[k], 1 if scale > 1.0 else 3), *ends))
                step = 0.1 if scale > 1.0 else 0.001
                slider = self.page.gui.add_slider(plain_name(name), float(ends[0]), float(ends[1]), step, value)
                self.page.watch(self, "redesign", self.solve, slider)
                self.sliders.append(slider)
        self.filling = False
        self.back.visible = self.take.visible = self.folder.visible = True
        words = "Move a slider: the motion is solved again at once. In Parts its parts are chosen."
        self.page.set_html(self.state, words)
        self.page.set_html(self.gradient, "")

    def forget(self) -> None:
        """There is no arm any more."""
        self.found = self.changed = self.problem = None
        self.back.visible = self.take.visible = self.folder.visible = False
        self.page.set_html(self.state, WAITING)
        self.page.set_html(self.gradient, "")

    def go_back(self) -> None:
        """Take back all changes, or make those again that were taken back."""
        if self.found is None:
            return
        if self.left:
            self.filling = True
            for slider, value in zip(self.sliders, self.left, strict=True):
                slider.value = value
            self.filling = False
            self.solve()
            return
        left = [slider.value for slider in self.sliders]
        self.begin(self.found)
        self.page.panels["Arms"].show()
        self.left, self.back.label, self.back.disabled = left, AGAIN, False

    def keep(self) -> None:
        """Make the changed arm one of the arms, in a run folder of its own, so that all is made for it.

        One that was changed as it is built is a design again: at the demonstrated speed, its parts still to be chosen.

        Raises:
            SearchError: It does not do the task at that speed.
        """
        run = self.page.panels["Arms"].run
        result = None if self.changed is None else self.changed.result
        if result is None or self.problem is None or self.found is None or run is None:
            return
        folder = self.page.folder / "runs" / f"{run.name.removesuffix(CHANGED_RUN)}{CHANGED_RUN}"
        if self.found.design is not None:
            links = self.problem.settings.design
            asked = self.found.design.problem.in_room.with_settings({"design": {"a": links.a, "d": links.d}})
            result = Result(*evaluate_candidate(self.Phi, asked), known_slides=None)
        result = dataclasses.replace(result, name=folder.name, folder=folder)
        write_result(folder, result)
        arm = design_arm(result, CHANGED)
        self.page.panels["Arms"].put([arm], arm)

    def solve(self) -> None:
        """Follow the task with the arm as the sliders have it."""
        if self.problem is None or self.found is None:
            return
        page = self.page
        scale = np.array([scale_of(name) for name in self.problem.space.free_names])
        moved = np.array([slider.value for slider in self.sliders]) / scale
        self.Phi = Phi = np.clip(moved, *self.problem.space.bounds)
        self.left, self.back.label, self.back.disabled = [], BACK, False
        try:
            seen, found = evaluate_candidate(Phi, self.problem)
        except ArmDesignError as error:
            words = f'<b class="bad">{escape(sentence(error.what))}.</b> The picture still shows the arm before: '
            page.set_html(self.state, f"{words}move the slider back, or press '{BACK}'.")
            return
        result = Result(seen, found, name=CHANGED, known_slides=None)
        self.changed = arm = design_arm(result)
        page.show_arms((arm, COLOURS[0]))
        change = float(arm.error.max() - self.found.error.max())
        words = f"Largest error of the hand: {millimetres(float(arm.error.max()))}"
        words += f" ({'+' if change >= 0.0 else '-'}{millimetres(abs(change))} against the arm before)"
        page.set_html(self.state, f"<h4>{escape(words)}</h4>Clearance follows when you pause.")
        self.show_gradient(Phi)
        page.work("clearance", lambda: self.judge(result, words))

    def judge(self, result: Result, words: str) -> None:
        """What the changed arm touches; only once nothing newer is wished.

        Args:
            result: The changed arm.
            words: What it does.
        """
        if "redesign" in self.page.work.wishes:
            return
        lines = summary(result.verdict, result.judged, result.base_pose)[1:-1]
        items = "".join(f"<li>{escape(line)}</li>" for line in lines)
        self.page.set_html(self.state, f"<h4>{escape(words)}</h4><ul>{items}</ul>")

    def show_gradient(self, Phi: Array) -> None:
        """Which way every dimension has to go, and where the base wants to."""
        if self.problem is None or self.objective is None:
            return
        scores, _ = self.objective.evaluate(Phi[None], slopes=True)
        slopes = scores.slopes[0] if scores.slopes.shape[1] else np.full(len(Phi), np.nan)
        names = self.problem.space.free_names
        rows = ""
        for name, slope in zip(names, slopes, strict=True):
            title = escape(plain_name(name).split(" [")[0])
            rows += f"<tr><th>{title}</th><td>{gradient_words(float(slope), angular=scale_of(name) > 1.0)}</td></tr>"
        self.page.set_html(
            self.gradient, f"<b>Which way is better</b> (score of error and detours, in mm)<table>{rows}</table>"
        )

    def search_from_here(self) -> None:
        """Start a search whose first generation begins with this arm.

        Raises:
            SettingsError: There is no arm, or its recording is gone.
        """
        page = self.page
        if self.problem is None or self.found is None or page.take is None:
            raise SettingsError("there is no arm and recording to search from", fix="Search one first")
        settings = self.found.design.problem.settings if self.found.design else self.problem.settings
        links = self.problem.settings.design  # with room for what the sliders do
        settings = dataclasses.replace(settings, task=page.settings.task, design=links)
        first = tuple(float(x) for x in self.Phi)
        settings = settings.replace({"search": {"first": (first,), "seed": settings.search.seed + 1}})
        command = commands.search_command(settings, page.take, page.folder / "runs")
        page.panels["Search"].carry_out(command)
        page.notify("The search goes on from this arm", str(command), "green")

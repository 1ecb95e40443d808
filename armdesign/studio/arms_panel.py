"""Panel 4, arms: what was found, other numbers of joints, alternatives, ready-made arms, side by side and in step."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import Path

import numpy as np

from armdesign.errors import ArmDesignError, SettingsError
from armdesign.experiments.auto_dof.dof_records import holds_auto, run_name
from armdesign.experiments.compare.base_pose import BaseProgress, BaseSearch
from armdesign.experiments.compare.comparison import compare
from armdesign.experiments.compare.ready_made import open_ready_made, ready_made_arms
from armdesign.runs.alternatives import write_alternatives
from armdesign.runs.folder import RESULT
from armdesign.runs.listing import numbered_results
from armdesign.runs.reading import read_problem, read_result
from armdesign.search.design_problem import DesignProblem
from armdesign.search.result import Result
from armdesign.studio.arms import CHANGED_RUN, SORTS, Arm, arms_table, design_arm, ordered, ready_made_arm
from armdesign.studio.commands import shown
from armdesign.studio.page import Page, command_html
from armdesign.studio.scene import COLOURS

ALL = "all of them"
WAITING = "Search an arm first; here it is compared with others."
ABOUT = "The search's arm, its alternative 1, has the best score in all; in one column another may be better."
POSES = 400
"""Base poses that are tried for a ready-made arm."""


def needed_reach(problem: DesignProblem) -> float:
    """About how long an arm has to be, from the best of the places it may stand at to all that the hand does [m].

    Args:
        problem: The task and the places.
    """
    hand = problem.in_room.task.P[:, -1] + problem.shift
    middle = (hand.min(axis=0) + hand.max(axis=0)) / 2.0
    places = [np.clip(middle, *site.box) for site in problem.space.sites] or [middle]
    return min(float(np.linalg.norm(hand - place, axis=1).max()) for place in places)


def by_reach(lengths: Mapping[str, float], needed: float) -> tuple[str, ...]:
    """Names of ready-made arms with their lengths, the shortest that may do first, those too short last.

    Args:
        lengths: Of the arms by name [m].
        needed: What the task needs [m].
    """
    ranked = sorted(lengths.items(), key=lambda item: (item[1] < needed, abs(item[1] - needed)))
    return tuple(f"{name} ({length:.2f} m{', too short' if length < needed else ''})" for name, length in ranked)


class CancelledError(ArmDesignError):
    """Somebody does not want to wait."""


class ArmsPanel:
    """The arms."""

    def __init__(self, page: Page) -> None:
        """Lay out the panel."""
        self.page, gui = page, page.gui
        self.arms: list[Arm] = []
        self.run: Path | None = None
        self.result: Result | None = None
        self.chosen: Arm | None = None  # whose parts are chosen, and which is changed by hand
        self.cancelled = False
        self.note = page.html(WAITING)
        self.table = page.html("")
        self.sort = gui.add_dropdown("Sort by", SORTS, visible=False)
        self.which = gui.add_dropdown("Show", (ALL,), visible=False)
        self.others = gui.add_button("Add other arms of this search", visible=False)
        self.robot = gui.add_dropdown("Ready-made arm", tuple(ready_made_arms()) or ("none",), visible=False)
        self.add = gui.add_button("Compare with it", visible=False)
        self.bar = gui.add_progress_bar(0.0, visible=False)
        self.cancel = gui.add_button("Cancel", visible=False)
        self.command = page.html("")
        self.others.on_click(lambda _: page.slow("alternatives", self.find_alternatives))
        self.add.on_click(lambda _: page.slow("compare", self.mount))
        self.cancel.on_click(lambda _: setattr(self, "cancelled", True))
        self.sort.on_update(lambda _: page.work("arms", self.show))
        self.which.on_update(lambda _: page.work("arms", self.show))

    def forget(self) -> None:
        """Another run is watched."""
        self.arms, self.run, self.result, self.chosen = [], None, None, None
        self.page.set_html(self.note, WAITING)
        self.page.set_html(self.table, "")
        self.page.set_html(self.command, "")
        self.let_choose(visible=False)

    def let_choose(self, *, visible: bool) -> None:
        """Show what can be chosen, or hide it while there is no arm."""
        for handle in (self.sort, self.which, self.others, self.robot, self.add):
            handle.visible = visible

    def begin(self, result: Result, run: Path) -> None:
        """A search has ended: its arm, and those of other numbers of joints."""
        self.run, self.result, self.chosen = run, result, None
        self.arms = [design_arm(result, "search's arm")]
        for path in numbered_results(run, "n") if holds_auto(run) else ():
            n = int(path.parent.name.removeprefix("n"))
            if n != result.table.dof:
                self.arms.append(design_arm(read_result(path.parent), f"{n} joints"))
        for path in numbered_results(run / "alternatives"):
            if path.parent.name != "1":
                self.arms.append(design_arm(read_result(path.parent), f"alternative {path.parent.name}"))
        lengths = {name: open_ready_made(name).length for name in ready_made_arms()}
        self.robot.options = by_reach(lengths, needed_reach(result.problem)) or ("none",)
        self.robot.value = self.robot.options[0]
        self.let_choose(visible=True)
        self.which.options = (ALL,)
        self.show()
        self.page.slow("kept", self.page.panels["Parts"].read_kept)

    def put(self, arms: list[Arm], choose: Arm | None = None) -> None:
        """Add arms to the table, in the place of those of their names.

        Args:
            arms: The arms.
            choose: One of them to be shown alone from now on; by default what was chosen stays so among all.
        """
        names = {arm.name for arm in arms}
        self.arms = [arm for arm in self.arms if arm.name not in names] + arms
        self.show(choose)

    def show(self, choose: Arm | None = None) -> None:
        """Show the table, the scene and the errors; a design that is shown alone is the chosen one."""
        if not self.arms:
            return
        arms = ordered(self.arms, self.sort.value)
        colours = {arm.name: COLOURS[k % len(COLOURS)] for k, arm in enumerate(self.arms)}
        names = tuple(arm.name for arm in arms)
        if self.which.options != (*names, ALL):
            grown = set(names) > set(self.which.options) - {ALL} > set()
            self.which.options = (*names, ALL)
            self.which.value = ALL if grown else self.arms[0].name
        if choose is not None:
            self.which.value = choose.name
        seen = arms if self.which.value == ALL else [arm for arm in arms if arm.name == self.which.value]
        page = self.page
        if self.which.value != ALL and seen[0].result is not None and seen[0] is not self.chosen:
            self.chosen = seen[0]
            given = self.chosen.design or self.chosen.result
            own = None if given is None else given.folder
            changed = own is not None and own.name.endswith(CHANGED_RUN)
            page.panels["Parts"].begin(self.chosen, own if changed else self.run)
            page.panels["Redesign"].begin(self.chosen)
        seen = sorted(seen, key=lambda arm: arm is not self.chosen)  # the headline is about the first
        page.set_html(self.note, f"<h4>First by {self.sort.value}: {escape(arms[0].name)}</h4>{ABOUT}")
        stands = [f"{arm.name}: {arm.stands}" for arm in arms if arm.stands]
        table = arms_table(arms, [colours[arm.name] for arm in arms])
        page.set_html(self.table, table + "".join(f"<p>{escape(each)}</p>" for each in stands))
        page.show_arms(*((arm, colours[arm.name]) for arm in seen))
        if self.run is not None and (self.run / RESULT).is_file():
            robots = [arm.name for arm in self.arms if arm.result is None] or [self.robot.value.split()[0]]
            lines = [shown(["alternatives", self.run]), shown(["compare", self.run, *robots])]
            page.set_html(self.command, command_html(*lines))

    def ready(self) -> tuple[Path, Result]:
        """The run and its arm.

        Raises:
            SettingsError: There is none yet.
        """
        if self.run is None or self.result is None:
            raise SettingsError("there is no arm yet", fix="Search one first")
        return self.run, self.result

    def find_alternatives(self) -> None:
        """Find the best arms of the search that really differ."""
        run, result = self.ready()
        place = run / run_name(result.table.dof) if holds_auto(run) else run
        found = write_alternatives(place, read_problem(place), count=4)
        arms = [design_arm(each.result, f"alternative {each.rank}") for each in found if each.rank > 1]
        if not arms:
            self.page.notify("No other arms", "All good arms of this search are alike.")
        self.page.work("put", lambda: self.put(arms))

    def mount(self) -> None:
        """Find the best place of a ready-made arm on the same task."""
        _, result = self.ready()
        name, self.cancelled = self.robot.value.split()[0], False

        def told(_: str, progress: BaseProgress) -> None:
            self.bar.value = 100.0 * progress.evaluations / progress.total
            if self.cancelled:
                raise CancelledError("the comparison was cancelled")

        self.bar.visible = self.cancel.visible = True
        try:
            found = compare([name], result.problem.in_room, BaseSearch(POSES), on_progress=told)
        finally:
            self.bar.visible = self.cancel.visible = False
        arms = [ready_made_arm(row, result) for row in found.rows]
        if not found.rows[0].reached:
            message = f"{name} does not reach the start of the motion from any place that may be taken"
            raise SettingsError(message, value=name, fix="Choose a larger arm, or allow more places")
        self.page.work("put", lambda: self.put(arms))

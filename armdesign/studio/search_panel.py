"""Panel 3, the search: a process of its own, in a run folder like any other, which this page only watches."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from html import escape
from pathlib import Path
from subprocess import Popen
from typing import Any

import numpy as np

from armdesign.errors import ArmDesignError, RunFolderError, SettingsError, counted, resume_command
from armdesign.experiments.auto_dof.dof_records import holds_auto, read_auto
from armdesign.feasibility.words import sentence, summary
from armdesign.runs.folder import settings_file
from armdesign.runs.listing import RunStatus
from armdesign.search.result import Result, likely
from armdesign.settings.sections import read_settings
from armdesign.studio import commands
from armdesign.studio.arms import design_arm
from armdesign.studio.download_panel import MOST_JOINTS
from armdesign.studio.page import Page, bad, command_html, link
from armdesign.studio.plots import Curve, plot
from armdesign.studio.scene import COLOURS

NOT_FOUND = "If it stays so: allow a longer arm in the panel Room, another place, or one joint more."
MORE_FOLLOW = "Arms of more joints are tried next, by itself."
NOT_GOOD = "Allow one joint more, or a longer arm or larger error in the panel Room."
AUTO, NO_RUN = "as few as do it", "choose one"
FEWEST, MOST_AUTO = 4, 6
"""Joints that are tried where it is left to the search: parts of an arm of three that is as exact hardly ever fit."""
EFFORTS = {
    "quick: some minutes": ("quick", 4000), "normal: an hour or so": ("normal", 50_000),
    "thorough: hours": ("thorough", 50_000),
}  # fmt: skip
"""Effort and most candidates of a search."""
STATES = {
    "running": "Searching", "finished": "The search has ended", "interrupted": "The search was stopped",
    "stopped": "The search was stopped", "failed": "No arm was found", "broken": "The run is damaged",
    "evaluated": "A given arm, not a search",
}  # fmt: skip


def progress_words(run: RunStatus, joints: Sequence[int]) -> tuple[str, float]:
    """How far a search is, in words and as a share of the most that it may take.

    Args:
        run: The run that is at it.
        joints: The numbers of joints that are tried one after another; none where only one is.
    """
    done = min(1.0, (run.iterations or 0) / (run.planned or np.inf))
    tried = f"{run.iterations} of {run.planned} arms tried." if run.iterations and run.planned else "getting ready."
    if run.dof not in joints:
        return f"{counted(run.dof, 'joint')}: {tried}" if run.dof else tried, done
    share = (joints.index(run.dof) + done) / len(joints)
    return f"joints {run.dof} of {joints[0]}..{joints[-1]} (fewer is better): {tried}", share


def judged_words(result: Result) -> list[str]:
    """What a searched arm does, in sentences; of verdict and speed, that its motors are still to be chosen."""
    error, verdict, *more, speed = summary(result.verdict, result.judged, result.base_pose)
    assumed = "" if result.problem.settings.needs.max_speed else " Their speed is assumed:"
    verdict = verdict.replace("Verdict:", "Verdict before motors are chosen:")
    return [error, verdict, *more, f"Motors are not chosen yet.{assumed} {speed}"]


class SearchPanel:
    """The search.

    Attributes:
        run: The run folder that is watched; None for none.
        result: Its best arm so far.
    """

    def __init__(self, page: Page) -> None:
        """Lay out the panel."""
        self.page, gui = page, page.gui
        self.run: Path | None = None
        self.result: Result | None = None
        self.process: Popen[bytes] | None = None
        self.asked: dict[str, Any] = {}  # what the page asked for when the search began; nothing where it did not
        self.stopping = False  # a search that somebody ends has not failed
        self.seen: tuple[str, float | None] = ("", None)
        self.curve: dict[Path, list[tuple[float, float]]] = {}
        self.since: tuple[Path | None, float, int] = (None, 0.0, 0)  # folder, when it was first seen, its arms then
        self.joints = gui.add_dropdown("Joints", (AUTO, *map(str, range(2, MOST_JOINTS + 1))))
        self.effort = gui.add_dropdown("How thorough", tuple(EFFORTS))
        self.start = gui.add_button("Search the arm", color="green")
        self.halt = gui.add_button("Stop", color="red", visible=False)
        self.resume = gui.add_button("Go on with this search", visible=False)
        self.bar = gui.add_progress_bar(0.0, visible=False)
        self.state = page.html("Read a recording first, in the panel Recording; here the arm for it is searched.")
        self.runs = gui.add_dropdown("Earlier runs", (NO_RUN,), visible=False)
        self.command = page.html("")
        self.start.on_click(lambda _: page.work("start", self.begin))
        self.halt.on_click(lambda _: page.work("press", self.end))
        self.resume.on_click(lambda _: page.work("press", self.go_on))
        self.runs.on_update(lambda _: page.work("run", self.choose_run))
        for handle in (self.joints, self.effort):
            handle.on_update(lambda _: page.work("command", self.show_command))
        page.work("runs", self.list_runs)

    def settled(self) -> commands.Command:
        """The search as it stands on the page.

        Raises:
            SettingsError: There is no take yet, or what is asked for cannot be done.
        """
        page = self.page
        if page.take is None:
            raise SettingsError("there is no recording yet", fix="Drop one on the page")
        auto = self.joints.value == AUTO
        effort, budget = EFFORTS[self.effort.value]
        design = {"auto_dof": (FEWEST, MOST_AUTO)} if auto else {"auto_dof": None, "dof": int(self.joints.value)}
        changes = {"search": {"effort": effort, "budget": budget}, "design": design}
        settings = page.panels["Room"].over(page.settings).replace(changes)
        return commands.search_command(settings, page.take, page.folder / "runs", auto=auto)

    def show_command(self) -> None:
        """Show the search as one would type it."""
        if self.page.take is None:
            return
        try:
            text = command_html(str(self.settled()))
        except ArmDesignError as error:
            text = bad(error)
        self.page.set_html(self.command, text)

    def begin(self) -> None:
        """Start the search.

        Raises:
            ArmDesignError: The take cannot be used as it is.
        """
        if self.page.problem is None:
            raise SettingsError("the take cannot be searched for yet", fix="See what the panel Recording says")
        command = self.settled()
        self.asked = self.asks()
        self.carry_out(command)

    def asks(self) -> dict[str, Any]:
        """What the page asks for, by what it is called in a sentence."""
        return {"what is followed of the recording": self.page.settings.task, **self.page.panels["Room"].asked()}

    def changed(self) -> str:
        """What has changed on the page since the search began, in a clause; empty where nothing."""
        now = self.asks() if self.asked else {}
        names = [name for name, value in now.items() if value != self.asked[name]]
        return f"Changed since this arm was searched: {', '.join(names)}" if names else ""

    def carry_out(self, command: commands.Command) -> None:
        """Start a search and watch it."""
        self.process = commands.begin(command)
        self.watch(command.folder)

    def watch(self, folder: Path) -> None:
        """Watch a run folder from now on."""
        self.leave()
        self.run, self.seen = folder, ("", None)
        self.page.set_html(self.state, "<h4>Starting</h4>")
        self.page.say_next()
        self.look()

    def leave(self) -> None:
        """Watch nothing; the search goes on."""
        self.run, self.result, self.stopping = None, None, False
        self.start.visible = True
        for handle in (self.bar, self.halt, self.resume):
            handle.visible = False
        for name in ("Arms", "Redesign", "Parts"):
            self.page.panels[name].forget()
        self.page.show_arms()
        self.page.set_html(self.state, "")
        self.page.set_html(self.page.progress, "")

    def end(self) -> None:
        """End the search with the best arm so far."""
        if self.run is None or not commands.stop(self.run):
            raise SettingsError("nobody is searching in this run", value=str(self.run), fix="Start a search")
        self.stopping = True
        self.page.set_html(self.page.progress, "Stopping: the best arm so far is kept ...")

    def go_on(self) -> None:
        """Go on with a search that has not ended."""
        if self.run is not None:
            self.process = commands.begin(self.run)
            self.watch(self.run)

    def list_runs(self) -> None:
        """List the runs that are there, newest first."""
        place = self.page.folder / "runs"
        runs, now = commands.known_runs(place), time.time()
        when = [time.strftime("%d %b %H:%M", time.localtime(now - run.age)) for run in runs]
        facts = [", ".join(filter(None, (commands.facts(run), said))) for run, said in zip(runs, when, strict=True)]
        names = [f"{run.folder.relative_to(place)} ({said})" for run, said in zip(runs, facts, strict=True)]
        self.runs.options = (NO_RUN, *names)
        self.runs.visible = bool(names)

    def choose_run(self) -> None:
        """A run was chosen, perhaps the one that was watched last; the list then says again that one can be chosen."""
        name = self.runs.value
        if name != NO_RUN:
            self.runs.value = NO_RUN
            self.open_run(self.page.folder / "runs" / name.rpartition(" (")[0])

    def open_run(self, folder: Path) -> None:
        """Open a run folder, with its recording where that is still there.

        Args:
            folder: The run folder.
        """
        inner = folder if settings_file(folder).is_file() else commands.status(folder).folder
        settings = read_settings(settings_file(inner)).replace({"search": {"first": ()}})  # another search has its own
        take = settings.task.recording
        if take is not None and Path(take).is_file():
            self.joints.value = AUTO if holds_auto(folder) else str(settings.design.dof)
            self.page.panels["Recording"].open_take(Path(take), settings)
            self.asked = self.asks()
        else:
            self.page.settings, self.asked = settings, {}
            self.page.scene.show_take(None)
        self.watch(folder)
        self.page.look()

    def look(self) -> None:
        """See how far the watched search is, and show its best arm where that is a new one."""
        if self.run is None:
            return
        if not self.run.is_dir():
            folder = self.run
            self.leave()
            raise RunFolderError(f"{folder} is not there any more", value=str(folder), fix="Search again")
        run = commands.status(self.run)
        alive = self.process is not None and self.process.poll() is None
        if self.process is not None and not alive and run.state in ("broken", "stopped", "failed"):
            self.process = None
            words = commands.last_words(self.run) or "The search has ended without a word; see its studio.log."
            if not self.stopping:
                self.page.set_html(self.state, f'<b class="bad">The search has failed</b><br>{escape(sentence(words))}')
                self.page.notify("The search has failed", words, "red", None)
                self.seen = (run.state, run.best)
        state = "running" if alive and run.state in ("broken", "stopped", "interrupted") else run.state
        running = state == "running"
        self.bar.visible, self.halt.visible = running and bool(run.iterations), running
        self.start.visible = not running
        self.resume.visible = state in ("stopped", "interrupted")
        words, share = progress_words(run, read_auto(self.run).joints if holds_auto(self.run) else ())
        self.bar.value = 100.0 * share
        if self.since[0] != run.folder:
            self.since = (run.folder, time.monotonic(), run.iterations or 0)
        _, began, first = self.since
        if run.iterations and run.iterations > first and run.planned:
            left = (time.monotonic() - began) * (run.planned - run.iterations) / (run.iterations - first)
            words += f" {max(left / 60.0, 1.0):.0f} min more at most for these."
        elif running and not run.iterations and commands.compiles(self.run):
            words += " The kernels are compiled, once on this machine, in some minutes."
        if not self.stopping or not running:
            words = f"<b>Searching</b>, {words} {link('Search', 'Stop, or see more')}" if running else ""
            self.page.set_html(self.page.progress, words)
        if run.best is None and running:
            if run.iterations:
                advice = MORE_FOLLOW if holds_auto(self.run) else NOT_FOUND
                self.page.set_html(self.state, f"<h4>Searching</h4>None can do the motion yet. {advice}")
            return
        if (state, run.best) == self.seen:
            return
        if self.seen[0] == "running" and state == "finished":
            self.page.notify("The search has ended", "The panel Parts chooses its parts.", "green")
        self.seen = (state, run.best)
        self.show(run, state)
        self.list_runs()

    def show(self, run: RunStatus, state: str) -> None:
        """Show the best arm so far, and what is known of the search.

        Args:
            run: How far it is.
            state: Its state in the studio's words.
        """
        result = commands.best_so_far(run) if run.state != "broken" else None
        if result is None or self.run is None:
            advice = NOT_FOUND if state in ("failed", "finished", "interrupted") else ""
            self.page.set_html(self.state, f"<h4>{STATES.get(state, state)}</h4>{advice}")
            return
        first = self.result is None
        self.result = result = dataclasses.replace(result, name=self.run.name)
        arm = design_arm(result, "best arm so far" if state == "running" else None)
        self.page.problem = result.problem.in_room
        self.page.panels["Room"].show()
        self.page.show_arms((arm, COLOURS[0]))
        if first or state != "running" or self.page.scene.outgrown:
            self.page.look()
        points = self.curve.setdefault(run.folder, [])
        points.append((float(run.iterations or 0), 1e3 * result.evaluation.fitness))
        ended = state != "running"
        lines = [f"<h4>{STATES.get(state, state)}: {counted(result.table.dof, 'joint')}</h4>"]
        if ended:
            words = judged_words(result)
            mark = "" if result.verdict.passed else ' class="bad"'  # good only once its parts fit
            items = "".join(f"<li{mark if k == 1 else ''}>{escape(line)}</li>" for k, line in enumerate(words))
            lines.append(f"<ul>{items}</ul>")
        if result.facts is not None and ended:
            sure = result.facts.agreement
            better = "" if sure is None else f" That a thorough search finds a better one is {likely(sure.chance)}."
            lines.append(f"{run.iterations or result.facts.evaluations} arms tried.{better}")
        x, y = np.array(points, dtype=float).reshape(-1, 2).T
        if len(x) > 1:
            title = "How far off the best arm is, detours added [mm]"
            lines.append(plot([Curve(x, y, COLOURS[0], "best so far")], title, "arms tried"))
        if ended:
            ways = link("Parts", "choose its parts"), link("Arms", "compare it"), link("Redesign", "change it")
            lines.append(f"<p>Next: <b>{ways[0]}</b>, or {ways[1]} with other arms, or {ways[2]} by hand.</p>")
            self.page.panels["Arms"].begin(result, self.run)
        if ended and not result.verdict.passed:
            lines.append(f"Not good enough? {NOT_GOOD}")
        if state in ("interrupted", "stopped"):
            lines.append(command_html(resume_command("search", self.run)))
        self.page.set_html(self.state, "".join(lines))

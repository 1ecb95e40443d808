"""What the panels share: headline, time, scene, and the one thread on which all work is done, newest wish first."""

from __future__ import annotations

import sys
import threading
import time
import traceback
from collections.abc import Callable, Mapping
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from armdesign.demonstration import Recording
from armdesign.errors import ArmDesignError
from armdesign.feasibility.words import sentence
from armdesign.search.design_problem import DesignProblem
from armdesign.settings import Settings
from armdesign.studio.arms import Arm, job_words, load_words
from armdesign.studio.plots import Curve, plot
from armdesign.studio.scene import Scene

STYLE = """<style>
.mantine-Slider-root{padding-bottom:1em!important}.mantine-Slider-markLabel{translate:0 .6rem}
.ad{margin:6px 12px;font-size:13.5px;line-height:1.45}.ad svg{width:100%;font:10px sans-serif;fill:#333}
.ad svg[data-start]{cursor:pointer}.ad h4{margin:2px 0;font-size:15px}.ad ul{margin:4px 0;padding-left:18px}
.ad table{border-collapse:collapse;width:100%}.ad td,.ad th{padding:3px 4px;text-align:right;white-space:nowrap}
.ad th:first-child{text-align:left;font-weight:600}.ad tr{border-bottom:1px solid #e2e5e9}
.ad .wide{overflow-x:auto;font-size:12.5px}
@media(max-width:960px){.ad .wide{font-size:10.5px}.ad .wide td,.ad .wide th{padding:3px 2px}}
@media(max-width:600px){.ad .wide tr>:nth-child(4),.ad .wide tr>:nth-child(5){display:none}}
@media(max-width:576px){div[style*="flex-grow: 1"][style*="height: 100%"]:has(canvas){height:42%!important}
.mantine-Paper-root[style*="max-height: 60%"]{width:100%!important;max-height:58%!important}
.mantine-ScrollArea-content>div[style*="20em"]{width:100%!important}}
.mantine-Button-root{height:auto!important;min-height:2em;padding-block:3px!important}
.mantine-Button-label{white-space:normal!important;line-height:1.25}
.ad .head{min-height:88px}
.ad i{display:inline-block;width:10px;height:10px;border-radius:5px;margin-right:5px}
.ad summary{color:#5c6670;cursor:pointer}.ad details{margin:6px 0}
.ad code{display:block;background:#f1f3f5;padding:5px 7px;overflow-wrap:anywhere;font-size:11.5px}
.ad thead th,.ad tbody th,.ad .parts td:first-child{white-space:normal}
.ad .parts td:first-child{text-align:left}.ad .parts th{padding-top:9px}
.mantine-Notifications-root{top:auto!important;bottom:12px;width:300px!important}
.ad .good{color:#16703c}.ad .part{color:#8a5a00}.ad .bad{color:#b00020}.ad .soft{color:#5c6670}
.ad a[data-panel]{font-weight:600;color:#1864ab}
</style>"""

WIDE, NARROW = 430, 330
"""Width of the panels, and in a small window [pixels]."""
RESHAPED = 0.2
"""Change of width by height of the scene at which it is looked at anew."""


def link(panel: str, words: str) -> str:
    """A link to a panel."""
    return f'<a data-panel="{panel}" href="#">{words}</a>'


def bad(error: Exception) -> str:
    """What is wrong, as a page shows it."""
    return f'<b class="bad">{escape(sentence(str(error)))}</b>'


def command_html(*lines: str) -> str:
    """Commands that do what the page does, folded up: who has come to click is not to read them."""
    text = "<br>".join(map(escape, lines))
    return f"<details><summary>The same on the command line</summary><code>{text}</code></details>"


class Worker:
    """One thread that does what is wished, in order; of wishes of one kind only the newest."""

    def __init__(self, complain: Callable[[Exception], None]) -> None:
        """Start.

        Args:
            complain: Called with what a wish has failed by.
        """
        self.wishes: dict[str, Callable[[], None]] = {}
        self.changed = threading.Condition()
        self.complain = complain
        threading.Thread(target=self._work, daemon=True).start()

    def __call__(self, kind: str, wish: Callable[[], None]) -> None:
        """Wish for something.

        Args:
            kind: What it replaces, if that has not begun yet.
            wish: What to do.
        """
        with self.changed:
            self.wishes.pop(kind, None)
            self.wishes[kind] = wish
            self.changed.notify()

    def _work(self) -> None:
        while True:
            with self.changed:
                self.changed.wait_for(lambda: self.wishes)
                wish = self.wishes.pop(next(iter(self.wishes)))
            try:
                wish()
            except Exception as error:  # the page lives on
                self.complain(error)


class Page:
    """What the panels share.

    Attributes:
        folder: Where takes, cells and runs are written.
        settings: Of the search to come.
        take: The file of the recording.
        recording: The recording; None before there is one.
        problem: What a search would solve; None where that is not settled.
        trouble: Why it is not settled.
        arm: The arm in the headline; None before there is one.
        work: Wishes; all that changes these attributes runs there.
        slow: Wishes that take longer than a glance and change nothing here.
    """

    def __init__(self, server: Any, folder: Path) -> None:  # noqa: ANN401 (viser's server)
        """Lay out the page."""
        self.server, self.gui, self.folder = server, server.gui, folder
        self.settings = Settings()
        self.take: Path | None = None
        self.recording: Recording | None = None
        self.problem: DesignProblem | None = None
        self.trouble = ""
        self.arm: Arm | None = None
        self.shown: tuple[tuple[Arm, str], ...] = ()
        self.work, self.slow = Worker(self.complain), Worker(self.complain)
        self.playing = False
        self.gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")
        self.gui.set_panel_label("armdesign studio")
        self.gui.main_panel.dock_right()
        self.gui.main_panel.set_width(WIDE)
        server.on_client_connect(self.fit)
        self.headline = self.html("")
        self.way = self.gui.add_button("", color="orange", visible=False)  # out of what is wrong with the arm
        self.way.on_click(lambda _: self.work("start", lambda: self.panels["Parts"].go(0)))
        self.progress = self.html("")
        self.time = self.gui.add_slider("Time [s]", 0.0, 1.0, 0.01, 0.0)
        self.play = self.gui.add_button("Play")
        self.play.on_click(lambda _: self.toggle_play())
        self.errors = self.html("")
        self.scene = Scene(
            server.scene, lambda name: self.work("point", lambda: self.panels["Recording"].clicked(name))
        )
        self.time.on_update(lambda _: self.scene.show_time(self.time.value))
        self.panels: dict[str, Any] = {}
        self.say_next()

    def lay_out(self, kinds: Mapping[str, Callable[[Page], Any]]) -> None:
        """Lay out the panels.

        Args:
            kinds: What makes each, by its name.
        """
        tabs = self.gui.add_tab_group()
        for name, kind in kinds.items():
            with tabs.add_tab(name):
                self.panels[name] = kind(self)

    def fit(self, client: Any) -> None:  # noqa: ANN401 (viser's handle)
        """Make the panels of a window narrower while they would take half of it, look anew where its shape changes."""
        width, aspect = WIDE, 0.0

        def changed(_: object) -> None:
            nonlocal width, aspect
            if abs(client.camera.aspect - aspect) > RESHAPED:
                aspect = client.camera.aspect
                self.aim(client)
            wanted = WIDE if client.camera.image_width + width > 2 * WIDE + 100 else NARROW
            if wanted != width:
                width = wanted
                client.gui.main_panel.set_width(width)

        client.camera.on_update(changed)

    def begin(self) -> None:
        """Let time pass from now on."""
        threading.Thread(target=self._tick, daemon=True).start()

    def watch(self, panel: Any, kind: str, wish: Callable[[], None], *handles: Any) -> None:  # noqa: ANN401
        """Wish for something whenever a person, not the panel itself, changes an input.

        Args:
            panel: The panel; ``filling`` while it fills its inputs.
            kind: Kind of the wish.
            wish: What to do.
            handles: The inputs.
        """

        def changed(_: object) -> None:
            if not panel.filling:
                self.work(kind, wish)

        for handle in handles:
            handle.on_update(changed)

    def html(self, content: str, *, visible: bool = True) -> Any:  # noqa: ANN401 (viser's handle)
        """A piece of page."""
        return self.gui.add_html(f'<div class="ad">{content}</div>', visible=visible)

    def complain(self, error: Exception, title: str = "That did not work") -> None:
        """Say what went wrong: the sentence of the command line, never a traceback."""
        if isinstance(error, ArmDesignError):
            self.notify(title, sentence(str(error)), "red")
        else:
            traceback.print_exception(error, file=sys.stderr)
            self.notify(title, f"A fault of the studio itself ({type(error).__name__}); the terminal says more.", "red")

    def notify(self, title: str, words: str, colour: str = "blue", seconds: float | None = 12.0) -> None:
        """Tell everybody who looks at the page."""
        for client in self.server.get_clients().values():
            client.add_notification(title, words, color=colour, auto_close_seconds=seconds)

    def say_next(self) -> None:
        """The headline: what the arm does, or what to do next."""
        if self.arm is not None:
            chosen = self.panels["Parts"].arm
            self.panels["Parts"].show_choice()
            words, mark = job_words(self.arm)
            mark = mark if chosen is not None else ""  # no verdict on a search that goes on
            result, changed = self.arm.result, self.panels["Search"].changed()
            text = f'<h4 class="{mark}">{escape(words)}</h4>'
            if changed:
                text = f'<h4 class="bad">{changed}: {link("Search", "search again")}</h4>Before: {escape(words)}.<br>'
            text += f"Arm: {escape(self.arm.name)}"
            text += "" if result is None else f", {load_words(result.problem.settings.needs.payload)}"
            text += f", furthest off at {self.arm.worst:.2f} s"
            if self.arm is chosen:
                text += f". {link('Parts', 'Parts and files' if chosen.built else 'Next: choose its parts')}"
            elif chosen is not None and result is not None:
                text += f". {link('Parts', 'Choose its parts')}, or "
                text += link("Redesign", "search from it, or go back")
            within = None if result is None else result.problem.settings.needs.hand_tolerance
            curves = [Curve(arm.time, 1e3 * arm.error, colour, arm.name) for arm, colour in self.shown]
            level = None if within is None else 1e3 * within
            title = "Error of the hand [mm]: click to go there"
            self.set_html(self.errors, plot(curves, title, "time [s]", level=level, timed=True))
        elif self.recording is None:
            text = "<h4>Drop a recording of a person's arm anywhere on this page</h4>Or choose its file below."
        elif self.trouble:
            text = '<h4 class="bad">The recording is read, but something is missing</h4>'
            text += escape(sentence(self.trouble))
        elif self.panels["Search"].run is not None:
            text = "<h4>An arm is searched for</h4>The best so far is shown here, as soon as there is one."
        else:
            text = "<h4>The recording is read</h4>Press Play: is the orange arm the person's? Then say "
            text += f"{link('Room', 'where the new arm may stand')}, or {link('Search', 'search it')} at once."
        ways = self.panels["Parts"].ways if self.arm is not None and self.arm is self.panels["Parts"].arm else []
        self.way.visible = bool(ways)
        self.way.label = ways[0] if ways else ""
        self.set_html(self.headline, f'{STYLE}<div class="head">{text}</div>')

    @staticmethod
    def set_html(handle: Any, content: str) -> None:  # noqa: ANN401 (viser's handle)
        """Replace a piece of page."""
        handle.content = f'<div class="ad">{content}</div>'

    def show_arms(self, *shown: tuple[Arm, str]) -> None:
        """Show arms, the first of which the headline is about.

        Args:
            shown: Each with its colour; none to show none.
        """
        self.shown = shown
        self.arm = shown[0][0] if shown else None
        self.scene.show_arms([arm for arm, _ in shown], [colour for _, colour in shown])
        if self.arm is not None:
            self.span(float(self.arm.time[0]), float(self.arm.time[-1]))
        else:
            self.set_html(self.errors, "")
        self.say_next()

    def span(self, start: float, end: float) -> None:
        """The time that the slider covers [s]."""
        start = round(start, 3)
        end = max(float(np.ceil(100.0 * end - 1e-6)) / 100.0, start + 0.02)
        if abs(self.time.min - start) > 1e-6 or abs(self.time.max - end) > 1e-6:
            self.time.min, self.time.max = start, end
            self.time.value = float(np.clip(self.time.value, start, end))

    def look(self) -> None:
        """Turn every camera to what there is to see."""
        camera = self.server.initial_camera
        camera.position, camera.look_at = self.scene.look_at(self.problem, camera.fov)
        for client in self.server.get_clients().values():
            self.aim(client)

    def aim(self, client: Any) -> None:  # noqa: ANN401 (viser's handle)
        """Turn a camera to what there is to see, in a window of any shape."""
        wide = 2.0 * np.arctan(np.tan(client.camera.fov / 2.0) * min(1.0, client.camera.aspect))
        client.camera.position, client.camera.look_at = self.scene.look_at(self.problem, wide)

    def toggle_play(self) -> None:
        """Play or halt."""
        self.playing = not self.playing
        self.play.label = "Halt" if self.playing else "Play"

    def _tick(self) -> None:
        """Let time pass while it plays, and look after the search."""
        last = looked = time.monotonic()
        while True:
            time.sleep(0.04)
            now = time.monotonic()
            if self.playing:
                value = self.time.value + now - last
                self.time.value = round(self.time.min if value > self.time.max else value, 3)
            if now - looked > 1.0:
                looked = now
                self.work("search", self.panels["Search"].look)
            last = now

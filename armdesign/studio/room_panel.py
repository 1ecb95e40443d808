"""Panel 2, the cell: where the arm may stand, what stands around it, what it carries and how exact it has to be."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from armdesign.building.build import PEDESTAL
from armdesign.building.room import room_for_motors
from armdesign.cell.obstacle_file import read_obstacles
from armdesign.demonstration import Recording
from armdesign.errors import ArmDesignError
from armdesign.files import write_whole
from armdesign.settings import Settings
from armdesign.settings.place import sites
from armdesign.studio.arms import ASSUMED_LOAD, load_words
from armdesign.studio.motors import families, family_of
from armdesign.studio.page import Page, bad, link
from armdesign.studio.takes import keep_upload

FLOOR, BOX, SHOULDER = "on the floor, best place", "on a table, or in a box that I drag", "at the shoulder, which moves"
HAND, WHOLE = "the hand", "the whole arm, as far as it can"
MOUNTINGS = ("floor", "wall", "ceiling", "any")
HAND_SHARE, HAND_AREA = 0.95, 0.5
"""Weight of the hand, and factor of the area, where the hand is what matters."""
FOLLOW = "The hand alone takes fewer joints. An arm that is to look like the person's follows elbow and wrist, too."
LOAD = "What the arm holds at its end: a small gripper weighs about 0.5 kg."
MOTORS = "The arm is searched with room for these; N m: the most of the strongest. Others can be tried at the end."
ADDED = "cell.toml"
"""The cell file of what was added on the page."""


@dataclass
class Solid:
    """A box or cylinder that was added on the page.

    Attributes:
        name: What it is called.
        kind: ``box`` or ``cylinder``.
        center: Shape (3,) [m].
        size: Edges; of a cylinder diameter twice, then its length, shape (3,) [m].
        yaw: Its turn about the vertical [deg].
    """

    name: str
    kind: str
    center: tuple[float, float, float]
    size: tuple[float, float, float]
    yaw: float = 0.0


def cell_text(solids: list[Solid]) -> str:
    """Solids as a cell file."""
    entries = []
    for one in solids:
        x, y, z = (f"{max(edge, 1e-3):.4f}" for edge in one.size)
        size = f"size = [{x}, {y}, {z}]" if one.kind == "box" else f"radius = {one.size[0] / 2.0:.4f}\nlength = {z}"
        center = ", ".join(f"{value:.4f}" for value in one.center)
        entries.append(
            f'[[{one.kind}]]\nname = "{one.name}"\ncenter = [{center}]\nrpy = [0.0, 0.0, {one.yaw:.2f}]\n{size}\n'
        )
    return "\n".join(entries)


def longest_link(longest: float) -> float:
    """How long a link of an arm of at most so much may be: as much less as by default, 0.5 m of 1.2 m."""
    return round(max(longest - 0.7, 0.5), 3)


def region(center: tuple[float, ...], size: tuple[float, ...]) -> str:
    """A box for the base as the setting ``place`` has it.

    Args:
        center: Shape (3,) [m].
        size: Edges, shape (3,) [m].
    """
    ends = ((c - abs(s) / 2.0, c + abs(s) / 2.0) for c, s in zip(center, size, strict=True))
    texts = (f"{low:.3f}" if high - low < 1e-3 else f"{low:.3f}..{high:.3f}" for low, high in ends)
    return " ".join(f"{axis}={text}" for axis, text in zip("xyz", texts, strict=True))


def pedestal(length: float, most: float) -> dict[str, tuple[float, float]]:
    """Bounds by which an arm turns about the normal of its plate, with room for the first motor's brackets [deg, m].

    Args:
        length: Of a joint's housing with its brackets [m].
        most: How far along its axis the first joint may sit [m].
    """
    least = min(round(Settings().body.base_height + length / 2.0 + PEDESTAL + 0.02, 3), most)
    return {"alpha_0": (0.0, 0.0), "d_0": (least, most)}


def hand_first(points: int) -> dict[str, Any]:
    """Entries of the section Fitness by which the hand counts, and the rest of the person's arm hardly.

    Args:
        points: How many points of the person's arm are followed, the hand being the last.
    """
    others = (round((1.0 - HAND_SHARE) / max(points - 1, 1), 6),) * (points - 1)
    return {"weights": (*others, 1.0 - sum(others)), "lambda_E": HAND_AREA}


def reach_from_floor(recording: Recording) -> float:
    """Length of an arm on the floor that gets to all of a recording with room to bend [m].

    Args:
        recording: The recording; z is up, the floor at 0.
    """
    heights = np.concatenate([path[:, 2] for path in recording.points.values()] or [np.zeros(1)])
    highest = max((float(z) for z in heights[np.isfinite(heights)]), default=0.0)
    return float(np.clip(np.ceil(13.0 * highest) / 10.0, 0.6, 10.0))


class RoomPanel:
    """The cell."""

    def __init__(self, page: Page) -> None:
        """Lay out the panel."""
        self.page, gui = page, page.gui
        self.solids: list[Solid] = []
        self.files: list[Path] = []
        self.filling = False
        self.gizmo: Any = None
        self.room: tuple[str, dict[str, float]] = ("", {})  # that a build has turned out to take, by its motors
        with gui.add_folder("Where may the arm stand?"):
            self.stand = gui.add_dropdown("The base stands", (FLOOR, BOX, SHOULDER))
            self.mounted = gui.add_dropdown("Mounted as on a", MOUNTINGS, visible=False)
            self.center = gui.add_vector3("Box: middle [m]", (0.5, 0.0, 0.0), step=0.01, visible=False)
            self.size = gui.add_vector3("Box: edges [m]", (0.6, 0.6, 0.0), step=0.01, visible=False)
        with gui.add_folder("What stands in the way?"):
            kinds = gui.add_button_group("Add", ("Box", "Cylinder"))
            kinds.on_click(lambda event: page.work("add", lambda: self.add(event.target.value.lower())))
            upload = gui.add_upload_button("Load a mesh or a file of obstacles")
            upload.on_upload(lambda event: self.uploaded(event.target.value.name, event.target.value.content))
            self.unit = gui.add_dropdown("Unit of meshes", ("m", "cm", "mm", "in"))
            self.which = gui.add_dropdown("Change", ("nothing",), visible=False)
            self.at = gui.add_vector3("Middle [m]", (0.0, 0.0, 0.0), step=0.01, visible=False)
            self.edges = gui.add_vector3("Edges [m]", (0.3, 0.3, 0.3), min=(0.001,) * 3, step=0.01, visible=False)
            self.yaw = gui.add_number("Turn [deg]", 0.0, step=5.0, visible=False)
            self.remove = gui.add_button("Remove it", visible=False)
        with gui.add_folder("What must it do, and carry?"):
            self.load = page.html("")
            self.payload = gui.add_number(
                "It carries, gripper included [kg]", ASSUMED_LOAD, min=0.0, max=1000.0, step=0.1, hint=LOAD
            )
            self.follow = gui.add_dropdown("What follows the person", (HAND, WHOLE), hint=FOLLOW)
            self.tolerance = gui.add_number("Hand may be off by [mm], 0: any", 20.0, min=0.0, max=1000.0, step=1.0)
            self.motors = gui.add_dropdown("Motors", families(), hint=MOTORS)
            self.longest = gui.add_number("Arm at most this long [m]", 1.2, min=0.6, max=10.0, step=0.1)
            self.speed = gui.add_number("Fastest joint [deg/s], 0: any", 0.0, min=0.0, max=1e5, step=10.0)
        self.note = page.html("")
        self.remove.on_click(lambda _: page.work("remove", self.drop))
        page.watch(self, "which", self.choose, self.which)
        page.watch(self, "solid", self.reshape, self.at, self.edges, self.yaw)
        whole = (self.stand, self.mounted, self.center, self.size, self.unit, self.follow, self.tolerance)
        page.watch(self, "take", self.changed, *whole, self.longest, self.payload, self.motors, self.speed)

    def fresh(self, known: Settings | None, *, captured: bool) -> None:
        """Begin with another take.

        Args:
            known: The settings of a run that is opened; None to keep what the page asks for.
            captured: Whether a capture system has made it, so that it has a floor.
        """
        self.filling = True
        if known is None:
            self.stand.value = FLOOR if captured else SHOULDER
            self.follow.value = HAND if captured else WHOLE
            if captured and self.page.recording is not None:
                self.longest.value = max(self.longest.value, reach_from_floor(self.page.recording))
        else:
            cell, needs = known.cell, known.needs
            placed = bool(cell.place) or cell.base_at is not None
            self.stand.value = FLOOR if cell.stand == "floor" else BOX if placed else SHOULDER
            if self.stand.value == BOX:
                low, high = sites(cell)[0].box
                self.center.value, self.size.value = tuple((low + high) / 2.0), tuple(high - low)
                self.mounted.value = cell.mounted or "floor"
            self.solids, self.files = [], [Path(path) for path in cell.obstacles if Path(path).is_file()]
            self.unit.value = cell.obstacle_units or "m"
            self.tolerance.value, self.payload.value = 1e3 * (needs.hand_tolerance or 0.0), needs.payload
            self.speed.value = 0.0 if needs.max_speed is None else max(needs.max_speed)
            self.longest.value = known.design.length[1]
            self.follow.value = HAND if known.fitness.lambda_E == HAND_AREA else WHOLE
            self.which.options = ("nothing", *(f"file {path.name}" for path in self.files))
            self.which.visible = bool(self.files)
        self.filling = False

    def changed(self) -> None:
        """Something was changed: settle the task anew."""
        self.hold_box()
        self.page.panels["Recording"].settle()

    def asked(self) -> dict[str, Any]:
        """What a search is asked for here, by what it is called in a sentence."""
        boxed = self.stand.value == BOX
        return {
            "the load": self.payload.value, "the tolerance": self.tolerance.value, "the speed": self.speed.value,
            "the length": self.longest.value, "the motors": self.motors.value,
            "what follows the person": self.follow.value,
            "where it may stand": (
                self.stand.value, *((self.mounted.value, self.center.value, self.size.value) if boxed else ())
            ),
            "what stands in the way": (cell_text(self.solids), tuple(self.files), self.unit.value),
        }  # fmt: skip

    def over(self, settings: Settings) -> Settings:
        """Settings with the cell as it stands on the page.

        Args:
            settings: Of the take.

        Raises:
            ArmDesignError: Something cannot be used.
        """
        boxed = self.stand.value == BOX
        cell: dict[str, Any] = {"stand": "floor" if self.stand.value == FLOOR else None, "place": (), "mounted": None}
        if boxed:
            cell["place"] = (region(self.center.value, self.size.value),)
            cell["mounted"] = None if self.mounted.value == "floor" else self.mounted.value
        files = [str(path.resolve()) for path in self.files]
        if self.solids:
            target = self.page.folder / "takes" / ADDED
            target.parent.mkdir(parents=True, exist_ok=True)
            write_whole(target, cell_text(self.solids))
            files.append(str(target.resolve()))
        cell["obstacles"] = tuple(files)
        meshes = any(path.suffix.lower() in (".stl", ".obj", ".ply") for path in self.files)
        cell["obstacle_units"] = self.unit.value if meshes and self.unit.value != "m" else None
        needs = {
            "hand_tolerance": 1e-3 * self.tolerance.value or None,
            "payload": self.payload.value,
            "max_speed": (self.speed.value,) if self.speed.value else None,
        }
        made_for, body = self.room
        if made_for != self.motors.value:
            body = room_for_motors(family_of(self.motors.value), self.longest.value, self.payload.value)
            if self.stand.value == SHOULDER:  # nothing that is built, so no room is left for parts
                body = {name: getattr(Settings().body, name) for name in body}
        kept = {name: ends for name, ends in settings.design.bounds.items() if name not in pedestal(0.0, 1.0)}
        design: dict[str, Any] = {"bounds": kept}
        fitness: dict[str, Any] = {"weights": (), "lambda_E": Settings().fitness.lambda_E}
        if self.longest.value != settings.design.length[1]:
            most = longest_link(self.longest.value)
            design |= {name: (getattr(settings.design, name)[0], most) for name in ("a", "d")}
            design["length"] = (settings.design.length[0], self.longest.value)
        if self.stand.value != SHOULDER:
            design["bounds"] = kept | pedestal(body["joint_length"], design.get("d", settings.design.d)[1])
        if self.follow.value == HAND:
            fitness = hand_first(self.page.panels["Recording"].followed)
        changes = {"cell": cell, "needs": needs, "design": design, "body": body, "fitness": fitness}
        self.page.settings = settings.replace(changes)
        return self.page.settings

    def show(self) -> None:
        """Show the room in the scene."""
        page = self.page
        try:
            cell = page.settings.cell
            if page.problem is not None:
                page.scene.show_room(page.problem.first.obstacles.each, page.problem.space.sites)
            else:
                read = read_obstacles(cell.obstacles, cell.obstacle_units).each if cell.obstacles else ()
                page.scene.show_room(read, ())
        except ArmDesignError as error:
            page.set_html(self.note, bad(error))
            return
        told = {
            FLOOR: "The search finds the best place on the floor, in the blue area.",
            BOX: "The search finds the best place in the blue box: drag it by its arrows. On a table: z of the middle "
            "is the height of its top, z of the edges 0, mounted as on a floor, which is upright.",
            SHOULDER: "The arm hangs at the person's shoulder and moves with it: good for study, not for a workshop.",
        }
        assumed = self.payload.value == ASSUMED_LOAD
        load = f"It {load_words(self.payload.value)}, gripper included."
        load = f"<b>What does it carry, gripper included? {ASSUMED_LOAD:g} kg is assumed.</b>" if assumed else load
        ready = f"<br>{link('Search', 'Next: search the arm')}" if page.problem is not None else ""
        page.set_html(self.note, f"{told[self.stand.value]}{ready}")
        page.set_html(self.load, load)

    def hold_box(self) -> None:
        """Show what belongs to the box for the base, with a gizmo to drag it by."""
        boxed = self.stand.value == BOX
        for handle in (self.center, self.size, self.mounted):
            handle.visible = boxed
        if boxed and (self.gizmo is None or self.which.value == "nothing"):
            self.hold(self.center.value, self.dragged_box)
        elif not boxed and self.which.value == "nothing":
            self.page.scene.clear("/gizmo")

    def hold(self, at: tuple[float, ...], dragged: Any) -> None:  # noqa: ANN401 (a callback)
        """Put the gizmo somewhere.

        Args:
            at: Where, shape (3,) [m].
            dragged: Called with where it is dragged to.
        """
        self.page.scene.clear("/gizmo")
        self.gizmo = self.page.scene.api.add_transform_controls(
            "/gizmo", scale=0.3, disable_rotations=True, depth_test=False, position=at
        )
        self.gizmo.on_update(lambda event: dragged(tuple(np.round(event.target.position, 3).tolist())))

    def dragged_box(self, at: tuple[float, float, float]) -> None:
        """The box for the base was dragged."""
        self.center.value = at

    def uploaded(self, name: str, content: bytes) -> None:
        """A file of obstacles has come."""

        def wish() -> None:
            path = keep_upload(self.page.folder / "takes", name, content)
            read_obstacles([path], self.unit.value)
            self.files = [*(each for each in self.files if each != path), path]
            self.list_solids(f"file {path.name}")
            self.changed()

        self.page.work("obstacle", wish)

    def add(self, kind: str) -> None:
        """Add a solid where it is seen, beside the hand's path."""
        count = 1 + sum(one.kind == kind for one in self.solids)
        _, middle = self.page.scene.look_at(self.page.problem, 1.0)
        name = f"{kind}_{count}"
        while any(one.name == name for one in self.solids):
            count += 1
            name = f"{kind}_{count}"
        x, y = (round(float(value), 2) for value in middle[:2])
        self.solids.append(Solid(name, kind, (x + 0.3, y, 0.15), (0.3, 0.3, 0.3)))
        self.list_solids(name)
        self.changed()

    def list_solids(self, chosen: str) -> None:
        """List what was added, with one of them chosen."""
        self.filling = True
        names = ("nothing", *(one.name for one in self.solids), *(f"file {path.name}" for path in self.files))
        self.which.options, self.which.visible = names, len(names) > 1
        self.which.value = chosen if chosen in names else "nothing"
        self.filling = False
        self.choose()

    def choose(self) -> None:
        """Show what can be changed of the chosen solid."""
        one = next((each for each in self.solids if each.name == self.which.value), None)
        for handle in (self.at, self.edges, self.yaw):
            handle.visible = one is not None
        self.remove.visible = self.which.value != "nothing"
        if one is None:
            self.gizmo = None
            self.page.scene.clear("/gizmo")
            self.hold_box()
            return
        self.filling = True
        self.at.value, self.edges.value, self.yaw.value = one.center, one.size, one.yaw
        self.filling = False

        def dragged(at: tuple[float, float, float]) -> None:
            self.at.value = at

        self.hold(one.center, dragged)

    def reshape(self) -> None:
        """The chosen solid was moved or resized."""
        one = next((each for each in self.solids if each.name == self.which.value), None)
        if one is None:
            return
        one.center, one.size, one.yaw = self.at.value, self.edges.value, self.yaw.value
        if self.gizmo is not None and np.abs(np.array(self.gizmo.position) - one.center).max() > 2e-3:
            self.gizmo.position = one.center
        self.changed()

    def drop(self) -> None:
        """Remove the chosen solid or file."""
        self.solids = [one for one in self.solids if one.name != self.which.value]
        self.files = [path for path in self.files if f"file {path.name}" != self.which.value]
        self.list_solids("nothing")
        self.changed()

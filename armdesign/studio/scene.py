"""The one scene: the take, the person's arm, the room, and arms in step, all at one time."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from armdesign._types import Array
from armdesign.cell.obstacles import Box, Cylinder, Mesh, Obstacle, Plane, Sphere
from armdesign.search.design_problem import DesignProblem
from armdesign.settings.place import Site
from armdesign.studio.arms import Arm
from armdesign.studio.takes import Shot, nearest
from armdesign.views.preview.human import limb_radii
from armdesign.views.preview.shapes import rod_places

PERSON, POINT, UNSEEN = (213, 94, 0), (120, 128, 138), (200, 40, 40)
LIMB = (172, 28, 0)
"""The person's colour for viser's batches, which take a colour as linear."""
COLOURS = ("#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f5539", "#444444")
TUBE, BASE, OBSTACLE, REGION = (169, 183, 196), (61, 70, 80), (138, 127, 114), (59, 110, 165)
BALL, FLESH = 0.014, 0.55
FROM_Y = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""Turns a cylinder along z so that it runs along y, shape (4, 4)."""
PATH_POINTS = 400
MOST_TRIANGLES = 20_000
"""Larger meshes are drawn as the box about them."""


def rgb(colour: str) -> tuple[int, int, int]:
    """``#rrggbb`` as viser takes it."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def wxyz(rotations: Array) -> Array:
    """Rotation matrices, shape (..., 3, 3), as unit quaternions w, x, y, z, shape (..., 4)."""
    xyzw = Rotation.from_matrix(rotations).as_quat()
    return np.asarray(np.roll(xyzw, 1, axis=-1))


def solids_of(arm: Arm, colour: str) -> list[tuple[int, tuple[int, int, int], Any]]:
    """What an arm is drawn of: per link and colour one mesh in the link's frame.

    Args:
        arm: The arm.
        colour: Of its joints; a ready-made arm, of which only the joints are known, is rods of that colour alone.
    """
    groups: dict[tuple[int, tuple[int, int, int]], list[trimesh.Trimesh]] = {}
    if arm.result is not None:
        paint = {"joint": rgb(colour), "tube": TUBE, "base": BASE}
        for part in arm.result.body.parts:
            solid = part.solid
            mesh = trimesh.creation.cylinder(solid.radius, solid.length, sections=28, transform=solid.pose)
            groups.setdefault((part.link, paint[solid.material]), []).append(mesh)
    else:
        poses = arm.place(0)
        for link, pose in enumerate(poses):
            groups.setdefault((link, rgb(colour)), []).append(trimesh.creation.icosphere(2, 0.03))
            if link + 1 < len(poses):
                end = (np.linalg.inv(pose) @ poses[link + 1])[:3, 3]
                if np.linalg.norm(end) > 1e-6:
                    rod = trimesh.creation.cylinder(0.02, segment=[np.zeros(3), end], sections=20)
                    groups[link, rgb(colour)].append(rod)
    return [(link, paint, trimesh.util.concatenate(meshes)) for (link, paint), meshes in groups.items()]


Method = TypeVar("Method", bound=Callable[..., Any])


def one_at_a_time(method: Method) -> Method:
    """Decorate a method of the scene, so that no two threads are in it."""

    @functools.wraps(method)
    def locked(self: Scene, *values: Any, **more: Any) -> Any:  # noqa: ANN401 (as the method)
        with self.lock:
            return method(self, *values, **more)

    return locked  # type: ignore[return-value]


class Scene:
    """Everything in the picture, at a time.

    Attributes:
        time: What is shown [s].
    """

    def __init__(self, scene: Any, on_point: Callable[[str], None]) -> None:  # noqa: ANN401 (viser's SceneApi)
        """An empty floor.

        Args:
            scene: viser's scene.
            on_point: Called with the name of a point that was clicked.
        """
        self.api, self.on_point, self.time = scene, on_point, 0.0
        self.lock = threading.RLock()
        self.framed = (np.zeros(3), np.zeros(3))  # what the cameras were turned to, its ends [m]
        self.shot: Shot | None = None
        self.arms: tuple[Arm, ...] = ()
        self.obstacles: list[tuple[Obstacle, Any]] = []
        self.links: list[list[Any]] = []
        self.balls: Any = None
        self.person: list[Any] = []
        scene.set_up_direction("+z")
        scene.configure_default_lights(cast_shadow=False)
        scene.add_grid("/floor", width=6.0, height=6.0, cell_size=0.1, section_size=0.5)

    def clear(self, name: str) -> None:
        """Take something out."""
        handle = self.api.get_handle_by_name(name)
        if handle is not None:
            handle.remove()

    @one_at_a_time
    def show_take(self, shot: Shot | None) -> None:
        """Show a take, its points and the person's arm."""
        for name in ("/points", "/person", "/hand"):
            self.clear(name)
        self.shot, self.balls, self.person = shot, None, []
        if shot is None:
            return
        count = len(shot.names)
        if count:
            ball = trimesh.creation.icosphere(1, BALL)
            still = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
            self.balls = self.api.add_batched_meshes_simple(
                "/points", ball.vertices, ball.faces, still, np.zeros((count, 3)), batched_scales=np.ones(count),
                batched_colors=POINT,
            )  # fmt: skip
            self.balls.on_click(lambda event: self.on_point(shot.names[event.instance_index or 0]))
        self.show_person("/person", shot.chain)
        self.show_time(self.time)

    def show_person(self, name: str, chain: Array) -> None:
        """The person's arm as limbs, rounded where they meet, and the path of the hand.

        Args:
            name: Node.
            chain: Shape (T, k, 3) [m].
        """
        if chain.shape[1] < 2:
            return
        radii = limb_radii(chain.shape[1] - 1)
        solids = trimesh.creation.cylinder(1.0, 1.0, sections=24, transform=FROM_Y), trimesh.creation.icosphere(2, 1.0)
        self.person = [
            self.api.add_batched_meshes_simple(
                f"{name}/{k}", solid.vertices, solid.faces, np.tile([1.0, 0.0, 0.0, 0.0], (len(radii), 1)),
                np.zeros((len(radii), 3)), batched_scales=np.tile(radii[:, None], (1, 3)), batched_colors=LIMB,
                opacity=FLESH,
            )
            for k, solid in enumerate(solids)
        ]  # fmt: skip
        frames = np.unique(np.linspace(0, len(chain) - 1, PATH_POINTS).astype(int))
        hand = chain[frames, -1]
        path = np.stack([hand[:-1], hand[1:]], axis=1)
        path = path[np.isfinite(path).all(axis=(1, 2))]
        if len(path):
            self.api.add_line_segments("/hand", path, PERSON, thickness=1.5, thickness_units="screen")

    @one_at_a_time
    def show_arms(self, arms: Sequence[Arm], colours: Sequence[str]) -> None:
        """Show arms, each in its colour.

        Args:
            arms: The arms.
            colours: One each.
        """
        self.clear("/arms")
        self.arms, self.links = (), []
        for k, (arm, colour) in enumerate(zip(arms, colours, strict=True)):
            links = [self.api.add_frame(f"/arms/{k}/{link}", show_axes=False) for link in range(len(arm.at(self.time)))]
            for n, (link, paint, mesh) in enumerate(solids_of(arm, colour)):
                self.api.add_mesh_simple(
                    f"/arms/{k}/{link}/{n}", mesh.vertices, mesh.faces, color=paint, flat_shading=True,
                    opacity=None if len(arms) < 3 or not k else 0.6,
                )  # fmt: skip
            self.links.append(links)
        self.arms = tuple(arms)
        self.show_time(self.time)

    @one_at_a_time
    def show_room(self, obstacles: Sequence[Obstacle], sites: Sequence[Site]) -> None:
        """Show what stands in the room, and where the base may stand.

        Args:
            obstacles: What there is; half spaces are left to the floor.
            sites: The regions.
        """
        self.clear("/room")
        self.obstacles = []
        for k, one in enumerate(each for each in obstacles if not isinstance(each.shape, Plane)):
            mesh = obstacle_mesh(one)
            handle = self.api.add_mesh_simple(
                f"/room/{k}", mesh.vertices, mesh.faces, color=OBSTACLE, opacity=0.7, flat_shading=True
            )
            self.obstacles.append((one, handle))
        for k, site in enumerate(sites):
            low, high = site.box
            if np.isfinite(site.box).all() and np.ptp(site.box, axis=0).max() > 1e-3:
                size = np.maximum(high - low, 4e-3)
                self.api.add_box(
                    f"/room/site_{k}", color=REGION, dimensions=size, opacity=0.25, position=(low + high) / 2.0
                )
        self.show_time(self.time)

    @one_at_a_time
    def show_time(self, time: float) -> None:
        """Move everything to where it is at a time [s]."""
        self.time = time
        if self.shot is not None:
            if self.balls is not None:
                places = self.shot.at(time)
                seen = np.isfinite(places[:, 0])
                self.balls.batched_positions = np.where(seen[:, None], places, 0.0).astype(np.float32)
                self.balls.batched_scales = np.where(seen, 1.0, 1e-6).astype(np.float32)
            if self.person:
                body = self.shot.chain[nearest(self.shot.recording.time, time)]
                limbs, bends = self.person
                middle, turn, length = rod_places(body[:-1], body[1:])
                radii = limb_radii(len(length))
                limbs.batched_positions, limbs.batched_wxyzs = middle.astype(np.float32), np.roll(turn, 1, axis=1)
                limbs.batched_scales = np.stack([radii, length, radii], axis=1).astype(np.float32)
                bends.batched_positions = body[:-1].astype(np.float32)
        for arm, links in zip(self.arms, self.links, strict=False):
            poses = arm.at(time)
            for link, pose, turn in zip(links, poses, wxyz(poses[:, :3, :3]), strict=True):
                link.position, link.wxyz = pose[:3, 3] + self.moved(arm, time), turn
        for one, handle in self.obstacles:
            frames = max(len(one.poses) - 1, 0)
            times = self.arms[0].time if self.arms else np.arange(frames + 1.0)
            pose = one.poses[min(nearest(times, time), frames)]
            handle.position, handle.wxyz = pose[:3, 3], wxyz(pose[:3, :3])

    def moved(self, arm: Arm, time: float) -> Array:
        """Where the shoulder is that an arm hangs at, as seen from the room; nowhere of an arm with a place, (3,)."""
        loose = arm.result is not None and arm.result.base_pose.frame == "base"
        if not loose or self.shot is None or self.shot.chain.shape[1] == 0:
            return np.zeros(3)
        return np.asarray(self.shot.chain[nearest(self.shot.recording.time, time), 0])

    @property
    def outgrown(self) -> bool:
        """Whether the arms reach out of what the cameras were turned to."""
        low, high = self.ends(None)
        return bool((low < self.framed[0] - 0.05).any() or (high > self.framed[1] + 0.05).any())

    @one_at_a_time
    def ends(self, problem: DesignProblem | None) -> tuple[Array, Array]:
        """The corners of the box about all that counts, shape (3,) each [m].

        Args:
            problem: What is searched for; None where that is not settled.
        """
        points = np.zeros((0, 1, 3)) if problem is None else problem.in_room.task.arm + problem.shift
        if self.shot is not None:
            points = self.shot.chain if self.shot.chain.shape[1] else self.shot.places
        standing = [arm for arm in self.arms if arm.result is None or arm.result.placed]
        bodies = [arm.place(k)[:, :3, 3] for arm in standing for k in range(0, len(arm.time), 20)]
        flat = np.concatenate([points.reshape(-1, 3), *bodies])
        flat = flat[np.isfinite(flat).all(axis=1)]
        low, high = (flat.min(axis=0), flat.max(axis=0)) if len(flat) else np.zeros((2, 3))
        sites = () if problem is None else problem.space.sites
        low[2] = min(low[2], *(site.box[0, 2] for site in sites), np.inf)
        return low, high

    @one_at_a_time
    def look_at(self, problem: DesignProblem | None, fov: float) -> tuple[Array, Array]:
        """From where to where to look so that the take or task is seen down to where the arm stands, (3,) each [m].

        Args:
            problem: What is searched for; None where that is not settled.
            fov: Width of the view [rad].
        """
        self.framed = low, high = self.ends(problem)
        middle, radius = (low + high) / 2.0, max(float(np.linalg.norm(high - low)) / 2.0, 0.4)
        way = np.array([0.55, -0.77, 0.32])
        return middle + way * (1.1 * radius / np.sin(fov / 2.0)), middle


def obstacle_mesh(one: Obstacle) -> Any:  # noqa: ANN401 (a trimesh.Trimesh)
    """An obstacle's shape in its own frame; of a large mesh the box about it."""
    match one.shape:
        case Sphere(radius=radius):
            return trimesh.creation.icosphere(3, radius)
        case Cylinder(radius=radius, length=length):
            return trimesh.creation.cylinder(radius, length, sections=40)
        case Mesh() if len(one.shape.faces) <= MOST_TRIANGLES:
            return trimesh.Trimesh(one.shape.vertices, one.shape.faces, process=False)
        case Mesh():
            mesh = trimesh.creation.box(2.0 * one.shape.extents)
            return mesh.apply_translation(one.shape.middle)
        case Box(size=size):
            return trimesh.creation.box(size)
    raise TypeError(f"no picture of a {type(one.shape).__name__}")

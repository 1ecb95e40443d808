"""Obstacles from files: cell files in TOML, meshes (STL, OBJ, PLY) and the collision shapes of URDF scenes."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
import scipy

from armdesign._types import Array
from armdesign.cell.obstacles import Box, Cylinder, Mesh, Obstacle, Obstacles, Plane, Shape, Sphere
from armdesign.errors import ObstacleError, counted
from armdesign.files import is_number
from armdesign.settings.kinds import LENGTHS

if TYPE_CHECKING:
    import trimesh

MESHES = (".stl", ".obj", ".ply")
SMALLEST, LARGEST = 1e-3, 100.0
"""Sizes that an obstacle of a cell has; beyond them its unit is wrong [m]."""
LIKELY = 0.02, 20.0
"""Sizes that most obstacles have [m]."""
MOST = 200
"""Obstacles of one cell."""


class Kind(NamedTuple):
    """What an entry of a cell file holds, besides name, center, rpy and carried_by.

    Attributes:
        needs: Entries that it must have.
        make: The shape of a checked entry.
        placed: Whether it has a center.
    """

    needs: tuple[str, ...]
    make: Callable[[Entry], Shape]
    placed: bool = True


class Entry:
    """One entry of a cell file, read key by key.

    Attributes:
        where: File and entry, for messages.
        content: Its keys and values.
        folder: The folder that files count from.
    """

    def __init__(self, where: str, content: Mapping[str, Any], folder: Path) -> None:
        """Of a file's table."""
        self.where, self.content, self.folder = where, content, folder

    def length(self, key: str) -> float:
        """A size [m].

        Raises:
            ObstacleError: It is no number above 0, or not one of a cell.
        """
        value = self.content[key]
        if not is_number(value) or value <= 0.0:
            raise ObstacleError(f"{self.where}: {key} is {value!r}", value=value, allowed="a length above 0 [m]")
        check_size(f"{self.where}: {key}", float(value))
        return float(value)

    def vector(self, key: str, what: str = "three numbers") -> Array:
        """Three numbers.

        Raises:
            ObstacleError: They are something else.
        """
        value = self.content.get(key, [0.0, 0.0, 0.0])
        if not isinstance(value, list) or len(value) != 3 or not all(map(is_number, value)):
            raise ObstacleError(f"{self.where}: {key} is {value!r}", value=value, allowed=what)
        return np.array(value, dtype=float)


def box_of(entry: Entry) -> Shape:
    """A box."""
    size = entry.vector("size", "three lengths above 0 [m]")
    if (size <= 0.0).any():
        raise ObstacleError(
            f"{entry.where}: size is {size.tolist()}", value=size.tolist(), allowed="three lengths above 0 [m]"
        )
    check_size(f"{entry.where}: size", float(size.max()))  # a sheet may be as thin as it likes
    return Box(size)


def mesh_of(entry: Entry) -> Shape:
    """A mesh from the file that an entry names."""
    file, unit = entry.content["file"], entry.content.get("units", "m")
    if not isinstance(file, str):
        raise ObstacleError(f"{entry.where}: file is {file!r}", value=file, allowed="a path")
    scale = unit_of(f"{entry.where}: units", unit)
    try:
        return read_mesh(entry.folder / file, scale)
    except ObstacleError as error:
        raise ObstacleError(f"{entry.where}: {error}", value=error.value) from error


KINDS: Mapping[str, Kind] = {
    "box": Kind(("size",), box_of),
    "sphere": Kind(("radius",), lambda entry: Sphere(entry.length("radius"))),
    "cylinder": Kind(("radius", "length"), lambda entry: Cylinder(entry.length("radius"), entry.length("length"))),
    "plane": Kind(("point", "normal"), lambda _: Plane(), placed=False),
    "mesh": Kind(("file",), mesh_of),
}
OPTIONAL: Mapping[str, tuple[str, ...]] = {"mesh": ("units",)}


def read_obstacles(paths: Sequence[str | Path], units: str | None = None) -> Obstacles:
    """Read what stands in the room.

    Args:
        paths: Cell files (TOML), meshes (STL, OBJ, PLY) and URDF scenes.
        units: Unit of length of meshes given by their path: m, cm, mm or in; metres by default.

    Raises:
        ObstacleError: A file cannot be read, or holds what cannot stand in a room; the message names file and entry.
    """
    found: list[Obstacle] = []
    scale = unit_of("the unit of meshes", units or "m")
    for path in map(Path, paths):
        suffix = path.suffix.lower()
        if not path.is_file():
            raise ObstacleError(f"there is no file of obstacles {path}", value=str(path), fix="Check the path")
        if suffix == ".toml":
            found += read_cell_file(path)
        elif suffix in MESHES:
            found.append(Obstacle(path.stem, read_mesh(path, scale), np.eye(4), source=str(path)))
        elif suffix in (".urdf", ".xml"):
            found += read_scene(path)
        else:
            allowed = "cell files (.toml), meshes (.stl, .obj, .ply), URDF scenes (.urdf)"
            raise ObstacleError(f"{path} is no file of obstacles by its ending", value=suffix, allowed=allowed)
    names: dict[str, str] = {}
    for one in found:
        if one.name in names:
            also = "" if names[one.name] == one.source else f" and in {names[one.name]}"
            raise ObstacleError(
                f"{one.source}: two obstacles are called '{one.name}'{also}", value=one.name, fix="Rename one of them"
            )
        names[one.name] = one.source
    if len(found) > MOST:
        raise ObstacleError(f"there are {len(found)} obstacles", value=len(found), allowed=f"up to {MOST}")
    return Obstacles(tuple(found))


def read_cell_file(path: Path) -> list[Obstacle]:
    """The obstacles of a cell file.

    Raises:
        ObstacleError: It is not TOML, or an entry is none; the message names it.
    """
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ObstacleError(f"cannot read {path}: {error.strerror}", value=str(path)) from error
    except UnicodeDecodeError as error:
        raise ObstacleError(f"{path} is not UTF-8 text", value=str(path)) from error
    except (ValueError, RecursionError) as error:
        raise ObstacleError(f"{path} is not valid TOML: {error}", value=str(path)) from error
    found = []
    for title, entries in tables.items():
        if title not in KINDS:
            raise ObstacleError(f"{path}: unknown shape '{title}'", value=title, allowed=meant(title, KINDS))
        if not isinstance(entries, list) or not all(isinstance(entry, Mapping) for entry in entries):
            raise ObstacleError(f"{path}: '{title}' is no list of shapes", value=title, fix=f"Write [[{title}]]")
        for k, content in enumerate(entries, start=1):
            found.append(obstacle_of(title, k, content, path))
    if not found:
        raise ObstacleError(f"{path} holds no obstacle", value=str(path), allowed=[f"[[{title}]]" for title in KINDS])
    return found


def obstacle_of(title: str, k: int, content: Mapping[str, Any], path: Path) -> Obstacle:
    """One entry of a cell file as an obstacle.

    Args:
        title: Its kind.
        k: Its number among those of its kind, from 1.
        content: Its keys and values.
        path: The file.

    Raises:
        ObstacleError: A key is unknown or missing, or a value is none.
    """
    kind, name = KINDS[title], content.get("name", f"{title}_{k}")
    if not isinstance(name, str) or not name.strip() or len(name) > 80 or not name.isprintable():
        allowed = "a text of 1 to 80 printable characters"
        raise ObstacleError(f"{path}: the name of {title} {k} is {name!r}", value=name, allowed=allowed)
    where = f"{path}, {title} '{name}'"
    # a half space has no end: turned by what carries it, its far parts would move at any speed
    where_it_is = ("center", "rpy", "carried_by") if kind.placed else ()
    known = ["name", *kind.needs, *OPTIONAL.get(title, ()), *where_it_is]
    for key in content:
        if key not in known:
            raise ObstacleError(f"{where}: unknown key '{key}'", value=key, allowed=meant(key, known))
    for key in kind.needs:
        if key not in content:
            raise ObstacleError(f"{where}: {key} is missing", value=key, fix=f"Add '{key} = ...'")
    carried = content.get("carried_by")
    if carried is not None and not isinstance(carried, str):
        raise ObstacleError(
            f"{where}: carried_by is {carried!r}", value=carried, allowed="name of a body of the recording"
        )
    entry = Entry(where, content, path.parent)
    pose = np.eye(4)
    if kind.placed:
        pose[:3, :3] = scipy.spatial.transform.Rotation.from_euler(
            "xyz", entry.vector("rpy", "roll, pitch, yaw [deg]"), degrees=True
        ).as_matrix()
        pose[:3, 3] = entry.vector("center", "x, y, z [m]")
    else:
        pose = plane_pose(entry.vector("point", "x, y, z [m]"), entry.vector("normal"), where)
    far = float(np.abs(pose[:3, 3]).max())
    if far > LARGEST:
        raise ObstacleError(
            f"{where}: it stands {far:g} m from the room's origin", value=far, allowed=f"up to {LARGEST:g} m", fix=HINT
        )
    return Obstacle(name, kind.make(entry), pose, carried, str(path))


HINT = "Lengths are in metres: 500 mm is 0.5"


def plane_pose(point: Array, normal: Array, where: str) -> Array:
    """Pose of a half space whose surface goes through a point, z along its normal, shape (4, 4).

    Args:
        point: Shape (3,) [m].
        normal: Points to the free side, shape (3,).
        where: What it is, for the message.

    Raises:
        ObstacleError: The normal has no length.
    """
    length = float(np.linalg.norm(normal))
    if length < 1e-9:
        raise ObstacleError(f"{where}: normal is {normal.tolist()}", value=normal.tolist(), allowed="not 0, 0, 0")
    z = normal / length
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = x, np.cross(z, x), z, point
    return pose


def read_mesh(path: Path, scale: float | Array) -> Mesh:
    """A closed mesh from a file.

    Args:
        path: STL, OBJ or PLY.
        scale: Metres per unit of the file; or one for each of its axes, shape (3,).

    Raises:
        ObstacleError: It cannot be read, is not closed, or has a size that no obstacle has.
    """
    if path.suffix.lower() not in MESHES:
        raise ObstacleError(f"{path} is no mesh by its ending", value=path.suffix, allowed=list(MESHES))
    if not path.is_file():
        raise ObstacleError(f"there is no mesh {path}", value=str(path), fix="Paths count from the folder of the file")
    import trimesh  # noqa: PLC0415 (a third of a second, for all searches)

    try:
        loaded = trimesh.load(path, file_type=path.suffix[1:].lower(), force="mesh", process=True)
    except Exception as error:  # trimesh raises whatever its readers do
        raise ObstacleError(f"cannot read the mesh {path}: {first_line(error)}", value=str(path)) from error
    if not isinstance(loaded, trimesh.Trimesh) or not len(loaded.faces):
        raise ObstacleError(f"the mesh {path} has no triangles", value=str(path))
    return closed_mesh(loaded, str(path), scale)


def closed_mesh(loaded: trimesh.Trimesh, where: str, scale: float | Array) -> Mesh:
    """A mesh that is closed, its triangles counter-clockwise from outside.

    Args:
        loaded: The mesh.
        where: Where it was read, for messages.
        scale: Metres per unit; or one for each axis, shape (3,).

    Raises:
        ObstacleError: It is not closed, or its size is none of an obstacle.
    """
    if not np.isfinite(loaded.vertices).all():
        raise ObstacleError(f"the mesh {where} has corners that are no numbers", value=where)
    loaded.merge_vertices(merge_tex=True, merge_norm=True)
    size = float(np.abs(scale * np.ptp(loaded.vertices, axis=0)).max())
    check_size(f"the mesh {where}", size, unit_hint(float(np.ptp(loaded.vertices, axis=0).max())))
    edges = np.sort(loaded.edges, axis=1)
    _, uses = np.unique(edges, axis=0, return_counts=True)
    open_edges = int((uses % 2 == 1).sum())
    if open_edges:
        raise ObstacleError(
            f"the mesh {where} is not closed: {counted(open_edges, 'edge')} of {counted(len(uses), 'edge')} "
            f"{'belongs' if open_edges == 1 else 'belong'} to an odd number of triangles", value=open_edges,
            allowed="closed meshes, whose inside is known", fix="Close it in a mesh editor, or put boxes in its place",
        )  # fmt: skip
    if not loaded.is_winding_consistent or loaded.volume < 0.0:
        loaded.fix_normals(multibody=True)
    return Mesh(scale * np.asarray(loaded.vertices, dtype=float), np.asarray(loaded.faces, dtype=np.int64))


def unit_hint(size: float) -> str:
    """What to do about a mesh of a wrong unit.

    Args:
        size: Its largest edge in the file's units.
    """
    fitting = [unit for unit, metres in LENGTHS.items() if LIKELY[0] <= size * metres <= LIKELY[1]]
    if not fitting:
        return "Set its unit: units = ... in the cell file, or --obstacle-units"
    unit = "mm" if "mm" in fitting else fitting[0]
    measures = f"its {size:g} units would be {size * float(LENGTHS[unit]):g} m"
    return f'In {unit} {measures}: set units = "{unit}" in the cell file, or --obstacle-units {unit}'


def read_scene(path: Path) -> list[Obstacle]:
    """The collision shapes of a URDF, its joints at 0, as obstacles that stand still.

    Raises:
        ObstacleError: It cannot be read, has no collision shapes, or a mesh of it is missing.
    """
    try:
        root = ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, OSError, ValueError) as error:
        raise ObstacleError(f"the scene {path} is not valid XML: {first_line(error)}", value=str(path)) from error
    if root.tag != "robot":
        raise ObstacleError(f"the scene {path} holds <{root.tag}>", value=root.tag, allowed="a URDF, <robot>")
    import yourdfpy  # noqa: PLC0415 (loads trimesh)

    try:
        scene = yourdfpy.URDF.load(
            str(path), build_scene_graph=True, build_collision_scene_graph=False, load_meshes=False,
            load_collision_meshes=False, mesh_dir=str(path.parent),
        )  # fmt: skip
        scene.update_cfg(np.zeros(len(scene.actuated_joint_names)))
    except Exception as error:  # yourdfpy raises whatever its readers do
        raise ObstacleError(f"cannot read the scene {path}: {first_line(error)}", value=str(path)) from error
    found = []
    for link in scene.robot.links:
        pose = scene.get_transform(link.name) if link.name in scene.scene.graph.nodes else np.eye(4)
        for k, collision in enumerate(link.collisions, start=1):
            name = link.name if len(link.collisions) == 1 else f"{link.name} {k}"
            own = np.eye(4) if collision.origin is None else collision.origin
            found.append(Obstacle(name, scene_shape(collision.geometry, name, path), pose @ own, source=str(path)))
    if not found:
        raise ObstacleError(f"the scene {path} has no collision shapes", value=str(path))
    return found


def scene_shape(geometry: Any, name: str, path: Path) -> Shape:  # noqa: ANN401 (a yourdfpy Geometry)
    """The shape of a collision element.

    Args:
        geometry: The element.
        name: What it is called.
        path: The URDF.

    Raises:
        ObstacleError: It has none, or its mesh cannot be used.
    """
    where = f"{path}, {name}"
    shape: Shape
    if geometry.box is not None:
        shape = Box(np.asarray(geometry.box.size, dtype=float).reshape(3))
    elif geometry.sphere is not None:
        shape = Sphere(float(geometry.sphere.radius))
    elif geometry.cylinder is not None:
        shape = Cylinder(float(geometry.cylinder.radius), float(geometry.cylinder.length))
    elif geometry.mesh is not None:
        scale = geometry.mesh.scale
        return read_mesh(mesh_file(geometry.mesh.filename, path, where), 1.0 if scale is None else np.asarray(scale))
    else:
        raise ObstacleError(f"{where}: its collision shape is none", allowed="box, sphere, cylinder, mesh")
    sizes = shape.extents[: SIZES_OF[type(shape)]]
    if not (sizes > 0.0).all():
        raise ObstacleError(f"{where}: a size is not above 0", value=sizes.tolist(), allowed="lengths above 0 [m]")
    check_size(where, 2.0 * float(sizes.max()))
    return shape


SIZES_OF: Mapping[type, int] = {Box: 3, Sphere: 1, Cylinder: 2}
"""How many sizes a shape has."""


def mesh_file(filename: str, path: Path, where: str) -> Path:
    """The file of a scene's mesh: beside the URDF, or of a package somewhere above it.

    Args:
        filename: What the URDF names: a path, file:// or package://NAME/path.
        path: The URDF.
        where: What needs it, for the message.

    Raises:
        ObstacleError: There is none.
    """
    inside = filename.removeprefix("file://")
    _, package, within = inside.partition("package://")
    inside = within if package else inside
    # a package's folder may be called otherwise than the package
    below = [inside, inside.partition("/")[2]] if package else [inside]
    for folder in (path.parent, *path.resolve().parent.parents):
        for name in below:
            if name and (folder / name).is_file():
                return folder / name
        if not package:
            break
    raise ObstacleError(f"{where}: there is no mesh {filename}", value=filename, fix="Put it beside the URDF")


def unit_of(what: str, unit: object) -> float:
    """Metres per unit.

    Raises:
        ObstacleError: There is no such unit.
    """
    if not isinstance(unit, str) or unit not in LENGTHS:
        raise ObstacleError(f"{what} is {unit!r}", value=unit, allowed=list(LENGTHS))
    return float(LENGTHS[unit])


def check_size(what: str, size: float, fix: str = HINT) -> None:
    """Refuse sizes that no obstacle has, which come of a wrong unit.

    Args:
        what: What has the size.
        size: The size [m].
        fix: What to do about it.

    Raises:
        ObstacleError: It is below a millimetre or above 100 m.
    """
    if SMALLEST <= size <= LARGEST:
        return
    shown = f"{1e3 * size:g} mm" if size < SMALLEST else f"{size:g} m"
    allowed = f"{1e3 * SMALLEST:g} mm to {LARGEST:g} m"
    raise ObstacleError(f"{what} measures {shown}, which no obstacle does", value=size, allowed=allowed, fix=fix)


def meant(name: str, known: Sequence[str] | Mapping[str, Any]) -> list[str]:
    """Names like a wrong one, or all there are."""
    return difflib.get_close_matches(name, list(known), n=3) or list(known)


def first_line(error: Exception) -> str:
    """What a library says of a file, without its further lines."""
    return (str(error).splitlines() or [type(error).__name__])[0][:200]

"""The kinds of file that only a build has: each a function of the build that gives files by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from armdesign._types import Array
from armdesign.building.build import Build, assembly_of
from armdesign.building.hrdf import hrdf
from armdesign.building.part_lists import part_lists
from armdesign.building.parts import Part, Prism, file_name
from armdesign.building.solids import solid, step_file, stl_file
from armdesign.errors import CatalogueError


def step_files(build: Build) -> dict[str, bytes]:
    """Every part that is made, and the whole arm with all joints at zero, as STEP [mm]."""
    assembly = assembly_of(build)
    shapes = {name: solid(part) for name, (part, _) in assembly.counted().items()}
    files = {
        f"step/{file_name(name)}.step": step_file([(name, shapes[name], name, np.eye(4))])
        for name, (part, _) in assembly.counted().items() if not part.bought
    }  # fmt: skip
    whole = [
        (f"{each.mark} {each.part.name}", shapes[each.part.name], each.part.name, pose)
        for each, pose in assembly.posed(build.result.table, np.zeros(build.result.table.dof))
    ]
    return {"step/arm.step": step_file(whole), **files}


def stl_files(build: Build) -> dict[str, bytes]:
    """Every part that is made as a closed mesh, binary STL [mm]."""
    kinds = assembly_of(build).counted()
    return {f"stl/{file_name(name)}.stl": stl_file(part) for name, (part, _) in kinds.items() if not part.bought}


def mesh_files(build: Build) -> dict[str, bytes]:
    """Every part, those that are bought too, as a closed mesh for a robot file, binary STL [mm]."""
    kinds = assembly_of(build).counted()
    return {mesh_name(part): stl_file(part) for part, _ in kinds.values()}


def mesh_name(part: Part) -> str:
    """The file of a part's mesh beside a robot file."""
    return f"meshes/{file_name(part.name)}.stl"


def mesh_places(build: Build) -> dict[int, list[tuple[str, Array, str]]]:
    """The meshes of every link: file, pose in the link's frame, shape (4, 4) [m], and colour."""
    found: dict[int, list[tuple[str, Array, str]]] = {}
    for each in assembly_of(build).placed:
        found.setdefault(each.link, []).append((mesh_name(each.part), each.pose, each.part.look))
    return found


def hrdf_files(build: Build) -> dict[str, str]:
    """The arm as HEBI's robot configuration, which their software reads.

    Raises:
        CatalogueError: It is not built of HEBI's links and brackets.
    """
    if build.kit is None:
        raise CatalogueError(
            "HRDF holds arms of HEBI's actuators, links and brackets, and this one is of other parts",
            value=build.options.catalogue, allowed="builds of hebi or hebi-x without --stock and --printed",
        )  # fmt: skip
    return {"arm.hrdf": hrdf(build.result.body, build.choice.actuators, build.kit, build.result.name)}


def drawings(build: Build) -> Mapping[str, str | bytes]:
    """Sheets of the arm, of all parts and of each, as SVG and one PDF."""
    from armdesign.building.part_drawing import drawing_files  # noqa: PLC0415 (Matplotlib takes its time)

    return drawing_files(build)


BUILD_FORMATS: Mapping[str, Callable[[Build], Mapping[str, str | bytes]]] = {
    "step": step_files, "stl": stl_files, "drawing": drawings, "bom": part_lists, "hrdf": hrdf_files,
}  # fmt: skip
"""Kinds of file of builds, and what makes them."""


def extent(part: Part) -> tuple[float, float, float]:
    """Sides of the box about a part in its own frame, smallest first [m]."""
    points: list[Array] = []
    for form in part.solids:
        if isinstance(form, Prism):
            points += [*form.ends.reshape(-1, 3)]
        else:
            u = (form.end - form.start) / np.linalg.norm(form.end - form.start)
            around = form.radius * np.sqrt(np.maximum(1.0 - u**2, 0.0))
            points += [end + sign * around for end in (form.start, form.end) for sign in (1.0, -1.0)]
    a, b, c = sorted(np.ptp(np.array(points), axis=0).tolist())
    return a, b, c


def printing_notes(build: Build, printer: Sequence[float]) -> list[str]:
    """What cannot be printed on a printer, and what to do, in a sentence; nothing where all can.

    Tubes are cut, not printed.

    Args:
        build: The build.
        printer: Sides of what it prints [m].
    """
    room = sorted(printer)
    large = [
        f"{name} ({' x '.join(f'{side * 1e3:.0f}' for side in extent(part))} mm)"
        for name, (part, _) in assembly_of(build).counted().items()
        if not part.bought and part.kind != "tube" and any(s > r for s, r in zip(extent(part), room, strict=True))
    ]
    if not large:
        return []
    return [f"The printer takes {' x '.join(f'{side * 1e3:.0f}' for side in room)} mm, too little for "
            f"{', '.join(large)}: mill these of aluminium, or build with thinner tubes or a smaller base."]  # fmt: skip

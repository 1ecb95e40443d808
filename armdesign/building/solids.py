"""Parts as CAD solids: STEP and STL, in millimetres, by Open CASCADE (extra ``cad``)."""

from __future__ import annotations

import importlib
import re
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from armdesign._types import Array
from armdesign.building.parts import Part, Prism, Rod
from armdesign.errors import CatalogueError, MissingExtraError

MM = 1e3
FINENESS = (0.05, 0.2)
"""How far meshes are from the solids at most [mm], and their faces' angle [rad]."""
BEYOND = 2.0
"""How far holes are drilled beyond the face they leave through [mm]."""
STAMP = re.compile(r"(FILE_NAME\([^,]*,)'[^']*'")
"""Of a STEP file: when it was written, which would make every file another one."""


def occ(name: str) -> Any:  # noqa: ANN401 (a module without types)
    """A module of Open CASCADE.

    Raises:
        MissingExtraError: It is not installed.
    """
    try:
        return importlib.import_module(f"OCP.{name}")
    except ImportError as error:
        raise MissingExtraError(
            "STEP and STL need Open CASCADE, which is not installed", fix="pip install 'armdesign[cad]'"
        ) from error


def solid(part: Part) -> Any:  # noqa: ANN401 (a TopoDS_Shape)
    """A part as a solid in its own frame [mm].

    Raises:
        CatalogueError: What comes out is no valid solid, as of dimensions that do not go together.
    """
    algo, upgrade = occ("BRepAlgoAPI"), occ("ShapeUpgrade")
    shape, *more = [formed(each) for each in part.solids]
    for each in more:  # one after the other: what touches within a compound is not fused
        shape = algo.BRepAlgoAPI_Fuse(shape, each).Shape()
    if part.holes:
        shape = algo.BRepAlgoAPI_Cut(shape, together(formed(hole, drilled=True) for hole in part.holes)).Shape()
    unify = upgrade.ShapeUpgrade_UnifySameDomain(shape, True, True, False)
    unify.Build()
    shape = unify.Shape()
    if not occ("BRepCheck").BRepCheck_Analyzer(shape).IsValid() or volume(shape) <= 0.0 or count(shape) != 1:
        raise CatalogueError(f"{part.name} is no valid solid", value=dict(part.sizes))
    return shape


def count(shape: Any) -> int:  # noqa: ANN401
    """How many solids a shape consists of."""
    solid = occ("TopAbs").TopAbs_ShapeEnum.TopAbs_SOLID
    each, found = occ("TopExp").TopExp_Explorer(shape, solid), 0
    while each.More():
        found += 1
        each.Next()
    return found


def formed(form: Prism | Rod, *, drilled: bool = False) -> Any:  # noqa: ANN401
    """A prism or rod as a shape [mm].

    Args:
        form: The prism or rod.
        drilled: Whether it is a hole, which then goes on beyond the face it leaves through.
    """
    gp, prim, build = occ("gp"), occ("BRepPrimAPI"), occ("BRepBuilderAPI")
    if isinstance(form, Rod):
        start, end = MM * form.start, MM * form.end
        way = (end - start) / np.linalg.norm(end - start)
        if drilled and form.oblique:
            end = end + (BEYOND + 2.0 * MM * form.radius) * way
        frame = gp.gp_Ax2(gp.gp_Pnt(*start.tolist()), gp.gp_Dir(*way.tolist()))
        return prim.BRepPrimAPI_MakeCylinder(frame, MM * form.radius, float(np.linalg.norm(end - start))).Shape()
    outline = build.BRepBuilderAPI_MakePolygon()
    for corner in (MM * form.ends[0]).tolist():
        outline.Add(gp.gp_Pnt(*corner))
    outline.Close()
    face = build.BRepBuilderAPI_MakeFace(outline.Wire(), True).Face()
    return prim.BRepPrimAPI_MakePrism(face, gp.gp_Vec(0.0, 0.0, MM * form.width)).Shape()


def together(shapes: Iterable[Any]) -> Any:  # noqa: ANN401
    """Several shapes as one compound."""
    builder, compound = occ("BRep").BRep_Builder(), occ("TopoDS").TopoDS_Compound()
    builder.MakeCompound(compound)
    for shape in shapes:
        builder.Add(compound, shape)
    return compound


def volume(shape: Any) -> float:  # noqa: ANN401
    """[mm^3]."""
    properties = occ("GProp").GProp_GProps()
    occ("BRepGProp").BRepGProp.VolumeProperties_s(shape, properties)
    return float(properties.Mass())


def mesh(shape: Any) -> Any:  # noqa: ANN401
    """The triangles of a shape as a closed trimesh.Trimesh [mm]."""
    import trimesh  # noqa: PLC0415 (0.4 s of CPU, for all commands)

    explorer, top, brep = occ("TopExp"), occ("TopAbs"), occ("BRep")
    occ("BRepMesh").BRepMesh_IncrementalMesh(shape, FINENESS[0], False, FINENESS[1], False)
    corners, faces, count = [], [], 0
    each = explorer.TopExp_Explorer(shape, top.TopAbs_ShapeEnum.TopAbs_FACE)
    location = occ("TopLoc").TopLoc_Location
    while each.More():
        face, place = occ("TopoDS").TopoDS.Face(each.Current()), location()
        triangles = brep.BRep_Tool.Triangulation_s(face, place)
        move, turned = place.Transformation(), face.Orientation() == top.TopAbs_Orientation.TopAbs_REVERSED
        nodes = [triangles.Node(i).Transformed(move) for i in range(1, triangles.NbNodes() + 1)]
        corners += [(p.X(), p.Y(), p.Z()) for p in nodes]
        own = [triangles.Triangle(i).Get() for i in range(1, triangles.NbTriangles() + 1)]
        faces += [
            (count + a - 1, count + (c if turned else b) - 1, count + (b if turned else c) - 1) for a, b, c in own
        ]
        count += len(nodes)
        each.Next()
    whole = trimesh.Trimesh(np.round(corners, 6), faces, process=False)
    whole.merge_vertices(digits_vertex=5)
    whole.update_faces(whole.nondegenerate_faces())
    return whole


def stl_file(part: Part) -> bytes:
    """A part as a closed mesh, binary STL [mm]."""
    return bytes(mesh(solid(part)).export(file_type="stl"))


def transformation(pose: Array) -> Any:  # noqa: ANN401
    """A pose, shape (4, 4), in metres, as Open CASCADE's."""
    turn = occ("gp").gp_Trsf()
    rows = np.hstack([pose[:3, :3], MM * pose[:3, 3:]])
    turn.SetValues(*rows.ravel().tolist())
    return turn


def step_file(pieces: Sequence[tuple[str, Any, str, Array]]) -> bytes:
    """A STEP file: one shape as it is, or several as an assembly, each kind of part in it once.

    Args:
        pieces: Of each its name, its shape [mm], the name of its kind and its pose, shape (4, 4), in metres.
    """
    step, interface = occ("STEPCAFControl"), occ("Interface")
    strings, tools, places = occ("TCollection"), occ("XCAFDoc"), occ("TopLoc")
    quiet()
    held = occ("TDocStd").TDocStd_Document(strings.TCollection_ExtendedString("XmlOcaf"))
    shapes = tools.XCAFDoc_DocumentTool.ShapeTool_s(held.Main())

    def called(label: Any, text: str) -> Any:  # noqa: ANN401
        occ("TDataStd").TDataStd_Name.Set_s(label, strings.TCollection_ExtendedString(text))
        return label

    if len(pieces) == 1:
        called(shapes.AddShape(pieces[0][1], False), pieces[0][0])
    else:
        whole, known = called(shapes.NewShape(), "arm"), {}
        for name, shape, kind, pose in pieces:
            if kind not in known:
                known[kind] = called(shapes.AddShape(shape, False), kind)
            called(shapes.AddComponent(whole, known[kind], places.TopLoc_Location(transformation(pose))), name)
        shapes.UpdateAssemblies()
    interface.Interface_Static.SetCVal_s("write.step.unit", "MM")
    writer = step.STEPCAFControl_Writer()
    writer.SetNameMode(True)
    writer.Transfer(held)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "arm.step"
        writer.Write(str(path))
        text = path.read_text(encoding="utf-8")
    return STAMP.sub(r"\1'1970-01-01T00:00:00'", text, count=1).encode()


def quiet() -> None:
    """Keep Open CASCADE from telling on the screen what it writes."""
    told = occ("Message").Message.DefaultMessenger_s()
    told.RemovePrinters(occ("Message").Message_Printer.get_type_descriptor_s())

"""The arm in motion, drawn in MeshCat as Pinocchio reads it from the exported URDF."""

from __future__ import annotations

from typing import Any

import meshcat.geometry as mg
import numpy as np
import pinocchio as pin

from armdesign._types import Array
from armdesign.export.urdf import MATERIALS
from armdesign.views.preview.colours import ARM, BASE, TUBE, number
from armdesign.views.preview.recorder import Track, pose_tracks

PAINT = {"base": BASE, "joint": ARM, "tube": TUBE}
"""The colours of the page for the materials of the URDF."""
OPACITY = 0.7
"""Of the arm, so that the points and their places inside the tubes are seen."""


class AlongZ(mg.Cylinder):  # type: ignore[misc]
    """A cylinder along z, as in URDF; MeshCat's is along y."""

    def intrinsic_transform(self) -> Array:
        """What turns MeshCat's cylinder, shape (4, 4)."""
        turn: Array = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
        return turn


def draw_arm(node: Any, urdf: str, q: Array) -> list[Track]:  # noqa: ANN401 (a meshcat.Visualizer)
    """Draw an arm at its first pose, and let it go through all of them.

    Pinocchio's own MeshcatVisualizer draws the same, but loading it loads every viewer that Pinocchio knows, 1.5 s.

    Args:
        node: Where; the arm's base frame is that of the node.
        urdf: The exported arm, n joints.
        q: Joint angles at the keyframes, shape (K, n) [rad].

    Returns:
        How its solids move over the keyframes.
    """
    model = pin.buildModelFromXML(urdf)
    solids = pin.buildGeomFromUrdfString(model, urdf, pin.GeometryType.VISUAL)
    data, placed = model.createData(), pin.GeometryData(solids)
    poses = np.empty((len(q), solids.ngeoms, 4, 4))
    for k, angles in enumerate(q):
        pin.updateGeometryPlacements(model, data, solids, placed, angles)
        poses[k] = [pose.homogeneous for pose in placed.oMg]
    tracks = []
    for each, solid in enumerate(solids.geometryObjects):
        at = node["arm"]["visuals"][solid.name]
        colour = next(PAINT[name] for name in PAINT if np.allclose(solid.meshColor, MATERIALS[name], atol=1e-6))
        cylinder = AlongZ(2.0 * solid.geometry.halfLength, solid.geometry.radius)
        at.set_object(cylinder, mg.MeshPhongMaterial(color=number(colour), transparent=True, opacity=OPACITY))
        at.set_transform(poses[0, each])
        tracks += pose_tracks(at.path.lower(), poses[:, each])
    return tracks

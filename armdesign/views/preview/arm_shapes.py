"""The arm in motion, drawn by Pinocchio's MeshcatVisualizer from the exported URDF."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
from pinocchio.visualize import MeshcatVisualizer

from armdesign._types import Array
from armdesign.export.urdf import MATERIALS
from armdesign.views.preview.colours import ARM, BASE, TUBE, components
from armdesign.views.preview.recorder import Poses, Track, pose_tracks

ROOT = "arm"
"""Node of the arm below its design's."""
PAINT = {"base": BASE, "joint": ARM, "tube": TUBE}
"""The colours of the page for the materials of the URDF."""


OPACITY = 0.7
"""Of the arm, so that the points and their places inside the tubes are seen."""


def arm_models(urdf: str) -> tuple[pin.Model, pin.GeometryModel]:
    """The exported arm and its solids as Pinocchio reads them, in the colours of the page."""
    model = pin.buildModelFromXML(urdf)
    solids = pin.buildGeomFromUrdfString(model, urdf, pin.GeometryType.VISUAL)
    for solid in solids.geometryObjects:
        for name, colour in PAINT.items():
            if np.allclose(solid.meshColor, MATERIALS[name], atol=1e-6):
                solid.meshColor = np.array([*components(colour), OPACITY])
                break
    return model, solids


def draw_arm(node: Any, urdf: str, q: Array) -> list[Track]:  # noqa: ANN401 (a meshcat.Visualizer)
    """Draw an arm at its first pose, and let it go through all of them.

    Args:
        node: Where; the arm's base frame is that of the node.
        urdf: The exported arm, n joints.
        q: Joint angles at the keyframes, shape (K, n) [rad].

    Returns:
        How its solids move over the keyframes.
    """
    model, solids = arm_models(urdf)
    display = MeshcatVisualizer(model, None, solids)
    display.initViewer(viewer=node)
    display.loadViewerModel(ROOT)
    display.display(q[0])
    poses = Poses(node.path.lower())
    display.viewer = poses
    for angles in q:
        display.display(angles)
    return [track for path, taken in poses.taken.items() for track in pose_tracks(path, np.array(taken))]

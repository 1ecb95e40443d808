"""The dimensioned drawing of the arm, as the report and the study of designs show it."""

from __future__ import annotations

from armdesign.building.arm_drawing import Pose, arm_drawing
from armdesign.building.sheet import Sheet, svg_of
from armdesign.kinematics.base_pose import MOUNTINGS
from armdesign.search.result import Result
from armdesign.views.report.drawing import Picture, inlined


def sketch(run: Result) -> Sheet:
    """The arm as it starts, in third-angle projection, its base turned to the front as it is mounted."""
    return arm_drawing(Pose(run.body, run.evaluation.path.q[0], MOUNTINGS[run.base_pose.mounted]))


def sketch_picture(run: Result, *, built: bool = False) -> Picture:
    """The dimensioned drawing of a run's arm.

    Args:
        run: The run.
        built: Whether it is made of known parts.
    """
    parts = " Motors are drawn as the cylinders about them, without brackets and flanges." if built else ""
    return Picture(
        "sketch",
        inlined(svg_of(sketch(run)), "sketch"),
        f"Dimensioned drawing of the {run.table.dof} joints and the links between them: front, top and right side view "
        "with the numbers of the table, and the arm at an angle.",
        "The arm at the start of its motion, in third-angle projection: the view from above over that from the front, "
        "that from the right beside it. Lengths a and link offsets d (along the joints' axes) are true lengths in "
        "millimetres, also where a view shows them shortened; α is the twist about the link before a joint. J1, J2, "
        f"... are the joints, dash-dotted lines their axes.{parts}",
    )

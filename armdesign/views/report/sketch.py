"""The dimensioned drawing of the arm, as the report and the study of designs show it."""

from __future__ import annotations

from armdesign.building.arm_drawing import Pose, arm_drawing
from armdesign.building.sheet import Sheet, svg_of
from armdesign.kinematics.base_pose import MOUNTINGS
from armdesign.search.result import Result
from armdesign.views.report.drawing import Picture, inlined


def sketch(run: Result) -> tuple[Sheet, float]:
    """The arm as it starts, in third-angle projection, its base turned to the front as mounted; and where to cut it."""
    return arm_drawing(Pose(run.body, run.evaluation.path.q[0], MOUNTINGS[run.base_pose.mounted]))


def sketch_picture(run: Result, *, built: bool = False) -> Picture:
    """The dimensioned drawing of a run's arm.

    Args:
        run: The run.
        built: Whether it is made of known parts.
    """
    sheet, cut = sketch(run)
    whole, extent, height = inlined(svg_of(sheet), "sketch"), sheet.extent, sheet.size[1]
    ends = (extent[0] - 1.0, cut), (cut, extent[2] + 1.0)
    wide = max(right - left for left, right in ends)
    halves = [  # one below the other on a phone, to one scale
        f'<svg class="half" aria-hidden="true" style="width:{100.0 * (right - left) / wide:.0f}%" '
        f'viewBox="{left:.1f} 0 {right - left:.1f} {height:.4g}"><use href="#sketch-views"/></svg>'
        for left, right in ends
    ]
    parts = " Motors are drawn as the cylinders about them, without brackets and flanges." if built else ""
    return Picture(
        "sketch",
        whole.replace("<g ", '<g id="sketch-views" ', 1) + "".join(halves),
        f"Dimensioned drawing of the {run.table.dof} joints and the links between them: front, top and right side view "
        "with the numbers of the table, and the arm at an angle.",
        "The arm at the start of its motion, in third-angle projection: the view from above over that from the front, "
        "that from the right beside it. Lengths a and link offsets d (along the joints' axes) are true lengths in "
        "millimetres, also where a view shows them shortened; α is the twist about the link before a joint. J1, J2, "
        f"... are the joints, dash-dotted lines their axes.{parts}",
    )

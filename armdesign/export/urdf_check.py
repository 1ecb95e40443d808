"""Read an exported URDF with a reader that shares no code with the writer, before it goes to the disk.

The templates may be changed by users, and nothing else would notice a slip in them. Checked are the URDFs of an export
and of the tests, not the arm.urdf of every search: importing yourdfpy and trimesh takes 0.4 s of CPU.
"""

from __future__ import annotations

import io
import xml.etree.ElementTree as ET

import numpy as np

from armdesign.errors import DesignError
from armdesign.export.parts import BASE_LINK, TOOL_LINK
from armdesign.export.robot_file import Robot

TOLERANCE = 1e-9
"""Largest difference of an entry of tool0's pose [m, or of a rotation matrix]."""


def check_urdf(text: str, robot: Robot) -> None:
    """See that a URDF reads back as the arm: its joints, and tool0 at the start pose where the DH table has it.

    Args:
        text: The URDF.
        robot: What it was written from.

    Raises:
        DesignError: It cannot be read, or reads as another arm.
    """
    import yourdfpy  # noqa: PLC0415 (with trimesh and networkx 0.4 s)

    fix = "Restore the templates of armdesign, or check what was changed in them"
    try:
        ET.fromstring(text)  # yourdfpy goes on where the XML is cut short
        read = yourdfpy.URDF.load(io.BytesIO(text.encode()), load_meshes=False)
        joints = [f"joint_{i + 1}" for i in range(robot.table.dof)]
        if list(read.actuated_joint_names) != joints:
            raise ValueError(f"its joints are {read.actuated_joint_names}")
        read.update_cfg(robot.start)
        off = np.abs(read.get_transform(TOOL_LINK, BASE_LINK) - robot.table.frames(robot.start)[-1]).max()
        if not off < TOLERANCE:
            raise ValueError(f"tool0 is {off:.2g} away from where the DH table has it")
    except Exception as error:  # yourdfpy raises whatever its XML and graph libraries raise
        raise DesignError(f"the URDF does not read back as the arm: {error}", fix=fix) from error

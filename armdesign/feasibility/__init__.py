"""Whether an arm can exist and does its job: clearance, speeds, torques, tolerance, and how they enter the search."""

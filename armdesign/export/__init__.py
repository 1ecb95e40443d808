"""What leaves the package: the arm as a URDF, with its solids, its limits and the templates behind it."""

"""Compiled kernels of the room feasibility."""

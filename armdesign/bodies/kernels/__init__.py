"""Compiled kernels of the room bodies."""

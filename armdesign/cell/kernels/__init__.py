"""Compiled kernels of the room cell."""

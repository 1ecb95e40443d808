"""Compiled kernels of the studies."""

"""Compiled kernels of the fitness: association, temporal and path fitness, area, and their gradients."""

"""Compiled kernels of the arm's chain and the damped least squares step."""

"""Temporal, path, area and robot fitness, and the design constraints."""

"""Designs and ready-made arms on the same task by the same fitness."""

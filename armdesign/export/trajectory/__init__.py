"""The arm's motion over time: smooth, timed so that a robot can run it, written to files, tried in simulation."""

"""Sweeps: many searches, one for every combination of recording, algorithm, joints, angle interval D and seed.

A sweep is a folder of run folders with one table over them. Its units are whole searches that do not depend on each
other, so that worker processes here, or a cluster, carry them out in any order to the same folder.
"""

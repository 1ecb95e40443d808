"""The paper's studies, done over on any demonstration: each a sweep, with tables and a figure.

Temporal fitness by many solvers, robot fitness by many searches, RA-PSO against PSO, and designs over the number of
joints. ``study_plan`` holds what a study shall do, ``study_registry`` which studies there are.
"""

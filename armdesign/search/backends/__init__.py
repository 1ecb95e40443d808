"""Who evaluates a generation: this process, worker processes on this machine, or a Dask cluster.

The fitness is a pure function of the candidate, so every backend gives the same scores to the last bit; they differ in
speed alone. The workers of ``workers`` do the runs of sweeps and studies as well.
"""

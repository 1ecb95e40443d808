"""Who evaluates a generation: this process, worker processes on this machine, or a Dask cluster.

The fitness is a pure function of the candidate, so every backend gives the same scores to the last bit; they differ in
speed alone.
"""

from armdesign.search.backends.backend import Backend, InProcess
from armdesign.search.backends.processes import WorkerPool

__all__ = ["Backend", "InProcess", "WorkerPool"]

"""A small search, and one generation of it with its scores in one process."""

from pathlib import Path

import numpy as np
import pytest
from dask_processes import processes

from armdesign.demonstration import read_recording
from armdesign.search.backends.backend import InProcess
from armdesign.search.prepare import prepare
from armdesign.settings.sections import Settings

PACKAGING = Path(__file__).resolve().parents[3] / "examples" / "packaging.csv"


@pytest.fixture(scope="package")
def prepared():
    settings = {"search": {"particles": 24, "iterations": 6}, "task": {"stop": 0.4}}
    return prepare(read_recording(PACKAGING), Settings().replace(settings))


@pytest.fixture(scope="package")
def generation(prepared):
    """Designs, cutoffs that some of them pass, and their scores."""
    rng = np.random.default_rng(5)
    Phi = prepared.space.sample(rng, 60)
    backend = InProcess(prepared)
    fitness = backend.evaluate(Phi, np.full(60, np.inf))[0].fitness
    cutoff = fitness * np.where(np.isfinite(fitness), rng.uniform(0.5, 1.5, 60), 1.0)
    return Phi, cutoff, backend.evaluate(Phi, cutoff)


@pytest.fixture(scope="package")
def cluster(tmp_path_factory):
    """A Dask scheduler with a worker of one thread and one of three."""
    with processes(tmp_path_factory.mktemp("cluster")) as started:
        started.add_worker(threads=1)
        started.add_worker(threads=3)
        yield started

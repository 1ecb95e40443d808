"""The simplest workers, for sweeps where it does not matter who carries out the units."""

from pathlib import Path

from armdesign.experiments.sweep.units import carry_out_unit
from armdesign.search.backends.workers import Event

PACKAGING = Path(__file__).resolve().parents[3] / "examples" / "packaging.csv"


class Here:
    """This process, with or without the same disk. Its units end in the reverse of the order they were begun in."""

    def __init__(self, capacity=1, share_disk=True):
        self.capacity, self.share_disk = capacity, share_disk
        self.jobs, self.taken = [], []

    def room(self):
        return self.capacity - len(self.jobs)

    def begin(self, job):
        self.jobs.append(job)
        self.taken.append(job.content.place.name)

    def wait(self, timeout):
        job = self.jobs.pop()
        return [Event(job, "answer", carry_out_unit(job.content))]

    def interrupt(self):
        pass

    def drop(self):
        self.jobs = []

    def close(self):
        pass

"""Workers that carry out parts of a search side by side, a while at a time.

A part goes to a worker as a state and comes back as one, further on its way: so the search can be saved, interrupted
and continued at any time, a worker that dies loses a moment, and what turns out not to be wanted is not gone on with.
"""

from __future__ import annotations

from armdesign.search.backends.parallel import DEATHS_OF_A_PART, ParallelBackend, Stretch
from armdesign.search.backends.workers import Job
from armdesign.swarm import Algorithm, Part

LOOK_EVERY = 0.5
"""Longest time between two looks at the workers [s]."""


class PartScheduler:
    """Hands parts of a search to the workers of a backend and takes them back."""

    def __init__(self, backend: ParallelBackend) -> None:
        """Nothing is handed out yet.

        Args:
            backend: Its workers have the problem.
        """
        self.workers = backend.workers
        self.at_hand: dict[Job, int] = {}  # the labels of the parts
        self.suspects: set[int] = set()

    def work_on(self, swarm: Algorithm) -> bool:
        """Hand out parts of a search that are wanted, and wait a moment for one to come back.

        Args:
            swarm: The search.

        Returns:
            Whether that is what the search needs; else it has to go on batch by batch, since it has no parts, or since
            its first one has brought down workers, and only batches show by which candidate.

        Raises:
            ArmDesignError: A worker reports an error.
        """
        room = self.workers.room()
        parts = swarm.parts(max(1, room + len(self.at_hand)))
        if not parts or parts[0].label in self.suspects:
            self.at_hand.clear()  # evaluating lets go of them
            return False
        under_way = set(self.at_hand.values())
        for part in [part for part in parts if part.label not in under_way | self.suspects][:room]:
            job = Job(Stretch(part.state()), DEATHS_OF_A_PART)
            self.workers.begin(job)
            self.at_hand[job] = part.label
        for event in self.workers.wait(LOOK_EVERY):
            label = self.at_hand.get(event.job)
            if label is None or not event.is_end:
                continue
            del self.at_hand[event.job]
            if event.kind == "error":
                raise event.content
            if event.kind == "given up":
                self.suspects.add(label)
            else:
                swarm.put(Part.from_state(event.content, swarm.space))
        return True

"""The simplest crew, for sweeps whose crew does not matter."""

from pathlib import Path

from armdesign.experiments.sweep import News, carry_out_unit

PACKAGING = Path(__file__).resolve().parents[3] / "examples" / "packaging.csv"


class Here:
    """A crew of one: this process. Its units end in the reverse of the order they were taken in."""

    def __init__(self, capacity=1):
        self.capacity = capacity
        self.places = []
        self.taken = []

    def room(self):
        return self.capacity - len(self.places)

    def take(self, place):
        self.places.append(place)
        self.taken.append(place.name)

    def wait(self, timeout):
        place = self.places.pop()
        return [News(place.name, outcome=carry_out_unit(place))]

    def interrupt(self):
        pass

    def close(self):
        pass

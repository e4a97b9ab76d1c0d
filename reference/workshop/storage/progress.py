"""How much of long work is done, in words, where no bar of tqdm is seen."""

from time import monotonic

from tqdm import tqdm

SECONDS_BETWEEN = 60.0  # from one line to the next


class Pace:
    """Tells which share is done, and how long the rest takes at the pace so far.

    total  what there is to do;  first  what was done when it began
    """

    def __init__(self, total: int, first: int = 0):
        self.total = total
        self.first = first
        self.begin = monotonic()
        self.told = self.begin  # when it was asked for last

    @property
    def due(self) -> bool:
        """Whether nothing was told for a while."""
        return monotonic() - self.told >= SECONDS_BETWEEN

    def in_words(self, done: int) -> str:
        """Say how much is done, and the time left once anything is."""
        self.told = monotonic()
        share = f"{done / self.total:.0%} done"
        if done == self.first:
            return share
        each = (self.told - self.begin) / (done - self.first)
        return f"{share}, {tqdm.format_interval(each * (self.total - done))} left"

"""Bootstrap intervals: how far a figure would move, had other runs been drawn.

Clause: F12 [chosen].  Percentile intervals: a statistic of many samples, each drawn
with replacement from the values themselves.  Of two strategies on the same seeds only
the differences of pairs are drawn, so that what their runs share cancels.

    n  values, one for each run;  k  figures of a run;  B  resamples
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

RESAMPLES = 2000
"""[F12, chosen] B: the ends of an interval then move by a seventieth of its width from
one choice of samples to the next."""

CONFIDENCE = 0.95
"""[F12, chosen] intervals hold the true figure in so many of all experiments."""

AT_ONCE = 100  # resamples of trainings in memory together

TRIMMED = 0.25  # [F12, chosen] share that an interquartile mean drops at either end

Values = Sequence[float] | np.ndarray


class Interval(NamedTuple):
    """A figure of all values, and the ends of its interval, low <= high."""

    mean: float
    low: float
    high: float


def of_mean(values: Values, seed: int = 0) -> Interval:
    """The mean of (n,) values.

    One value, or n times the same, makes an interval without width: nothing is known
    of how values scatter. Raises ValueError for no values and for what is no number.
    """
    return _interval(*_means(_finite(values, 1)[:, None], seed))


def of_means(
    statistic: Callable[..., np.ndarray], rows: np.ndarray, seed: int = 0
) -> Interval:
    """A statistic of the means of k figures that belong together, as one row a run.

    rows       (n, k);  statistic  k arrays of means, (B,) each, -> (B,)
    Raises ValueError as `of_mean` does, and what the statistic raises.
    """
    whole, drawn = _means(_finite(rows, 2), seed)
    return _interval(statistic(*whole[:, None]), statistic(*drawn.T))


def of_difference(one: Values, other: Values, seed: int = 0) -> Interval:
    """The mean of one minus other, paired: (n,) values each, of the same seeds.

    Raises ValueError as `of_mean` does, and for two that are not of one length.
    """
    a, b = _finite(one, 1), _finite(other, 1)
    if len(a) != len(b):
        raise ValueError(
            f"{len(a)} values and {len(b)} make no pairs. Give both of the same seeds."
        )
    return of_mean(a - b, seed)


def band(rows: np.ndarray, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean, low and high, (k,) each, of every column of (n, k) values by itself."""
    whole, drawn = _means(_finite(rows, 2), seed)
    low, high = _ends(drawn)
    return whole, low, high


def _means(rows: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(k,) means of (n, k) rows, and (B, k) means of B samples of n rows.

    Of deviations from the first row, so that equal values have exactly their mean.
    """
    n = len(rows)
    drawn = np.random.default_rng(seed).integers(n, size=(RESAMPLES, n))
    sample = np.arange(RESAMPLES)[:, None]
    counts = np.bincount((drawn + n * sample).ravel(), minlength=RESAMPLES * n)
    deviations = rows - rows[0]
    means = counts.reshape(RESAMPLES, n) @ deviations / n
    return rows[0] + deviations.mean(axis=0), rows[0] + means


# -- Training runs ------------------------------------------------------------------


def iqm(values: np.ndarray) -> np.ndarray:
    """The interquartile mean over the last axis: that of the middle half.

    A quarter is dropped at either end, rounded down: of five values one each, of three
    none.
    """
    n = values.shape[-1]
    cut = int(TRIMMED * n)
    return np.sort(values, axis=-1)[..., cut : n - cut].mean(axis=-1)


def of_trainings(values: np.ndarray, seed: int = 0) -> Interval:
    """The interquartile mean over training runs; values: (trainings, episodes).

    The unit is the training, of which each has a mean over its episodes. Trainings are
    drawn first, then within each that was drawn its episodes: either would be others in
    another experiment. Raises ValueError as `of_mean` does.
    """
    values = _finite(values, 2)
    rng = np.random.default_rng(seed)
    drawn = [_drawn(values, rng) for _ in range(RESAMPLES // AT_ONCE)]
    return _interval(iqm(values.mean(axis=1))[None], np.concatenate(drawn))


def _drawn(values: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(AT_ONCE,) interquartile means of as many trainings with as many episodes."""
    trainings, episodes = values.shape
    which = rng.integers(trainings, size=(AT_ONCE, trainings, 1))
    when = rng.integers(episodes, size=(AT_ONCE, trainings, episodes))
    return iqm(values[which, when].mean(axis=2))


# -- Ends ---------------------------------------------------------------------------


def _interval(whole: np.ndarray, drawn: np.ndarray) -> Interval:
    """From a figure of all values, (1,), and its (B,) or (B, 1) resamples."""
    low, high = _ends(drawn.ravel())
    return Interval(float(whole[0]), float(low), float(high))


def _ends(drawn: np.ndarray) -> np.ndarray:
    """Low and high of (B, ...) resamples."""
    tail = (1 - CONFIDENCE) / 2
    return np.quantile(drawn, [tail, 1 - tail], axis=0)


def _finite(values: Values, dimensions: int) -> np.ndarray:
    """An array of so many dimensions with at least one value, all of them numbers."""
    array = np.asarray(values, dtype=float)
    if array.ndim != dimensions or not array.size:
        raise ValueError(
            f"an interval needs at least one value in {dimensions} dimensions, not "
            f"{array.shape}. Run something first."
        )
    if not np.isfinite(array).all():
        raise ValueError("an interval is of numbers: leave out what is none.")
    return array

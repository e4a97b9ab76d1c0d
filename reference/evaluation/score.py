"""The score E of robots: their reward weighed against the difficulty of the fire.

Clauses: F1, F2, F3, F9, F10, F12.  A `Ruler` holds the constants of E.  `PAPER` has the
paper's; `calibrated` makes one as the paper did, `from_runs` from a baseline's runs.

    R   reward, health points;          h   difficulty, on the scale of F10
    y   exponential value of a reward;  e′  y and difficulty together, before scaling
    E   the score: e′ / β;              α, b, c, k, β   the ruler's constants
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from math import isfinite, log
from typing import NamedTuple, TypeVar

import numpy as np

from reference.paper import ALPHA, BEST_POINT, BETA, WORST_POINT, InputError, K

LARGEST = 1e12
"""[F9, chosen] limit of each part of e′: above it the other part loses its digits."""

WIDEST = 1e100  # [F2, chosen] limit of b, c and 1/c, so that no power overflows
FEWEST_RUNS = 6  # [F12, chosen] two in each third
CLEARLY = 2.0  # [F12, chosen] standard errors between easy and hard thirds: 95 %

Number = TypeVar("Number", float, np.ndarray)
Point = tuple[float, float]


class RulerError(InputError):
    """Constants that make no ruler, or a reading outside its range."""


class Case(NamedTuple):
    """A reward, health points, earned at a difficulty, on the scale of F10."""

    reward: float
    difficulty: float


@dataclass(frozen=True)
class Ruler:
    """The constants of E. Raises RulerError where they make no ruler.

    alpha  α, health points;  base  b of Eq. 4;  control  c of Eq. 4
    k      weight of reward against difficulty;  beta  β, the e′ that scores 1
    """

    alpha: float
    base: float
    control: float
    k: float
    beta: float

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            least = 1.0 if name == "base" else 0.0
            if not (isfinite(value) and value > least):
                raise RulerError(f"{name} is {value}: give a number above {least:g}")

    def reward_part(self, reward: Number) -> Number:
        """y = b^(R/α) / c [F1, Eq. 4]; RulerError where it exceeds LARGEST."""
        R, α, b, c = reward, self.alpha, self.base, self.control
        _check(R, "reward", -np.inf, self.reward_at(LARGEST))
        return b ** (R / α) / c

    def slope(self, reward: Number) -> Number:
        """dy/dR = y ln(b) / α, the value of one more health point [F3]."""
        return self.reward_part(reward) * log(self.base) / self.alpha

    def difficulty_part(self, difficulty: Number) -> Number:
        """h² / (kα²) [F9, Eq. 8]; RulerError below 0 and where it exceeds LARGEST."""
        h, k, α = difficulty, self.k, self.alpha
        _check(h, "difficulty", 0, α * (k * LARGEST) ** 0.5)
        return h**2 / (k * α**2)

    def unscaled(self, reward: Number, difficulty: Number) -> Number:
        """e′ = b^(R/α)/c + h²/(kα²) [F9, Eq. 8]."""
        return self.reward_part(reward) + self.difficulty_part(difficulty)

    def score(self, reward: Number, difficulty: Number) -> Number:
        """E = e′ / β [F9]: 1 is as good as the baseline."""
        return self.unscaled(reward, difficulty) / self.beta

    def reward_at(self, y: float) -> float:
        """Invert Eq. 4: the reward, health points, of y > 0 [F1, Eq. 4]."""
        return self.alpha * log(y * self.control) / log(self.base)

    def difficulty_at(self, reward: float) -> float:
        """Invert Eq. 8: the difficulty h at which this reward scores 1 [F10].

        Raises RulerError where the reward alone scores more, without any fire.
        """
        k, β, α, y = self.k, self.beta, self.alpha, self.reward_part(reward)
        if y > β:
            below = f"ask for a reward below {self.reward_at(β):.0f}"
            raise RulerError(f"reward {reward:g} alone scores above 1: {below}")
        return ((β - y) * k) ** 0.5 * α


def _check(value: float | np.ndarray, what: str, low: float, high: float) -> None:
    """Raise RulerError for values that are not finite or not between low and high."""
    v = np.asarray(value, dtype=float)
    off = v[~(np.isfinite(v) & (v >= low) & (v <= high))]
    if off.size:
        limits = f"at most {high:.0f}" if low == -np.inf else f"{low:g} to {high:.0f}"
        raise RulerError(
            f"{what} {off[0]:g} lies off this ruler, which reads {limits}: calibrate "
            "one for this building and these people"
        )


# -- Calibration --------------------------------------------------------------------


def base_and_control(worst: Point, best: Point) -> tuple[float, float]:
    """Solve Eq. 4 for b and c through two critical points, (reward, y) each [F2].

    b = (y₂/y₁)^(α/(R₂−R₁)), c = b^(R₁/α)/y₁. Raises RulerError unless both R and y
    grow from the first to the second, and where b, c or 1/c exceeds WIDEST.
    """
    (R_1, y_1), (R_2, y_2), α = worst, best, ALPHA
    points = f"Critical Points {tuple(worst)} and {tuple(best)}"
    if not (R_1 < R_2 < np.inf and 0 < y_1 < y_2 < np.inf):
        raise RulerError(f"{points}: take two, of which the second has more of both")
    ln_b = log(y_2 / y_1) * α / (R_2 - R_1)
    ln_c = ln_b * R_1 / α - log(y_1)
    if max(ln_b, abs(ln_c)) > log(WIDEST):
        raise RulerError(f"{points}: take them farther apart or nearer to 0")
    return float(np.exp(ln_b)), float(np.exp(ln_c))


def weight(one: Case, other: Case, base: float, control: float) -> float:
    """Solve for k, such that two cases score alike [F9].

    k = (h₂² − h₁²) / (α²(y₁ − y₂)); base, control: b and c of Eq. 4. Raises RulerError
    unless the case with more reward has less difficulty.
    """
    unit = Ruler(ALPHA, base, control, k=1.0, beta=1.0)
    (R_1, h_1), (R_2, h_2) = sorted((one, other), reverse=True)
    harder = unit.difficulty_part(h_2) - unit.difficulty_part(h_1)
    richer = unit.reward_part(R_1) - unit.reward_part(R_2)
    if not (harder > 0 and richer > 0 and isfinite(harder / richer)):
        raise RulerError(
            f"rewards {R_1:g} and {R_2:g} at difficulties {h_1:g} and {h_2:g}: more "
            "reward must be the easier case, so take fires that differ more"
        )
    return harder / richer


def calibrated(
    worst: Point, best: Point, equal: tuple[Case, Case], baseline: Case
) -> Ruler:
    """Calibrate a ruler as the paper does [F12]: two points, equal cases, a baseline.

    worst, best  the critical points, (reward, y) each: b and c
    equal        two cases that count as equally good: k
    baseline     the case that is to score 1: β, its e′
    """
    b, c = base_and_control(worst, best)
    ruler = Ruler(ALPHA, b, c, weight(*equal, b, c), beta=1.0)
    return replace(ruler, beta=ruler.unscaled(*baseline))


def from_runs(
    rewards: Sequence[float],
    difficulties: Sequence[float],
    worst: Point,
    best: Point,
    fires: Sequence[str],
) -> Ruler:
    """Calibrate a ruler from a baseline's runs and critical points [F12, chosen].

    The two equal cases are the means of the third of the runs with the easiest fires
    and of the third with the hardest: the same robots deserve the same score. β is the
    mean, over the named fires, of e′ at each fire's mean reward and difficulty.

    Take runs against weak and strong fires alike. Raises RulerError for fewer than
    FEWEST_RUNS, and where the hard third did not CLEARLY earn less than the easy one.
    """
    R, h = np.asarray(rewards, dtype=float), np.asarray(difficulties, dtype=float)
    if not R.shape == h.shape == (len(fires),) or not np.isfinite([R, h]).all():
        what = f"{R.size} rewards and {h.size} difficulties for {len(fires)} runs"
        raise RulerError(f"{what}: give one finite number of each for each run")
    if len(R) < FEWEST_RUNS:
        raise RulerError(f"{len(R)} runs make no ruler: give at least {FEWEST_RUNS}")
    ranked, third = np.sort(h), len(h) // 3
    easy, hard = h <= ranked[third - 1], h >= ranked[-third]  # with ties
    equal = _mean(R[easy], h[easy]), _mean(R[hard], h[hard])
    ruler = calibrated(worst, best, equal, _mean(R, h))
    error = np.sqrt(sum(R[part].var(ddof=1) / part.sum() for part in (easy, hard)))
    if R[easy].mean() - R[hard].mean() < CLEARLY * error:
        raise RulerError(
            f"the baseline earned {R[easy].mean():.0f} in the easiest third of the "
            f"fires, {R[hard].mean():.0f} in the hardest, give or take {error:.0f}: "
            "run more seeds, or weak and strong fires alike"
        )
    parts = [np.array(fires) == name for name in np.unique(fires)]
    β = np.mean([ruler.unscaled(*_mean(R[part], h[part])) for part in parts])
    return replace(ruler, beta=float(β))


def _mean(R: np.ndarray, h: np.ndarray) -> Case:
    return Case(float(R.mean()), float(h.mean()))


# -- The paper's --------------------------------------------------------------------

PAPER = Ruler(ALPHA, *base_and_control(WORST_POINT, BEST_POINT), k=K, beta=BETA)
"""The constants that the appendix prints, b and c to more digits [F2] [F9]."""

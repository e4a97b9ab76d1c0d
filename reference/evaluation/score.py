"""The score E of robots: their reward weighed against the difficulty of the fire.

A `Ruler` holds the constants of E.  `paper_ruler` has the paper's; `calibrate` makes
one as the paper did.

    R   reward, health points;          h   difficulty, on the scale of F10
    y   exponential value of a reward;  e′  y and difficulty together, before scaling
    E   the score: e′ / β;              α, b, c, k, β   the ruler's constants
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log
from typing import TypeVar

import numpy as np

from reference import paper
from reference.paper import InputError

LARGEST_Y = 1e12  # [F1, chosen] limit of y: above it, difficulty would not count

Number = TypeVar("Number", float, np.ndarray)
Point = tuple[float, float]  # a reward, health points, and its y
Case = tuple[float, float]  # a reward, and the difficulty at which it was earned


class RulerError(InputError):
    """Runs that make no ruler, or a reward outside its range."""


@dataclass(frozen=True)
class Ruler:
    """The constants of E."""

    alpha: float  # α, health points
    base: float  # b of Eq. 4
    control: float  # c of Eq. 4
    k: float  # weight of reward against difficulty
    beta: float  # β, the e′ that scores 1

    def reward_part(self, reward: Number) -> Number:
        """y = b^(R/α) / c [F1, Eq. 4]; RulerError where y exceeds LARGEST_Y."""
        highest = np.max(reward)
        most = self.reward_at(LARGEST_Y)
        if highest > most:
            raise RulerError(
                f"reward {highest:g} lies off this ruler, which reads at most "
                f"{most:.0f}: calibrate one for this building and these people"
            )
        R = reward
        α = self.alpha
        b = self.base
        c = self.control
        return b ** (R / α) / c

    def slope(self, reward: Number) -> Number:
        """dy/dR = y ln(b) / α, the value of one more health point [F3]."""
        return self.reward_part(reward) * log(self.base) / self.alpha

    def difficulty_part(self, difficulty: Number) -> Number:
        """h² / (kα²) [F9, Eq. 8]."""
        h = difficulty
        k = self.k
        α = self.alpha
        return h**2 / (k * α**2)

    def score(self, reward: Number, difficulty: Number) -> Number:
        """E = e′ / β, where e′ = b^(R/α)/c + h²/(kα²) [F9, Eq. 8]."""
        return (self.reward_part(reward) + self.difficulty_part(difficulty)) / self.beta

    def reward_at(self, y: float) -> float:
        """Invert Eq. 4: the reward, health points, of y > 0 [F1, Eq. 4]."""
        return self.alpha * log(y * self.control) / log(self.base)


def base_and_control(worst: Point, best: Point) -> tuple[float, float]:
    """Solve Eq. 4 for b and c through two critical points, (reward, y) each [F2].

    b = (y₂/y₁)^(α/(R₂−R₁)), c = b^(R₁/α)/y₁. Raises RulerError unless R₁ < R₂.
    """
    R_1, y_1 = worst
    R_2, y_2 = best
    if R_1 >= R_2:
        raise RulerError("the best reward is the worst: all ways out are too long")
    α = paper.ALPHA
    b = (y_2 / y_1) ** (α / (R_2 - R_1))
    return b, b ** (R_1 / α) / y_1


def calibrate(
    worst: Point, best: Point, equal: tuple[Case, Case], baseline: Sequence[Case]
) -> Ruler:
    """Calibrate a ruler as the paper does [F12]: two points, equal cases, a baseline.

    worst, best  the critical points, (reward, y) each: b and c
    equal        two cases that are to score alike: k = (h₂² − h₁²) / (α²(y₁ − y₂))
    baseline     the cases that are to score 1 on average: β, their mean e′
    Raises RulerError unless the case with less reward had the harder fires, or as
    `base_and_control`.
    """
    b, c = base_and_control(worst, best)
    unit = Ruler(paper.ALPHA, b, c, k=1.0, beta=1.0)
    (R_1, h_1), (R_2, h_2) = sorted(equal, reverse=True)
    harder = unit.difficulty_part(h_2) - unit.difficulty_part(h_1)
    richer = unit.reward_part(R_1) - unit.reward_part(R_2)
    if not (harder > 0 and richer > 0):
        raise RulerError(
            "these two cases cannot score alike: they do only where the one with less "
            "reward had harder fires"
        )
    ruler = replace(unit, k=harder / richer)
    beta = float(np.mean([ruler.score(*case) for case in baseline]))
    return replace(ruler, beta=beta)


def paper_ruler() -> Ruler:
    """The constants that the appendix prints, b and c to more digits [F2] [F9]."""
    b, c = base_and_control(paper.WORST_POINT, paper.BEST_POINT)
    return Ruler(paper.ALPHA, b, c, k=paper.K, beta=paper.BETA)

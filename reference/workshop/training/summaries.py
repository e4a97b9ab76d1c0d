"""Summaries by ML-Agents' names: rows of means, in a table.

A row stands at the end of a round in which a side's steps pass a multiple of
`summary_freq`, or several [E1] [E2]: means over the episodes and updates since the row
before.  Rewards are unscaled health points [E5]; unlike in ML-Agents, "Cumulative
Reward" includes the group's reward.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from reference.learning.settings import Side
from reference.workshop.storage.files import Table, read_table
from reference.workshop.storage.records import SettingsError

SUMMARIES = "summaries.csv"
"""Name of the table in the folder of a training."""

FOREIGN = "Move it away: it begins anew then, and the training loses nothing else."
"""Advice where something else stands in the table's place."""

WHEN_COLUMNS = ("side", "step", "round", "episodes", "phase")
"""Whose row; its side's decisions, rounds and episodes so far; who is learning."""

GROUP_REWARD = "Environment/Group Cumulative Reward"
OWN_REWARD = "Environment/Cumulative Reward"
SURVIVAL = "Environment/Survival"
PRETRAINING = "Losses/Pretraining Loss"

EPISODE_COLUMNS = {
    GROUP_REWARD: "group_reward",
    OWN_REWARD: "group_reward",  # the fire's is fire_reward
    "Environment/Episode Length": "length",
    SURVIVAL: "survival",
    "Environment/Evacuated": "evacuated",
    "Environment/Died": "died",
    "Environment/Seconds": "seconds",
    "Environment/Fire Sources": "sources",
    "Environment/Fires Refused": "refused",
}
"""Columns, and the episode's fact that each averages; the group is the robots'."""

FACTS = {*EPISODE_COLUMNS.values(), "fire_reward"}
"""Of an episode."""

SIGNAL = "Policy/Signal to Noise"
EXPLAINED = "Policy/Explained Variance"

UPDATE_COLUMNS = (
    "Losses/Policy Loss",
    "Losses/Value Loss",
    "Losses/Baseline Loss",
    PRETRAINING,
    "Policy/Entropy",
    "Policy/Learning Rate",
    "Policy/Epsilon",
    "Policy/Beta",
    "Policy/Extrinsic Value Estimate",
    "Policy/Extrinsic Baseline Estimate",
    SIGNAL,  # ours, as EXPLAINED is
    EXPLAINED,
)
SUMMARY_COLUMNS = (*WHEN_COLUMNS, *EPISODE_COLUMNS, *UPDATE_COLUMNS)
SummaryRow = dict[str, Any]
Figures = Mapping[str, float]


@dataclass
class RunningMeans:
    """One side's next row: sums over what has come in since the row before.

    last  step of the row before;  sums and counts  by column
    """

    last: int
    sums: dict[str, float]
    counts: dict[str, int]

    def __post_init__(self) -> None:
        known = self.sums.keys() == self.counts.keys() <= {*SUMMARY_COLUMNS}
        if not known or min(self.counts.values(), default=1) < 1:
            raise SettingsError("sums and counts of a summary do not fit")

    def add(self, side: Side, facts: Iterable[Figures], update: Figures) -> None:
        """Add facts of episodes, and the update's figures, if there was one."""
        for fact in facts:
            values = {column: fact[name] for column, name in EPISODE_COLUMNS.items()}
            if side == "fire":
                values[OWN_REWARD] = fact["fire_reward"]
            self._add(values)
        self._add(update)

    def _add(self, values: Figures) -> None:
        for column, value in values.items():
            self.sums[column] = self.sums.get(column, 0.0) + value
            self.counts[column] = self.counts.get(column, 0) + 1

    def row(self, step: int, every: int) -> SummaryRow | None:
        """The means, if this step is past another multiple of `every`; begin anew."""
        if step // every == self.last // every:
            return None
        means = {name: self.sums[name] / self.counts[name] for name in self.sums}
        self.last = step
        self.sums = {}
        self.counts = {}
        return means


@dataclass(frozen=True)
class Levels:
    """Means that do not change as a training goes on, to measure it by.

    about: what they are means of;  means: of each guide, by column of the table
    """

    about: str
    means: Mapping[str, Figures]


def table_until(folder: Path, rounds: int) -> Table:
    """Go on with a training's table, without its rows of later rounds than `rounds`.

    Raises ValueError for a file that is another table, OSError.
    """
    path = folder / SUMMARIES
    there = read_table(
        path, SUMMARY_COLUMNS, lambda row: (int(row["round"]), row), FOREIGN
    )
    return Table(
        path, SUMMARY_COLUMNS, (row for round, row in there if round <= rounds)
    )

"""Summaries: what users of ML-Agents look at, as CSV and for TensorBoard.

Clauses: E1, E2, E3, E5.  A row every `summary_freq` steps of a side: means over the
episodes and updates since the row before.  Rewards are unscaled health points; unlike
in ML-Agents, "Cumulative Reward" has the group's reward in it.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from reference.learning.settings import SettingsError, Side
from reference.workshop.files import Table, read_table

WHEN = ("side", "step", "round", "episodes", "phase")
"""Whose row; its side's decisions, rounds and episodes so far; who is learning."""

GROUP_REWARD = "Environment/Group Cumulative Reward"
OWN_REWARD = "Environment/Cumulative Reward"
SURVIVAL = "Environment/Survival"
PRETRAINING = "Losses/Pretraining Loss"

OF_EPISODES = {
    GROUP_REWARD: "group_reward",
    "Environment/Episode Length": "length",
    SURVIVAL: "survival",
    "Environment/Evacuated": "evacuated",
    "Environment/Died": "died",
    "Environment/Seconds": "seconds",
    "Environment/Fire Sources": "sources",
    "Environment/Fires Refused": "refused",
}
"""The fact of an episode that each is the mean of; the group is the robots'."""

OWN_FACT: dict[Side, str] = {"robots": "group_reward", "fire": "fire_reward"}

OF_UPDATES = (
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
)
COLUMNS = (*WHEN, GROUP_REWARD, OWN_REWARD, *list(OF_EPISODES)[1:], *OF_UPDATES)
TIMES = (
    "round",
    "decisions",
    "play_seconds",
    "learn_seconds",
    "decisions_per_second",
)
"""What a clock says about a round, in a file of its own: no two runs agree in it."""

Row = dict[str, Any]


class Means:
    """Means by name of what has come in since they were last taken."""

    def __init__(self) -> None:
        self.sums: dict[str, float] = {}
        self.counts: dict[str, int] = {}

    def add(self, values: Mapping[str, float]) -> None:
        """One more value of each of these names."""
        for name, value in values.items():
            self.sums[name] = self.sums.get(name, 0.0) + value
            self.counts[name] = self.counts.get(name, 0) + 1

    def taken(self) -> dict[str, float]:
        """The means; then it begins anew."""
        means = {name: self.sums[name] / self.counts[name] for name in self.sums}
        self.sums, self.counts = {}, {}
        return means


class Summary:
    """What one side's next row will say."""

    def __init__(self, side: Side, every: int):
        self.side, self.every = side, every
        self.means = Means()
        self.last = 0

    def add(
        self, facts: Iterable[Mapping[str, float]], update: Mapping[str, float]
    ) -> None:
        """Facts of episodes, and what the update said, if there was one."""
        names = OF_EPISODES | {OWN_REWARD: OWN_FACT[self.side]}
        for fact in facts:
            self.means.add({name: fact[of] for name, of in names.items()})
        self.means.add(update)

    def row(self, step: int, when: Mapping[str, Any]) -> Row | None:
        """A row, if this step is past another multiple of `summary_freq`."""
        if step // self.every == self.last // self.every:
            return None
        self.last = step
        return {"side": self.side, "step": step, **when, **self.means.taken()}

    def state(self) -> dict[str, Any]:
        """Plain numbers, for a checkpoint."""
        return {"last": self.last, "sums": self.means.sums, "counts": self.means.counts}

    def load(self, state: Mapping[str, Any]) -> None:
        """What `state` gave."""
        self.last = state["last"]
        self.means.sums, self.means.counts = dict(state["sums"]), dict(state["counts"])


def table_to(path: Path, columns: Sequence[str], rounds: int) -> Table:
    """Go on with a table, without the rows of more than so many rounds.

    Raises ValueError for a file that is another table, OSError.
    """
    there = read_table(path, columns, dict)
    return Table(path, columns, (r for r in there if int(r["round"]) <= rounds))


class Board:
    """The same for TensorBoard, a folder for each side; wants the extra of its name."""

    def __init__(self, folder: Path, steps: Mapping[Side, int]):
        """steps: how far each side is; what is there of later ones is hidden.

        Raises SettingsError without the extra `tensorboard`.
        """
        try:
            from torch.utils.tensorboard import SummaryWriter
        except ImportError as error:
            raise SettingsError(
                "TensorBoard is not installed. pip install "
                "'fire-rescue-reference[tensorboard]', or leave --tensorboard out."
            ) from error
        self.writers = {
            side: SummaryWriter(str(folder / side), purge_step=step + 1)
            for side, step in steps.items()
        }

    def append(self, rows: Sequence[Row]) -> None:
        """Every number of the rows under its name."""
        for row in rows:
            writer = self.writers[row["side"]]
            for name in COLUMNS[len(WHEN) :]:
                if name in row:
                    writer.add_scalar(name, row[name], row["step"])
            writer.flush()

    def close(self) -> None:
        """Nothing more comes."""
        for writer in self.writers.values():
            writer.close()

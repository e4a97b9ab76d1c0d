"""Compare: robots x fires x seeds with intervals, and whole experiments.

Cross-play is `named` (who plays), `matches` (what is evaluated), `runs` (all of them
played) and `results` (what they come to, by `intervals`); `buildings` does so in
several.  An experiment is `design` (one file), `jobs` (train, test) and `report` (a
page).

    from reference.evaluation.score import paper_ruler
    from reference.workshop.comparing import begin_evaluation, cells
    from reference.workshop.comparing import play_evaluation, table
    from reference.workshop.storage.workers import workers

    evaluation = begin_evaluation(robots=("sweep", "patrol"), fires=("random",))
    with workers(0) as executor:  # more: under `if __name__ == "__main__":`
        results = play_evaluation(evaluation, None, executor)
    print(table(cells(results, paper_ruler())))
"""

from reference.workshop.comparing.matches import (
    DEFAULT_EPISODES,
    Evaluation,
    begin_evaluation,
    resume_evaluation,
)
from reference.workshop.comparing.named import strategy_named
from reference.workshop.comparing.results import Cell, cells, ruler_of, table
from reference.workshop.comparing.runs import RunResult, play_evaluation

__all__ = [
    "DEFAULT_EPISODES",
    "Cell",
    "Evaluation",
    "RunResult",
    "begin_evaluation",
    "cells",
    "play_evaluation",
    "resume_evaluation",
    "ruler_of",
    "strategy_named",
    "table",
]

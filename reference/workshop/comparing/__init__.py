"""Compare: robots x fires x seeds with intervals, and whole experiments.

Cross-play is `named` (who plays), `matches` (what is
evaluated), `runs` (all of them played) and `results` (what they come to, by
`intervals`).  An experiment is `design` (one file), `jobs` (train, test) and `report`
(a page).

    evaluation = begin(robots=("sweep", "patrol"), fires=("random",))
    with workers(2) as executor:
        results = evaluate(evaluation, None, executor)
    print(table(cells(results, PAPER)))
"""

from reference import former_names
from reference.workshop.comparing.matches import (
    DEFAULT_EPISODES,
    Evaluation,
    begin_evaluation,
    resume_evaluation,
)
from reference.workshop.comparing.named import strategy_named
from reference.workshop.comparing.results import Cell, cells, ruler_of, table
from reference.workshop.comparing.runs import RunResult, play_evaluation

__getattr__ = former_names(
    __name__, {"begin": "begin_evaluation", "evaluate": "play_evaluation"}
)

"""Cross-play: evaluate all robots' strategies against all fires, on the same seeds.

Clauses: F9, F12.  Read `contestants` (who plays), `matches` (what is evaluated), `runs`
(all of them played) and `results` (what they come to, by `intervals`).

    evaluation = begin(robots=("sweep", "patrol"), fires=("random",))
    with workers(2) as executor:
        results = evaluate(evaluation, None, executor)
    print(table(cells(results, PAPER)))
"""

from reference.workshop.crossplay.contestants import contestant
from reference.workshop.crossplay.matches import EPISODES, Evaluation, begin, resume
from reference.workshop.crossplay.results import Cell, cells, ruler_of, table
from reference.workshop.crossplay.runs import RunResult, evaluate

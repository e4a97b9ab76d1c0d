"""Cross-play: evaluate all robots' strategies against all fires, on the same seeds.

Clauses: F9, F12.  Read `records` (one run), `asked` (what is evaluated), `playing` (all
runs) and `results` (what they come to).

    evaluation = begin(Asked(robots=("sweep", "patrol"), fire=("random",)))
    with workers(2) as executor:
        records = evaluate(evaluation, None, executor)
    print(table(cells(records, PAPER)))
"""

from reference.workshop.evaluation.crossplay.asked import (
    EPISODES,
    MOST_RUNS,
    Arena,
    Asked,
    Evaluation,
    begin,
    resume,
    unlike_training,
)
from reference.workshop.evaluation.crossplay.playing import evacuation_of, evaluate
from reference.workshop.evaluation.crossplay.records import Match, Record, read
from reference.workshop.evaluation.crossplay.results import (
    HEADINGS,
    Cell,
    as_json,
    as_plain,
    cells,
    mean_and_interval,
    read_ruler,
    ruler_of,
    table,
    write_cells,
)

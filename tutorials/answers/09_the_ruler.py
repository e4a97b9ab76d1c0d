"""Exercise 9: calibrate the ruler from other seeds. It takes 20 seconds.

E moves by up to 0.06. That of `sweep` where nothing burns moves by 0.04, out of its
interval: the interval knows of other runs, but not of another ruler. So compare
scores by one ruler only, or use many more seeds.
"""

from reference.building import building_of
from reference.evaluation.bounds import critical_points
from reference.workshop import comparing
from reference.workshop.comparing import cells
from reference.workshop.storage.workers import InProcess


def evaluated(seed: int) -> tuple:
    """Play as in the tutorial; results, and the ruler on which `sweep` scores 1."""
    evaluation = comparing.begin_evaluation(
        robots=("none", "sweep"),
        fires=("none", "random", "greedy"),
        building="museum",
        people=12,
        episodes=24,
        seed=seed,
    )
    results = comparing.play_evaluation(evaluation, None, InProcess())
    museum = building_of(evaluation.arena.plan)
    worst, best = critical_points(museum, evaluation.arena.scenario)
    return results, comparing.ruler_of(results, "sweep", worst, best)


results, ruler = evaluated(0)
_, other = evaluated(100)
for old, new in zip(cells(results, ruler), cells(results, other), strict=True):
    E, low, high = old.score
    moved = new.score.mean - E
    print(f"{old.robots:5} {old.fire:6} E {E:.2f} [{low:.2f}, {high:.2f}] {moved:+.2f}")
#> none  none   E 0.83 [0.80, 0.87] +0.03
#> none  random E 0.45 [0.39, 0.55] +0.04
#> none  greedy E 0.42 [0.34, 0.52] +0.04
#> sweep none   E 1.03 [1.00, 1.05] +0.04
#> sweep random E 1.00 [0.77, 1.23] +0.06
#> sweep greedy E 0.97 [0.77, 1.20] +0.06

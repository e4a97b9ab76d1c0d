"""Exercise 14: one more exit for School 1. It takes 10 seconds.

In the corridor, the room `way`, it saves twice as many of those who are alone: who
steps into it sees the exit. The room `art` lies behind two others, so fewer find its
exit, and guides have farther to go.
"""

from reference.workshop import comparing
from reference.workshop.maps.generated import generated_text
from reference.workshop.storage.workers import InProcess

school = generated_text(seed=1)
SOUTH = school.splitlines().index("floor 2: classrooms") - 2  # the ground floor's last


def with_exit(column: int) -> str:
    """Cut an exit of two cells into the southern wall; return the map's text."""
    lines = school.splitlines()
    row = lines[SOUTH]
    lines[SOUTH] = row[:column] + "EE" + row[column + 2 :]
    return "\n".join(lines) + "\n"


PLANS = {
    "as it is": school,
    "exit in the corridor": with_exit(28),
    "exit in the room art": with_exit(8),
}
for name, text in PLANS.items():
    evaluation = comparing.begin_evaluation(
        robots=("none", "escort"), fires=("random",), building=text, episodes=12
    )
    results = comparing.play_evaluation(evaluation, None, InProcess())
    nobody, escort = comparing.cells(results, None)
    alone = nobody.survival.mean
    guided = escort.survival.mean
    print(f"{name:<20} {alone:4.0%} alone, {guided:4.0%} with escort")
#> as it is              32% alone,  50% with escort
#> exit in the corridor  64% alone,  85% with escort
#> exit in the room art  53% alone,  68% with escort

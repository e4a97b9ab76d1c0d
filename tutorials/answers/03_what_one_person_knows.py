"""Exercise 3: what is memory worth? It takes 5 seconds.

With forgetting, a visitor tries doors again that lead nowhere. So fewer get out.
"""

from reference import Scenario, Simulation, load
from reference.fire import NoFire
from reference.humans import forget
from reference.robots import NoRobots

museum = load("museum")
one = Scenario(people=1, rooms=("1/greece",))


def gets_out(seed: int, every: float) -> bool:
    """Run a visitor who forgets everything every so many seconds."""
    visit = Simulation(museum, one, NoRobots(), NoFire(), seed)
    ticks = round(every / visit.tick)
    while not visit.done:
        visit.step()
        if visit.ticks % ticks == 0:
            forget(visit.world.minds[0])
    return visit.outcome().evacuated == 1


for every in (1000, 40, 20, 10):
    out = sum(gets_out(seed, every) for seed in range(10))
    print(f"forgets every {every:4} s: {out:2} of 10 get out")
#> forgets every 1000 s: 10 of 10 get out
#> forgets every   40 s:  9 of 10 get out
#> forgets every   20 s:  8 of 10 get out
#> forgets every   10 s:  3 of 10 get out

"""Tutorial 12: what an adversary can teach.

The paper lets a fire attack robots so that they become robust. That needs a game in
which something better can be done under attack. You meet a fire that repeats itself,
robots that know it and stand in its way, and a fire that looks before it strikes. It
takes 10 seconds.
"""

from collections import Counter
from pathlib import Path

from reference import Scenario, Simulation, load
from reference.workshop import drawing
from reference.workshop.engine import run_to_end
from reference.workshop.strategies import FIRES
from reference.workshop.strategies.fires import FixedFire, beside_ways_out
from reference.workshop.strategies.guard import Guard
from reference.workshop.strategies.guides import Observer
from reference.world import FireLit

# %% A fire that repeats itself
# `fixed` lights cells that can burn, in the same order, whatever people do: those
# nearest to the exits, then those nearest to the entrances of stairwells.

institute = load("paper")


def played(robots, fire):
    """Play eight evacuations; robots, fire: functions that make a strategy."""
    runs = []
    for seed in range(8):
        runs.append(Simulation(institute, Scenario(), robots(), fire(), seed))
    run_to_end(runs)
    return runs


def saved(runs):
    """Share of people who got out alive, in per cent."""
    out = sum(run.outcome().evacuated for run in runs)
    return f"{out / (40 * len(runs)):.0%}"


sequence = beside_ways_out(Simulation(institute).world)
for number, (floor, x, y) in enumerate(sequence[:3], 1):
    print(f"fire {number}: floor {floor + 1}, ({x}, {y})")
#> fire 1: floor 1, (-17.5, 18.5)
#> fire 2: floor 1, (17.5, -11.5)
#> fire 3: floor 1, (3.5, 17.5)
leads = played(Observer, FixedFire)
print("`observer` saves", saved(leads))
#> `observer` saves 78%

# %% Stand in its way
# Rule D6: no fire starts where a robot stands. It starts in another, random place, and
# in training not at all. `guard` leads as `observer` does, but has one robot step onto
# the next cell of the sequence just before its time, if one gets there.

guards = played(Guard, FixedFire)
print("`guard` saves", saved(guards))
#> `guard` saves 91%
for name, runs in (("observer", leads), ("guard", guards)):
    events = [event for run in runs for event in run.events]
    fires = [event for event in events if isinstance(event, FireLit)]
    as_usual = sum((fire.floor, fire.x, fire.y) in sequence for fire in fires)
    print(f"{name}: {as_usual} of {len(fires)} fires in a cell of the sequence")
#> observer: 63 of 63 fires in a cell of the sequence
#> guard: 51 of 62 fires in a cell of the sequence

# Look at it: just before the second fire is due, at 35 s, a robot stands in its cell,
# in the canteen: the ring is around it.

watched = Simulation(institute, Scenario(), Guard(), FixedFire(), seed=3)
while watched.world.time < 34.4:
    watched.step()
Path("out").mkdir(exist_ok=True)
figure = drawing.draw(watched)
_, x, y = sequence[1]
ring = {"mfc": "none", "mec": "#0868ac", "mew": 2.5, "zorder": 8}
figure.axes[0].plot(x, y, "o", ms=24, **ring)  # on floor 1
print(drawing.save(figure, "out/12_guard.png"))
#> out/12_guard.png

# %% What it costs elsewhere
# Under other fires the robot that stands guard is a robot that does not lead. So
# `guard` gives up when it sees that the fire is not `fixed`: when a source appears
# elsewhere though nobody stood in the way, or right beside the guard, which only a fire
# that looks does. In these eight evacuations `guard` costs nothing that one can see.
# RESULTS.md has two hundred.

for fire in ("none", "random", "busiest"):
    by_observer = saved(played(Observer, FIRES[fire]))
    by_guard = saved(played(Guard, FIRES[fire]))
    print(f"{fire}: `observer` saves {by_observer}, `guard` {by_guard}")
#> none: `observer` saves 97%, `guard` 97%
#> random: `observer` saves 96%, `guard` 96%
#> busiest: `observer` saves 68%, `guard` 68%

# %% A fire that looks
# `busiest` lights the cell that most people will cross. Does looking help it? Count its
# first, second, ... choices, and let that sequence burn without looking.

busy = played(Observer, FIRES["busiest"])
all_sources = [run.world.flames.sources for run in busy]
own = []
for number in range(min(map(len, all_sources))):
    nth = [sources[number] for sources in all_sources]
    places = Counter((source.floor, source.x, source.y) for source in nth)
    place = max(places, key=places.get)
    own.append(place)
    print(f"fire {number + 1}: its usual place in {places[place]} of 8 evacuations")
#> fire 1: its usual place in 5 of 8 evacuations
#> fire 2: its usual place in 3 of 8 evacuations
#> fire 3: its usual place in 2 of 8 evacuations
#> fire 4: its usual place in 4 of 8 evacuations
#> fire 5: its usual place in 3 of 8 evacuations
#> fire 6: its usual place in 1 of 8 evacuations
#> fire 7: its usual place in 2 of 8 evacuations
#> fire 8: its usual place in 1 of 8 evacuations
blind = played(Observer, lambda: FixedFire(own))
print("survivors of `busiest`:", saved(busy), " of its sequence:", saved(blind))
#> survivors of `busiest`: 68%  of its sequence: 72%

# A fire is adaptive only if it does more harm than its own most frequent sequence. Then
# no guard can wait for it, and robots have to learn something else than a place.
# Three things are unfair here. The sequence is tested on the evacuations that it was
# read from. It is as short as the shortest of them. Its last places were chosen once or
# twice in eight. In 200 other evacuations, which RESULTS.md tells of, such a sequence
# leaves two points more alive than `busiest`: that may be luck.
# `tutorials/experiments/is_it_adaptive.py` asks it of any fire, from other evacuations.
#
# So there is something to teach: whoever knows the attack saves more under it. Robots
# that learn from nothing can find it out by themselves, but it takes millions of
# decisions, and one training of two did not (`tutorials/pictures/who_guards.png`).
# RESULTS.md tells more, from more evacuations.

# %% Exercise
# `closer` lights the free cell nearest to each way out in turn. Read its sequence from
# one evacuation without robots, give it to `Guard(places)`, and compare with
# `observer`. Guess first: how much does the guard gain?
# Hint: `world.flames.sources` has what was lit, with `floor`, `x` and `y`.

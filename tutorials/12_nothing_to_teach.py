"""Tutorial 12: why an adversary may have nothing to teach.

You look at the strongest fire that learned, and ask what robots could learn from it.
The paper lets a fire attack robots so that they become robust. That needs a game in
which something better can be done under attack. It takes 15 seconds.
"""

from collections import Counter

from reference.evaluation.difficulty import arrival_of, ways_lost
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.workshop.crossplay.contestants import contestant
from reference.workshop.lockstep import to_the_end
from reference.workshop.maps import load
from reference.workshop.strategies.fires import FixedFire
from reference.workshop.workers import one_thread
from reference.world import Evacuated

# %% The strongest fire
# `observer` is the best guide that knows no more than a robot observes. Here it guides
# under random fires, and under the fire that ships as `learned`.

institute, SEEDS = load("paper"), range(6)


def played(robots: str, fire) -> list[Simulation]:
    """Run six evacuations; fire: a name, or places to light in their order."""
    runs = []
    for seed in SEEDS:
        guide = contestant(robots, "robots")
        lit = contestant(fire, "fire") if isinstance(fire, str) else FixedFire(fire)
        runs.append(Simulation(institute, Scenario(), guide, lit, seed))
    with one_thread():
        to_the_end(runs)
    return runs


def saved(runs: list[Simulation]) -> str:
    """Share of people who got out alive."""
    return f"{sum(run.outcome().evacuated for run in runs) / (40 * len(runs)):.0%}"


random, learned = played("observer", "random"), played("observer", "learned")
print("random fire:", saved(random), " learned fire:", saved(learned))
#> random fire: 88%  learned fire: 33%

# %% It repeats itself
# Where did it light its fires? Count the first, the second, and so on.

lit = [[(s.floor, s.x, s.y) for s in run.world.flames.sources] for run in learned]
sequence = []
for number, places in enumerate(zip(*lit, strict=False), 1):
    (place, often), *_ = Counter(places).most_common()
    floor, x, y = place
    print(f"fire {number}: floor {floor + 1}, ({x}, {y}) in {often} of {len(SEEDS)}")
    sequence.append(place)
#> fire 1: floor 1, (12.5, -6.5) in 6 of 6
#> fire 2: floor 1, (-7.5, 11.5) in 6 of 6
#> fire 3: floor 1, (-13.5, 8.5) in 4 of 6
#> fire 4: floor 1, (15.5, 11.5) in 5 of 6
#> fire 5: floor 1, (3.5, 17.5) in 4 of 6
#> fire 6: floor 2, (15.5, 11.5) in 3 of 6
#> fire 7: floor 2, (-1.5, 8.5) in 5 of 6

# The first two stand beside the two exits. So play that sequence without looking at
# anybody. Does a fire that observes 167 numbers do more harm?

print("the sequence alone:", saved(played("observer", sequence)))
#> the sequence alone: 33%

# A fire is adaptive only if it does more harm than its own most frequent sequence. This
# one is not. `tutorials/experiments/is_it_adaptive.py` asks it of any fire.

# %% Knowing more does not help
# `escort` knows where everybody is and what burns. `observer` has to guess. If there
# were a better answer to this fire, the one who knows more should come nearer to it.

print("who knows everything:", saved(played("escort", "learned")))
#> who knows everything: 33%

# %% It is a race
# Flames close ways out one after the other, and a way once closed stays closed. When
# has each floor lost all of its ways?

(first, *_) = learned
lost = ways_lost(institute, arrival_of(first)) == 1  # each second, each area
for floor in range(institute.floors):
    rooms = [
        k
        for k, area in enumerate(institute.areas)
        if area.floor == floor and area.kind == "room"
    ]
    shut = lost[:, rooms].mean(axis=1) > 0.5
    print(f"most rooms of floor {floor + 1} are shut after {shut.argmax()} s")
#> most rooms of floor 1 are shut after 78 s
#> most rooms of floor 2 are shut after 78 s
#> most rooms of floor 3 are shut after 78 s
last = max(event.time for event in first.events if isinstance(event, Evacuated))
print(f"the last person got out after {last:.0f} s")
#> the last person got out after 56 s

# Whoever is not out by then dies. No way round is left to be found. All that counts is
# to be quick, and to be quick is right under every fire, under none too. So robots that
# never saw a fire are hardly worse here than robots that learned under attack.
#
# RESULTS.md has the long version: a family of ten guides, of which the best under
# random fire is as good as the best under each hard fire; and robots that learned with
# an adversary beside robots that did not. It tells two things apart: an adversary that
# fails to teach, and a game in which there is nothing to be taught.

# %% Exercise
# Who could have won the race? For each floor, print how many seconds people need to the
# nearest exit if they know the way and nothing burns: on average, and from the farthest
# place. Compare them with the moments when fires 1 and 2 are lit, after 10 and 35 s.
# Hint: `navigation_of(institute).distance_to(mark)` has the metres to a door, exit or
# entrance of stairs from each place of its floor; `paper.STAIRS_METRES` is one storey.

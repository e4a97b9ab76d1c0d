"""What is one choice of one robot worth, and how many evacuations does it take to see?

    python tutorials/experiments/one_choice.py --robots observer --fire busiest

In the paper's building, at a moment of each evacuation, one robot does something else
than its team's strategy says: it goes to one of its options, for HOLD seconds or until
it is there. Each option is played to the end in the same futures, and counted in people
saved.
"""

from argparse import ArgumentParser

import numpy as np

from reference.game.moments import Moment
from reference.game.observations import from_normalised, robot_vectors
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.workshop.crossplay.contestants import contestant
from reference.workshop.crossplay.intervals import of_mean
from reference.workshop.landmarks.of_robots import RobotOption, RobotOptions
from reference.workshop.lockstep import to_the_end
from reference.workshop.maps import load
from reference.workshop.worst_case import another_future

HOLD = 20.0  # seconds


class Otherwise:
    """A strategy, but for one robot that goes elsewhere until a time."""

    def __init__(self, strategy, body, place, start):
        self.strategy, self.body, self.place, self.start = strategy, body, place, start

    def decide(self, world, robots, rng):
        goals = self.strategy.decide(world, robots, rng)
        late = world.time - self.start
        for k, robot in enumerate(robots):
            if robot.body == self.body and (not late or robot.way) and late < HOLD:
                goals[k] = self.place
        return goals


def saved(team, fire, seed, start, futures):
    """People saved, (1 + options, futures), in the first row as the team decides; and
    which options are groups of people. start: seconds."""
    building, scenario = load("paper"), Scenario()
    players = contestant(team, "robots"), contestant(fire, "fire")
    now = Simulation(building, scenario, *players, seed)
    while now.world.time < start - now.tick / 2:
        now.step()
    robots, rng = now.world.robots, np.random.default_rng(seed)
    robot = rng.choice([k for k, robot in enumerate(robots) if robot.active])
    vectors = robot_vectors(now.world, scenario)
    moment = Moment.of(now.world, vectors, np.ones(len(robots), dtype=bool))
    choices = RobotOptions(building, scenario)(moment)
    offered = choices.action_mask[robot]
    offered[RobotOption.KEEP] = False
    places = from_normalised(building, choices.places[robot, offered].astype(float))
    group = choices.features[robot, offered, RobotOption.GROUP] > 0
    body, rows = robots[robot].body, []
    for place in (None, *map(tuple, places.tolist())):
        who = now.robot_strategy
        if place:
            who = Otherwise(who, body, place, now.world.time)
        here = now.world, scenario, who, now.fire_strategy
        runs = [another_future(*here, seed=k) for k in range(futures)]
        to_the_end(runs)
        rows.append([run.outcome().evacuated for run in runs])
    return np.array(rows, dtype=float), group


def facts(people, group):
    """Of one moment: variances of futures and of options; people saved more by an
    option on average, by one that is a group of people, and by the best of them and the
    team's own choice, which is found in one half of the futures and counted in the
    other.
    """
    noise = people.var(axis=1, ddof=1).mean()
    spread = people[1:].mean(axis=1).var(ddof=1) - noise / people.shape[1]
    more, halves = people - people[0], np.array_split(people - people[0], 2, axis=1)
    best = [b.mean(axis=1)[a.mean(axis=1).argmax()] for a, b in (halves, halves[::-1])]
    groups = more[1:][group].mean() if group.any() else np.nan
    return noise, spread, more[1:].mean(), groups, np.mean(best)


if __name__ == "__main__":
    parser = ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--robots", default="observer", metavar="S")
    parser.add_argument("--fire", default="busiest", metavar="S")
    parser.add_argument("--seconds", type=float, nargs="+", default=(5, 10, 20, 30))
    parser.add_argument("--moments", type=int, default=8, metavar="N")
    parser.add_argument("--futures", type=int, default=16, metavar="N")
    parser.add_argument("--seed", type=int, default=7000, metavar="N")
    asked = parser.parse_args()
    seeds = range(asked.seed, asked.seed + asked.moments)
    players, when = (asked.robots, asked.fire), asked.seconds
    found = [
        facts(*saved(*players, seed, when[seed % len(when)], asked.futures))
        for seed in seeds
    ]
    noise, spread, *more = map(np.array, zip(*found, strict=True))
    print("people of forty, {} against {}, {} moments".format(*players, asked.moments))
    print(f"  standard deviation of futures: {noise.mean() ** 0.5:.1f}")
    print(f"  standard deviation of options: {max(spread.mean(), 0.0) ** 0.5:.1f}")
    words = ("an option", "a group of people", "the best option")
    for what, gain in zip(words, more, strict=True):
        mean, low, high = of_mean(gain[np.isfinite(gain)])
        print(f"  saved more by {what}: {mean:.2f} [{low:.2f}, {high:.2f}]")

"""Robots that learned in some buildings, in others: how near do they come to a guide?

    python tutorials/experiments/any_map.py
    python tutorials/experiments/any_map.py out/any/checkpoint-000100.pt --out out/mine
    python tutorials/experiments/any_map.py --most-robots 8 --out out/many

Held out are thirty generated buildings, drawn from seeds that no training takes, with
people and robots by lot, up to four on a floor, and five that ship.  In each play
nobody, `sweep`, `escort` and those who learned, under three fires, on the same
evacuations.  A building is the unit: intervals are over buildings.  It takes some
fifteen minutes of one core.

Said before looking, of each fire and over all buildings: not more than 2 points below
whichever of `sweep` and `escort` saves more on average, and three quarters of what that
guide gains over nobody in buildings where it gains 8 points or more.
"""

import sys
from argparse import ArgumentParser
from pathlib import Path
from typing import NamedTuple

import numpy as np

from reference import load
from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing.intervals import format_interval, interval_of_mean
from reference.workshop.comparing.matches import begin_evaluation
from reference.workshop.comparing.results import align_columns
from reference.workshop.comparing.runs import play_evaluation
from reference.workshop.maps.generated import generated_text
from reference.workshop.storage.files import make_folder, write_json
from reference.workshop.storage.workers import workers
from reference.workshop.training.families import ROOM, Family

GUIDES = ("sweep", "escort")
FIRES = ("none", "random", "busiest")
SHIPPED = ("museum", "school", "tower", "maze", "tiny")
FIRST_SEED = 5000  # of generated buildings, and of evacuations
MOST_ROBOTS = 4  # of a floor of a generated building
GAINS = 8.0  # points that a guide has to be worth, to ask for a share of them


class Place(NamedTuple):
    """A building, as `evaluate` takes it, and who is in it."""

    building: str
    people: int
    robots_per_floor: int


def generated_places(folder, number, first, most_robots=MOST_ROBOTS):
    """Draw buildings and people by lot, from the ranges of trainings, and robots."""
    make_folder(folder)
    family = Family()
    for seed in range(first, first + number):
        rng = np.random.default_rng(seed)
        ranges = (
            family.widths,
            family.heights,
            family.floors,
            family.people,
            (1, most_robots),
        )
        drawn = [int(rng.integers(low, high, endpoint=True)) for low, high in ranges]
        *size, people, robots = drawn
        path = folder / f"{seed}.txt"
        path.write_text(generated_text(seed, *size), encoding="utf-8")
        yield Place(str(path), min(people, room_in(path)), robots)


def room_in(path):
    """Count the people who fit without a crowd.

    Trainings count fewer: they leave out doors, stairs and exits.
    """
    building = load(str(path))
    cells = int(building.walkable.sum(axis=(1, 2)).min()) * building.floors
    return max(1, cells // ROOM)


def survivors(place, robots, fires, episodes, folder, executor):
    """Per cent who get out, by robots and fire, each a mean over evacuations."""
    evaluation = begin_evaluation(
        robots,
        fires,
        place.building,
        people=place.people,
        seed=FIRST_SEED,
        episodes=episodes,
        scenario={"robots_per_floor": place.robots_per_floor},
    )
    played = play_evaluation(evaluation, folder, executor)
    found = {}
    for run in played:
        found.setdefault((run.robots, run.fire), []).append(100 * run.survival)
    return {who: float(np.mean(shares)) for who, shares in found.items()}


def table_of_buildings(places, found, robots):
    """What came in each building under each fire, aligned."""
    rows = [["building", "people", "robots a floor", *robots, "under"]]
    for place, (name, cells) in zip(places, found.items(), strict=True):
        where = [name, str(place.people), str(place.robots_per_floor)]
        for fire in FIRES:
            figures = [f"{cells[who, fire]:.1f}" for who in robots]
            rows.append([*where, *figures, fire])
    return align_columns(rows, "<>>" + ">" * len(robots) + "<")


def compare(found, learned, fire):
    """What came under one fire, over all buildings: a row of the table at the end."""
    saved = {
        who: np.array([cells[who, fire] for cells in found.values()])
        for who in ("none", *GUIDES, learned)
    }
    best = max(GUIDES, key=lambda guide: saved[guide].mean())
    less = interval_of_mean(saved[learned] - saved[best])
    gain = saved[best] - saved["none"]
    worth = gain >= GAINS
    share = "-"
    if worth.any():
        own = (saved[learned] - saved["none"])[worth].sum()
        share = f"{100 * own / gain[worth].sum():.0f} % in {worth.sum()}"
    means = [f"{each.mean():.1f}" for each in saved.values()]
    difference = format_interval(less, 1, ends=True)
    return [fire, *means, best, difference, share]


def main():
    parser = ArgumentParser(description="Robots in buildings that they never saw.")
    parser.add_argument("robots", nargs="?", default="learned", help="a checkpoint")
    parser.add_argument("--out", type=Path, default=Path("out/any_map"))
    parser.add_argument("--buildings", type=whole(1), default=30, help="generated")
    parser.add_argument("--first", type=whole(0), default=FIRST_SEED, help="seed")
    parser.add_argument(
        "--most-robots", type=whole(1), default=MOST_ROBOTS, help="of a floor"
    )
    parser.add_argument("--episodes", type=whole(1), default=20)
    parser.add_argument("--workers", type=whole(0), default=2)
    options = parser.parse_args()

    drawn = (options.buildings, options.first, options.most_robots)
    places = [*generated_places(options.out, *drawn)]
    places += [Place(name, 12 if name == "tiny" else 40, 2) for name in SHIPPED]
    robots = ("none", *GUIDES, options.robots)
    found = {}
    with workers(options.workers) as executor:
        for place in places:
            name = Path(place.building).stem
            folder = options.out / f"runs-{name}"
            found[name] = survivors(
                place, robots, FIRES, options.episodes, folder, executor
            )

    print(table_of_buildings(places, found, robots))
    head = ["fire", *robots, "better guide", "less that", "share of its gain"]
    ends = [compare(found, options.robots, fire) for fire in FIRES]
    print()
    print(align_columns([head, *ends], "<" + ">" * len(robots) + "<<<"))

    listed = {
        name: {f"{who} {fire}": x for (who, fire), x in cells.items()}
        for name, cells in found.items()
    }
    write_json(options.out / "any_map.json", listed)


if __name__ == "__main__":
    sys.exit(exit_status(main))

"""Families of buildings: a job plays in one of them, with people and robots by lot.

A policy that has no building in it can learn in many [C5, chosen].  A family is some
maps, or generated buildings: so many, or a new one in every job.  In generated ones
people and robots vary too, job by job.  All of it follows from the run's seed.
"""

import gc
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from reference.building import Building, Kind, building_of
from reference.learning.rollouts import Job
from reference.workshop import maps
from reference.workshop.anchors.known_ways import known_ways_of
from reference.workshop.engine import engine_is_ready
from reference.workshop.maps.generated import generated_text
from reference.workshop.storage.runs import ContradictionError
from reference.workshop.strategies.observed import known_map_of

HEADS_OF_SEVERAL = ("set",)
"""Heads of policies that have no building in them."""

RANDOM = "random"
MOST_BUILDINGS = 10**6
FIRST_SEED = 2**32
"""[C5, chosen] generated buildings in trainings have seeds from here on. Who asks for
smaller ones, as tests do, gets buildings that are new to whoever learned."""

Bounds = tuple[int, ...]  # least and most

FREED_TOGETHER = 8  # buildings that nobody keeps any more

ROOM = 4  # [C5, chosen] cells of a floor for each of its people, at least

# What seeds are for, beside those of `rounds`.
BUILDINGS = 10
ORDERS = 11
PEOPLE_AND_ROBOTS = 12


@dataclass(frozen=True)
class Family:
    """Buildings of one training.

    names   of maps as they were asked for;  plans  their texts
    number  of generated buildings, where there are no maps; 0: a new one in every job
    widths, heights, floors  of generated buildings [C5, chosen], cells of a main body
    people, robots_per_floor  in them; where maps are named, the scenario tells both
    """

    names: tuple[str, ...] = ()
    plans: tuple[str, ...] = ()
    number: int = 0
    widths: Bounds = (15, 60)
    heights: Bounds = (10, 40)
    floors: Bounds = (1, 4)
    people: Bounds = (10, 120)
    robots_per_floor: Bounds = (1, 8)

    def about(self) -> str:
        """Say in some words which buildings these are."""
        if self.plans:
            return ", ".join(building_of(plan).title for plan in self.plans)
        many = f"{self.number:,}" if self.number else "a new one in every job"
        return (
            f"generated buildings ({many}; {_in_words(self.widths)} x "
            f"{_in_words(self.heights)} cells, {_in_words(self.floors)} floors, "
            f"{_in_words(self.people)} people, {_in_words(self.robots_per_floor)} "
            "robots a floor)"
        )

    def bounds(self) -> dict[str, Bounds]:
        """Find the scenario's fields that the family tells, least and most."""
        if self.plans:
            return {}
        return {"people": self.people, "robots_per_floor": self.robots_per_floor}

    def varied(self) -> dict[str, Bounds]:
        """Find those of them that jobs draw by lot."""
        told = self.bounds().items()
        return {name: (low, high) for name, (low, high) in told if low < high}

    def example(self) -> str:
        """The text of one building, for what is the same in all."""
        if self.plans:
            return self.plans[0]
        return generated_text(0, self.widths[0], self.heights[0], self.floors[0])


def _in_words(bounds: Bounds) -> str:
    low, high = bounds
    return f"{low}" if low == high else f"{low} to {high}"


def family_of(words: Sequence[str], stated: Mapping[str, Any]) -> Family | None:
    """Read which buildings are asked for; None for a single map.

    stated: fields of a scenario that are asked for; they do not vary. Raises
    InputError, MistakesError for a map, OSError for an unreadable file.
    """
    random = next((word for word in words if word.partition(":")[0] == RANDOM), None)
    if random is None:
        if len(words) == 1:
            return None
        if len({*words}) < len(words):
            raise ContradictionError("--building: a map is named twice. Name it once.")
        plans = [maps.plan_of(map_named(word)) for word in words]
        return Family(tuple(words), tuple(plans))

    if len(words) > 1:
        raise ContradictionError(
            f"--building: {random} stands alone. Leave the others out."
        )
    lost = stated.keys() & {"rooms", "people_per_floor"}
    if lost:
        raise ContradictionError(
            f"--building {random}: {min(lost)} is of one building. Leave it out, or "
            "take people."
        )
    fixed: dict[str, Any] = {}
    for name in ("people", "robots_per_floor"):
        if name in stated:
            fixed[name] = (stated[name], stated[name])
    return Family(number=_number(random), **fixed)


def map_named(word: str) -> Building:
    """Load the map of a word; a slip of the pen may mean `random`. Raises as `load`."""
    if "\n" not in word:
        maps.find_map(word, (RANDOM,))
    return maps.load(word)


def _number(word: str) -> int:
    """How many buildings `random` or `random:N` means; 0: as many as jobs."""
    _, colon, digits = word.partition(":")
    if not colon:
        return 0
    if not digits.isdecimal() or not 1 <= int(digits) <= MOST_BUILDINGS:
        raise ContradictionError(
            f"--building {word}: write {RANDOM}:N, with N from 1 to {MOST_BUILDINGS:,}."
        )
    return int(digits)


# -- Which building a job plays in --------------------------------------------------


@dataclass(frozen=True)
class Lot:
    """What a job has drawn: a building, and how many people and robots stand in it.

    size  width, height and floors
    """

    seed: int
    size: tuple[int, int, int]
    people: int
    robots_per_floor: int

    def place(self, job: Job) -> Job:
        """Generate the building and let the job play there; fewer people, if need be.

        Whoever plays the job does it, since it takes a moment.
        """
        plan = generated_text(self.seed, *self.size)
        building = building_of(plan)
        rooms = (building.kind == Kind.FLOOR).sum(axis=(1, 2))
        fit = int(rooms.min()) * building.floors // ROOM
        scenario = replace(
            job.scenario,
            people=max(1, min(self.people, fit)),
            robots_per_floor=self.robots_per_floor,
        )
        return replace(job, plan=plan, scenario=scenario)


@dataclass(frozen=True)
class LotJob(Job):
    """A job whose building is not made yet."""

    lot: Lot | None = None

    def placed(self) -> Job:
        """Make the building, and the job in it."""
        rows = {name: x for name, x in vars(self).items() if name != "lot"}
        assert self.lot
        return self.lot.place(Job(**rows))


def prepare(job: Job) -> None:
    """Make the tables of a job's building, which are kept for a few buildings."""
    building = building_of(job.plan)
    _free_earlier(building)
    reach = job.scenario.sight_range
    if engine_is_ready():
        from reference.workshop.engine.rows import sight_made_quickly  # numba
        from reference.workshop.engine.tables import tables_of

        tables_of(sight_made_quickly(building, reach))
    known_map_of(building)
    known_ways_of(building)


@lru_cache(maxsize=4)  # as many as `build` keeps
def _free_earlier(building: Building) -> None:
    """Free tables of earlier buildings, once for so many new ones.

    A `Navigation` and a `Sight` keep answers of their own methods, so they hold
    themselves. Python looks for such rings in its own time, after tens of buildings; to
    look takes a tenth of a second.
    """
    if _free_earlier.cache_info().misses % FREED_TOGETHER == 0:
        gc.collect()


def job_in(family: Family, seed: int, phase: int, number: int, job: Job) -> Job:
    """Move a job to its building.

    seed: of the run; phase, number: of the job, which say what it draws
    """
    several = len(family.plans) or family.number
    which = _turn(several, seed, phase, number) if several else None
    if family.plans:
        assert which is not None
        return replace(job, plan=family.plans[which])

    if which is None:
        rng = _rng(seed, BUILDINGS, phase, number)
    else:
        rng = _rng(seed, BUILDINGS, which)
    building_seed, size = _drawn_building(family, rng)

    rng = _rng(seed, PEOPLE_AND_ROBOTS, phase, number)
    lot = Lot(
        seed=building_seed,
        size=size,
        people=_draw(rng, family.people),
        robots_per_floor=_draw(rng, family.robots_per_floor),
    )
    return LotJob(**vars(job), lot=lot)


def plan_in(family: Family, seed: int, which: int) -> str:
    """The text of a generated building of a training with this seed, from 0 on."""
    building_seed, size = _drawn_building(family, _rng(seed, BUILDINGS, which))
    return generated_text(building_seed, *size)


def _drawn_building(
    family: Family, rng: np.random.Generator
) -> tuple[int, tuple[int, int, int]]:
    """Draw a building's width, height and floors, and the seed that generates it."""
    width = _draw(rng, family.widths)
    height = _draw(rng, family.heights)
    floors = _draw(rng, family.floors)
    seed = FIRST_SEED + int(rng.integers(2**32))
    return seed, (width, height, floors)


def _turn(several: int, seed: int, phase: int, number: int) -> int:
    """Choose a building for a job: all in turn, in another order each time.

    In one order a building would meet the same fire for ever.
    """
    times, place = divmod(number, several)  # how often all have had their turn
    return int(_rng(seed, ORDERS, phase, times).permutation(several)[place])


def _rng(seed: int, *purpose: int) -> np.random.Generator:
    sequence = np.random.SeedSequence(seed, spawn_key=purpose)
    return np.random.default_rng(sequence)


def _draw(rng: np.random.Generator, bounds: Bounds) -> int:
    low, high = bounds
    return int(rng.integers(low, high + 1))

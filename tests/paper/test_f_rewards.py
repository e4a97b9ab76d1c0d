"""What events are worth, summed by hand."""

import pytest
from movies import Board, show, stage, ticks

from reference.paper import FIRE_REFUSED_PENALTY
from reference.rewards import fire_reward, group_reward
from reference.world import Died, DoorBurnt, Evacuated, FireLit, FireRefused, LeftFloor

OUT = [
    LeftFloor(9.0, 0, 1, 80.0),
    LeftFloor(30.0, 0, 0, 60.0),
    Evacuated(30.0, 0, 0, 60.0, 5),
]
REFUSED = FireRefused(10.0, 0, 0.5, 0.5)


RESCUES = """
    1.0 s: paid 199.5
    #AA+........E

    #AA+q.....r.#
    1.4 s: paid 99.3
    #AA+........E

    #Aq+......r.#
    4.0 s: paid -300.0
    #AA+........E

    #Aq+..x.....#
    22.8 s: paid 188.6
    #AA+........E

    #AA+..x.....#
    """


@pytest.mark.paper("F8", "F5")
def test_who_leaves_a_floor_alive_pays_their_health_and_at_the_exit_a_fixed_reward():
    """p is out with 99.5, q comes down with 99.3 and is out with 88.6, r dies."""
    sim = stage("#AA+.......pE\n\n#AA+.q.....r#", health={"r": 2})
    strip = []
    for events in ticks(sim, 60):
        paid = group_reward(events)
        if paid:
            strip.append(f"{sim.world.time:.1f} s: paid {paid:.1f}\n{show(sim)}")
    assert Board("\n".join(strip)) == RESCUES


@pytest.mark.paper("E5")
@pytest.mark.paper("F8", "F5")
def test_the_reward_belongs_to_the_group():
    """It is a sum over everybody's events, in any order."""
    events = [*OUT, Died(50.0, 1, 2)]
    assert group_reward(events) == group_reward(reversed(events)) == 240 - 300


def test_nothing_else_is_worth_anything_to_the_robots():
    """Not even what the fire does."""
    events = [DoorBurnt(1.0, 3), FireLit(1.0, 0, 0.5, 0.5), REFUSED]
    assert group_reward(events) == 0


@pytest.mark.paper("D2", "chosen")
@pytest.mark.paper("D6")
def test_the_fire_gains_what_the_robots_lose_and_pays_for_refusals():
    """A certain reward is deducted for each."""
    assert fire_reward([*OUT, REFUSED, REFUSED]) == -240 - 2 * FIRE_REFUSED_PENALTY

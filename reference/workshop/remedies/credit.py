"""Credit: what a robot is paid, the group's reward or the part that it can touch.

Clauses: E5.
"""

from collections.abc import Sequence

from reference.game.codec import PolicyCodec
from reference.rewards import group_reward
from reference.world import Died, Evacuated, Event, LeftFloor

CREDITS = "group", "floor"
"""What a robot is paid: the group's reward, as in the paper, or its part of that."""


def floor_reward(events: Sequence[Event], floor: int, began: Sequence[int]) -> float:
    """Reward of a robot of this floor; began: each human's first floor.

    [E5, chosen] The part of the group's reward that it can touch. Nobody walks up, so
    that is what happens on its floor or below to those who began on its floor or above.
    """

    def touched(event: Event) -> bool:
        if not isinstance(event, LeftFloor | Evacuated | Died):
            return False
        return event.floor <= floor <= began[event.person]

    return group_reward(filter(touched, events))


def pay_by_floor(codec: PolicyCodec) -> None:
    """Pay each robot by its floor, a kind of reward for each floor."""
    floors, team = range(codec.building.floors), codec.scenario.robots_per_floor
    codec.pay = floor_reward
    codec.kinds = tuple(floor for floor in floors for _ in range(team))

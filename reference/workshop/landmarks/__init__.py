"""Options of a pointer head: candidate places, computed from the observation.

Clauses: A3, A4, C1, C3, C5, C6, C7, D1, D2, D6.  [C5, chosen] [D2, chosen] A pointer
head scores options by their features, and the coordinates of the one it chooses are
the action, which stays two floats, with the fire's floor three.  A policy is trained
for one building, so it may use its map; of what changes, only the observation, and
where robots are headed, which they remember.

    G   agents;  O  options, their number fixed per scenario;  F  features of an option
"""

from reference.learning.settings import Side, TrainerSettings
from reference.workshop.landmarks.of_fire import FireOptions
from reference.workshop.landmarks.of_robots import RobotOptions


def landmarks_for(
    side: Side, settings: TrainerSettings
) -> type[RobotOptions | FireOptions] | None:
    """Look up what makes a side's pointer options; None for other heads."""
    if settings.head != "pointer":
        return None
    return RobotOptions if side == "robots" else FireOptions

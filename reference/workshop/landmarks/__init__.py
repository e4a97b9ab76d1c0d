"""What a pointer head chooses among: landmarks, computed from the observation.

Clauses: A3, A4, C1, C3, C5, C6, C7, D1, D2, D6.  [C5, chosen] [D2, chosen] A pointer
head scores options by their features, and the coordinates of the one it chooses are
the action, which stays two floats.  A policy is trained for one building, so its map
may be used; of what changes, only the observation is.

    G   agents;  K  options, their number fixed per building;  F  features of an option
"""

from reference.learning.settings import Side, TrainerSettings
from reference.workshop.landmarks.of_fire import FireOptions
from reference.workshop.landmarks.of_robots import RobotOptions


def landmarks_for(
    side: Side, settings: TrainerSettings
) -> type[RobotOptions | FireOptions] | None:
    """What makes the options of a side's pointer head; None for the Gaussian one."""
    if settings.head != "pointer":
        return None
    return RobotOptions if side == "robots" else FireOptions

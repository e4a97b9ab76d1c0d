"""Settings with anchors, what helps learning beside the paper: codec and head.

The trainers compute what ML-Agents computes; settings with anchors give them another
`PolicyCodec`, with another head.

    floor    the paper's Gaussian: coordinates of the whole floor
    set      Gaussians around anchors that one network scores, whatever the building:
             see `workshop.anchors.sets` for the robots', `set_fire` for the fire's
    mixture  Gaussians around anchors: a robot's are those of its own frame, see
             `workshop.anchors.frame`; the fire's stand beside the building's exits,
             entrances and doors

    N    observations;  H  hidden units;  V  numbers a network reads;  K  anchors
    C    numbers it emits, in units of UNIT metres: x and y; the fire's storey first
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from reference.building import Building, lengths
from reference.game.codec import AXES, Moment, PolicyCodec
from reference.game.environment import DECIMALS
from reference.game.observations import grid_shape
from reference.learning.settings import (
    ATTENTION_HEADS,
    REWARD_SCALE,
    Network,
    Side,
    TrainerSettings,
)
from reference.navigation import navigation_of
from reference.paper import InputError, Scenario
from reference.workshop.anchors.crop import CROP_SHAPE, crops
from reference.workshop.anchors.frame import (
    UNIT,
    AnchorSizes,
    RobotView,
    fire_decisions,
    in_body,
    robot_destinations,
)
from reference.workshop.anchors.set_fire import LIT, SetsOfFire
from reference.workshop.anchors.sets import SetView
from reference.workshop.anchors.shapes import SetSizes
from reference.workshop.engine import quick_searches
from reference.workshop.storage.records import (
    ABOVE_0,
    Allowed,
    SettingsError,
    check_values,
)
from reference.workshop.strategies.fires import places_beside
from reference.world import Flames

# -- Settings -----------------------------------------------------------------------

HYPER = ("hyperparameters",)
NETWORK = ("network_settings",)
REWARD = ("reward_signals", "extrinsic")

Share = Annotated[float, Allowed(HYPER, low=0, high=1)]
Schedule = Annotated[str, Allowed(HYPER, ("linear", "constant"))]


@dataclass(frozen=True)
class SideSettings(TrainerSettings):
    """A table with rows for anchors; all are off in Tables I and II [C5, C7, chosen].

    Rows of the tables stand here again with their sections in ML-Agents' files and
    the values that they may have, where a whole number from 1 is not what is wanted.

    head        which codec and which head policies have: see this module; what a set
                tells is scaled as it is, whatever normalize says
    spread      metres, standard deviation of a mixture around each anchor

    The robots' own:

    commitment  logit bonus of the anchor "where I am headed"; without it a new policy
                would turn round before it arrives anywhere
    masks       a mixture may not choose anchors that help nobody, see `frame`
    """

    trainer_type: Annotated[str, Allowed((), ("poca", "ppo"))]
    batch_size: Annotated[int, Allowed(HYPER)]
    buffer_size: Annotated[int, Allowed(HYPER)]
    learning_rate: Annotated[float, Allowed(HYPER, low=ABOVE_0, high=1)]
    learning_rate_schedule: Schedule
    beta: Share
    beta_schedule: Schedule
    epsilon: Annotated[float, Allowed(HYPER, low=ABOVE_0, high=1)]
    epsilon_schedule: Schedule
    lambd: Share
    num_epoch: Annotated[int, Allowed(HYPER)]
    vis_encode_type: Annotated[str, Allowed(NETWORK, ("simple",))]
    normalize: Annotated[bool, Allowed(NETWORK)]
    hidden_units: Annotated[int, Allowed(NETWORK, high=2**13)]
    num_layers: Annotated[int, Allowed(NETWORK, high=2**5)]
    gamma: Annotated[float, Allowed(REWARD, low=0, high=1)]
    strength: Annotated[float, Allowed(REWARD, low=0)]
    reward_scale: Annotated[float, Allowed(None, low=ABOVE_0)] = REWARD_SCALE

    head: Annotated[str, Allowed(None, ("floor", "mixture", "set"))] = "floor"
    spread: Annotated[float, Allowed(None, low=0.01)] = 0.4
    commitment: Annotated[float, Allowed(None, low=0)] = 0.0
    masks: Annotated[bool, Allowed(None)] = False

    def __post_init__(self) -> None:
        check_values(self)
        if self.buffer_size < self.batch_size:
            raise SettingsError(
                f"buffer_size {self.buffer_size} is less than batch_size "
                f"{self.batch_size}"
            )
        if self.trainer_type == "poca" and self.hidden_units % ATTENTION_HEADS:
            raise SettingsError(
                f"hidden_units {self.hidden_units} is no multiple of poca's "
                f"{ATTENTION_HEADS} attention heads"
            )

    def codec(self, side: Side, building: Building, scenario: Scenario) -> PolicyCodec:
        """Make the codec of this side's networks."""
        if self.head == "floor":
            return PolicyCodec(side, building, scenario)
        if side == "fire":
            if self.head == "set":
                return SetsOfFire(building, scenario, self.spread)
            return MixtureOfFire(building, scenario, self)
        if self.head == "set":
            return RobotsSets(building, scenario, self)
        return RobotsFrame(building, scenario, self)

    def network(self, kind: type[Network]) -> type[Network]:
        """Which class of network is made where the paper has this one."""
        if self.head == "floor":
            return kind
        from reference.workshop.anchors.heads import MIXTURE  # torch
        from reference.workshop.anchors.set_networks import SET

        instead: dict[Any, Any] = SET if self.head == "set" else MIXTURE
        return instead.get(kind, kind)


# -- Codecs -------------------------------------------------------------------------


class RobotsFrame(PolicyCodec):
    """Robots observe and decide in their own frame [C5, chosen].

    size  V, how many numbers a network reads;  anchors  K: the first 2K numbers are
    x and y of the anchors, units from the robot, the next K are 1 for those that may
    be chosen now
    """

    def __init__(self, building: Building, scenario: Scenario, settings: SideSettings):
        super().__init__("robots", building, scenario)
        self.settings = settings
        view = self._view(*self._nothing())
        self.size: int = view.numbers().shape[1]
        self.anchors: int = view.anchors.shape[1]

    def _nothing(self) -> tuple[np.ndarray, np.ndarray, list[None]]:
        """Make what `_view` takes, where nobody is: the map alone says the sizes."""
        robots = self.layout.blocks["robots"].rows
        return (
            np.zeros((robots, self.layout.size)),
            np.full((robots, 2), np.nan),
            [None],
        )

    def _view(
        self, vectors: np.ndarray, headed: np.ndarray, flames: Sequence[Flames | None]
    ) -> RobotView:
        """vectors (B, layout.size), headed (B, 2): of all robots; flames: by world."""
        return RobotView(self, vectors, headed, self.settings.masks)

    @property
    def sizes(self) -> AnchorSizes:
        """As the paper's, but for what a network reads and its head."""
        return AnchorSizes(
            vector=self.size,
            grid=grid_shape(self.building),
            continuous=AXES,
            anchors=self.anchors,
            spread=self.settings.spread,
            commitment=self.settings.commitment,
        )

    def read(self, moments: Sequence[Moment]) -> np.ndarray:
        """(S, G, V) float32, what robots see in their frames; all moments at once."""
        vectors = np.concatenate([moment.vectors for moment in moments])
        worlds = [moment.world for moment in moments]
        headed = robot_destinations(*worlds)
        # Flames never leave the main body, so it is what the grid tells [C3].
        flames = [world.flames for world in worlds]
        with quick_searches(navigation_of(self.building)):
            seen = self._view(vectors, headed, flames).numbers()
        return seen.reshape(len(moments), -1, self.size)

    def actions(self, raw: np.ndarray, moments: Sequence[Moment]) -> np.ndarray:
        """Metres (S, G, 2) of units around the robots (S, G, 2), with DECIMALS."""
        return self.metres(raw, np.stack([moment.vectors for moment in moments]))

    def metres(self, raw: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        """Metres (..., 2) of units around the robots that observe vectors."""
        metres = self._own(vectors) + UNIT * raw.astype(np.float64)
        return in_body(self.building, metres).round(DECIMALS)

    def raw(self, metres: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        """Invert `metres`; nan stays nan."""
        return ((metres - self._own(vectors)) / UNIT).astype(np.float32)

    def _own(self, vectors: np.ndarray) -> np.ndarray:
        return self.layout.block_of(vectors, "robots")[..., 0, :2].astype(np.float64)

    def off_anchors(self, raw: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """(N,) metres from raw actions (N, 2) to the nearest anchor that is allowed.

        seen: (N, V), what is read.
        """
        K = self.anchors
        anchors = seen[:, : 2 * K].reshape(-1, K, 2)
        allowed = seen[:, 2 * K : 3 * K] > 0
        off = lengths(anchors - raw[:, None])
        return UNIT * np.where(allowed, off, np.inf).min(axis=1)


class RobotsSets(RobotsFrame):
    """Robots observe sets, and a crop of the grid around each [C5, chosen].

    shapes  of what a network reads; the numbers of an element are those of any building
    """

    def __init__(self, building: Building, scenario: Scenario, settings: SideSettings):
        super().__init__(building, scenario, settings)
        self.shapes = self._view(*self._nothing()).shapes()

    def _view(
        self, vectors: np.ndarray, headed: np.ndarray, flames: Sequence[Flames | None]
    ) -> SetView:
        return SetView(self, vectors, headed, self.settings.masks, flames)

    @property
    def sizes(self) -> SetSizes:
        """Sets; crops of all robots are channels of their grid."""
        robots = self.layout.blocks["robots"].rows
        channels, height, width = CROP_SHAPE
        return SetSizes(
            vector=self.size,
            grid=(channels * robots, height, width),
            continuous=AXES,
            anchors=self.anchors,
            spread=self.settings.spread,
            commitment=self.settings.commitment,
            sets=self.shapes,
        )

    def grids(self, moments: Sequence[Moment]) -> np.ndarray:
        """(S, 3 G, CROP, CROP) uint8: what is around each robot."""
        vectors = np.stack([moment.vectors for moment in moments])
        own = self.layout.block_of(vectors, "robots")[:, :, 0]
        return crops(super().grids(moments), self.building, own)


class MixtureOfFire(PolicyCodec):
    """The fire draws around places beside exits, entrances and doors [D2, chosen]."""

    def __init__(self, building: Building, scenario: Scenario, settings: SideSettings):
        super().__init__("fire", building, scenario)
        self.settings = settings
        nav = navigation_of(building)
        marks = range(len(building.landmarks))
        places = np.array(places_beside(building, marks))
        if not len(places):
            raise InputError(
                f"{building.title}: nothing can burn there. Draw more, or take --fire "
                "none."
            )
        storeys = places // (nav.places // building.floors)
        self.anchors = np.column_stack([storeys, nav.centres[places] / UNIT])

    @property
    def sizes(self) -> AnchorSizes:
        """As the paper's, but for the anchors, and one more number that is drawn."""
        K, C = self.anchors.shape
        return AnchorSizes(
            vector=self.layout.size + (C + 1) * K,
            grid=grid_shape(self.building),
            continuous=C,
            anchors=K,
            spread=self.settings.spread,
            commitment=0.0,  # a fire is headed nowhere
        )

    def read(self, moments: Sequence[Moment]) -> np.ndarray:
        """(S, 1, V) float32: anchors, which may be chosen, what the paper's reads."""
        vectors = np.stack([moment.vectors for moment in moments])
        fires = self.layout.block_of(vectors, "fires")  # (S, 1, F, 3)
        sources = fires[:, :, None]  # (S, 1, 1, F, 3)
        off = self.anchors[:, None, 1:] * UNIT - sources[..., :2]
        near = lengths(off) < LIT
        lit = (near & (sources[..., 2] == self.anchors[:, None, 0])).any(axis=-1)
        # Where all are lit, all may be chosen: a mixture needs one.
        allowed = ~lit | lit.all(axis=-1, keepdims=True)
        anchors = np.tile(self.anchors.ravel(), (len(vectors), 1, 1))
        parts = [anchors, allowed, super().read(moments)]
        return np.concatenate(parts, axis=-1, dtype=np.float32)

    def actions(self, raw: np.ndarray, moments: Sequence[Moment]) -> np.ndarray:
        """Floor and metres (..., 3) of storey and place (..., 3)."""
        return fire_decisions(self.building, raw)

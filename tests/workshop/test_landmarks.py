"""Landmarks: what a pointer head chooses among, where it leads, if it is enough."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from movies import fire_named, robots_named, shipped, stage, wait

from reference.building import Kind
from reference.events import FireRefused
from reference.fire import Generator
from reference.game.environment import destination, fire_decision
from reference.game.moments import Moment
from reference.game.observations import fire_vector, robot_vectors
from reference.navigation import navigation_of
from reference.paper import Scenario
from reference.robots import actual_target, said_on_the_way
from reference.simulation import Simulation
from reference.strategies import NoRobots, RandomFire
from reference.workshop.landmarks.of_fire import FIRE_FEATURES, FireOption, FireOptions
from reference.workshop.landmarks.of_robots import (
    ASTRAY,
    OWN,
    ROBOT_FEATURES,
    THERE,
    RobotOption,
    RobotOptions,
    fixed_options,
)
from reference.workshop.landmarks.shared import FAR
from reference.workshop.strategies.robots import Sweep
from reference.world import Instruction

BUILDINGS = ("paper", "tiny", "museum", "maze", "school", "tower")
BOARD = """
    ########################
    #qp........#..........r#
    #..........#...........#
    #..R.......+...........E
    #..........#...........#
    #..........#...........#
    ########################
    """
EXIT_BY_THE_STAIRS = """
       #########
    ####...p...#
    #AA+...R...#
    ####.......#
       ####E####

       #########
    ####.......#
    #AA+...R...#
    ####.......#
       #########
    """


def robots_of(sim):
    """All robots' options now."""
    vectors = robot_vectors(sim.world, sim.scenario)
    return RobotOptions(sim.building, sim.scenario)(moment_of(sim.world, vectors))


def fire_of(sim):
    """The fire's options now."""
    vectors = fire_vector(sim.world, sim.scenario)[None]
    return FireOptions(sim.building, sim.scenario)(moment_of(sim.world, vectors))


def moment_of(world, vectors):
    """What a side's player is asked, if it observes these vectors."""
    return Moment.of(world, vectors, np.ones(len(vectors), bool))


def moments(name, every=10.0, robots="sweep", seed=3, **scenario):
    """A simulation as it is at a few decisions of one evacuation."""
    sim = Simulation(
        shipped(name), Scenario(**scenario), robots_named(robots), RandomFire(), seed
    )
    for _ in range(round(sim.scenario.time_limit / every)):
        if not sim.done:
            yield sim
            wait(sim, every)
    yield sim


@cache
def evacuation(name):
    """One such evacuation, kept: copies of the simulation and all robots' options."""
    return [(sim.copy(), robots_of(sim)) for sim in moments(name)]


def feature(options, name):
    """(G, K) one of the robots' features."""
    return options.features[..., ROBOT_FEATURES.index(name)]


def of_kind(options, kind):
    """(G, K) bool: options of robots that are of this kind."""
    return feature(options, kind.name.lower()) > 0


class Scorer:
    """Robots, or a fire, that choose by a formula of the features alone."""

    def __init__(self, formula, scenario):
        self.formula, self.scenario = formula, scenario
        self.options = None

    def _best(self, options, names):
        columns = dict(zip(names, np.moveaxis(options.features, -1, 0), strict=True))
        scores = np.where(options.action_mask, self.formula(columns), -np.inf)
        best = scores.argmax(axis=1)
        return np.take_along_axis(options.places, best[:, None, None], axis=1)[:, 0]


class RobotScorer(Scorer):
    """... robots."""

    def decide(self, world, robots, rng):
        """Where the formula leads."""
        self.options = self.options or RobotOptions(world.building, self.scenario)
        moment = moment_of(world, robot_vectors(world, self.scenario))
        actions = self._best(self.options(moment), ROBOT_FEATURES)
        first = len(world.bodies)
        return [destination(world.building, actions[r.body - first]) for r in robots]


class FireScorer(Scorer):
    """... a fire."""

    def decide(self, world, rng):
        """Where the formula strikes."""
        self.options = self.options or FireOptions(world.building, self.scenario)
        moment = moment_of(world, fire_vector(world, self.scenario)[None])
        actions = self._best(self.options(moment), FIRE_FEATURES)
        return fire_decision(world.building, actions[0])


def survival(robots, fire, seeds, scenario):
    """Mean share of the people who get out of the paper's building."""
    runs = [
        Simulation(
            shipped("paper"), scenario, robots_named(robots), fire_named(fire), seed
        ).run()
        for seed in seeds
    ]
    return np.mean([run.evacuated / run.people for run in runs])


# -- The robots' options ------------------------------------------------------------


@pytest.mark.parametrize("name", BUILDINGS)
def test_robots_always_have_an_option_in_the_main_body(name):
    """At every decision, with finite features; whoever has left may only stay."""
    for sim, options in evacuation(name):
        away = np.delete(options.action_mask, RobotOption.STAY, axis=1).any(axis=1)
        assert (options.action_mask[:, RobotOption.STAY] == ~away).all()
        assert np.isfinite(options.features).all()
        assert np.abs(options.places).max(initial=0) <= 1
        assert np.abs(options.features).max(initial=0) <= 10
        at_work = [sim.world.anybody_at_or_above(r.floor) for r in sim.world.robots]
        assert not away[np.logical_not(at_work)].any()


@pytest.mark.paper("C7", "Alg. 3:3")
@pytest.mark.paper("C5", "chosen")
@pytest.mark.parametrize("name", BUILDINGS)
def test_who_is_under_way_may_keep_on_where_it_may_help_somebody(name):
    """To the same place before stairs, or out, with people; or after those it seeks."""
    kept, given_up = 0, 0
    for sim, options in evacuation(name):
        leads = feature(options, "mine")[:, 0] > 0
        for k, robot in enumerate(sim.world.robots):
            keeps = options.action_mask[k, RobotOption.KEEP]
            at_work = sim.world.anybody_at_or_above(robot.floor)
            if not (robot.way and at_work):
                assert not keeps
                continue
            spot = destination(sim.building, options.places[k, RobotOption.KEEP])
            target = actual_target(sim.building, robot.floor, *spot)
            fixed = fixed_options(sim.building, robot.floor)
            (known,) = (fixed.place == robot.way[-1]).nonzero()
            to_people = lost_within(sim, robot, ASTRAY)
            if len(known):
                before_stairs = fixed.kind[known[0]] == RobotOption.LANDING
                assert keeps == (before_stairs or leads[k])
                assert target == pytest.approx(robot.destination, abs=1e-3)
            elif keeps:
                assert np.hypot(*(to_people - spot).T).min() < 1e-3
            else:
                assert not len(to_people)
            kept, given_up = kept + keeps, given_up + (not keeps)
    assert kept
    assert given_up


def lost_within(sim, robot, metres):
    """(k, 2) people near a robot's destination, none of them in sight of robots."""
    bodies, nav = sim.world.bodies, navigation_of(sim.building)
    seen = np.zeros(len(bodies), bool)
    here = np.asarray(bodies.walking & (bodies.floor == robot.floor))
    for mate in (r for r in sim.world.robots if r.floor == robot.floor):
        seen |= nav.distances([mate.place])[bodies.place] <= sim.scenario.sight_range
    lost = bodies.position[here & ~seen]
    return lost[np.hypot(*(lost - robot.destination).T) <= metres]


@pytest.mark.paper("C5")
@pytest.mark.parametrize("name", BUILDINGS)
def test_where_a_robot_is_already_is_no_option(name):
    """Nothing but to keep the destination leads less than THERE metres away."""
    there = 0
    for _, options in evacuation(name):
        way = 20 * feature(options, "way")
        at_work = options.action_mask.sum(axis=1) > 1
        here = (way < THERE)[at_work][:, OWN:]
        assert not options.action_mask[at_work][:, OWN:][here].any()
        there += here.any(axis=1).sum()
    assert there


def test_of_two_robots_that_stand_together_one_has_a_nearer_mate():
    """They see the same, and would do the same for ever; the first of the team goes."""
    sim = Simulation(shipped("paper"), fire=RandomFire(), robots=Sweep())
    first, second = (r for r in sim.world.robots if r.floor == 0)
    second.position, second.place = first.position.copy(), first.place
    options = robots_of(sim)
    listed = feature(options, "way")[0] < FAR / 20
    nearer = feature(options, "mate_nearer") > 0
    there = listed & (np.arange(len(listed)) >= OWN)
    assert there.sum() > 5
    assert not nearer[0, there].any() and nearer[1, there].all()


@pytest.mark.paper("C6", "Eq. 1")
@pytest.mark.parametrize("name", BUILDINGS)
@pytest.mark.parametrize(
    ("kind", "told"),
    [
        (RobotOption.STAIRWELL, Instruction.THIS_STAIRWELL),
        (RobotOption.EXIT, Instruction.THIS_EXIT),
        (RobotOption.LANDING, Instruction.FOLLOW_ME),
    ],
)
def test_a_way_out_is_what_people_are_told(name, kind, told):
    """The emitted action, through Eq. 1, gives the instruction that is meant."""
    sim = Simulation(shipped(name), fire=RandomFire(), robots=Sweep())
    options = robots_of(sim)
    for g, k in np.argwhere(of_kind(options, kind)).tolist():
        floor = sim.world.robots[g].floor
        aim = destination(sim.building, options.places[g, k])
        target = actual_target(sim.building, floor, *aim)
        assert said_on_the_way(sim.building, floor, target).instruction is told


@pytest.mark.paper("C6", "Eq. 1")
def test_an_exit_beside_a_stairwell_is_meant_from_its_far_side():
    """At the exit itself, 5.9 m from the middle of A, Eq. 1 would lead into A."""
    sim = stage(EXIT_BY_THE_STAIRS)
    exit_ = next(m for m in sim.building.landmarks if m.kind is Kind.EXIT)
    assert actual_target(sim.building, 0, *exit_.position) != exit_.position
    options = robots_of(sim)
    (place,) = options.places[of_kind(options, RobotOption.EXIT)]
    target = actual_target(sim.building, 0, *destination(sim.building, place))
    assert said_on_the_way(sim.building, 0, target).instruction is Instruction.THIS_EXIT


@pytest.mark.parametrize("name", BUILDINGS)
def test_every_way_out_of_a_floor_is_listed(name):
    """As many options as the map has, and a landing where stairs end."""
    sim = Simulation(shipped(name), fire=RandomFire(), robots=Sweep())
    options, building = robots_of(sim), sim.building
    for g, robot in enumerate(sim.world.robots):
        here = [mark for mark in building.landmarks if mark.floor == robot.floor]
        down = [well.leads_down(robot.floor) for well in building.stairwells]
        ends = [well.lowest == robot.floor for well in building.stairwells]
        for kind, count in (
            (RobotOption.EXIT, sum(mark.kind is Kind.EXIT for mark in here)),
            (RobotOption.STAIRWELL, sum(down)),
            (RobotOption.LANDING, sum(ends)),
        ):
            assert of_kind(options, kind)[g].sum() == count


@pytest.mark.paper("C5", "chosen")
@pytest.mark.parametrize("name", BUILDINGS)
def test_who_leads_nobody_is_offered_no_way_out(name):
    """Who leads somebody, as far as it knows, is: but for one where it is already."""
    offered = 0
    for _, options in evacuation(name):
        out = [of_kind(options, k) for k in (RobotOption.STAIRWELL, RobotOption.EXIT)]
        out = out[0] | out[1]
        alone = feature(options, "mine")[:, :1] == 0
        assert not (options.action_mask & out & alone).any()
        led_out = options.action_mask[
            out & ~alone & (20 * feature(options, "way") >= THERE)
        ]
        assert led_out.all()
        offered += len(led_out)
    assert offered


def test_the_order_of_the_people_does_not_matter():
    """The same options, bit for bit, however the vector lists them."""
    sim = Simulation(shipped("paper"), seed=1, fire=RandomFire(), robots=Sweep())
    vectors = robot_vectors(sim.world, sim.scenario)
    people = vectors[:, :120].reshape(6, 40, 3)
    order = np.random.default_rng(0).permutation(40)
    other = vectors.copy()
    other[:, :120] = people[:, order].reshape(6, 120)
    options = RobotOptions(sim.building, sim.scenario)
    one, two = (options(moment_of(sim.world, seen)) for seen in (vectors, other))
    assert np.array_equal(one.places, two.places)
    assert np.array_equal(one.features, two.features)


def test_people_near_a_robot_are_its_own_and_the_others_are_lost():
    """p and q stand 2 and 3 m from R and are its, though beside a flame.

    r, behind the wall, is a group.
    """
    options = robots_of(stage(BOARD.replace("qp.", "qp*")))
    people, lost = feature(options, "people")[0], feature(options, "lost")[0]
    group = np.flatnonzero(of_kind(options, RobotOption.GROUP)[0])
    assert feature(options, "mine")[0, 0] == pytest.approx(0.2)
    assert lost[group] == pytest.approx([0.1, 0.0])
    assert people[group] == pytest.approx([0.1, 0.2])


def test_ways_are_metres_on_foot_and_flames_count():
    """20 m from R to E through the door; a fire in the door makes it far longer."""
    way = []
    for board in (BOARD, BOARD.replace("+", "*")):
        options = robots_of(stage(board))
        way.append(20 * feature(options, "way")[of_kind(options, RobotOption.EXIT)])
    assert way[0] == pytest.approx([20.0])
    assert way[1] > 60


def test_nobody_left_and_no_robots_are_no_trouble():
    """Robots may stay; without robots or people there are simply no rows."""
    sim = Simulation(
        shipped("tiny"), Scenario(people=0), fire=RandomFire(), robots=Sweep()
    )
    assert robots_of(sim).action_mask.sum(axis=1).tolist() == [1, 1, 1, 1]
    assert fire_of(sim).action_mask.any()
    empty = Simulation(shipped("tiny"), robots=NoRobots(), fire=RandomFire())
    assert robots_of(empty).places.shape[0] == 0
    assert fire_of(empty).action_mask.any()


# -- The fire's options -------------------------------------------------------------


@pytest.mark.paper("D6")
@pytest.mark.parametrize("name", BUILDINGS)
def test_a_fire_breaks_out_wherever_it_is_offered(name):
    """No option is refused in training, as long as somebody is inside."""
    for sim in moments(name, every=15.0, training=True):
        options, scenario = fire_of(sim), Scenario(sources=1000, training=True)
        generator = Generator(sim.building, scenario, np.random.default_rng(0))
        assert options.action_mask.any()
        assert np.isfinite(options.features).all()
        assert np.abs(options.places).max() <= 1
        assert np.abs(options.features).max() <= 10
        for action in options.places[options.action_mask]:
            if any(sim.world.occupancy):
                decision = fire_decision(sim.building, action)
                source = generator.generate(sim.world, decision)
                assert not isinstance(source, FireRefused)


@pytest.mark.paper("D6")
def test_no_fire_is_offered_where_nobody_is_or_comes_through():
    """The floor above p is empty; its robot, at rest, would not even be seen."""
    options = fire_of(stage(EXIT_BY_THE_STAIRS))
    assert set(options.places[options.action_mask][:, 0].tolist()) == {-0.5}


def test_everybodys_way_out_crosses_the_only_exit():
    """All three pass the cell beside E, and none of them the far corners."""
    options = fire_of(stage(BOARD))
    exit_ = options.features[0, :, int(FireOption.EXIT)] > 0
    cross = options.features[0, :, FIRE_FEATURES.index("cross")]
    assert cross[exit_] == pytest.approx([1.0])
    assert cross.max() == 1.0


@pytest.mark.paper("D6", "chosen")
def test_a_fire_is_offered_the_cell_of_a_clearances_rim_that_most_come_past():
    """Straight before E, where p and q come from the door; others are a bit nearer."""
    sim = stage(BOARD)
    options = fire_of(sim)
    exit_ = options.features[0, :, int(FireOption.EXIT)] > 0
    (place,) = options.places[0, exit_]
    _, x, y = fire_decision(sim.building, place)
    assert sim.building.cell(x, y) == (3, 18)


def test_people_upstairs_come_past_the_exits_downstairs():
    """Before anybody has moved, all who are above will cross some exit below."""
    sim = Simulation(shipped("paper"), seed=2, fire=RandomFire(), robots=Sweep())
    options = fire_of(sim)
    exits = options.features[0, options.features[0, :, int(FireOption.EXIT)] > 0]
    come = exits[:, FIRE_FEATURES.index("come")]
    above = exits[0, FIRE_FEATURES.index("above")]
    assert above == pytest.approx(26 / 40)
    assert come.sum() == pytest.approx(above)


# -- Is it enough? ------------------------------------------------------------------


def fetch(f):
    """As `sweep` does: most people per metre of a trip, and not where a mate is nearer.

    f: features by name, (G, K) each.
    """
    fetched = f["group"] * (f["lost"] > 0) * (f["mine"] + f["lost"]) * f["trip"]
    fetched *= np.where(f["mate_nearer"] > 0, 0.3, 1.0)
    led_out = f["best_out"] * f["mine"] * f["trip"]
    return fetched + led_out + 1e-4 * f["landing"] * (1 + f["on_stairs"])


@pytest.mark.slow
@pytest.mark.paper("C5", "chosen")
def test_what_robots_see_of_landmarks_is_enough_to_guide_well():
    """A formula of the features saves more than `patrol`, and does not train."""
    seeds, scenario = range(5000, 5004), Scenario()
    scored = survival(RobotScorer(fetch, scenario), "random", seeds, scenario)
    assert scored > survival("patrol", "random", seeds, scenario) + 0.1


@pytest.mark.slow
@pytest.mark.paper("D2", "chosen")
def test_what_the_fire_sees_of_landmarks_is_enough_to_do_harm():
    """Beside the busiest ways it kills many more than `greedy` does."""
    seeds, scenario = range(5000, 5002), replace(Scenario(), training=True)
    fire = FireScorer(lambda f: f["cross"] + f["come"], scenario)
    scored = survival("sweep", fire, seeds, scenario)
    assert scored < survival("sweep", "greedy", seeds, scenario) - 0.2

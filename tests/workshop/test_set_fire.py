"""What the fire reads as sets: places to light in any building, and nothing hidden."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from movies import shipped, stage, wait

from reference.fire import free_places
from reference.game.codec import Moment, decision_in
from reference.game.observations import fire_vectors, vector_layout
from reference.learning.adversarial import learner_for
from reference.learning.networks import Actor
from reference.navigation import navigation_of
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.workshop.anchors.frame import UNIT
from reference.workshop.anchors.set_fire import CROWDED, LIT, MAP_NUMBERS
from reference.workshop.maps import plan_of
from reference.workshop.strategies.fires import BusiestFire, RandomFire
from reference.workshop.strategies.guides import Escort
from reference.workshop.training.presets import preset
from reference.world import FireLit

BUILDINGS = ("paper", "tiny", "museum", "maze", "school", "tower")
TWO_HALLS = """
    #########################
    #p..........#......q....#
    #.....R.....+.....s.....E
    #r..........#...........#
    #############...........#
                #############
    """
AT = MAP_NUMBERS  # numbers of an anchor before what the people and flames tell


def settings():
    """A small network's."""
    return replace(preset("tiny").fire, head="set")


def codec_of(sim):
    """How the fire reads and speaks in a simulation."""
    return settings().codec("fire", sim.building, sim.scenario)


def moment_of(sim):
    """What the fire decides from now."""
    layout = vector_layout(sim.building, sim.scenario)
    (vectors,) = fire_vectors([sim.world], layout)
    return Moment(vectors, np.ones(1, dtype=bool), sim.world)


def anchors(codec, moment):
    """Decisions that mean the anchors, (K, 3), which are allowed, and their numbers."""
    ((seen,),) = codec.read([moment])
    K, N = codec.shapes.anchors
    spots = codec.actions(seen[: 3 * K].reshape(K, 3), [moment])
    allowed = seen[3 * K : 4 * K] > 0.5
    return spots, allowed, seen[4 * K : 4 * K + K * N].reshape(K, N)


def places_of(sim, spots):
    """(K,) places of decisions."""
    nav = navigation_of(sim.building)
    return np.array([nav.place(*decision_in(spot)) for spot in spots])


def policy(codec, moment, seed=0):
    """What a network that has learned nothing would do."""
    torch.manual_seed(seed)
    actor = settings().network(Actor)(codec.sizes, settings())
    seen = torch.from_numpy(codec.read([moment]))
    return actor(seen, torch.from_numpy(codec.grids([moment])))


def evacuations(name, times=(8.0, 20.0), robots=Escort, **scenario):
    """Simulations of a building under fire, at some times."""
    for seed, seconds in enumerate(times):
        scene = Scenario(**scenario)
        sim = Simulation(shipped(name), scene, robots(), RandomFire(), seed)
        wait(sim, seconds)
        yield sim


# -- No building in it --------------------------------------------------------------


@pytest.mark.paper("D2", "chosen")
def test_weights_of_one_building_light_every_other():
    """For any number of people, robots and sources; nothing read is large."""
    scenes = {name: {} for name in BUILDINGS}
    scenes["tiny"] = {"people": 3, "robots_per_floor": 0, "sources": 2}
    scenes["museum"] = {"people": 1, "sources": 0}
    scenes["maze"] = {"people": 120, "robots_per_floor": 8}
    plan = plan_of(shipped("tiny"))
    made = learner_for("fire", plan, Scenario(people=6), settings(), 0)
    for name, scene in scenes.items():
        for sim in evacuations(name, **scene):
            codec = codec_of(sim)
            there = settings().network(Actor)(codec.sizes, settings())
            there.load_state_dict(made.actor.state_dict())
            moment = moment_of(sim)
            seen = codec.read([moment])
            assert np.isfinite(seen).all()
            assert np.abs(seen[..., :-4]).max() < 40  # at last the counts of sets
            grids = torch.from_numpy(codec.grids([moment]))
            drawn = there(torch.from_numpy(seen), grids)
            assert drawn.log_probs(drawn.act()).isfinite().all()


@pytest.mark.paper("D2", "chosen")
@pytest.mark.parametrize("block", ["humans", "robots", "fires"])
def test_the_order_of_people_robots_and_sources_means_nothing(block):
    """The fire has no number for anybody."""
    (sim,) = evacuations("paper", (50.0,))
    codec = codec_of(sim)
    moment = moment_of(sim)
    mixed = moment.vectors.copy()
    rows = codec.layout.block_of(mixed, block)
    rows[:] = rows[:, ::-1].copy()
    assert not np.array_equal(mixed, moment.vectors)
    one, other = (
        policy(codec, some).choice.probs
        for some in (moment, replace(moment, vectors=mixed))
    )
    assert torch.allclose(one, other, atol=1e-5)


@pytest.mark.paper("D1")
def test_it_reads_nothing_that_the_fire_does_not_observe():
    """Whom people follow, where they and the robots go, how healthy they are."""
    (sim,) = evacuations("paper", (45.0,))
    codec = codec_of(sim)
    before = codec.read([moment_of(sim)])
    bodies = sim.world.bodies
    rng = np.random.default_rng(0)
    n = len(bodies)
    bodies.leader[:] = rng.integers(-1, n, n)
    bodies.landmark[:] = rng.integers(-1, len(sim.building.landmarks), n)
    bodies.stairs_until += 3
    bodies.health[:] = 50
    bodies.target[:] = 0
    for robot in sim.world.robots:
        robot.destination = np.zeros(2)
    sim.world.flames.arrival += 1  # when cells will burn
    assert np.array_equal(codec.read([moment_of(sim)]), before)


# -- Its anchors --------------------------------------------------------------------


@pytest.mark.paper("D2", "chosen")
@pytest.mark.parametrize("name", BUILDINGS)
def test_its_anchors_are_free_cells_beside_all_ways_and_in_crowds(name):
    """As far as the fire sees: no flames, nobody there, away from sources."""
    for sim in evacuations(name, (5.0, 40.0)):
        codec = codec_of(sim)
        spots, allowed, _ = anchors(codec, moment_of(sim))
        free = free_places(sim.world) | sim.world.flames.ash.ravel()
        assert allowed.any()
        assert free[places_of(sim, spots)][allowed].all()
        for floor, x, y in spots[allowed]:
            for source in sim.world.flames.sources:
                off = np.hypot(source.x - x, source.y - y)
                assert source.floor != floor or off >= LIT
        marks = len(sim.building.landmarks)
        assert len(spots) <= marks + CROWDED


@pytest.mark.paper("D2", "chosen")
def test_where_somebody_stands_or_fire_was_lit_an_anchor_moves_on():
    """To the next free cell; none is lost."""
    sim = stage(TWO_HALLS, sources=3)
    codec = codec_of(sim)
    spots, allowed, _ = anchors(codec, moment_of(sim))
    robot = sim.world.robots[0]
    floor, x, y = spots[0]
    robot.position = np.array([x, y])
    robot.place = int(places_of(sim, spots)[0])
    beside, still, _ = anchors(codec, moment_of(sim))
    assert 0 < np.hypot(*(beside[0] - spots[0])[1:]) < 3
    sim.world.flames.sources.append(FireLit(0.0, int(floor), float(x), float(y)))
    away, again, _ = anchors(codec, moment_of(sim))
    assert LIT - 1e-6 <= np.hypot(*(away[0] - spots[0])[1:]) < 5
    assert np.all([some[:2] for some in (allowed, still, again)])


@pytest.mark.paper("D2", "chosen")
def test_the_first_crowd_is_where_the_busiest_fire_would_burn():
    """It computes by the observation what that one reads in the world."""
    for name in ("paper", "school"):
        for sim in evacuations(name, (5.0, 15.0)):
            sim.world.flames.sources.clear()  # else the one may light beside a source
            spots, allowed, _ = anchors(codec_of(sim), moment_of(sim))
            crowd = len(spots) - CROWDED
            assert allowed[crowd]
            busiest = BusiestFire().decide(sim.world, np.random.default_rng(0))
            assert decision_in(spots[crowd]) == pytest.approx(busiest, abs=1e-4)


@pytest.mark.paper("D2", "chosen")
def test_an_anchor_tells_what_it_is_at_and_who_will_pass():
    """A door of one hall, and the exit that all three people have to take."""
    sim = stage(TWO_HALLS)
    codec = codec_of(sim)
    _, allowed, numbers = anchors(codec, moment_of(sim))
    door, way_out = numbers[:2]
    assert allowed[:2].all()
    assert door[:4].tolist() == [0, 0, 0, 1]
    assert way_out[:4].tolist() == [1, 0, 0, 0]
    passes = AT + 5  # in fives
    assert 5 * door[passes] == pytest.approx(2)  # p and r
    assert 5 * way_out[passes] == pytest.approx(4)
    assert 0 < door[MAP_NUMBERS - 1] < way_out[MAP_NUMBERS - 1] == 1  # of all cells


@pytest.mark.paper("E6")
def test_a_fire_reads_the_same_in_a_batch_as_alone():
    """To the last bit."""
    sims = list(evacuations("paper", (8.0, 30.0)))
    codec = codec_of(sims[0])
    moments = [moment_of(sim) for sim in sims]
    alone = [codec.read([moment])[0] for moment in moments]
    assert np.array_equal(codec.read(moments), np.stack(alone))


@pytest.mark.paper("D6", "chosen")
def test_where_nothing_can_burn_it_lights_nothing():
    """All is within the protected metres of the exit."""
    sim = stage(
        """
        ######
        #p...E
        ######
        """,
        sources=2,
    )
    codec = codec_of(sim)
    moment = moment_of(sim)
    raw = policy(codec, moment).act().detach().numpy()
    ((row,),) = codec.actions(raw, [moment])
    assert decision_in(row) is None


@pytest.mark.paper("D2", "chosen")
def test_the_likeliest_decision_is_an_anchor():
    """Floor and metres, as the fire generator takes them."""
    (sim,) = evacuations("tower", (20.0,))
    codec = codec_of(sim)
    moment = moment_of(sim)
    raw = policy(codec, moment).act().detach().numpy()
    ((row,),) = codec.actions(raw, [moment])
    spots, allowed, _ = anchors(codec, moment)
    off = np.abs(spots[allowed] - row).max(axis=1)
    assert off.min() < 1e-5 * UNIT

"""Anchors, people, mates and fires as sets: no order, any number, any building."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import torch
from hall import BUILDINGS, HALL
from movies import shipped, stage, wait

from reference.building import lengths
from reference.fire import RandomFire
from reference.game.codec import Moment
from reference.game.observations import grid, robot_vectors, vector_layout
from reference.learning.adversarial import learner_for, player_of
from reference.learning.networks import Actor
from reference.learning.players import LearnedNetwork
from reference.learning.poca import GroupCritic
from reference.navigation import navigation_of
from reference.paper import SIGHT_RANGE, Scenario
from reference.simulation import Simulation
from reference.workshop import engine
from reference.workshop.anchors.crop import CROP, crops
from reference.workshop.anchors.frame import (
    FIRST_MARK,
    KEEP,
    NEAREST_PEOPLE,
    UNIT,
    WAIT,
    robot_destinations,
)
from reference.workshop.anchors.known_ways import KnownWays
from reference.workshop.anchors.reckoning import FARTHEST
from reference.workshop.anchors.sets import (
    APART,
    GROUPS,
    MARK_NUMBERS,
    MATES_READ,
    STATION,
    SetView,
)
from reference.workshop.maps import load, plan_of
from reference.workshop.strategies.guides import Observer, Sweep, as_observed
from reference.workshop.strategies.observed import (
    guard_points,
    may_lead,
    metres_between,
    way_marks,
)
from reference.workshop.training.families import Family
from reference.workshop.training.presets import preset
from reference.world import NOBODY

OFF = 3 + MARK_NUMBERS  # numbers of an anchor before where it is from me
ON_WAY = OFF + 5  # flames on the way to an anchor, near it
MATES_BEFORE = slice(OFF + 13, OFF + 16)  # of those who choose before me
MATE_BEFORE = 5  # in a mate's numbers


def settings(head="set", **rows):
    """A small network's."""
    return replace(preset("tiny").robots, head=head, **rows)


def codec_of(sim, head="set", **rows):
    """How robots read and speak in a simulation."""
    return settings(head, **rows).codec("robots", sim.building, sim.scenario)


def moment_of(sim):
    """What all robots decide from now."""
    layout = vector_layout(sim.building, sim.scenario)
    (vectors,) = robot_vectors([sim.world], layout)
    return Moment(vectors, np.ones(len(vectors), dtype=bool), sim.world)


def numbers(codec, seen):
    """What robots read, (G, V), by name: (G, k, numbers) each."""
    K, _ = codec.shapes.anchors
    found = {}
    at = 3 * K
    for name in ("anchors", "people", "mates", "fires"):
        k, width = getattr(codec.shapes, name)
        found[name] = seen[:, at : at + k * width].reshape(-1, k, width)
        at += k * width
    return found | {"counts": seen[:, at : at + codec.shapes.counts]}


def networks(codec, seed=0):
    """A policy and a critic with random weights; new ones would have no biases."""
    torch.manual_seed(seed)
    table = settings()
    sizes = codec.sizes
    both = table.network(Actor)(sizes, table), GroupCritic(sizes, table)
    with torch.no_grad():
        for network in both:
            for weight in network.parameters():
                weight.add_(0.1 * torch.randn_like(weight))
    return both


def says(codec, moment, actor):
    """(G, K) probabilities of anchors."""
    seen = torch.from_numpy(codec.read([moment]))
    return actor(seen, torch.from_numpy(codec.grids([moment]))).choice.probs[0]


def evacuations(name, times=(8.0, 20.0), **scenario):
    """Simulations of a building under fire, at some times."""
    for seed, seconds in enumerate(times):
        sim = Simulation(
            shipped(name), Scenario(**scenario), Sweep(), RandomFire(), seed
        )
        wait(sim, seconds)
        yield sim


# -- No building in it --------------------------------------------------------------


@pytest.mark.paper("C5", "chosen")
def test_weights_of_one_building_play_in_every_other():
    """For any number of people, robots and fires; nothing read is infinite or large."""
    scenes = {name: {} for name in BUILDINGS}
    scenes["tiny"] = {"people": 3, "robots_per_floor": 1, "sources": 2}
    scenes["museum"] = {"robots_per_floor": 1}  # a robot without mates
    scenes["maze"] = {"people": 1, "sources": 0}
    (first,) = evacuations("paper", (8.0,))
    actor, critic = networks(codec_of(first))
    for name, scene in scenes.items():
        for sim in evacuations(name, **scene):
            codec = codec_of(sim)
            there, valued = networks(codec)
            there.load_state_dict(actor.state_dict())
            valued.load_state_dict(critic.state_dict())
            moment = moment_of(sim)
            seen = codec.read([moment])
            assert np.isfinite(seen).all()
            assert np.abs(seen[..., :-4]).max() < 40  # at last the counts of sets
            vectors, grids = map(torch.from_numpy, (seen, codec.grids([moment])))
            policy = there(vectors, grids)
            assert policy.log_probs(policy.act()).isfinite().all()
            alive = torch.from_numpy(moment.alive)[None]
            assert valued(vectors, grids, alive).isfinite().all()


@pytest.mark.paper("C5", "chosen")
def test_a_network_made_for_one_building_is_a_player_in_another():
    """As a checkpoint's would be."""
    scenario = Scenario(people=6)
    plan = plan_of(load("tiny"))
    made = player_of(learner_for("robots", plan, scenario, settings(), 0))
    assert isinstance(made, LearnedNetwork)
    sim = Simulation(shipped("school"), Scenario(), Sweep(), RandomFire(), 0)
    player = made.player("robots", sim.building, sim.scenario)
    decided, _ = player.act([moment_of(sim)])
    assert np.isfinite(decided).all()


@pytest.mark.paper("C5", "chosen")
def test_who_is_out_or_dead_changes_nothing():
    """Rows of nobody, in a scenario of more people, sources and so on."""
    sim = stage(HALL, sources=2)
    more = replace(sim.scenario, people=9, people_per_floor=(9,), sources=7)
    codec = codec_of(sim)
    actor, _ = networks(codec)
    wide = settings().codec("robots", sim.building, more)
    moment = moment_of(sim)
    vectors = np.zeros((2, wide.layout.size), dtype=np.float32)
    for name, block in codec.layout.blocks.items():
        to = wide.layout.block_of(vectors, name)
        if block.rows > 1 and name != "fires_per_floor":
            to[:] = (0, 0, -1)
        to[:, : block.rows] = codec.layout.block_of(moment.vectors, name)
    same, _ = networks(wide)
    same.load_state_dict(actor.state_dict())
    found = says(wide, replace(moment, vectors=vectors), same)
    known = says(codec, moment, actor)
    assert torch.allclose(found[:, : known.shape[1]], known, atol=1e-6)
    assert not found[:, known.shape[1] :].any()


@pytest.mark.paper("C5", "chosen")
@pytest.mark.parametrize("robots", [2, 8, 11])
def test_a_robot_reads_of_its_own_floor_the_nearest_mates(robots):
    """As many as generated buildings have, so that crowds of robots are nothing new."""
    assert max(Family().robots_per_floor) == 1 + MATES_READ < 11
    for sim in evacuations("museum", (0.2, 20.0), robots_per_floor=robots):
        codec = codec_of(sim)
        moment = moment_of(sim)
        (seen,) = codec.read([moment])
        mates = numbers(codec, seen)["mates"]
        beside = mates[..., 4] == 1
        there = mates[..., -1] == 1
        points = codec.layout.block_of(moment.vectors, "robots")
        off = points[:, 1:, :2] - points[:, :1, :2]
        metres = np.hypot(off[..., 0], off[..., 1])
        same = points[:, 1:, 2] == points[:, :1, 2]
        for g in range(len(points)):
            nearest = np.sort(metres[g, same[g]])[:MATES_READ]
            read = UNIT * np.hypot(*mates[g, beside[g], :2].T)
            assert np.sort(read) == pytest.approx(nearest, abs=1e-3)
            assert there[g].sum() == len(nearest) + (~same[g]).sum()


# -- No order in it -----------------------------------------------------------------


@pytest.mark.paper("C5", "chosen")
@pytest.mark.parametrize("block", ["humans", "robots", "fires"])
def test_the_order_of_people_mates_and_fires_means_nothing(block):
    """Nor to the critic; who reads them stays the first robot of its own row."""
    (sim,) = evacuations("paper", (40.0,))
    codec = codec_of(sim)
    actor, critic = networks(codec)
    moment = moment_of(sim)
    mixed = moment.vectors.copy()
    rows = codec.layout.block_of(mixed, block)
    first = 1 if block == "robots" else 0
    rows[:, first:] = rows[:, first:][:, ::-1].copy()
    assert not np.array_equal(mixed, moment.vectors)
    shuffled = replace(moment, vectors=mixed)
    one, other = (says(codec, some, actor) for some in (moment, shuffled))
    assert torch.allclose(one.sort().values, other.sort().values, atol=1e-5)
    alive = torch.ones(1, len(one), dtype=torch.bool)
    one, other = (
        critic(*map(torch.from_numpy, (codec.read([m]), codec.grids([m]))), alive)
        for m in (moment, shuffled)
    )
    assert torch.allclose(one, other, atol=1e-5)


@pytest.mark.paper("C5", "chosen")
def test_robots_that_change_places_change_what_they_read_but_for_their_number():
    """It says who chooses before whom; so two robots at one place can part."""
    first, second = stage(HALL), stage(HALL)
    a, b = second.world.robots
    for name in ("position", "place"):
        mine, theirs = getattr(a, name), getattr(b, name)
        setattr(a, name, theirs)
        setattr(b, name, mine)
    codec = codec_of(first)
    one, other = (
        numbers(codec, codec.read([moment_of(sim)])[0]) for sim in (first, second)
    )
    assert one["counts"][:, -1].tolist() == other["counts"][:, -1].tolist() == [0, 1]
    assert one["mates"][:, 0, MATE_BEFORE].tolist() == [0, 1]
    near, _ = one["anchors"][..., MATES_BEFORE][..., 1]
    assert not near.any()  # nobody chooses before the first
    for read in (one, other):
        read["anchors"][..., MATES_BEFORE] = 0
        read["mates"][..., MATE_BEFORE] = 0
        read["counts"][:, -1] = 0
    for name, read in one.items():
        assert np.array_equal(read, other[name][::-1]), name


@pytest.mark.paper("C5", "chosen")
def test_a_foot_of_stairs_is_the_station_of_some():
    """As `guides.station` has it: the robots of a floor take turns."""
    (sim,) = evacuations("paper", (8.0,))
    codec = codec_of(sim)
    (seen,) = codec.read([moment_of(sim)])
    anchors = numbers(codec, seen)["anchors"]
    feet = way_marks(sim.building, 0)[1]
    mine = [robot for robot in sim.world.robots if robot.floor == 0]
    assert len(feet) == len(mine) == 2
    for robot, read in zip(sim.world.robots, anchors, strict=True):
        stations = read[read[:, 3 + STATION] == 1]
        assert len(stations) == (robot.floor == 0)
        for station in stations:
            at = robot.position + UNIT * station[OFF : OFF + 2]
            assert at == pytest.approx(feet[robot.number % 2], abs=1e-3)


# -- What stands in it --------------------------------------------------------------


@pytest.mark.paper("C5", "chosen")
@pytest.mark.parametrize("masks", [True, False])
def test_its_anchors_are_those_of_a_mixture(masks):
    """But at people: the same points; what may be chosen there may be chosen here."""
    for name in BUILDINGS:
        for sim in evacuations(name):
            found = []
            for head, people in (("mixture", NEAREST_PEOPLE), ("set", GROUPS)):
                codec = codec_of(sim, head, masks=masks)
                (seen,) = codec.read([moment_of(sim)])
                K = codec.anchors
                rows = [
                    seen[:, 0 : 2 * K : 2],
                    seen[:, 1 : 2 * K : 2],
                    seen[:, 2 * K :],
                ]
                of_map = K - people
                found.append(np.stack([row[:, :of_map] for row in rows], axis=-1))
            for mixture, sets in zip(*found, strict=True):
                assert rows_of(mixture[:, :2]) == rows_of(sets[:, :2])
                allowed = mixture[mixture[:, 2] > 0]
                assert rows_of(allowed) <= rows_of(sets)


def rows_of(table):
    """A table's rows as a set."""
    return set(map(tuple, table.tolist()))


@pytest.mark.paper("C1", "chosen")
def test_sets_and_guides_guess_alike_who_leads_whom():
    """Robots under way and at rest, four on a floor, all through an evacuation."""
    scenario = Scenario(people=40, robots_per_floor=4)
    sim = Simulation(shipped("tower"), scenario, Observer(), seed=1)
    codec = codec_of(sim)
    nav = navigation_of(sim.building)
    several = 0
    while sim.world.time < 60:
        engine.run_to_decision([sim])
        world = sim.world
        moment = moment_of(sim)
        view = SetView(
            codec, moment.vectors, robot_destinations(world), True, [world.flames]
        )
        bodies = as_observed(world).bodies
        led = bodies.leader != NOBODY
        for robot, mine, people in zip(
            world.robots, view.mine, view.people, strict=True
        ):
            way = metres_between(nav, np.array(robot.place), bodies.place)
            own = may_lead(bodies.leader == robot.body, led, way)
            seen = people[mine, :2]
            assert rows_of(seen) == rows_of(bodies.position[own].astype(np.float32))
            several += (way <= SIGHT_RANGE).sum() > 1
    assert several > 100


@pytest.mark.paper("C5", "chosen")
def test_who_may_lead_somebody_may_choose_a_way_out():
    """Robots stand side by side, and the guess names the nearer one."""
    for plan, may in (
        ("#..pR.R....E", 2),
        ("#..pR.........R.E", 1),
        ("#...R.R....E", 0),
    ):
        sim = stage(f"{'#' * len(plan)}\n{plan}\n{'#' * len(plan)}")
        codec = codec_of(sim)
        (seen,) = codec.read([moment_of(sim)])
        allowed = seen[:, 2 * codec.anchors : 3 * codec.anchors]
        way_out = FIRST_MARK
        assert allowed[:, way_out].sum() == may


@pytest.mark.paper("C5", "chosen")
@pytest.mark.parametrize("name", BUILDINGS)
def test_its_anchors_at_people_stand_apart_and_leave_nobody_out(name):
    """The first is at the nearest; each lost person is near one, as far as they go."""
    most = 0
    for sim in evacuations(name, people=60):
        codec = codec_of(sim, masks=False)
        (seen,) = codec.read([moment_of(sim)])
        K = codec.anchors
        spots = UNIT * seen[:, : 2 * K].reshape(-1, K, 2)[:, -GROUPS:]
        there = seen[:, 2 * K : 3 * K][:, -GROUPS:] > 0
        people = numbers(codec, seen)["people"]
        mixture = codec_of(sim, "mixture", masks=False)
        (nearest,) = mixture.read([moment_of(sim)])
        first = UNIT * nearest[:, : 2 * mixture.anchors].reshape(len(seen), -1, 2)
        for b in range(len(seen)):
            mine = spots[b, there[b]]
            off = lengths(mine[:, None] - mine)
            assert (off[~np.eye(len(mine), dtype=bool)] >= APART - 1e-3).all()
            here = (people[b, :, 2] == 0) & (people[b, :, 4] == 1)
            lost = UNIT * people[b, here, :2]
            if not len(lost):
                assert not len(mine)
                continue
            assert np.allclose(mine[0], first[b, -NEAREST_PEOPLE], atol=1e-3)
            if len(mine) < GROUPS:
                off = lengths(lost[:, None] - mine).min(axis=1)
                assert (off < APART + 1e-3).all()
            most = max(most, len(mine))
    assert most > 1


@pytest.mark.paper("E6")
def test_a_robot_reads_the_same_in_a_batch_as_alone():
    """Numbers and crops, to the last bit."""
    sims = list(evacuations("paper", (8.0, 30.0, 55.0)))
    codec = codec_of(sims[0])
    moments = [moment_of(sim) for sim in sims]
    for read in (codec.read, codec.grids):
        alone = [read([moment])[0] for moment in moments]
        assert np.array_equal(read(moments), np.stack(alone))


@pytest.mark.parametrize("name", BUILDINGS)
def test_a_robot_reads_the_same_whoever_searches_ways(name, monkeypatch):
    """The engine, where it is ready, or the book: to the last bit."""
    pytest.importorskip("numba")
    engine.make_ready()
    for sim in evacuations(name):
        codec = codec_of(sim)
        (quickly,) = codec.read([moment_of(sim)])
        sim.navigation._search.cache_clear()
        with monkeypatch.context() as patch:
            patch.setattr("reference.workshop.engine._make_ready", cache(int))
            (seen,) = codec.read([moment_of(sim)])
        assert np.array_equal(seen, quickly)
    assert sim.world.flames.burning.any()


@pytest.mark.paper("C3", "chosen")
def test_a_crop_is_the_grid_around_a_robot():
    """Its own cell is in the middle; beyond the edges is nothing."""
    (sim,) = evacuations("paper", (40.0,))
    whole = grid(sim.world)
    building = sim.building
    floors = building.floors
    own = codec_of(sim).layout.block_of(moment_of(sim).vectors, "robots")[:, 0]
    found = crops(whole[None], building, own[None]).reshape(len(own), 3, CROP, CROP)
    left, _, _, top = building.body
    half = CROP // 2
    for robot, around in zip(sim.world.robots, found, strict=True):
        assert robot.active
        x, y = robot.position
        for d_row, d_col in ((0, 0), (-half, half), (3, -2), (half, 0)):
            row = int(np.clip(top - y, 0, 39)) + d_row  # stairs: the nearest cell
            col = int(np.clip(x - left, 0, 39)) + d_col
            inside = 0 <= row < 40 and 0 <= col < 40
            channels = whole[robot.floor :: floors, row, col] if inside else [0, 0, 0]
            assert around[:, half + d_row, half + d_col].tolist() == list(channels)
    assert found[:, 1].any()


@pytest.mark.paper("A3")
@pytest.mark.parametrize("name", BUILDINGS)
def test_ways_out_are_measured_to_the_outside(name):
    """Exits are there; stairs lead on from their foot. Chains end at an exit."""
    building = shipped(name)
    ways = KnownWays(building)
    nav = navigation_of(building)
    for floor in range(building.floors):
        outs, feet = way_marks(building, floor)
        assert len(feet) == (ways.feet[floor] >= 0).sum()
        assert len(guard_points(building, floor)) == (ways.rim_width[floor] > 0).sum()
        for k in range(len(outs)):
            exit_ = ways.wells[floor, k] < 0
            assert (ways.metres_out[floor, k] == 0) == exit_
            chain = np.flatnonzero(ways.on_way[:, floor, k])
            assert set(chain // nav.floor_size) <= set(range(floor + 1))
            at_exits = np.concatenate([nav.goals[m] for m in building.exits])
            assert np.isin(chain, at_exits).any()
            assert (ways.near_way[chain, floor, k] == 1).all()
            assert ways.width[floor, k] > 0
    free = nav.walkable & (building.area.ravel() >= 0) & (ways.well_of < 0)
    assert (ways.outside[free] < FARTHEST).all()


@pytest.mark.paper("C5", "chosen")
def test_flames_on_the_way_to_an_anchor_are_told():
    """On the straight way wholly; beside it less, the more so the longer the detour."""
    sim = stage(HALL.replace("r.............E", "r....*........E"))
    codec = codec_of(sim)
    (seen,) = codec.read([moment_of(sim)])
    anchors = numbers(codec, seen)["anchors"]
    assert np.allclose(
        anchors[..., OFF : OFF + 2], seen[:, : 2 * codec.anchors].reshape(2, -1, 2)
    )
    on_way, near = anchors[0, :, ON_WAY], anchors[0, :, ON_WAY + 1]
    out, rim = FIRST_MARK, FIRST_MARK + 1
    assert on_way[out] == on_way[rim] == 1  # through the flame
    assert on_way[WAIT] < on_way[-1] < 1 or on_way[WAIT] < 0.1
    assert near[rim] > near[WAIT] > 0
    assert not anchors[0, KEEP].any()  # it is headed nowhere
    (calm,) = codec.read([moment_of(stage(HALL))])
    assert not numbers(codec, calm)["anchors"][..., ON_WAY : ON_WAY + 2].any()

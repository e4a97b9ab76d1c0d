"""The fire: Eqs. 2-3, rule D6 in both modes, first passage, scripted strategies."""

from dataclasses import replace
from math import exp, floor, inf, trunc

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from movies import (
    beside,
    body,
    built,
    drawn,
    empty,
    events_of,
    flames,
    found,
    later,
    mark,
    nth,
    play,
    shipped,
    show,
    split,
    stage,
    wait,
)

from reference import paper
from reference.building import Kind, without_doors
from reference.fire import (
    NoFire,
    RandomFire,
    SourceGenerator,
    Spread,
    burnable,
    cells_around_clearance,
    decision_at,
    free_places,
    snapped,
)
from reference.navigation import navigation_of
from reference.paper import Scenario
from reference.robots import NoRobots
from reference.simulation import Simulation
from reference.workshop.strategies import FIRES
from reference.workshop.strategies.guides import Sweep
from reference.workshop.strategies.worst_case import FirstDecision
from reference.world import DoorBurnt, Fate, FireLit, FireRefused

COORDINATES = st.floats(-1e6, 1e6)


# -- Equations 2 and 3 --------------------------------------------------------------


@pytest.mark.paper("D3", "Eq. 2")
@given(COORDINATES)
def test_a_source_appears_at_the_nearest_cell_centre(x):
    """For every real coordinate, also negative; that of 20 lies outside the body."""
    assert snapped(x) % 1 == 0.5
    assert abs(snapped(x) - x) <= 0.5
    assert snapped(20) == 20.5


@pytest.mark.paper("D4", "Eq. 2")
@pytest.mark.parametrize("bracket", [floor, trunc, round])
@given(x=COORDINATES)
def test_equation_2_holds_however_its_brackets_are_read(bracket, x):
    """As floor, as truncation or as rounding: the formula as printed is nearest."""
    whole = bracket(x)
    first = abs(whole - x + 0.5) > abs(whole - x - 0.5)
    printed = whole - 0.5 if first else whole + 0.5
    assert abs(printed - x) == pytest.approx(abs(snapped(x) - x), abs=1e-9)
    assert not (first and bracket is floor)  # its first branch is never taken


# -- Rule D6 ------------------------------------------------------------------------

BOARD = """
       ####################
    ####......p...#.......#
    #AA+......*.R.+.......E
    ####........,.#.......#
       ####################

       ####################
    ####..........#.......#
    #AA+........R.+...q...#
    ####..........#.......#
       ####################
    """
FREE = np.array([0, 1, 8])
"""Floor, row and column where a source may be."""
OUTSIDE = {
    "below": (-1, 0, 0),
    "above": (1, 0, 0),
    "north": (0, -1, 0),
    "south": (0, 1, 0),
    "west": (0, 0, -1),
    "east": (0, 0, 1),
}
"""How many buildings farther on there is none."""
OCCUPIED = [*"#A+E*,Rpq", "R2", "door", "protected", *OUTSIDE]
"""Signs of places on BOARD where no source may be, and more such places."""


def generated(sim, decision, rng):
    """What follows from a decision here and now."""
    generator = SourceGenerator(sim.building, sim.scenario, rng)
    return generator.generate(sim.world, decision)


def spot(sim, what):
    """Floor and metres of one of these places."""
    if what in OUTSIDE:
        floor, row, col = FREE + sim.building.kind.shape * np.array(OUTSIDE[what])
        return (int(floor), *sim.building.metres(row, col))
    if what == "door":
        return (0, *sim.building.landmarks[mark(sim, Kind.DOOR)].position)
    sign = "E" if what == "protected" else what
    floor, row, col = found(split(BOARD), sign[0])[nth(sign) - 1]
    if what == "protected":
        col -= paper.PROTECTED_METRES
    return (floor, *sim.building.metres(row, col))


@pytest.mark.paper("D6")
@pytest.mark.parametrize("what", OCCUPIED)
def test_refuses_an_occupied_place_in_training(what):
    """No fire in walls, in ways and near them, nor where it burns or has burnt, nor
    where anybody stands."""
    sim = stage(BOARD, training=True)
    where = spot(sim, what)
    assert generated(sim, where, sim.rng["fire"]) == FireRefused(0.0, *where)


@pytest.mark.paper("D6")
@pytest.mark.parametrize("what", OCCUPIED)
def test_an_occupied_place_yields_another_free_one_outside_training(what):
    """Somewhere at random, where a source is allowed; other draws for every case."""
    sim = stage(BOARD, training=False)
    rng = np.random.default_rng(list(what.encode()))
    for _ in range(20):
        result = generated(sim, spot(sim, what), rng)
        assert isinstance(result, FireLit)
        place = sim.navigation.place(result.floor, result.x, result.y)
        assert free_places(sim.world)[place]


@pytest.mark.paper("D6")
def test_the_other_free_place_may_be_anywhere_in_the_building():
    """On any floor: of many runs, some have it on each, and hardly two in one place."""
    sim = stage(BOARD, training=False)
    wall = spot(sim, "#")
    rng = np.random.default_rng(0)
    lit = [generated(sim, wall, rng) for _ in range(60)]
    assert {source.floor for source in lit} == {0, 1}
    assert len({(source.floor, source.x, source.y) for source in lit}) > 25


@pytest.mark.paper("D6", "chosen")
def test_other_places_come_in_one_order_for_a_whole_run():
    """The first that is free: when one burns it is the next one's turn."""
    sim = stage(BOARD, training=False)
    wall = spot(sim, "#")
    generator = sim.generator
    first = generator.generate(sim.world, wall)
    assert generator.generate(sim.world, wall) == first
    cell = (first.floor, *sim.building.cell(first.x, first.y))
    sim.world.flames.arrival[cell] = sim.world.time
    assert generator.generate(sim.world, wall) != first
    sim.world.flames.arrival[cell] = np.inf
    assert generator.generate(sim.world, wall) == first


@pytest.mark.paper("D6")
def test_a_source_occupies_its_cell_before_the_flames_next_step():
    """Where decisions follow each other faster than flames do."""
    sim = stage(BOARD, training=True, decision_seconds=0.1, frames_per_tick=5)
    first = int(np.flatnonzero(free_places(sim.world))[0])
    sim.fire_strategy = FirstDecision(decision_at(sim.world, first), NoFire())
    wait(sim, 0.3)
    sim.fire_strategy = FirstDecision(decision_at(sim.world, first), NoFire())
    wait(sim, 0.6)
    assert [type(event) for event in sim.events] == [FireLit, FireRefused]


@pytest.mark.paper("D6", "chosen")
def test_random_fires_of_one_seed_are_the_same_for_all_robots():
    """The same sources, where the same places are free."""
    sparse = Scenario(people=4, time_limit=40)  # nobody stands in a fire's way
    one, other = (
        Simulation(shipped("paper"), sparse, robots, RandomFire(), seed=3)
        for robots in (NoRobots(), Sweep())
    )
    one.run()
    other.run()
    mine = one.world.flames.sources
    its = other.world.flames.sources
    few = min(len(mine), len(its))
    assert few >= 2 and mine[:few] == its[:few]


@pytest.mark.paper("D3", "Eq. 2")
@pytest.mark.paper("D5", "Eq. 3")
@pytest.mark.paper("D6")
@pytest.mark.usefixtures("unprotected")
@pytest.mark.parametrize("training", [True, False])
@pytest.mark.parametrize(("east", "north"), [(0.4, 0.4), (-0.4, -0.4), (0.4, -0.4)])
def test_a_source_is_lit_in_the_middle_of_a_free_cell(training, east, north):
    """Wherever within the cell, in both modes: Eq. 3 snaps Y as Eq. 2 snaps X."""
    board = "#########\n#p.......\n#.......E\n#.......#\n#########"
    sim = stage(board, training=training)
    x, y = sim.building.metres(2, 5)
    result = generated(sim, (0, x + east, y + north), sim.rng["fire"])
    assert result == FireLit(0.0, 0, x, y)


@pytest.mark.paper("D6")
@pytest.mark.parametrize("fate", [Fate.DEAD, Fate.EVACUATED])
def test_a_place_where_somebody_died_is_free(fate):
    """Or from where somebody got out: only people inside occupy a place."""
    sim = stage(BOARD, training=True)
    sim.world.bodies.fate[body("p")] = fate
    where = spot(sim, "p")
    assert generated(sim, where, sim.rng["fire"]) == FireLit(0.0, *where)
    assert free_places(sim.world)[sim.world.bodies.place[body("p")]]


# -- First passage ------------------------------------------------------------------


@pytest.fixture(scope="module")
def spread():
    """How flames would spread in the paper's building, with one seed."""
    return Spread(shipped("paper"), Scenario(), np.random.default_rng(5))


ONE = FireLit(0.0, 0, -10.5, 5.5)
OTHER = FireLit(20.0, 0, 3.5, -8.5)


@pytest.mark.paper("D7")
def test_flames_walk_from_cell_to_cell_and_leave_ash():
    """Lit at 2 s; as seen at 3, 20 and 60 s. Each border takes its own time."""
    board, *burning = beside("""
        ###############    ###############    ###############    ###############
        #......#......#    #......#......#    #.****.#......#    #*,,,,.#......#
        #......#......#    #..*...#......#    #.***..#......#    #*,,,**#......#
        #............pE    #............pE    #****........pE    #,,,,**......pE
        ###############    ###############    ###############    ###############
        """)
    fire = FirstDecision((0, *built(board).metres(2, 3)), NoFire())
    sim = stage(board, fire=fire, still="p", decision_seconds=1, sources=1)
    assert [play(sim, seconds) for seconds in (3, 17, 40)] == burning


@pytest.mark.paper("D7")
def test_arrival_is_a_shortest_sum_of_delays_shorter_than_a_cell_burns(spread):
    """As networkx's Dijkstra finds it over the same delays; so a fire may die out."""
    assert spread.delays.data.max() < paper.BURN_SECONDS
    graph = nx.from_scipy_sparse_array(spread.delays)
    p = navigation_of(spread.building).place(ONE.floor, ONE.x, ONE.y)
    seconds = nx.single_source_dijkstra_path_length(graph, p)
    expected = [seconds.get(q, inf) for q in range(spread.building.kind.size)]
    np.testing.assert_allclose(flames(spread, ONE).arrival.ravel(), expected)


@pytest.mark.paper("D7")
def test_each_cell_burns_from_the_earlier_of_what_two_sources_do_alone(spread):
    """Bit for bit, and in whichever order they are lit."""
    alone = [flames(spread, source).arrival for source in (ONE, OTHER)]
    for both in ((ONE, OTHER), (OTHER, ONE)):
        assert np.array_equal(flames(spread, *both).arrival, np.minimum(*alone))


@pytest.mark.paper("D7")
@pytest.mark.parametrize("floor", range(3))
def test_flames_enter_neither_walls_nor_stairwells_nor_protected_cells(floor, spread):
    """They reach much of the rest of their floor, and never leave it."""
    building = spread.building
    reached = np.isfinite(flames(spread, replace(ONE, floor=floor)).arrival)
    burns = burnable(building)[floor]
    assert not (reached[floor] & ~burns).any()
    assert reached[floor].sum() > burns.sum() / 3
    assert set(building.kind[reached].tolist()) == {Kind.FLOOR, Kind.DOOR}
    assert reached.any(axis=(1, 2)).tolist() == [k == floor for k in range(3)]


PROTECTED = """
       ##############
    ####ooo....#.ooo#
    #AA+oooo...#ooooE
    ####ooo....#.ooo#
       ######+##+####
       #............#
       ##############

       ##############
    ####ooo...#.....#
    #AA+oooo..+.....#
    ####ooo...#.....#
       #####+########
       #............#
       ##############
    """
"""o: protected, within 4 m on foot of a way out; not what only walls keep near it."""


@pytest.mark.paper("D6", "chosen")
@pytest.mark.paper("D7", "chosen")
def test_cells_within_4_m_on_foot_of_a_way_out_are_protected():
    """All other cells of rooms, and their doors, can burn; the board is of all that is
    protected."""
    sim = stage(PROTECTED.replace("o", "."))
    sim.world.flames.burning = burnable(sim.building)
    burns = show(sim).replace(".", "o").replace("*", ".")
    for sign, wanted in zip(burns, drawn(PROTECTED), strict=True):
        assert sign == wanted or (sign == "." and wanted == "+")


@pytest.mark.paper("D7", "chosen")
def test_the_rim_of_a_clearance_is_what_flames_must_fill_to_close_it():
    """Not the cells beyond a wall, nor those inside."""
    building = built(PROTECTED.replace("o", "."))
    (way_out,) = building.exits
    assert [divmod(p, 17) for p in cells_around_clearance(building, way_out)] == [
        (1, 12),
        (3, 12),
    ]


@pytest.mark.paper("D7")
def test_delays_are_the_same_both_ways_and_differ_by_seed(spread):
    """A border has one delay, fixed for the run."""
    assert (spread.delays != spread.delays.T).nnz == 0
    other = Spread(spread.building, Scenario(), np.random.default_rng(6))
    assert not np.array_equal(spread.delays.data, other.delays.data)


@pytest.mark.paper("D7")
@pytest.mark.parametrize("now", [30.0, 70.0])
def test_what_burns_is_what_the_flames_have_reached_lately(spread, now):
    """The rest is ash; `advance` tells when the next cell begins or ends to burn."""
    fire = flames(spread, ONE, OTHER)
    next_time = spread.advance(fire, now)
    begin = fire.arrival
    end = fire.arrival + paper.BURN_SECONDS
    assert np.array_equal(fire.burning, (begin <= now) & (now < end))
    assert np.array_equal(fire.ash, end <= now)
    assert fire.ash.any() == (now > paper.BURN_SECONDS)
    coming = np.concatenate([begin.ravel(), end.ravel()])
    assert next_time == coming[coming > now].min()


@pytest.mark.paper("D7", "chosen")
def test_a_cell_burns_for_40_s_and_is_ash_then():
    """It hurts nobody any more, and people walk over it."""
    sim = stage("#p.*...E", still="p")
    assert play(sim, paper.BURN_SECONDS - 1) == "#p.*...E"
    assert play(sim, 2) == "#p.,...E"
    assert sim.world.flames.ash.sum() == 1
    assert not sim.world.flames.harm.any()
    sim.world.bodies.pace[:] = paper.WALKING_SPEED
    assert play(sim, 3) == "#..,.p.E"


@pytest.mark.paper("D7", "chosen")
def test_a_source_is_seen_to_burn_from_the_next_step_of_the_flames_on():
    """Its cell is lit between two of them, so it burns a second less than others."""
    sim = stage("#..........E")
    sim.fire_strategy = FirstDecision((0, *sim.building.metres(1, 1)), NoFire())
    while not sim.world.flames.sources:
        sim.step()
    (source,) = sim.world.flames.sources
    seen = []
    while not sim.world.flames.ash[0, 1, 1]:
        if sim.world.flames.burning[0, 1, 1]:
            seen.append(sim.world.time)
        sim.step()
    assert seen[0] == pytest.approx(source.time + paper.FLAME_SECONDS)
    assert sim.world.time == pytest.approx(source.time + paper.BURN_SECONDS)


@pytest.mark.paper("D7", "chosen")
def test_one_border_in_eleven_carries_no_flames(spread):
    """Those whose delay is longer than a cell burns: bond percolation."""
    burns = burnable(spread.building)
    south = burns[:, 1:] & burns[:, :-1]
    east = burns[..., 1:] & burns[..., :-1]
    borders = south.sum() + east.sum()
    carried = spread.delays.nnz / 2 / borders  # each border in both directions
    expected = 1 - exp(-paper.SPREAD_RATE * paper.BURN_SECONDS)
    assert carried == pytest.approx(expected, abs=0.02)


@pytest.mark.paper("D7", "chosen")
def test_how_fast_flames_spread_and_how_long_they_burn_is_the_scenarios():
    """Twice the rate halves every delay; what burns long lets more borders pass."""
    building = shipped("tiny")

    def delays(**fire):
        rng = np.random.default_rng(5)
        return Spread(building, Scenario(**fire), rng).delays

    usual = delays(burn_seconds=1_000_000)
    twice = delays(spread_rate=2 * paper.SPREAD_RATE, burn_seconds=1_000_000)
    np.testing.assert_allclose(twice.toarray(), usual.toarray() / 2)
    short = delays(burn_seconds=10)
    assert short.data.max() < 10
    assert short.nnz < delays().nnz < usual.nnz


@pytest.mark.paper("D7", "chosen")
@pytest.mark.parametrize("burn_seconds", [5, 1_000_000])
def test_a_cell_burns_for_as_long_as_the_scenario_says(burn_seconds):
    """For good, if that is longer than an evacuation."""
    sim = stage("#p.*...E", still="p", burn_seconds=burn_seconds)
    assert play(sim, 4) == "#p.*...E"
    assert play(sim, 60) == ("#p.,...E" if burn_seconds == 5 else "#p.*...E")


@pytest.mark.paper("D7", "chosen")
def test_ash_is_never_lit_again():
    """Neither by flames beside it nor by a source [D6]."""
    sim = stage("#.*...pE", still="p")
    wait(sim, paper.BURN_SECONDS + 1)
    place = (0, *sim.building.metres(1, 2))
    refusing = SourceGenerator(
        sim.building, Scenario(training=True), np.random.default_rng(0)
    )
    assert isinstance(refusing.generate(sim.world, place), FireRefused)
    was = sim.world.flames.arrival.flat[sim.navigation.place(*place)]
    sim.spread.ignite(sim.world.flames, FireLit(sim.world.time, *place))
    assert sim.world.flames.arrival.flat[sim.navigation.place(*place)] == was


@pytest.mark.paper("B7")
def test_flames_hurt_and_so_does_standing_beside_them():
    """Most in them, less beside them, not at all farther away or behind a wall."""
    sim = stage("#.*.p.E")
    assert sim.world.flames.harm[0, 1].tolist() == (
        [0, paper.HEAT_LOSS, paper.BURN_LOSS, paper.HEAT_LOSS, 0, 0, 0]
    )
    assert not sim.world.flames.harm[0, [0, 2]].any()


@pytest.mark.paper("B7")
def test_everybody_loses_what_their_own_place_costs():
    """p stands beside the flame, q farther away."""
    sim = stage("#..*p..q..E", still="pq")
    sim.step()
    everywhere = paper.HEALTH_RATE * paper.FRAMES_PER_TICK
    lost = paper.HEALTH - sim.world.bodies.health
    beside_it = everywhere + paper.HEAT_LOSS * sim.tick
    assert lost == pytest.approx([beside_it, everywhere])


@pytest.mark.paper("B7")
@pytest.mark.paper("C7", "chosen")
def test_two_flames_side_by_side_are_no_hotter_than_one():
    """h: beside flames, in all four directions, not where only corners meet. A metre
    there counts as 4 for robots, and as 50 in flames."""
    board = """
        #########
        #..hh...#
        #.h**h..#
        #..h*h..#
        #...h...E
        #########
        """
    fire = stage(board.replace("h", ".")).world.flames
    harm = {"*": paper.BURN_LOSS, "h": paper.HEAT_LOSS}
    cost = {"*": paper.BURN_COST, "h": paper.HEAT_COST}
    for row, signs in enumerate(drawn(board).splitlines()):
        assert fire.harm[0, row].tolist() == [harm.get(sign, 0) for sign in signs]
        assert fire.cost[0, row].tolist() == [cost.get(sign, 1) for sign in signs]


# -- Doors --------------------------------------------------------------------------


@pytest.mark.paper("A6")
def test_a_door_is_destroyed_as_soon_as_flames_burn_beside_it():
    """Once, and not from two cells away. Its own cell does not burn yet, and it is no
    edge of the graph any more."""
    assert later("#p...*.+....E", 3, still="p") == "#p...*.+....E"
    sim = stage("#p....*+....E", still="p")
    assert play(sim, paper.FLAME_SECONDS) == "#p....*:....E"
    door = sim.building.landmarks[mark(sim, ":")].id
    burnt = [sim.building.landmarks[k].id for k in sim.world.burnt]
    left = without_doors(sim.building.graph, burnt)
    assert door not in {key for *_, key in left.edges(keys=True)}
    wait(sim, 5 * paper.FLAME_SECONDS)
    assert [type(event) for event in sim.events] == [DoorBurnt]


@pytest.mark.paper("A6")
def test_entrances_and_exits_are_not_regular_doors_and_do_not_burn():
    """Flames stand beside all three; only the door in the middle is destroyed."""
    board = "#AA+*p....*+..*E\n\n#AA+...........#"
    assert later(board, 3, still="p") == "#AA+*p....*:..*E\n\n#AA+...........#"


@pytest.mark.paper("A6")
def test_four_doors_around_one_flame_are_destroyed_at_once():
    """In the same second, on all its sides; the fifth is a metre farther away."""
    board, after = beside("""
        ##########    ##########
        #.......p#    #.......p#
        #.##+#####    #.##:#####
        #.#+*+.+.#    #.#:*:.+.#
        #.##+#####    #.##:#####
        #........E    #........E
        ##########    ##########
        """)
    sim = stage(board, still="p")
    assert play(sim, paper.FLAME_SECONDS) == after
    times = [event.time for event in events_of(sim, DoorBurnt)]
    assert times == [paper.FLAME_SECONDS] * 4


# -- Strategies ---------------------------------------------------------------------


@pytest.mark.paper("C2", "D2")
def test_sources_appear_at_every_kth_decision_until_all_are_lit():
    """The first at 10 s, then every 25 s; the generator stops, and refuses none."""
    scenario = Scenario(people=4, sources=3, time_limit=90)
    sim = Simulation(shipped("paper"), scenario, NoRobots(), RandomFire())
    sim.world.bodies.pace[:] = 0  # nobody gets out
    sim.run()
    lit = events_of(sim, FireLit | FireRefused)
    first = paper.FIRE_FIRST_DECISION * paper.DECISION_SECONDS
    step = paper.FIRE_EVERY_DECISIONS * paper.DECISION_SECONDS
    assert lit == sim.world.flames.sources
    assert [e.time for e in lit] == pytest.approx(first + step * np.arange(3))


@pytest.mark.paper("D2")
@pytest.mark.parametrize("name", FIRES)
def test_a_strategy_decides_floor_and_place_or_nothing(name):
    """On a floor that exists, inside the drawing."""
    sim = Simulation(shipped("paper"), seed=4)
    decision = FIRES[name]().decide(sim.world, np.random.default_rng(0))
    assert (decision is None) == (name == "none")
    if decision:
        place = sim.navigation.place(*decision)
        assert sim.building.kind.ravel()[place] == Kind.FLOOR


@pytest.mark.paper("D2")
@pytest.mark.paper("D6", "chosen")
def test_a_random_fire_chooses_free_cells_of_rooms_on_all_floors():
    """Uniformly over the floors, hardly one twice, and no protected one."""
    world = empty(shipped("paper"))
    rng = np.random.default_rng(0)
    free = burnable(world.building)
    chosen = [RandomFire().decide(world, rng) for _ in range(300)]
    floors = [floor for floor, _, _ in chosen]
    assert min(np.bincount(floors, minlength=3)) > 70
    assert len(set(chosen)) > 250
    for level, x, y in chosen:
        row, col = world.building.cell(x, y)
        assert free[level, row, col]


@pytest.mark.paper("D2")
@pytest.mark.paper("D6", "chosen")
def test_a_random_fire_lights_small_floors_as_often_as_large_ones():
    """Four cells may burn upstairs, 20 below."""
    world = empty(built("#........................E\n\n#........E################"))
    rng = np.random.default_rng(0)
    floors = [RandomFire().decide(world, rng)[0] for _ in range(300)]
    assert min(np.bincount(floors, minlength=2)) > 110


@pytest.mark.paper("D6", "chosen")
@pytest.mark.parametrize("fire", FIRES)
def test_nothing_ever_burns_where_all_cells_are_protected(fire):
    """Scripted fires decide nothing; whoever decides is refused, in both modes."""
    sim = stage("#p...E", fire=fire)
    assert not burnable(sim.building).any()
    sim.run()
    assert not events_of(sim, FireLit | FireRefused)
    rng = np.random.default_rng(0)
    place = (0, *sim.building.metres(1, 2))
    for training in (True, False):
        scenario = Scenario(training=training)
        generator = SourceGenerator(sim.building, scenario, rng)
        refused = generator.generate(sim.world, place)
        assert isinstance(refused, FireRefused)

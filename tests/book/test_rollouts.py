"""Rollouts: what a learner gets is what happened in the environment."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import torch
from lives import settings

from reference.building import building_of
from reference.fire import NoFire, RandomFire
from reference.game.codec import PolicyCodec, decision_in
from reference.game.environment import FIRE, Environment
from reference.game.observations import from_normalised, robots_at_work, vector_layout
from reference.learning.adversarial import adversarial_rounds, learner_for, player_of
from reference.learning.rollouts import Episode, Job, play
from reference.learning.settings import SIDES
from reference.paper import Scenario
from reference.rewards import fire_reward
from reference.simulation import Simulation
from reference.workshop.engine import run_to_decision
from reference.workshop.maps import load, plan_of
from reference.world import Died, Evacuated, FireLit, FireRefused

TINY = plan_of(load("tiny"))
TABLE = settings("ppo", hidden_units=8, num_layers=1)  # Gaussians
SCENARIO = Scenario(people=6, sources=3, training=True)


def played(scenario: Scenario) -> Episode:
    """An episode of two new policies."""
    sides = {
        side: player_of(learner_for(side, TINY, scenario, TABLE, seed=1))
        for side in ("robots", "fire")
    }
    (episode,) = play(Job(TINY, scenario, **sides, seeds=(1,)))
    return episode


def replayed(episode: Episode, environment: Environment):
    """Take the recorded actions again: each side's rewards, one a decision; what it is
    told then and at the end, see `told_to`; and whom time cut off."""
    *team, _ = environment.possible_agents
    floors = environment.building.floors
    paid = {"robots": [], "fire": []}
    told = {"robots": [], "fire": []}
    seen, infos = environment.reset(episode.seed)
    fires = iter(episode.fire.actions[:, 0])
    for raw in episode.robots.actions:
        told["robots"].append(told_to(team, seen, infos))
        axes = raw.clip(-3, 3) / 3
        actions = dict(zip(environment.possible_agents, axes, strict=False))
        actions[FIRE] = np.zeros(3)
        if infos[FIRE]["acts"]:
            *place, branch = next(fires)
            middle = (2 * branch + 1) / floors - 1  # of this floor's share of [-1, 1]
            actions[FIRE] = np.array([middle, *np.clip(place, -3, 3) / 3])
            paid["fire"].append(0.0)
            told["fire"].append(told_to([FIRE], seen, infos))
        now, rewards, _, cut, says = environment.step(actions)
        seen |= now  # who has left keeps what it was told last
        infos |= says
        paid["robots"].append(rewards["robot_0"])
        if paid["fire"]:
            paid["fire"][-1] += rewards[FIRE]
    assert environment.agents == [] == list(fires)
    told["robots"].append(told_to(team, seen, infos))
    told["fire"].append(told_to([FIRE], seen, infos))
    return paid, told, [agent for agent in cut if cut[agent]]


def told_to(agents, seen, infos):
    """Their vectors, the grid of all, and whose next action is read."""
    vectors = np.stack([seen[agent]["vector"] for agent in agents])
    return vectors, seen[FIRE]["grid"], [infos[agent]["acts"] for agent in agents]


@pytest.mark.paper("C8", "D6", "E3")
@pytest.mark.paper("E4", "deviation")
@pytest.mark.parametrize(
    ("people", "seconds", "robots_go_on", "fire_goes_on"),
    [
        ((3, 3), 30, 4, True),
        ((0, 6), 18, 4, True),
        ((6, 0), 30, 2, True),
        ((3, 3), 95, 2, False),
        ((3, 3), 200, 0, False),
    ],
    ids=[
        "time is up",
        "upstairs",
        "nobody upstairs",
        "the last source is lit",
        "nobody is inside",
    ],
)
def test_a_trajectory_is_what_the_environment_says_to_its_actions(
    people, seconds, robots_go_on, fire_goes_on
):
    """Rewards; what is observed and who decides, at each decision; what is observed
    last, and who is cut off with something left to decide."""
    scenario = replace(SCENARIO, people_per_floor=people, time_limit=float(seconds))
    episode = played(scenario)
    environment = Environment(building_of(TINY), scenario)
    paid, told, cut = replayed(episode, environment)
    *team, fire = environment.possible_agents
    assert cut == team[:robots_go_on] + [fire] * (robots_go_on > 0)
    at_work = robots_at_work(environment.simulation.world)  # when time was up
    scaled = vector_layout(environment.building, scenario).scaled
    for side in SIDES:
        t = getattr(episode, side)
        assert t.rewards == pytest.approx(paid[side]) and any(paid[side])
        vectors, grids, acts = map(np.stack, zip(*told[side], strict=True))
        assert np.array_equal(t.vectors, scaled(vectors) if side == "fire" else vectors)
        assert np.array_equal(t.grids, grids)
        assert np.array_equal(t.alive[:-1], acts[:-1])
    goes_on = [agent in cut and at_work[k] for k, agent in enumerate(team)]
    assert episode.robots.alive[-1].tolist() == goes_on
    assert episode.fire.alive[-1].tolist() == [fire_goes_on]
    assert episode.facts == pytest.approx(facts_of(environment.simulation, paid))


def facts_of(run: Simulation, paid: dict[str, list[float]]) -> dict[str, float]:
    """What an episode that went like this tells."""
    events = Counter(map(type, run.events))
    outcome = run.outcome()
    return {
        "group_reward": sum(paid["robots"]),
        "fire_reward": fire_reward(run.events),
        "survival": outcome.evacuated / 6,
        "evacuated": events[Evacuated],
        "died": events[Died],
        "refused": events[FireRefused],
        "sources": events[FireLit],
        "seconds": run.world.time,
        "length": len(paid["robots"]),
    }


@pytest.mark.paper("E6")
def test_episodes_played_at_once_are_as_if_played_alone():
    """Seeds beside them change nothing but a last digit; nor do jobs played before."""
    scene = replace(SCENARIO, time_limit=60.0)
    one, other = (
        player_of(learner_for("robots", TINY, scene, TABLE, seed)) for seed in (1, 2)
    )
    jobs = [
        Job(TINY, scene, one, RandomFire(), seeds=(1, 2)),
        Job(TINY, scene, other, NoFire(), seeds=(3,)),
    ]
    each = [replace(job, seeds=(seed,)) for job in jobs for seed in job.seeds]
    alone = [episode for job in each for episode in play(job)]
    at_once = [
        episode for job in jobs for episode in play(job, advance=run_to_decision)
    ]
    for one, other in zip(alone, at_once, strict=True):
        assert one.facts == other.facts
        for name, column in vars(one.robots).items():
            close = pytest.approx(column, rel=1e-5, abs=1e-6, nan_ok=True)  # float32
            assert getattr(other.robots, name) == close


def test_playing_leaves_torch_s_own_random_numbers_alone():
    """Somebody's own seeded training beside it draws what it draws without."""
    before = torch.random.get_rng_state()
    played(SCENARIO)
    assert torch.equal(torch.random.get_rng_state(), before)


@pytest.mark.paper("E6")
def test_each_round_both_sides_learn_and_play_the_next_with_what_they_learned():
    """The second round's episodes are those of the players after the first update."""
    table = replace(TABLE, batch_size=2, buffer_size=2)  # every round fills the buffers
    scene = replace(SCENARIO, time_limit=70.0)
    learners = {s: learner_for(s, TINY, scene, table, seed=1) for s in SIDES}
    before = {side: player_of(learner) for side, learner in learners.items()}
    rounds = adversarial_rounds(TINY, scene, learners, [(1, 3), (2,)])
    assert [episode.seed for episode in next(rounds)] == [1, 3]
    after = {side: player_of(learner) for side, learner in learners.items()}
    for side in SIDES:
        one, other = (p[side].weights["head.mean.weight"] for p in (before, after))
        assert not np.array_equal(one, other), side
    (second,) = next(rounds)
    (again,) = play(Job(TINY, scene, **after, seeds=(2,)))
    for side in SIDES:
        one = getattr(second, side)
        other = getattr(again, side)
        assert np.array_equal(one.actions, other.actions), side


@pytest.mark.paper("D2", "E3")
@pytest.mark.parametrize("name", ["tiny", "paper"])
def test_a_gaussian_fire_s_branch_is_a_floor(name):
    """Branch k lights floor k; a number beyond 3 is clipped."""
    building = load(name)
    raw = np.array([[[6.0, -1.5, k]] for k in range(building.floors)])
    rows = PolicyCodec("fire", building, SCENARIO).actions(raw, [])[:, 0]
    x, y = from_normalised(building, np.array([1.0, -0.5])).tolist()
    assert list(map(decision_in, rows)) == [(k, x, y) for k in range(building.floors)]

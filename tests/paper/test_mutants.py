"""Every chapter of the book counts: changed, a test of its clause should say so.

`MUTANTS` changes one piece of the code after the other, in a copy of the checkout; at
least one test that is filed under the clause must then fail.  Whole lines of the
algorithms are taken out by `test_lines_removed`.  Each takes five to ten seconds, all
eighteen minutes on two cores, so it is a command of its own:
`python -m pytest -m mutants`.
"""

import os
import shutil
import subprocess
import sys

import pytest
from conftest import ROOT

MUTANTS = """
A1 paper
  - FLOORS = 3
  + FLOORS = 4
A2 building
  - [a-z][a-z0-9]*|[A-D]
  + [a-z]+|[A-D]
A2 building
  - width=self._width(floor, cells)
  + width=len(cells)
A2 building
  - min(here, there) or max(here, there)
  + max(here, there)
A2 building
  - min(here, there) or max(here, there)
  + min(here, there)
A3 building
  - return floor in self.areas and floor > self.lowest
  + return floor in self.areas
A3 building
  - (here.kind == "room") == mark.leads_out
  + here.kind == "room"
A3 building
  - kind = Kind.ENTRANCE if "stairwell" in kinds else Kind.DOOR
  + kind = Kind.DOOR
A3 walking
  - bodies.stairs_until[i] +=
  + bodies.stairs_until[i] += 2 *
A3 walking
  - < paper.body_diameter()).any()
  + < 0).any()
A4 simulation
  - self._leave(i, Fate.EVACUATED)
  + pass
A3 building
  - if here != OUTSIDE and
  + if here == OUTSIDE or
A3 walking
  - for p in nav.goals[mark].tolist():
  + for p in nav.goals[mark].tolist()[:1]:
A5 simulation
  - = since + count / (flow * way.width)
  + = now
A5 simulation
  - elif mark not in self.world.burnt:
  + else:
A5 walking
  - (mark >= 0) & (mark != marks[before])
  + (mark >= 0) & (place != before)
A6 simulation
  - touched = burning | cells_beside(self.building, burning)
  + touched = burning
A6 simulation
  - (self.building.kind == Kind.DOOR))
  + (self.building.kind >= Kind.DOOR))
A7 navigation
  - if d_row and d_col:  # never cut a corner
  + if False:
A6 view
  - return self.holes | under_me
  + return self.holes
A6 view
  - while through := world.burnt
  + if through := world.burnt
A6 simulation
  - for mark in sorted(set(doors.tolist()) - burnt):
  + for mark in sorted(set(doors.tolist()) - burnt)[:1]:
A7 navigation
  - d_row * d_row + d_col * d_col <= reach * reach
  + d_row * d_row + d_col * d_col <= 2
A7 navigation
  - longer = (further != at) &
  + longer = (further < 0) &
A8 building
  - row = int(np.ceil(self.origin[0] - y)) - 1
  + row = int(np.floor(self.origin[0] - y))
A9 motion
  - for axis in (1, 0):
  + for axis in (0, 1):
A9 motion
  - (at_me | ~standing[i])
  + ~standing[i]
A9 motion
  - np.maximum(s, 0) / paper.GAP_SECONDS)
  + 9 + 0 * s)
A9 motion
  - least_apart = np.where(facing, paper.SHOULDER_METRES, paper.body_diameter())
  + least_apart = np.where(facing, paper.body_diameter(), paper.body_diameter())
B1 rays
  - clear = np.isin(building.kind, (Kind.FLOOR, Kind.STAIRS))
  + clear = building.walkable.copy()
B2 paper
  - SIGHT_RANGE = 5.0
  + SIGHT_RANGE = 6.0
B2 humans
  - me.patches |= observe.looked_at
  + pass
B3 view
  - sum(1 for j in self.bodies if
  + sum(1 for j in range(len(leader)) if
B3 view
  - near[np.arange(len(who)), who] = False
  + pass
B4 humans
  - me.mode = Mode.LEADER if me.mode is Mode.FOLLOWER else Mode.FOLLOWER
  + me.mode = Mode.LEADER
B4 simulation
  - self.due[i] = True
  + pass
B4 simulation
  - self.due[:] = self.turn ==
  + self.due |= self.turn ==
B5 humans
  - return observe.time - me.seen_at < paper.LEADER_GRACE_SECONDS
  + return False
B5 humans
  - return STAY if time < me.waits_until else switch_mode(me)
  + return switch_mode(me)
B5 walking
  - fearless = burning[bodies.place[who]] | reckless
  + fearless = reckless
B5 humans
  - seen[1] < paper.FOLLOW_DISTANCE
  + False
B5 humans
  - me.told = observe.robots.get(me.leader)
  + me.told = next(iter(observe.robots.values()), None)
B6 humans
  - if kept - nearest < paper.GOAL_HYSTERESIS:
  + if False:
B6 view
  - and them.rank[j] > self.rank
  +
B6 humans
  - me.trail[-1].door)
  + me.trail[0].door)
B6 beginning
  - rank=rng.random(n),
  + rank=np.zeros(n),
B6 humans
  - if last is not None and last.door == landmark:
  + if last is not None and last.door == landmark and last.side != side:
B6 humans
  - best = max(ways
  + best = min(ways
B6 humans
  - (me.doors, me.seen_from, me.trail,
  + (me.doors, me.trail,
B6 humans
  - if kept - nearest < paper.GOAL_HYSTERESIS:
  + if kept - nearest <= paper.GOAL_HYSTERESIS:
B6 humans
  - for leader in observe.leaders_to(wanted):
  + for leader in observe.leaders_to(wanted)[:1]:
B6 rays
  - nearest.setdefault(hit.landmark, hit)
  + nearest[hit.landmark] = hit
B7 simulation
  - bodies.health[i] = 0.0
  + pass
B7 fire
  - heat = np.where(beside, paper.HEAT_LOSS, 0.0)
  + heat = np.where(beside, 0.0, 0.0)
B7 simulation
  - bodies.health -= rate * bodies.inside
  + bodies.health -= 2 * rate * bodies.inside
B7 fire
  - np.where(burning, paper.BURN_LOSS, heat)
  + heat + np.where(burning, paper.BURN_LOSS, 0.0)
B8 paper
  - PEOPLE = 40
  + PEOPLE = 41
C1 game/observations
  - fires[k, 0, j] = source.x, source.y, source.floor
  + fires[k, 0, j] = source.y, source.x, source.floor
C2 paper
  - FIRE_SOURCES = 8
  + FIRE_SOURCES = 7
C3 game/observations
  - cells[floors : 2 * floors, :rows, :cols] = burning
  + cells[floors : 2 * floors, :rows, :cols] = burning[::-1]
C4 game/observations
  - rank = np.where(up >= 0, up, floors - up)
  + rank = np.abs(up)
C4 game/observations
  - np.lexsort((metres, rank), axis=-1)
  + rank.argsort(axis=-1, kind="stable")
C6 robots
  - goal = nav.nearest_free(robot.floor, *target)
  + goal = nav.nearest_free(robot.floor, *decision)
C6 robots
  - return here if at_exit or to_stairs > paper.NEAR_STAIRWELL else middle
  + return here
C6 robots
  - and to_exit < to_stairs
  + and to_exit < 0
C7 fire
  - return np.where(burning, paper.BURN_COST, detour)
  + return np.where(burning, paper.HEAT_COST, detour)
C7 fire
  - np.where(burning, paper.BURN_COST, detour)
  + detour + np.where(burning, paper.BURN_COST, 0.0)
C7 robots
  - if world.flames.burning[floor].any() else
  + if world.flames.burning.any() else
C7 robots
  - waits = gap > paper.FOLLOWER_GAP
  + waits = gap > 9 + paper.FOLLOWER_GAP
C7 robots
  - < paper.DOORWAY_METRES:
  + < 0:
C7 robots
  - return (world.bodies.leader == robot.body).nonzero()[0]
  + return (world.bodies.leader >= len(world.bodies)).nonzero()[0]
C8 robots
  - if not robot.active:
  + if not robot.active and not robot.way:
C8 world
  - return any(self.occupancy[floor:])
  + return any(self.occupancy[floor : floor + 1])
C8 learning/poca
  - values * goes_on
  + 0 * values * goes_on
D1 game/observations
  - team = work.sum(axis=1, keepdims=True)
  + team = 0 * work.sum(axis=1, keepdims=True)
D2 simulation
  - since % paper.FIRE_EVERY_DECISIONS == 0
  + since % 4 == 0
D2 fire
  - return burnable(building) & (building.kind == Kind.FLOOR)
  + return building.kind == Kind.FLOOR
D2 building
  - rng.choice(np.argwhere(cells))
  + np.argwhere(cells)[0]
D2 game/environment
  - min(int(share * building.floors), building.floors - 1)
  + max(int(np.ceil(share * building.floors)) - 1, 0)
D3 fire
  - return below + 0.5
  + return below + 0.0
D5 fire
  - y = snapped(decision[2])
  + y = decision[2]
D6 fire
  - if self.training or not len(others):
  + if not len(others):
D6 fire
  - free[[robot.place for robot in world.robots]] = False
  + pass
D6 fire
  - free[[robot.place for robot in world.robots]] = False
  + free[[robot.place for robot in world.robots[:1]]] = False
D6 fire
  - unlit = world.flames.arrival > world.time
  + unlit = ~world.flames.burning
D6 fire
  - unlit = world.flames.arrival > world.time
  + unlit = ~world.flames.burning & ~world.flames.ash
B7 simulation
  - bodies.stairs_until[i] = inf
  + pass
A3 walking
  - bodies.walking & (bodies.floor == well.lowest)
  + bodies.walking
D7 fire
  - flames.arrival = np.minimum(flames.arrival,
  + flames.arrival = np.maximum(flames.arrival,
D7 simulation
  - and self.ticks % self._flame_ticks == 0
  +
E1 learning/adversarial
  - LEARNERS[settings.trainer_type]
  + LEARNERS["ppo"]
E1 workshop/training/rounds
  - tuple(rounds)[-most:]
  + tuple(rounds)[:most]
E1 learning/poca
  - return R - baselines, R
  + return R - values, R
E2 learning/ppo
  - following = deltas[t] + gamma * lambd * following
  + following = deltas[t] + gamma * following
E3 learning/players
  - policy.log_probs(raw).numpy()
  + policy.log_probs(policy.act()).numpy()
E3 learning/players
  - rng.standard_normal((agents, continuous), dtype=np.float32)
  + np.repeat(rng.standard_normal((1, continuous), dtype=np.float32), agents, 0)
E3 learning/adversarial
  - if learner.full:
  + if True:
E3 learning/adversarial
  - for episode in episodes]
  + for episode in episodes[:1]]
E3 learning/ppo
  - LEAST_EPSILON, at, end, s.epsilon_schedule)
  + LEAST_EPSILON, at, end, s.learning_rate_schedule)
E3 learning/ppo
  - clipped = rho.clamp(1 - epsilon, 1 + epsilon)
  + clipped = rho
E3 learning/ppo
  - self.reward_scale = settings.strength * settings.reward_scale
  + self.reward_scale = settings.reward_scale
E4 learning/ppo
  - self.update_normalisers(trajectories)
  + pass
E5 game/environment
  - dict.fromkeys(agents, group_reward(events))
  + dict.fromkeys(agents, 0.5 * group_reward(events))
E6 learning/adversarial
  - learn(side, learner, episodes)
  + side == "robots" and learn(side, learner, episodes)
E6 learning/players
  - normal = moment.rng.standard_normal(
  + normal = moments[0].rng.standard_normal(
F1 evaluation/score
  - return b ** (R / α) / c
  + return b ** (R / α) * c
F2 evaluation/score
  - (α / (R_2 - R_1))
  + (α / R_2)
F3 evaluation/score
  - return self.reward_part(reward) * log(self.base) / self.alpha
  + return self.reward_part(reward) / self.alpha
F4 evaluation/bounds
  - return -paper.FIXED_PENALTY * people
  + return 0.0
F5 paper
  - FIXED_PENALTY = 300.0
  + FIXED_PENALTY = 301.0
F6 evaluation/bounds
  - return people * (on_floors + paper.FIXED_REWARD)
  + return people * on_floors
F7 evaluation/bounds
  - way / paper.WALKING_SPEED * lost
  + way / paper.WALKING_SPEED / lost
F8 rewards
  - reward += event.health
  + reward += 1.0
F8 beginning
  - pace=np.clip(pace, slowest, fastest),
  + pace=np.clip(pace, fastest, fastest),
F9 evaluation/score
  - return h**2 / (k * α**2)
  + return h / (k * α**2)
F10 workshop/drawing/ruler
  - (max(β - y, 0.0) * k) ** 0.5 * α
  + (max(β - y, 0.0) * k) * α
F12 workshop/comparing/results
  - easy = h <= ranked[third - 1]
  + easy = h >= 0
"""
"""Clause and module, what stands there, and what stands there instead."""


def mutants():
    """Clause, file, old and new of each."""
    lines = MUTANTS.strip().splitlines()
    for first in range(0, len(lines), 3):
        head, old, new = lines[first : first + 3]
        clause, module = head.split()
        name = f"{clause}-{first // 3}"
        yield pytest.param(
            clause,
            f"reference/{module}.py",
            old[4:],
            new[4:],  # may be nothing
            id=name,
        )


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of all that the tests of the paper need."""
    folder = tmp_path_factory.mktemp("mutant")
    for name in ("reference", "tests", "floors"):
        shutil.copytree(ROOT / name, folder / name)
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


@pytest.mark.mutants
@pytest.mark.parametrize(("clause", "file", "old", "new"), list(mutants()))
def test_a_change_is_noticed_under_its_clause(clause, file, old, new, copy):
    """By a test that is filed there."""
    path = copy / file
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1, f"not once in {file}: {old}"
    path.write_text(text.replace(old, new), encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-qx", "-p", "no:cacheprovider"]
    environment = os.environ | {"PYTHONDONTWRITEBYTECODE": "1", "PYTHONPATH": str(copy)}
    try:
        done = subprocess.run(
            [*command, "--paper", clause], cwd=copy, env=environment, check=False
        )
    finally:
        path.write_text(text, encoding="utf-8")
    assert done.returncode == pytest.ExitCode.TESTS_FAILED


def test_what_a_mutant_changes_stands_there_once():
    """And there are mutants of all six parts of the appendix."""
    rows = [mutant.values for mutant in mutants()]
    for _, file, old, new in rows:
        assert old != new
        assert (ROOT / file).read_text("utf-8").count(old) == 1, old
    assert len(rows) > 60
    assert {clause[0] for clause, *_ in rows} == set("ABCDEF")

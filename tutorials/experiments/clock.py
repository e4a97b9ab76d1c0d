"""How much faster is one build than another? Two checkouts in turn, one table.

    git worktree add ../old 5608d40
    python tutorials/experiments/clock.py ../old .
    python tutorials/experiments/clock.py ../old . --only escort memory --rounds 1

Commit 5608d40 is of version 0.17.2, before GAME 8 and the engine; it has
`workshop.lockstep` in the engine's place, which `old` may have. Each measurement is a
process of its own that imports its checkout's package; old and new take turns, so that
what else runs on the machine meets both. Costs are CPU seconds on one thread with warm
caches, those of trainings seconds on the wall with two workers. Targets are this
project's, set against 5608d40 before the engine was measured. A round of all rows takes
a quarter of an hour; without the trainings five minutes.
"""

import argparse
import csv
import json
import os
import resource
import subprocess
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter, process_time, sleep
from typing import Any, NamedTuple

DECISIONS = 40_000  # of the robots in a training
MINIBATCHES = 4  # of a measured update, at least


# -- What is measured: each returns a cost, in a process of its own -----------------


def engine_of_this_checkout() -> Any:
    """Return the module that has `run_to_decision` and `run_to_end`, by these names."""
    try:
        from reference.workshop import engine
    except ImportError:
        from reference.workshop import lockstep as engine
    if not hasattr(engine, "run_to_end"):  # as they were called before
        engine.run_to_decision = engine.together
        engine.run_to_end = engine.to_the_end
    return engine


def each_alone(runs: Sequence[Any]) -> None:
    """Let the book play, one world after the other."""
    for run in runs:
        run.run()


def tick(
    runs: int, people: int, robots: str, fire: str, seconds: float, alone: bool = False
) -> float:
    """Microseconds per world and tick of so many evacuations."""
    from reference.paper import Scenario
    from reference.simulation import Simulation
    from reference.workshop.maps import load
    from reference.workshop.strategies import SCRIPTS

    building = load("paper")
    scenario = Scenario(people=people, time_limit=seconds)
    play = each_alone if alone else engine_of_this_checkout().run_to_end

    for _ in range(2):  # the first time warms up
        worlds = []
        for seed in range(100, 100 + runs):
            guides = SCRIPTS["robots"][robots]()
            flames = SCRIPTS["fire"][fire]()
            worlds.append(Simulation(building, scenario, guides, flames, seed))
        start = process_time()
        play(worlds)
        cost = process_time() - start
    return 1e6 * cost / sum(world.ticks for world in worlds)


def begin_training(name: str) -> Any:
    """Begin a preset's training."""
    import reference
    from reference.workshop.training.checkpoints import Task
    from reference.workshop.training.presets import preset
    from reference.workshop.training.rounds import Training

    floors = Path(reference.__file__).parent.parent / "floors"
    plan = (floors / "paper.txt").read_text()
    return Training(Task("paper", plan, preset(name), 0))


def lives_of(episodes: Sequence[Any], side: str) -> list[Any]:
    """Return the trajectories of a side; an episode may have none."""
    lives = [getattr(episode, side) for episode in episodes]
    return [life for life in lives if life is not None]


def rollouts(name: str) -> float:
    """Microseconds per decision of the robots in a preset's first job."""
    from reference.learning.rollouts import play
    from reference.workshop.storage.workers import one_thread

    job = begin_training(name).jobs()[0]
    with one_thread():
        for _ in range(2):  # the first time warms up
            start = process_time()
            played = play(job, advance=engine_of_this_checkout().run_to_decision)
            cost = process_time() - start
    return 1e6 * cost / sum(life.steps for life in lives_of(played, "robots"))


def update(name: str, side: str) -> float:
    """Microseconds per sample and epoch of an update: MA-POCA robots or PPO fire."""
    from reference.learning.rollouts import play
    from reference.workshop.storage.workers import one_thread

    training = begin_training(name)
    learner = training.learners[side]
    settings = learner.settings
    with one_thread():
        jobs = training.jobs()
        advance = engine_of_this_checkout().run_to_decision
        played = [e for job in jobs for e in play(job, advance=advance)]
        lives = lives_of(played, side)
        steps = sum(life.steps for life in lives)
        often = -(-MINIBATCHES * settings.batch_size // steps)
        for _ in range(2):  # the first time warms up
            learner.add(lives * often)
            start = process_time()
            learner.update()
            cost = process_time() - start
    return 1e6 * cost / (often * steps * settings.num_epoch)


def training(name: str) -> float:
    """Seconds on the wall from the command until its robots have decided so often."""
    command = f"-m reference train --preset {name} --seed 0 --workers 2 --out"
    with TemporaryDirectory() as folder:
        out = Path(folder, "out")
        start = perf_counter()
        with subprocess.Popen(
            [sys.executable, *command.split(), str(out)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        ) as process:
            while decisions(out / "summaries.csv") < DECISIONS:
                if process.poll() is not None:
                    raise SystemExit(f"train --preset {name} has failed")
                sleep(0.02)
            cost = perf_counter() - start
            process.terminate()
    return cost


def decisions(summaries: Path) -> int:
    """How often robots have decided, as a training's whole rows say so far."""
    if not summaries.exists():
        return 0
    whole, _, _ = summaries.read_text().rpartition("\n")
    rows = csv.DictReader(whole.splitlines())
    return max((int(row["step"]) for row in rows if row["side"] == "robots"), default=0)


def memory() -> float:
    """Megabytes at the peak of `evaluate` with 100 evacuations, in one process."""
    command = "evaluate --robots escort --fire busiest --workers 0 --episodes 100"
    subprocess.run(
        [sys.executable, "-m", "reference", *command.split()],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024


def first_decision() -> float:
    """CPU seconds until the engine has played one decision, and of who compiles it."""
    from reference.simulation import Simulation
    from reference.workshop.maps import load

    run = Simulation(load("tiny"))
    start = sum(os.times()[:4])
    engine_of_this_checkout().run_to_decision([run])
    return sum(os.times()[:4]) - start


def compilation() -> float:
    """CPU seconds until the first decision, with an empty cache."""
    with TemporaryDirectory() as folder:
        os.environ["XDG_CACHE_HOME"] = folder
        return first_decision()


MEASURES: dict[str, Callable[[], float]] = {
    "40 alone": partial(tick, 2, 40, "none", "none", 300.0, alone=True),
    "40 many": partial(tick, 32, 40, "none", "none", 300.0),
    "400 alone": partial(tick, 2, 400, "none", "none", 20.0, alone=True),
    "400 many": partial(tick, 4, 400, "none", "none", 20.0),
    "escort": partial(tick, 32, 40, "escort", "busiest", 300.0),
    "memory": memory,
    "compilation": compilation,
    "first decision": first_decision,
}
for preset in ("laptop", "paper"):
    MEASURES[f"rollouts {preset}"] = partial(rollouts, preset)
    MEASURES[f"PPO {preset}"] = partial(update, preset, "fire")
    MEASURES[f"MA-POCA {preset}"] = partial(update, preset, "robots")
    MEASURES[f"training {preset}"] = partial(training, preset)


# -- The table ----------------------------------------------------------------------


class Row(NamedTuple):
    """What is compared, of how many runs; measures of old and new; the target."""

    what: str
    old: str  # "" for none
    new: str
    target: float  # how many times faster; without an old one, what it may cost


ROWS = {
    "alone": Row(
        "us a tick, 40 people: 2 runs by the book, now 32", "40 alone", "40 many", 30
    ),
    "many": Row("us a tick, 40 people: 32 runs", "40 many", "40 many", 14),
    "400": Row(
        "us a tick, 400 people: 2 runs by the book, now 4", "400 alone", "400 many", 10
    ),
    "escort": Row("us a tick, escort, busiest: 32 runs", "escort", "escort", 5),
    "book": Row(
        "us a tick, 40 people: 32 runs, now 2 by the book", "40 many", "40 alone", 0.5
    ),
    "memory": Row("MB of 100 evacuations", "memory", "memory", 1),
    "compilation": Row("s of cold compilation", "", "compilation", 60),
    "start": Row("s of a start from the cache", "", "first decision", 2),
}
for what, name, targets in (
    ("us a decision", "rollouts", {"laptop": 5, "paper": 5}),
    ("us a sample", "PPO", {"laptop": 1.3, "paper": 1.3}),
    ("us a sample", "MA-POCA", {"laptop": 1.05, "paper": 1.05}),
    (f"s of {DECISIONS:,} decisions", "training", {"laptop": 2.5, "paper": 2}),
):
    for preset, target in targets.items():
        both = f"{name} {preset}"
        ROWS[f"{name}-{preset}"] = Row(f"{what}: {both}", both, both, target)


def measured(checkout: Path, name: str) -> float:
    """Measure in a process of its own, with a checkout's package."""
    environment = os.environ | {
        "PYTHONPATH": str(checkout),
        "OMP_NUM_THREADS": "1",
        "OMP_WAIT_POLICY": "PASSIVE",
    }
    if name.startswith("training"):  # how many threads learn is its own affair
        del environment["OMP_NUM_THREADS"]
    done = subprocess.run(
        [sys.executable, __file__, "--measure", name],
        cwd=checkout,
        env=environment,
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    cost: float = json.loads(done.stdout.splitlines()[-1])
    print(f"{checkout.name}, {name}: {cost:.4g}", file=sys.stderr, flush=True)
    return cost


def line(row: Row, old: Sequence[float], new: Sequence[float]) -> str:
    """Write a row: medians, the ratios' median and range, target, verdict."""
    now = median(new)
    if not old:
        verdict = "met" if now <= row.target else "missed"
        return f"| {row.what} | | {now:.3g} | | | at most {row.target:g} | {verdict} |"
    ratios = sorted(before / after for before, after in zip(old, new, strict=True))
    ratio = median(ratios)
    verdict = "met" if ratio >= row.target else "missed"
    cells = (
        row.what,
        f"{median(old):.4g}",
        f"{now:.4g}",
        f"{ratio:.2f}",
        f"{ratios[0]:.2f} to {ratios[-1]:.2f}",
        f"{row.target:g}",
        verdict,
    )
    return f"| {' | '.join(cells)} |"


def compare(old: Path, new: Path, rows: Sequence[Row], rounds: int) -> None:
    """Measure old and new in turn, and print the table."""
    wanted = dict[tuple[Path, str], list[float]]()
    for row in rows:
        if row.old:
            wanted[old, row.old] = []
        wanted[new, row.new] = []
    measured(new, "first decision")  # compiles, if nobody has before
    ordered = sorted(wanted, key=lambda one: [*MEASURES].index(one[1]))
    for _ in range(rounds):
        for checkout, name in ordered:
            wanted[checkout, name].append(measured(checkout, name))

    print("| what | old | new | times | range | target | |")
    print("|---|---|---|---|---|---|---|")
    for row in rows:
        before = wanted[old, row.old] if row.old else []
        print(line(row, before, wanted[new, row.new]))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("checkouts", nargs="*", type=Path, metavar="OLD NEW")
    parser.add_argument("--only", nargs="+", choices=ROWS, default=[*ROWS])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--measure", choices=MEASURES, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.measure:
        print(json.dumps(MEASURES[asked.measure]()))
    elif asked.rounds < 1:
        parser.error("--rounds: it must be 1 or more")
    elif len(asked.checkouts) == 2:
        one, other = (path.resolve() for path in asked.checkouts)
        compare(one, other, [ROWS[name] for name in asked.only], asked.rounds)
    else:
        parser.error("name two checkouts, the old one first")

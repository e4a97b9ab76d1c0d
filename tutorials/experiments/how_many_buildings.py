"""How many buildings must robots have seen, to guide in one that they never saw?

    python tutorials/experiments/how_many_buildings.py
    python tutorials/experiments/how_many_buildings.py --decisions 100_000 --seeds 0

Trainings of preset `any` in 1, 10, 100 and 1,000 generated buildings: each copies
`escort`, then makes as many decisions under scripted fires.  Afterwards they play in
buildings of their own training and in others, where `escort` plays, too.  The gap
between both is how much they overfit.  Whatever is finished is kept, each
number of decisions apart; the same command goes on.  With 500,000 it takes hours.
"""

import signal
import subprocess
import sys
from argparse import ArgumentParser
from pathlib import Path

import numpy as np
from any_map import FIRES, Place, generated_places, room_in, survivors
from matplotlib.figure import Figure

from reference.workshop.commands.common import exit_status
from reference.workshop.commands.options import whole
from reference.workshop.comparing.results import align_columns
from reference.workshop.drawing import save
from reference.workshop.drawing.page import BLUE
from reference.workshop.storage.files import make_folder, write_json
from reference.workshop.storage.workers import workers
from reference.workshop.training.checkpoints import newest_checkpoint
from reference.workshop.training.families import Family, plan_in

NUMBERS = (1, 10, 100, 1000)
PLACES = 10  # of each kind that they play in; of one building, that one
HELD_OUT = 7000  # seeds of buildings in no training
GUIDE = "escort"
SETTINGS = """reference:
  imitation_rounds: 2
  imitation_episodes: 240
  Robot:
    max_steps: {decisions}
    keep_checkpoints: 2
"""


def train(out, number, seed, decisions, workers_of_it):
    """Begin a training, or go on; return its folder."""
    folder = out / f"{number}-{seed}"
    settings = out / "settings.yaml"
    settings.write_text(SETTINGS.format(decisions=decisions), encoding="utf-8")
    begin = ["--preset", "any", "--building", f"random:{number}", "--imitate", GUIDE]
    begin += ["--seed", str(seed), "--settings", str(settings)]
    finish_training(folder, begin, workers_of_it)
    return folder


def finish_training(folder, begin, workers_of_it):
    """Train to the end. begin: options of `train` where it has not begun yet."""
    command = [sys.executable, "-m", "reference", "train"]
    command += ["--resume"] if newest_checkpoint(folder) else begin
    command += ["--workers", str(workers_of_it), "--out", str(folder)]
    training = subprocess.Popen(command)
    try:
        status = training.wait()
    except BaseException:  # a stop reaches the training, too: it saves and ends
        training.terminate()
        training.wait()
        raise
    if status:
        sys.exit(status)  # it has said why


def own_places(folder, number, seed):
    """Write the first buildings of a training; people and robots by lot."""
    make_folder(folder)
    family = Family(number=number)
    for which in range(min(number, PLACES)):
        rng = np.random.default_rng([seed, which])
        ranges = (family.people, family.robots_per_floor)
        people, robots = (
            int(rng.integers(low, high, endpoint=True)) for low, high in ranges
        )
        path = folder / f"{which}.txt"
        path.write_text(plan_in(family, seed, which), encoding="utf-8")
        yield Place(str(path), min(people, room_in(path)), robots)


def less_than_guide(places, robots, episodes, folder, executor):
    """Points less than the guide, a mean of each fire over buildings."""
    lost = []
    for place in places:
        runs = folder / f"runs-{Path(place.building).stem}"
        found = survivors(place, (GUIDE, robots), FIRES, episodes, runs, executor)
        lost.append([found[robots, fire] - found[GUIDE, fire] for fire in FIRES])
    return dict(zip(FIRES, np.mean(lost, axis=0).tolist(), strict=True))


def drawn(found):
    """Draw points less than the guide against buildings, a panel for each fire."""
    figure = Figure(figsize=(9, 3.6), layout="constrained")
    panels = figure.subplots(1, len(FIRES), sharey=True)
    kinds = {
        "own": ("in buildings of its training", "#c2571a"),
        "held out": ("in others", BLUE),
    }
    for axes, fire in zip(panels, FIRES, strict=True):
        for kind, (label, colour) in kinds.items():
            points = [(row["buildings"], row[kind][fire]) for row in found]
            means = {
                number: np.mean([less for n, less in points if n == number])
                for number, _ in points
            }
            axes.plot(*zip(*points, strict=True), "o", color=colour, alpha=0.5)
            axes.plot(list(means), list(means.values()), color=colour, label=label)
        axes.axhline(0, color="0.4", linestyle="dashed", linewidth=1)
        axes.set_xscale("log")
        numbers = sorted({row["buildings"] for row in found})
        axes.set_xticks(numbers, [f"{number:,}" for number in numbers])
        axes.minorticks_off()
        axes.set_title("no fire" if fire == "none" else f"fire {fire}", fontsize=10)
        axes.set_xlabel("buildings of the training")
    panels[0].set_ylabel(f"survivors less those of {GUIDE}, points")
    panels[1].legend(loc="lower right")
    return figure


def main():
    parser = ArgumentParser(description="How many buildings are needed?")
    add = parser.add_argument
    add("--numbers", type=whole(1), nargs="+", default=NUMBERS, help="of buildings")
    add("--seeds", type=whole(0), nargs="+", default=(0, 1), help="of trainings; 0, 1")
    add("--decisions", type=whole(1), default=500_000, help="of each; 500,000")
    add("--episodes", type=whole(1), default=10, help="in each building; 10")
    add("--out", type=Path, default=Path("out/how_many"), help="out/how_many")
    add("--workers", type=whole(0), default=2, help="processes; 0: this one; 2")
    add("--picture", type=Path, help="OUT/DECISIONS/buildings.png")
    asked = parser.parse_args()

    out = asked.out / str(asked.decisions)
    make_folder(out)
    found = []
    there = [*generated_places(out / "held_out", PLACES, HELD_OUT)]
    for seed in asked.seeds:
        for number in asked.numbers:
            made = train(out, number, seed, asked.decisions, asked.workers)
            own = [*own_places(out / f"own-{number}-{seed}", number, seed)]
            row = {"buildings": number, "seed": seed, "decisions": asked.decisions}
            with workers(asked.workers) as executor:
                for kind, places in {"own": own, "held out": there}.items():
                    folder = out / f"{number}-{seed}-{kind.split()[0]}"
                    make_folder(folder)
                    row[kind] = less_than_guide(
                        places, str(made), asked.episodes, folder, executor
                    )
            found.append(row)
            write_json(out / "how_many.json", {"trainings": found})

    rows = [["buildings", "seed", "where", *FIRES]]
    for row in sorted(found, key=lambda row: (row["buildings"], row["seed"])):
        for kind in ("own", "held out"):
            lost = [f"{row[kind][fire]:.1f}" for fire in FIRES]
            rows.append([str(row["buildings"]), str(row["seed"]), kind, *lost])
    print(align_columns(rows, "<<<" + ">" * len(FIRES)))
    save(drawn(found), asked.picture or out / "buildings.png")


def until_stopped(main):
    """Run a script that goes on where it was; return the exit status.

    Ctrl-C and SIGTERM stop it alike.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)

    def run():
        try:
            main()
        except KeyboardInterrupt:
            raise KeyboardInterrupt("stopped; the same command goes on") from None

    return exit_status(run)


if __name__ == "__main__":
    sys.exit(until_stopped(main))

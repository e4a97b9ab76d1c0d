"""Learning curves: what is read from a table, how it is smoothed, what is drawn."""

import re
from dataclasses import replace

import matplotlib
import numpy as np
import pytest
import torch
from matplotlib.colors import to_hex
from pages import overlaps, writing
from trainings import TINY, tiny, trained

from reference.__main__ import main
from reference.fire import RandomFire
from reference.learning.players import LearnedNetwork
from reference.paper import InputError
from reference.simulation import Simulation
from reference.workshop.commands.training import _differences
from reference.workshop.drawing import curves
from reference.workshop.drawing.colours import colour_of
from reference.workshop.drawing.evacuation import EMBER
from reference.workshop.drawing.page import BLUE, sheet
from reference.workshop.maps import load, plan_of
from reference.workshop.storage.files import Table
from reference.workshop.storage.workers import torch_threads
from reference.workshop.strategies import ROBOTS
from reference.workshop.strategies.fires import BusiestFire
from reference.workshop.training import levels, summaries
from reference.workshop.training.checkpoints import Task
from reference.workshop.training.differing import differences
from reference.workshop.training.families import Family
from reference.workshop.training.presets import preset
from reference.workshop.training.rounds import Training

VALUE = "Losses/Value Loss"
FIGURES = summaries.SUMMARY_COLUMNS[len(summaries.WHEN_COLUMNS) :]

TOGETHER = [("together", 6)]
IMITATED = [("critic", 5), ("together", 25)]


def rows(phases, seed=0, imitation=0):
    """Rows of a table: 10 episodes a round, for (name, rounds) each."""
    first = {"side": "robots", "step": 0, "episodes": 0, "phase": "imitation"}
    rng = np.random.default_rng(seed)
    episodes = 0
    yield from [first] * imitation
    for phase, rounds in phases:
        for _ in range(rounds):
            episodes += 10
            for side in ("robots", "fire") if phase == "together" else ("robots",):
                when = {"side": side, "step": 50 * episodes, "phase": phase}
                what = {name: rng.uniform(0.1, 1) for name in FIGURES}
                yield {**when, "episodes": episodes, **what}


@pytest.fixture
def run(tmp_path):
    """A function that writes a folder with a table and reads it as a run."""

    def written(name, *args, **more):
        (tmp_path / name).mkdir()
        file = tmp_path / name / "summaries.csv"
        Table(file, summaries.SUMMARY_COLUMNS, rows(*args, **more))
        return curves.read_summaries(tmp_path / name)

    return written


def panel(figure, title):
    """The axes of a panel."""
    return next(axes for axes in figure.axes if title in axes.get_title("left"))


def bold(axes, colour):
    """The x and y of the thick lines of a colour."""
    return [
        line.get_data()
        for line in axes.lines
        if to_hex(line.get_color()) == colour and line.get_linewidth() == 2
    ]


# -- The table ----------------------------------------------------------------------


def test_a_row_that_is_still_being_written_is_left_out(run, tmp_path):
    """One can look at a training while it runs."""
    run("a", TOGETHER)
    file = tmp_path / "a" / "summaries.csv"
    file.write_text(file.read_text()[:-5])
    side = curves.read_summaries(file).columns["side"].tolist()
    assert (side.count("robots"), side.count("fire")) == (6, 5)


def test_an_empty_cell_is_no_point_of_a_curve(run):
    """Where nothing was updated there is no loss, and not a loss of zero."""
    imitated = run("a", TOGETHER, imitation=3)
    ((x, _),) = curves.curves_of([imitated], "robots", VALUE)
    assert x.tolist() == [10, 20, 30, 40, 50, 60]


def test_refuses_a_folder_without_a_table(tmp_path):
    """The message says what would do."""
    with pytest.raises(FileNotFoundError, match=r"Name the folder of a training"):
        curves.read_summaries(tmp_path)


@pytest.mark.parametrize("column", [1, 3])
def test_refuses_a_table_whose_rows_are_out_of_order(run, tmp_path, column):
    """Of episodes or of a side's steps: a running mean of them would be none."""
    run("a", TOGETHER)
    file = tmp_path / "a" / "summaries.csv"
    head, first, *others = file.read_text().splitlines()
    cells = first.split(",")
    cells[column] = "100000"
    file.write_text("\n".join([head, ",".join(cells), *others, ""]))
    told = r"summaries.csv: its rows are not in the order of episodes and steps. Put"
    with pytest.raises(InputError, match=told):
        curves.read_summaries(file)


def test_refuses_a_training_that_has_only_imitated_so_far(run):
    """Rows there are, but none with a reward."""
    with pytest.raises(ValueError, match="train for longer"):
        curves.learning_curves([run("a", [], imitation=3)])


def test_names_the_training_that_has_too_few_rows(run):
    """Beside one that has enough."""
    runs = [run("a", TOGETHER), run("b", [])]
    with pytest.raises(ValueError, match=r"^b: too few rows"):
        curves.learning_curves(runs)


# -- The lines ----------------------------------------------------------------------


def test_a_running_mean_agrees_with_the_sum_written_out():
    """At uneven distances too, against a loop over all pairs."""
    rng = np.random.default_rng(0)
    x = np.sort(rng.uniform(0, 100, 60))
    y = rng.normal(size=60)
    half = curves.SMOOTHING * x[-1] / 2
    expected = [y[near].mean() for near in np.abs(x[:, None] - x) <= half]
    np.testing.assert_allclose(curves.smooth(x, y), expected)


def test_the_mean_of_runs_is_drawn_where_all_of_them_are():
    """From 1 to 3 here, at half way between the two."""
    ramp = np.array([0.0, 3.0])
    x, y = curves.mean_curve([(ramp, ramp), (ramp + 1, ramp + 3)])
    assert (x[0], x[-1]) == (1, 3)
    np.testing.assert_allclose(y, x + 1)


# -- The page -----------------------------------------------------------------------


@pytest.mark.paper("E6")
def test_both_sides_share_the_axis_of_episodes(run):
    """In their colours, up to the same episode; rows are wider apart than a mean."""
    one = run("a", TOGETHER)
    axes = panel(curves.learning_curves([one]), "entropy of the policies")
    for side, colour in (("robots", BLUE), ("fire", EMBER)):
        ((x, y),) = bold(axes, colour)
        assert x.tolist() == [10, 20, 30, 40, 50, 60]
        rows = one.columns["side"] == side
        np.testing.assert_allclose(y, one.columns["Policy/Entropy"][rows])


def test_several_trainings_have_a_colour_and_a_name_each(run):
    """In every panel the same one; dashes tell sides apart, what differs is said."""
    runs = [run(f"run {seed}", TOGETHER, seed) for seed in range(3)]
    figure = curves.learning_curves(runs, "head: floor, mixture, set")
    axes = panel(figure, "entropy of the policies")
    colours = [to_hex(line.get_color()) for line in axes.lines]
    assert colours[:3] == colours[3:] and len({*colours}) == 3
    assert [line.get_linestyle() for line in axes.lines] == 3 * ["-"] + 3 * ["-."]
    legend = figure.legends[0]
    entries = zip(legend.get_texts(), legend.legend_handles, strict=True)
    named = {text.get_text().split(":")[0]: handle for text, handle in entries}
    for colour, one in zip(colours, runs, strict=False):
        assert to_hex(named[one.name].get_facecolor()) == colour
    assert "head: floor, mixture, set" in legend.get_title().get_text()
    assert "robots" in named and "people" not in named  # a line as that of robots


def test_where_one_side_learns_nothing_is_said_of_the_other(run):
    """Nor of running means, where rows are wider apart than one."""
    said = writing(curves.learning_curves([run("a", [("robots", 6)])]))
    assert {"episodes played", "decisions of the robots"} <= {*said}
    assert not any("bold" in words or "sides" in words for words in said)
    long = writing(curves.learning_curves([run("b", [("robots", 200)])]))
    assert any("bold: running means over 5%" in words for words in long)


@pytest.mark.parametrize("count", [1, 2])
def test_the_dashed_baseline_is_dashed_in_all_its_lines(run, count):
    """Faint or bold, of one training or of two."""
    runs = [run(str(seed), TOGETHER, seed) for seed in range(count)]
    axes = panel(curves.learning_curves(runs), "losses of the critics")
    styles = [line.get_linestyle() for line in axes.lines]
    assert styles.count("--") == 2
    assert styles.count("-") == 2


def test_several_trainings_name_their_decisions_and_share_no_axis_of_them(run):
    """2 × 50 an episode in one, 50 in the other: no axis would be right for both."""
    runs = [run("a", TOGETHER), run("b", [("robots", 4)])]
    figure = curves.learning_curves(runs)
    assert all(not axes.child_axes for axes in figure.axes)
    assert {"a: 6,000 decisions", "b: 2,000 decisions"} <= {*writing(figure)}


MEANS = {summaries.GROUP_REWARD: 0.3, summaries.SURVIVAL: 0.4}
LEVELS = summaries.Levels(
    "means of 20", {"none": MEANS, "escort": {name: 0.8 for name in MEANS}}
)


@pytest.mark.parametrize("count", [1, 2])
def test_level_lines_of_guides_are_drawn_where_their_figures_are(run, count):
    """Reward and survivors; in the colours that evaluations give them, with words."""
    runs = [run(str(seed), TOGETHER, seed) for seed in range(count)]
    figure = curves.learning_curves(runs, levels=LEVELS)
    own = {colour_of(name): means for name, means in LEVELS.means.items()}
    assert len(own) == 2
    panels = {"reward of an episode": summaries.GROUP_REWARD}
    panels[curves.SURVIVORS] = summaries.SURVIVAL
    for axes in figure.axes:
        found = {
            to_hex(line.get_color()): line.get_ydata()
            for line in axes.lines
            if to_hex(line.get_color()) in own
        }
        title = axes.get_title("left")
        column = [of for name, of in panels.items() if name in title]
        expected = {c: [own[c][name]] * 2 for c in own for name in column}
        assert {c: list(y) for c, y in found.items()} == expected
    said = writing(figure)
    assert {"none: 40% survive", "escort: 80% survive"} <= {*said}
    assert any("none, escort: means of 20" in words for words in said)
    assert overlaps(figure) == []


def test_decisions_stand_above_as_a_training_counts_them(run):
    """Those of both sides together, 2 × 50 in each episode here."""
    figure = curves.learning_curves([run("a", TOGETHER)])
    figure.draw_without_rendering()
    axes = panel(figure, "reward of an episode")
    (above,) = axes.child_axes
    assert above.get_xlabel() == "decisions of all sides"
    across = axes.transData.transform([(60.0, 0)])[0, 0]
    assert above.transData.transform([(6000.0, 0)])[0, 0] == pytest.approx(
        across, abs=1
    )


def test_long_noisy_lines_are_painted_in_pieces():
    """As a whole one of a long training takes ten seconds, and there are a dozen."""
    assert 0 < matplotlib.rcParams["agg.path.chunksize"] <= 10_000


@pytest.mark.parametrize(("phases", "count"), [(IMITATED, 1), (TOGETHER, 3)])
def test_nothing_overlaps_and_nothing_is_clipped(run, phases, count):
    """Of one training or of several, one can read all words on the page."""
    runs = [run(str(k), phases, k, imitation=3 * (k % 2)) for k in range(count)]
    about = "; ".join(f"robots.setting_{k}: 1.25, 2.75" for k in range(6))
    assert overlaps(curves.learning_curves(runs, about)) == []
    assert overlaps(curves.curves_of_arms({"a": runs, "b": runs[:1]})) == []
    assert "the trainings are too short for curves" in writing(
        curves.curves_of_arms({})
    )


def test_an_arm_whose_trainings_do_not_overlap_has_no_line(run):
    """The first ends before the second begins: there is no mean of both."""
    one, other = (run(name, TOGETHER) for name in "ab")
    later = other.columns | {"step": other.columns["step"] + 1e6}
    apart = [one, other._replace(columns=later)]
    figure = curves.curves_of_arms({"apart": apart, "whole": [one]})
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["whole"]


def test_a_side_that_does_not_learn_is_neither_drawn_nor_in_the_legend(run):
    """A scripted fire has no entropy and no losses."""
    figure = curves.learning_curves([run("a", [("robots", 6)])])
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["robots", "people", "robots' baseline"]


# -- What differs -------------------------------------------------------------------


def test_what_differs_between_trainings_is_said_in_a_line():
    """In the order of the trainings; what is equal is left out, many are counted."""
    one = Task("tiny", "", preset("tiny"))
    robots = one.settings.robots
    other = replace(one.settings, robots=replace(robots, head="set"))
    assert differences({"a": one, "b": one}) == ""
    told = differences({"a": one, "b": replace(one, seed=3, settings=other)})
    assert told == f"seed: 0 | 3; robots.head: {robots.head} | set"
    fixed = replace(one, building="paper", fixed={"fire": ("random",)})
    assert (
        differences({"a": one, "b": fixed})
        == "building: tiny | paper; fire: learns | random"
    )
    both = replace(one, fixed={"fire": ("random", "fixed")})
    assert differences({"a": both, "b": fixed}).endswith("fire: random, fixed | random")
    later = replace(one, initial={"robots": network(3)})
    assert re.fullmatch(
        r"begins with: random weights \| network [0-9a-f]{6}",
        differences({"a": one, "b": later}),
    )
    against = {k: replace(one, fixed={"fire": (network(k),)}) for k in (1, 2)}
    assert re.fullmatch(
        r"fire: network [0-9a-f]{6} \| network [0-9a-f]{6}", differences(against)
    )
    laptop = replace(one, settings=preset("laptop"))
    assert re.search(r"; and \d+ more$", differences({"a": one, "b": laptop}))


# -- Levels -------------------------------------------------------------------------


def network(weight):
    """A fire that does not learn; its weights tell it from another."""
    weights = {"weight": torch.full((3,), float(weight))}
    return LearnedNetwork(preset("tiny").fire, weights)


def task_with(fires=None, plan=TINY, **changes):
    """A training's task in the small office; fires, if it does not learn."""
    settings = tiny()
    scenario = replace(settings.scenario, **changes)
    fixed = {} if fires is None else {"fire": fires}
    return Task("tiny", plan, replace(settings, scenario=scenario), fixed=fixed)


def test_levels_are_means_of_the_trainings_own_evacuations(monkeypatch):
    """As the book plays them, all fires in turn, by the rule of training [D6]."""
    monkeypatch.setattr(levels, "EVACUATIONS", 4)
    task = task_with(("random", "busiest"))
    measured = levels.levels_of(task)
    assert measured.about.startswith("means of 4 evacuations each")
    assert measured.about.endswith("fire random, busiest")
    assert [*measured.means] == ["none", "escort"]
    for name, means in measured.means.items():
        ended = []
        for seed in range(4):
            fire = (RandomFire(), BusiestFire())[seed % 2]
            scenario = task.settings.scenario
            assert scenario.training
            run = Simulation(load("tiny"), scenario, ROBOTS[name](), fire, seed)
            ended.append(run.run())
        reward = np.mean([outcome.reward for outcome in ended])
        share = np.mean([outcome.evacuated / outcome.people for outcome in ended])
        assert means[summaries.GROUP_REWARD] == pytest.approx(reward)
        assert means[summaries.SURVIVAL] == pytest.approx(share)


def test_where_no_robots_stand_only_nobody_is_a_level(monkeypatch):
    """A fire that learns meets the random one in its place."""
    monkeypatch.setattr(levels, "EVACUATIONS", 2)
    measured = levels.levels_of(task_with(robots_per_floor=0))
    assert [*measured.means] == ["none"]
    assert measured.about.endswith("of the same task, but with fire random")


def test_several_maps_meet_all_fires(monkeypatch):
    """No map meets one fire alone; networks have one thread, as everywhere."""
    monkeypatch.setattr(levels, "EVACUATIONS", 8)
    played = []

    def noted(job, advance):
        assert torch.get_num_threads() == 1
        played.append(job)
        return []

    monkeypatch.setattr(levels, "play", noted)
    maps = Family(names=("tiny", "museum"), plans=(TINY, plan_of(load("museum"))))
    task = replace(task_with(("random", "none")), family=maps)
    with torch_threads(2):
        levels._episodes(task, "none")
    met = {(job.plan, type(job.fire)) for job in played}
    assert len(met) == 4 and len(played) == 8


@pytest.mark.parametrize(
    ("tasks", "why"),
    [
        ([task_with(), replace(task_with(), seed=3)], ""),
        ([task_with(), task_with(("random",))], ""),
        ([task_with(), task_with(("busiest",))], "they differ"),
        ([task_with((network(1),)), task_with((network(1),))], ""),
        ([task_with((network(1),)), task_with((network(2),))], "they differ"),
        ([task_with(), task_with(people=5)], "they differ"),
        ([task_with(), task_with(plan=plan_of(load("museum")))], "they differ"),
        ([replace(task_with(), family=Family())], "by lot"),
    ],
)
def test_there_are_no_levels_where_tasks_differ(tasks, why):
    """Neither where buildings are drawn by lot; seeds may differ."""
    said = levels.why_no_levels(tasks)
    assert (why in said) if why else said == ""


def test_there_are_no_levels_without_the_engine(monkeypatch):
    """The book would take a minute for them."""
    monkeypatch.setattr(levels, "engine_is_ready", lambda: False)
    assert "engine" in levels.why_no_levels([task_with()])


@pytest.mark.parametrize("number", [0, 7])
def test_other_families_are_other_buildings(number, capsys):
    """Neither of them has a single map that could be compared."""
    tasks = {
        name: replace(task_with(plan=""), family=Family(number=count))
        for name, count in {"a": 0, "b": number}.items()
    }
    _differences(tasks)
    said = "Their buildings differ" in capsys.readouterr().err
    assert said == bool(number)


def test_the_command_draws_levels_or_says_why_not(tmp_path, monkeypatch, capsys):
    """From the checkpoints beside the tables, of one training or of two."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(levels, "EVACUATIONS", 2)
    for name, task in {"a": task_with(), "b": task_with(people=5)}.items():
        trained(Training(task), tmp_path / name, rounds=0)
        file = tmp_path / name / "summaries.csv"
        Table(file, summaries.SUMMARY_COLUMNS, rows(TOGETHER))
    drawn = []

    def caught(runs, about, measured):
        drawn.append(measured)
        return sheet("caught", 3, 2)

    monkeypatch.setattr(curves, "learning_curves", caught)
    assert main(["curves", "a"]) == 0
    assert main(["curves", "a", "b"]) == 0
    assert main(["curves", "a/summaries.csv"]) == 0
    said = capsys.readouterr().err
    assert [*drawn[0].means] == ["none", "escort"] and drawn[1] is None
    assert drawn.pop() == drawn[0]
    assert "No lines of none and escort to compare with: they differ in" in said
    assert "Their buildings differ" not in said
    (damaged,) = (tmp_path / "a").glob("checkpoint-*")
    damaged.write_bytes(b"no checkpoint")
    assert main(["curves", "a"]) == 0
    assert drawn[2] is None
    assert "Only tables are drawn" in capsys.readouterr().err
    damaged.unlink()
    assert main(["curves", "a"]) == 0
    assert "there is no checkpoint of a" in capsys.readouterr().err

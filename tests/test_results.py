"""What README and RESULTS say of the contest is what the kept table says.

`tutorials/tables/contest.json` is the `cells.json` of the command in RESULTS, section
"A contest that can be answered". Whoever makes it anew is told here which lines of text
no longer hold.
"""

import json
import re
from csv import DictReader
from functools import partial
from itertools import product

import numpy as np
import pytest
from conftest import ROOT

from reference.workshop.comparing.intervals import (
    Interval,
    format_interval,
    interval_of_mean,
    interval_over_trainings,
)

CELLS = {
    (cell["robots"], cell["fire"]): cell
    for cell in json.loads(
        (ROOT / "tutorials" / "tables" / "contest.json").read_text(encoding="utf-8")
    )["cells"]
}
GUIDES = ("none", "sweep", "escort", "observer", "guard", "learned")
FIRES = ("none", "random", "greedy", "closer", "busiest", "fixed", "learned")
SCORED = ("none", "busiest")
RULERS = {"the paper's ruler": "score", "`escort`'s own": "score_on_baseline"}
SCRIPTED = ("random", "greedy", "closer", "busiest", "fixed")
README = (ROOT / "README.md").read_text(encoding="utf-8")
RESULTS = (ROOT / "RESULTS.md").read_text(encoding="utf-8")


def figure(robots: str, fire: str, name: str = "survival", end: str = "mean") -> float:
    """A figure of a cell: of survival and gain in per cent."""
    share = name in ("survival", "gain")
    return CELLS[robots, fire][name][end] * (100 if share else 1)


def signed(number: float) -> str:
    """With one decimal and a true minus sign, as it is printed."""
    return f"{number:.1f}".replace("-", "−")


def gain(robots: str, fire: str) -> str:
    """Points more than `escort`, with the interval, as it is printed."""
    mean, low, high = (
        signed(figure(robots, fire, "gain", end)) for end in ("mean", "low", "high")
    )
    return f"{mean} [{low}, {high}]"


def row(first: str, cells: list[str]) -> str:
    """A line of a table in Markdown."""
    return f"| {first} | {' | '.join(cells)} |"


def lines_of_readme() -> list[str]:
    """Survivors in whole per cent."""
    return [
        row(f"`{who}`", [f"{figure(who, fire):.0f}" for fire in FIRES])
        for who in GUIDES
    ]


def lines_of_results() -> list[str]:
    """Survivors with R; how hard the fires of `escort` were; differences from it."""
    survivors = [
        row(
            f"`{who}`",
            [
                f"{figure(who, fire):.1f} ({figure(who, fire, 'reward'):,.0f})".replace(
                    "-", "−"
                )
                for fire in FIRES
            ],
        )
        for who in GUIDES
    ]
    h = row("h", [f"{figure('escort', fire, 'difficulty'):,.0f}" for fire in FIRES])
    differences = [
        row(f"`{who}`", [gain(who, fire) for fire in FIRES])
        for who in GUIDES
        if who != "escort"
    ]
    return [*survivors, h, *differences]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        *product(["README"], lines_of_readme()),
        *product(["RESULTS"], lines_of_results()),
    ],
)
def test_a_row_of_a_table_is_that_of_the_kept_table(text, line):
    """Figure by figure, in README rounded to whole per cent."""
    assert line in {"README": README, "RESULTS": RESULTS}[text].splitlines()


def lines_of_scores() -> list[str]:
    """How high `escort` scores on both rulers."""
    return [
        row(who, [f"{CELLS['escort', fire][name]['mean']:.2f}" for fire in SCORED])
        for who, name in RULERS.items()
    ]


def findings() -> list[str]:
    """Cells of the findings that rest on the contest."""
    least = min(SCRIPTED, key=lambda fire: -figure("none", fire, "gain"))
    low, high = (-figure("none", least, "gain", end) for end in ("high", "low"))
    worth = -figure("none", least, "gain")
    lost = min(SCRIPTED, key=lambda fire: figure("learned", fire, "gain"))
    worst = gain("learned", lost).replace(" [", " | [")
    knows = gain("guard", "fixed").replace(" [", " | [")
    return [
        f"under every scripted fire | {worth:.1f} | [{low:.1f}, {high:.1f}] |",
        f"who knows `fixed` saves 10 points more | {knows} |",
        f"than `escort` under each hard fire | {worst} |",
        f"fewer than {figure('escort', 'busiest'):.1f} % survive | "
        f"{figure('escort', 'learned'):.1f} |",
    ]


def words(text: str) -> str:
    """A text on one line, so that its lines may break anywhere."""
    return " ".join(text.split())


def claim_from_nothing() -> str:
    """What robots saved in the end that learned from nothing, beside `escort`."""
    kept = ROOT / "tutorials" / "tables" / "from_nothing.json"
    cells = json.loads(kept.read_text(encoding="utf-8"))["cells"]
    last = {cell["fire"]: cell["gain"] for cell in cells[-5:]}
    assert last["busiest"]["low"] < 0 < last["busiest"]["high"]
    fixed = 100 * last["fixed"]["mean"]
    closer = -100 * last["closer"]["mean"]
    return (
        f"save about as many as `escort` under `busiest`, {fixed:.1f} points more "
        f"under `fixed`, and {closer:.1f} fewer under `closer`, which they never met."
    )


def claims() -> list[tuple[str, str]]:
    """Sentences and rows with figures of the contest, as the kept table has them."""
    guidance = [-figure("none", fire, "gain") for fire in SCRIPTED]
    by_hand = [who for who in GUIDES if who != "learned"]
    hardest = min(max(figure(who, fire) for who in by_hand) for fire in SCRIPTED)
    harm = figure("escort", "fixed") - figure("escort", "busiest")
    guarding = figure("guard", "fixed", "gain")
    return [
        (
            "README",
            f"under `fixed` it saves {guarding:.1f} points more than `escort`.",
        ),
        (
            "README",
            f"The first saves {figure('learned', 'fixed', 'gain'):.1f} points more "
            "than `escort` under `fixed`, as many under `busiest`, as far as can be "
            f"told, and {-figure('learned', 'closer', 'gain'):.1f} fewer under "
            "`closer`.",
        ),
        ("README", claim_from_nothing()),
        ("RESULTS", f"hardest scripted fire | {hardest:.1f} (`escort`, `busiest`) |"),
        (
            "RESULTS",
            "20 points under every fire | "
            f"{min(guidance):.1f} to {max(guidance):.1f} |",
        ),
        ("RESULTS", f"to the best guide than `fixed` | {harm:.1f} |"),
        ("RESULTS", f"10 points against `fixed` | {gain('guard', 'fixed')} |"),
        ("RESULTS", f"95 % without fire | {figure('sweep', 'none'):.1f} |"),
        (
            "RESULTS",
            f"survivors without guides | {figure('none', 'learned'):.1f} |",
        ),
        *[("RESULTS", line) for line in lines_of_scores()],
        *[("RESULTS", line) for line in findings()],
    ]


def test_what_can_not_be_told_is_said_to_be_so():
    """README says so of the copy that ships, under `busiest`."""
    low = figure("learned", "busiest", "gain", "low")
    assert low < 0 < figure("learned", "busiest", "gain", "high")


@pytest.mark.parametrize(("text", "claim"), claims())
def test_a_sentence_says_what_the_kept_table_says(text, claim):
    """Whoever measures anew is told which sentences to write anew."""
    assert claim in words({"README": README, "RESULTS": RESULTS}[text])


def lines_of_buildings() -> list[str]:
    """What trainings in few and many buildings lack to `escort`, as it is printed.

    Both trainings of each number, in the order of their seeds.
    """
    kept = ROOT / "tutorials" / "tables" / "how_many_buildings.json"
    made = json.loads(kept.read_text(encoding="utf-8"))["trainings"]
    rows = []
    for number in sorted({each["buildings"] for each in made}):
        both = [each for each in made if each["buildings"] == number]
        columns = product(("own", "held out"), ("none", "random", "busiest"))
        cells = [
            ", ".join(signed(each[kind][fire]) for each in both)
            for kind, fire in columns
        ]
        rows.append(row(f"{number:,}", cells))
    return rows


TENTHS = {
    (cell["robots"], cell["fire"]): cell
    for cell in json.loads(
        (ROOT / "tutorials" / "tables" / "tenths.json").read_text(encoding="utf-8")
    )["cells"]
}
"""Preset `paper` by tenths, as `tenths.py` has written them."""


def lines_of_tenths() -> list[str]:
    """Survivors of each age; then reward, difficulty and score under its own fire."""
    rows = []
    for robots in dict.fromkeys(who for who, _ in TENTHS):
        fires = ["none", "random", "busiest", "fixed", "of its age"]
        met = [TENTHS[robots, fire] for fire in fires if (robots, fire) in TENTHS]
        cells = [f"{100 * cell['survival']['mean']:.1f}" for cell in met]
        if (robots, "of its age") in TENTHS:
            own = met[-1]
            cells.append(f"{own['reward']['mean']:,.0f}".replace("-", "−"))
            cells.append(f"{own['difficulty']['mean']:,.0f}")
            cells.append(f"{own['score']['mean']:.3f}" if own["score"] else "")
        else:
            cells += [""] * 4
        rows.append(row(f"`{robots}`" if robots.isalpha() else robots, cells))
    return rows


def test_what_the_paper_s_training_saves_at_its_end_is_told_as_kept():
    """How many more survive than with nobody."""
    end = TENTHS["100%", "busiest"]["gain"]
    mean, low, high = (signed(100 * end[name]) for name in ("mean", "low", "high"))
    assert f"| {mean} | [{low}, {high}] |" in RESULTS


LEAGUE = json.loads(
    (ROOT / "tutorials" / "tables" / "league.json").read_text(encoding="utf-8")
)
"""What `experiment league.toml --json` has printed."""

LEAGUE_FIRES = (*FIRES, "worst-case", "adversary's fires")


def lines_of_league() -> list[str]:
    """Survivors of each arm, and how many more the first of a pair saves."""
    survivors = {
        (cell["robots"], cell["fire"]): 100 * cell["survival"]["mean"]
        for cell in LEAGUE["cells"]
    }
    rows = [
        row(f"`{who}`", [f"{survivors[who, fire]:.1f}" for fire in LEAGUE_FIRES])
        for who in dict.fromkeys(robots for robots, _ in survivors)
    ]
    told = r"`(\w+)` less `(\w+)` under (.+?): (\S+ \[.+?\]):"
    pairs: dict[tuple[str, str], dict[str, str]] = {}
    for one, other, fire, points in re.findall(told, LEAGUE["answer"]):
        pairs.setdefault((one, other), {})[fire] = points.replace("-", "−")
    rows += [
        row(f"`{one}` − `{other}`", [points[fire] for fire in LEAGUE_FIRES])
        for (one, other), points in pairs.items()
    ]
    return rows


def lines_of_best_responses() -> list[str]:
    """Survivors of each arm from fires that learned against it; two arms compared."""
    kept = ROOT / "tutorials" / "tables" / "best_responses.json"
    survivors = {
        arm: np.array(shares)
        for arm, shares in json.loads(kept.read_text(encoding="utf-8")).items()
    }
    rows = []
    for arm, shares in survivors.items():
        less = ""
        if arm != "escort":
            less = over_trainings(shares, survivors["escort"])
        rows.append(row(f"`{arm}`", [over_trainings(shares), less]))
    pairs = [("adversary", "scripted"), ("scripted", "scripted_ppo")]
    rows += [
        row(f"`{one}` − `{other}`", [over_trainings(survivors[one], survivors[other])])
        for one, other in pairs
    ]
    return [line.replace("|  |", "| |") for line in rows]


def over_trainings(*shares: np.ndarray) -> str:
    """An interval over trainings, as it is printed."""
    found = interval_over_trainings(*shares)
    return format_interval(found, 1, ends=True).replace("-", "−")


WORTH = [
    {name: cells[name] for name in ("base", "fire", "time", "gain")}
    | {"believed": float(cells["believed"]) > 2 * float(cells["believed_error"])}
    for cells in DictReader(
        (ROOT / "tutorials" / "tables" / "worth_of_decisions.csv")
        .read_text(encoding="utf-8")
        .splitlines()
    )
]
"""Decisions drawn by lot, as `what_a_decision_is_worth.py` has measured them."""


def lines_of_by_age() -> list[str]:
    """What both sides of a league learned, from its first tenth and its middle on."""
    kept = ROOT / "tutorials" / "tables" / "by_age.json"
    learned = json.loads(kept.read_text(encoding="utf-8"))["learned"]
    return [
        row(what, [against, points.replace("-", "−")])
        for what, against, points in learned
    ]


def lines_of_from_nothing(name: str) -> list[str]:
    """Survivors after so many decisions, and of guides; at last less `escort`.

    Of the second training without guides: they are those of the first table.
    """
    kept = ROOT / "tutorials" / "tables" / f"{name}.json"
    cells = json.loads(kept.read_text(encoding="utf-8"))["cells"]
    met: dict[str, list[dict]] = {}
    for cell in cells:
        met.setdefault(cell["robots"], []).append(cell)
    rows = []
    for robots, under in met.items():
        if robots.isalpha() and name.endswith("again"):
            continue
        who = f"`{robots}`" if robots.isalpha() else robots
        rows.append(
            row(who, [f"{100 * cell['survival']['mean']:.1f}" for cell in under])
        )
    *_, last = (who for who in met if not who.isalpha())
    less = []
    for cell in met[last]:
        mean, low, high = (
            signed(100 * cell["gain"][end]) for end in ("mean", "low", "high")
        )
        less.append(f"{mean} [{low}, {high}]")
    return [*rows, row(f"{last} less `escort`", less)]


def lines_of_worth() -> list[str]:
    """All, those of the first 50 s, and those in whose better choice was believed."""
    rows = []
    for base, fire in product(("observer", "learned"), WORTH_FIRES):
        part = [one for one in WORTH if (one["base"], one["fire"]) == (base, fire)]
        early = [one for one in part if float(one["time"]) < 50]
        believed = [one for one in part if one["believed"]]
        cells = [f"`{fire}`" if fire != "random" else "random fire"]
        for some in (part, early, believed):
            mean, low, high = interval_of_mean([float(one["gain"]) for one in some])
            ends = f"[{two_decimals(low)}, {two_decimals(high)}]"
            cells += [str(len(some)), f"{two_decimals(mean)} {ends}"]
        rows.append(row(f"`{base}`", cells))
    return rows


WORTH_FIRES = ("random", "closer", "busiest", "fixed", "learned")


def lines_of_search() -> list[str]:
    """Whole evacuations of robots that search: survivors, and points more."""
    kept = ROOT / "tutorials" / "tables" / "search.csv"
    played = list(DictReader(kept.read_text(encoding="utf-8").splitlines()))
    rows = []
    for fire in ("closer", "busiest"):
        part = [one for one in played if one["fire"] == fire]
        own, searching = (
            np.array([100 * int(one[who]) / int(one["people"]) for one in part])
            for who in ("own", "searching")
        )
        chosen = np.mean([int(one["chosen"]) for one in part])
        cells = [f"{own.mean():.1f}", f"{searching.mean():.1f}"]
        more = with_interval(searching - own)
        rows.append(row(f"`{fire}`", [str(len(part)), *cells, more, f"{chosen:.1f}"]))
    return rows


def two_decimals(number: float) -> str:
    """With a true minus sign, and none at 0."""
    return f"{number:.2f}".replace("-0.00", "0.00").replace("-", "−")


LADDER = json.loads((ROOT / "tutorials/tables/ladder.json").read_text("utf-8"))
RUNGS = {
    "recipe": "the recipe",
    "gamma": "γ 0.9",
    "learning_rate": "learning rate 1e-4",
    "buffer": "buffer 20,480, batch 1,024",
    "network": "3 layers of 256",
    "beta": "β 0.005, constant",
    "spread_1": "σ 1 m instead of 0.4",
    "spread_2": "σ 2 m",
    "spread_3": "σ 3 m",
    "no_commitment": "no commitment",
    "no_masks": "no masks",
    "floor": "one Gaussian of the whole floor",
    "printed": "all as printed",
    "untrained": "nothing learned (rate 1e-12)",
    "none": "nobody",
}


@pytest.mark.parametrize("arm", RUNGS)
def test_a_rung_of_the_ladder_is_told_as_kept(arm):
    """Survivors, and how many less than by the recipe, under both fires."""
    cells = []
    for fire in ("none", "random"):
        (share,) = (
            cell["survival"]["mean"]
            for cell in LADDER["cells"]
            if (cell["robots"], cell["fire"]) == (arm, fire)
        )
        pair = re.escape(f"`{arm}` less `recipe` under {fire}: ")
        less = re.search(rf"{pair}(\S+ \[\S+, \S+\])", LADDER["answer"])
        cells += [f"{100 * share:.1f}", less[1].replace("-", "−") if less else ""]
    begins = row(RUNGS[arm], cells).replace("|  |", "| |")
    assert any(line.startswith(begins) for line in RESULTS.splitlines()), begins


def lines_of_any_map(name: str) -> list[str]:
    """Means over buildings, what `learned` lacks, and its share of what is gained."""
    kept = ROOT / "tutorials" / "tables" / f"{name}.json"
    buildings = json.loads(kept.read_text("utf-8"))
    held_out = np.array([name.isdigit() for name in buildings])  # they are generated
    saved = {
        (who, fire): np.array([means[f"{who} {fire}"] for means in buildings.values()])
        for who, fire in product(("none", *GUIDES_ANYWHERE), ("none", *FIRES_ANYWHERE))
    }
    fires = ("none", *FIRES_ANYWHERE)
    lines = []
    for who in ("none", *GUIDES_ANYWHERE):
        words = {"none": "nobody", "learned": "`learned`, any map"}.get(who, f"`{who}`")
        lines.append(row(words, [f"{saved[who, fire].mean():.1f}" for fire in fires]))

    less = []
    less_held_out = []
    shares = []
    for fire in fires:
        lacks = saved["learned", fire] - saved["escort", fire]
        less.append(with_interval(lacks))
        less_held_out.append(with_interval(lacks[held_out]))
        gain_there = saved["escort", fire] - saved["none", fire]
        worth = gain_there >= 8
        own = saved["learned", fire] - saved["none", fire]
        share = 100 * own[worth].sum() / gain_there[worth].sum()
        shares.append(f"{share:.0f} % in {worth.sum()}")
    shares[0] += " buildings"
    lines.append(row("less `escort`", less))
    lines.append(row("the same, in the 30 that are held out", less_held_out))
    lines.append(row("share of its gain where it gains 8 points", shares))
    return lines


def lines_of_copies() -> list[str]:
    """Points less than `guard` under five fires, and how often a copy agrees."""
    kept = ROOT / "tutorials" / "tables" / "to_copy.json"
    cells = json.loads(kept.read_text(encoding="utf-8"))["cells"]
    of_copy: dict[tuple[int, int], list[dict]] = {}
    for cell in cells:
        of_copy.setdefault((cell["evacuations"], cell["units"]), []).append(cell)
    rows = []
    for (evacuations, units), under in sorted(of_copy.items()):
        less = []
        for cell in under:
            gain = Interval(**{end: 100 * x for end, x in cell["gain"].items()})
            less.append(format_interval(gain, 1, ends=True).replace("-", "−"))
        agree = np.mean([cell["agreement"] for cell in under])
        rows.append(row(f"{evacuations:,}", [str(units), *less, f"{agree:.1f}"]))
    return rows


def with_interval(values: np.ndarray) -> str:
    """A mean with its interval, as it is printed."""
    mean, low, high = map(signed, interval_of_mean(values))
    return f"{mean} [{low}, {high}]"


GUIDES_ANYWHERE = ("sweep", "escort", "learned")
FIRES_ANYWHERE = ("random", "busiest")


@pytest.mark.parametrize(
    ("lines_of", "count"),
    [
        (lines_of_buildings, 4),
        (lines_of_tenths, 14),
        (lines_of_league, 15),
        (lines_of_best_responses, 8),
        (lines_of_by_age, 6),
        (partial(lines_of_from_nothing, "from_nothing"), 13),
        (partial(lines_of_from_nothing, "from_nothing_again"), 8),
        (lines_of_copies, 6),
        (lines_of_worth, 10),
        (lines_of_search, 2),
        (partial(lines_of_any_map, "any_map"), 7),
        (partial(lines_of_any_map, "any_map_many_robots"), 7),
    ],
    ids=[
        "buildings",
        "tenths",
        "league",
        "best responses",
        "by age",
        "from nothing",
        "from nothing again",
        "copies",
        "worth",
        "search",
        "any map",
        "with many robots",
    ],
)
def test_what_was_measured_is_told_as_kept(lines_of, count):
    """Line by line, and none is missing."""
    lines = lines_of()
    assert len(lines) == count
    assert {*lines} < {*RESULTS.splitlines()}


# -- All of RESULTS: what its words say stands in a table ----------------------------

SECTIONS = dict(
    part.split("\n", 1) for part in re.split(r"^## ", RESULTS, flags=re.MULTILINE)[1:]
)


def tables_of(section: str) -> str:
    """Its lines that belong to tables."""
    return "\n".join(line for line in section.splitlines() if line.startswith("|"))


def told_in(section: str) -> str:
    """Its other lines."""
    return "\n".join(line for line in section.splitlines() if line[:1] != "|")


@pytest.mark.parametrize("name", SECTIONS)
def test_a_figure_in_words_stands_in_a_table_of_its_section(name):
    """Of figures with a decimal; a library's version is none."""
    told = re.sub(r"\d+\.\d+\.\d+", "", told_in(SECTIONS[name]))
    tables = re.findall(r"\d[\d,]*\.\d+", tables_of(SECTIONS[name]))
    assert {*re.findall(r"\d[\d,]*\.\d+", told)} <= {*tables}


@pytest.mark.parametrize("name", SECTIONS)
def test_no_interval_stands_in_a_sentence(name):
    """They belong to tables."""
    assert not re.findall(r"\[−?\d", told_in(SECTIONS[name]))


def lines_of_findings() -> list[list[str]]:
    """Cells of the table at the head."""
    head = RESULTS.split("\n## ", 1)[0]
    rows = [line for line in head.splitlines() if re.match(r"\| \d", line)]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in rows]


@pytest.mark.parametrize("cells", lines_of_findings(), ids=lambda cells: cells[0])
def test_a_finding_stands_in_the_section_that_it_names(cells):
    """Figure and interval, in its tables; signs may be turned."""
    _, _, figure_told, interval, _, link = cells
    name, place = re.fullmatch(r"\[(.+)\]\(#(.+)\)", link).groups()
    (title,) = [title for title in SECTIONS if title.startswith(name)]
    assert re.sub(r"[^a-z ]", "", title.lower()).replace(" ", "-") == place
    known = re.findall(r"[\d.]+", tables_of(SECTIONS[title]))
    assert {*re.findall(r"[\d.]+", figure_told + interval)} <= {*known}


def test_the_contest_is_right():
    """What had to hold, said before looking."""
    best = max(figure(who, "busiest") for who in GUIDES if who != "learned")
    assert 55 <= best <= 75
    assert all(-figure("none", fire, "gain") >= 20 for fire in SCRIPTED)
    assert figure("escort", "fixed") - figure("escort", "busiest") >= 8
    assert figure("guard", "fixed", "gain") >= 10
    assert figure("sweep", "none") >= 95

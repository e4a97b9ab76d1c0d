"""Commands that check the ruler's parts: agree and gap.

Clauses: F4, F11.  Both measure, print and draw; neither changes a score.
"""

import json
import sys
from argparse import Namespace
from collections.abc import Callable, Sequence
from typing import Any

from reference.building import plan_of
from reference.paper import InputError, Scenario
from reference.workshop.commands import options
from reference.workshop.commands.common import (
    Command,
    counted,
    workforce,
    writable,
)
from reference.workshop.evaluation import agreement as agreements
from reference.workshop.evaluation import gap as gaps
from reference.workshop.evaluation.contestants import WORST
from reference.workshop.evaluation.crossplay import Asked, as_plain, begin
from reference.workshop.evaluation.intervals import Interval
from reference.workshop.maps import load
from reference.workshop.workers import Given, Made, in_order

MOMENTS = 40
CHOOSERS = ("random", "greedy", WORST)


# -- agree --------------------------------------------------------------------------


def agree(arguments: Namespace) -> None:
    """Correlates a fire's difficulty h with the reward it costs unguided people."""
    _refuse_output(arguments)
    plan, seed = plan_of(load(arguments.building)), arguments.seed or 0
    fires = agreements.fires_to_measure(plan, Scenario(), arguments.fires, seed)
    measured = _done(agreements.measure, fires, arguments, "fire")
    found = agreements.agreement(measured)
    facts = {
        "building": arguments.building,
        "fires": len(found.fires),
        "spearman": found.spearman,
        "pearson": found.pearson,
        "spearman_within_sources": found.within,
    }
    if arguments.output:
        from reference.workshop import drawing
        from reference.workshop.drawing.agreement import figure

        drawing.save(figure(found), arguments.output)
    _tell(facts, arguments, "h and the reward that unguided people lose to it")


# -- gap ----------------------------------------------------------------------------


def gap(arguments: Namespace) -> None:
    """Plays the places that several fires choose to the end, with the same seeds."""
    _refuse_output(arguments)
    fires = tuple(dict.fromkeys([*CHOOSERS, *(arguments.fire or ())]))
    asked = Asked(
        (arguments.robots,), fires, arguments.building, arguments.people, arguments.seed
    )
    arena = begin(asked).arena
    first = arguments.seed or 0
    seeds = range(first, first + arguments.moments)
    comparisons = gaps.comparisons(
        arena.plan, arena.scenario, arguments.robots, fires, seeds
    )
    found = _done(gaps.rescore, list(comparisons), arguments, "moment")
    results = [result for result in found if result is not None]
    if not results:
        raise InputError("No evacuation lasts until the first fire. Take more people.")
    facts = _facts(arguments, fires, results)
    if arguments.output:
        from reference.workshop import drawing
        from reference.workshop.drawing.attack import figure

        drawing.save(figure(results), arguments.output)
    _tell(facts, arguments, "what one more fire costs, by who chose its place")


def _facts(
    arguments: Namespace, fires: Sequence[str], results: Sequence[gaps.Result]
) -> dict[str, Any]:
    """Harm of every chooser, and how each differs from the look-ahead."""
    return {
        "robots": arguments.robots,
        "moments": len(results),
        **{f"harm of {fire}": gaps.gap(results, "none", fire) for fire in fires},
        **{
            f"{fire} leaves more than {WORST}": gaps.gap(results, fire, WORST)
            for fire in fires
            if fire != WORST
        },
        f"{WORST} leaves more than it foresaw": gaps.optimism(results),
    }


def _done(
    work: Callable[[Given], Made],
    jobs: Sequence[Given],
    arguments: Namespace,
    unit: str,
) -> list[Made]:
    """Do all jobs, results in order, with a progress bar; Ctrl-C keeps nothing."""
    about = counted(len(jobs), f"{unit}s")
    with workforce(arguments.workers, about) as (executor, stop):
        results = in_order(executor, work, jobs, stop, unit)
    if results is None:
        raise KeyboardInterrupt("stopped; nothing was kept")
    return results


# -- Both ---------------------------------------------------------------------------


def _refuse_output(arguments: Namespace) -> None:
    """Refuse a picture that cannot be written, before anything is measured."""
    if arguments.output:
        from reference.workshop.drawing.page import PICTURES

        writable(arguments.output, PICTURES, "a picture")


def _tell(facts: dict[str, Any], arguments: Namespace, title: str) -> None:
    """Print one object, or a line for each fact; intervals with their ends."""
    if arguments.json:
        print(json.dumps(as_plain(facts)))
    else:
        print(title)
        for name, value in facts.items():
            print(f"  {name.replace('_', ' '):42}{_shown(value)}")
    if arguments.output:
        print(f"the picture is in {arguments.output}", file=sys.stderr)


def _shown(value: Any) -> str:
    if isinstance(value, Interval):
        return f"{value.mean:8,.0f} [{value.low:,.0f}, {value.high:,.0f}]"
    if value is None:
        return f"{'-':>8}"
    return f"{value:8.2f}" if isinstance(value, float) else f"{value!s:>8}"


AGREE_OPTIONS: options.Table = {
    **options.BUILDING,
    "--fires": options.number(
        1, f"default: {agreements.FIRES}", default=agreements.FIRES
    ),
    **options.WORKERS,
    **options.picture("none is drawn"),
}
GAP_OPTIONS: options.Table = {
    **options.player("robots", "default: sweep", default="sweep"),
    **options.player("fire", f"added to {', '.join(CHOOSERS)}", **options.SEVERAL),
    **options.PLACE,
    "--moments": options.number(
        1, f"one of each evacuation; default: {MOMENTS}", default=MOMENTS
    ),
    **options.WORKERS,
    **options.picture("none is drawn"),
}

AGREE = Command(agree, AGREE_OPTIONS, "agree --fires 50 -o agreement.png")
GAP = Command(gap, GAP_OPTIONS, "gap --robots sweep --moments 12 -o gap.png")

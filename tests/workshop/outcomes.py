"""Results of evacuations that nobody has played."""

from reference.workshop.comparing import RunResult


def result(
    robots="sweep", fire="random", seed=0, times=range(1, 21), people=40, **changes
):
    """Some people are out, at these times in s, and all others are dead."""
    out = len(times)
    in_order = tuple(sorted(map(float, times)))
    facts = {
        "people": people,
        "evacuated": out,
        "died": people - out,
        "inside": 0,
        "survival": out / people,
        "reward": 0.0,
        "difficulty": 1000.0,
        "evacuation_time": in_order[-1] if out else None,
        "times": in_order,
        "mean_health": 80.0 if out else None,
        "simulated_seconds": 200.0,
        "deaths": (),
    }
    return RunResult(robots, fire, seed, **facts | changes)

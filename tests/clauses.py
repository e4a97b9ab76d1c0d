"""The clauses of the paper's appendix, A1 to F12, as this project reads them.

Each id stands with the kind of statement it is and a title of one line:

stated    the appendix says it
derived   it follows from what the appendix says
erratum   what is printed cannot be meant; we implement what is meant
deviation the appendix says it; we do otherwise on purpose, and say why
chosen    the appendix is silent; we chose, and say why where the code does it

Code cites them in one grammar, `[D3, Eq. 2]`, and tests by `@pytest.mark.paper("D3")`;
`citations` and `marks` find both without importing anything.
"""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

KINDS = ("stated", "derived", "erratum", "deviation", "chosen")

CLAUSES = {
    "A1": ("stated", "three floors, each 40 x 40 units of 1 m"),
    "A2": ("stated", "rooms joined by doors, fewer rooms further up"),
    "A3": ("stated", "two stairwells outside the main body, with entrances"),
    "A4": ("stated", "who passes an exit leaves the environment"),
    "A5": ("stated", "doors, entrances, exits are triggers without volume"),
    "A6": ("stated", "flames destroy the regular door they touch"),
    "A7": ("stated", "a navigation mesh over all walkable areas"),
    "A8": ("stated", "six figures of the building"),
    "B1": ("stated", "a human sees by casting rays"),
    "B2": ("stated", "rays are short; nothing hit means unexplored"),
    "B3": ("derived", "no human knows the map"),
    "B4": ("stated", "two modes that switch, leader and follower"),
    "B5": ("erratum", "Algorithm 1, the follower"),
    "B6": ("stated", "Algorithm 2, the leader"),
    "B7": ("derived", "health falls by 0.01 a frame, from 100"),
    "B8": ("stated", "forty humans"),
    "C1": ("stated", "a robot observes 167 numbers"),
    "C2": ("derived", "167 numbers mean 14 robots and fire sources"),
    "C3": ("stated", "a grid of 40 x 40 cells seen as an image"),
    "C4": ("stated", "agents of one floor observe the same"),
    "C5": ("stated", "a robot's action is a destination, two floats"),
    "C6": ("stated", "Eq. 1, destinations near a stairwell"),
    "C7": ("stated", "Algorithm 3, whoever decides: model or algorithm"),
    "C8": ("chosen", '"in this level" is "here or above": a robot ends its work'),
    "D1": ("stated", "the fire is the adversary and sees everything"),
    "D2": ("stated", "the fire's action is a floor and a place"),
    "D3": ("stated", "a source appears at the nearest cell's centre"),
    "D4": ("derived", "Eq. 2 is right for every real number"),
    "D5": ("erratum", "Eq. 3 is Eq. 2 with Y for X"),
    "D6": ("stated", "occupied places yield no fire, or another place"),
    "D7": ("chosen", "flames spread by first passage"),
    "E1": ("stated", "robots learn by MA-POCA, Table I"),
    "E2": ("stated", "the fire learns by PPO, Table II"),
    "E3": ("stated", "the semantics are those of ML-Agents 0.29.0"),
    "E4": ("stated", "normalised inputs, three hidden layers of 256"),
    "E5": ("stated", "group rewards, discounted by 0.90 and 0.99"),
    "E6": ("derived", "both learn at once, each at its own rate"),
    "F1": ("stated", "Eq. 4, rewards on an exponential scale"),
    "F2": ("derived", "b and c follow from two critical points"),
    "F3": ("derived", "slopes of Eq. 4"),
    "F4": ("stated", "Eqs. 5 and 6, the worst case"),
    "F5": ("derived", "the penalty for a death is 300"),
    "F6": ("stated", "Eq. 7, the best case"),
    "F7": ("erratum", "Eq. 7's denominator is a product"),
    "F8": ("chosen", "reward 100 per rescue, 50 frames a second"),
    "F9": ("derived", "Eq. 8, the score E with k and beta"),
    "F10": ("derived", "difficulty h runs from 0 to about 4000"),
    "F11": ("chosen", "the difficulty function itself"),
    "F12": ("stated", "the score is calibrated for each building"),
}

ALGORITHMS = {
    "Alg. 1": """
        while not at exit do
        if not stuck and no leader then
        switch mode
        end
        if leader within line of sight then
        move towards leader
        if leader is a robot then
        act according to robot's instructions
        end
        else
        disconnect and switch mode
        end
        end""",
    "Alg. 2": """
        while not at exit do
        if exit found in view then
        go to the exit
        end
        if there are doors or stairs in view that desired to go then
        if there are suitable leaders in the view then
        switch mode
        else
        go to the desired stair or door
        end
        else
        look for doors and stairs in view
        if all doors in view have been or do not exist
        if there are unexplored directions in the view then
        move in the unexplored direction
        else
        go to the door that passed by last time
        end
        else
        go to the desired stair or door
        end
        end
        end""",
    "Alg. 3": """
        while there are humans not evacuated in this level
        evacuate humans
        if model or algorithm makes a decision then
        update destination based on the decision
        modify instructions based on the destination
        end
        move towards the current destination
        end""",
}
"""The lines as the paper prints them, numbered as `reading.md` restores them."""

PRINTED = {
    place: line.strip()
    for name, text in ALGORITHMS.items()
    for place, line in [
        (name, "as a whole"),
        *((f"{name}:{k}", line) for k, line in enumerate(text.split("\n")[1:], 1)),
    ]
} | {
    "Eq. 1": "the actual target of a robot",
    "Eq. 2": "the grid cell nearest to X",
    "Eq. 3": "the grid cell nearest to Y",
    "Eq. 4": "y, rewards on an exponential scale",
    "Eq. 5": "R_w, the worst case",
    "Eq. 6": "R_w when everybody dies",
    "Eq. 7": "R_b, the best case",
    "Eq. 8": "e', reward and difficulty together",
    "Tab. I": "configuration of the robots",
    "Tab. II": "configuration of the fire",
    "Fig. 1": "the building from an oblique angle",
    "Fig. 2": "its walkable areas",
    "Fig. 3": "exits, entrances and doors",
    "Fig. 4": "the first floor from above",
    "Fig. 5": "the second floor from above",
    "Fig. 6": "the third floor from above",
}
"""What the paper prints, place by place, as citations and marks name it."""

CITATION = re.compile(r"\[([A-F]\d{1,2}\b[^\[\]]*)\]")
CLAUSE = re.compile(r"[A-F]\d{1,2}")


def citations() -> Iterator[tuple[str, Path, int]]:
    """Clause, file and line of every citation such as `[D3, Eq. 2]` in reference/."""
    for parts, path, number in _cited():
        for part in parts:
            if CLAUSE.fullmatch(part):
                yield part, path, number


def kinds_of(clause: str) -> list[str]:
    """The kind of a clause, then those that the code tags: `[A5, deviation]`."""
    tagged = {part for parts, *_ in _cited() if clause in parts for part in parts}
    kind, _ = CLAUSES[clause]
    return [kind, *(each for each in KINDS if each in tagged - {kind})]


@cache
def _cited() -> list[tuple[list[str], Path, int]]:
    """The parts, file and line of every citation."""
    return [
        (re.split(r"[,;:] *", cited), path, number)
        for path in sorted((ROOT / "reference").rglob("*.py"))
        for number, line in enumerate(path.read_text("utf-8").splitlines(), start=1)
        for cited in CITATION.findall(line)
    ]


def marks() -> Iterator[tuple[str, Path, int, list[str]]]:
    """Clause, file, line and places, such as "Eq. 2", of every mark in tests/."""
    for path in sorted((ROOT / "tests").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and _is_mark(node.func) and node.args:
                clause, *places = map(ast.literal_eval, node.args)
                yield clause, path, node.lineno, places


def _is_mark(function: ast.expr) -> bool:
    return ast.unparse(function) in ("pytest.mark.paper", "mark.paper")

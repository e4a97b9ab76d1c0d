"""The lines of Algorithms 1-3 as the paper prints them.

What each means in our words, and all clauses, stand in
`reference/workshop/annotated/annotations.toml`.
"""

from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

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
"""Their numbers are restored: those of our copy are shifted."""

PRINTED = {
    f"{name}:{k}": line.strip()
    for name, text in ALGORITHMS.items()
    for k, line in enumerate(text.split("\n")[1:], 1)
}

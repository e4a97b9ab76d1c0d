"""Tutorial 1: a building from text.

You learn to draw a building in any text editor, and to read the messages about
mistakes. You also learn what the program makes of it: rooms with names, and a kind for
every square metre. Run this file from the repository's root, whole or cell by cell. It
takes a second.
"""

from pathlib import Path

from reference.building import Building, Kind
from reference.workshop import drawing
from reference.workshop.maps import MistakesError, parse_map

# %% Draw the floors
# A character is a square metre: `#` wall, `.` floor, `+` a door [A2], `E` an exit [A4].
# Small letters write a room's name on its floor. The same capital, A to D, in the same
# place on two floors is a stairwell, and a `+` that touches it is its entrance [A3].

HOUSE = """
building: Doll's house
size:     20 x 8

floor 1: downstairs
   #################
   #.......#.......#
####.......+.......#
#AA+..hall.#kitchen#
#AA#.......####+####
####.......+.......#
   #.......#.garden#
   ####EE#######E###

floor 2: upstairs
   #################
   #.....#.........#
####.....#.........#
#AA+.....+..attic..#
#AA#.....###########
####.bed.#.........#
   #.....+..bath...#
   #################
"""
house = Building(parse_map(HOUSE))
print(house.title, "has", house.floors, "floors")
#> Doll's house has 2 floors

# %% Rooms and landmarks
# Code counts floors from 0; the ids, which people read, count them from 1.

for room in house.rooms(0):
    print(f"{room.id:<9} {room.size:>2} m2, its middle at {room.centre} m")
#> 1/hall    42 m2, its middle at (-3.5, 0.0) m
#> 1/kitchen 21 m2, its middle at (4.5, 1.5) m
#> 1/garden  14 m2, its middle at (4.5, -2.0) m

# A landmark is a door, an entrance or an exit. Two characters side by side are one
# landmark, 2 m wide. Exits lead out of their floor. So do entrances to stairs that lead
# down.

for mark in house.landmarks:
    if mark.leads_out:
        print(f"{mark.id:<12} {mark.width} m wide, joins {' and '.join(mark.sides)}")
#> 1/exit-1     2 m wide, joins 1/hall and outside
#> 1/exit-2     1 m wide, joins 1/garden and outside
#> 2/entrance-1 1 m wide, joins 2/bed and 2/A

# %% Characters and metres
# Positions are in metres, x to the east and y to the north of the middle of the
# building without its stairwells [A8]. If that is inside a cell, its north-west corner
# counts instead. Rows and columns count from the drawing's upper left corner, from 0.

x, y = house.metres(3, 7)
print("row 3, column 7 is at", (x, y), "m")
#> row 3, column 7 is at (-3.5, 0.5) m
row, column = house.cell(x - 3, y)
print("3 m further west there is", Kind(house.kind[0, row, column]).name)
#> 3 m further west there is FLOOR

# %% Mistakes are explained
# Here the exit becomes a hole in the wall. The message says where to look, shows the
# line, and gives one hint. `.venv/bin/python -m reference check FILE` prints the same.

try:
    parse_map(HOUSE.replace("EE", ".."), "house.txt")
except MistakesError as error:
    print(error)
#> house.txt:13:8: there is a hole in the outer wall
#>        ####..#######E###
#>            ^
#>     hint: Type '#' here, or 'E' for an exit.

# %% What it looks like
# Doors are blue, stairwell entrances purple and exits green, as in the paper [A8]. A
# dashed line joins the two floors of the stairwell.

Path("out").mkdir(exist_ok=True)
print(drawing.save(drawing.oblique(house), "out/01_dolls_house.png"))
#> out/01_dolls_house.png

# %% Exercise
# Replace one `#` of the attic's north wall by each of the other characters in turn.
# Which are accepted, and what do the messages say about the rest?
# Hint: the attic's north wall is the first row of floor 2.

"""Tutorial 1: a building from text.

You learn to draw a building in any text editor, to read what is said about a mistake,
and what becomes of the drawing: rooms with names, and a kind for every square metre.
Run this file from the repository's root, whole or cell by cell.
"""

from pathlib import Path

from reference import drawing
from reference.building import Kind, build
from reference.floorplan import FloorPlanError, parse

# %% A floor is drawn, not described
# One letter is one square metre: `#` wall, `.` floor, `+` a door [A2], `E` an exit [A4].
# Small letters spell a room's name on its floor. The same capital, A to D, in the same
# place of both floors is a stairwell; a `+` that touches it is its entrance [A3].

HOUSE = """
building: Doll's house
size:     20 x 8

floor 1: downstairs
   #################
   #.......#.......#
####.......+.......#
#AA+..hall.#kitchen#
####.......#.......#
   #.......####+####
   #.......+.garden#
   ####EE#######E###

floor 2: upstairs
   #################
   #.....#.........#
####.....#.........#
#AA+.....+..attic..#
####.....###########
   #.bed.#.........#
   #.....+..bath...#
   #################
"""
house = build(parse(HOUSE))
print(house.title, "has", house.floors, "floors")
#> Doll's house has 2 floors

# %% What was read
# An area is a room, or one storey of a stairwell. Its id begins with its floor.

for area in house.areas:
    print(f"{area.id:<10} {area.kind:<9} {area.size:>3} m2")
#> 1/hall     room       42 m2
#> 1/kitchen  room       28 m2
#> 1/garden   room        7 m2
#> 1/A        stairwell   2 m2
#> 2/bed      room       30 m2
#> 2/attic    room       27 m2
#> 2/bath     room       18 m2
#> 2/A        stairwell   2 m2

# A landmark is what one passes on the way out. Two letters side by side are one, twice
# as wide. Its sides tell what it joins.

for mark in house.landmarks:
    joins = " and ".join(mark.sides)
    print(f"{mark.id:<12} {mark.width} m wide, joins {joins}")
#> 1/door-1     1 m wide, joins 1/hall and 1/kitchen
#> 1/door-2     1 m wide, joins 1/kitchen and 1/garden
#> 1/door-3     1 m wide, joins 1/hall and 1/garden
#> 1/entrance-1 1 m wide, joins 1/hall and 1/A
#> 1/exit-1     2 m wide, joins 1/hall and outside
#> 1/exit-2     1 m wide, joins 1/garden and outside
#> 2/door-1     1 m wide, joins 2/bed and 2/attic
#> 2/door-2     1 m wide, joins 2/bed and 2/bath
#> 2/entrance-1 1 m wide, joins 2/bed and 2/A

# %% Letters and metres
# Places are told in metres, x to the east and y to the north of the middle of the
# rooms [A8]. Rows and columns count from the drawing's upper left corner, from 0.

row, col = 3, 7
x, y = house.metres(row, col)
print("row", row, "column", col, "is at", (x, y), "metres")
#> row 3 column 7 is at (-3.5, 0.5) metres
print("two metres west of it:", Kind(house.kind[0][house.cell(x - 2, y)]).name)
#> two metres west of it: FLOOR

# %% Mistakes are explained
# Leave the way out open, as a wall with a hole. The message says where to look, shows
# the line, and asks for one thing. `python -m reference check FILE` says the same.

try:
    parse(HOUSE.replace("EE", ".."), "house.txt")
except FloorPlanError as error:
    print(error)

# %% What it looks like
# Doors are blue, stairwell entrances purple and exits green, as in the paper [A8].

Path("out").mkdir(exist_ok=True)
print(drawing.save(drawing.oblique(house), "out/01_dolls_house.png"))
#> out/01_dolls_house.png

# %% Exercise
# Give the attic a window of one letter on the north side. Which letters could stand
# there, and what is said about the others?
# Hint: put each of the seven meanings into row 0 of floor 2 in turn, with `replace`.

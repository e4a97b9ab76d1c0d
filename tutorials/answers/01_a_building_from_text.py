"""Exercise 1: which characters may stand in the attic's north wall? It takes a second.

A wall and an exit may. Even upstairs an exit is accepted: think of a fire escape. Each
other character opens the wall, and the message says how.
"""

from reference.workshop.maps import MistakesError, parse_map

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
downstairs, upstairs = HOUSE.split("upstairs\n")
for character in "#.+EAa ":
    changed = upstairs[:14] + character + upstairs[15:]  # in its first row, the wall
    drawn = f"{downstairs}upstairs\n{changed}"
    try:
        parse_map(drawn, "house.txt")
        print(f"'{character}' is accepted")
    except MistakesError as error:
        print(f"'{character}':", str(error).splitlines()[0])
#> '#' is accepted
#> '.': house.txt:16:15: there is a hole in the outer wall
#> '+': house.txt:16:15: this door leads outside
#> 'E' is accepted
#> 'A': house.txt:16:15: 'A' stands alone, and is no stairwell
#> 'a': house.txt:16:15: there is a hole in the outer wall
#> ' ': house.txt:16:15: there is a hole in the outer wall

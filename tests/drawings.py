"""A drawing without a mistake, for tests to spoil."""

HOUSE = """building: Small house
size:     14 x 5

floor 1: ground
   ###########
####.....#...#
#AA+.hall+lab#
####.....#...#
   ####E######

floor 2: upstairs
   ###########
####.....#...#
#AA+.desk+map#
####.....#...#
   ###########
"""

"""A film of Algorithms 1 and 2: twenty seconds that pass through all their lines.

A frame says which printed lines somebody has passed just now; their numbers are those
of the comments in the code.
"""

import pytest
from movies import Script, film, opening, stage

from reference.humans import Follower, Leader

FOLLOWER = """
    0.0 s: the beginning
    #p...q.+.....R.........E
    0.2 s: lines 2, 3
    #p...q.+.....R.........E
    2.0 s: lines 2, 5, 6, 7
    #..p.!.+.....R.........E
    3.8 s: lines 2, 5, 10, 11
    #....p.+.....R.........E
    8.0 s: lines 2, 5, 6, 7, 8
    #....x.+..p..!.........E
    14.6 s: lines 2, 5, 6, 7, 8
    #....x.+..........pR...!
    18.2 s: line 1, out
    #....x.+.............R.E
    """
LEADER = """
    0.0 s: the beginning
    ###########################
    #..#.......#..*.#....#....#
    #p.+.......+....+..q.+....E
    ###########################
    0.2 s: lines 2, 5, 11, 12, 13, 14, 16, 17
    ###########################
    #..#.......#..*.#....#....#
    #p.!.......+....+..q.+....E
    ###########################
    2.6 s: lines 2, 5, 11, 12, 13, 14, 15
    ###########################
    #..#.......#..*.#....#....#
    #..+p....?.+....+..q.+....E
    ###########################
    3.8 s: lines 2, 5, 6, 8, 9
    ###########################
    #..#.......#..*.#....#....#
    #..+..p....!....+..q.+....E
    ###########################
    7.4 s: lines 2, 5, 6, 8, 9
    ###########################
    #..#.......#..*.#....#....#
    #..+.......p!...+..q.+....E
    ###########################
    8.6 s: lines 2, 5, 11, 12, 13, 19, 20
    ###########################
    #..#.......#..*.#....#....#
    #..+.......+p...!..q.+....E
    ###########################
    12.2 s: lines 2, 5, 6, 7
    ###########################
    #..#.......#..*.#....#....#
    #..+.......+....+p.!.+....E
    ###########################
    17.6 s: lines 2, 3
    ###########################
    #..#.......#..*.#....#....#
    #..+.......+....+..x.+p...!
    ###########################
    20.2 s: line 1, out
    ###########################
    #..#.......#..*.#....#....#
    #..+.......+....+..x.+....E
    ###########################
    """


@pytest.mark.paper("B5", "Alg. 1")
def test_a_film_of_algorithm_1():
    """p finds q, who dies; then a robot, which sends it to the exit."""
    script = Script(None, None, (9.5, 0.5))
    sim = stage(opening(FOLLOWER), script, leads="q", still="q", health={"q": 1.5})
    assert film(sim, 30, Follower.setoff) == FOLLOWER


@pytest.mark.paper("B6", "Alg. 2")
def test_a_film_of_algorithm_2():
    """p comes out of a closet, walks past flames, and follows q, who dies."""
    said = {"leads": "pq", "visited": "+1", "still": "q", "health": {"q": 7}}
    sim = stage(opening(LEADER), **said)
    assert film(sim, 30, Leader.setoff) == LEADER

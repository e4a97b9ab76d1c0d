"""A film of each algorithm: twenty seconds that pass through all of its lines.

A frame says which printed lines somebody has passed just now; their numbers are those
of the comments in the code.
"""

import pytest
from movies import film, stage

from reference.humans import Follower, Leader
from reference.robots import RobotAlgorithm

FOLLOWER = """
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
    0.2 s: lines 2, 5, 6, 7, 11, 12, 13, 14, 16, 17
    ###########################
    #..#.......#..*.#....#....#
    #p.!.......+....+..q.+....E
    ###########################
    2.6 s: lines 2, 5, 6, 7, 11, 12, 13, 14, 15
    ###########################
    #..#.......#..*.#....#....#
    #..+p....?.+....+..q.+....E
    ###########################
    3.8 s: lines 2, 5, 6, 7, 8, 9
    ###########################
    #..#.......#..*.#....#....#
    #..+..p....!....+..q.+....E
    ###########################
    7.4 s: lines 2, 5, 6, 7, 8, 9
    ###########################
    #..#.......#..*.#....#....#
    #..+.......p!...+..q.+....E
    ###########################
    8.6 s: lines 2, 5, 6, 7, 11, 12, 13, 19, 20
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
ROBOT = """
    0.2 s: lines 1, 2, 3, 4, 5, 7
    #q.R.........E

    #p..R.......2E
    0.4 s: lines 1, 2, 3, 7
    #q.R.........E

    #p...R......2E
    9.6 s: lines 1
    #q.R.........E

    #...........2E
    """


class Decides:
    """Robots that are sent to a place at one time, in seconds."""

    def __init__(self, time, *where):
        self.time, self.where = time, where

    def decide(self, world, robots, rng):
        """Nothing at other times."""
        now = abs(world.time - self.time) < 0.1
        return [self.where if now else None] * len(robots)


@pytest.mark.paper("B5", "Alg. 1")
def test_a_film_of_algorithm_1():
    """p finds q, who dies; then a robot, which sends it to the exit."""
    sim = stage(
        "#p...q.+.....R.........E",
        robots=Decides(10, 9.5, 0.5),
        leads="q",
        still="q",
        health={"q": 1.5},
    )
    assert film(sim, 30, Follower.setoff, "p") == FOLLOWER


@pytest.mark.paper("B6", "Alg. 2")
def test_a_film_of_algorithm_2():
    """p comes out of a closet, walks past flames, and follows q, who dies."""
    board = """
        ###########################
        #..#.......#..*.#....#....#
        #p.+.......+....+..q.+....E
        ###########################
        """
    sim = stage(board, leads="pq", visited="+1", still="q", health={"q": 7})
    assert film(sim, 30, Leader.setoff, "p") == LEADER


@pytest.mark.paper("C7", "Alg. 3")
def test_a_film_of_algorithm_3():
    """The robot upstairs waits for p, leads it out, and is done; q is still below."""
    sim = stage("#q.R.........E\n\n#p..R.......2E", still="q")
    assert film(sim, 20, RobotAlgorithm.act, "R2") == ROBOT

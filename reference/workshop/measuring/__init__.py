"""Measure: trajectories, density, standard cases of crowds, speed, decisions."""

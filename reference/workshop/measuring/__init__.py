"""Measure: trajectories, density, standard cases of pedestrian dynamics, speed."""

"""Trainings: settings, checkpoints and the loop that writes them down."""

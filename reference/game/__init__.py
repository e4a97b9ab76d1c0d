"""The game of robots against fire: rewards, observations and the environment."""

"""The game that is learned: rewards, observations and the environment."""

"""The game of robots against fire: observations, codec and environment."""

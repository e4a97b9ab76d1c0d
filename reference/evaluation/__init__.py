"""Evaluate robots: bounds of the reward, difficulty of the fire, and the score E."""

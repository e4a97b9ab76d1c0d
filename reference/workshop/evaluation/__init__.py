"""Comparisons: contestants, worst cases, cross-play and intervals."""

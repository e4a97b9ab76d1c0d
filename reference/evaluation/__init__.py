"""How good are robots, given how hard the fire is: bounds, difficulty, worst cases, E.

Clauses: F1-F12.
"""

"""Experiments: read `design` (one file), `jobs` (train, test) and `report` (a page).

Clauses: E6, F12.
"""

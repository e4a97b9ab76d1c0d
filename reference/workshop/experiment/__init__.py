"""Experiments: trainings and tests from one file, as jobs; then a page about them.

Clauses: E6, F12.  Read `design` (what the file says), `jobs` (train and test, wherever)
and `report` (what they come to).
"""

"""Experiments: trainings, best responses and tests from one file, as jobs.

Clauses: E6, F12.  Read `asked` (the file), `begun` (what of it may not change),
`jobs` (the two kinds of jobs, pure functions of plain data), `steps` (which jobs there
are and in what order), `results` (what they come to) and `page` (what is told of them).
"""

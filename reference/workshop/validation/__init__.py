"""Standard cases of pedestrian dynamics, and how the model does in them.

Clauses: A3, A9, F8.  `crowd` puts people who know the way on small maps and measures
them; `cases` is the table of RiMEA's, IMO's and ISO's cases.
"""

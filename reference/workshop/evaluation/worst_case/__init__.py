"""Approximate the worst case of Eq. 5: the fires and errors that do most harm.

Clauses: F4.  The appendix says that R_w = min E[R] over all attacks cannot be computed;
it takes the greedy worst case (GWC): at every state the action of lowest reward.  Its
cost is linear in the number of decisions.  Here the attacker is one of

* the fire, which chooses among `placements`: the one that a `look_ahead` simulation
  finds worst, or the one that a `critic` values least;
* an error of bounded size in what the robots observe: `perturbed`.

Eq. 6's R_w, if everybody dies, is below all of them: see `bounds`.  `critic` and
`perturbed` need a checkpoint, and so torch.
"""

from reference.workshop.evaluation.worst_case.look_ahead import WorstCase
from reference.workshop.evaluation.worst_case.placements import placements

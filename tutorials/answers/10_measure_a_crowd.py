"""Exercise 10: how many pass the exit? It takes 3 seconds.

About 1.3 people per second and metre, the limit, as soon as there is a crowd: a little
more or less, since some enter in one tick. With 25 people there is hardly a crowd. It
makes no difference how many wait.
"""

import numpy as np

from reference import Scenario, Simulation, load
from reference.world import Evacuated

institute = load("paper")
exit_2 = institute.landmark_of["1/exit-2"]

for people in (25, 50, 100, 140):
    lunch = Scenario(people=people, rooms=("1/canteen",), sight_range=20)
    crowd = Simulation(institute, lunch, seed=1)
    crowd.run()
    evacuated = [event for event in crowd.events if isinstance(event, Evacuated)]
    left = [event for event in evacuated if event.landmark == exit_2.index]
    times = np.sort([event.time for event in left])
    tenth = len(times) // 10
    middle = times[tenth : len(times) - tenth]
    flow = (len(middle) - 1) / (middle[-1] - middle[0]) / exit_2.width
    print(f"{people:3} people: {flow:.2f} people per second and metre")
#>  25 people: 1.19 people per second and metre
#>  50 people: 1.30 people per second and metre
#> 100 people: 1.30 people per second and metre
#> 140 people: 1.27 people per second and metre

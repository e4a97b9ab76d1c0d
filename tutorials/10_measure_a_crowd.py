"""Tutorial 10: measure a crowd.

You learn to record an evacuation and to measure it with PedPy, a library that measures
experiments with real crowds: where people walk, how many pass a door, how density slows
them. It takes 5 seconds. PedPy is an extra:

    .venv/bin/pip install -c constraints.txt -e '.[pedpy]'
"""

from pathlib import Path
from shutil import rmtree

import matplotlib.pyplot as plt
import numpy as np

from reference import Scenario, Simulation, load
from reference.workshop.measuring.recording import record
from reference.workshop.measuring.validation import ONE_WAY, REAL_PEOPLE_SOURCE
from reference.world import Evacuated

try:
    import pedpy
    import shapely
except ImportError:
    install = ".venv/bin/pip install -c constraints.txt -e '.[pedpy]'"
    raise SystemExit(f"This tutorial needs PedPy: {install}") from None

# %% A recording
# A hundred people are in the canteen of the paper's building. There is no smoke, so
# they see 20 m far. Each floor becomes a file in JuPedSim's format, which PedPy reads.
# The command for it is `.venv/bin/python -m reference evacuate --record FOLDER`.

folder = Path("out/10_recording")
rmtree(folder, ignore_errors=True)  # a recording never overwrites another
lunch = Scenario(people=100, rooms=("1/canteen",), sight_range=20)
crowd = Simulation(load("paper"), lunch, seed=1)
record(crowd, folder)
print(*sorted(path.name for path in folder.iterdir()))
#> floor-1.sqlite floor-2.sqlite floor-3.sqlite

# %% Nobody walks through walls
# The walkable area is one polygon with holes. A person who takes the stairs leaves the
# file of one floor and enters that of another, with the same id. A floor that walls
# divide becomes a file for each part, floor-2-part-1.sqlite and so on, since PedPy and
# JuPedSim take one polygon. A file in which nobody ever was cannot be loaded by PedPy.

ground = folder / "floor-1.sqlite"
paths = pedpy.load_trajectory_from_jupedsim_sqlite(trajectory_file=ground)
area = pedpy.load_walkable_area_from_jupedsim_sqlite(trajectory_file=ground)
print(f"{paths.frame_rate:.0f} frames a second, {area.area:.0f} m2")
#> 5 frames a second, 1247 m2
outside = ~shapely.covers(area.polygon, paths.data.point)
print("positions outside the walls:", outside.sum())
#> positions outside the walls: 0

# %% How many pass a door
# N(t) counts who has crossed a line by time t. The line is the threshold of the exit,
# two metres wide. The slope of N(t) is the flow, people per second. The line reaches a
# little into the walls, because a straight step of 0.2 s may cut a corner.

line = pedpy.MeasurementLine([(19, -16.3), (19, -13.7)])
passed, _ = pedpy.compute_n_t(traj_data=paths, measurement_line=line)
exit_2 = crowd.building.landmark_of["1/exit-2"].index
evacuated = [event for event in crowd.events if isinstance(event, Evacuated)]
left = [event for event in evacuated if event.landmark == exit_2]
counted = passed.cumulative_pedestrians
print("all who left were counted:", counted.max() == len(left))
#> all who left were counted: True
crossings = passed.time[counted.diff() > 0]
slope = (counted.max() - 1) / (crossings.max() - crossings.min())
print(f"from the first to the last: {slope:.2f} people per second")
#> from the first to the last: 2.55 people per second

# %% How density slows people down
# A person's Voronoi cell is all floor that is nearer to this person than to others, at
# most 1.5 m away. One divided by its area is the density (Steffen and Seyfried 2010).
# We measure it once a second, in front of the exit. PedPy's own circle of 1.5 m is a
# polygon of 12 corners, 4.5 % smaller than a circle, which makes people who stand alone
# that much denser. Ours has 64.

some = paths.data[paths.data.frame % 5 == 0]
cells = pedpy.compute_individual_voronoi_polygons(
    traj_data=pedpy.TrajectoryData(some, paths.frame_rate),
    walkable_area=area,
    cut_off=pedpy.Cutoff(radius=1.5, quad_segments=16),
)
speeds = pedpy.compute_individual_speed(traj_data=paths, frame_step=3)
felt = some.merge(cells, on=["id", "frame"]).merge(speeds, on=["id", "frame"])
felt = felt[felt.x.between(14, 19) & felt.y.between(-18, -12)]
where_dense = felt.speed[felt.density > 2].mean()
where_sparse = felt.speed[felt.density < 1].mean()
print(f"more than 2 people per m2: {where_dense:.2f} m/s")
print(f"less than 1 person per m2: {where_sparse:.2f} m/s")
#> more than 2 people per m2: 0.22 m/s
#> less than 1 person per m2: 0.47 m/s

# %% The picture
# Left: people walk straight to the exit and wait in a half circle. Middle: N(t) climbs
# in steps. Some enter in the same tick; then the exit is shut for as long as that many
# need at 1.3 people per second and metre [A5]. Right: from 1 to 4 people per square
# metre speed falls. Those who are slow at less than 1 wait at the crowd's edge, where a
# Voronoi cell reaches into the empty room. Nearly all above 5.5 lean on the wall beside
# the exit, which cuts their cells. Squares are real people, who walk one way and wait
# for no exit.

figure, (floor, flow, pace) = plt.subplots(
    1, 3, figsize=(14, 4.6), width_ratios=(1.15, 1, 1), layout="constrained"
)
pedpy.plot_trajectories(traj=paths, walkable_area=area, axes=floor, traj_width=0.5)
floor.plot(*np.transpose(line.coords), color="#0a7d28", lw=4)
floor.set(xlim=(4, 21), ylim=(-20, -7), xlabel="x, m", ylabel="y, m")
floor.set_title("Paths in the canteen; green: the line", loc="left")
flow.plot(passed.time, passed.cumulative_pedestrians, color="#1f5fa8")
flow.set(xlabel="time, s", ylabel="people", xlim=0, ylim=0)
flow.set_title("N(t): people across the line, some in one tick", loc="left")
dots = {"s": 8, "alpha": 0.4, "color": "#c43c00", "label": "here"}
pace.scatter(felt.density, felt.speed, **dots)
real = {"marker": "s", "s": 45, "fc": "white", "ec": "black", "zorder": 3}
pace.scatter(list(ONE_WAY), list(ONE_WAY.values()), **real, label="real people")
pace.legend()
pace.set(xlabel="density, people per m²", ylabel="speed, m/s", xlim=0, ylim=0)
pace.set_title("Density and speed in front of the exit", loc="left")
source = f"real people: {REAL_PEOPLE_SOURCE}"
figure.text(0.99, 0, source, ha="right", va="top", fontsize=8)
figure.savefig("out/10_measured.png", dpi=120, bbox_inches="tight")
print("out/10_measured.png")
#> out/10_measured.png

# %% Exercise
# In experiments 1.9 to 2.4 people per second and metre get through a narrow exit. How
# many do here, where 1.3 is the limit? Does it depend on how many wait?
# Hint: the slope of N(t) without its first and its last tenth, for 25, 50, 100 and 140
# people. Hardly more fit into the canteen.

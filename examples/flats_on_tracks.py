"""
At which speed is a flat worst? That depends on the track
=========================================================

The largest force of a fresh flat over speed and length, on a rigid rail, on a one-mass track and on rails over sleepers
and a slab, from 18 to 216 km/h.
"""  # noqa: D205, D400 - a title for the gallery

import numpy as np
from matplotlib.figure import Figure

import wheeltapper as wt

wheelset = wt.Wheelset(mass=1200, load=188_228)  # 100 kN per wheel with its weight
scene = wt.Scenario(
    vehicle=wheelset,
    contact=wt.Hertz(constant=1.8825e11),
    irregularity=wt.WheelFlat(length="40 mm", position="50 mm", repeat=False),
    speed=20,
    duration=0.05,
)
tracks = {
    "rigid": wt.StiffTrack(),
    "one mass": wt.FloatingDeck(mass=300, stiffness=1.2e8, damping=1.2e5),
    "soft pads": wt.tracks.Ballasted.named("Zhai2004"),
    "stiff pads": wt.tracks.Ballasted.named("railFE_default"),
    "slab": wt.tracks.Slab(rail="UIC60", spacing=0.65, pad_stiffness=40e6, pad_damping=12e3),
}
over = {"speed": np.linspace(5.0, 60.0, 12), "irregularity.0.length": np.array([0.02, 0.03, 0.04, 0.05, 0.06])}
charts = {
    name: wt.sweep(scene.replaced({"track": track}), over, wt.features.largest_force(over_static=True))
    for name, track in tracks.items()
}

# %%
# The worst speed of each track for each flat, where it is inside the range.


def worst_speeds(chart):
    """Return the speed of the largest force for each length, m/s; NaN where the force still rises at the end."""
    force = chart.largest_force_over_static
    inside = force.max("speed") > force.isel(speed=-1)
    return force.idxmax("speed").where(inside)


for name, chart in charts.items():
    found = ", ".join(f"{3.6 * speed:.0f}" if speed == speed else "-" for speed in worst_speeds(chart).values)
    print(f"{name}: worst at {found} km/h")
rail = float(charts["stiff pads"].largest_force_over_static.sel({"speed": 60.0, "irregularity.0.length": 0.04}))
print(f"40 mm at 216 km/h on sleepers: {rail:.3f} times the static force")

# %%
# The same as a picture.

figure = Figure(figsize=(9.0, 5.5), layout="constrained")
axes = figure.subplots(2, 3, sharex=True, sharey=True).ravel()
for axis, (name, chart) in zip(axes, charts.items(), strict=False):
    for length, force in chart.largest_force_over_static.groupby("irregularity.0.length"):
        axis.plot(3.6 * chart.speed, force.squeeze(), label=f"{1e3 * length:.0f} mm")
    axis.set(title=name, xlabel="speed [km/h]", ylabel="force over static", yscale="log")
    axis.set_yticks([1, 2, 5, 10, 20], ["1", "2", "5", "10", "20"])
    axis.label_outer()
axes[2].xaxis.set_tick_params(labelbottom=True)
axes[2].set_xlabel("speed [km/h]")
axes[-1].axis("off")
axes[-1].legend(*axes[0].get_legend_handles_labels(), title="length of the flat", loc="center", frameon=False)

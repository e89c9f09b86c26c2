"""
A contact law of one's own
==========================

Two laws that are not in the package, beside Hertz's, on the same wheel flat. The first is a function: rough surfaces,
whose asperities are pressed down before the bodies deform. The second is a class with damping, which grows faster with
the indentation than the force does: a layer between wheel and rail that is squeezed.
"""  # noqa: D205, D400 - a title for the gallery

import numpy as np
from matplotlib.figure import Figure

import wheeltapper as wt

CONSTANT = 1.405e11  # N/m^1.5, of the wheelset


def rough(delta):
    """Return the force of Hertz, which asperities of 80 µm soften, N."""
    return CONSTANT * delta**1.5 * (1.0 - np.exp(-delta / 80e-6))


class Squeezed(wt.contact.ForceLaw):
    """N = C·δ^1.5 + D·δ²·δ'.

    Parameters
    ----------
    constant
        C, N/m^1.5.
    damping
        D, N·s/m³.
    """

    constant: float
    damping: float

    def force(self, delta, rate):
        """Return the force of the wheelset, N."""
        return self.constant * delta**1.5 + self.damping * delta**2 * rate


# %%
# A flat of 0.1 mm at 18 km/h, on a rigid rail.

laws = {
    "Hertz": wt.Hertz(constant=CONSTANT),
    "rough surfaces": wt.contact.Law(rough, exponent=2.5),
    "squeezed layer": Squeezed(constant=CONSTANT, damping=1e13),
}
scene = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4, radius=0.46),
    contact=laws["Hertz"],
    irregularity=wt.WheelFlat(depth="0.1 mm", position=0.2, repeat=False),
    speed=5.0,
    duration=0.15,
)
records = {name: wt.simulate(scene.replaced({"contact": law})) for name, law in laws.items()}
for name, record in records.items():
    force = float(record.peaks.normal_force.max()) / record.static_force
    count, lost = record.impacts.sizes["impact"], abs(float(record.energy.dissipated_contact))
    print(f"{name}: {count} impacts, largest force {force:.3f} of static, {lost:.1f} J lost in the contact")

# %%
# The force of rough surfaces rises later and more steeply than Hertz's. Its blows are 6 % harder here, and the impacts
# end sooner. Damping hardly lowers the first blow, but ends the impacts after the second.

figure = Figure(figsize=(8.0, 4.5), layout="constrained")
axis = figure.subplots()
for (name, record), line in zip(records.items(), ("-", "--", "-"), strict=True):
    history = record.history(rate=20e3)
    axis.plot(1e3 * history.time, 1e-3 * history.normal_force, line, label=name)
axis.set(xlabel="time [ms]", ylabel="normal force [kN]", xlim=(30.0, 90.0))
axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, frameon=False)

# %%
# A table of the law marches in its place. The record says how far the two differ.

print(next(note for note in records["squeezed layer"].notes if "table" in note))

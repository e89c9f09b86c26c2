"""
A rail that is held at its seats
================================

Half a wave of the rail fits between two sleepers: there a rail vibrates as if it were pinned at its seats, and they
cannot damp it. Euler's beam says f = π/2·√(EI/m)/L². Shear makes the rail softer: f is lower by √(1 + π²·EI/(κGA·L²)),
and a little more by its rotary inertia.
"""  # noqa: D205, D400 - a title for the gallery

import numpy as np

import wheeltapper as wt

track = wt.tracks.Ballasted.named("Zhai2004")
rail, spacing = track.rail, track.spacing
euler = 0.5 * np.pi * np.sqrt(rail.bending_stiffness / rail.mass_per_length) / spacing**2
sheared = euler / np.sqrt(1.0 + (np.pi / spacing) ** 2 * rail.bending_stiffness / rail.shear_stiffness)
found = float(wt.tracks.pinned_pinned(track))
print(f"pinned-pinned frequency {found:.1f} Hz, of Euler's beam {euler:.1f} Hz, with shear {sheared:.1f} Hz")

# %%
# A rail between two seats resonates there; above a seat it hardly moves.

figure = track.plot()

# %%
# What the rail looks like.

figure = wt.plot(wt.tracks.pinned_pinned(track))

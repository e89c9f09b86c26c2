"""Scenes that many tests ask about."""

import wheeltapper as wt

BUMP = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4),
    contact=wt.Hertz(constant=1.405e11), irregularity=wt.CosineBump(height=2e-4, length=0.05, start=0.009),
    rolling="point", speed=9.0, duration=0.12,
)  # fmt: skip
"""The README's bump under a point follower: the wheel leaves the rail and lands three times or more."""

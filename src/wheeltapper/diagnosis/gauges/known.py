"""What is known of the wheels that pass a site with a track."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from wheeltapper.describe.contact.hertz import Hertz
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.site import Site
from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.lower.laws.ellipse import contact_constant

MASS, RADIUS, CONTACT = "vehicle.mass", "vehicle.radius", "contact.constant_per_wheel"
"""Paths in the scene of one wheel."""
OF_SITE = {"unsprung_mass": MASS, "radius": RADIUS}
"""The same of paths of a site, where they differ."""


class Known(NamedTuple):
    """What is known of a site's track and its wheels.

    Attributes
    ----------
    scene
        One wheel without a flaw on the site's track; its x is that of the site.
    spread
        Standard deviations over values, by their paths in `scene`.
    """

    scene: Scenario
    spread: Mapping[str, float]

    @property
    def mirrored(self) -> Known:
        """The same with x towards the other end."""
        return self._replace(scene=self.scene.replaced({"track.first_sleeper": -self.scene.track.first_sleeper}))


def known_of(site: Site) -> Known:
    """Return what a site with a track says of wheels that pass it."""
    contact, mass = site.contact or Hertz(), float(site.unsprung_mass or 0.0)
    if contact.given is None:
        elastic = float(site.radius or 0.0), float(contact.rail_radius), float(contact.youngs_modulus), contact.poisson
        kept = {name: getattr(contact, name) for name in ("curvature", "restitution", "impact_speed", "hysteresis")}
        contact = Hertz(constant_per_wheel=float(contact_constant(*elastic)), **kept)
    wheel = Wheelset(mass=mass, load=0.0, stiffness=0.0, damping=0.0, radius=site.radius, wheels=1)
    scene = Scenario(vehicle=wheel, track=site.track, contact=contact, speed=0.0, duration=1.0)
    own = {path: share for path, share in site.uncertainty.items() if path != "static_force"}  # which is measured
    return Known(scene, {OF_SITE.get(path, path): share for path, share in own.items()})

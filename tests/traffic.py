"""Recordings of traffic over a site's gauges by the package's own runs: trains whose wheels are rough.

Each wheel is a run of its own; a train is their sum. Wheels are rough by themselves, and all roll over the same rail.
"""

from functools import cache

import numpy as np

import wheeltapper as wt
from tests.wayside import HERTZ, MASS, RADIUS, SPACING
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis import Recording
from wheeltapper.diagnosis.gauges.known import known_of

RATE, NOISE, AHEAD, BEYOND = 5e3, 500.0, 4.8, 5.0
"""Hz, N, and how far a run begins before the site's x = 0, whole bays, and goes on behind it, m."""
AXLES = (0.0, 1.8, 9.0, 10.8)
PAIRS = tuple((SPACING * k + 0.1, SPACING * k + 0.5) for k in range(4))
UNCERTAIN = {
    "track.pad_stiffness": 0.2, "track.pad_damping": 0.3, "track.ballast_stiffness": 0.2, "track.ballast_damping": 0.3,
    "contact.constant_per_wheel": 0.05, "unsprung_mass": 0.08,
}  # fmt: skip


def gauges(track, pairs=PAIRS, **changes):
    """Return a site with gauges in neighbouring cribs."""
    sensors = [
        wt.sensors.RailShearForce(name=f"{number}", x1=a, x2=b, rate=RATE, gain_uncertainty=0.05)
        for number, (a, b) in enumerate(pairs)
    ]
    return Site(
        sensors=sensors, contact=wt.Hertz(constant_per_wheel=HERTZ), track=track, radius=RADIUS, unsprung_mass=MASS,
        uncertainty=UNCERTAIN, **changes,
    )  # fmt: skip


@cache
def wheel(site, speed, load, seed, rail):
    """Return what the gauges of a site read of a wheel, (gauge, samples), N."""
    rough = [wt.irregularities.Spectrum(curve="ISO 3095:2013", wavelengths=(0.022, 0.446), seed=seed)]
    if rail is not None:
        rough.append(wt.irregularities.Spectrum(curve="ISO 3095:2013", wavelengths=(0.022, 0.446), seed=rail))
    sensors = [one.model_copy(update={"x1": one.x1 + AHEAD, "x2": one.x2 + AHEAD}) for one in site.sensors]
    scene = known_of(site).scene.replaced({
        "vehicle.load": load - MASS * 9.81, "speed": speed, "duration": (AHEAD + BEYOND) / speed,
        "irregularity": rough, "track.first_sleeper": 0.0,
    })  # fmt: skip
    found = wt.simulate(scene).recordings(sensors)
    return np.stack([one.samples for one in found.values()])


def train(site, speed, loads, seed, rail=None, gains=1.0, axles=AXLES):
    """Return recordings of a train with wheels of these loads, N."""
    rng = np.random.default_rng(seed)
    each = [wheel(site, speed, load, 1000 * seed + k, rail) for k, load in enumerate(loads)]
    out = np.zeros((len(site.sensors), round((axles[-1] + AHEAD + BEYOND + 4.0) / speed * RATE)))
    for behind, read in zip(axles, each, strict=True):
        first = round((2.0 + behind) / speed * RATE)
        out[:, first : first + read.shape[1]] += read
    out = np.broadcast_to(gains, len(out))[:, None] * out + NOISE * rng.standard_normal(out.shape)
    return {one.name: Recording(row, RATE, "force") for one, row in zip(site.sensors, out, strict=True)}

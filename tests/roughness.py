"""The contact force on a rough rail by linear theory, in plain NumPy, and the same from a march.

Wheel, contact and rail act on each other at one place, N = r/(1/k_H + α_rail - 1/(m·ω²)), as if the wheel stood there.
The roughness repeats after LENGTH, whole bays of both tracks, so that the steady force has the same lines as it has,
and neither a window nor leakage disturbs their comparison.
"""

import numpy as np

import wheeltapper as wt

MASS, LOAD, CONSTANT = 1200.0, 188_228.0, 1.8825e11
SPEED, LENGTH, SETTLING = 20.0, 81.0, 0.5
RATE = 10_000.0
BANDS = 10.0 ** (np.arange(17, 34) / 10.0)
"""Middles of the third-octave bands from 50 to 2000 Hz."""


def track(parts):
    """Return Zhai's track with its seats split into so many, each of them as much softer and lighter."""
    whole = wt.tracks.Ballasted.named("Zhai2004")
    split = {
        name: getattr(whole, name) / parts
        for name in (
            "spacing", "pad_stiffness", "pad_damping", "sleeper_mass", "ballast_stiffness", "ballast_damping",
        )
    }  # fmt: skip
    return wt.tracks.Ballasted(rail=whole.rail, bays=80 * parts, **split)


def roughness(seed):
    """Return the roughness at the limit of ISO 3095:2013, as a patch of contact with a radius of 5 mm feels it."""
    return wt.irregularities.Spectrum(
        curve="ISO 3095:2013", wavelengths=(0.008, 0.446), seed=seed, period=LENGTH, patch="5 mm"
    )


def linear_response(rails, where, points=250):
    """Return frequencies, and the mean of |N/r|² over places of the wheel, (N/m)²."""
    grid = np.geomspace(0.9 * SPEED / 0.446, 1.1 * SPEED / 0.008, points)
    stiffness = 1.5 * CONSTANT ** (2 / 3) * (LOAD + MASS * 9.81) ** (1 / 3)
    rail = 0.5 * wt.tracks.receptance(rails, grid, where=list(where)).transpose("place", ...).values
    return grid, np.mean(np.abs(1.0 / stiffness + rail - 1.0 / (MASS * (2 * np.pi * grid) ** 2)) ** -2, axis=0)


def linear_levels(rough, response):
    """Return the force's levels in dB re 1 N by a linear response."""
    k, variance = rough.variances()
    grid, square = response
    return in_bands(SPEED * k, variance * np.exp(np.interp(np.log(SPEED * k), np.log(grid), np.log(square))))


def in_bands(frequency, power):
    """Return third-octave levels, dB re 1."""
    edge = 10**0.05
    return np.array([
        10 * np.log10(power[(frequency >= middle / edge) & (frequency < middle * edge)].sum()) for middle in BANDS
    ])  # fmt: skip


def marched(rough, rails):
    """Return the record of a run over the settling and one length of the roughness."""
    return wt.simulate(
        wt.Scenario(
            vehicle=wt.Wheelset(mass=MASS, load=LOAD), track=rails, contact=wt.Hertz(constant=CONSTANT),
            irregularity=rough, rolling="point", speed=SPEED, duration=SETTLING + LENGTH / SPEED,
        )
    )  # fmt: skip


def marched_levels(record):
    """Return the force's levels over the last length of the roughness, dB re 1 N."""
    count = round(LENGTH / SPEED * RATE)
    force = record.at(SETTLING + np.arange(count) / RATE).normal_force.values
    return in_bands(np.fft.rfftfreq(count, 1.0 / RATE), 2.0 * np.abs(np.fft.rfft(force) / count) ** 2)

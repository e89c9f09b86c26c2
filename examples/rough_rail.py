"""
A rough rail, by march and by linear theory
===========================================

As long as contact is not lost, wheel, contact and rail answer a roughness like three springs in a row (docs/theory,
section 15.6), if the wheel stood at one place of the rail. How good is that for a wheel that rolls over sleepers?

The roughness repeats after 81 m, a whole number of bays, so that the force of the steady motion has lines at the same
frequencies, and its spectrum needs no window.
"""  # noqa: D205, D400 - a title for the gallery

import numpy as np
from matplotlib.figure import Figure

import wheeltapper as wt

speed, length, settling = 20.0, 81.0, 0.5
constant, mass, load = 1.8825e11, 1200.0, 188_228.0
static = load + 9.81 * mass
rough = wt.irregularities.Spectrum(
    curve="ISO 3095:2013", wavelengths=(0.008, 0.446), seed=1, period=length, patch="5 mm"
)
bands = 10.0 ** (np.arange(17, 34) / 10.0)  # 50 Hz to 2 kHz


def in_bands(frequency, power):
    """Return third-octave levels, dB re 1 N."""
    edge = 10**0.05
    inside = [(frequency >= middle / edge) & (frequency < middle * edge) for middle in bands]
    return np.array([10 * np.log10(power[band].sum()) for band in inside])


def marched(track):
    """Return the levels of the force over one period of the roughness."""
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=mass, load=load), track=track, contact=wt.Hertz(constant=constant),
        irregularity=rough, rolling="point", speed=speed, duration=settling + length / speed,
    )  # fmt: skip
    record = wt.simulate(scene)
    print(record)
    times = settling + np.arange(0.0, length / speed, 1e-4)
    force = record.at(times).normal_force.values
    return in_bands(np.fft.rfftfreq(len(times), 1e-4), 2 * np.abs(np.fft.rfft(force) / len(times)) ** 2)


def linear(track, where):
    """Return the levels that linear theory gives for wheels that stand at some places."""
    wavenumber, variance = rough.variances()
    omega = 2 * np.pi * speed * wavenumber
    contact = 1 / (1.5 * constant ** (2 / 3) * static ** (1 / 3))
    seen = np.geomspace(0.9 * omega[0], 1.1 * omega[-1], 250)
    rail = 0.5 * wt.tracks.receptance(track, seen / (2 * np.pi), where=list(where)).transpose("place", ...).values
    squares = np.abs(contact + rail - 1 / (mass * seen**2)) ** -2
    mean = np.exp(np.interp(np.log(omega), np.log(seen), np.log(np.mean(squares, axis=0))))
    return in_bands(omega / (2 * np.pi), variance * mean)


# %%
# Zhai's track, and the same track with its seats 0.1 m apart, each of them six times softer and lighter: there it
# hardly matters where in the bay a wheel is, and both agree.

usual = wt.tracks.Ballasted.named("Zhai2004")
fields = ("spacing", "pad_stiffness", "pad_damping", "sleeper_mass", "ballast_stiffness", "ballast_damping")
dense = wt.tracks.Ballasted(rail=usual.rail, bays=480, **{name: getattr(usual, name) / 6 for name in fields})

difference = {}
for track in (dense, usual):
    places = track.spacing * (np.arange(4) + 0.5) / 4
    difference[track.spacing] = marched(track) - linear(track, places)
near = float(np.abs(difference[dense.spacing]).max())
far = float(difference[usual.spacing].min())
print(f"seats 0.1 m apart: the largest difference is {near:.2f} dB; 0.6 m apart: {far:.2f} dB")

# %%
# On the usual track, the theory of a standing wheel is wrong around the pinned-pinned frequency. There the receptance
# between sleepers has a sharp maximum, which a rolling wheel passes before the rail has begun to resonate; and as the
# response changes along the bay, each wave also answers at its frequency plus and minus multiples of 33 Hz, speed over
# spacing.

figure = Figure(figsize=(8.0, 6.5))
above, below = figure.subplots(2, 1, sharex=True)
frequencies = np.geomspace(45.0, 2200.0, 250)
seen = np.abs(wt.tracks.receptance(usual, frequencies, where=[0.0, 0.3])).transpose("place", ...)
for line, name in zip(seen.values, ("over a sleeper", "between two"), strict=True):
    above.loglog(frequencies, 1e9 * line, label=name)
above.set_ylabel("receptance [nm/N]")
above.legend()
for spacing, found in difference.items():
    below.semilogx(bands, found, "o-", label=f"seats {spacing:g} m apart")
below.axvline(float(wt.tracks.pinned_pinned(usual)), color="0.5", linestyle="--", linewidth=0.8)
below.set(xlabel="frequency [Hz]", ylabel="force: march over theory [dB]")
below.legend()

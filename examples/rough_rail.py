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


def marched(track, irregularity=rough):
    """Return the levels of the force over one period of the roughness."""
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=mass, load=load), track=track, contact=wt.Hertz(constant=constant),
        irregularity=irregularity, rolling="point", speed=speed, duration=settling + length / speed,
    )  # fmt: skip
    record = wt.simulate(scene)
    print(record)
    times = settling + np.arange(0.0, length / speed, 1e-4)
    force = record.at(times).normal_force.values
    return in_bands(np.fft.rfftfreq(len(times), 1e-4), 2 * np.abs(np.fft.rfft(force) / len(times)) ** 2)


def linear(track, where):
    """Return the levels that linear theory gives for wheels that stand at some places: the mean of their powers."""
    wavenumber, variance = rough.variances()
    omega = 2 * np.pi * speed * wavenumber
    contact = 1 / (1.5 * constant ** (2 / 3) * static ** (1 / 3))
    seen = np.geomspace(0.9 * omega[0], 1.1 * omega[-1], 200)
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
difference = {"seats 0.1 m apart": marched(dense) - linear(dense, [0.0, 0.05])}

# %%
# On the usual track, a wheel that stands over a sleeper, or between two, does not tell the force of one that rolls:
# near the pinned-pinned frequency it is wrong by 5 or 6 dB. The mean over the bay does, but for what no roughness
# makes: the static load passes from sleeper to sleeper, on a level rail too, at multiples of 33 Hz.

rolled, level = marched(usual), marched(usual, None)
bay = linear(usual, 0.6 * (np.arange(3) + 0.5) / 6)  # half of it: the other half is its mirror image
difference |= {
    "0.6 m: over a sleeper": rolled - linear(usual, [0.0]),
    "0.6 m: between two": rolled - linear(usual, [0.3]),
    "0.6 m: mean over the bay": rolled - bay,
    "the same, and sleepers passed": rolled - 10 * np.log10(10 ** (bay / 10) + 10 ** (level / 10)),
}
largest = {name: float(np.abs(found).max()) for name, found in difference.items()}
for name, found in largest.items():
    print(f"{name}: the largest difference is {found:.1f} dB")

# %%

figure = Figure(figsize=(8.0, 4.5))
axis = figure.subplots()
for (name, found), line in zip(difference.items(), ("o-", "^:", "v:", "s--", "s-"), strict=True):
    axis.semilogx(bands, found, line, label=name, markersize=4)
axis.axvline(float(wt.tracks.pinned_pinned(usual)), color="0.5", linestyle="--", linewidth=0.8, label="pinned-pinned")
axis.set(xlabel="frequency [Hz]", ylabel="march over theory [dB]")
axis.legend(fontsize=8)

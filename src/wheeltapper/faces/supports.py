"""Pictures of tracks and their parts: what lies under the rail, and how it gives way over frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from wheeltapper.describe.track.anomaly import Anomaly
from wheeltapper.describe.track.deck import FloatingDeck
from wheeltapper.describe.track.rail import Rail
from wheeltapper.describe.track.stiff import StiffTrack
from wheeltapper.describe.track.supported import SupportedRail
from wheeltapper.faces.panels import BLUE, COLOURS, GREEN, RED, legend_above, panels, spaced

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FREQUENCIES = np.geomspace(5.0, 2000.0, 240)
"""Hz, over which tracks are drawn."""
SEATS = range(-3, 4)
"""Seats that are drawn, unless anomalies are elsewhere."""
SLEEPER, PAD, BALLAST, RAIL = 0.26, 0.03, 0.3, 0.17
"""Width of a sleeper, and heights of pad, ballast and rail in sketches, m."""


def draw_supported(track: SupportedRail) -> Figure:
    """Draw some seats of a track, its receptance above a seat and between two, and the decay of its waves."""
    from wheeltapper.ask.tracks import decay_rate, pinned_pinned, receptance

    figure, (side, modulus, decay) = panels(3, 9.0, height_ratios=(1.1, 1.6, 1.2))
    draw_seats(side, track)
    regular = track.model_copy(update={"anomalies": ()})
    spacing = float(track.spacing)
    found = receptance(regular, FREQUENCIES, [0.0, 0.5 * spacing])
    for number, name in enumerate(("above a seat", "between two")):
        modulus.loglog(FREQUENCIES, 1e9 * np.abs(found.isel(place=number)), color=COLOURS[number], label=f"rail {name}")
    decay.loglog(FREQUENCIES, decay_rate(regular, FREQUENCIES), color=BLUE, label="slowest wave")
    pinned = float(pinned_pinned(regular))
    for axis in (modulus, decay):
        axis.axvline(pinned, color=RED, linewidth=0.8, linestyle="--", label=f"pinned-pinned, {pinned:.4g} Hz")
        legend_above(axis)
    modulus.set_ylabel("receptance [nm/N]")
    decay.set(ylabel="decay rate [dB/m]", xlabel="frequency [Hz]")
    modulus.sharex(decay)
    others = f", {len(track.anomalies)} anomalies (curves: of regular seats)" if track.anomalies else ""
    named = f" “{track.source.partition(':')[0]}”".replace("_", " ") if ":" in track.source else ""
    figure.suptitle(f"{spaced(type(track).__name__)} track{named}{others}", x=0.02, ha="left", fontsize=9)
    return figure


def draw_seats(axis: Axes, track: SupportedRail) -> None:
    """Draw rail, pads, sleepers and ballast from the side; seats that are not like the others are red."""
    changed = {change.seat: change for item in track.anomalies for change in item.changes(_seats_of(track))}
    spacing, first = float(track.spacing), float(track.first_sleeper)
    seats = _seats_of(track)
    bedded = bool(track.under_pads)
    ends = first + spacing * np.array([seats.start - 0.5, seats.stop - 0.5])
    _draw_box(axis, ends, 0.0, RAIL, "0.45")
    for seat in seats:
        x, change = first + spacing * seat, changed.get(seat)
        normal = change is None
        pad, ballast = (1.0, 1.0) if change is None else (change.pad, change.ballast)
        middle = x + 0.5 * SLEEPER * np.array([-1.0, 1.0])
        if pad:
            _draw_box(axis, middle * 0.7 + x * 0.3, -PAD, PAD, GREEN if normal else RED)
        if bedded:
            _draw_box(axis, middle, -PAD - 0.2, 0.2, "0.6" if normal else RED)
        void = change is not None and (change.void is not None or ballast == 0.0)
        if bedded and not void:
            _draw_box(axis, middle + 0.1 * np.array([-1.0, 1.0]), -PAD - 0.2 - BALLAST, BALLAST, "0.85")
    low = -PAD - (0.2 + BALLAST if bedded else 0.0)
    axis.axhline(low, color="0.3", linewidth=2.0)
    axis.set(xlim=ends, xlabel="x [m]", ylim=(low - 0.1, RAIL + 0.1))
    names = {"rail": 0.5 * RAIL, "sleeper": -PAD - 0.1, "ballast": -PAD - 0.2 - 0.5 * BALLAST}
    axis.set_yticks([*names.values()][: 3 if bedded else 1], [*names][: 3 if bedded else 1])
    axis.set_title("seats, heights not to scale" + ("" if bedded else "; the ground is rigid"))
    axis.grid(False)


def _seats_of(track: SupportedRail) -> range:
    named = [seat for item in track.anomalies for seat in item.places]
    return range(min(named) - 3, max(named) + 4) if named else SEATS


def _draw_box(axis: Axes, ends: Any, low: float, tall: float, colour: str) -> None:
    axis.fill([ends[0], ends[1], ends[1], ends[0]], [low, low, low + tall, low + tall], color=colour, linewidth=0.5)


def draw_deck(deck: FloatingDeck) -> Figure:
    """Draw the receptance of a deck, and where it lies."""
    mass, stiffness, damping = (float(value) for value in (deck.mass, deck.stiffness, deck.damping))
    own = np.sqrt(stiffness / mass) / (2.0 * np.pi)
    middle = own if own > 0.0 else 10.0
    frequency = np.unique(np.append(np.geomspace(0.1 * middle, 20.0 * middle, 400), middle))
    omega = 2.0 * np.pi * frequency
    found = 1.0 / (stiffness - mass * omega**2 + 1j * omega * damping)
    figure, (modulus, phase) = panels(2, 5.5, sharex=True, height_ratios=(2, 1))
    modulus.loglog(frequency, 1e9 * np.abs(found), color=BLUE, label="deck")
    modulus.axvline(middle, color=RED, linewidth=0.8, linestyle="--", label=f"its own frequency, {own:.4g} Hz")
    phase.semilogx(frequency, np.degrees(np.angle(found)), color=BLUE)
    modulus.set_ylabel("receptance [nm/N]")
    phase.set(xlabel="frequency [Hz]", ylabel="phase [°]", ylim=(-185.0, 5.0), yticks=[-180, -90, 0])
    legend_above(modulus)
    end = "" if deck.length is None else f" to {float(deck.start or 0.0) + float(deck.length):g} m"
    where = "without ends" if deck.start is None else f"from {float(deck.start):g} m on" if not end else (
        f"from {float(deck.start):g} m{end}"
    )  # fmt: skip
    figure.suptitle(f"floating deck of {mass / 1e3:g} t, {where}", x=0.02, ha="left")
    return figure


def draw_stiff(track: StiffTrack) -> Figure:
    """Draw a rail on rigid ground."""
    figure, (axis,) = panels(1, 2.2)
    _draw_box(axis, np.array([-1.0, 1.0]), 0.0, RAIL, "0.45")
    axis.fill_between([-1.0, 1.0], -0.12, 0.0, facecolor="none", edgecolor="0.4", hatch="////")
    axis.set(xlim=(-1.0, 1.0), ylim=(-0.2, 0.3), xlabel="x [m]")
    axis.set_yticks([0.5 * RAIL], ["rail"])
    axis.grid(False)
    figure.suptitle("stiff track: only the contact deforms", x=0.02, ha="left")
    return figure


def draw_rail(rail: Rail) -> Figure:
    """Draw the speed of waves in a free rail over frequency: as a Timoshenko beam, and as Euler's."""
    bending, shear = float(rail.bending_stiffness), float(rail.shear_stiffness)
    mass, inertia = float(rail.mass_per_length), rail.inertia
    frequency = np.geomspace(5.0, 5000.0, 300)
    omega = 2.0 * np.pi * frequency
    # EI·k⁴ - (m·EI/S + J)·ω²·k² + (m·J/S)·ω⁴ - m·ω² = 0, the larger root (docs/theory/track.rst, section 13.1)
    half = 0.5 * (mass * bending / shear + inertia) * omega**2
    square = (half + np.sqrt(half**2 + bending * (mass * omega**2 - mass * inertia / shear * omega**4))) / bending
    euler = (mass * omega**2 / bending) ** 0.25
    figure, (axis,) = panels()
    axis.loglog(frequency, omega / np.sqrt(square), color=BLUE, label="with shear and rotary inertia")
    axis.loglog(frequency, omega / euler, "--", color="0.5", label="Euler's beam")
    axis.set(xlabel="frequency [Hz]", ylabel="speed of bending waves [m/s]")
    legend_above(axis)
    figure.suptitle(
        f"rail of {mass:.4g} kg/m with a bending stiffness of {bending / 1e6:.4g} MN m²", x=0.02, ha="left", fontsize=9
    )
    return figure


def draw_anomaly(anomaly: Anomaly) -> Figure:
    """Draw by what factors seats differ from the others of a track."""
    places = anomaly.places
    seats = range(min(places) - 5, max(places) + 6) if places else range(-20, 21)
    changes = {change.seat: change for change in anomaly.changes(seats)}
    figure, (axis,) = panels(1, 3.5)
    for number, name in enumerate(("pad", "ballast")):
        values = [100.0 * getattr(changes[seat], name) if seat in changes else 100.0 for seat in seats]
        axis.bar(np.array(seats) + 0.2 * (2 * number - 1), values, 0.4, color=COLOURS[number], label=name)
    for seat in places:
        axis.axvspan(seat - 0.5, seat + 0.5, color=RED, alpha=0.12, zorder=0)
    axis.set(xlabel="seat [number]", ylabel="stiffness over the track's [%]")
    legend_above(axis)
    voids = [f"{1e3 * float(one.void):g} mm" for one in changes.values() if one.void is not None]
    void = f" above a void of {voids[0]}" if voids else ""
    figure.suptitle(f"{spaced(type(anomaly).__name__)}{void}", x=0.02, ha="left")
    return figure

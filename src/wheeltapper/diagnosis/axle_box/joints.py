"""Joints, welds and dips of the rail in the acceleration of an axle box: shapes of the rail, met once by a wheel.

Theory: docs/theory/gauges.rst, section 16.11.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks, welch

from wheeltapper.diagnosis.gauges.roughness import usual_amplitudes

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
LENGTHS = tuple(0.1 * 2.0 ** (0.5 * number) for number in range(9))
"""Of shapes that are compared, m."""
STANDS_OUT = 8.0
"""What is found is so many standard deviations of its height: that which the power tells, or that of heights over the
recording if it is larger."""
BESIDE, REACH, ECHO = 1.5, 8.0, 0.1
"""Within so many m the largest counts alone; within REACH what is less than this part of it does not count."""
PIECE = 0.5
"""Of a turn, of which spectra tell the power: so they do not show lines of the wheel's turn, whose part is taken away.
"""
END = 2.0
"""So near to an end of the recording nothing is told, m."""
OF_WHEEL, TURNS = 2.0, 0.85
"""What is found is so many times as large as what the same place of the wheel shows in this part of the other turns: a
flat's strikes differ, since they meet other places of a bay."""
AROUND = 0.15
"""How far such places are apart, m."""
ALIKE, MODEL_ERROR = 6.0, 0.15
"""Other shapes are not excluded if they lower χ² by this much less, and by this part of it."""
REPEATED, NEAR = 0.7, 0.15
"""Joints come at equal distances if this share of the distances is near a multiple of one, m."""
SHORTEST, LONGEST = 5.0, 120.0
"""Lengths of rails, m."""


class RailFlaw(NamedTuple):
    """A flaw of the rail.

    Attributes
    ----------
    place
        m after the first sample.
    kind
        "dipped joint", "dip" of another or of an unknown shape, or "weld": upwards.
    height
        Height of its middle, m, positive upwards.
    interval
        The 90 % interval of the height, m.
    length
        Length, m.
    peak
        Largest acceleration, m/s².
    """

    place: float
    kind: str
    height: float
    interval: tuple[float, float]
    length: float
    peak: float

    def to_dict(self) -> dict[str, Any]:
        """Return everything, in SI units."""
        return {**self._asdict(), "interval": list(self.interval)}


def shapes(x: FloatArray) -> dict[tuple[str, float], FloatArray]:
    """Return heights at places beside the middle, of 1 m in the middle, by name and length, m."""
    out = {}
    for length in LENGTHS:
        along = np.clip(np.abs(x) / length, 0.0, 0.5)
        out["joint", length] = -((1.0 - 2.0 * along) ** 2)
        out["cosine", length] = 0.5 + 0.5 * np.cos(2.0 * np.pi * along)
    return out


def flaws_in(
    left: FloatArray, rate: float, speed: float, answer: Callable[[FloatArray], ComplexArray], turn: float
) -> list[RailFlaw]:
    """Return what the rail has, by place.

    Parameters
    ----------
    left
        Acceleration without what is the wheel's and the seats', m/s².
    rate
        Samples per second, Hz.
    speed
        m/s.
    answer
        Acceleration per height of the rail at frequencies, 1/s².
    turn
        Circumference of the wheel, m.
    """
    count = len(left)
    x = np.asarray((np.arange(count) - count // 2) * speed / rate, dtype=np.float64)
    frequencies = np.asarray(np.fft.rfftfreq(count, 1.0 / rate), dtype=np.float64)
    piece = max(16, int(PIECE * turn / speed * rate))
    measured, power = welch(left, rate, nperseg=min(count, piece), average="median")
    spectrum, own, step = np.fft.rfft(left), answer(frequencies), float(frequencies[1])
    rough = usual_amplitudes(frequencies / speed, step / speed) ** 2 / step
    power = np.maximum(np.interp(frequencies, measured, power), np.abs(own) ** 2 * rough)
    weight = own / np.maximum(power, 1e-9 * power.max())
    names, heights, sizes = [], [], []
    for name, shape in shapes(x).items():
        line = np.fft.rfft(np.fft.ifftshift(shape))
        scale = np.real(np.sum(np.abs(line) ** 2 * own.conj() * weight)) * 2.0 / count
        found = np.fft.irfft(spectrum * np.conj(line * weight), count) / scale
        names.append(name)
        heights.append(found)
        over = found * np.sqrt(2.0 * scale / rate)
        sizes.append(over / max(1.0, 1.4826 * float(np.median(np.abs(over)))))
    table = np.abs(np.array(sizes))
    return _picked(np.array(heights), table, names, left, rate, speed, turn)


def _picked(
    heights: FloatArray, table: FloatArray, names: list[tuple[str, float]], left: FloatArray, rate: float, speed: float,
    turn: float,
) -> list[RailFlaw]:  # fmt: skip
    top, apart = table.max(axis=0), speed / rate
    cut = int(END / apart)
    top[:cut], top[len(top) - cut :] = 0.0, 0.0
    peaks, _ = find_peaks(top, height=STANDS_OUT, distance=max(1, int(0.2 * BESIDE / apart)))
    out: list[RailFlaw] = []
    taken: list[tuple[int, float]] = []
    for at in sorted(peaks.tolist(), key=lambda one: -top[one]):
        beside = [(abs(at - other) * apart, size) for other, size in taken]
        if any(d < BESIDE or (d < REACH and top[at] < ECHO * size) for d, size in beside):
            continue
        if top[at] < OF_WHEEL * _other_turns(top, at, turn / apart, AROUND / apart):
            continue
        taken.append((at, top[at]))
        out.append(_flaw(heights[:, at], table[:, at], names, at, left, rate, speed))
    return sorted(out, key=lambda one: one.place)


def _other_turns(top: FloatArray, at: int, turn: float, around: float) -> float:
    """Return what the same place of the wheel shows in other turns, but in the few that show most."""
    near = int(np.ceil(around))
    others = np.arange(-int(at / turn), int((len(top) - 1 - at) / turn) + 1)
    middles = np.rint(at + others[others != 0] * turn).astype(int)
    shown = [top[max(0, one - near) : one + near + 1].max() for one in middles]
    return float(np.quantile(shown, TURNS)) if shown else 0.0


def _flaw(
    heights: FloatArray, table: FloatArray, names: list[tuple[str, float]], at: int, left: FloatArray, rate: float,
    speed: float,
) -> RailFlaw:  # fmt: skip
    best = int(np.argmax(table))
    alike = table**2 > table[best] ** 2 * (1.0 - MODEL_ERROR) - ALIKE
    turned = np.array([-1.0 if one == "joint" else 1.0 for one, _ in names]) * heights  # its shape is one downwards
    alike &= np.sign(turned) == np.sign(turned[best])
    spread = 1.645 * np.abs(heights) / table
    ends = float((turned - spread)[alike].min()), float((turned + spread)[alike].max())
    name, length = names[best]
    sure = name == "joint" and all(one == "joint" for (one, _), own in zip(names, alike, strict=True) if own)
    height = float(turned[best])
    kind = "weld" if height > 0.0 else "dipped joint" if sure else "dip"
    near = slice(max(0, at - int(0.5 * rate / speed)), at + int(rate / speed) + 1)
    return RailFlaw(at * speed / rate, kind, height, ends, length, float(np.abs(left[near]).max()))


def distance_of(places: FloatArray) -> float | None:
    """Return the distance at which joints come again, m; None where they do not."""
    apart = np.diff(places)
    if len(apart) < 3:
        return None
    for one in np.unique(np.round(apart[(apart > SHORTEST) & (apart < LONGEST)], 1))[::-1]:
        times = np.maximum(np.rint(apart / one), 1.0)
        near = np.abs(apart - times * one) < NEAR * np.sqrt(times)
        if near.mean() >= REPEATED:
            return float(np.median(apart[near] / times[near]))
    return None

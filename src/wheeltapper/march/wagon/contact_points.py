"""The contact of a circle and a profile of waves and chords, with height, slope and curvature of the profile.

The profile consists of cells, each of them the sum of its terms:

    cell i      terms[first[i] : first[i + 1]]
    a wave      OFFSET + SINE·sin(WAVENUMBER·(s - ORIGIN)) + COSINE·cos(WAVENUMBER·(s - ORIGIN)), a level without any
    a chord     of a circle of RADIUS, between its ends START and END at a distance of BELOW from the circle's centre
"""

from __future__ import annotations

from math import cos, sin, sqrt

from wheeltapper.march.common.kernel import plain_kernel
from wheeltapper.march.common.program import FloatArray, IntArray

TERM = 6
KIND = 0
TERM_WAVE, CHORD = 0.0, 1.0
TERM_OFFSET, TERM_SINE, TERM_COSINE, TERM_WAVENUMBER, TERM_ORIGIN = range(1, 6)
SPAN_START, SPAN_END, SPAN_RADIUS, SPAN_BELOW = range(1, 5)
NEWTON_STEPS = 80
LAST_DIGIT, PART = 4e-16, 1e-2
"""A point of contact is found when a step is below LAST_DIGIT times the place and PART times the radius of the
circle."""


@plain_kernel
def _term_derivatives(terms: FloatArray, s: float) -> tuple[float, float, float]:
    """Return value, slope and curvature of the sum of some terms."""
    value, slope, curvature = 0.0, 0.0, 0.0
    for i in range(len(terms)):
        if terms[i, KIND] == CHORD:
            start, end, radius = terms[i, SPAN_START], terms[i, SPAN_END], terms[i, SPAN_RADIUS]
            x = s - 0.5 * (start + end)
            root = sqrt(radius * radius - x * x)
            value += (s - start) * (s - end) / (terms[i, SPAN_BELOW] + root)
            slope += x / root
            curvature += radius * radius / (root * root * root)
            continue
        value += terms[i, TERM_OFFSET]
        k = terms[i, TERM_WAVENUMBER]
        if k != 0.0:
            phase = k * (s - terms[i, TERM_ORIGIN])
            across, along = sin(phase), cos(phase)
            wave = terms[i, TERM_SINE] * across + terms[i, TERM_COSINE] * along
            value += wave
            slope += k * (terms[i, TERM_SINE] * along - terms[i, TERM_COSINE] * across)
            curvature -= k * k * wave
    return value, slope, curvature


@plain_kernel
def evaluate(terms: FloatArray, first: IntArray, cell: IntArray, s: FloatArray, order: int, out: FloatArray) -> None:
    """Write the value (order 0), slope (1) or curvature (2) of the profile at s, each in the given cell."""
    for i in range(len(s)):
        c = cell[i]
        out[i] = _term_derivatives(terms[first[c] : first[c + 1]], s[i])[order]


@plain_kernel
def bracket_contacts(
    places: FloatArray, contacts: FloatArray, first: IntArray, owner: IntArray, x: FloatArray, s: FloatArray,
    low: FloatArray, high: FloatArray,
) -> None:  # fmt: skip
    """Write approximate points of contact of circles with centres above x, each on the given branch, and bounds.

    Branch i holds the samples first[i] : first[i + 1] of the circle's places and its points of contact, both rising.
    Beyond its ends it touches there.
    """
    for i in range(len(x)):
        begin, end = first[owner[i]], first[owner[i] + 1]
        left, right = begin, end - 1  # the last sample not beyond x, and the one after it
        while right - left > 1:
            middle = (left + right) // 2
            if places[middle] < x[i]:
                left = middle
            else:
                right = middle
        share = (x[i] - places[left]) / (places[right] - places[left])
        s[i] = contacts[left] + min(max(share, 0.0), 1.0) * (contacts[right] - contacts[left])
        low[i], high[i] = contacts[max(left - 1, begin)], contacts[min(right + 1, end - 1)]


@plain_kernel
def refine_contacts(
    terms: FloatArray, first: IntArray, cell: IntArray, radius: float, x: FloatArray, low: FloatArray,
    high: FloatArray, s: FloatArray,
) -> None:  # fmt: skip
    """Refine the points of contact of circles with centres above x in a cell between low and high.

    The profile's slope less that of the circle falls through zero there. If it does not, s is one of the ends.
    """
    for i in range(len(s)):
        here, there = terms[first[cell[i]] : first[cell[i] + 1]], s[i]
        lo, hi = low[i], high[i]
        for _ in range(NEWTON_STEPS):
            at = there
            _, slope, curvature = _term_derivatives(here, at)
            u = at - x[i]
            root = sqrt(radius * radius - u * u)
            gap = slope - u / root
            bend = curvature - radius * radius / (root * root * root)
            if gap > 0.0:
                lo = at
            else:
                hi = at
            there = at - gap / (bend if bend != 0.0 else -1.0)
            if not lo <= there <= hi:
                there = 0.5 * (lo + hi)
            if not abs(there - at) > LAST_DIGIT * (abs(there) + PART * radius):
                break
        s[i] = there

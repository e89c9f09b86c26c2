"""A new term in the equation of motion is one line of a tape: series and tangents follow, here of two that nobody has.

A damper whose force grows with the cube of the velocity, and an elastic law N = C·δ^1.25. The latter needs another
variable than Hertz's: with δ = u⁴ and dt = u³ ds all is polynomial. The series are put into the equations in time.
"""

import mpmath
import pytest

from wheeltapper.march.steps import derive, tangents
from wheeltapper.march.steps.equations import Terms, contact
from wheeltapper.march.steps.tape import Tape, constant

mpmath.mp.dps = 50
ORDER = 12
VALUES = {name: mpmath.mpf(value) for name, value in {
    "u0": "1.1", "w0": "0.3", "K": "0.02", "G": "0.03", "cubic": "1.2", "quadratic": "0", "f0": "1", "drag": "0.05",
}.items()}  # fmt: skip


def with_cubic_drag():
    tape = contact(Terms("flat"))
    u, p, q = (tape.called(name) for name in ("u", "p", "q"))
    v = tape.named("v", "G" * q - p)  # of the wheel: the rail is level
    tape.rate(p, tape.rates[p] + "drag" * tape.product(u, tape.product(v, tape.product(v, v))))
    return tape


def softer_law():
    tape = Tape()
    t, u, p = tape.state("t", first=1), tape.state("u"), tape.state("p")
    square = tape.product(u, u)
    q, cube = tape.product(square, square, "q"), tape.product(u, square)
    w = tape.named("w", p - "G" * q)
    tape.rate(t, constant(0.0) + cube)
    tape.rate(u, 0.25 * w)
    tape.rate(p, "f0" * cube - "K" * tape.product(cube, q) - "cubic" * tape.product(q, q))
    return tape


MODELS = {"cubic drag": (with_cubic_drag, "drag", 2), "softer law": (softer_law, "cubic", 4)}
"""The tape, a number of the model, and which power of u the indentation is."""


def lines_of(tape, power, way):
    start = f"p0 = w0 + G * u0**{power}"
    return [start, "t0 = 0.0 * u0", *(line for line in way(tape, ORDER) if not line.startswith("w0 = "))]


def run(lines, known):
    known = dict(known)
    for name, code in (line.split(" = ", 1) for line in lines):
        known[name] = eval(code, {}, known)
    return known


def times(a, b):
    return [mpmath.fsum(a[j] * b[n - j] for j in range(n + 1)) for n in range(ORDER)]


def raised(a, power):
    out = [mpmath.mpf(1)] + [mpmath.mpf(0)] * ORDER
    for _ in range(power):
        out = times(out, a)
    return out


@pytest.mark.parametrize("way", [derive.coefficients, derive.quick_coefficients])
@pytest.mark.parametrize("name", MODELS)
def test_series_satisfy_the_equations_in_time(name, way):
    tape, _, power = MODELS[name]
    found = run(lines_of(tape(), power, way), VALUES)
    t, u, w = ([found[f"{series}{n}"] for n in range(ORDER + 1)] for series in "tuw")
    depth, pace = raised(u, power), [(n + 1) * t[n + 1] for n in range(ORDER)]
    assert pace == pytest.approx(raised(u, power - 1), rel=1e-15)
    force = [VALUES["cubic"] * x for x in raised(u, 3 if power == 2 else 5)]  # δ^1.5, or δ^1.25
    drag = [VALUES["drag"] * x if power == 2 else 0 for x in raised([-x for x in w], 3)]
    pull = [  # w' in time: the wheel has mass and weight one, and is pressed into a level rail
        (n == 0) - VALUES["K"] * depth[n] - VALUES["G"] * w[n] - force[n] + drag[n] for n in range(ORDER)
    ]
    for series, rate in ((depth, times(w, pace)), (w, times(pull, pace))):
        for n in range(ORDER - 1):
            assert abs((n + 1) * series[n + 1] - rate[n]) < 1e-15 * max(abs(x) for x in rate[: n + 2])


@pytest.mark.parametrize("name", MODELS)
def test_tangents_are_derived(name):
    tape, number, power = MODELS[name]
    lines = lines_of(tape(), power, derive.coefficients)
    values = tangents._split(lines)
    rates = tangents._rates(values, {number}, {})
    exact = run([" = ".join(line) for line in [*values, *rates]], VALUES | {f"d{number}": mpmath.mpf(1)})
    step = mpmath.mpf(10) ** -15
    above, below = (run(lines, VALUES | {number: VALUES[number] + sign * step}) for sign in (1, -1))
    for series in "utw":
        for n in range(3, ORDER):
            difference = (above[f"{series}{n}"] - below[f"{series}{n}"]) / (2 * step)
            assert abs(exact[f"d{series}{n}"] - difference) < 1e-20 * (1 + abs(difference))

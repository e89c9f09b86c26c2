"""Steps of a wheel against series in 50 digits, which are computed here from the equations in their plain form."""

import linecache
from math import comb, inf

import mpmath
import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.lower.build import lower
from wheeltapper.march import layout, program, series
from wheeltapper.march.flight import flight_reach
from wheeltapper.march.single import march
from wheeltapper.march.steps import written
from wheeltapper.march.steps.equations import BENT, FLAT, WAVE, Free, Terms

mpmath.mp.dps = 50
TOLERANCE = 1e-7
ROWS = {"t": layout.T, "u": layout.U, "w": layout.W, "Y": layout.Y, "Z": layout.Z, "N": layout.N, "e": layout.BUSH,
        "x": layout.WHEEL_Y, "v": layout.WHEEL_V, "clear": layout.CLEAR}  # fmt: skip


class Truncated:
    """A power series of which the first coefficients are known."""

    def __init__(self, terms):
        self.terms = list(terms)

    def __getitem__(self, n):
        return self.terms[n] if n < len(self.terms) else mpmath.mpf(0)


def product(a, b, n):
    return mpmath.fsum(a[j] * b[n - j] for j in range(n + 1))


def composed(polynomial, inner, n):
    """Coefficient n of a polynomial of a series, by Horner's rule."""
    out = Truncated([mpmath.mpf(0)] * (n + 1))
    for c in reversed(polynomial):
        out = Truncated([product(out, inner, k) + (c if k == 0 else 0) for k in range(n + 1)])
    return out[n]


def derivative(polynomial):
    return [k * c for k, c in enumerate(polynomial)][1:] or [mpmath.mpf(0)]


def drawn(rng, terms):
    """Numbers, a piece of a path and scratch memory of a step in progress."""
    numbers, S = np.zeros(program.NUMBERS), np.zeros(layout.SCRATCH)
    pieces = np.zeros((1, program.MARKED_COLUMNS))
    numbers[[program.STIFFNESS, program.DAMPING]] = rng.uniform(1e-3, 5e-2, 2)
    numbers[[program.QUADRATIC, program.CUBIC]] = rng.uniform(0, 0.3), rng.uniform(0.5, 1.5)
    numbers[[program.PACE, program.LIFT, program.TOLERANCE]] = rng.uniform(0.5, 2), rng.uniform(0.5, 2), TOLERANCE
    state = S[layout.STATE :]
    state[[program.TIME, program.A, program.B]] = rng.uniform(0, 3), rng.uniform(0.5, 1.5), rng.uniform(-1, 1)
    state[program.SHIFT] = rng.uniform(-1, 1)
    row, bent, free = pieces[0], getattr(terms, "path", BENT) == BENT, isinstance(terms, Free)
    away = numbers[program.PACE] * state[program.TIME] - state[program.SHIFT]
    row[[program.CENTRE, program.SCALE]] = away - rng.uniform(-1, 1), rng.uniform(1, 3)
    row[program.DEGREE], row[program.COEFFICIENT] = 0, rng.uniform(-1, 1)
    row[program.FACTOR_DEGREE] = -1
    if bent:
        row[program.DEGREE] = 8
        row[program.COEFFICIENT : program.COEFFICIENT + 9] = rng.uniform(-1, 1, 9) * 0.5 ** np.arange(9)
        row[program.FACTOR_DEGREE] = 8
        row[program.FACTOR : program.FACTOR + 9] = 0.1 * rng.uniform(-1, 1, 9) * 0.5 ** np.arange(9)
        row[program.FACTOR] += 1
    if getattr(terms, "path", BENT) != FLAT:
        row[[program.SINE, program.COSINE]], row[program.WAVENUMBER] = rng.uniform(-1, 1, 2), rng.uniform(0.5, 2)
    if terms.deck:
        numbers[[program.DECK_MASS, program.DECK_STIFFNESS, program.DECK_DAMPING]] = rng.uniform([2, 0, 0], [20, 1, 1])
        numbers[program.PRESTRESS], state[program.ON_DECK] = rng.uniform(0, 2), 1.0
        state[[program.DECK_Y, program.DECK_V]] = rng.uniform(-1, 1, 2)
    if terms.end:
        S[[layout.END_G, layout.END_B, layout.END_BETA]] = 0.0, *rng.uniform(0.1, 0.5, 2)
        state[program.END_DEFLECTION] = rng.uniform(-1, 1)
    if not free and terms.hysteresis:
        numbers[program.HYSTERESIS] = rng.uniform(0.05, 0.3)
    if not free and terms.yields:
        row[program.RESIDUAL_DEGREE] = 2 if bent else 0
        row[program.RESIDUAL : program.RESIDUAL + (3 if bent else 1)] = 0.1 * rng.uniform(0, 1, 3 if bent else 1)
        series.localise_marks(pieces, numbers, 0, state[program.SHIFT], state[program.TIME], S)
        S[[layout.HERE_LAW_TERMS, layout.HERE_LAW_CENTRE, layout.HERE_LAW_SCALE]] = 9, 1.0, 0.8
        S[layout.HERE_LAW : layout.HERE_LAW + 9] = rng.uniform(0.2, 1, 9) * 0.4 ** np.arange(9)
    series.localise(pieces, numbers, 0, state[program.SHIFT], state[program.TIME], S)
    return numbers, pieces, S


class Exact:
    """The equations of a step, in their plain form and in 50 digits."""

    def __init__(self, numbers, pieces, S, terms):
        def polynomial(source, degree, gain=1):
            x = mpmath.mpf(numbers[program.PACE]) * state[program.TIME] - state[program.SHIFT] - row[program.CENTRE]
            x, rate = x / row[program.SCALE], mpmath.mpf(numbers[program.PACE]) / row[program.SCALE]
            terms = [gain * mpmath.mpf(row[source + k]) for k in range(int(row[degree]) + 1)]
            return [
                rate**k * mpmath.fsum(terms[j] * comb(j, k) * x ** (j - k) for j in range(k, len(terms)))
                for k in range(len(terms))
            ]

        state, row, mp = [mpmath.mpf(x) for x in S[layout.STATE :]], pieces[0], mpmath.mpf
        self.terms, self.numbers = terms, [mp(x) for x in numbers]
        lift = self.numbers[program.LIFT]
        self.path = polynomial(program.COEFFICIENT, program.DEGREE, lift)
        self.factor = polynomial(program.FACTOR, program.FACTOR_DEGREE) or [mp(1)]
        self.residual = polynomial(program.RESIDUAL, program.RESIDUAL_DEGREE, lift)
        self.law = [mp(x) for x in S[layout.HERE_LAW : layout.HERE_LAW + 9]]
        phase = mp(row[program.WAVENUMBER]) * (
            self.numbers[program.PACE] * state[program.TIME] - state[program.SHIFT] - row[program.CENTRE]
        )
        self.omega = mp(row[program.WAVENUMBER]) * self.numbers[program.PACE]
        a, b = lift * row[program.SINE], lift * row[program.COSINE]
        self.h0 = a * mpmath.sin(phase) + b * mpmath.cos(phase)
        self.g0 = self.omega * (a * mpmath.cos(phase) - b * mpmath.sin(phase))
        self.start = {name: state[at] for name, at in (
            ("a", program.A), ("b", program.B), ("Y", program.DECK_Y), ("Z", program.DECK_V),
            ("e", program.END_DEFLECTION), ("on", program.ON_DECK),
        )}  # fmt: skip
        self.K = self.numbers[program.STIFFNESS]
        self.G = mp(S[layout.END_G]) if terms.end else self.numbers[program.DAMPING]
        self.bush, self.rate = (mp(S[layout.END_B]), mp(S[layout.END_BETA])) if terms.end else (mp(0), mp(0))

    def deck(self, y, z, force, n):
        """Coefficient n of the acceleration of the deck."""
        mass, stiff, drag = self.numbers[program.DECK_MASS : program.DECK_DAMPING + 1]
        if mass == 0:
            return mpmath.mpf(0)
        load = self.numbers[program.PRESTRESS] if n == 0 else 0
        return (self.start["on"] * (load - force) - stiff * y[n] - drag * z[n]) / mass

    def force(self, c, n):
        """Coefficient n of the contact force."""
        if self.terms.yields:
            depth = Truncated([c["q"][k] + composed(self.residual, c["t"], k) for k in range(n + 1)])
            depth.terms[0] -= 1
            return composed(self.law, Truncated([x / mpmath.mpf(0.8) for x in depth.terms]), n)
        law = [self.numbers[program.QUADRATIC] * c["q"][k] + self.numbers[program.CUBIC] * product(c["q"], c["u"], k)
               for k in range(n + 1)]  # fmt: skip
        factor = Truncated([composed(self.factor, c["t"], k) for k in range(n + 1)])
        elastic = Truncated([product(Truncated(law), factor, k) for k in range(n + 1)])
        return elastic[n] + self.numbers[program.HYSTERESIS] * product(elastic, c["w"], n)

    def contact(self, order):
        """Coefficients in s."""
        names = ("t", "u", "w", "Y", "Z", "e", "x", "h", "g", "q", "N", "v", "pull", "A", "slip")
        c = {name: Truncated([]) for name in names}
        s, on = self.start, self.start["on"]
        first = {"t": mpmath.mpf(0), "u": s["a"], "w": s["b"], "Y": s["Y"], "Z": s["Z"], "e": s["e"], "h": self.h0,
                 "g": self.g0, "x": self.path[0] + self.h0 + on * s["Y"] - s["a"] ** 2}  # fmt: skip
        for name, value in first.items():
            c[name].terms.append(value)
        slope, bend = derivative(self.path), derivative(derivative(self.path))
        for n in range(order):
            c["q"].terms.append(product(c["u"], c["u"], n))
            c["N"].terms.append(self.force(c, n))
            velocity = composed(slope, c["t"], n) + c["g"][n]
            c["v"].terms.append(velocity + on * c["Z"][n] - c["w"][n])
            c["A"].terms.append(self.deck(c["Y"], c["Z"], c["N"][n], n))
            wheel = c["N"][n] - self.K * c["x"][n] - self.G * c["v"][n] - self.bush * c["e"][n] - (n == 0)
            rail = composed(bend, c["t"], n) - self.omega**2 * c["h"][n] + on * c["A"][n]
            c["pull"].terms.append(rail - wheel)
            c["slip"].terms.append(c["v"][n] - self.rate * c["e"][n])
            u = c["u"]
            rates = {"t": u[n], "u": c["w"][n] / 2, "w": product(u, c["pull"], n), "Y": product(u, c["Z"], n),
                     "Z": product(u, c["A"], n), "e": product(u, c["slip"], n), "x": product(u, c["v"], n),
                     "h": product(u, c["g"], n), "g": -self.omega**2 * product(u, c["h"], n)}  # fmt: skip
            for name, rate in rates.items():
                c[name].terms.append(rate / (n + 1))
        return c

    def free(self, order):
        """Coefficients in time; u and w are displacement and velocity of the wheel there."""
        c = {name: Truncated([]) for name in ("u", "w", "Y", "Z", "e", "h", "g", "clear", "N")}
        for name in ("Y", "Z", "e"):
            c[name].terms.append(self.start[name])
        for name, value in (("u", self.start["a"]), ("w", self.start["b"]), ("h", self.h0), ("g", self.g0)):
            c[name].terms.append(value)
        path, factor = Truncated(self.path), Truncated(self.factor)
        for n in range(order + 1):
            c["clear"].terms.append(path[n] + c["h"][n] - c["u"][n] + self.start["on"] * c["Y"][n])
            c["N"].terms.append(product(factor, c["clear"], n) if self.terms.bonded else mpmath.mpf(0))
            wheel = c["N"][n] - self.K * c["u"][n] - self.G * c["w"][n] - self.bush * c["e"][n] - (n == 0)
            rates = {"u": c["w"][n], "w": wheel, "Y": c["Z"][n], "Z": self.deck(c["Y"], c["Z"], c["N"][n], n),
                     "e": c["w"][n] - self.rate * c["e"][n], "h": c["g"][n],
                     "g": -self.omega**2 * c["h"][n]}  # fmt: skip
            for name, rate in rates.items():
                c[name].terms.append(rate / (n + 1))
        return c


def worst(S, exact, names):
    """The largest error of a coefficient, relative to it or, where it is small for its order, to its neighbours."""
    found = 0.0
    for name in names:
        terms = np.array([float(x) for x in exact[name].terms])
        size = np.abs(terms)
        for n, term in enumerate(exact[name].terms):
            near = max(size[max(n - 2, 0) : n + 3])
            if near > 0.0:
                found = max(found, float(abs(mpmath.mpf(S[ROWS[name] + n]) - term)) / near)
    return found


@pytest.mark.parametrize("order", [12, 20])
@pytest.mark.parametrize("terms", written.VARIANTS, ids=lambda terms: terms.name)
def test_coefficients_of_contact_steps_are_those_of_50_digits(terms, order):
    rng = np.random.default_rng([written.VARIANTS.index(terms), order])
    for _ in range(3):
        numbers, pieces, S = drawn(rng, terms)
        exact = Exact(numbers, pieces, S, terms).contact(order)
        numbers[program.ORDER] = order
        written.function(terms, order)(numbers, pieces, inf, 0, pieces, S)
        names = ["t", "u", "w", "N", *(["Y", "Z"] if terms.deck else []), *(["x", "v", "e"] if terms.end else [])]
        assert worst(S, exact, names) < 1e-14


@pytest.mark.parametrize("terms", written.FREE, ids=lambda terms: terms.name)
def test_coefficients_of_steps_in_time_are_those_of_50_digits(terms):
    numbers, pieces, S = drawn(np.random.default_rng(written.FREE.index(terms)), terms)
    order = int(layout.FLIGHT_ORDER)
    exact = Exact(numbers, pieces, S, terms).free(order)
    written.function(terms, order)(numbers, pieces, inf, 0, pieces, S)
    names = ["u", "w", "clear", *(["Y", "Z"] if terms.deck else []), *(["e"] if terms.end else [])]
    powers = flight_reach(numbers, S) ** np.arange(order + 1)
    for name in [*names, *(["N"] if terms.bonded else [])]:  # their terms within a step
        expected = powers * np.array([float(x) for x in exact[name].terms[: order + 1]])
        found = powers * S[ROWS[name] : ROWS[name] + order + 1]
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14 * np.abs(expected).max())


BUMP = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=95285, stiffness=2.4e6, damping=1e4),
    contact=wt.Hertz(constant=1.9e11),
    irregularity=wt.CosineBump(height=0.5e-3, length=50e-3, start=0.01),
    rolling="point",
    speed=5,
    duration=0.5,
)
UNFELT = {
    "hysteresis": ({program.HYSTERESIS: 1e-300}, {}),
    "a factor": ({}, {program.FACTOR_DEGREE: 0.0, program.FACTOR: 1.0}),
    "a polynomial": ({}, {program.DEGREE: 1.0}),
    "a deck": ({program.DECK_MASS: 1e300, program.DECK_TO: inf, program.PRESTRESS: 1.0}, {}),
}
"""Terms that cannot be felt: entries of the numbers and columns of the pieces."""


@pytest.mark.parametrize("method", ["default", "strict"])
@pytest.mark.parametrize("added", UNFELT)
def test_a_term_that_cannot_be_felt_changes_nothing(added, method):
    pieces, numbers, *_ = lower(BUMP, method).program
    more, bent = numbers.copy(), pieces.copy()
    for entry, value in UNFELT[added][0].items():
        more[entry] = value
    for column, value in UNFELT[added][1].items():
        bent[:, column] = value
    plain, other = march(program.Program(pieces, numbers)), march(program.Program(bent, more))
    assert len(plain.events) == len(other.events) > 100
    np.testing.assert_allclose(plain.events, other.events, rtol=0, atol=1e-9)
    np.testing.assert_allclose(plain.peaks, other.peaks, rtol=0, atol=1e-9)


def test_a_function_s_lines_can_be_read():
    made = written.function(Terms(FLAT), 12)
    lines = linecache.getlines(made.py_func.__code__.co_filename)
    assert "".join(lines) == written.text(Terms(FLAT), 12)
    assert any(line.strip().startswith("u12 = ") for line in lines)


def test_there_are_at_most_24_functions_of_an_order():
    assert len(written.VARIANTS) == len(set(written.VARIANTS)) == 24
    assert {terms.path for terms in written.VARIANTS} == {FLAT, WAVE, BENT}

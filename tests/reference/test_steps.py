"""Steps of a wheel against series in 50 digits, which are computed here from the equations in their plain form."""

import linecache
import re
import time
from concurrent.futures import ThreadPoolExecutor
from math import comb, inf

import llvmlite.binding as llvm
import mpmath
import numba
import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.lower.build import lower
from wheeltapper.march.common import program
from wheeltapper.march.common.kernel import FASTMATH
from wheeltapper.march.steps import lane_rows as at
from wheeltapper.march.steps import lanes, layout, powers, scalar, series, tangent_path, tangents, variants, written
from wheeltapper.march.steps.equations import BENT, FLAT, WAVE, Free, Terms
from wheeltapper.march.steps.variants import FREE, OF_ENDED, OF_YIELDING, VARIANTS
from wheeltapper.march.wheel.single import march
from wheeltapper.march.wheel.step import flight_reach

from ..marks import slow_but

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


@pytest.mark.few(8)
@pytest.mark.parametrize("order", [12, *slow_but([20])])
@pytest.mark.parametrize("terms", VARIANTS, ids=lambda terms: terms.name)
def test_coefficients_of_contact_steps_are_those_of_50_digits(terms, order):
    rng = np.random.default_rng([VARIANTS.index(terms), order])
    for _ in range(3):
        numbers, pieces, S = drawn(rng, terms)
        exact = Exact(numbers, pieces, S, terms).contact(order)
        numbers[program.ORDER] = order
        written.compiled(scalar.source(terms, order))(numbers, pieces, inf, 0, pieces, S)
        names = ["t", "u", "w", "N", *(["Y", "Z"] if terms.deck else []), *(["x", "v", "e"] if terms.end else [])]
        assert worst(S, exact, names) < 1e-14


@pytest.mark.parametrize("terms", FREE, ids=lambda terms: terms.name)
def test_coefficients_of_steps_in_time_are_those_of_50_digits(terms):
    numbers, pieces, S = drawn(np.random.default_rng(FREE.index(terms)), terms)
    order = int(layout.FLIGHT_ORDER)
    exact = Exact(numbers, pieces, S, terms).free(order)
    written.compiled(scalar.free_source(terms))(numbers, pieces, inf, 0, pieces, S)
    names = ["u", "w", "clear", *(["Y", "Z"] if terms.deck else []), *(["e"] if terms.end else [])]
    powers = flight_reach(numbers, S) ** np.arange(order + 1)
    for name in [*names, *(["N"] if terms.bonded else [])]:  # their terms within a step
        expected = powers * np.array([float(x) for x in exact[name].terms[: order + 1]])
        found = powers * S[ROWS[name] : ROWS[name] + order + 1]
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14 * np.abs(expected).max())


@pytest.mark.parametrize("order", [12, *slow_but([20])])
def test_how_far_a_step_goes_beyond_what_the_surface_bears_is_that_of_50_digits(order):
    rng = np.random.default_rng([order, 3])
    for degree in (8, 3):
        S, mp = np.zeros(layout.SCRATCH), mpmath.mpf
        S[layout.T + 1 : layout.T + order] = rng.uniform(0.2, 1, order - 1) * 0.5 ** np.arange(order - 1)
        S[layout.U : layout.U + order] = rng.uniform(-1, 1, order) * 0.5 ** np.arange(order)
        S[layout.HERE_BEARS_DEGREE] = degree
        S[layout.HERE_BEARS : layout.HERE_BEARS + 9] = rng.uniform(-1, 1, 9)
        t, u = (Truncated([mp(x) for x in S[row : row + order]]) for row in (layout.T, layout.U))
        bears = [mp(x) for x in S[layout.HERE_BEARS : layout.HERE_BEARS + degree + 1]]
        exact = [float(product(u, u, n) - composed(bears, t, n)) for n in range(order)]
        written.interpreted(scalar.yielding_source(order))(S, S[:, None], 0.0, 0, S[:, None], S)
        np.testing.assert_allclose(S[layout.TREND : layout.TREND + order], exact, rtol=1e-14, atol=2e-15)


@pytest.mark.parametrize("order", [12, 20])
def test_the_force_by_s_and_its_changes_are_those_of_50_digits(order):
    rng = np.random.default_rng(order)
    S, D, mp = np.zeros(layout.SCRATCH), np.zeros((layout.TURNED_ROWS, 8)), mpmath.mpf
    rows = [slice(row, row + order) for row in (layout.U, layout.N)]
    for row in rows:
        S[row], D[row] = rng.uniform(-1, 1, order), rng.uniform(-1, 1, (order, 8))
    written.interpreted(scalar.pushing_source(order))(S, S[:, None], 0.0, 0, S[:, None], S)
    written.interpreted(tangents.turned_push_source(order))(S, S, D)
    u, N = (Truncated(map(mp, S[row])) for row in rows)
    exact = [float(product(u, N, n)) for n in range(order)]
    np.testing.assert_allclose(S[layout.PUSH : layout.PUSH + order], exact, rtol=0, atol=1e-14)
    for lane in range(8):
        of_u, of_N = (Truncated(map(mp, D[row, lane])) for row in rows)
        exact = [float(product(of_u, N, n) + product(u, of_N, n)) for n in range(order)]
        np.testing.assert_allclose(D[layout.PUSH : layout.PUSH + order, lane], exact, rtol=0, atol=2e-14)


def put_in_lane(i, numbers, pieces, S, L):
    """The same step in a lane, as marches in lanes put it there."""
    state, row, lift = S[layout.STATE :], pieces[0], numbers[program.LIFT]
    mass, turns = numbers[program.DECK_MASS], row[program.WAVENUMBER] / (2 * np.pi)
    on, origin = state[program.ON_DECK], state[program.SHIFT] + row[program.CENTRE]
    per_mass = 1 / mass if mass else 0.0
    level = lift * row[program.COEFFICIENT]
    given = {
        at.LANE_TIME: state[program.TIME], at.LANE_U0: state[program.A], at.LANE_W0: state[program.B],
        at.LANE_K: numbers[program.STIFFNESS], at.LANE_G: numbers[program.DAMPING], at.LANE_LEVEL: level,
        at.LANE_LOAD: 1 + numbers[program.STIFFNESS] * level, at.LANE_AMP_SIN: lift * row[program.SINE],
        at.LANE_AMP_COS: lift * row[program.COSINE], at.LANE_OMEGA: row[program.WAVENUMBER] * numbers[program.PACE],
        at.LANE_RATE: turns * numbers[program.PACE], at.LANE_OFFSET: turns * origin, at.LANE_UNTIL: inf,
        at.LANE_GOAL: np.log2(TOLERANCE), at.LANE_CUBIC: numbers[program.CUBIC],
        at.LANE_QUADRATIC: numbers[program.QUADRATIC], at.LANE_ETA: numbers[program.HYSTERESIS],
        at.LANE_PACE: numbers[program.PACE] / row[program.SCALE], at.LANE_ORIGIN: origin / row[program.SCALE],
        at.LANE_ON: on, at.LANE_PRESTRESS: on * numbers[program.PRESTRESS] * per_mass,
        at.LANE_DECK_STIFF: numbers[program.DECK_STIFFNESS] * per_mass,
        at.LANE_DECK_DRAG: numbers[program.DECK_DAMPING] * per_mass, at.LANE_SHARE: on * per_mass,
        at.LANE_DECK_Y: state[program.DECK_Y], at.LANE_DECK_V: state[program.DECK_V],
    }  # fmt: skip
    if S[layout.END_B]:
        given |= {
            at.LANE_G: S[layout.END_G], at.LANE_BUSH: S[layout.END_B], at.LANE_BUSH_RATE: S[layout.END_BETA],
            at.LANE_GIVES: 1.0, at.LANE_BUSH_Y: state[program.END_DEFLECTION],
        }  # fmt: skip
    if S[layout.HERE_LAW_TERMS]:
        given |= {at.LANE_LAW_CENTRE: S[layout.HERE_LAW_CENTRE], at.LANE_LAW_RATE: 1 / S[layout.HERE_LAW_SCALE]}
        for k in range(program.TERMS):
            residual = lift * row[program.RESIDUAL + k] if k <= row[program.RESIDUAL_DEGREE] else 0.0
            given |= {at.LANE_LAW + 8 * k: S[layout.HERE_LAW + k], at.LANE_RESIDUAL + 8 * k: residual}
    for place, value in given.items():
        L[place + i] = value
    for k in range(program.TERMS):
        L[at.LANE_PATH + 8 * k + i] = lift * row[program.COEFFICIENT + k] if k <= row[program.DEGREE] else 0.0
        L[at.LANE_FACTOR + 8 * k + i] = row[program.FACTOR + k] if k <= row[program.FACTOR_DEGREE] else k == 0


def eight(rng, terms):
    """Eight steps in progress, in lanes and each for itself."""
    L, alone = np.zeros(at.TANGENT_ENTRIES), [drawn(rng, terms) for _ in range(8)]
    for i, one in enumerate(alone):
        put_in_lane(i, *one, L)
    return L, alone


def series_in_lane(L, i, rows):
    """Series of a lane, where `worst` looks for them."""
    out = np.zeros(layout.SCRATCH)
    for name, (place, count) in rows.items():
        out[ROWS[name] : ROWS[name] + count] = L[place + i : place + i + 8 * count : 8]
    return out


@pytest.mark.parametrize("terms", [*VARIANTS, *FREE], ids=lambda terms: terms.name)
def test_energies_are_those_of_50_digits(terms):
    L, alone = np.zeros(at.ENERGY_ENTRIES), []
    rng = np.random.default_rng([*terms.name.encode()])
    for i in range(8):
        alone.append(drawn(rng, terms))
        put_in_lane(i, *alone[i], L)
        L[[at.LANE_MASS + i, at.LANE_BEFORE + i, at.LANE_AFTER + i]] = alone[i][0][program.DECK_MASS], *rng.random(2)
        if terms in FREE and not terms.bonded:
            L[at.LANE_FACTOR + i :: 8][: program.TERMS] = 0.0
    kind = 0 if terms in FREE else 2 if terms.yields else 1
    written.interpreted(powers.source(kind))(L)
    for i, (numbers, pieces, S) in enumerate(alone):
        exact = Exact(numbers, pieces, S, terms)
        many, on, drag = powers.MANY[kind], exact.start["on"], exact.numbers[program.DECK_DAMPING]
        c = exact.contact(many) if kind else exact.free(many)
        c["one"] = Truncated([mpmath.mpf(1)])
        u, y, v = (c[name] for name in ("u", "x", "v") if kind) if kind else (c["one"], c["u"], c["w"])
        slip = Truncated([v[n] - on * c["Z"][n] for n in range(many)])
        brake = Truncated([exact.G * v[n] + exact.bush * c["e"][n] for n in range(many)])
        lost = Truncated([product(brake, v, n) + drag * product(c["Z"], c["Z"], n) for n in range(many)])
        power = Truncated([product(c["N"], slip, n) - lost[n] for n in range(many)])
        power = [product(u, power, n) for n in range(many)]
        weights = powers.hermite_weights(many)
        before, after = (mpmath.mpf(L[row + i]) for row in (at.LANE_BEFORE, at.LANE_AFTER))
        gains = [
            mpmath.fsum(weight * term * (-1) ** (n * sign) * h ** (n + 1) for n, (weight, term) in enumerate(
                zip(weights, power, strict=True)))
            for h, sign in ((before, 1), (after, 0))
        ]  # fmt: skip
        mass, stiff = numbers[[program.DECK_MASS, program.DECK_STIFFNESS]]
        energy = 0.5 * (v[0] ** 2 + exact.K * y[0] ** 2) + y[0]
        energy += 0.5 * (mass * c["Z"][0] ** 2 + stiff * c["Y"][0] ** 2) - on * numbers[program.PRESTRESS] * c["Y"][0]
        loss = 0.5 * lost[0] * u[0] * after if kind else mpmath.fsum(
            weight * lost[n] * after ** (n + 1) for n, weight in enumerate(weights))  # fmt: skip
        found = L[[row + i for row in (at.LANE_GAIN_BEFORE, at.LANE_GAIN_AFTER, at.LANE_ENERGY, at.LANE_LOST_AFTER)]]
        np.testing.assert_allclose(found, [float(x) for x in (*gains, energy, loss)], rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("many", [1, 4, 8])
def test_hermites_rule_is_exact_for_polynomials(many):
    for degree in range(2 * many):  # over (0, h) of x^degree, by its Taylor coefficients at both ends
        h = 1.3
        starts, ends = (
            [comb(degree, n) * x ** (degree - n) if n <= degree else 0.0 for n in range(many)] for x in (0.0, h)
        )
        found = sum(
            weight * h ** (n + 1) * (starts[n] + (-1) ** n * ends[n])
            for n, weight in enumerate(powers.hermite_weights(many))
        )
        assert found == pytest.approx(h ** (degree + 1) / (degree + 1), rel=1e-12)


LANED = VARIANTS[:OF_YIELDING]


@pytest.mark.few(8)
@pytest.mark.parametrize("order", [12, *slow_but([20])])
@pytest.mark.parametrize("terms", LANED, ids=lambda terms: terms.name)
def test_coefficients_in_lanes_are_those_of_50_digits_and_lengths_those_of_one_wheel(terms, order):
    L, alone = eight(np.random.default_rng([LANED.index(terms), order, 1]), terms)
    written.interpreted(lanes.contact_source(terms, order))(L)
    rows = {"u": (at.LANE_U, order + 1), "w": (at.LANE_W, order + 1)}
    rows |= {"Y": (at.LANE_Y, order + 1), "Z": (at.LANE_V, order + 1)} if terms.deck else {}
    rows |= {"N": (at.LANE_N, order)} if terms.path == BENT or terms.hysteresis else {}
    rows |= {"e": (at.LANE_E, order + 1)} if terms.end else {}
    for i, (numbers, pieces, S) in enumerate(alone):
        exact = Exact(numbers, pieces, S, terms).contact(order)
        found = written.interpreted(scalar.source(terms, order))(numbers, pieces, inf, 0, pieces, S)
        lost = worst(S, exact, rows)  # where a draw itself loses digits, so does one wheel
        assert worst(series_in_lane(L, i, rows), exact, rows) < max(1e-14, 2.0 * lost)
        if terms.path == BENT or terms.hysteresis or terms.deck or terms.end:
            assert L[at.LANE_LENGTH + i] == pytest.approx(found[0], rel=1e-12)
        ends = L[[at.LANE_LENGTH + i, at.LANE_T_END + i, at.LANE_U_END + i, at.LANE_W_END + i]]
        np.testing.assert_allclose(ends, found[:4], rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("end", [False, True])
@pytest.mark.parametrize("deck", [False, True])
def test_flights_in_lanes_are_those_of_50_digits(deck, end):
    terms, order = Free(deck=deck, end=end), int(layout.FLIGHT_ORDER)
    L, alone = eight(np.random.default_rng(4), terms)
    written.interpreted(lanes.free_source(terms))(L)
    rows = {"u": (at.LANE_Y, order + 1), "w": (at.LANE_V, order + 1), "clear": (at.LANE_POLYNOMIAL, order + 1)}
    rows |= {"Y": (at.LANE_U, order + 1), "Z": (at.LANE_W, order + 1)} if deck else {}
    rows |= {"e": (at.LANE_E, order + 1)} if end else {}
    for i, (numbers, pieces, S) in enumerate(alone):
        exact, reach = Exact(numbers, pieces, S, terms).free(order), flight_reach(numbers, S)
        if end:
            rate = 2.0 / reach - numbers[program.DAMPING] + S[layout.END_G]
            reach = 2.0 / (rate + np.sqrt(S[layout.END_B]) + S[layout.END_BETA])
        assert L[at.LANE_LENGTH + i] == pytest.approx(reach, rel=1e-12)
        powers, found = reach ** np.arange(order + 1), series_in_lane(L, i, rows)
        for name in rows:
            expected = powers * np.array([float(x) for x in exact[name].terms[: order + 1]])
            ours = found[ROWS[name] : ROWS[name] + order + 1] * (1 if name == "clear" else powers)
            np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


STARTS = {"TIME": program.TIME, "U": program.A, "W": program.B, "DECK_Y": program.DECK_Y, "DECK_V": program.DECK_V}
"""What a step begins with: rows of its changes, and its columns."""
TURNED = ("STIFFNESS", "DAMPING", "PACE", "LIFT"), ("DECK_MASS", "DECK_STIFFNESS", "DECK_DAMPING", "PRESTRESS")
"""Numbers that change along a direction, and those of a deck."""


def direction(rng, terms):
    """How numbers, a piece of the path and a state change."""
    numbers, piece, state = np.zeros(program.NUMBERS), np.zeros(program.MARKED_COLUMNS), np.zeros(layout.SCRATCH)
    names = TURNED[0] + TURNED[1] * terms.deck + ("HYSTERESIS",) * terms.hysteresis
    numbers[[getattr(program, name) for name in names]] = rng.uniform(-1, 1, len(names))
    many = program.TERMS if terms.path == BENT else 1
    for first, last in ((program.CENTRE, 1), (program.COEFFICIENT, many), (program.FACTOR, many * (many > 1))):
        piece[first : first + last] = 0.1 * rng.uniform(-1, 1, last)
    if terms.path != FLAT:
        piece[[program.SINE, program.COSINE, program.WAVENUMBER]] = rng.uniform(-1, 1, 3)
    columns = [*STARTS.values()][: 5 if terms.deck else 3]
    state[[layout.STATE + column for column in (*columns, program.SHIFT)]] = rng.uniform(-1, 1, len(columns) + 1)
    return numbers, piece, state


@pytest.mark.parametrize("order", [12, *slow_but([20])])
@pytest.mark.parametrize("terms", VARIANTS[:OF_ENDED], ids=lambda terms: terms.name)
def test_tangents_of_steps_in_lanes_are_differences_of_their_ends(terms, order):
    rng = np.random.default_rng([LANED.index(terms), 6])
    numbers, _, _ = drawn(rng, terms)
    alone = [(numbers, *drawn(rng, terms)[1:]) for _ in range(8)]  # eight steps of one cell
    of_numbers, _, _ = direction(rng, terms)
    turns = [(of_numbers, *direction(rng, terms)[1:]) for _ in range(8)]
    base, along = (written.interpreted(code) for code in tangents.pair(terms, order))
    names = ("T", "U", "W", "DECK_Y", "DECK_V")[: 5 if terms.deck else 3]

    def after(far):
        L = np.zeros(at.TANGENT_ENTRIES)
        for i in range(8):
            put_in_lane(i, *(one + far * of for one, of in zip(alone[i], turns[i], strict=True)), L)
        L[at.LANE_LENGTH : at.LANE_LENGTH + 8] = np.linspace(0.05, 0.3, 8)
        base(L)
        ends = np.array([L[row : row + 8] for row in (getattr(at, f"LANE_{name}_END") for name in names)])
        return L, ends + np.array([L[at.LANE_TIME : at.LANE_TIME + 8], *np.zeros((len(names) - 1, 8))])

    L, _ = after(0.0)
    L[at.LANE_NUMBERS : at.LANE_NUMBERS + program.NUMBERS] = numbers
    L[at.LANE_OF_NUMBERS : at.LANE_OF_NUMBERS + program.NUMBERS] = of_numbers
    if not terms.deck:
        L[at.LANE_NUMBERS + program.DECK_MASS] = inf
    for i, ((_, pieces, S), (_, piece, state)) in enumerate(zip(alone, turns, strict=True)):
        for column in range(program.PIECE_COLUMNS):
            L[at.LANE_PIECE + 8 * column + i] = pieces[0, column]
            L[at.LANE_OF_PIECE + 8 * column + i] = piece[column]
        L[at.LANE_SHIFT + i], L[at.LANE_OF_SHIFT + i] = (one[layout.STATE + program.SHIFT] for one in (S, state))
        for name, column in STARTS.items():
            L[getattr(at, f"LANE_OF_{name}") + i] = state[layout.STATE + column]
    written.interpreted(tangents.turn_source(terms.path == BENT))(L)
    along(L)
    found = np.array([L[row : row + 8] for row in (getattr(at, f"LANE_OF_{name}_END") for name in names)])
    step = 1e-3
    ends = [after(k * step)[1] for k in (-2, -1, 1, 2)]
    expected = (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * step)
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-8)


def test_the_path_about_a_step_changes_as_differences_say():
    rng = np.random.default_rng(9)
    terms = Terms(BENT)
    numbers, pieces, S = drawn(rng, terms)
    turns = [direction(rng, terms) for _ in range(8)]
    D, table, bends = np.zeros((layout.TURNED_ROWS, 8)), np.arange(8), np.zeros((8, 1, program.MARKED_COLUMNS))
    state, rows = S[layout.STATE :], slice(layout.HERE_POLY, layout.HERE_FACTOR + program.TERMS)
    for lane, (turn, piece, start) in enumerate(turns):
        D[layout.OF_NUMBERS : layout.CARRIED, lane], bends[lane, 0] = turn, piece
        D[layout.CARRIED + tangent_path.DSHIFT, lane] = start[layout.STATE + program.SHIFT]
    tangent_path.show_piece(pieces, bends, 0, table, state, state[program.TIME], S, D)
    written.interpreted(tangents.turned_piece_source())(numbers, S, D)
    written.interpreted(tangents.turned_joint_source())(numbers, S, D)
    step = 1e-3
    here = np.zeros((4, 8, layout.SCRATCH))
    joints = np.zeros((4, 8, 2))
    for n, k in enumerate((-2, -1, 1, 2)):
        for lane, (turn, piece, start) in enumerate(turns):
            shift = state[program.SHIFT] + k * step * start[layout.STATE + program.SHIFT]
            moved = pieces + k * step * piece, numbers + k * step * turn
            series.localise(*moved, 0, shift, state[program.TIME], here[n, lane])
            joints[n, lane] = series.path_at(0.0, here[n, lane])[:2]
    by_differences = [(x[0] - 8 * x[1] + 8 * x[2] - x[3]).T / (12 * step) for x in (here, joints)]
    changing = [
        row for row in range(rows.start, rows.stop) if row not in (layout.HERE_DEGREE, layout.HERE_FACTOR_DEGREE)
    ]
    np.testing.assert_allclose(D[changing], by_differences[0][changing], rtol=1e-8, atol=1e-8)
    at_joint = D[[layout.JOINT_HEIGHT, layout.JOINT_VELOCITY]]
    np.testing.assert_allclose(at_joint, by_differences[1], rtol=1e-8, atol=1e-8)
    series.localise(pieces, numbers, 0, state[program.SHIFT], state[program.TIME], S)
    values = S[[layout.JOINT_HEIGHT, layout.JOINT_VELOCITY, layout.JOINT_ACCELERATION, layout.JOINT_FACTOR]]
    np.testing.assert_allclose(values, [*series.path_at(0.0, S), series.factor_at(0.0, S)[0]], rtol=1e-13)


def test_sine_and_cosine_in_lanes_are_exact_to_rounding():
    turns = np.concatenate([np.linspace(-1, 1, 4001), np.random.default_rng(5).uniform(-500, 500, 4000)])[:8000]
    body = ["turns_given = L[LANE_OFFSET + i]", *lanes.sincos("turns_given")]
    body += ["L[LANE_U0 + i] = s", "L[LANE_W0 + i] = c"]
    code = lanes.function("sine_and_cosine", "Find both.", body)
    both = numba.njit(error_model="numpy", fastmath=FASTMATH)(written.interpreted(code))  # not kept with the kernels
    L = np.zeros(at.LANE_ENTRIES)
    for eight_of_them in turns.reshape(-1, 8):
        L[at.LANE_OFFSET : at.LANE_OFFSET + 8] = eight_of_them
        both(L)
        angle = 2 * np.pi * (eight_of_them - np.rint(eight_of_them))
        np.testing.assert_allclose(L[at.LANE_U0 : at.LANE_U0 + 8], np.sin(angle), atol=5e-16)
        np.testing.assert_allclose(L[at.LANE_W0 : at.LANE_W0 + 8], np.cos(angle), atol=5e-16)


@pytest.mark.slow
@pytest.mark.few(3)
@pytest.mark.skipif(
    not llvm.get_host_cpu_features().get("fma", False) or bool(numba.config.DISABLE_JIT), reason="needs a CPU with FMA"
)
@pytest.mark.parametrize(
    ("number", "fewest"),
    [
        (0, 170), (variants.SHARPEN_FLIGHT, 40),
        *slow_but([(1, 250), (2, 500), (5, 500), (11, 800), (variants.ALONGS, 170), (variants.ALONGS + 2, 500)]),
        *slow_but([(variants.TURN_BENT, 80), (variants.FLIGHTS + 1, 100)]), ("energies", 150),
    ],
)  # fmt: skip
def test_the_machine_code_of_the_lanes_is_packed(number, fewest):
    made = written.compiled(powers.source(1) if number == "energies" else written.source_in_lanes(number, 12))
    anew = numba.njit(error_model="numpy", fastmath=FASTMATH)(made.shortened())
    anew.compile("void(float64[::1])")
    (code,) = anew.inspect_asm().values()
    assert len(re.findall(r"\bvfn?m(?:add|sub)\d+pd\b", code)) >= fewest
    alone = re.findall(r"\bv(?:fn?m(?:add|sub)\d+|mul|add|sub|div)sd\b", code)
    assert len(alone) <= (30 if number == variants.TURN_BENT else 0)  # what all lanes have in common, once


@pytest.mark.few(1)
@pytest.mark.skipif(
    not llvm.get_host_cpu_features().get("fma", False) or bool(numba.config.DISABLE_JIT), reason="needs a CPU with FMA"
)
@pytest.mark.parametrize(
    ("number", "fewest"), [(variants.TURN_PIECE, 80), *slow_but([(2, 500), (11, 800), (OF_ENDED, 40)])]
)
def test_the_machine_code_of_eight_directions_is_packed(number, fewest):
    made = written.compiled(written.source_of_tangents(number, 12))
    anew = numba.njit(error_model="numpy", fastmath=FASTMATH)(made.shortened())
    anew.compile("void(float64[::1], float64[::1], float64[:,::1])")
    (code,) = anew.inspect_asm().values()
    assert len(re.findall(r"\bvfn?m(?:add|sub)\d+pd\b", code)) >= fewest


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
    made = written.interpreted(scalar.source(Terms(FLAT), 12))
    lines = linecache.getlines(made.__code__.co_filename)
    assert "".join(lines) == scalar.source(Terms(FLAT), 12)
    assert any(line.strip().startswith("u12 = ") for line in lines)


def test_the_addresses_of_all_functions_have_room_in_scratch_memory():
    assert layout.FUNCTIONS + variants.ONE_WHEEL <= layout.DERIVATIVES
    assert layout.DERIVATIVES + variants.TURNED <= layout.STATE


def test_there_are_at_most_24_functions_of_an_order():
    assert len(VARIANTS) == len(set(VARIANTS)) == 24
    assert {terms.path for terms in VARIANTS} == {FLAT, WAVE, BENT}


def test_threads_that_need_one_function_at_once_write_it_once(monkeypatch):
    asked = []

    def slow_source(number, order):
        asked.append((number, order))
        time.sleep(0.02)
        return scalar.source(Terms(FLAT), order)

    monkeypatch.setattr(written, "compiled", lambda code: code)
    monkeypatch.setattr(written, "address_of", lambda code, _: float(len(code)))
    functions = written._Functions(3, slow_source, written.ONE)
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda _: functions.with_bits(12, 0b101).copy(), range(8)))
    assert sorted(asked) == [(0, 12), (2, 12)]
    for addresses in found:  # nobody goes on before what was asked for is there
        assert addresses[[0, 2]].min() > 0.0
        assert addresses[1] == 0.0

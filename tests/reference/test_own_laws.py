"""Laws from tables in the general march, against the same laws by their own formulas."""

import itertools
import re
import warnings

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import wheeltapper as wt
from tests import rails
from wheeltapper.lower.laws.own_law import tabulated_law
from wheeltapper.march.common import program as contract
from wheeltapper.march.general.contract import DEFAULT, STRICT, Law
from wheeltapper.march.general.laws.switch import HUNT_CROSSLEY, forces
from wheeltapper.march.general.march import law_row, march
from wheeltapper.march.general.replay import path_heights, replay
from wheeltapper.march.general.tables import Units, compliance_at, shapes_at

C = 9.4125e10


def hertz(delta):
    return C * delta**1.5


def hardening(delta):
    return C * delta**1.5 * (1.0 + 2e3 * delta)


def hunt_crossley(delta, rate):
    return C * delta**1.5 * (1.0 + 0.3 * rate)


def power(delta):
    return 5e9 * delta**1.2


@pytest.mark.parametrize(
    ("force", "exponent", "rated"),
    [(hertz, 1.5, False), (hardening, 1.5, False), (hunt_crossley, 1.5, True), (power, 1.2, False)],
)
def test_a_table_is_the_law_and_its_slopes(force, exponent, rated):
    law, table = tabulated_law(wt.contact.Law(force, exponent=exponent, largest=1e-3))
    assert table.error < 1e-8
    units = Units(1e-4, 1e5)
    row = law_row(rails.one_wheel(rails.level(), 1.0, law=law).contacts[0], units, 0)
    delta, rate = np.array([1e-6, 3e-5, 1e-4, 2.5e-4, 9e-4]), np.array([-1.5, -0.2, 0.0, 0.4, 1.1])
    N, slope, viscous = np.zeros((3, 5))

    def expected(delta, rate):
        return force(delta, rate) if rated else force(delta)

    forces(
        row, law.table, 0.0, 5, delta / units.length, rate / units.length, np.zeros(5), np.ones(5), N, slope, viscous
    )  # fmt: skip
    most = expected(np.array([1e-3]), np.zeros(1))[0]
    assert units.force * N == pytest.approx(expected(delta, rate), abs=1e-8 * most)
    h = 1e-4 * delta
    slopes = (expected(delta + h, rate) - expected(delta - h, rate)) / (2.0 * h)
    assert slope * units.force / units.length == pytest.approx(slopes, rel=1e-5)
    by_rate = (expected(delta, rate + 1e-4) - expected(delta, rate - 1e-4)) / 2e-4
    assert viscous * units.force / units.length == pytest.approx(by_rate, rel=1e-5, abs=1e-6)


@pytest.mark.parametrize(
    ("force", "law"), [(hertz, rails.HERTZIAN), (hunt_crossley, Law(HUNT_CROSSLEY, np.array([C, 0.3])))]
)
def test_marches_with_tables_are_those_with_formulas(force, law):
    own, _ = tabulated_law(wt.contact.Law(force))
    pieces = rails.flat(0.06, 0.5)
    by_table, by_formula = (
        march(rails.one_wheel(pieces, 10.0, law=one), DEFAULT, 0.08) for one in (own, law)
    )  # fmt: skip
    assert by_table.status == by_formula.status == contract.DONE
    assert len(by_formula.events) >= 4
    assert by_table.events[:, 1].tolist() == by_formula.events[:, 1].tolist()
    assert by_table.events[:, 0] == pytest.approx(by_formula.events[:, 0], abs=1e-8, rel=0)
    assert by_table.peaks[:, 1].max() == pytest.approx(by_formula.peaks[:, 1].max(), rel=1e-7)


@pytest.mark.parametrize(
    ("pieces", "speed", "track", "duration"),
    [
        (rails.flat(0.04, 3.0), 20.0, "rolland_UIC60_example", 0.16),
        (rails.wave(200e-6, 0.05, 0.6), 30.0, "Zhai2004", 0.1),
    ],
)
def test_a_table_of_a_rated_law_marches_on_rails_as_its_formula(pieces, speed, track, duration):
    own, _ = tabulated_law(wt.contact.Law(hunt_crossley))
    by_table, by_formula = (
        march(rails.one_wheel(pieces, speed, rails.ring(track), law), DEFAULT, duration)
        for law in (own, Law(HUNT_CROSSLEY, np.array([C, 0.3])))
    )  # fmt: skip
    assert by_table.status == by_formula.status == contract.DONE
    assert len(by_formula.events) >= 2
    assert by_table.events[:, 1].tolist() == by_formula.events[:, 1].tolist()
    assert by_table.events[:, 0] == pytest.approx(by_formula.events[:, 0], abs=1e-7, rel=0)


def test_a_force_with_another_exponent_bounces_alike_with_finer_steps():
    own, _ = tabulated_law(wt.contact.Law(power, exponent=1.2))
    pieces = rails.flat(0.06, 0.5)
    found = march(rails.one_wheel(pieces, 10.0, law=own), DEFAULT, 0.07)
    finer = march(rails.one_wheel(pieces, 10.0, law=own), STRICT, 0.07)
    assert found.status == finer.status == contract.DONE
    assert len(found.events) == len(finer.events) > 4
    assert found.events[:, 0] == pytest.approx(finer.events[:, 0], abs=1e-7, rel=0)


@pytest.mark.parametrize(
    ("force", "fields", "message"),
    [
        (lambda delta: -delta, {}, "force: found a function that is -0.001 at an indentation of 0.001 m"),
        (lambda delta: np.full_like(delta, np.inf), {}, "force: found a function that is inf"),
        (lambda delta: "strong", {}, "force: found a function that returns"),
        (lambda delta: 1.0 / 0.0, {}, "force: found a function that raises ZeroDivisionError"),
        ("1e9*d", {}, "force: found '1e9\\*d'; allowed: a Python function, which a file cannot hold"),
        (hertz, {"exponent": 0.5}, "exponent"),
        (hertz, {"largest": 0.0}, "largest"),
    ],
)
def test_what_is_no_law_is_refused(force, fields, message):
    with pytest.raises(wt.InputError, match=message):
        wt.contact.Law(force, **fields)


def test_what_no_table_can_hold_is_refused():
    with pytest.raises(wt.InputError, match=r"grows as the power 1\.2 near zero"):
        tabulated_law(wt.contact.Law(power))
    smooth = r"its table misses by .*allowed: one of which N/δ\^1\.5 \(`exponent`\) is smooth from 0 to `largest`"
    with pytest.raises(wt.InputError, match=f"{smooth}$"):
        tabulated_law(wt.contact.Law(lambda delta: np.where(delta < 3.1e-4, 1.0, 1.7) * hertz(delta)))
    with pytest.raises(wt.InputError, match=f"{smooth}, at every rate$"):
        tabulated_law(wt.contact.Law(lambda delta, rate: C * delta**1.5 + 1e5 * delta**0.25 * rate))


def test_beyond_its_rates_a_table_goes_on_straight():
    law, _ = tabulated_law(wt.contact.Law(lambda delta, rate: C * delta**1.5 * (1.0 + 0.01 * rate)))
    units = Units(1e-4, 1e5)
    row = law_row(rails.one_wheel(rails.level(), 1.0, law=law).contacts[0], units, 0)
    rate = np.array([-50.0, -5.0, 5.0, 50.0])
    N, slope, viscous = np.zeros((3, 4))
    forces(row, law.table, 0.0, 4, np.ones(4), rate / units.length, np.zeros(4), np.ones(4), N, slope, viscous)
    assert N / N[2] == pytest.approx(np.array([0.5, 0.95, 1.05, 1.5]) / 1.05, rel=1e-9)
    assert viscous == pytest.approx(viscous[1], rel=1e-9)


@pytest.mark.parametrize(
    ("force", "largest", "bump", "said"),
    [
        (hertz, 1e-4, None, r"the indentation reached 0\.108\d* mm; the table of the contact's law ends at 0\.1 mm"),
        (
            hunt_crossley,
            2e-2,
            wt.CosineBump(height=3e-3, length=0.03, start=0.02),
            r"the indentation's rate reached [\d.]+ m/s; the table of the contact's law ends at 5 m/s",
        ),
    ],
)
def test_a_run_beyond_the_table_is_told(force, largest, bump, said):
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=600, load=1e5), contact=wt.contact.Law(force, largest=largest), irregularity=bump,
        rolling="point", speed=30.0, duration=0.002,
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that it is told, and that the bump is a sharp one
        record = wt.simulate(scene)
    assert [note for note in record.notes if re.search(said, note) and note.doubtful]


# -- a law with a rate under a local compliance, whose indentation is a state of its own -------------------------------


def saturating(delta, rate):
    return C * delta**1.5 * (1.0 + 2e3 * delta) * np.exp(0.3 * np.tanh(rate))


class WithLag:
    """The same truncated structure and contact for SciPy's DOP853, while contact lasts: δ' is what N(δ, δ') = N asks.

    N is (D - δ)/r, with the gap D and the local compliance r.
    """

    def __init__(self, system, start):
        self.system, self.ring = system, system.ring
        static = rails.LOAD
        delta = brentq(lambda d: saturating(d, 0.0) - static, 1e-6, 1e-3, xtol=1e-18)
        modes = start.modes
        self.offset = start.offsets[0]
        self.state = np.concatenate([[0.0, 0.0, delta], modes.real, modes.imag])

    def force(self, t, state):
        x = np.array([self.system.speed * t])
        bay = np.floor(x / self.ring.spacing)
        turn = np.exp(1j * np.multiply.outer(bay, np.angle(self.ring.turns)))
        inside = x - bay * self.ring.spacing
        shows = shapes_at(self.ring, self.ring.deflection, inside) * turn * self.ring.weights
        takes = shapes_at(self.ring, self.ring.drive, inside) / turn
        modes = state[3:].reshape(2, -1)
        gap = state[0] + self.offset + path_heights(self.system.contacts[0], x)[0]
        gap -= np.real(shows[0] @ (modes[0] + 1j * modes[1]))
        return (gap - state[2]) / compliance_at(self.ring, inside)[0], takes[0]

    def rate(self, t, state):
        N, takes = self.force(t, state)
        share = np.log(N / (C * state[2] ** 1.5 * (1.0 + 2e3 * state[2]))) / 0.3
        modes = state[3:].reshape(2, -1)
        moved = self.ring.rates * (modes[0] + 1j * modes[1]) + N * takes
        a = (rails.LOAD - N) / rails.MASS
        return np.concatenate([[state[1], a, np.arctanh(share)], moved.real, moved.imag])

    def forces(self, times, breaks):
        """Return the forces at some times, s, restarted at breaks."""
        out, state = [], self.state
        for begin, end in itertools.pairwise(breaks):
            inside = times[(times > begin) & (times <= end)]
            run = solve_ivp(
                self.rate, (begin, end), state, "DOP853", t_eval=np.append(inside[inside < end], end), rtol=1e-11,
                atol=1e-14, max_step=2e-5,
            )  # fmt: skip
            out += [self.force(t, y)[0] for t, y in zip(run.t, run.y.T, strict=True) if t in inside]
            state = run.y[:, -1]
        return np.array(out)


@pytest.mark.slow
def test_forces_of_a_law_with_a_rate_are_those_of_a_general_solver():
    law, table = tabulated_law(wt.contact.Law(saturating))
    assert table.error < 1e-10
    assert table.cells.shape[1] <= 18
    system = rails.one_wheel(rails.wave(60e-6, 0.3, 0.1), 20.0, rails.ring("Zhai2004", 20, 1e3), law)
    times = np.array([1e-4, 3.1e-4, 4.9e-3, 5.05e-3, 6.1e-3, 8.3e-3, 1.17e-2])
    seats = 0.3 * np.arange(1, 2) / 20.0
    found = march(system, STRICT, 0.012)
    assert found.status == contract.DONE
    expected = WithLag(system, found.prepared.start).forces(times, [0.0, 0.1 / 20.0, *seats[seats < 0.012], 0.012])
    for method, most in ((STRICT, 1e-7), (DEFAULT, 1e-5)):
        force = replay(march(system, method, 0.012), times).force[:, 0]
        assert force == pytest.approx(expected, abs=most * rails.LOAD)
    assert np.ptp(expected) > 0.05 * rails.LOAD


@pytest.mark.parametrize("method", [DEFAULT, STRICT], ids=["default", "strict"])
def test_a_wheel_with_a_lag_begins_with_its_static_force(method):
    law = Law(HUNT_CROSSLEY, np.array([C, 20.0]))
    found = march(rails.one_wheel(rails.level(), 0.0, rails.ring("Zhai2004", 40, 1e3), law), method, 0.002)
    assert found.status == contract.DONE
    assert not len(found.events)
    force = replay(found, np.linspace(0.0, 0.002, 50)).force
    assert force == pytest.approx(np.full((50, 1), rails.LOAD), rel=1e-7)


@pytest.mark.parametrize(
    ("loss", "amplitude", "length", "speed", "track"),
    [
        (3.4136809175600327, 6.48577795464057e-05, 0.05, 50.0, "Zhai2004"),
        (3.3491860299416727, 1.3287814607061574e-4, 0.03, 30.0, "Zhai2004"),
        (10.645224724819836, 8.827154976988476e-05, 0.05, 50.0, "Zhai2004"),
    ],
)
def test_a_released_contact_that_presses_again_does_so_once(loss, amplitude, length, speed, track):
    """Slow modes leave much to the local compliance, and so a long lag; rounding of the rate is no second release."""
    law = Law(HUNT_CROSSLEY, np.array([C, loss]))
    system = rails.one_wheel(rails.wave(amplitude, length, 0.3), speed, rails.ring(track, 40, 1e3), law)
    found, finer = (march(system, method, 0.06) for method in (DEFAULT, STRICT))
    assert found.status == finer.status == contract.DONE
    assert len(finer.events) > 4
    assert found.events[:, 1].tolist() == finer.events[:, 1].tolist()
    assert found.events[:, 0] == pytest.approx(finer.events[:, 0], abs=1e-7, rel=0)


@pytest.mark.parametrize("sharpness", [0.02, 0.04, 0.3])
def test_a_wheel_at_rest_stays_at_rest_however_finely_the_rate_is_tabulated(sharpness):
    def force(delta, rate):
        return 1.405e11 * delta**1.5 * (1.0 + 0.2 * rate / np.sqrt(rate**2 + sharpness**2))

    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307), contact=wt.contact.Law(force, exponent=1.5), speed=0.0,
        duration=0.2,
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the table's error
        record = wt.simulate(scene)
    assert record.outcome.name == "COMPLETED"
    assert record.events.sizes["event"] == 0
    np.testing.assert_allclose(record.at(0.2).normal_force, record.static_force, rtol=1e-9)

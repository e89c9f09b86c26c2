"""Laws from tables in the general march, against the same laws by their own formulas."""

import re
import warnings

import numpy as np
import pytest

import wheeltapper as wt
from tests import rails
from wheeltapper.lower.own_law import tabulated_law
from wheeltapper.march import program as contract
from wheeltapper.march.general.contract import DEFAULT, STRICT, Law
from wheeltapper.march.general.laws.switch import HUNT_CROSSLEY, forces
from wheeltapper.march.general.march import law_row, march
from wheeltapper.march.general.tables import Units

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

    forces(row, law.table, 5, delta / units.length, rate / units.length, np.ones(5), N, slope, viscous)
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
    with pytest.raises(wt.InputError, match="its table misses by"):
        tabulated_law(wt.contact.Law(lambda delta: np.where(delta < 3.1e-4, 1.0, 1.7) * hertz(delta)))


def test_beyond_its_rates_a_table_stays_what_it_is():
    law, _ = tabulated_law(wt.contact.Law(lambda delta, rate: C * delta**1.5 * (1.0 + 0.01 * rate)))
    units = Units(1e-4, 1e5)
    row = law_row(rails.one_wheel(rails.level(), 1.0, law=law).contacts[0], units, 0)
    rate = np.array([-50.0, -5.0, 5.0, 50.0])
    N, slope, viscous = np.zeros((3, 4))
    forces(row, law.table, 4, np.ones(4), rate / units.length, np.ones(4), N, slope, viscous)
    assert N[[0, 3]] == pytest.approx(N[[1, 2]], rel=1e-12)
    assert viscous[[0, 3]].tolist() == [0.0, 0.0]
    assert N[2] / N[1] == pytest.approx(1.05 / 0.95, rel=1e-9)


@pytest.mark.parametrize(
    ("force", "largest", "bump", "said"),
    [
        (hertz, 1e-4, None, r"the indentation reached 0\.108\d* mm; the table of the contact's law ends at 0\.1 mm"),
        (
            hunt_crossley, 2e-2, wt.CosineBump(height=3e-3, length=0.03, start=0.02),
            r"the indentation's rate reached [\d.]+ m/s; the table of the contact's law ends at 5 m/s",
        ),
    ],
)  # fmt: skip
def test_a_run_beyond_the_table_is_told(force, largest, bump, said):
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=600, load=1e5), contact=wt.contact.Law(force, largest=largest), irregularity=bump,
        rolling="point", speed=30.0, duration=0.002,
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that it is told, and that the bump is a sharp one
        record = wt.simulate(scene)
    assert [note for note in record.notes if re.search(said, note) and note.doubtful]

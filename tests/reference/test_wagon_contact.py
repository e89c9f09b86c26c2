"""Contacts of the coach against an elastic program: the Manchester contact benchmark, case A-2.2, left wheel."""

import numpy as np
import pytest
from scipy.optimize import fsolve

import wheeltapper as wt
from tests.cases import rows
from wheeltapper.lower.wagon import lower_wagon
from wheeltapper.march.wagon.assembly import TO_RATE
from wheeltapper.march.wagon.multibody import start_rates
from wheeltapper.march.wagon.wheel_rows import FX, FY, NORMAL, ROLLING, ROW_G, SLIP_TURN, SLIP_X, SLIP_Y

SPEED, FORCE = 10.0, 10e3
Y, Z, ROLL, YAW, PITCH_RATE = 1, 2, 3, 5, TO_RATE + 4
LEFT, RIGHT = 0, 4


@pytest.fixture(scope="module")
def rolling():
    axle = wt.vehicles.Axle(mass=2 * FORCE / 9.81, inertia=(800.0, 100.0, 800.0), position=0.0)
    elastic = {"youngs_modulus": 2 * 82e9 * 1.28, "poisson": 0.28}
    scene = wt.Scenario(
        vehicle=wt.Wagon(bodies=(), axles=(axle,)),
        contact=wt.Hertz(**elastic),
        creep=wt.creep.Fastsim(friction=0.3, cells=20, strips=20, wheel_spin="full"),
        profiles=wt.profiles.WheelRail(smoothing=5e-6),
        speed=SPEED,
        duration=1.0,
    )
    assembly = lower_wagon(scene).assembly

    def contacts(y, yaw, z, roll, spin):
        state = np.zeros((1, len(assembly.start)))
        state[0, [Y, Z, ROLL, YAW, PITCH_RATE]] = y, z, roll, yaw, spin
        return start_rates(assembly, state)[1][0]

    def at(y, yaw, roll):
        def missing(x):
            wheels = contacts(y, yaw, 1e-4 * x[0], 1e-4 * x[1], x[2])
            carried = [wheels[NORMAL + i] + s * wheels[ROW_G + i] * wheels[FY + i] for i, s in ((LEFT, 1), (RIGHT, -1))]
            turn = sum(wheels[FX + i] * wheels[ROLLING + i] for i in (LEFT, RIGHT))
            return [carried[0] / FORCE - 1, carried[1] / FORCE - 1, turn / 500.0]

        found, _, ok, said = fsolve(missing, [-0.3, 1e4 * roll, 0.0], full_output=True, xtol=1e-12)
        assert ok == 1, said
        return found, contacts(y, yaw, 1e-4 * found[0], 1e-4 * found[1], found[2])

    return at


@pytest.mark.slow
def test_a_wheelset_that_rolls_quasi_statically_is_the_elastic_programs(rolling):
    compared = 0
    for row in rows("contact_mbench_a22_left.csv"):
        row = {name: float(value) for name, value in row.items()}
        if not 1.0 <= row["y"] <= 4.5:  # there the contact is one place and does not jump
            continue
        compared += 1
        # the program counts y to the right and z downwards
        found, wheels = rolling(-1e-3 * row["y"], -row["yaw"], row["roll"])
        assert 1e-4 * found[1] == pytest.approx(row["roll"], rel=0.03)
        assert wheels[SLIP_Y + LEFT] / SPEED == pytest.approx(row["ceta"], rel=0.003)
        assert wheels[SLIP_TURN + LEFT] / SPEED == pytest.approx(1e3 * row["cphi"], rel=0.02)
        # its longitudinal creepage is that of another point than our mean one: at the same point
        there = (
            wheels[SLIP_X + LEFT] / SPEED
            + (1 + found[2] * 0.46 / SPEED) * (wheels[ROLLING + LEFT] - 0.46 - 1e-3 * row["zcpw"]) / 0.46
        )
        assert there == pytest.approx(-row["cksi"], rel=0.06)  # it balances forces that FASTSIM turns by 12 %
        assert wheels[NORMAL + LEFT] * np.hypot(1, wheels[ROW_G + LEFT]) == pytest.approx(row["Fn"], rel=2e-3)
        assert wheels[FY + LEFT] == pytest.approx(row["Fs"], rel=0.02)
        assert -wheels[FX + LEFT] == pytest.approx(row["Fx"], rel=0.06)
    assert compared == 8

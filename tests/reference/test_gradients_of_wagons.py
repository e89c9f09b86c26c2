"""Gradients of wagons against the exact tangents of the general march: half a coach that cannot roll is a bogie."""

import numpy as np
import pytest

import wheeltapper as wt
from tests.reference.test_wagon_on_rails import NUMBERS, half_coach

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
FEATURES = ["largest_force", "first_loss", "time_in_air", "impact_interval"]
RAILS = wt.tracks.Ballasted(
    **wt.tracks.Ballasted.example | {"bays": 60, "cutoff": 1500.0, "first_sleeper": 0.17}
)  # fmt: skip
WHEELS = 2
"""Wheels of a wheelset, which share the forces of the bogie's."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("track", "allowed"),
    [
        pytest.param(wt.StiffTrack(), (1e-9, 2e-9), id="on a stiff track"),
        pytest.param(RAILS, (5e-8, 5e-7), id="on rails", marks=pytest.mark.slow),
    ],
)
def test_half_a_coach_has_the_derivatives_of_a_bogie(track, allowed):
    """Errors count over the larger derivative of both wheelsets.

    On rails the second one only feels the first, whose derivative by the speed is 40 times as large. The bogie's own
    tangents, strict with ten to fourteen nodes and steps as they are and half as long, scatter by 4e-7 of that.
    """
    common = {
        "contact": wt.Hertz(constant_per_wheel=8e10, curvature=False), "speed": 20.0, "duration": 0.04,
        "irregularity": wt.Corrugation(amplitude=2e-4, wavelength=0.1, start=0.05), "rolling": "point", "track": track,
    }  # fmt: skip
    coach = wt.Scenario(vehicle=half_coach(), profiles=wt.profiles.Cones(), **common)
    load = float(wt.simulate(coach).static_forces[0].sum())
    bogie = wt.Scenario(vehicle=wt.vehicles.Bogie(wheel_load=load, **NUMBERS), **common)
    names = [element.name for element in coach.vehicle.elements]
    dampers = [f"vehicle.elements.{names.index(f'damper wheelset {number}')}.damping.2" for number in (1, 2)]
    same = ["speed", "irregularity.0.amplitude"]
    own = wt.gradient(coach, FEATURES, [*same, *dampers])
    exact = wt.gradient(bogie, FEATURES, [*same, "vehicle.primary_damping"], method="strict")
    assert int(own.gradient_status) == 0
    for name in FEATURES:
        of_both = [1.0, 1 / WHEELS][name == "largest_force"] * exact[f"{name}_gradient"]
        for side in ("left", "right"):
            found = own[f"{name}_gradient"].sel(side=side).values
            found = np.vstack([found[:2], found[2:].sum(axis=0)])
            size = np.nanmax(np.abs(of_both.values), axis=1)
            size[size == 0.0] = 1.0
            for number in range(2):
                one, other = found[:, number] / size, of_both.values[:, number] / size
                np.testing.assert_allclose(one, other, rtol=0, atol=allowed[number])
            error = own[f"{name}_gradient_error"].sel(side=side).values[:2]
            assert np.all((np.abs(error) < 1e-6 * np.abs(found[:2])) | np.isnan(found[:2]) | (found[:2] == 0.0))

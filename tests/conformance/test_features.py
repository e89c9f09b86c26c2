"""Every feature: a file may name it, and its gradient is a difference.

That a record has it as a map's cell does is shown in tests/properties/test_features.py.
"""

import pytest

import wheeltapper as wt
from tests import scenes
from wheeltapper.describe.registry import registered_in

BUMP = scenes.BUMP.replaced({"duration": 0.05})


def features():
    return {name: make() for name, make in registered_in("wheeltapper.record.features").items()}


FEATURES = features()


@pytest.mark.parametrize("name", FEATURES)
def test_its_name_is_that_of_its_variable_and_serves_in_files(name):
    feature = wt.features.named({"type": name})
    assert feature.name == name
    assert feature.definition
    assert wt.features.named({"type": name, "name": "other"}).name == "other"


@pytest.mark.parametrize("name", [name for name, feature in FEATURES.items() if feature.differentiable])
def test_its_gradient_is_a_difference(name):
    mass, step = 1500.0, 0.05
    found = float(wt.gradient(BUMP, [name], ["vehicle.mass"], method="strict")[f"{name}_gradient"].squeeze())
    ends = wt.sweep(BUMP, {"vehicle.mass": [mass - step, mass + step]}, [name], method="strict")[name].values
    assert found == pytest.approx((ends[1] - ends[0]) / (2 * step), rel=1e-5, abs=1e-8 * abs(ends[0]) / mass)

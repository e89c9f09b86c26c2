"""Every creep law that saturates: what all of them must do. New files are found by themselves."""

import numpy as np
import pytest

from wheeltapper.describe.creep.base import CreepLaw
from wheeltapper.describe.creep.polach import Polach

from . import samples


def laws():
    """Return the laws that are a curve; FASTSIM is none."""
    return {name: law for name, law in samples(CreepLaw).items() if hasattr(law, "saturation")}


LAWS = laws()
LIMITED = [name for name in LAWS if name != "KalkerLinear"]
Q = np.concatenate([[0.0], np.geomspace(1e-9, 1e5, 4000)])


@pytest.mark.parametrize("name", LAWS)
def test_small_creepages_are_linear(name):
    found = LAWS[name].saturation(Q)
    assert found[0] == 1.0
    np.testing.assert_allclose(found[Q < 1e-6], 1.0, atol=1e-6)


@pytest.mark.parametrize("name", LIMITED)
def test_the_force_rises_to_the_friction_limit_and_never_beyond(name):
    force = Q * LAWS[name].saturation(Q)  # over the limit
    assert force.max() <= 1.0
    assert force[-1] == pytest.approx(1.0, abs=1e-4)
    steps = np.diff(force)
    assert (steps >= -1e-15).all()
    assert np.abs(np.diff(LAWS[name].saturation(Q))).max() < 0.01  # continuous


def test_known_values():
    assert LAWS["ShenHedrickElkins"].saturation(1.5) * 1.5 == pytest.approx(1.5 - 0.75 + 0.125)
    e = np.pi / 4
    polach = LAWS["Polach"]
    assert polach.saturation(1.0) == pytest.approx(2 / np.pi * (e / (1 + e * e) + np.arctan(e)))
    wet = Polach(friction=0.3, adhesion_reduction=0.3, slip_reduction=0.1)
    assert wet.saturation(0.0) == pytest.approx(0.2)
    assert wet.saturation(1.0) == pytest.approx(2 / np.pi * (0.3 * e / (1 + (0.3 * e) ** 2) + np.arctan(0.1 * e)))

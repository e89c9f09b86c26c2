"""The force on a rough rail against linear theory with the exact receptance of the infinite track.

Seats 0.1 m apart, so that it hardly matters where between them the wheel is; contact is never lost. What is left is the
contact's curve (forces vary by a seventh) and the wheel's motion along the rail.
"""

import numpy as np
import pytest

from ..roughness import BANDS, linear_levels, linear_response, marched, marched_levels, roughness, track


@pytest.mark.slow
def test_third_octaves_of_the_force_are_those_of_linear_theory():
    rails, found = track(6), []
    response = linear_response(rails, (0.0, 0.05))
    for seed in (1, 2):
        rough = roughness(seed)
        record = marched(rough, rails)
        assert record.outcome.name == "COMPLETED"
        assert record.events.sizes["event"] == 0
        found.append(marched_levels(record) - linear_levels(rough, response))
    assert len(BANDS) == len(found[0]) == 17
    assert np.abs(np.mean(found, axis=0)).max() < 0.5

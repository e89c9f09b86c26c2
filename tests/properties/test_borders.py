"""Borders: on one side of them contact is lost once more, on the other it is not."""

import numpy as np
import pytest

import wheeltapper as wt

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
DIP = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=85_285), contact=wt.Hertz(constant=9e10), rolling="point", speed=5,
    irregularity=wt.CosineBump(height=-6e-5, length=0.02, start=0.05), duration=0.2,
)  # fmt: skip
NOMINAL = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=4.1e4), contact=wt.Hertz(constant=1.405e11),
    irregularity=wt.CosineBump(height=-1.01e-4, length=0.0403, start=0.009), rolling="point", speed=5.57, duration=0.12,
)  # fmt: skip
CIRCLE = NOMINAL.replaced({"rolling": "circle"})
DECK = NOMINAL.replaced({"track": wt.FloatingDeck(mass=3000, stiffness=1e8)})


def test_the_threshold_of_the_dip():
    """0.06407 mm at 5 m/s (docs/theory/accuracy.rst, section 10.3)."""
    over = {"irregularity.0.height": [-6.6e-5, -6.2e-5], "speed": [4.9, 5.1]}
    curve = wt.border(DIP, over, resolution=2)
    depth = -curve["irregularity.0.height"].values[np.abs(curve.speed.values - 5.0) < 1e-12]
    assert depth == pytest.approx([0.06407e-3], abs=1e-8)
    assert np.abs(curve.margin.values).max() < 1e-12


@pytest.mark.parametrize(
    ("scene", "over", "many"),
    [
        (DIP, {"irregularity.0.height": [-1.5e-4, -2e-5], "speed": [3.0, 9.0]}, 1),
        (NOMINAL, {"vehicle.damping": [2e4, 6e4], "vehicle.mass": [900.0, 2100.0]}, 2),
        (
            NOMINAL.replaced({"rolling": "circle"}),
            {"irregularity.0.height": [-2e-4, -2e-5], "vehicle.mass": [900, 2100]},
            1,
        ),
        (
            NOMINAL.replaced({"track": wt.FloatingDeck(mass=3000, stiffness=1e8)}),
            {"speed": [3, 8], "track.mass": [2e3, 5e3]},
            1,
        ),
    ],
)
def test_a_millionth_on_either_side_the_count_differs(scene, over, many):
    curve = wt.border(scene, over, losses=many, resolution=6)
    assert curve.sizes["point"] >= 4
    first, second = over
    for i in range(0, curve.sizes["point"], max(1, curve.sizes["point"] // 5)):
        here = {path: float(curve[path][i]) for path in over}
        found = set()
        for path in (first, second):
            for sign in (-1, 1):
                moved = here | {path: here[path] * (1 + 1e-6 * sign)}
                events = wt.simulate(scene.replaced(moved)).events
                found.add(int((events.kind == "loss").sum()) >= many)
        assert found == {True, False}


def test_a_plane_without_a_border_has_no_points():
    curve = wt.border(DIP, {"irregularity.0.height": [-2e-5, -1e-5], "speed": [4.0, 5.0]}, resolution=3)
    assert curve.sizes["point"] == 0


def test_a_border_is_drawn_over_its_map():
    over = {"vehicle.damping": [2e4, 6e4], "vehicle.mass": [900.0, 2100.0]}
    chart = wt.sweep(
        NOMINAL, {path: np.linspace(*ends, 8) for path, ends in over.items()}, [wt.features.impact_interval()]
    )
    curve = wt.border(NOMINAL, over, losses=2, resolution=8)
    axis = wt.plot(chart, border=curve).axes[0]
    (line,) = axis.lines
    np.testing.assert_allclose(line.get_ydata(), curve["vehicle.mass"].values)  # kg
    np.testing.assert_allclose(line.get_xdata(), curve["vehicle.damping"].values / 1e3)  # kN s/m
    with pytest.raises(wt.InputError, match="border"):
        wt.plot(chart, border=wt.border(DIP, {"irregularity.0.height": [-2e-5, -1e-5], "speed": [4, 5]}, resolution=3))


@pytest.mark.parametrize(
    ("over", "options", "found"),
    [
        ({"speed": [1, 2]}, {}, "1 fields"),
        ({"speed": [1, 2], "vehicle.mass": [1, 2, 3]}, {}, "different lengths"),
        ({"speed": [2, 1], "vehicle.mass": [1000, 2000]}, {}, "lowest and highest"),
        ({"speed": [1, 2], "vehicle.wheels": [1, 2]}, {}, "vehicle.wheels"),
        ({"speed": [1, 2], "vehicle.mass": [1000, 2000]}, {"losses": 0}, "losses"),
        ({"speed": [1, 2], "vehicle.mass": [1000, 2000]}, {"resolution": 1}, "resolution"),
    ],
)
def test_a_wrong_plane_is_refused(over, options, found):
    with pytest.raises(wt.InputError, match=found):
        wt.border(DIP, over, **options)

"""Pictures of charts show what the charts hold."""

import numpy as np
import pytest
import xarray as xr

import wheeltapper as wt
from tests.scenes import BUMP
from wheeltapper.faces.panels import words

PAIR = [wt.features.impact_interval(), wt.features.force_ratio()]
OVER = {"vehicle.damping": np.linspace(2e4, 8e4, 7), "vehicle.mass": np.linspace(600, 2100, 6)}


def test_a_map_has_level_curves_arrows_and_its_specificity():
    chart = wt.sweep(BUMP, OVER, PAIR, gradient=True)
    axis = wt.plot(chart, features=["impact_interval"]).axes[0]
    assert axis.get_xlabel() == "damping of the vehicle over 50 kN s/m"
    assert axis.get_ylabel() == "mass of the vehicle over 1\u202f500 kg"
    assert "off the mass of the vehicle" in axis.get_title(loc="left")
    (arrows,) = [artist for artist in axis.collections if type(artist).__name__ == "Quiver"]
    assert np.all(np.abs(arrows.V) > np.abs(arrows.U))  # nearly along the axis of the mass
    assert len(wt.plot(chart).axes) == 2


@pytest.mark.parametrize(
    ("shape", "levels"),
    [
        (lambda x: 350.7 + 60.0 * x, np.arange(355.0, 411.0, 5.0)),
        (lambda x: 1e-3 * x, np.arange(1.0, 9.5) * 1e-4),
        (lambda x: np.round(9.0 * x), np.arange(1.0, 9.0)),
        (lambda x: 350.0 + 60.0 * x**8, [350.0, 350.5, 352.0, 354.0, 360.0, 370.0, 400.0]),  # most of it is flat
        (lambda x: 1.0 * (x > 0.5), [0.0, 1.0]),
        (lambda x: 1.0 * (x == 1.0), [0.0]),
    ],
)
def test_level_curves_have_round_numbers(shape, levels):
    values = shape(np.linspace(0.0, 1.0, 900)).reshape(30, 30)
    held = {"speed": np.linspace(8.0, 10.0, 30), "load": np.linspace(1.0, 2.0, 30)}
    chart = xr.Dataset({"force": (("speed", "load"), values)}, held, {"title": "wheeltapper chart"})
    (curves,) = wt.plot(chart).axes[0].collections
    np.testing.assert_allclose(curves.levels, levels, atol=1e-12)


def test_an_axis_counts_from_the_scenarios_value_however_its_path_names_it():
    pair = wt.vehicles.Wheelsets(wheelsets=(BUMP.vehicle, BUMP.vehicle), positions=(0.0, -2.5))
    over = {"vehicle.wheelsets.wheelset 2.damping": [4e4, 5e4], "speed": [8.0, 9.0]}
    chart = wt.sweep(BUMP.replaced({"vehicle": pair, "duration": 0.01}), over, ["largest_force"]).isel(wheelset=0)
    axis = wt.plot(chart, features=["largest_force"]).axes[0]
    assert axis.get_xlabel() == "damping of wheelset 2 [kN s/m]"
    assert axis.get_ylabel() == "speed [m/s]"


def test_a_wagons_feature_has_one_panel_of_the_wheel_in_which_it_varies_most():
    coach = wt.Scenario(
        vehicle=wt.Wagon.erri_b176(), contact=wt.Hertz(constant_per_wheel=9e10), speed=5.0, duration=0.02,
        irregularity={"right": wt.Step(height="0.1 mm", position=0.05)},
    )  # fmt: skip
    chart = wt.sweep(coach, {"speed": [4.0, 5.0, 6.0], "vehicle.bodies.0.mass": [3e4, 3.2e4]}, ["largest_force"])
    (axis,) = wt.plot(chart).axes
    assert axis.get_title(loc="left").startswith("wheelset 1, right: of 8 the one in which it is largest")
    assert axis.get_ylabel() == "mass of the car body [kg]"
    assert len(wt.plot(chart, wheels="all").axes) == 8
    (other,) = wt.plot(chart.sel(wheelset=2, side="left")).axes
    assert "wheelset" not in other.get_title(loc="left")
    (lines,) = wt.plot(chart.isel({"vehicle.bodies.0.mass": 0}, drop=True)).axes
    assert len(lines.get_lines()) == len(lines.get_legend().get_texts()) == 8
    with pytest.raises(wt.InputError, match="wheels: found 'all'; allowed: 'one', unless `what` is a chart"):
        wt.plot(coach, wheels="all")


@pytest.mark.parametrize(
    ("path", "said"),
    [
        ("speed", "speed"),
        ("vehicle.bodies.0.mass", "mass of body 1"),
        ("vehicle.bodies.car body.inertia.1", "inertia 2 of the car body"),
        ("irregularity.0.height", "height of irregularity 1"),
        ("track.rail.bending_stiffness", "bending stiffness of the rail"),
        ("irregularity.right.0.height", "height of irregularity 1 right"),
        ("irregularity.0.of.height", "height of irregularity 1"),
        ("vehicle.spring_corners.0.1", "spring corners 1 2 of the vehicle"),
    ],
)
def test_a_path_is_called_by_what_holds_the_field(path, said):
    assert words(path) == said


def test_masked_cells_are_hatched_and_have_no_arrow():
    dip = wt.CosineBump(height=-1.01e-4, length=0.0403, start=0.009)
    chart = wt.sweep(BUMP.replaced({"irregularity": dip, "speed": 5.57}), OVER, PAIR, gradient=True)
    masked = np.isnan(chart.impact_interval.values)
    assert masked.any()
    assert not masked.all()
    axis = wt.plot(chart, features=["impact_interval"]).axes[0]
    (arrows,) = [artist for artist in axis.collections if type(artist).__name__ == "Quiver"]
    hidden = np.broadcast_to(arrows.Umask, arrows.U.shape)
    assert hidden.reshape(6, 7).tolist() == masked.T.tolist()
    assert any(getattr(artist, "hatches", None) for artist in axis.collections)


def test_one_field_gives_lines_and_samples_give_clouds(tmp_path):
    line = wt.sweep(BUMP, {"speed": [8.0, 9.0, 10.0]}, PAIR)
    assert wt.plot(line, tmp_path / "line.png").axes[0].get_xlabel() == "speed [m/s]"
    assert (tmp_path / "line.png").stat().st_size > 1000
    ranges = {"vehicle.mass": ["1 t", "2 t"], "speed": [8, 10]}
    cloud = wt.sweep(BUMP, ranges, PAIR[:1], samples=8)
    assert wt.plot(cloud).axes[0].get_ylabel() == "speed [m/s]"
    assert wt.plot(wt.sweep(BUMP, {"speed": [8, 9]}, PAIR[:1], samples=8)).axes[0].get_xlabel() == "speed [m/s]"
    three = wt.sweep(BUMP, ranges | {"vehicle.damping": [2e4, 8e4]}, PAIR[:1], samples=8)
    said = [axis.get_xlabel() for axis in wt.plot(three).axes]
    assert said == ["mass of the vehicle [kg]", "speed [m/s]", "damping of the vehicle [kN s/m]"]


def test_what_cannot_be_drawn_is_refused():
    with pytest.raises(wt.InputError, match="a Record, a chart, an evolution, marks"):
        wt.plot(3)
    chart = wt.sweep(BUMP, OVER | {"speed": [8.0, 9.0]}, PAIR)
    with pytest.raises(wt.InputError, match="3 varied fields"):
        wt.plot(chart)
    with pytest.raises(wt.InputError, match="nonsense"):
        wt.plot(chart.isel(speed=0), features=["nonsense"])
    with pytest.raises(wt.InputError, match="at least 2 x 2"):
        wt.plot(chart.isel({"speed": 0, "vehicle.mass": slice(0, 1)}))


def test_a_record_with_many_losses_has_one_shade_on_each_axis_and_no_integrals():
    record = wt.simulate(BUMP)
    figure = wt.plot(record)
    losses = int((record.events.kind == "loss").sum())
    for axis in figure.axes:
        shade = axis.collections[-1]
        assert len(shade.get_paths()) == losses > 1
        start = shade.get_paths()[0].vertices[:, 0].min()
        assert start == pytest.approx(1e3 * float(record.events.time[record.events.kind == "loss"][0]))
    assert "impacts" not in vars(record)  # which would be integrated over every step


def test_answers_about_a_track_are_drawn():
    track = wt.tracks.Ballasted.named("rolland_UIC60_example")
    frequencies = np.geomspace(20.0, 3000.0, 40)
    modulus, phase = wt.plot(wt.tracks.receptance(track, [0.0, *frequencies], [0.0, 0.3])).axes
    assert modulus.get_ylabel() == "receptance [nm/N]"
    assert [line.get_label() for line in modulus.lines] == ["at 0 m", "at 0.3 m", "pinned-pinned"]
    x, y = modulus.lines[1].get_data()
    np.testing.assert_allclose(x, frequencies)  # zero has no place on a logarithmic axis
    np.testing.assert_allclose(y, 1e9 * abs(wt.tracks.receptance(track, frequencies, 0.3)))
    assert phase.get_ylim() == (-180.0, 0.0)
    (cross, _) = wt.plot(wt.tracks.receptance(track, frequencies, 0.0, 1.2)).axes
    assert cross.lines[0].get_label() == "at 1.2 m, force at 0 m"
    (axis,) = wt.plot(wt.tracks.decay_rate(track, frequencies)).axes
    np.testing.assert_allclose(axis.lines[0].get_ydata(), wt.tracks.decay_rate(track, frequencies))
    (axis,) = wt.plot(wt.tracks.static_deflection(track, np.linspace(0.0, 1.2, 30))).axes
    assert [float(line.get_xdata()[0]) for line in axis.lines[1:]] == pytest.approx([0.0, 0.6, 1.2])
    figure = wt.plot(wt.tracks.pinned_pinned(track))
    assert "1063.2 Hz" in figure.get_suptitle()

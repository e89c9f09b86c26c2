"""Each kind of picture can be read: labels with units, legends beside the data, nothing cut off."""

import numpy as np
import pytest
from matplotlib.colors import to_hex

import wheeltapper as wt
from tests.looks import flaws
from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.registry import makeable_nouns
from wheeltapper.faces.vehicles import _per_cent

from .test_charts import BUMP, OVER, PAIR

COACH = {"vehicle": wt.Wagon.erri_b176(), "speed": 5.0, "duration": 0.05}
STEP = wt.Step(height=1e-4, position=0.05)
PLASTIC = {"contact": wt.contact.Thornton(constant=1.405e11, yield_force=2.1e5, rail_share=0.5)}


@pytest.fixture(scope="module")
def site():
    return wt.load("examples/site.toml")


@pytest.fixture(scope="module")
def recording(site):
    (found,) = wt.synthesise(site, fault="broken spring", seed=2)
    return found


def test_a_record_shows_what_its_shades_mean():
    figure = wt.plot(wt.simulate(BUMP))
    assert flaws(figure) == []
    for axis in figure.axes:
        assert "out of contact" in [text.get_text() for text in axis.get_legend().get_texts()]


def test_colours_do_not_depend_on_the_style_at_the_time_of_saving():
    figure = wt.plot(wt.simulate(BUMP))
    marks = [line for line in figure.axes[1].get_lines() if line.get_label() == "impact"]
    assert not str(marks[0].get_color()).startswith("C")


def test_a_wagons_wheelsets_share_one_scale_and_its_body_has_a_direction():
    figure = wt.plot(wt.simulate(wt.Scenario(irregularity={"wheelset 1": STEP}, **COACH)))
    assert flaws(figure) == []
    assert len({axis.get_ylim() for axis in figure.axes[:4]}) == 1
    assert "upwards" in figure.axes[-1].get_ylabel()
    still = wt.plot(wt.simulate(wt.Scenario(**COACH)))
    low, high = still.axes[0].get_ylim()
    assert high - low > 0.01 * high  # rounding does not look like an event


def test_a_wagon_beside_its_core_model():
    scenario = wt.Scenario(irregularity=STEP, **COACH)
    assert flaws(wt.plot(wt.simulate(scenario), against=wt.simulate(wt.reduced(scenario)))) == []


def test_a_sweep_of_one_field_has_units_that_read_well_and_explains_its_bars():
    chart = wt.sweep(BUMP, {"speed": np.linspace(3.0, 9.0, 60)}, ["largest_force", "impact_interval"], gradient=True)
    figure = wt.plot(chart)
    assert flaws(figure) == []
    assert figure.axes[0].get_ylabel() == "largest force [kN]"
    assert figure.axes[1].get_ylabel() == "impact interval [ms]"
    (said,) = figure.axes[1].get_legend().get_texts()
    assert said.get_text() == "no value, or no reliable gradient"


def test_a_map_and_a_cloud():
    chart = wt.sweep(BUMP, OVER, PAIR, gradient=True)
    figure = wt.plot(chart)
    assert flaws(figure) == []
    numbers = [text for text in figure.axes[0].texts if text.get_text()]
    assert {to_hex(text.get_color()) for text in numbers} == {"#000000"}
    assert 1.0 < float(numbers[0].get_text()) < 20.0  # ms
    cloud = wt.sweep(BUMP, {"vehicle.mass": ["1 t", "2 t"], "speed": [8, 10]}, PAIR[:1], samples=8)
    assert flaws(wt.plot(cloud)) == []


@pytest.mark.slow
def test_a_map_over_masses_of_five_digits_has_numbers_apart():
    over = {"vehicle.bodies.car body.mass": [30e3, 32e3, 34e3], "speed": [4.0, 6.0]}
    chart = wt.sweep(wt.Scenario(irregularity=STEP, **COACH | {"duration": 0.02}), over, ["largest_force"])
    assert flaws(wt.plot(chart)) == []


@pytest.mark.slow
def test_wear_has_no_offset_and_no_growth_of_noise():
    shape = wt.Corrugation(amplitude=-5e-5, wavelength=0.05, start=0.01)
    rough = BUMP.replaced({"irregularity": shape, "speed": 36.0, "duration": 0.03, "vehicle.damping": 8e3} | PLASTIC)
    worn = wt.wear_in(rough, 3)
    figure = wt.plot(worn)
    assert flaws(figure) == []
    (growth,) = [axis for axis in figure.axes if "growth" in axis.get_ylabel()]
    drawn = np.isfinite(growth.get_lines()[0].get_ydata())
    first = worn.amplitude.isel(kept=0).values
    assert (first[drawn] > 1e-3 * first.max()).all()
    assert flaws(wt.plot(wt.wear.marks(wt.simulate(BUMP.replaced(PLASTIC))))) == []


@pytest.mark.slow
def test_a_finding_and_its_recording_and_force(site, recording):
    figure = wt.plot(wt.diagnose(recording, site))
    assert flaws(figure) == []
    verdicts = figure.axes[-1]
    assert max(bar.get_height() for bar in verdicts.patches) < 0.25 * abs(np.diff(verdicts.get_ylim()).item())
    assert flaws(wt.plot(recording)) == []
    assert flaws(wt.plot(wt.diagnosis.reconstructed(recording, site))) == []


@pytest.mark.whole
@pytest.mark.slow
def test_how_well_a_site_tells_faults(site):
    found = wt.diagnosis.assess(
        site, {"wheel flat": (0.002, 0.02), "broken spring": None}, count=6, healthy=6, workers=1
    )
    figure = wt.plot(found)
    assert flaws(figure) == []
    assert figure.axes[1].get_xlabel() == "size [mm]"
    widths = [line.get_linewidth() for line in figure.axes[0].get_lines()]
    assert len(set(widths)) == len(widths)  # curves that coincide are seen


def test_the_imitation_of_decks(site):
    shown = wt.diagnosis.imitation_map(site, np.geomspace(2e3, 2e4, 20), np.geomspace(2e6, 2e7, 20), [50.0, 180.0])
    figure = wt.plot(shown)
    assert flaws(figure) == []
    assert "error" in figure.get_suptitle()


@pytest.mark.slow
def test_a_design_marks_what_it_chose(site):
    figure = wt.plot(wt.design_site(site, budget=40, speeds=(9.0,)))
    assert flaws(figure) == []
    for axis in figure.axes[1:]:
        assert "chosen" in [str(line.get_label()) for line in axis.get_lines()]


@pytest.mark.slow
def test_a_wagon_shows_its_bodies_to_scale_and_names_all_elements():
    coach = wt.Wagon.erri_b176()
    figure = wt.plot(coach)
    assert flaws(figure) == []
    side = figure.axes[0]
    boxes = [patch.get_extents().transformed(side.transData.inverted()) for patch in side.patches]
    # the homogeneous box of the mass and the moments: m·(b² + c²)/12
    assert boxes[0].width == pytest.approx(np.sqrt(6 * (2 * 1.97e6 - 56_800) / 32e3), rel=1e-9)
    assert {round(box.width, 6) for box in boxes if box.y0 < 1e-9} == {0.92}  # wheels stand on the rail
    (named,) = figure.legends
    numbers, names = zip(*(text.get_text().split("  ") for text in named.get_texts()), strict=True)
    assert numbers == tuple(str(number) for number in range(1, len(names) + 1))
    assert figure.axes[2].get_title(loc="left") == "plan"
    below = wt.plot(coach, interactive=True).layout.annotations[-1].text
    assert below.startswith("1  primary spring 1 left, primary damper 1 left<br>2  ")
    said = ", ".join(names)
    assert sorted(said.split(", ")) == sorted(element.name for element in coach.elements)
    alone = wt.Wagon(bodies=(), axles=coach.axles[:1])
    assert flaws(wt.plot(alone)) == []
    assert len(wt.plot(wt.vehicles.ErriB176()).axes) == 3
    assert len(wt.plot(wt.Wheelset(mass=1500)).axes) == 3


def test_a_plan_leaves_out_numbers_that_have_no_room_and_says_how_many():
    coach = wt.Wagon.erri_b176()
    more = [
        wt.vehicles.Spring(name=f"more {k}", between=("car body", "bogie 1"), at=(-1.3 + 0.05 * k, 0.5, 0.7),
                           stiffness=(1e3, 1e3, 1e3)) for k in range(100)
    ]  # fmt: skip
    figure = wt.plot(wt.Wagon(bodies=coach.bodies, axles=coach.axles, elements=(*coach.elements, *more)))
    assert flaws(figure) == []
    plan = figure.axes[2]
    shown = [text for text in plan.texts if text.get_visible()]
    boxes = [text.get_window_extent() for text in shown]
    assert not any(one.overlaps(other) for i, one in enumerate(boxes) for other in boxes[:i])
    left_out = 18 + 100 - sum(len(text.get_text().split(", ")) for text in shown)
    assert plan.get_title(loc="left") == f"plan; no room for {left_out} of the list's numbers"
    assert 0 < left_out < 100


@pytest.mark.slow
def test_modes_show_roots_and_shapes():
    modes = wt.modes(wt.Scenario(**COACH))
    figure = wt.plot(modes)
    assert flaws(figure) == []
    noted = [text.get_text() for text in figure.axes[2].texts]  # those of equal roots are in one label
    assert len(", ".join(noted).split(", ")) == 4
    assert _per_cent(-8.5e-13) == "0"
    assert _per_cent(0.0135) == "1.35"
    bounce = modes.isel(mode=list(modes.name.values).index("car body bounce"))
    figure = wt.plot(bounce)
    (dots,) = figure.axes[2].collections
    (root,) = dots.get_offsets()
    size, ratio = 2 * np.pi * float(bounce.frequency), float(bounce.damping_ratio)
    np.testing.assert_allclose(root, [-ratio * size, float(bounce.frequency) * np.sqrt(1 - ratio**2)])
    side = figure.axes[3]
    still, moved = side.patches[0].get_xy(), side.patches[1].get_xy()
    up = (moved - still)[:4, 1]
    np.testing.assert_allclose(up, up[0])  # the car body goes up as a whole, by a share of the vehicle's length
    assert up[0] > 0.5


def test_modes_over_speed_follow_what_becomes_unstable():
    running = wt.Scenario(**COACH, creep=wt.creep.Polach(friction=0.35), contact=wt.Hertz(constant_per_wheel=7.025e10))
    several = [wt.modes(running.replaced({"speed": speed})) for speed in (60.0, 70.0, 80.0)]
    figure = wt.plot(several)
    assert flaws(figure) == []
    named = [line for line in figure.axes[1].get_lines() if str(line.get_label()).startswith("bogie lateral")]
    assert len(named) == 2
    for line in named:
        ratios = line.get_ydata()
        assert ratios[0] > 0.0 > ratios[-1]
        assert (np.diff(ratios) < 0.0).all()
    with pytest.raises(wt.InputError, match="rising speeds"):
        wt.plot(several[::-1])


@pytest.mark.slow
def test_comfort_shows_accelerations_running_rms_and_blocks():
    bump = wt.CosineBump(height=2e-3, length=2.0, start=1.0)
    record = wt.simulate(wt.Scenario(**COACH | {"duration": 6.0}, irregularity=bump))
    comfort = record.comfort(rate=250.0)
    np.testing.assert_allclose(comfort.running_rms.max("time"), comfort.maximum_transient_vibration)
    block = comfort.weighted_acceleration.isel(time=slice(0, 1250))
    np.testing.assert_allclose(np.sqrt((block**2).mean("time")), comfort.continuous_comfort.isel(block=0))
    figure = wt.plot(comfort)
    assert flaws(figure) == []
    assert len(figure.axes) == 3
    assert f"{float(comfort.mean_comfort):.3g}" in figure.get_suptitle()
    short = record.comfort(rate=250.0, settling=5.5)
    assert flaws(wt.plot(short)) == []


def test_several_records():
    records = [wt.simulate(BUMP.replaced({"vehicle.damping": damping})) for damping in (2e4, 5e4)]
    figure = wt.plot(records)
    assert flaws(figure) == []
    assert len(figure.axes[0].get_lines()) == 2


@pytest.mark.parametrize("what", [[], [3]])
def test_a_list_of_other_things_is_refused(what):
    with pytest.raises(wt.InputError, match="allowed"):
        wt.plot(what)


CORRUGATED = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4), contact=wt.Hertz(constant=1.405e11),
    irregularity=wt.Corrugation(amplitude=5e-5, wavelength=0.05, start=0.1), rolling="point", speed=5.0, duration=1.0,
)  # fmt: skip


@pytest.mark.slow
def test_orbits_and_what_is_asked_about_them():
    orbit = wt.orbits.find(CORRUGATED)
    branch = wt.orbits.follow(orbit, {"speed": (4.0, 8.0)})
    starts = {"start.displacement": np.linspace(-4e-4, 4e-4, 9), "start.velocity": np.linspace(-0.3, 0.3, 9)}
    amplitudes = {"irregularity.0.amplitude": [4.8e-5, 4.6e-5]}
    _, multiplier = wt.plot(branch).axes
    drawn = {line.get_label(): line for line in multiplier.get_lines()}
    np.testing.assert_array_equal(drawn["fold"].get_ydata(), 1.0)  # by what a fold is
    stable, unstable = (drawn[name].get_xdata() for name in ("stable", "unstable"))
    for at in drawn["fold"].get_xdata():  # lines end where the motion changes, not at the point of the branch beside it
        assert at in stable
        assert at in unstable
    fold = branch.isel(special=int(np.flatnonzero(branch.kind.values == "fold")[-1]))
    for result in (
        orbit, branch, wt.orbits.returns(CORRUGATED, {"speed": np.linspace(4.0, 8.0, 9)}, 20, 5),
        wt.orbits.fates(CORRUGATED, starts, 60), wt.orbits.fates(CORRUGATED, {"speed": [5.0, 9.0, 15.0]}, 200),
        wt.orbits.ramp(CORRUGATED, {"speed": (5.0, 6.0)}, 0.01), wt.orbits.trace(orbit, fold, amplitudes),
    ):  # fmt: skip
        assert flaws(wt.plot(result)) == []


@pytest.mark.slow
def test_several_borders_share_one_plane_and_differ_in_their_lines():
    orbit = wt.orbits.find(CORRUGATED)
    branch = wt.orbits.follow(orbit, {"speed": (2.5, 8.0)})
    folds = np.flatnonzero(branch.kind.values == "fold")[-2:]
    depths = {"irregularity.0.amplitude": [5e-5, 4.8e-5]}
    curves = [wt.orbits.trace(orbit, branch.isel(special=number), depths) for number in folds]
    figure = wt.plot(curves)
    assert flaws(figure) == []
    (axis,) = figure.axes
    assert [line.get_label() for line in axis.get_lines()] == ["fold 1", "fold 2"]
    assert len({line.get_linestyle() for line in axis.get_lines()}) == 2
    np.testing.assert_allclose(axis.get_lines()[0].get_ydata(), [50.0, 48.0])
    other = wt.orbits.trace(orbit, branch.isel(special=folds[0]), {"vehicle.damping": [2e4]})
    with pytest.raises(wt.InputError, match="same two fields"):
        wt.plot([curves[0], other])


def test_rising_and_falling_ramps_and_diagrams_and_several_branches_share_one_picture():
    up, down = (
        wt.orbits.returns(CORRUGATED, {"speed": np.linspace(5.0, 8.0, 7)}, 100, 5, carry) for carry in ("up", "down")
    )
    rise, fall = (wt.orbits.ramp(CORRUGATED, {"speed": ends}, 0.01) for ends in ((5.0, 6.0), (6.0, 5.0)))
    branch = wt.orbits.follow(wt.orbits.find(CORRUGATED), {"speed": (4.5, 5.5)})
    for several, names in (([up, down], ["up", "down"]), ([rise, fall], ["rising", "falling"])):
        figure = wt.plot(several)
        assert flaws(figure) == []
        assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()] == names
        for line, one in zip(figure.axes[-1].get_lines(), several, strict=True):
            np.testing.assert_allclose(line.get_ydata(), one.largest_force.values.ravel() / one.static_force)
    assert [line.get_label() for line in wt.plot([rise, rise]).axes[0].get_lines()] == ["1: rising", "2: rising"]
    figure = wt.plot({"one wave": branch, "again": branch})
    assert all(flaw.endswith("points") for flaw in flaws(figure))  # of so short a branch
    assert {"one wave", "again"} <= {text.get_text() for text in figure.axes[0].get_legend().get_texts()}
    other = wt.orbits.ramp(CORRUGATED, {"vehicle.mass": (1500.0, 1510.0)}, 1.0)
    with pytest.raises(wt.InputError, match=r"what: found orbits over different fields: speed, vehicle\.mass"):
        wt.plot([rise, other])


SHAPES = {kind.__name__: kind(**kind.example) for kind in makeable_nouns(Irregularity)}


@pytest.mark.parametrize("name", SHAPES)
def test_an_irregularity_along_its_rail_or_wheel(name):
    figure = wt.plot(SHAPES[name])
    assert flaws(figure) == []
    (line,) = figure.axes[0].get_lines()
    x, y = line.get_data()
    course = SHAPES[name].course(0.46)
    scale = np.abs(y).max() / np.abs(course.value(x)).max()
    np.testing.assert_allclose(y, scale * course.value(x), rtol=1e-9, atol=1e-12)
    assert np.ptp(y) > 0.0


def test_a_spectrum_beside_what_is_stated_and_its_limit():
    rough = wt.irregularities.Spectrum(curve="ISO 3095:2005", wavelengths=("1 cm", "50 cm"), seed=1)
    figure = wt.plot(rough)
    assert flaws(figure) == []
    stated, realised, limit = figure.axes[1].get_lines()
    np.testing.assert_allclose(realised.get_ydata(), stated.get_ydata(), atol=0.05)
    assert stated.get_ydata()[8] == pytest.approx(6.9, abs=0.05)  # dB at 8 cm
    assert limit.get_ydata()[0] == 17.1

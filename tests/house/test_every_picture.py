"""Everything that has a name in public is drawn, and what is drawn is what the noun or the table says."""

from importlib import import_module

import numpy as np
import pytest

import wheeltapper as wt
from tests.looks import flaws
from wheeltapper.describe.contact.base import Contact
from wheeltapper.describe.creep.base import CreepLaw
from wheeltapper.describe.registry import makeable_nouns
from wheeltapper.describe.track.anomaly import Anomaly
from wheeltapper.describe.track.base import Track
from wheeltapper.describe.vehicle.base import Vehicle
from wheeltapper.describe.vehicle.element import Element
from wheeltapper.faces.drawers import HELD, KINDS, TITLES
from wheeltapper.faces.faults import reference_passage
from wheeltapper.faces.interactive import interactive_figure
from wheeltapper.faces.plane import integrated

from ..registering import undone
from .test_charts import BUMP, OVER, PAIR

ENDS = {"name": "damper 1", "between": ("car body", "bogie 1"), "at": (0.0, 0.0, 1.0)}
WHEELSET = {"mass": 1500, "load": 91_307, "stiffness": 2.44e6, "damping": 5e4}
GIVEN = {"Element": ENDS, "Wheelset": WHEELSET, "Wagon": {"bodies": (), "axles": wt.Wagon.erri_b176().axles[:1]}}


def made(family):
    """Return one of each kind of noun of a family, by its name."""
    return {
        kind.__name__: kind(
            **GIVEN.get(family.__name__, {}) | GIVEN.get(kind.__name__, {}) | getattr(kind, "example", {})
        )
        for kind in makeable_nouns(family)
    }


NOUNS = {name: noun for family in (Contact, CreepLaw, Track, Anomaly, Vehicle, Element)
         for name, noun in made(family).items()}  # fmt: skip
NOUNS |= {
    "Rail": wt.tracks.Rail.named("60E1"), "WheelRail": wt.profiles.WheelRail(),
    "Cones": wt.profiles.Cones(conicity=0.05),
    "Site": wt.load("examples/site.toml"), "detector": wt.load("examples/detector.toml"),
    "Body": wt.Wagon.erri_b176().bodies[0], "Axle": wt.Wagon.erri_b176().axles[1],
    "Scenario": wt.load("examples/flat_on_ballast.toml"), "deck": wt.load("examples/deck.toml"),
    "coach": wt.load("examples/coach_step.toml"),
    "track with anomalies": wt.tracks.Ballasted(
        **wt.tracks.Ballasted.example,
        anomalies=(wt.tracks.HangingSleeper(seat=2, void=1e-3), wt.tracks.MissingPad(seat=4)),
    ),
    "Law with a rate": wt.contact.Law(lambda d, v: 1.4e11 * d**1.5 * (1.0 + 0.4 * v)),
    "Rule": wt.diagnosis.read_rules()[0], "Rule of a sum": wt.diagnosis.read_rules()[-1],
    "Prior": wt.diagnosis.Prior(0.04, 0.7, "lognormal"), "Prior, normal": wt.diagnosis.Prior(9.0, 0.1, "normal"),
    "Prior, uniform": wt.diagnosis.Prior(1.4, 1.4, "uniform"), "Prior, flat": wt.diagnosis.Prior(1500.0),
    "Prior, shift": wt.diagnosis.Prior(0.0, 1e-3, "shift"),
    "Neighbour": wt.diagnosis.Neighbour(spacing=-2.5, fault="wheel flat", size=(0.02, 0.06)),
    "Condition": wt.diagnosis.Condition("broken spring"),
    "Hertz with hysteresis": wt.Hertz(hysteresis=0.5), "pad sensor": wt.diagnosis.Sensor(kind="pad force", seat=3),
}  # fmt: skip


def test_every_name_in_the_list_of_drawers_is_a_function():
    for drawer in [*KINDS.values(), *TITLES.values(), *(one for _, one in HELD)]:
        for name in filter(None, (drawer.one, drawer.several)):
            module, _, function = name.rpartition(".")
            assert callable(getattr(import_module(f"wheeltapper.faces.{module}"), function)), name
    for kind in KINDS:
        module, _, name = kind.rpartition(".")
        assert isinstance(getattr(import_module(f"wheeltapper.{module}"), name), type), kind


@pytest.mark.slow
@pytest.mark.few(25)
@pytest.mark.parametrize("name", NOUNS)
def test_a_noun_draws_itself(name):
    figure = NOUNS[name].plot()
    assert flaws(figure) == []
    assert figure.get_suptitle()
    assert len(interactive_figure(figure).data)


@pytest.mark.slow
@pytest.mark.parametrize("name", wt.diagnosis.CATALOGUE)
def test_a_fault_draws_the_force_that_it_changes_and_what_is_believed_of_it(name):
    fault = wt.diagnosis.CATALOGUE[name]
    figure = fault.plot()
    assert flaws(figure) == []
    assert figure.get_suptitle().startswith(f"{name} ({fault.part})")
    healthy, faulty = (line.get_ydata() for line in figure.axes[0].get_lines())
    common = min(len(healthy), len(faulty))
    assert np.abs(healthy[:common] - faulty[:common]).max() > 0.1  # kN
    assert len(figure.axes) == 1 + len(fault.believed(reference_passage()))
    assert name in fault._repr_html_()


def test_a_rule_shows_what_it_allows_and_to_what_it_applies():
    rule = next(one for one in wt.diagnosis.read_rules() if one.plus_static and np.isfinite(one.speed_up_to))
    limit, scope = rule.plot().axes
    static, allowed = limit.get_lines()[0].get_data()
    np.testing.assert_allclose(1e3 * allowed, [rule.allowed(1e3 * one) for one in static])
    assert scope.collections[0].get_paths()[0].get_extents().y1 == pytest.approx(3.6 * rule.speed_up_to)
    assert f"{rule.limit / 1e3:g} kN" in rule._repr_html_()


def test_a_prior_shows_its_density():
    x, y = wt.diagnosis.Prior(0.04, 0.7, "lognormal").plot().axes[0].get_lines()[0].get_data()
    assert x[np.argmax(y)] == pytest.approx(0.04)
    np.testing.assert_allclose(y, np.exp(-0.5 * (np.log(x / 0.04) / 0.7) ** 2), atol=1e-12)
    x, y = wt.diagnosis.Prior(1.4, 0.2, "uniform").plot().axes[0].get_lines()[0].get_data()
    assert (y[np.abs(x - 1.4) < 0.199] == 1.0).all()
    assert (y[np.abs(x - 1.4) > 0.201] == 0.0).all()
    assert "lognormal" in wt.diagnosis.Prior(0.04, 0.7, "lognormal")._repr_html_()


def test_neighbours_stand_where_they_run():
    row = [wt.diagnosis.Neighbour(spacing=2.5), wt.diagnosis.Neighbour(spacing=-17.5, fault="wheel flat", size=0.03)]
    figure = wt.plot(row)
    assert flaws(figure) == []
    *wheels, _ = figure.axes[0].get_lines()
    np.testing.assert_allclose([line.get_xdata()[:-1].mean() for line in wheels], [0.0, 2.5, -17.5], atol=1e-9)
    assert "wheel flat, length 0.03 m" in figure.get_suptitle()
    assert "17.5" in row[1]._repr_html_()


def test_a_law_of_contact_shows_its_force():
    (line,) = wt.Hertz(constant=1.405e11).plot().axes[0].get_lines()
    x, y = line.get_data()
    np.testing.assert_allclose(1e3 * y, 1.405e11 * (1e-6 * x) ** 1.5, rtol=1e-12)
    own = wt.contact.Law(lambda d: 2e9 * d, exponent=1.0, largest=1e-4)
    (line,) = own.plot().axes[0].get_lines()
    np.testing.assert_allclose(1e3 * line.get_ydata(), 2e9 * 1e-6 * line.get_xdata(), rtol=1e-12)
    figure = wt.plot([own, wt.Linear(stiffness=1e9), wt.Hertz(constant=1.405e11)])
    assert flaws(figure) == []
    assert len(figure.axes[0].get_lines()) == 3


def test_own_laws_are_named_by_their_classes_and_lines_of_rates_by_the_rates():
    with undone():

        class Polymer(wt.contact.ForceLaw):
            def force(self, delta, rate):
                return 1.4e11 * delta**1.5 * (1.0 + 0.4 * rate)

        figure = wt.plot([Polymer(), wt.Hertz(constant=1.4e11), wt.contact.Thornton(constant=1.4e11)])
        assert flaws(figure) == []
        assert wt.plot(Polymer()).get_suptitle() == "contact law: Polymer"
    named = {text.get_text(): handle.get_linestyle() for text, handle in zip(
        figure.axes[0].get_legend().get_texts(), figure.axes[0].get_legend().get_lines(), strict=True)}  # fmt: skip
    assert named == {
        "1: Polymer": "-", "2: Hertz": "-", "3: Thornton": "-", "at a rate of -0.2 m/s": ":",
        "at a rate of 0.2 m/s or unloading": "--",
    }  # fmt: skip


def test_creep_laws_begin_with_the_linear_theory_and_end_at_the_limit_of_friction():
    laws = [wt.creep.Polach(friction=0.3), wt.creep.ShenHedrickElkins(friction=0.3), wt.creep.Fastsim(friction=0.3)]
    figure = wt.plot(laws)
    assert flaws(figure) == []
    *found, limit, linear = figure.axes[0].get_lines()
    assert limit.get_ydata()[0] == pytest.approx(0.3 * 75.0)
    for line in found:
        x, y = line.get_data()
        slope = linear.get_ydata()[1] / x[1]
        assert y[1] / x[1] == pytest.approx(slope, rel=0.06)
        assert 0.95 < y[-1] / 22.5 <= 1.01
        assert (np.diff(y) > -1e-3).all()


def test_a_suspension_shows_its_bumpstop():
    stopped = wt.Wheelset(**WHEELSET, bumpstop_gap=0.01, bumpstop_stiffness=1e7)
    (line,) = [one for one in stopped.plot().axes[1].get_lines() if one.get_label() == "suspension"]
    force = np.interp([-5.0, 5.0, 15.0], *line.get_data())
    np.testing.assert_allclose(force, [-12.2, 12.2, 36.6 + 50.0], rtol=2e-3)
    kinked = integrated((np.array([-1.0, 1.0]), np.array([3.0, 0.0, 3.0])), np.array([-2.0, 0.5, 2.0]))
    np.testing.assert_allclose(kinked, [-3.0, 0.0, 3.0], atol=1e-12)


@pytest.mark.slow
def test_a_deck_gives_way_as_one_mass_does_and_cones_have_their_conicity():
    line = wt.FloatingDeck(mass=5000, stiffness=2e7, damping=1e4).plot().axes[0].get_lines()[0]
    frequency, receptance = line.get_data()
    assert np.interp(1.0, frequency, receptance) == pytest.approx(1e9 / 2e7, rel=0.02)
    assert receptance.max() == pytest.approx(1e9 / (1e4 * np.sqrt(2e7 / 5000)), rel=1e-3)  # 1/(c·ω) at its frequency
    labels = [one.get_label() for one in wt.profiles.Cones(conicity=0.05).plot().axes[2].get_lines()]
    assert any("equivalent conicity 0.05" in label for label in labels)


def test_a_scenario_shows_the_path_ahead_and_the_force_at_rest():
    figure = BUMP.plot()
    assert flaws(figure) == []
    path = figure.axes[2].get_lines()[0]
    assert path.get_ydata().max() == pytest.approx(200.0, rel=1e-3)  # µm
    (rest,) = [one for one in figure.axes[1].get_lines() if one.get_label() == "at rest"]
    assert rest.get_data()[1][0] == pytest.approx(105.82, abs=0.01)


@pytest.fixture(scope="module")
def record():
    return wt.simulate(BUMP)


@pytest.mark.slow
def test_the_tables_of_a_record(record):
    for table in (
        record.events,
        record.peaks,
        record.impacts,
        record.energy,
        record.history(2e4),
        record.suspension_events,
    ):
        figure = wt.plot(table)
        assert flaws(figure) == []
        assert figure.get_suptitle()
    stems = wt.plot(record.impacts).axes[0].get_lines()[0]
    np.testing.assert_allclose(stems.get_ydata(), record.impacts.peak_force / 1e3)
    named = [text.get_text() for text in wt.plot(record.events).axes[0].get_legend().get_texts()]
    assert named == ["loss (11)", "impact (11)"]


@pytest.mark.slow
def test_readings_of_a_track_and_a_train_of_several_wheels():
    changes = {"duration": 0.05, "irregularity.0.position": 0.6}
    run = wt.simulate(wt.load("examples/flat_on_ballast.toml").replaced(changes))
    figure = wt.plot(run.track(5e3, rail=[0.3, 0.6], seat=[1]))
    assert flaws(figure) == []
    assert [line.get_label() for line in figure.axes[0].get_lines()] == ["x = 0.3 m", "x = 0.6 m"]
    assert flaws(wt.plot(run.history(5e3))) == []


def test_several_records_are_named_by_what_sets_them_apart(record):
    figure = wt.plot([record, wt.simulate(BUMP.replaced({"vehicle.damping": 2e4}))])
    said = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert said == ["damping of the vehicle 50 kN s/m", "damping of the vehicle 20 kN s/m"]
    with pytest.raises(wt.InputError, match=r"what\.1"):
        wt.plot([record, wt.Hertz(constant=1e11)])


@pytest.mark.slow
def test_guiding_forces_and_running_safety_of_a_coach():
    coach = wt.Scenario(
        vehicle=wt.Wagon.erri_b176(), speed=20.0, duration=0.3, creep=wt.creep.Polach(),
        irregularity={"wheelset 1 right": wt.CosineBump(height=2e-4, length=0.5, start=0.5)},
    )  # fmt: skip
    run = wt.simulate(coach)
    found = run.guidance(rate=20e3)
    assert flaws(wt.plot(found)) == []
    assert flaws(wt.plot(run.running_safety(rate=20e3))) == []
    assert flaws(wt.plot([run, run])) == []
    y = wt.plot(found).axes[0].get_lines()[0].get_ydata()
    np.testing.assert_allclose(y, found.guiding_force.isel(wheelset=0, side=0) / 1e3)
    still = 1e-12 * found.sum_of_guiding_forces  # rounding of a vehicle that runs straight
    assert wt.plot(found.assign(sum_of_guiding_forces=still)).axes[3].get_ylim() == (-1.0, 1.0)
    worn = wt.plot(found).axes[-1].get_lines()[0].get_ydata()  # of T-gamma, which has no mean at the ends
    np.testing.assert_array_equal(np.isnan(worn), np.isnan(found.t_gamma.isel(surface=0, wheelset=0, side=0)))


def test_a_gradient_and_a_border_and_statistics():
    found = wt.gradient(BUMP, PAIR, ["speed", "vehicle.mass"])
    figure = wt.plot(found)
    assert flaws(figure) == []
    widths = [bar.get_width() for bar in figure.axes[0].patches]
    np.testing.assert_allclose(widths[:2], found.impact_interval_elasticity)
    border = wt.border(BUMP, {"speed": (2.0, 6.0), "irregularity.0.height": (2e-5, 2e-4)}, resolution=9)
    assert flaws(wt.plot(border)) == []
    rng = np.random.default_rng(1)
    curve = wt.diagnosis.roc(rng.normal(0, 1, 100), rng.normal(2, 1, 100))
    assert flaws(curve.plot()) == []
    assert flaws(wt.diagnosis.false_calls(3, 1000).plot()) == []
    sizes = rng.uniform(1, 50, 120)
    pod = wt.diagnosis.hit_miss(sizes, rng.uniform(size=120) < 1 / (1 + np.exp(-3 * (np.log(sizes) - 2.5))))
    line = pod.plot().axes[0].get_lines()[0]
    assert np.interp(pod.a50, *line.get_data()) == pytest.approx(0.5, abs=0.01)


@pytest.mark.slow
def test_what_recordings_say_of_fields_and_trains():
    site = wt.load("examples/site.toml")
    found = wt.diagnosis.information(site, speeds=[6.0, 9.0])
    figure = found.plot()
    assert flaws(figure) == []
    dots = figure.axes[0].get_lines()[0].get_xdata()
    np.testing.assert_allclose(dots, 100.0 * found.deviations[0])
    assert flaws(wt.diagnosis.combinations(found).plot()) == []
    recordings = wt.synthesise(site, fault="broken spring", seed=2, count=2)
    assert flaws(wt.plot(recordings)) == []
    train = wt.diagnosis.diagnose_train(recordings, site)
    assert flaws(train.plot()) == []
    assert flaws(wt.plot((train, train))) == []
    bars = [bar.get_height() for bar in train.plot().axes[0].patches]
    np.testing.assert_allclose(bars, [row["static_kn"] for row in train.table()])
    assert "axle 2" in train._repr_html_()
    estimate = train.findings[1].estimate
    assert flaws(estimate.plot()) == []


def test_a_train_marks_wheels_that_strike_and_recordings_are_named_by_their_channels():
    site, file = wt.load("examples/detector.toml"), "examples/data/passages/2026-11-02T08-12_id=4711.csv.gz"
    channels = wt.diagnosis.read_channels(file, site)
    figure = wt.plot(channels)
    assert [axis.get_title(loc="left") for axis in figure.axes] == [f"{one.name}: force" for one in site.sensors]
    assert figure.get_suptitle() == "6 recordings: 2026-11-02T08-12 id=4711.csv.gz"
    assert wt.plot(list(channels.values())).axes[1].get_title(loc="left").startswith("2: force, examples/data/passages")
    (train,) = wt.diagnosis.measure_trains(channels, site)
    (struck,) = (row for row in train.table() if row["strikes"])
    figure = train.plot()
    assert flaws(figure) == flaws(wt.plot([train, train])) == []
    assert figure.get_suptitle() == "12 axles, 1 wheel strikes, 0 alarms"
    (star,) = (line for line in figure.axes[0].get_lines() if line.get_label() == "hardest strike")
    assert star.get_xydata().tolist() == [[pytest.approx(struck["axle"] + 0.2), struck["strike_kn"]]]
    ratios = [row["dynamic_ratio"] for row in train.table()]
    assert figure.axes[1].get_ylim() == (0.0, pytest.approx(1.1 * max(ratios)))  # so that no dot is cut


def test_a_number_has_no_picture():
    for what in (3, "bump", None, np.zeros(3), {}, [None]):
        with pytest.raises(wt.InputError, match="what"):
            wt.plot(what)
    with pytest.raises(wt.InputError, match="features"):
        wt.plot(BUMP, features=["speed"])


def test_a_chart_of_all_features_is_drawn_by_the_same_verb():
    chart = wt.sweep(BUMP, OVER, PAIR)
    assert len(wt.plot(chart).axes) == 2

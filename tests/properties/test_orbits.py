"""Orbits are what marches do: they close, branches consist of them, fates last, and exponents are those of orbits."""

import numpy as np
import pytest

import wheeltapper as wt

AMPLITUDE = "irregularity.0.amplitude"
WHEEL = {"mass": 1500, "load": 91_307, "stiffness": 2.44e6, "damping": 2e4, "radius": 0.46}
DECK = wt.FloatingDeck(mass=500, stiffness=1e7, damping=100)
HEIGHT, SPEED = 8.289e-5, 0.0777
"""Static indentation, and the velocity that belongs to it."""


def scene(speed=5.0, irregularity=None, **changes):
    waves = wt.Corrugation(amplitude=5e-5, wavelength=0.05, start=0.1)
    given = {"rolling": "point", "contact": wt.Hertz(constant=1.405e11)} | changes
    return wt.Scenario(
        vehicle=wt.Wheelset(**WHEEL | given.pop("vehicle", {})), irregularity=irregularity or waves, speed=speed,
        duration=1.0, **given,
    )  # fmt: skip


PERIODIC = {
    "joints": scene(9.0, wt.Repeated(of=wt.CosineBump(height=1e-4, length=0.05, start=0.3), period=0.5)),
    "joints under a circle": scene(
        9.0, wt.Repeated(of=wt.CosineBump(height=1e-4, length=0.1, start=0.3), period=0.5), rolling="circle"
    ),
    "a flat": scene(9.0, wt.WheelFlat(depth=1e-4, position=0.3), rolling="circle"),
    "out of round": scene(9.0, wt.OutOfRound(orders=(1, 9), amplitudes=(1e-4, 2e-5)), rolling="circle"),
    "corrugation and a flat of the same period": scene(
        9.0, [wt.Corrugation(amplitude=2e-5, wavelength=2 * np.pi * 0.46 / 50, start=0.1),
              wt.WheelFlat(depth=1e-5, position=0.3)], rolling="circle",
    ),
    "two corrugations": scene(
        9.0, [wt.Corrugation(amplitude=2e-5, wavelength=w, start=0.1) for w in (0.05, 0.075)]
    ),
    "default wheel": scene(9.0, contact=wt.Hertz(), rolling="circle"),
    "hysteresis": scene(9.0, contact=wt.Hertz(constant=1.405e11, hysteresis=0.3)),
    "linear": scene(9.0, contact=wt.Linear(stiffness=1.2e9)),
    "bilateral": scene(9.0, contact=wt.Linear(stiffness=1.2e9, bilateral=True)),
    "deck": scene(9.0, track=wt.FloatingDeck(mass=15e3, stiffness=1.5e7, damping=5e4)),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.few(5)
@pytest.mark.parametrize("name", PERIODIC)
def test_an_orbit_closes_in_its_record_and_in_a_public_run(name):
    orbit = wt.orbits.find(PERIODIC[name])
    assert orbit.closure <= 1e-12
    if name != "hysteresis":
        assert abs(orbit.determinant_error) < 1e-8
        strict = wt.orbits.find(PERIODIC[name], method="strict")
        assert abs(strict.determinant_error) < 1e-12
        assert strict.closure <= 1e-12
    record = orbit.record
    assert record.outcome is wt.orbits.find(PERIODIC[name]).record.outcome
    ends = record.at([0.0, orbit.period])
    for variable, scale in (("wheel_displacement", HEIGHT), ("wheel_velocity", SPEED), ("normal_force", 1e5)):
        assert abs(np.diff(ends[variable].values).item()) < 1e-11 * scale
    assert float(ends.wheel_displacement[0]) == pytest.approx(orbit.start["displacement"], rel=1e-12)
    if name != "deck":  # whose own start a scenario does not have
        longer = record.scenario.model_copy(update={"duration": 2.0 * orbit.period})
        again = wt.simulate(longer, progress=False).at(orbit.period * np.array([0.25, 1.25])).wheel_displacement.values
        assert abs(again[1] - again[0]) < 1e-6 * HEIGHT


RAIL = 12.5
"""Length of a rail, m."""


def rail_joints():
    """Return dipped joints and a little waviness, measured over one rail, which is like all others."""
    x = np.linspace(0.0, RAIL, 501)
    to_joint = np.minimum(x, RAIL - x)
    heights = -2e-3 * np.exp(-to_joint) + 3e-5 * np.cos(2 * np.pi * 7 * x / RAIL)
    return wt.Measured(positions=tuple(x), heights=tuple(heights), beyond="repeat")


LONG_PERIODS = {
    "flat at 5 m/s": (scene(5.0, wt.WheelFlat(depth=1e-4, position=0.3), rolling="circle"), 2 * np.pi * 0.46),
    "flat at 20 m/s": (scene(20.0, wt.WheelFlat(depth=1e-4, position=0.3), rolling="circle"), 2 * np.pi * 0.46),
    "deep flat at 60 m/s": (scene(60.0, wt.WheelFlat(depth=1e-3, position=0.3), rolling="circle"), 2 * np.pi * 0.46),
    "rails at 10 m/s": (scene(10.0, rail_joints(), rolling="circle"), RAIL),
    "rails at 36 m/s": (scene(36.0, rail_joints(), rolling="circle"), RAIL),
    "rails under a point": (scene(20.0, rail_joints()), RAIL),
    "insulated joints": (
        scene(20.0, wt.Repeated(of=wt.CosineBump(height=-2e-3, length=0.6, start=1.0), period=RAIL), rolling="circle"),
        RAIL,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", LONG_PERIODS)
def test_a_long_plain_run_settles_on_the_orbit_over_a_revolution_or_a_rail(name):
    scenario, length = LONG_PERIODS[name]
    orbit = wt.orbits.find(scenario)
    assert orbit.period == pytest.approx(length / scenario.speed, rel=1e-12)
    assert orbit.stable
    assert orbit.closure <= 1e-12
    assert abs(orbit.determinant_error) < 1e-8
    rounds = 4 + int(np.ceil(np.log(1e-9) / np.log(min(abs(orbit.multipliers[0]), 0.8))))
    begin = (orbit.phase_zero + rounds * length) / scenario.speed
    plain = wt.simulate(scenario.replaced({"duration": begin + orbit.period}), progress=False)
    ends = plain.at([begin, begin + orbit.period])
    assert np.abs(ends.wheel_displacement.values - orbit.start["displacement"]).max() < 1e-7 * HEIGHT
    assert np.abs(ends.wheel_velocity.values - orbit.start["velocity"]).max() < 1e-7 * SPEED
    times = np.linspace(0.0, orbit.period, 301)
    forces = [one.normal_force.values for one in (plain.at(begin + times), orbit.record.at(times))]
    assert np.abs(forces[0] - forces[1]).max() < 1e-5 * orbit.largest_force
    late = plain.events.time.values[plain.events.kind.values == "loss"] > begin
    assert orbit.losses == int(late.sum())
    highest = plain.peaks.where(plain.peaks.time > begin, drop=True).normal_force
    assert orbit.largest_force == pytest.approx(float(highest.max()), rel=1e-6)


@pytest.mark.parametrize("wavelength", [0.05, 0.5, 2.0])
@pytest.mark.parametrize("speed", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("rolling", ["point", "circle"])
def test_a_long_calm_period_has_the_exact_determinant(rolling, speed, wavelength):
    waves = wt.Corrugation(amplitude=5e-5, wavelength=wavelength, start=0.0)
    for method, allowed in (("default", 1e-8), ("strict", 1e-12)):
        orbit = wt.orbits.find(scene(speed, waves, rolling=rolling), method=method)
        assert orbit.losses == 0
        assert abs(orbit.determinant_error) < allowed


@pytest.mark.parametrize(("method", "allowed"), [("default", 1e-9), ("strict", 1e-12)])
@pytest.mark.parametrize("speed", [0.5, 2.0, 30.0])
def test_a_linear_contact_that_never_opens_has_the_multipliers_of_its_equations(speed, method, allowed):
    waves = wt.Corrugation(amplitude=2e-7, wavelength=0.05, start=0.0)
    deck = wt.FloatingDeck(mass=15e3, stiffness=1.5e7, damping=5e4)
    for track in (wt.StiffTrack(), deck):
        orbit = wt.orbits.find(scene(speed, waves, contact=wt.Linear(stiffness=1.2e9), track=track), method=method)
        assert orbit.losses == 0
        m, k, c, contact = WHEEL["mass"], WHEEL["stiffness"], WHEEL["damping"], 1.2e9
        if track is deck:
            M, kd, cd = 15e3, 1.5e7, 5e4
            rates = np.array([
                [0, 1, 0, 0], [-(k + contact) / m, -c / m, contact / m, 0],
                [0, 0, 0, 1], [contact / M, 0, -(contact + kd) / M, -cd / M],
            ])  # fmt: skip
        else:
            rates = np.array([[0, 1], [-(k + contact) / m, -c / m]])
        expected = np.exp(np.linalg.eigvals(rates) * orbit.period)
        found = np.sort_complex(np.round(orbit.multipliers, 14))
        np.testing.assert_allclose(found, np.sort_complex(np.round(expected, 14)), rtol=0, atol=allowed)


def test_hysteresis_leaves_nothing_for_the_strict_method_to_mend():
    for speed in (1.0, 3.0, 9.0):
        worn = scene(speed, contact=wt.Hertz(constant=1.405e11, hysteresis=0.3))
        both = [wt.orbits.find(worn, method=method).multipliers for method in ("default", "strict")]
        np.testing.assert_allclose(*both, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["joints", "default wheel", "hysteresis", "deck"])
def test_multipliers_are_those_of_difference_quotients(name):
    from wheeltapper.orbits.asked import section_of
    from wheeltapper.orbits.section_map import SectionMap

    orbit = wt.orbits.find(PERIODIC[name], method="strict")
    each = SectionMap(section_of(PERIODIC[name], "strict"), 1)
    wave, state = each.wave_at(), orbit.state / each.scale
    quotients = each._differences(wave, state)
    np.testing.assert_allclose(
        each.image(wave, state).slopes, quotients, rtol=1e-5, atol=1e-6 * np.abs(quotients).max()
    )


def test_every_point_of_a_branch_is_an_orbit():
    orbit = wt.orbits.find(scene(5.0))
    branch = wt.orbits.follow(orbit, {"speed": (4.0, 8.0)})
    for point in np.linspace(0, branch.sizes["point"] - 1, 7).astype(int):
        here = branch.isel(point=point)
        start = {"displacement": float(here.displacement), "velocity": float(here.velocity)}
        found = wt.orbits.find(scene(float(here.speed)), start=start)
        assert found.start["displacement"] == pytest.approx(start["displacement"], abs=1e-9 * HEIGHT)
        assert found.losses == int(here.losses)
        assert found.stable == bool(here.stable)
        assert found.largest_force == pytest.approx(float(here.largest_force), rel=1e-8)


@pytest.mark.slow
def test_the_multipliers_of_every_orbit_of_a_branch_have_the_exact_product():
    branch = wt.orbits.follow(wt.orbits.find(scene(3.0)), {"speed": (1.0, 20.0)})
    product = (branch.multiplier_real + 1j * branch.multiplier_imag).prod("multiplier")
    exact = np.exp(-WHEEL["damping"] * 0.05 / (WHEEL["mass"] * branch.speed))
    assert float(abs(product - exact).max()) < 1e-8


def test_a_branch_that_only_comes_near_a_doubling_reports_none():
    branch = wt.orbits.follow(wt.orbits.find(scene(5.8)), {"speed": (5.5, 6.3)})
    assert branch.sizes["special"] == 0
    smallest = np.min((1.0 + branch.multiplier_real) ** 2 + branch.multiplier_imag**2)
    assert 0.0 < smallest < 0.01


def test_an_orbit_of_two_waves_begins_at_the_doubling_of_that_of_one():
    one = wt.orbits.follow(wt.orbits.find(scene(11.0)), {"speed": (10.5, 12.0)})
    two = wt.orbits.follow(wt.orbits.find(scene(11.8), 2), {"speed": (11.0, 12.8)})
    (doubling,) = one.parameter.values[one.kind.values == "doubling"]
    assert two.special.kind.values[0] == "doubling"
    assert float(two.special.parameter[0]) == pytest.approx(doubling, rel=1e-10)
    assert "fewer waves" in two.attrs["begins"]
    assert two.kind.values.tolist()[1:] == ["grazing", "fold"]
    assert float(two.parameter[-1]) == pytest.approx(12.7612672, rel=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize(
    "path", ["vehicle.mass", "vehicle.damping", "irregularity.0.wavelength", "contact.constant", "vehicle.load"]
)
def test_any_continuous_field_can_be_followed(path):
    from wheeltapper.lower.fields import Fields

    held = float(Fields(scene())(path))
    branch = wt.orbits.follow(wt.orbits.find(scene()), {path: (0.9 * held, 1.1 * held)})
    assert branch[path].values[[0, -1]] == pytest.approx([0.9 * held, 1.1 * held], rel=1e-12)
    end = branch.isel(point=-1)
    found = wt.orbits.find(scene().replaced({path: 1.1 * held}))
    assert found.start["displacement"] == pytest.approx(float(end.displacement), rel=1e-9)


def test_speed_and_wavelength_count_by_their_ratio_only():
    short = wt.orbits.follow(wt.orbits.find(scene(6.5)), {"speed": (6.0, 7.0)})
    long = wt.Corrugation(amplitude=5e-5, wavelength=0.1, start=0.1)
    double = wt.orbits.follow(wt.orbits.find(scene(13.0, long)), {"speed": (12.0, 14.0)})
    np.testing.assert_allclose(double.parameter, 2.0 * short.parameter, rtol=1e-9)
    assert double.kind.values.tolist() == short.kind.values.tolist()


@pytest.mark.slow
def test_a_torus_begins_on_a_light_deck():
    orbit = wt.orbits.find(scene(30.0, vehicle={"damping": 1e3}, track=DECK))
    branch = wt.orbits.follow(orbit, {"speed": (5.0, 31.0)})
    tori = np.flatnonzero(branch.kind.values == "torus")
    assert len(tori) == 2
    for i in tori:
        near = branch.isel(special=i)
        start = {name: float(near[f"special_{name}"]) for name in orbit.start}
        found = wt.orbits.find(orbit.scenario.replaced({"speed": float(near.parameter)}), start=start, method="strict")
        on_circle = found.multipliers[np.argmin(np.abs(np.abs(found.multipliers) - 1.0))]
        assert abs(abs(on_circle) - 1.0) < 1e-8
        assert abs(on_circle.imag) > 0.01
        assert bool(branch.stable[int(near.after)]) != bool(branch.stable[int(near.after) + 1])


def test_returns_carried_up_and_down_differ_where_two_orbits_coexist():
    over = {"speed": np.linspace(2.8, 7.0, 43)}
    up, down = (wt.orbits.returns(scene(), over, 200, 3, carry) for carry in ("up", "down"))
    assert float(up.speed[up.losses.sum("return") > 0].min()) == pytest.approx(6.8)
    assert float(down.speed[down.losses.sum("return") > 0].min()) == pytest.approx(3.1)
    assert (up["return"].size, up.speed.size) == (3, 43)


def test_a_return_is_the_motion_at_phase_zero():
    found = wt.orbits.returns(scene(), {"speed": [5.0]}, 3, 2)
    moved = scene(5.0, wt.Corrugation(amplitude=5e-5, wavelength=0.05, start=0.0))
    record = wt.simulate(moved)
    at = record.at([0.04, 0.05])
    np.testing.assert_allclose(found.displacement.values.ravel(), at.wheel_displacement.values, atol=1e-9 * HEIGHT)
    np.testing.assert_allclose(found.velocity.values.ravel(), at.wheel_velocity.values, atol=1e-9 * SPEED)


def test_what_does_not_vary_of_a_start_is_that_of_rest():
    kicked = wt.orbits.returns(scene(), {"start.velocity": [0.0, 0.1]}, 0, 3)
    rest = wt.orbits.returns(scene(), {"speed": [5.0]}, 0, 3)
    np.testing.assert_allclose(kicked.displacement[0], rest.displacement[0], rtol=0, atol=1e-12 * HEIGHT)
    assert abs(float(kicked.displacement[1, 0] - rest.displacement[0, 0])) > 0.01 * HEIGHT


def test_of_two_irregularities_the_distance_matters_and_can_be_followed():
    both = [wt.Corrugation(amplitude=2e-5, wavelength=0.05, start=start) for start in (0.1, 0.11)]
    path = "irregularity.1.start"
    branch = wt.orbits.follow(wt.orbits.find(scene(5.0, both)), {path: (0.108, 0.112)})
    assert float(branch.largest_force.max() / branch.largest_force.min()) > 1.001


GRID = {"start.displacement": np.linspace(-4e-4, 4e-4, 7), "start.velocity": np.linspace(-0.3, 0.3, 7)}


def test_results_do_not_depend_on_threads():
    for ask in (
        lambda threads: wt.orbits.returns(scene(), {"speed": np.linspace(4.0, 30.0, 130)}, 20, 5, threads=threads),
        lambda threads: wt.orbits.fates(scene(), GRID, 100, threads=threads),
    ):
        assert ask(1).identical(ask(3))


@pytest.mark.slow
def test_captures_in_lanes_are_those_of_single_marches(monkeypatch):
    from wheeltapper.march.wheel import orbits as marches
    from wheeltapper.march.wheel.orbits import TRAP_COLUMNS, capture
    from wheeltapper.orbits.asked import section_of
    from wheeltapper.orbits.basin import start_states

    def fates(way):
        return wt.orbits.fates(scene(**way), GRID, 150)

    def after_one_wave(way):
        found = section_of(scene(**way)).cells({"speed": np.linspace(4.0, 30.0, 40)})
        states, none = start_states(found), np.zeros(40, dtype=np.int64)
        states[:, 1] += np.linspace(-2.0, 2.0, 40)
        told = capture(found.cells, states, 1, np.zeros((0, TRAP_COLUMNS)), none, none, 1)
        assert np.all(told.waves == 1)
        return states

    for way in ({}, {"speed": 9.0}, {"track": wt.FloatingDeck(mass=15e3, stiffness=1.5e7, damping=5e4)}):
        lanes = fates(way), after_one_wave(way)
        with monkeypatch.context() as alone:
            alone.setattr(marches, "FEW", 1_000_000)
            single = fates(way), after_one_wave(way)
        np.testing.assert_allclose(lanes[1], single[1], rtol=0, atol=1e-12)
        np.testing.assert_array_equal(lanes[0].orbit, single[0].orbit)
        np.testing.assert_array_equal(lanes[0].waves, single[0].waves)


def test_a_fate_is_where_the_motion_is_long_after():
    found = wt.orbits.fates(scene(), GRID)
    assert int(found.orbit.min()) >= 0  # all are settled
    assert set(found.orbit_waves.values.tolist()) >= {1}
    late = wt.orbits.returns(scene(), GRID, 3000, 6)
    np.testing.assert_allclose(late.losses.mean("return"), found.losses / found.period, atol=1e-12)
    np.testing.assert_allclose(late.largest_force.max("return"), found.largest_force, rtol=1e-9)
    assert np.all(found.orbit_closure <= 1e-12)
    assert np.all(found.orbit_multiplier < 1.0)


def test_a_trap_is_never_left_and_leads_to_its_orbit():
    from wheeltapper.march.wheel.orbits import STATE_SIZE, TRAP_CENTRE, TRAP_NORM, TRAP_REACH
    from wheeltapper.orbits.asked import section_of
    from wheeltapper.orbits.section_map import SectionMap
    from wheeltapper.orbits.traps import traps_of

    for speed, waves, rounds in ((5.0, 1, 400), (9.0, 3, 300), (36.0, 1, 2800)):
        orbit = wt.orbits.find(scene(speed), waves)
        each = SectionMap(section_of(scene(speed)), waves)
        wave = each.wave_at()
        found = each.fixed_point(wave, orbit.state / each.scale)
        (trap, *_) = traps_of(each, wave, found, 0)
        norm, centre = trap[TRAP_NORM:].reshape(STATE_SIZE, -1)[:2, :2], trap[TRAP_CENTRE : TRAP_CENTRE + 2]
        points = np.random.default_rng(1).normal(size=(40, 2))
        points *= (np.random.default_rng(2).random(40) ** 0.5 / np.linalg.norm(points, axis=1))[:, None]
        states = centre + np.sqrt(trap[TRAP_REACH]) * np.linalg.solve(norm, points.T).T
        before = np.linalg.norm((states - centre) @ norm.T, axis=1)
        after = np.linalg.norm((each.marched(wave, states) - centre) @ norm.T, axis=1)
        assert np.all(after < before)
        late = each.marched(wave, states, rounds)
        assert np.abs(late - centre).max() < 1e-9


def test_the_fate_of_a_start_on_an_orbit_is_that_orbit_at_once():
    bouncing = {"displacement": 0.00020373567, "velocity": -0.198591078}
    over = {f"start.{name}": [value] for name, value in bouncing.items()}
    found = wt.orbits.fates(scene(), over)
    assert int(found.waves.item()) <= 1
    assert found.losses.item() == 1


def test_a_long_transient_is_unsettled_and_not_called_anything_else():
    found = wt.orbits.fates(scene(18.0), {"start.displacement": np.linspace(-4e-4, 4e-4, 12)}, 300)
    free = found.orbit.values == -1
    assert free.any()
    assert np.all(found.waves.values[free] == 300)
    assert np.all(found.period.values[free] == 0)
    assert np.isnan(found.largest_force.values[free]).all()
    assert "chao" not in str(found).lower()


@pytest.mark.whole
@pytest.mark.slow
def test_at_18_m_s_nearly_all_motions_settle_on_an_orbit_of_two_waves():
    over = {"start.displacement": np.linspace(-4e-4, 4e-4, 16), "start.velocity": np.linspace(-0.3, 0.3, 16)}
    found = wt.orbits.fates(scene(18.0), over, 60_000)
    assert float((found.period == 2).mean()) > 0.97
    assert 6_000 < float(found.waves.mean()) < 12_000


@pytest.mark.parametrize(
    ("up", "per_wave", "expected"),
    [(True, 1e-3, 6.761), (True, 1e-2, 6.800), (False, 1e-3, 2.957), (False, 1e-2, 2.750)],
)
def test_a_ramp_through_resonance_jumps_behind_the_fold(up, per_wave, expected):
    if up:
        calm = wt.orbits.follow(wt.orbits.find(scene(6.0)), {"speed": (5.9, 6.7)}).isel(point=-1)
        start = {name: float(calm[name]) for name in ("displacement", "velocity")}
        found = wt.orbits.ramp(scene(), {"speed": (6.7, 6.9)}, per_wave, start)
        jump = np.flatnonzero(found.largest_force > 3.0 * found.attrs["static_force"])[0]
    else:
        start = wt.orbits.find(scene(3.3), start={"displacement": -0.00043, "velocity": -0.02}).start
        found = wt.orbits.ramp(scene(), {"speed": (3.3, 2.7)}, per_wave, start)
        jump = np.flatnonzero(found.losses)[-1]
    assert float(found.speed[jump]) == pytest.approx(expected, abs=2.5 * per_wave)


@pytest.mark.slow
def test_a_traced_fold_is_the_fold_of_each_branch():
    orbit = wt.orbits.find(scene(6.0))
    branch = wt.orbits.follow(orbit, {"speed": (5.0, 7.0)})
    (number,) = np.flatnonzero(branch.kind.values == "fold")
    curve = wt.orbits.trace(orbit, branch.isel(special=number), {AMPLITUDE: [4e-5, 2.5e-5]})
    assert float(curve.speed[1]) == pytest.approx(7.480500290163, rel=1e-8)
    here = wt.orbits.follow(wt.orbits.find(scene(6.0).replaced({AMPLITUDE: 4e-5})), {"speed": (5.0, 7.5)})
    assert float(curve.speed[0]) == pytest.approx(float(here.parameter[here.kind == "fold"][0]), rel=1e-10)


@pytest.mark.whole
@pytest.mark.slow
def test_traced_folds_scale_with_the_wavelength():
    orbit = wt.orbits.find(scene(5.0))
    branch = wt.orbits.follow(orbit, {"speed": (2.5, 8.0)})
    for number in np.flatnonzero(branch.kind.values == "fold")[-2:]:
        special = branch.isel(special=number)
        curve = wt.orbits.trace(
            orbit, special, {"irregularity.0.wavelength": [0.05, 0.1]}
        )  # it begins at its own value
        np.testing.assert_allclose(curve.speed, float(special.parameter) * np.array([1.0, 2.0]), rtol=1e-9)


@pytest.mark.whole
@pytest.mark.slow
def test_traced_grazings_and_tori_are_those_of_other_branches():
    orbit = wt.orbits.find(scene(9.0))
    branch = wt.orbits.follow(orbit, {AMPLITUDE: (2e-6, 8e-5)})
    for number, kind in ((0, "grazing"), (1, "doubling")):
        curve = wt.orbits.trace(orbit, branch.isel(special=number), {"speed": [9.2, 9.5]})
        assert curve.attrs["kind"] == kind
        there = wt.orbits.follow(wt.orbits.find(scene(9.5)), {AMPLITUDE: (2e-6, 8e-5)})
        (expected,) = there.parameter.values[there.kind.values == kind]
        assert float(curve[AMPLITUDE][-1]) == pytest.approx(float(expected), rel=1e-9)

    light = wt.orbits.find(scene(30.0, vehicle={"damping": 1e3}, track=DECK))
    branch = wt.orbits.follow(light, {"speed": (5.0, 31.0)})
    number = np.flatnonzero(branch.kind.values == "torus")[-1]
    curve = wt.orbits.trace(light, branch.isel(special=number), {AMPLITUDE: [4.8e-5, 4.5e-5]})
    start = {name: float(curve[name][-1]) for name in light.start}
    there = light.scenario.replaced({"speed": float(curve.speed[-1]), AMPLITUDE: 4.5e-5})
    sizes = np.abs(wt.orbits.find(there, start=start, method="strict").multipliers)
    assert np.min(np.abs(sizes - 1.0)) < 1e-8


def test_a_march_that_never_ends_is_given_up(monkeypatch):
    from wheeltapper.march.wheel import orbits as marches
    from wheeltapper.orbits.asked import section_of
    from wheeltapper.orbits.section_map import SectionMap

    monkeypatch.setattr(marches, "MOST_ROWS", 2048)
    each = SectionMap(section_of(scene(5.0)), 1, ("speed",))
    image = each.image(each.wave_at(1e-4), np.array([-1.0, 0.0]))
    assert np.all(np.isnan(image.state))
    assert np.all(np.isnan(image.slopes))


@pytest.mark.slow
def test_a_traced_doubling_ends_where_it_meets_another():
    orbit = wt.orbits.find(scene(12.0))
    branch = wt.orbits.follow(orbit, {"speed": (11.0, 13.0)})
    (number,) = np.flatnonzero(branch.kind.values == "doubling")
    curve = wt.orbits.trace(orbit, branch.isel(special=number), {AMPLITUDE: [4.8e-5, 4.6e-5, 4.4e-5]})
    assert np.isfinite(curve.speed.values).tolist() == [True, True, False]


@pytest.mark.slow
@pytest.mark.parametrize(("speed", "waves"), [(5.0, 1), (9.0, 3), (36.0, 1)])
def test_the_growth_exponent_of_a_stable_orbit_is_that_of_its_multipliers(speed, waves):
    orbit = wt.orbits.find(scene(speed), waves)
    record = wt.simulate(scene(speed))
    found = float(wt.features.growth_exponent(10_000)(record))
    assert found == pytest.approx(np.log(abs(orbit.multipliers[0])) / orbit.period, rel=1e-2)


def test_the_growth_exponent_of_a_map_is_that_of_records():
    features = [wt.features.growth_exponent(200), wt.features.growth_exponent(200, error=True)]
    chart = wt.sweep(scene(), {"speed": [5.0, 6.0]}, features)
    for speed in (5.0, 6.0):
        record = wt.simulate(scene(speed))
        for feature in features:
            assert float(feature(record)) == pytest.approx(float(chart[feature.name].sel(speed=speed)), rel=1e-9)


def test_nothing_grows_where_nothing_repeats():
    bump = scene(9.0, wt.CosineBump(height=1e-4, length=0.05, start=0.1))
    assert np.isnan(wt.features.growth_exponent(100)(wt.simulate(bump)))


@pytest.mark.slow
def test_the_growth_exponent_at_15_m_s_is_that_of_long_runs():
    record = wt.simulate(scene(15.0))
    found = float(wt.features.growth_exponent(300_000)(record))
    assert found == pytest.approx(94.6, abs=1.5)


def settled_and_worn(start=None, yields_at=2.0, passes=3):
    """Return an orbit at 5 m/s, and the rail behind some wheels that begin on it."""
    orbit = wt.orbits.find(scene(), start=start)
    law = wt.contact.Thornton(constant=1.405e11, yield_force=yields_at * orbit.record.static_force)
    begun = orbit.record.scenario.replaced({"contact": law, "duration": 0.2})
    return orbit, wt.wear_in(begun, passes, every=1)


def test_each_passage_on_a_calm_orbit_is_that_orbit_and_leaves_no_mark():
    orbit, rail = settled_and_worn()
    np.testing.assert_allclose(rail.largest_force, orbit.largest_force, rtol=1e-9)
    assert float(abs(rail.permanent_indentation).max()) == 0.0
    at_rest = scene(5.0, wt.Corrugation(amplitude=5e-5, wavelength=0.05, start=0.0))
    law = wt.contact.Thornton(constant=1.405e11, yield_force=2.0 * orbit.record.static_force)
    transient = wt.wear_in(at_rest.replaced({"contact": law, "duration": 0.2}), 1)
    assert float(transient.largest_force[0]) > 1.4 * orbit.largest_force


@pytest.mark.parametrize(
    ("start", "grows"), [(None, True), ({"displacement": 2.04e-4, "velocity": -0.199}, False)], ids=["calm", "bouncing"]
)
def test_marks_of_an_orbit_lie_where_its_force_is_and_make_the_corrugation_grow_or_shrink(start, grows):
    orbit, rail = settled_and_worn(start, yields_at=1.2)
    x, first = rail.position.values, rail.permanent_indentation.sel(kept=1).values
    waves = np.exp(-2j * np.pi * x / 0.05)
    middle = (x >= 0.2) & (x < 0.8)
    times = np.linspace(0.0, orbit.period, 400, endpoint=False)
    force = orbit.record.at(times).normal_force.values
    of_force = np.angle(np.mean(force * np.exp(-2j * np.pi * times / orbit.period)))
    of_marks = np.angle(np.mean((first * waves)[middle]))
    assert abs(np.angle(np.exp(1j * (of_force - of_marks)))) < np.radians(3.0)
    to_profile = of_marks + 0.5 * np.pi  # phase behind a sine
    assert (np.cos(to_profile) < 0.0) == grows  # the marks are in the troughs, or on the crests
    amplitude = rail.amplitude.sel(wavelength=0.05, method="nearest").values
    assert np.all(np.diff(amplitude) > 0.0) == grows
    assert np.all(np.diff(amplitude) < 0.0) != grows


def test_an_orbit_says_what_it_is_in_one_line():
    bouncing = wt.orbits.find(scene(), start={"displacement": 2.04e-4, "velocity": -0.199})
    told = "stable orbit of 1 wave, 10 ms: 1 loss of contact, largest force 6.640 of static, largest multiplier 0.9355"
    assert str(bouncing).startswith(told)
    assert repr(bouncing) == f"<Orbit {bouncing}>"


def test_a_start_that_an_orbit_names_is_a_start_of_the_scenario():
    rail = scene(5.0, wt.Corrugation(amplitude=5e-5, wavelength=0.05, start=0.0))
    orbit = wt.orbits.find(rail)
    record = wt.simulate(rail.replaced({"start": orbit.start, "duration": 0.1}))
    np.testing.assert_allclose(
        record.at(0.01 * np.arange(11)).wheel_displacement, orbit.start["displacement"], atol=1e-14
    )

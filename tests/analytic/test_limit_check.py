"""Limits against closed forms of what is compared: static loads, located maxima, SciPy's filters, geometry."""

import json
from math import nan, sqrt

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

import wheeltapper as wt
from wheeltapper.faces.cli import main
from wheeltapper.record.assessment.filtering import low_passed
from wheeltapper.record.simulate import ModelWarning

WEIGHT = 188_228.0 + 1200.0 * 9.81
LEVEL = wt.Scenario(
    vehicle=wt.Wheelset(mass=1200, load=188_228), contact=wt.Hertz(constant=1.8825e11), speed=20.0, duration=0.2
)
FLAT = LEVEL.replaced({"irregularity": wt.WheelFlat(length="62 mm", position=1.0)})
TIGHT = {"level": "warning"}


def rule(quantity="peak_force", limit=1e5, **more):
    return wt.limits.Rule("own", quantity, limit, **(TIGHT | more))


def only(record, **more):
    (row,) = wt.limits.check(record, [rule(**more)])
    return row


@pytest.fixture(scope="module")
def flat():
    return wt.simulate(FLAT)


@pytest.fixture(scope="module")
def coach():
    scene = wt.Scenario(
        vehicle=wt.Wagon.erri_b176(), contact=wt.Hertz(), creep=wt.creep.Polach(friction=0.35),
        irregularity={"wheelset 2 right": wt.WheelFlat(length="30 mm", position=1.0)}, speed=30.0, duration=0.2,
    )  # fmt: skip
    return wt.simulate(scene)


@pytest.mark.parametrize(
    ("vehicle", "more", "value"),
    [
        (LEVEL.vehicle, {}, WEIGHT / 2),
        (LEVEL.vehicle, {"per": "axle"}, WEIGHT),
        (LEVEL.vehicle.model_copy(update={"wheels": 1}), {}, WEIGHT),
        (LEVEL.vehicle, {"quantity": "dynamic_ratio", "limit": 2.0}, 1.0),
        (LEVEL.vehicle, {"quantity": "dynamic_increment", "limit": 2.0}, 0.0),
        (LEVEL.vehicle, {"low_pass": 20.0}, WEIGHT / 2),
        (LEVEL.vehicle, {"low_pass": 20.0, "sliding_mean": 2.0, "per": "axle"}, WEIGHT),
    ],
)
def test_on_a_level_rail_the_static_force_is_compared(vehicle, more, value):
    row = only(wt.simulate(LEVEL.replaced({"vehicle": vehicle})), **more)
    assert row.value == pytest.approx(value, rel=1e-9, abs=1e-9)
    assert (row.wheelset, row.side) == (1, "both")


@pytest.mark.parametrize(
    ("limit", "more", "allowed", "exceeded"),
    [
        (50e3, {"plus_static": 1.0}, 50e3 + WEIGHT / 2, False),
        (50e3, {"plus_static": 1.0, "at_most": 90e3}, 90e3, True),
        (10e3, {"plus_static": 1 / 3, "per": "axle"}, 10e3 + WEIGHT / 3, True),
        (WEIGHT / 2 * (1 + 1e-6), {}, WEIGHT / 2, False),
        (WEIGHT / 2 * (1 - 1e-6), {}, WEIGHT / 2, True),
    ],
)
def test_what_is_allowed_follows_the_static_force(limit, more, allowed, exceeded):
    row = only(wt.simulate(LEVEL), limit=limit, **more)
    assert row.allowed == pytest.approx(allowed, rel=2e-6)
    assert row.exceeded is exceeded


def test_the_largest_located_maximum_is_compared_with_its_place(flat):
    peaks = flat.peaks
    top = int(np.argmax(peaks.normal_force.values))
    row = only(flat, limit=350e3)
    assert row.value == float(peaks.normal_force[top]) / 2
    assert row.time == float(peaks.time[top])
    assert row.position == pytest.approx(20.0 * row.time)
    assert only(flat, limit="350 kN") == row
    assert only(flat, quantity="dynamic_ratio", limit=3.0).value == pytest.approx(2 * row.value / WEIGHT)


def test_the_packages_limits_name_flats_forces_and_what_is_left_out(flat):
    found = wt.limits.check(flat)
    assert found["Trafikverket, damage of 60 mm"].value == pytest.approx(0.062)
    assert found["Trafikverket, damage of 60 mm"].exceeded
    assert not found["Canada, freight cars, flat of 2 1/2 in"].exceeded
    left = dict(found.left_out)
    assert left["EN 14363, Y/Q of 0.8"] == "no lateral forces in this model"
    assert left["EN 14363, Q up to 200 km/h"] == "not for 72 km/h"
    assert {row.name for row in found.exceeded} <= {row.name for row in found}
    assert len(found) + len(left) == len(wt.limits.read_rules())
    depth = wt.simulate(FLAT.replaced({"irregularity": wt.WheelFlat(depth=1e-3, position=1.0), "vehicle.radius": 0.4}))
    again = wt.limits.check(depth)
    assert again["Trafikverket, damage of 60 mm"].value == pytest.approx(2.0 * sqrt(2 * 0.4 * 1e-3 - 1e-6))
    assert dict(again.left_out)["GCU, flat of 60 mm"] == "not for wheels of 800 mm"
    assert (
        dict(wt.limits.check(wt.simulate(LEVEL)).left_out)["GCU, flat of 60 mm"] == "the scenario states no flat length"
    )
    short = wt.limits.check(wt.simulate(LEVEL.replaced({"duration": 0.04})))
    assert dict(short.left_out)["EN 14363, Q up to 160 km/h"] == "0.04 s are shorter than a period of 20 Hz"


@pytest.mark.parametrize(
    ("shape", "size"),
    [
        (wt.OutOfRound(orders=(3,), amplitudes=(1e-4,)), 2e-4),
        (wt.OutOfRound(places=(0.0, 0.7, 1.4, 2.1), deviations=(0.0, -3e-4, 1e-4, 0.0)), 4e-4),
    ],
)
def test_out_of_roundness_is_the_largest_less_the_smallest_radius(shape, size):
    scene = LEVEL.replaced({"irregularity": shape, "duration": 0.05})
    row = only(wt.simulate(scene), quantity="out_of_roundness", limit=3e-4)
    assert row.value == pytest.approx(size, rel=1e-4)
    assert np.isnan(row.time)
    assert row.exceeded == (size > 3e-4)


def test_of_a_coach_the_wheel_with_the_flat_is_named(coach):
    found = wt.limits.check(coach)
    row = found["AAR 41, 90 kips"]
    assert (row.wheelset, row.side) == (2, "right")
    peaks = coach.peaks
    mine = (peaks.wheelset == 2) & (peaks.side == "right") & (peaks.surface == "tread")
    assert row.value == float(peaks.normal_force.where(mine).max())
    assert found["Trafikverket, damage of 60 mm"].value == pytest.approx(0.030)
    assert row.position == pytest.approx(1.0, abs=0.1)  # where this wheelset was


def test_lateral_limits_of_a_coach_are_filtered_and_averaged(coach):
    rate = 20e3
    history = coach.history(rate)
    sideways = low_passed(history.lateral_force.sum("side").values, rate, 20.0)
    window = round(2.0 / 30.0 * rate)
    sums = uniform_filter1d(sideways, window, axis=0)[window:-window]
    row = wt.limits.check(coach)["EN 14363, sum of Y"]
    assert row.value == pytest.approx(np.abs(sums).max(), rel=0.02)
    static = coach.static_forces.sel(wheelset=row.wheelset).sum()
    assert row.allowed == pytest.approx(10e3 + float(static) / 3)
    quotient = low_passed(history.lateral_force.values, rate, 20.0) / low_passed(
        history.vertical_force.values, rate, 20.0
    )
    means = uniform_filter1d(quotient, window, axis=0)[window:-window]
    assert wt.limits.check(coach)["EN 14363, Y/Q of 0.8"].value == pytest.approx(np.abs(means).max(), rel=0.02)


def test_forces_of_an_axle_are_those_of_both_wheels_together(coach):
    both = coach.history(20e3).vertical_force.sum("side")
    row = only(coach, per="axle", limit=1e6)
    assert row.value == pytest.approx(float(both.max()), rel=1e-9)
    assert (row.wheelset, row.side) == (2, "both")


def test_several_wheelsets_are_told_apart():
    alone = wt.Wheelset(mass=1200, load=188_228)
    pair = FLAT.replaced({
        "vehicle": wt.vehicles.Wheelsets(wheelsets=(alone, alone), positions=(0.0, -2.56)),
        "irregularity": {"wheelset 2": wt.WheelFlat(length="40 mm", position=1.0)},
    })  # fmt: skip
    row = only(wt.simulate(pair))
    assert row.wheelset == 2
    assert row.position == pytest.approx(20.0 * row.time - 2.56)


def test_it_prints_iterates_and_is_a_table(flat, tmp_path):
    found = wt.limits.check(flat, countries=["SE"])
    lines = str(found).splitlines()
    assert lines[0].split() == ["limit", "quantity", "value", "allowed", "exceeded", "where", "edition"]
    assert "verify current edition" in str(found)
    assert [row.name for row in found] == ["Trafikverket, 350 kN", "Trafikverket, damage of 60 mm"]
    table = found.to_dataframe()
    assert list(table["limit"]) == [row.name for row in found]
    assert {"source", "edition", "date", "verify", "wheelset", "time", "basis"} <= set(table.columns)
    assert json.loads(json.dumps(found.to_dict()))["limits"][1]["time"] is None
    assert wt.plot(found, tmp_path / "limits.png").axes
    with pytest.raises(wt.InputError, match="Trafikverket, 350 kN"):
        found["Trafikverket"]


def test_every_figure_of_the_package_has_source_edition_date_or_reason_and_is_to_be_verified():
    for each in wt.limits.read_rules():
        assert each.source
        assert each.edition
        assert "found" in each.basis or "remembered" in each.basis
        assert each.verify == "verify current edition"
    by_name = {each.name: each for each in wt.limits.read_rules()}
    assert by_name["EN 14363, Q up to 160 km/h"].allowed(100e3) == 190e3
    assert by_name["EN 14363, Q up to 160 km/h"].allowed(112.5e3) == 200e3
    assert by_name["EN 14363, sum of Y"].allowed(225e3) == pytest.approx(85e3)


OWN = """
[[rule]]
name = "ours"
quantity = "dynamic_ratio"
limit = 1.5
level = "warning"
low_pass = "90 Hz"
speed_up_to = "80 km/h"
"""


def test_the_command_compares_a_file_and_says_so_by_its_exit_code(flat, tmp_path, capsys):
    own, scene, record = tmp_path / "own.toml", tmp_path / "flat.toml", tmp_path / "flat.nc"
    own.write_text(OWN, encoding="utf-8")
    FLAT.to_toml(scene)
    flat.save(record)
    assert main(["limits", str(scene), "--countries", "SE"]) == 1
    assert "Trafikverket, damage of 60 mm" in capsys.readouterr().out
    assert main(["limits", str(record), "--rules", str(own), "--json"]) in (0, 1)
    (row,) = json.loads(capsys.readouterr().out)["limits"]
    with pytest.warns(ModelWarning, match=r"the last 0\.011 s of the run, .*: larger values may be there"):
        ratio = float(wt.features.filtered_force(90.0, over_static=True)(flat))  # it strikes again 6 ms before the end
    assert row["value"] == pytest.approx(ratio, rel=1e-9)
    assert (row["low_pass"], row["exceeded"]) == (90.0, ratio > 1.5)
    assert main(["limits", str(tmp_path / "none.toml")]) == 2
    assert main(["limits", str(scene), "--rules", str(scene)]) == 2
    assert main(["limits", str(scene), "--plot", str(tmp_path / "a.txt")]) == 2
    assert main(["limits", str(scene), "--countries", "XX"]) == 2
    assert main(["limits", str(record), "--method", "strict"]) == 2
    assert "--method: found 'strict' with a record" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("field", "reason"),
    [
        ('low_pass = "2 Hz"', "0.2 s are shorter than a period of 2 Hz"),
        ('low_pass = "5 Hz"', "nothing is left of the run but the ends"),
        ('sliding_mean = "5 m"', "4 m are no longer than the mean over 5 m"),
        ('speed_above = "80 km/h"', "not for 72 km/h"),
    ],
)
def test_the_command_keeps_no_limit_where_none_can_be_compared(tmp_path, capsys, field, reason):
    rules, scene = tmp_path / "own.toml", tmp_path / "level.toml"
    given = f'name = "own"\nquantity = "peak_force"\nlimit = "1 MN"\nlevel = "stop"\n{field}\n'
    rules.write_text(f"[[rule]]\n{given}", encoding="utf-8")
    LEVEL.to_toml(scene)
    assert main(["limits", str(scene), "--rules", str(rules)]) == 3
    said = capsys.readouterr()
    assert f"not compared: own: {reason}" in said.out
    assert said.err == "wheeltapper: no limit can be compared with this run: see what is not compared\n"


@pytest.mark.parametrize(
    ("call", "part"),
    [
        (lambda r: wt.limits.check("flat.nc"), "record: found 'flat.nc'"),
        (lambda r: wt.limits.check(r, [350e3]), "rules: found 350000"),
        (lambda r: wt.limits.check(r, "none.toml"), "no readable file"),
        (lambda r: wt.limits.check(r, countries=5), "countries: found 5"),
        (lambda r: wt.limits.check(r, countries=[]), "countries: found none"),
        (
            lambda r: wt.limits.check(r, countries=["SE", "XX"]),
            "countries: found 'XX', which no rule names; allowed",
        ),
        (lambda r: wt.limits.check(r, rate="20 m"), "rate: found '20 m'"),
        (lambda r: wt.limits.check(r, rate=100.0), "rate: found 100 Hz"),
        (lambda r: only(r, limit=nan, quantity="peak_force"), "limit: found nan"),
        (lambda r: only(r, quantity="noise"), "quantity: found 'noise'"),
        (lambda r: only(r, limit="3 mm"), "limit: found '3 mm'"),
        (lambda r: only(r, low_pass="3 s"), "low_pass: found '3 s'"),
    ],
)
def test_wrong_input_is_refused_in_one_line(flat, call, part):
    with pytest.raises(wt.InputError, match=part) as caught:
        call(flat)
    assert "\n" not in str(caught.value)

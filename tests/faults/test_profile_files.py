"""Wrong files of profiles: one message that names the file, what was found and what is allowed."""

import numpy as np
import pytest

from wheeltapper.describe.profile.files import rail_profile, wheel_profile
from wheeltapper.describe.profile.rail_60e1 import rail_60e1
from wheeltapper.describe.profile.s1002 import s1002
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.laws.geometry import contact_geometry

WHEEL = np.linspace(-70.0, 60.0, 261)
RAIL = np.linspace(-37.0, 37.0, 297)
READ = {"wheel": wheel_profile, "rail": rail_profile}


def rows(y, z):
    return "".join(f"{a:.8f} {b:.8f}\n" for a, b in zip(y, z, strict=True))


GOOD_WHEEL = rows(WHEEL, s1002(WHEEL))
GOOD_RAIL = rows(RAIL, rail_60e1(RAIL))


def simpack(points, *settings, kind=1):
    lines = "\n".join(("units.len.f = 1000", *settings))
    return (
        f"header.begin\ntype = {kind}\nheader.end\nspline.begin\n{lines}\npoint.begin\n{points}point.end\nspline.end\n"
    )


def refused(path, kind, *parts):
    with pytest.raises(InputError) as caught:
        READ[kind](str(path))
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    assert "; allowed: " in message
    for part in parts:
        assert part in message


@pytest.mark.parametrize(
    ("name", "kind", "content", "parts"),
    [
        ("absent.txt", "wheel", None, ("no such file", "'S1002'", ".prw")),
        ("S1003", "wheel", None, ("no such file", "'S1002'")),
        ("61E2", "rail", None, ("no such file", "'60E1'", ".prr", ".ban")),
        ("w.xlsx", "wheel", GOOD_WHEEL, ("'.xlsx'", ".txt, .dat, .csv, .prw, .whl, .mpt")),
        ("r.prr", "wheel", "", ("wheel: ", "the file of a rail (.prr)", ".prw")),
        ("r.BAN", "wheel", "", ("the file of a rail (.ban)",)),
        ("w.prw", "rail", "", ("the file of a wheel (.prw)",)),
        ("w.whl", "rail", "", ("the file of a wheel (.whl)",)),
    ],
)
def test_a_name_that_is_no_profiles_is_refused(tmp_path, name, kind, content, parts):
    if content is not None:
        (tmp_path / name).write_text(content)
    refused(tmp_path / name, kind, *parts)


@pytest.mark.parametrize(
    ("name", "content", "parts"),
    [
        ("w.txt", "", ("an empty file",)),
        ("w.txt", "1 2\n" * 9, ("9 points", "at least 10")),
        ("w.txt", "y z\n1 2\n3\n", ("line 3", "1 values in '3'", "2, as in the header")),
        ("w.txt", "1 2\n3 four\n", ("line 2", "'four'", "a number")),
        ("w.txt", "1 2 3\n", ("line 1", "3 columns", "allowed: 2")),
        ("w.txt", "nan 2\n1 2\n", ("line 1", "nan and 2", "finite")),
        ("w.txt", "1 inf\n", ("line 1", "finite")),
        ("w.txt", "1,5\t2,5\n", ("1 points",)),  # decimal commas, not four columns
        ("w.txt", "1,5,2,5\n2,5,3,5\n", ("line 1", "'1,5,2,5'", "decimal commas")),
        ("w.txt", "y [mm];z [kg]\n1;2\n", ("line 1, header", "'kg'", "a unit of length")),
        ("w.txt", "y [mm];z\n1;2\n", ("line 1, header", "no unit of 'z'", "units of both")),
        ("w.txt", "two lines\nof words\n", ("'of words' in line 2",)),
        ("w.txt", "\x00\x01\n\x02\x03", ("not text",)),
        ("w.whl", "XYPoints=300\n\n" + GOOD_WHEEL, ("XYPoints", "261 of 300", "cut off")),
        ("w.whl", "XYPoints=many\n\n" + GOOD_WHEEL, ("XYPOINTS", "'many'", "a number")),
        ("w.whl", "ColumnDef=A,C\n\n" + GOOD_WHEEL, ("ColumnDef", "'A,C'", "X and Y")),
        ("w.whl", "ColumnDef=X,Y\n\n1 2\nSide=L\n", ("line 4", "'Side=L'")),
        ("w.whl", "ColumnDef=X,Y\n\n1,5,2,5\n2,5,3,5\n", ("line 3", "'1,5,2,5'", "decimal commas")),
        ("w.prw", simpack(""), ("point", "no points", "point.begin")),
        ("w.prw", "spline.begin\npoint.begin\n1 2\n", ("point", "the end of the file", "point.end")),
        ("w.prw", simpack("1 2\n3\n"), ("line 8", "'3'")),
        ("w.prw", simpack(GOOD_WHEEL, kind=0), ("header.type", "0 (a rail)", "a wheel")),
        ("w.prw", simpack(GOOD_WHEEL, "rotate = 0.025"), ("spline.rotate", "0.025")),
        ("w.prw", simpack(GOOD_WHEEL, "shift.y = left"), ("spline.shift.y", "'left'", "a number")),
        ("w.prw", simpack(GOOD_WHEEL, "units.len.f = -1"), ("units.len.f", "-1", "per metre")),
        ("w.prw", simpack(GOOD_WHEEL, "units.len.f =", "units.len = 'ell'"), ("units.len.f", "'ell'")),
        ("w.prw", simpack(GOOD_WHEEL, "approx.smooth = -1"), ("approx.smooth", "-1")),
        ("w.prw", simpack(GOOD_WHEEL.replace("\n", " 2\n"), "approx.smooth = 1"), ("line 8", "weight")),
        ("w.prw", simpack(GOOD_WHEEL, "bound.y.min = 0", "bound.y.max = 2"), ("5 points",)),
    ],
)
def test_a_wheels_file_that_cannot_be_read_is_refused(tmp_path, name, content, parts):
    (tmp_path / name).write_text(content)
    refused(tmp_path / name, "wheel", *parts)


@pytest.mark.parametrize(
    ("factor", "unit"), [(1e-3, "metres"), (1 / 25.4, "inches"), (0.1, "centimetres"), (1e3, "micrometres")]
)
def test_other_units_are_recognised(tmp_path, factor, unit):
    (tmp_path / "w.txt").write_text(rows(factor * WHEEL, factor * s1002(WHEEL)))
    refused(tmp_path / "w.txt", "wheel", "width of the wheel", f"probably in {unit}", "80 mm to 200 mm")
    (tmp_path / "r.txt").write_text(rows(factor * RAIL, factor * rail_60e1(RAIL)))
    refused(tmp_path / "r.txt", "rail", "width of the rail", f"probably in {unit}", "40 mm to 120 mm")


@pytest.mark.parametrize(
    ("y", "z", "parts"),
    [
        (-WHEEL, s1002(WHEEL), ("flange", "y = 55 mm, on the wrong side", "mirror the file: y to -y")),
        (WHEEL, -s1002(WHEEL), ("no flange", "mirror the file: z to -z", "15 mm")),
        (WHEEL, 0.4 * s1002(WHEEL), ("no flange: 11.", "at least 15 mm")),
        (WHEEL[WHEEL > -31], s1002(WHEEL[WHEEL > -31]), ("no flange", "negative y")),
        (WHEEL + 70, s1002(WHEEL), ("tip at y = 15 mm", "-65 mm to -40 mm", "tread datum", "70 mm")),
        (WHEEL, s1002(WHEEL) + 430.0, ("tread", "430 mm at y = 0", "10 mm")),
        (RAIL, rail_60e1(RAIL), ("width of the wheel", "74 mm", "80 mm to 200 mm")),
        (np.roll(WHEEL, 100), s1002(np.roll(WHEEL, 100)), ("order", "turn back at y =", "flange's tip")),
    ],
)
def test_a_wheel_that_is_not_as_a_wheel_must_be_is_refused(tmp_path, y, z, parts):
    (tmp_path / "w.txt").write_text(rows(y, z))
    refused(tmp_path / "w.txt", "wheel", *parts)


ONE_SIDE = RAIL[RAIL > -33]


@pytest.mark.parametrize(
    ("y", "z", "parts"),
    [
        (RAIL, -rail_60e1(RAIL), ("crown", "where the rail ends", "mirror it: z to -z")),
        (RAIL[RAIL > 0], rail_60e1(RAIL[RAIL > 0]), ("width of the rail", "36.75 mm")),
        (RAIL + 25, rail_60e1(RAIL), ("crown", "at y = 25 mm", "within 20 mm")),
        (ONE_SIDE, rail_60e1(ONE_SIDE), ("gauge side", "below the crown at negative y", "14 mm", "mirror the file")),
        (RAIL[abs(RAIL) < 33], rail_60e1(RAIL[abs(RAIL) < 33]), ("gauge side", "14 mm at least, where the gauge")),
        (WHEEL, s1002(WHEEL), ("width of the rail", "130 mm", "40 mm to 120 mm")),
        (np.roll(RAIL, 170), rail_60e1(np.roll(RAIL, 170)), ("order", "turn back at y =", "crown")),
    ],
)
def test_a_rail_that_is_not_as_a_rail_must_be_is_refused(tmp_path, y, z, parts):
    (tmp_path / "r.txt").write_text(rows(y, z))
    refused(tmp_path / "r.txt", "rail", *parts)


def test_miniprofs_wheel_must_count_from_the_flanges_back(tmp_path):
    (tmp_path / "w.whl").write_text("ColumnDef=X,Y\n\n" + GOOD_WHEEL)
    refused(tmp_path / "w.whl", "wheel", "tip at y = -125 mm", "-65 mm to -40 mm")


def test_a_simpack_rail_with_heights_upwards_is_refused(tmp_path):
    (tmp_path / "r.prr").write_text(simpack(GOOD_RAIL, kind=0))
    refused(tmp_path / "r.prr", "rail", "crown", "mirror.z")


@pytest.mark.parametrize(("slope", "spacing"), [(20.0, 0.002), (90.0, 0.01)])
def test_steep_and_finely_sampled_sides_of_a_rail_touch_as_coarser_ones_do(tmp_path, slope, spacing):
    def touched(step):
        out = np.arange(step, 20.0 / slope, step)
        y = np.concatenate([-36.0 - out[::-1], head, 36.0 + out])
        z = np.concatenate([(tops[0] - slope * out)[::-1], tops, tops[-1] - slope * out])
        (tmp_path / "r.txt").write_text(rows(y, z))
        return contact_geometry(s1002, rail_profile(str(tmp_path / "r.txt")), surface="flange", smoothing=15e-6)

    head = np.linspace(-36.0, 36.0, 289)
    tops = rail_60e1(head)
    fine, coarse = touched(spacing), touched(0.05)
    assert np.isfinite(fine.curvature).all()
    near = fine.shift > 4e-3
    np.testing.assert_allclose(fine.lift[near], coarse.lift[near], atol=3e-5)


def test_a_flange_that_touches_with_an_edge_alone_is_refused():
    with pytest.raises(InputError, match="profiles: found a flange that is beside the rail"):
        contact_geometry(s1002, rail_60e1, surface="flange", shifts=np.linspace(-20e-3, -15e-3, 11))

"""Profiles read from files against the built-in ones that were written there, in every format and convention."""

import numpy as np
import pytest

from tests.cases import DATA
from wheeltapper.describe.profile.files import rail_profile, wheel_profile
from wheeltapper.describe.profile.rail_60e1 import rail_60e1
from wheeltapper.describe.profile.s1002 import s1002
from wheeltapper.lower.laws.geometry import contact_geometry, radius_difference

WHEEL = np.linspace(-70.0, 60.0, 1301)
RAIL = np.linspace(-37.28, 37.28, 2983)
SMOOTH_WHEEL = np.linspace(-68.0, 59.9, 3001)  # nearer to the flange's back the profile gets vertical
SMOOTH_RAIL = np.linspace(-35.0, 35.0, 3001)

SECTIONS = "header.begin\ntype = 0\nheader.end\nspline.begin\nunits.len.f = 1e3\npoint.begin\n"


def write(path, y, z, head="", tail="", between=" "):
    rows = "".join(f"{a:.9f}{between}{b:.9f}\n" for a, b in zip(y, z, strict=True))
    path.write_text(head + rows + tail, encoding="utf-8")
    return str(path)


def simpack(path, y, z, is_wheel, **settings):
    given = {"approx.smooth": 0.0, "file": "'-'", "comment": "'steep! 100%'", "units.len.f": 1000.0, **settings}
    lines = "".join(f"    {key.replace('_', '.')} = {value}   ! what it is\n" for key, value in given.items())
    head = f"! comment\n  header.begin\n    version = 1\n    type = {is_wheel:d}  ! 0=rail\n  header.end\n\n"
    return write(path, y, z, f"{head}  spline.begin\n{lines}    point.begin\n! y z\n", "    point.end\n  spline.end\n")


def miniprof(path, x, y, *more):
    head = ["ProgramName=MiniProf for Windows", "Side=%L", "Xoffset=0.0000", "ColumnDef=X,Y", f"XYPoints={len(x)}"]
    return write(path, x, y, "\n".join([*head, *more]) + "\n\n", between="  ")


def same_wheel(name):
    np.testing.assert_allclose(wheel_profile(name)(SMOOTH_WHEEL), s1002(SMOOTH_WHEEL), atol=1e-3, rtol=0)


def same_rail(name):
    np.testing.assert_allclose(rail_profile(name)(SMOOTH_RAIL), rail_60e1(SMOOTH_RAIL), atol=1e-3, rtol=0)


def test_the_built_in_names_give_the_built_in_profiles():
    assert wheel_profile("S1002") is s1002
    assert rail_profile("60E1") is rail_60e1


@pytest.mark.parametrize(
    ("suffix", "between", "head"),
    [
        (".txt", "\t", "# a comment\n! another\n% and another\n"),
        (".dat", "  ", "y z\n"),
        (".csv", ",", "y_mm, z_mm\n"),
        (".csv", ";", ""),
    ],
)
def test_two_columns_are_read_in_either_order_of_y(tmp_path, suffix, between, head):
    same_wheel(write(tmp_path / f"w{suffix}", WHEEL, s1002(WHEEL), head, between=between))
    same_wheel(write(tmp_path / f"x{suffix}", WHEEL[::-1], s1002(WHEEL[::-1]), head, between=between))
    same_rail(write(tmp_path / f"r{suffix}", RAIL, rail_60e1(RAIL), head, between=between))
    same_rail(write(tmp_path / f"s{suffix}", RAIL[::-1], rail_60e1(RAIL[::-1]), head, between=between))


def test_decimal_commas_are_read_between_semicolons(tmp_path):
    name = write(tmp_path / "w.csv", WHEEL, s1002(WHEEL), between=";")
    (tmp_path / "w.csv").write_text((tmp_path / "w.csv").read_text().replace(".", ","))
    same_wheel(name)


def test_miniprof_counts_from_the_flanges_back_and_a_rails_gauge_side_is_right(tmp_path):
    same_wheel(miniprof(tmp_path / "w.whl", WHEEL + 70.0, s1002(WHEEL) + 0.31))
    same_wheel(miniprof(tmp_path / "w.mpt", WHEEL + 71.5, s1002(WHEEL), "WheelDiameterTaperline=71.5"))
    same_wheel(miniprof(tmp_path / "w.txt", WHEEL[::-1] + 70.0, s1002(WHEEL[::-1])))
    same_rail(miniprof(tmp_path / "r.ban", RAIL - 4.0, rail_60e1(RAIL) - 0.2, "Xoffset=3", "Yoffset="))
    same_rail(miniprof(tmp_path / "r.mpt", RAIL, rail_60e1(RAIL)))


def test_old_miniprof_files_with_more_columns_and_comments_in_them_are_read(tmp_path):
    head = '#MINIWHEELPROF\nStock.......:\nColumnDef=A,Y,X\n" 32.58 37.11\n(Sd/Sh/qR)\n\n"1.0 2.0 3.0\n'
    rows = "".join(f'0.1 {s1002(np.array([y]))[0]:.9f} {y + 70.0:.9f} 663810000.0  " good\n' for y in WHEEL)
    (tmp_path / "w.whl").write_text(head + rows)
    same_wheel(str(tmp_path / "w.whl"))


def test_simpack_counts_down_and_follows_its_settings(tmp_path):
    w, r = s1002(WHEEL), -rail_60e1(RAIL)
    same_wheel(simpack(tmp_path / "w.prw", WHEEL[::-1], w[::-1], True, bound_y_min=1.0, bound_y_max=0.0))
    same_wheel(simpack(tmp_path / "w.prw", -WHEEL, w, True, mirror_y=1, inversion=1))  # as the Manchester benchmark
    same_wheel(simpack(tmp_path / "w.prw", WHEEL - 3.0, 5.0 - w, True, shift_y=3.0, shift_z=-5.0, mirror_z=1))
    same_wheel(simpack(tmp_path / "w.prw", 1e-3 * WHEEL, 1e-3 * w, True, units_len_f=1.0))
    same_wheel(simpack(tmp_path / "w.prw", 1e-3 * WHEEL, 1e-3 * w, True, units_len_f="", units_len="'m'"))
    same_rail(simpack(tmp_path / "r.prr", RAIL, r, False))
    same_rail(simpack(tmp_path / "r.prr", -RAIL, -r, False, mirror_y=1, mirror_z=1))
    same_rail(simpack(tmp_path / "r.prr", 1e-3 * RAIL, 1e-3 * r - 0.01, False, units_len_f=1.0, shift_z=0.01))
    same_rail(simpack(tmp_path / "r.txt", RAIL, r, False, point_dist_min=0.06))  # known by its content


def test_simpacks_bounds_drop_points_sideways_and_clip_heights(tmp_path):
    name = simpack(
        tmp_path / "w.prw", WHEEL, s1002(WHEEL), True, bound_y_min=-65.0, bound_y_max=50.0, bound_z_min=-2.0,
        bound_z_max=40.0,
    )  # fmt: skip
    at = np.array([-65.1, -64.9, 49.0, 50.1])
    np.testing.assert_allclose(wheel_profile(name)(at), [np.nan, s1002(at[1:2])[0], -1.902303, np.nan], atol=1e-3)
    name = simpack(tmp_path / "w.prw", WHEEL, s1002(WHEEL), True, bound_z_min=-1.0, bound_z_max=40.0)
    assert wheel_profile(name)(np.array([50.0]))[0] == pytest.approx(-1.0, abs=1e-9)


def test_nothing_is_smoothed_unless_a_simpack_file_asks_for_it(tmp_path):
    noise = 0.01 * np.random.default_rng(1).standard_normal(len(WHEEL))
    noisy = s1002(WHEEL) + noise
    tread = np.abs(WHEEL) < 30.0
    through = wheel_profile(write(tmp_path / "w.txt", WHEEL, noisy))(WHEEL)
    np.testing.assert_allclose(through[tread], noisy[tread], atol=1e-8)
    squares = 1e-4 * len(WHEEL)
    metres = simpack(
        tmp_path / "w.prw", 1e-3 * WHEEL, 1e-3 * noisy, True, units_len_f=1.0, approx_smooth=1e-6 * squares
    )
    for name in (simpack(tmp_path / "v.prw", WHEEL, noisy, True, approx_smooth=squares), metres):
        smooth = wheel_profile(name)(WHEEL)
        assert np.std((smooth - s1002(WHEEL))[tread]) < 0.75 * np.std(noise[tread])


def test_a_profile_ends_where_it_overhangs_or_is_vertical(tmp_path):
    # A rail's head is undercut 20 mm below its crown, and its foot lies beyond; the flange's back goes down, uneven.
    undercut = np.array([[-36.0, -34.0], [-30.0, -36.0], [-60.0, -40.0]])
    y, z = RAIL[np.abs(RAIL) < 36.1], rail_60e1(RAIL[np.abs(RAIL) < 36.1])
    outline = np.concatenate([undercut[::-1], np.column_stack([y, z]), undercut * [-1.0, 1.0]])
    head = rail_profile(write(tmp_path / "r.txt", *outline.T))
    np.testing.assert_allclose(head(SMOOTH_RAIL), rail_60e1(SMOOTH_RAIL), atol=1e-3)
    assert np.isnan(head(np.array([-45.0, -36.2, 36.2, 59.0]))).all()
    back = np.array([[-70.0 + 0.05 * np.sin(k), 9.0 - 0.4 * k] for k in range(60, 0, -1)])
    outline = np.concatenate([back, np.column_stack([WHEEL, s1002(WHEEL)])])
    same_wheel(write(tmp_path / "w.txt", *outline.T))


def test_a_little_noise_sideways_does_no_harm(tmp_path):
    y = WHEEL.copy()
    y[500] = y[499] - 0.005
    name = write(tmp_path / "w.txt", y, s1002(y))
    same_wheel(name)


@pytest.mark.parametrize("offset", [0.0, 7.0])
def test_the_contact_geometry_from_files_is_that_of_the_built_in_profiles(tmp_path, offset):
    expected = contact_geometry(s1002, rail_60e1)
    wheel = wheel_profile(simpack(tmp_path / "w.prw", WHEEL[::2], s1002(WHEEL[::2]), True))
    rail = rail_profile(write(tmp_path / "r.csv", RAIL[::2] + offset, rail_60e1(RAIL[::2]) + offset, between=";"))
    found = contact_geometry(wheel, rail)
    for shift in (1e-3, 2e-3, 3e-3, 4e-3):
        assert radius_difference(found, shift) == pytest.approx(radius_difference(expected, shift), rel=5e-3)


def test_a_rail_measured_as_it_lies_is_used_without_inclination(tmp_path):
    angle = np.arctan(1 / 40)
    y, z = (
        RAIL * np.cos(angle) - rail_60e1(RAIL) * np.sin(angle),
        RAIL * np.sin(angle) + rail_60e1(RAIL) * np.cos(angle),
    )
    crown = np.argmax(z)
    laid = rail_profile(write(tmp_path / "r.prr", y - y[crown], z[crown] - z, SECTIONS, "point.end\nspline.end\n"))
    found = contact_geometry(s1002, laid, inclination=0.0)
    expected = contact_geometry(s1002, rail_60e1)
    for shift in (1e-3, 4e-3):
        assert radius_difference(found, shift) == pytest.approx(radius_difference(expected, shift), rel=5e-3)


def test_a_rail_measured_on_one_side_is_laid_by_its_gauge_point(tmp_path):
    seen = RAIL[RAIL < 12.0]
    rail = rail_profile(write(tmp_path / "r.txt", seen + 2.0, rail_60e1(seen)))
    place = np.interp(-14.0, rail(np.linspace(-37.0, 0.0, 37001)), np.linspace(-37.0, 0.0, 37001))
    assert place == pytest.approx(-36.0, abs=1e-3)


def test_the_scanned_wheels_cross_section_is_s1002(tmp_path):
    y, z = np.loadtxt(DATA / "wheel_section_chalmers.csv", delimiter=",", skiprows=2).T
    wheel = wheel_profile(write(tmp_path / "w.csv", 1e3 * y, 1e3 * z, "y,z\n", between=","))
    beside = np.concatenate([np.linspace(-60.0, -30.0, 301), np.linspace(38.0, 59.0, 211)])
    assert np.abs(wheel(beside) - s1002(beside)).max() < 5e-3  # rounding, and 1 mm between the points
    scanned = np.linspace(-25.0, 35.0, 601)
    assert 0.01 < np.abs(wheel(scanned) - s1002(scanned)).max() < 0.12  # a worn tread

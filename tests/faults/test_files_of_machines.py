"""Files as measuring machines and loggers write them: read exactly, or refused in one line with the way out."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.profile.file import read_profile
from wheeltapper.describe.profile.files import _file_outline

# -- times of day -----------------------------------------------------------------------------------------------------


def wheel_outline(path):
    return _file_outline(read_profile(str(path), "wheel"), "wheel")


def logged(folder, stamps, name="a.csv", mark=","):
    rows = [f"{stamp}{mark}{np.sin(0.01 * i):.6f}" for i, stamp in enumerate(stamps)]
    (folder / name).write_text("\n".join([f"time{mark}acc [m/s2]", *rows]))
    return wt.read_recording(folder / name)


FORMS = {
    "T": lambda s: f"2026-11-27T{s}", "blank": lambda s: f"2026-11-27 {s}", "slashes": lambda s: f"2026/11/27 {s}",
    "none": lambda s: s, "UTC": lambda s: f"2026-11-27T{s}Z", "zone": lambda s: f"2026-11-27T{s}+05:30",
    "quoted": lambda s: f'"{s}"',
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_a_clock_of_iso_stamps_is_a_clock(form, tmp_path):
    stamps = [FORMS[form](f"14:18:{i / 1000:06.3f}") for i in range(3000)]
    found = logged(tmp_path, stamps)
    assert found.rate == pytest.approx(1000.0, rel=1e-9)
    assert found.times[:3] == pytest.approx([0.0, 0.001, 0.002], abs=1e-12)
    np.testing.assert_allclose(found.samples, np.sin(0.01 * np.arange(3000)), atol=1e-6)


def test_digits_beyond_a_microsecond_count(tmp_path):
    found = logged(tmp_path, [f"14:18:{30 + i / 51_200:012.9f}" for i in range(3000)])
    assert found.rate == pytest.approx(51_200.0, rel=1e-6)
    assert not found.notes


def test_stamps_without_a_date_go_on_over_midnight(tmp_path):
    seconds = [86399.0 + i / 100 for i in range(300)]
    stamps = [f"{int(s // 3600) % 24:02}:{int(s // 60) % 60:02}:{s % 60:05.2f}" for s in seconds]
    assert logged(tmp_path, stamps).times[-1] == pytest.approx(2.99, abs=1e-9)


def test_zones_that_change_are_taken_into_account(tmp_path):
    stamps = [
        f"2026-10-25T{'02' if i >= 50 else '03'}:00:{i / 10:06.3f}{'+01:00' if i >= 50 else '+02:00'}"
        for i in range(100)
    ]
    assert logged(tmp_path, stamps).times[-1] == pytest.approx(9.9, abs=1e-9)


def test_a_stamp_that_is_none_is_named(tmp_path):
    stamps = [f"14:18:{i / 1000:06.3f}" for i in range(300)]
    stamps[7] = "later"
    with pytest.raises(wt.InputError, match=r"line 9, time: found 'later'; allowed: a time as in the first line"):
        logged(tmp_path, stamps)


# -- columns and kinds ------------------------------------------------------------------------------------------------


def test_unnamed_columns_are_counted_as_they_stand_in_the_file(tmp_path):
    (tmp_path / "a.csv").write_text("".join(f"{i * 1e-3:.3f} {i % 7} {i % 5}\n" for i in range(2000)))
    with pytest.raises(wt.InputError, match=r"2 columns that may be meant; allowed: one of: 1, 2$"):
        wt.read_recording(tmp_path / "a.csv", unit="m/s^2")
    found = wt.read_recording(tmp_path / "a.csv", unit="m/s^2", column=2)
    assert found.samples[:6].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 0.0]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("a.json", r"found a JSON file \(.json\); allowed: its columns as .csv"),
        ("a.xlsx", r"found a spreadsheet \(.xlsx\); allowed: the sheet saved as .csv"),
        ("a.uff", r"found a universal file \(.uff\); allowed: its data sets written as .csv"),
    ],
)
def test_kinds_that_people_bring_have_a_word_of_their_own(name, said, tmp_path):
    (tmp_path / name).write_text('{"a": [1, 2]}')
    with pytest.raises(wt.InputError, match=said):
        wt.read_recording(tmp_path / name)
    with pytest.raises(wt.InputError, match=said):
        wt.Measured(path=tmp_path / name).course(0.46)


# -- rings ------------------------------------------------------------------------------------------------------------

ANGLES = np.linspace(0.0, 2.0 * np.pi, 361)
RING = 5e-5 * np.cos(3.0 * ANGLES)


def largest_force(wheel):
    vehicle = wt.Wheelset(mass=1500, load=9e4, stiffness=2.44e6, damping=5e4)
    scene = wt.Scenario(
        vehicle=vehicle,
        contact=wt.Hertz(constant=1.405e11),
        irregularity=wheel,
        rolling="point",
        speed=20,
        duration=0.1,
    )
    return float(wt.simulate(scene).peaks.normal_force.max())


def test_a_last_sample_that_is_the_first_again_changes_nothing(tmp_path):
    def ring(n):
        return wt.OutOfRound(places=tuple(ANGLES[:n]), deviations=tuple(RING[:n]), over="angle")

    alone = largest_force(ring(360))
    assert largest_force(ring(361)) == alone
    table = np.column_stack([np.degrees(ANGLES), 1e6 * RING])
    np.savetxt(tmp_path / "ring.csv", table, delimiter=",", header="angle [deg],deviation [um]", comments="")
    read = wt.OutOfRound(path=tmp_path / "ring.csv", over="angle")
    assert largest_force(read) == pytest.approx(alone, rel=1e-9)
    rounded = np.round(0.46 * ANGLES, 4)  # its end is 40 µm beside the circumference
    arcs = wt.OutOfRound(places=tuple(rounded), deviations=tuple(RING))
    assert largest_force(arcs) == pytest.approx(alone, rel=1e-3)


def test_a_ring_that_does_not_close_is_refused():
    torn = wt.OutOfRound(places=tuple(ANGLES), deviations=tuple(5e-5 * np.cos(2.5 * ANGLES)), over="angle")
    with pytest.raises(wt.InputError, match=r"found samples that end after one revolution 0.0001 m beside where they"):
        largest_force(torn)


# -- profiles and rails -----------------------------------------------------------------------------------------------

ROWS = "".join(f"{y:.2f} {0.002 * y * y:.3f} 0.000\n" for y in np.linspace(10.0, 120.0, 200))
OLD = "MINIPROF 101 148 1994 3 24\navg.prd\nWheel ID....:\n32.58 37.11 14.71  (Sd/Sh/qR)\n\n"
SECTIONS = "[FileInfo]\nProgramName=x\n\n[Profile1Info]\nColumnDef=X,Y,A\n\n[Profile1Points]\n"


@pytest.mark.parametrize(
    ("name", "head"), [("a.whl", OLD), ("b.whl", OLD.replace("  (Sd", "\n(Sd")), ("c.mpt", SECTIONS)]
)
def test_old_miniprof_and_files_with_sections_are_the_profile_of_a_new_one(name, head, tmp_path):
    (tmp_path / "new.whl").write_text(f"COLUMNDEF=X,Y,A\n\n{ROWS}")
    (tmp_path / name).write_text(head + ROWS)
    new, found = (wheel_outline(tmp_path / one) for one in ("new.whl", name))
    for field in new.__dataclass_fields__:
        np.testing.assert_array_equal(getattr(found, field), getattr(new, field))


def test_of_two_profiles_in_a_file_one_is_named(tmp_path):
    second = "[Profile2Info]\nColumnDef=X,Y\n\n[Profile2Points]\n"
    (tmp_path / "a.mpt").write_text(f"{SECTIONS}{ROWS}{second}")  # the second one has no points
    assert len(wheel_outline(tmp_path / "a.mpt").y) == 200
    fewer = "".join(ROWS.splitlines(keepends=True)[:150])
    (tmp_path / "a.mpt").write_text(f"{SECTIONS}{ROWS}{second}{fewer}")
    said = (
        r"found 2 profiles with points \(\[Profile1Points\], \[Profile2Points\]\); allowed: one of them, as 'a.mpt#2'"
    )
    for name in ("a.mpt", "a.mpt#3", "a.mpt#0"):
        with pytest.raises(wt.InputError, match=said):
            wheel_outline(tmp_path / name)
    for number, count in ((1, 200), (2, 150)):
        assert len(wheel_outline(tmp_path / f"a.mpt#{number}").y) == count
    with pytest.raises(wt.InputError, match="no such file"):
        wheel_outline(tmp_path / "b.mpt#1")


@pytest.mark.parametrize("micrometre", [b"\xa6\xccm", "µm".encode(), "μm".encode(), b"\xb5m"])
def test_tabs_at_ends_and_units_between_blanks_are_read(micrometre, tmp_path):
    rows = [f"{i}\t{-1.9 * np.sin(i / 50):.1f}\t\r\n".replace(".", ",").encode() for i in range(2880)]
    (tmp_path / "a.dat").write_bytes(b"[MeasurementData]\r\n[mm] [" + micrometre + b"]\r\n" + b"".join(rows))
    places, deviations = wt.OutOfRound(path=tmp_path / "a.dat").samples
    np.testing.assert_allclose(places, 1e-3 * np.arange(2880), rtol=0, atol=1e-12)
    np.testing.assert_allclose(deviations, 1e-6 * np.round(-1.9 * np.sin(np.arange(2880) / 50), 1), rtol=0, atol=1e-12)


# -- quantities that are no deck's ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name", ["axle box acceleration right", "Bogie frame acc", "axlebox", "car body vertical", "Achslager_3"]
)
def test_an_acceleration_of_something_else_is_not_taken_for_the_deck_s(name, tmp_path):
    rows = "\n".join(f"{np.sin(0.01 * i):.6f}" for i in range(3000))
    (tmp_path / "a.csv").write_text(f"# rate: 20 kHz\n# {name} [g]\n{rows}\n")
    with pytest.raises(wt.InputError, match=r"quantity: found .* an acceleration of something else than a deck"):
        wt.read_recording(tmp_path / "a.csv")
    stated = wt.read_recording(tmp_path / "a.csv", quantity="deck acceleration")
    (tmp_path / "b.csv").write_text(f"# quantity: deck acceleration\n# rate: 20 kHz\n# {name} [g]\n{rows}\n")
    np.testing.assert_array_equal(wt.read_recording(tmp_path / "b.csv").samples, stated.samples)


def test_a_quantity_that_is_not_diagnosed_is_not_called_a_misspelt_one(tmp_path):
    (tmp_path / "a.csv").write_text("# rate: 20 kHz\n# a [g]\n0\n1\n0\n")
    with pytest.raises(wt.InputError, match="something else than a deck"):
        wt.read_recording(tmp_path / "a.csv", quantity="axle box acceleration")
    (tmp_path / "b.csv").write_text("# quantity: axle box acceleration\n# rate: 20 kHz\n# a [g]\n0\n1\n0\n")
    with pytest.raises(wt.InputError, match="something else than a deck"):
        wt.read_recording(tmp_path / "b.csv")

"""Files of recordings: every format read, written ones read back the same, every fault named in one message."""

import gzip
import sys
from dataclasses import replace

import h5py
import numpy as np
import pytest
import xarray as xr
from scipy.io import savemat, wavfile

from wheeltapper.ground.errors import InputError
from wheeltapper.record.recordings.read import read_recording
from wheeltapper.record.recordings.recording import Recording
from wheeltapper.record.recordings.writing import write_recording

G = 9.80665
RATE = 20e3
STEPS = np.arange(200)
TIMES = STEPS / RATE
SAMPLES = np.sin(0.37 * STEPS) * np.exp(-0.01 * STEPS)


def text(path, columns, header="", separator=",", end="\n"):
    rows = [separator.join(map(str, row)) for row in zip(*(np.asarray(c).tolist() for c in columns), strict=True)]
    content = (header + end if header else "") + end.join(rows) + end
    path.write_bytes(gzip.compress(content.encode()) if path.suffix == ".gz" else content.encode())
    return path


def refused(path, *parts, **arguments):
    with pytest.raises(InputError) as caught:
        read_recording(path, **arguments)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    assert "; allowed: " in message
    for part in parts:
        assert part in message, message


def good(recording, samples=SAMPLES, factor=G, rate=RATE, start=0.0, quantity="deck acceleration"):
    np.testing.assert_allclose(recording.samples, factor * samples, rtol=1e-6, atol=1e-7 * factor)
    assert recording.rate == rate
    assert recording.start == pytest.approx(start, abs=1e-12)
    assert recording.quantity == quantity
    assert len(recording.clipped) == len(recording.samples)
    return recording


def noted(recording, *parts):
    for part in parts:
        assert any(part in note for note in recording.notes), recording.notes
    return recording


@pytest.mark.parametrize("suffix", [".csv", ".txt", ".tsv", ".csv.gz", ".txt.gz", ".tsv.gz"])
@pytest.mark.parametrize("separator", [",", ";", "\t", " ", "  "])
def test_text_is_read_with_every_separator(tmp_path, suffix, separator):
    path = text(tmp_path / f"a{suffix}", (TIMES, SAMPLES), separator.join(("t [s]", "a [g]")), separator)
    recording = good(read_recording(path))
    assert recording.source == str(path)
    assert recording.notes == ()
    assert not recording.clipped.any()


@pytest.mark.parametrize(
    ("header", "factor", "quantity"),
    [
        ("t_s,acc (m/s^2)", 1.0, "deck acceleration"),
        ("time (s),acc [m/s²]", 1.0, "deck acceleration"),
        ("t / s,a / (m/s^2)", 1.0, "deck acceleration"),
        ("t_s,acc_m_s2", 1.0, "deck acceleration"),
        ("Time [sec],a [mg]", 1e-3 * G, "deck acceleration"),
        ("t,a [mm/s^2]", 1e-3, "deck acceleration"),
        ("t,F [N]", 1.0, "force"),
        ("t,F_kN", 1e3, "force"),
        ("t,wheel force (kip)", 4448.2216152605, "force"),
        ("t,F [lbf]", 4.4482216152605, "force"),
        ("clock [s],F [kN]", 1e3, "force"),
        ("t,F\ns,kN", 1e3, "force"),
        ("t,F\n[s],[kN]", 1e3, "force"),
        ("# t [s], F [kN]", 1e3, "force"),
        ("station: Nord\nt,F [kN]", 1e3, "force"),
    ],
)
def test_quantity_follows_from_the_unit(tmp_path, header, factor, quantity):
    good(read_recording(text(tmp_path / "a.csv", (TIMES, SAMPLES), header)), factor=factor, quantity=quantity)


def test_times_may_have_another_unit(tmp_path):
    good(read_recording(text(tmp_path / "a.csv", (1e3 * TIMES + 5.0, SAMPLES), "t [ms],a [g]")), start=0.005)


def test_columns_are_chosen_by_name_number_or_unit(tmp_path):
    path = text(tmp_path / "a.csv", (SAMPLES, TIMES, 2.0 * SAMPLES, 3.0 * SAMPLES), "left [g],t,right [g],shunt [V]")
    good(read_recording(path, column="right"), factor=2.0 * G)
    good(read_recording(path, column=0))
    good(read_recording(path, column="left", time="t"))
    good(read_recording(path, column="shunt", unit="10 kN"), factor=3e4, quantity="force")
    noted(read_recording(path, column="shunt", unit="10 kN"), "1 V in the file is taken as 10 kN")
    refused(path, "column", "found 3 columns", "left, right, shunt")
    refused(path, "column", "'middle'", "left, t, right", column="middle")
    refused(path, "column", "found 7", "0 to 3", column=7)
    refused(path, "time", "for times and samples", column="t", time="t")
    refused(path, "unit", "the unit 'V'", "m/s^2, g", column="shunt")
    path = text(tmp_path / "b.csv", (TIMES, SAMPLES, 3.0 * SAMPLES), "t,a [g],F [kN]")
    good(read_recording(path, quantity="force"), factor=3e3, quantity="force")


def test_without_header_the_first_rising_column_is_time(tmp_path):
    path = text(tmp_path / "a.txt", (SAMPLES, TIMES), separator=" ")
    good(noted(read_recording(path, unit="g"), "no unit and are taken in s"))
    refused(path, "unit", "found no unit", 'unit="10 g"')


def test_numbers_of_samples_are_no_times(tmp_path):
    path = text(tmp_path / "a.csv", (np.delete(STEPS, 7), np.delete(SAMPLES, 7)), "sample,a [g]")
    expected = SAMPLES.copy()
    expected[7] = np.nan
    good(noted(read_recording(path, rate=RATE), "numbers of samples", "1 samples missing"), expected)
    refused(path, "rate", "'sample' and no rate")


@pytest.mark.parametrize(
    "line",
    ["# rate: 20000 Hz", "# sample rate = 20 kHz", "# Fs=20000", "# sampling rate [kHz]: 20", "Sample rate;20000",
     "# dt: 50 us", "% sample interval = 5e-5 s"],
)  # fmt: skip
def test_rate_stands_in_a_comment(tmp_path, line):
    path = text(tmp_path / "a.csv", (SAMPLES,), f"{line}\n# speed: 90 km/h\na [g]")
    recording = read_recording(path)
    good(replace(recording, rate=round(recording.rate, 6)))
    assert recording.speed == pytest.approx(25.0)
    refused(path, "rate", "21000 Hz, where the file says 20000 Hz", rate="21 kHz")
    given = read_recording(path, speed="80 km/h")
    assert given.speed == pytest.approx(80 / 3.6)
    noted(given, "the file says 25 m/s")


def test_rate_must_be_stated_without_times(tmp_path):
    path = text(tmp_path / "a.csv", (SAMPLES,), "a [g]")
    good(read_recording(path, rate="20 kHz"))
    refused(path, "rate", "neither a rate nor times")
    refused(path, "rate", "-1", "more than 0", rate=-1)
    refused(path, "rate", "'20 m'", "a frequency", rate="20 m")
    refused(path, "speed", "'fast'", rate=RATE, speed="fast")
    text(path, (SAMPLES,), "# rate: see manual\na [g]")
    noted(read_recording(path, rate=RATE), "not understood in the file: rate: see manual")
    text(path, (SAMPLES,), "# rate: 20 (kHz\na [g]")  # an open bracket is too much for pint's own errors
    noted(read_recording(path, rate=RATE), "not understood in the file: rate: 20 (kHz")
    text(path, (SAMPLES,), "# rate: 20 kHz\n# fs: 10 kHz\na [g]")
    refused(path, "line 2, rate", "10 kHz", "one rate")


@pytest.mark.parametrize("header", ["t [s],a [g],speed [km/h]", "t [s],a [g],Speed km/h", "t [s],a [g],speed_kmh"])
def test_a_column_may_hold_the_speed(tmp_path, header):
    recording = read_recording(text(tmp_path / "a.csv", (TIMES, SAMPLES, np.full(200, 90.0)), header))
    assert recording.speed == pytest.approx(25.0)
    assert recording.samples == pytest.approx(G * SAMPLES)
    assert not any("speed" in note for note in recording.notes)


def test_speeds_that_vary_or_have_no_unit_are_noted(tmp_path):
    varying = np.where(STEPS < 150, 25.0, 30.0)
    recording = read_recording(text(tmp_path / "a.csv", (TIMES, SAMPLES, varying), "t [s],a [g],speed"))
    assert recording.speed == 25.0
    assert "the speeds 'speed' have no unit and are taken in m/s" in recording.notes
    assert "the speeds 'speed' lie between 25 and 30 m/s; the median is taken" in recording.notes
    empty = read_recording(text(tmp_path / "b.csv", (TIMES, SAMPLES, np.full(200, np.nan)), "t [s],a [g],speed [m/s]"))
    assert empty.speed is None
    assert "the column 'speed' is empty" in empty.notes
    heavy = text(tmp_path / "c.csv", (TIMES, SAMPLES, varying), "t [s],a [g],speed [kg]")
    refused(heavy, "speed", "a column in 'kg'")
    standing = text(tmp_path / "d.csv", (TIMES, SAMPLES, 0.0 * varying), "t [s],a [g],speed [m/s]")
    refused(standing, "speed")
    assert read_recording(standing, speed="80 km/h").speed == pytest.approx(80 / 3.6)


def test_decimal_commas_stand_between_semicolons(tmp_path):
    rows = [f"{t:.6f};{a:.9f};".replace(".", ",") for t, a in zip(TIMES, SAMPLES, strict=True)]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["Zeit [s];Beschleunigung [g];", *rows]), encoding="utf-16")
    good(read_recording(path))
    path.write_bytes("\r\n".join(["t [s];a [m/s²]", *rows]).encode("latin-1"))
    good(read_recording(path), factor=1.0)
    path.write_text("\n".join(["a [g]", *(f"{a:.6f}".replace(".", ",") for a in SAMPLES)]))
    refused(path, "line 2", rate=RATE)


@pytest.mark.parametrize("cell", ["NaN", "nan", "", "N/A", "-", "null"])
def test_missing_values_are_nan_and_noted(tmp_path, cell):
    cells = [cell if i in (3, 4, 90) else str(a) for i, a in enumerate(SAMPLES)]
    path = text(tmp_path / "a.csv", (TIMES, cells), "t [s],a [g]")
    expected = SAMPLES.copy()
    expected[[3, 4, 90]] = np.nan
    good(noted(read_recording(path), "3 missing values of 200"), expected)


def test_infinite_values_are_missing(tmp_path):
    samples = SAMPLES.copy()
    samples[5] = np.inf
    path = text(tmp_path / "a.csv", (TIMES, samples), "t [s],a [g]")
    assert np.isnan(noted(read_recording(path), "1 infinite values").samples[5])


def test_words_short_lines_and_empty_lines_are_named(tmp_path):
    cells = [*map(str, SAMPLES[:9]), "1.0x", *map(str, SAMPLES[10:])]
    path = text(tmp_path / "a.csv", (TIMES, cells), "t [s],a [g]")
    refused(path, "line 11, a", "'1.0x'", "a number")
    path.write_text(path.read_text().replace(",1.0x", ""))
    refused(path, "line 11", "1 values", "2, as in the header")
    path.write_text("a [g]\n" + "1\n2\n" * 10 + "\n" + "3\n1\n" * 10)
    refused(path, "line 22", "an empty line", rate=RATE)
    path.write_text("t [s],a [g],b,c\n" + "0,1\n" * 20)
    refused(path, "line 1, header", "4 names above 2 values")


def test_gaps_of_whole_steps_are_filled_with_nan(tmp_path):
    keep = np.delete(STEPS, [10, 11, 12, 50])
    expected = SAMPLES.copy()
    expected[[10, 11, 12, 50]] = np.nan
    path = text(tmp_path / "a.csv", (TIMES[keep], SAMPLES[keep]), "t [s],a [g]")
    good(noted(read_recording(path), "4 samples missing in 2 gaps", "after 0.00045 s"), expected)
    times = TIMES[keep].copy()
    times[40:] += 0.4 / RATE
    text(path, (times, SAMPLES[keep]), "t [s],a [g]")
    refused(path, "line 42, time", "a step 39.7", "equal within 1 %")
    times[40:] += 2.0 / RATE
    text(path, (times, SAMPLES[keep]), "t [s],a [g]")
    refused(path, "line 42, time", "a gap of 3.4", "whole number of steps")
    times[40:] += 1000.0 / RATE - 0.4 / RATE
    text(path, (times, SAMPLES[keep]), "t [s],a [g]")
    refused(path, "time", "missing samples between 196")


def test_jitter_and_drift_are_refused_and_rounding_is_not(tmp_path):
    jitter = np.random.default_rng(1).uniform(-1.0, 1.0, 200)
    path = text(tmp_path / "a.csv", (TIMES + 0.002 * jitter / RATE, SAMPLES), "t [s],a [g]")
    assert read_recording(path).rate == pytest.approx(RATE, rel=1e-5)
    text(path, (TIMES + 0.05 * jitter / RATE, SAMPLES), "t [s],a [g]")
    refused(path, "time", "% off the mean step of", "resample")
    text(path, (np.round(TIMES + 0.05 * jitter / RATE, 7), SAMPLES), "t [s],a [g]")
    refused(path, "time", "% off the mean step of")
    text(path, (np.round(STEPS / 44100.0, 6), SAMPLES), "t [s],a [g]")
    good(noted(read_recording(path), "times rounded to 1e-06 s"), rate=44100.0)
    steps = np.arange(4000)
    text(path, ((steps + 5e-7 * steps**2) / RATE, np.sin(steps)), "t [s],a [g]")
    refused(path, "time", "leave a constant rate")


def test_doubled_falling_and_missing_times_are_named(tmp_path):
    for value, what in ((TIMES[59], "a doubled time"), (TIMES[20], "a falling time"), (np.nan, "a missing time")):
        times = TIMES.copy()
        times[60] = value
        path = text(tmp_path / "a.csv", (times, SAMPLES), "# made today\nt [s],a [g]")
        refused(path, "line 63, time", what)
        np.savez(tmp_path / "a.npz", a=SAMPLES, t=times)
        refused(tmp_path / "a.npz", "sample 60, time", what, unit="g")


def test_stated_rate_must_agree_with_the_times(tmp_path):
    path = text(tmp_path / "a.csv", (TIMES, SAMPLES), "t [s],a [g]")
    good(read_recording(path, rate=RATE))
    refused(path, "rate", "20030 Hz", "20000 Hz", rate=1.0015 * RATE)
    steps = np.arange(2000)
    text(path, (steps / RATE, np.sin(steps)), "t [s],a [g]")
    good(noted(read_recording(path, rate=1.0005 * RATE), "the rate of the times, 20000 Hz"), np.sin(steps))


def test_clipping_is_marked_at_both_ends(tmp_path):
    samples = np.clip(np.sin(0.1 * STEPS), -0.9, 0.95)
    recording = read_recording(text(tmp_path / "a.csv", (TIMES, samples), "t [s],a [g]"))
    assert (recording.clipped == ((samples == -0.9) | (samples == 0.95))).all()
    noted(recording, "at the largest value, 9.31632 m/s^2, in 3 runs", "at the smallest value, -8.82598")
    twice = np.where(STEPS == 4, SAMPLES[3], SAMPLES)
    assert not read_recording(text(tmp_path / "b.csv", (TIMES, twice), "t [s],a [g]")).clipped.any()
    rest = np.maximum(SAMPLES, 0.0)
    recording = read_recording(text(tmp_path / "c.csv", (TIMES, rest), "t [s],F [kN]"))
    assert not noted(recording, "0, stands", "taken as rest").clipped.any()


def test_constant_short_empty_and_implausible_signals(tmp_path):
    path = text(tmp_path / "a.csv", (TIMES, np.full(200, 0.5)), "t [s],a [g]")
    assert not noted(read_recording(path), "a constant signal").clipped.any()
    noted(read_recording(text(path, (TIMES, 2e5 * SAMPLES), "t,a [g]")), "implausibly large")
    noted(read_recording(text(path, (TIMES, 1e-8 * SAMPLES), "t,a [g]")), "implausibly small")
    refused(text(path, (TIMES[:15], SAMPLES[:15]), "t,a [g]"), "15 samples", "at least 16")
    refused(text(path, (TIMES, ["NaN"] * 200), "t,a [g]"), "0 samples besides 200 missing")
    for content, part in (("", "an empty file"), ("\n# nothing\n", "an empty file"), ("t,a [g]\n", "no line of num")):
        path.write_text(content)
        refused(path, part)


@pytest.mark.slow
def test_unit_and_quantity_must_not_contradict(tmp_path):
    path = text(tmp_path / "a.csv", (TIMES, SAMPLES), "t [s],a [g]")
    good(read_recording(path, unit="g", quantity="deck acceleration"))
    refused(path, "unit", "'m/s^2', where the file says 'g'", unit="m/s^2")
    refused(path, "quantity", "'force', where the unit 'g'", quantity="force")
    refused(path, "quantity", "'noise'", quantity="noise")
    text(path, (TIMES, SAMPLES), "t [s],a")
    good(read_recording(path, unit="-10 g"), factor=-10.0 * G)
    for unit in ("V", "0 g", "", "nan g"):
        refused(path, "unit", repr(unit), "m/s^2, g", unit=unit)


def test_missing_foreign_and_broken_files(tmp_path):
    refused(tmp_path / "none.csv", "no readable file")
    refused(tmp_path / "a.doc", "the suffix '.doc'", ".csv")
    (tmp_path / "folder.csv").mkdir()
    refused(tmp_path / "folder.csv", "no readable file")
    for suffix in (".csv", ".csv.gz", ".wav", ".mat", ".npy", ".npz", ".nc"):
        path = tmp_path / f"broken{suffix}"
        path.write_bytes(b"")
        refused(path, "an empty file")
        path.write_bytes(b"\x93PQ\0\x01" * 200)
        refused(path)
    path = text(tmp_path / "cut.csv.gz", (TIMES, SAMPLES), "t [s],a [g]")
    path.write_bytes(path.read_bytes()[:-40])
    refused(path, "a broken gzip file")


def wave24(path, samples):
    """Write PCM of 24 bits, which scipy reads but does not write."""
    data = b"".join(int(v).to_bytes(3, "little", signed=True) for v in np.rint(samples * 2**23))
    header = b"RIFF" + (36 + len(data)).to_bytes(4, "little") + b"WAVEfmt " + (16).to_bytes(4, "little")
    header += b"\x01\x00\x01\x00" + int(RATE).to_bytes(4, "little") + int(3 * RATE).to_bytes(4, "little")
    path.write_bytes(header + b"\x03\x00\x18\x00data" + len(data).to_bytes(4, "little") + data)


def test_wav_of_integers_needs_its_full_scale(tmp_path):
    path = tmp_path / "a.wav"
    for kind, bits in ((np.int16, 15), (np.int32, 31)):
        wavfile.write(path, int(RATE), np.rint(0.9 * SAMPLES * 2**bits).astype(kind))
        recording = read_recording(path, unit="10 g")
        np.testing.assert_allclose(recording.samples, 9.0 * G * SAMPLES, atol=10 * G / 2**bits)
        assert recording.rate == RATE
        refused(path, "unit", "'g' for samples whose 1 is full scale", '"10 g"', unit="g")
        refused(path, "unit", "no unit")
    wavfile.write(path, int(RATE), np.rint(128 + 100 * SAMPLES).astype(np.uint8))
    np.testing.assert_allclose(read_recording(path, unit="10 g").samples, 1000 * G / 128 * SAMPLES, atol=10 * G / 128)
    wave24(path, 0.9 * SAMPLES)
    np.testing.assert_allclose(read_recording(path, unit="10 g").samples, 9.0 * G * SAMPLES, atol=10 * G / 2**23)


def test_wav_of_floats_and_its_channels(tmp_path):
    path = tmp_path / "a.wav"
    wavfile.write(path, int(RATE), SAMPLES.astype(np.float32))
    good(read_recording(path, unit="g"))
    refused(path, "rate", "where the file says 20000 Hz", rate=21e3, unit="g")
    wavfile.write(path, int(RATE), np.stack([SAMPLES, 2.0 * SAMPLES], axis=1))
    good(read_recording(path, unit="g", column="channel 1"), factor=2.0 * G)
    refused(path, "2 columns", "channel 0, channel 1", unit="g")
    path.write_bytes(path.read_bytes()[:-800])
    assert len(noted(read_recording(path, unit="g", column=0), "EOF").samples) == 150


@pytest.mark.parametrize(
    "rates", [{"fs": RATE}, {"Fs": RATE}, {"rate": RATE}, {"sample_rate": RATE}, {"t": TIMES}, {"time": TIMES}]
)
def test_mat_and_npz_have_variables(tmp_path, rates):
    savemat(tmp_path / "a.mat", {"acc": SAMPLES, "unit": "g", **rates})
    np.savez(tmp_path / "a.npz", acc=SAMPLES, unit="g", **rates)
    for name in ("a.mat", "a.npz"):
        good(read_recording(tmp_path / name))
        refused(tmp_path / name, "unit", "where the file says 'g'", unit="kN")
    savemat(tmp_path / "a.mat", {"left": SAMPLES, "right": 2.0 * SAMPLES, **rates})
    np.savez(tmp_path / "a.npz", left=SAMPLES, right=2.0 * SAMPLES, **rates)
    for name in ("a.mat", "a.npz"):
        good(read_recording(tmp_path / name, unit="g", column="right"), factor=2.0 * G)
        refused(tmp_path / name, "column", "left, right", unit="g")


def test_mat_of_version_7_3(tmp_path):
    path = tmp_path / "a.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in (("acc", SAMPLES[:, None]), ("fs", np.array([[RATE]]))):
            file.create_dataset(name, data=value).attrs["MATLAB_class"] = np.bytes_("double")
        text_of = file.create_dataset("unit", data=np.array([[ord("g")]], dtype=np.uint16))
        text_of.attrs["MATLAB_class"] = np.bytes_("char")
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    good(read_recording(path))


def test_lengths_of_times_and_samples_must_agree(tmp_path):
    np.savez(tmp_path / "a.npz", a=SAMPLES, t=TIMES[1:])
    refused(tmp_path / "a.npz", "199 times for 200 samples", unit="g")


def test_npy_is_a_vector_a_matrix_or_fields(tmp_path):
    path = tmp_path / "a.npy"
    np.save(path, SAMPLES)
    good(read_recording(path, unit="g", rate=RATE))
    for matrix in (np.stack([TIMES, SAMPLES], axis=1), np.stack([TIMES, SAMPLES])):
        np.save(path, matrix)
        good(read_recording(path, unit="g"))
    np.save(path, np.rec.fromarrays([TIMES, SAMPLES], names=["t_s", "a_g"]))
    good(read_recording(path))
    np.save(path, (1000 * SAMPLES).astype(np.int16))
    counts = read_recording(path, unit="0.01 g", rate=RATE)
    np.testing.assert_allclose(counts.samples, 10.0 * G * SAMPLES, atol=0.01 * G)
    np.save(path, SAMPLES.astype(complex))
    refused(path, "samples", "complex128", unit="g", rate=RATE)
    np.save(path, np.array([None, {}]), allow_pickle=True)
    refused(path, "no readable numpy file", unit="g", rate=RATE)


def test_nc_has_units_and_a_time_coordinate(tmp_path):
    path = tmp_path / "a.nc"
    accelerations = ("time", SAMPLES, {"units": "g"})
    for unit, factor in (("s", 1.0), ("ms", 1e3), ("seconds since 2026-01-01", 1.0)):
        data = xr.Dataset({"a": accelerations}, {"time": ("time", factor * TIMES, {"units": unit})})
        data.to_netcdf(path, engine="h5netcdf")
        good(read_recording(path))
    xr.Dataset({"a": accelerations}, attrs={"fs": RATE}).to_netcdf(path, engine="h5netcdf")
    good(read_recording(path))
    single = xr.Dataset({"a": accelerations}, {"time": TIMES.astype(np.float32)})
    single.to_netcdf(path, engine="h5netcdf")
    good(read_recording(path))


@pytest.mark.parametrize(("suffix", "package"), [(".tdms", "nptdms"), (".mf4", "asammdf")])
def test_packages_that_are_not_installed_are_named(tmp_path, monkeypatch, suffix, package):
    monkeypatch.setitem(sys.modules, package, None)  # as if it were not
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"x")
    refused(path, f"the package {package} is not installed", f"pip install {package}")


def test_tdms_has_channels(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    path = tmp_path / "a.tdms"
    facts = {"wf_increment": 1.0 / RATE, "wf_start_offset": 0.25, "unit_string": "g"}
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject("deck", "a", SAMPLES, properties=facts)])
    good(read_recording(path), start=0.25)
    path.write_bytes(b"x" * 100)
    refused(path, "no readable TDMS file")


@pytest.mark.filterwarnings("ignore")
def test_mdf_has_channels(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    path = tmp_path / "a.mf4"
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(SAMPLES, TIMES, unit="g", name="a")])
        file.save(path)
    good(read_recording(path))
    path.write_bytes(b"x" * 100)
    refused(path, "no readable MDF file")


def written():
    samples = 1e3 * np.random.default_rng(3).normal(size=300)
    samples[[7, 8]] = np.nan
    clipped = np.zeros(300, dtype=bool)
    clipped[[20, 41]] = True
    truth = {"flat": {"depth": 1e-3, "δ": [1, 2]}, "count": np.int64(3), "levels": np.arange(3.0)}
    return Recording(
        samples, 19999.7, "force", -0.0123, clipped, 80 / 3.6, "made here", ("a note: two\n, lines",), truth
    )


@pytest.mark.parametrize("name", ["a.csv", "a.csv.gz", "a.npz", "a.nc"])
def test_written_recordings_read_back_the_same(tmp_path, name):
    recording, path = written(), tmp_path / name
    assert write_recording(recording, path) == path
    again = read_recording(path)
    np.testing.assert_array_equal(again.samples, recording.samples)
    np.testing.assert_array_equal(again.clipped, recording.clipped)
    assert (again.rate, again.start, again.quantity, again.speed) == (19999.7, -0.0123, "force", 80 / 3.6)
    assert again.source == str(path)
    assert again.truth == {"flat": {"depth": 1e-3, "δ": [1, 2]}, "count": 3, "levels": [0.0, 1.0, 2.0]}
    assert again.notes == ("a note: two\n, lines", "2 missing values of 300")
    write_recording(again, path)
    assert read_recording(path).notes == again.notes
    plain = Recording(SAMPLES, 20e3)
    write_recording(plain, path)
    again = read_recording(path)
    assert (again.speed, again.truth, again.notes, again.quantity) == (None, {}, (), "deck acceleration")
    assert list(tmp_path.iterdir()) == [path]


def test_writing_is_whole_or_not_at_all(tmp_path):
    path = tmp_path / "a.csv"
    write_recording(written(), path)
    before = path.read_bytes()
    broken = written()
    object.__setattr__(broken, "clipped", np.zeros(3, dtype=bool))  # which no constructor takes
    with pytest.raises(ValueError, match="zip"):
        write_recording(broken, path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
    for place, part in ((tmp_path / "a.wav", "the suffix '.wav'"), (tmp_path / "none" / "a.npz", "cannot be written")):
        with pytest.raises(InputError, match=part) as caught:
            write_recording(written(), place)
        assert str(caught.value).startswith(f"{place}: ")

"""Damaged, lying and swollen files of recordings: refused in one line, before they cost memory; the rest is done."""

import gzip
import importlib.util
import io
import random
import zipfile
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr
from scipy.io import savemat, wavfile

import wheeltapper as wt
from wheeltapper.diagnosis.folder import NOT_DIAGNOSED, diagnose_all
from wheeltapper.faces.cli import main
from wheeltapper.record.recordings import apart as reading_apart
from wheeltapper.record.recordings.read import read_recording
from wheeltapper.record.recordings.recording import Recording
from wheeltapper.record.recordings.writing import write_recording

RATE = 20e3
STEPS = np.arange(300)
TIMES = STEPS / RATE
SAMPLES = np.sin(0.37 * STEPS)


@pytest.fixture(autouse=True)
def _ended():
    """Leave no reading process to other tests."""
    yield
    reading_apart.stop()


def refused(path, *parts, **arguments):
    with pytest.raises(wt.InputError) as caught:
        read_recording(path, **arguments)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    for part in parts:
        assert part in message, message


# -- files that are damaged -------------------------------------------------------------------------------------------


def mdf(path):
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(SAMPLES, TIMES, unit="g", name="a")])
        file.save(path, compression=2)


def tdms(path):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as writer:
        facts = {"wf_increment": 1.0 / RATE, "unit_string": "g"}
        writer.write_segment([nptdms.ChannelObject("deck", "a", SAMPLES, properties=facts)])


def hdf(path):
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in (("acc_g", SAMPLES[:, None]), ("fs", np.array([[RATE]]))):
            file.create_dataset(name, data=value).attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


HELD = {"acc_g": SAMPLES, "fs": RATE, "more": {"a": SAMPLES[:9], "b": ["x", "yz"]}}
MAKERS = {
    "a.csv": lambda path: write_recording(Recording(SAMPLES, RATE), path),
    "a.csv.gz": lambda path: write_recording(Recording(SAMPLES, RATE), path),
    "a.npz": lambda path: write_recording(Recording(SAMPLES, RATE), path),
    "a.nc": lambda path: write_recording(Recording(SAMPLES, RATE), path),
    "a.npy": lambda path: np.save(path, np.rec.fromarrays([TIMES, SAMPLES], names=["t_s", "a_g"])),
    "a.wav": lambda path: wavfile.write(path, int(RATE), SAMPLES.astype(np.float32)),
    "b.wav": lambda path: wavfile.write(path, int(RATE), np.rint(3e4 * SAMPLES).astype(np.int16)),
    "a.mat": lambda path: savemat(path, HELD),
    "b.mat": lambda path: savemat(path, HELD, do_compression=True),
    "c.mat": lambda path: savemat(path, {"acc_g": SAMPLES, "fs": RATE}, format="4"),
    "d.mat": hdf,
    "a.tdms": tdms,
    "a.mf4": mdf,
}


def damaged(content, dice):
    """Return a file's content with something wrong in it: bits, a part missing, filled up or doubled."""
    kind = dice.randrange(6)
    whole = bytearray(content)
    if kind < 3:
        reach = len(whole) if kind == 0 else min(len(whole), 600)  # where most of the headers are
        for _ in range(dice.choice((1, 2, 4, 16))):
            whole[dice.randrange(reach)] ^= 1 << dice.randrange(8)
    elif kind == 3:
        del whole[dice.randrange(len(whole)) :]
    elif kind == 4:
        at = dice.randrange(len(whole))
        whole[at : at + dice.choice((4, 8, 64))] = dice.choice((b"\xff", b"\x00", b"\x7f")) * dice.choice((4, 8, 64))
    else:
        at = dice.randrange(len(whole))
        whole[at:at] = whole[max(0, at - 64) : at]
    return bytes(whole)


def survived(folder, seed, count):
    """Read damaged files of all formats; return how many were read nevertheless."""
    dice = random.Random(seed)
    known = {".tdms": "nptdms", ".mf4": "asammdf"}
    names = [name for name in MAKERS if importlib.util.find_spec(known.get(Path(name).suffix, "numpy"))]
    contents, read = {}, 0
    for name in names:
        MAKERS[name](folder / name)
        contents[name] = (folder / name).read_bytes()
    for number in range(count):
        name = names[number % len(names)]
        path = folder / f"{number} {name}"
        path.write_bytes(damaged(contents[name], dice))
        unit = None if name != "b.wav" else "10 g"
        try:
            read += isinstance(read_recording(path, unit=unit, rate=None, apart=True), Recording)
        except wt.InputError as error:
            message = str(error)
            assert message.startswith(f"{path}: ")
            assert "\n" not in message
        path.unlink()
    return read


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_damaged_files_are_read_or_refused(tmp_path):
    assert 0 < survived(tmp_path, 1, 104) < 104


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("seed", range(2, 6))
def test_many_damaged_files_are_read_or_refused(tmp_path, seed):
    assert 0 < survived(tmp_path, seed, 650) < 650


# -- a process of its own ---------------------------------------------------------------------------------------------


def start(monkeypatch, code):
    """Let the next files be read by a process that does something before."""
    reading_apart.stop()
    lines = [
        "import wheeltapper.record.recordings.apart as own", "plain = own.read_file", "def read(path, largest):",
        f"    {code}", "    return plain(path, largest)", "own.read_file = read", "own.serve()",
    ]  # fmt: skip
    monkeypatch.setattr(reading_apart, "_SERVE", "\n".join(lines))


def test_a_reader_that_dies_is_replaced(tmp_path, monkeypatch):
    start(monkeypatch, "import os; 'bad' in path.name and os.abort()")
    for name in ("bad.npy", "good.npy"):
        np.save(tmp_path / name, SAMPLES)
    for _ in range(2):
        refused(tmp_path / "bad.npy", "a file whose reader was ended by SIGABRT", apart=True)
        assert len(read_recording(tmp_path / "good.npy", unit="g", rate=RATE, apart=True).samples) == 300


def test_a_reader_that_does_not_end_is_replaced(tmp_path, monkeypatch):
    start(monkeypatch, "import time; 'bad' in path.name and time.sleep(600)")
    for name in ("bad.npy", "good.npy"):
        np.save(tmp_path / name, SAMPLES)
    assert len(read_recording(tmp_path / "good.npy", unit="g", rate=RATE, apart=True).samples) == 300
    monkeypatch.setattr(reading_apart, "PATIENCE", 0.3)
    refused(tmp_path / "bad.npy", "had not ended after 0.3 s", apart=True)
    monkeypatch.setattr(reading_apart, "PATIENCE", 60.0)
    assert len(read_recording(tmp_path / "good.npy", unit="g", rate=RATE, apart=True).samples) == 300


def test_what_a_reader_prints_is_no_answer(tmp_path, monkeypatch):
    start(monkeypatch, "import os; os.write(1, b'noise'); print('more', flush=True)")
    np.save(tmp_path / "a.npy", SAMPLES)
    np.testing.assert_array_equal(read_recording(tmp_path / "a.npy", unit="N", rate=RATE, apart=True).samples, SAMPLES)


def test_one_process_reads_a_healthy_folder(tmp_path):
    for number in range(20):
        np.save(tmp_path / f"{number}.npy", SAMPLES)
    used = set()
    for path in tmp_path.iterdir():
        read_recording(path, unit="g", rate=RATE, apart=True)
        used |= {process.pid for process in reading_apart._READERS.values()}
    assert len(used) == 1


@pytest.mark.slow
def test_a_folder_is_diagnosed_but_for_the_files_that_cannot_be_read(tmp_path, capsys, monkeypatch):
    start(monkeypatch, "import os; 'crash' in path.name and os.abort()")
    folder = tmp_path / "recordings"
    folder.mkdir()
    noise = 0.07 * np.random.default_rng(1).standard_normal(4000)
    for name in ("fine.npz", "fine.csv"):
        write_recording(Recording(noise, RATE), folder / name)
    (folder / "crash.mat").write_bytes(b"x" * 300)
    (folder / "damaged.npz").write_bytes((folder / "fine.npz").read_bytes()[:-30])
    (folder / "folder.csv").mkdir()
    (folder / "not_gzip.csv.gz").write_bytes(b"\x1f\x8b" + b"x" * 99)
    options = ["--output", str(tmp_path / "findings"), "--workers", "1"]
    assert main(["diagnose", str(folder), "--site", "examples/site.toml", *options]) == 3
    said = capsys.readouterr().out
    assert "6 recordings: 4 not read, 2 no wheel" in said
    assert f"{folder / 'damaged.npz'}: path: found no readable numpy file" in said
    fine = [str(folder / "fine.csv"), str(folder / "fine.npz")]
    assert main(["diagnose", *fine, "--site", "examples/site.toml", "--workers", "1"]) == 0


def test_an_error_of_a_diagnosis_is_its_files_own(tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    write_recording(Recording(SAMPLES, RATE), path)
    monkeypatch.setattr("wheeltapper.diagnosis.folder.diagnose", lambda *_: 1 / 0)
    (entry,) = diagnose_all([path], wt.load("examples/site.toml"), workers=1)
    assert entry["verdict"] == NOT_DIAGNOSED
    assert entry["paragraph"] == f"{path}: found ZeroDivisionError: division by zero"


# -- files that unpack to too much ------------------------------------------------------------------------------------

ZEROS = b"0\n" * 20_000_000


def numpy_header(shape):
    out = io.BytesIO()
    np.lib.format.write_array_header_1_0(out, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return out.getvalue()


def npz(path, content):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("samples.npy", content)


def mat5(content, dims):
    """Return a compressed element of a MATLAB file: a matrix of doubles."""

    def element(kind, data):
        return kind.to_bytes(4, "little") + len(data).to_bytes(4, "little") + data + bytes(-len(data) % 8)

    sizes = b"".join(n.to_bytes(4, "little") for n in dims)
    inner = element(6, bytes([6, 0, 0, 0, 0, 0, 0, 0])) + element(5, sizes) + element(1, b"a") + element(9, content)
    packed = zlib.compress(element(14, inner), 9)
    header = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    return header + (15).to_bytes(4, "little") + len(packed).to_bytes(4, "little") + packed


@pytest.mark.slow
def test_a_small_file_that_unpacks_to_much_is_refused(tmp_path):
    path = tmp_path / "a.csv.gz"
    path.write_bytes(gzip.compress(b"a [g]\n" + ZEROS))
    assert path.stat().st_size < 1e5
    refused(path, "more than 1e+07 bytes", "largest=", largest=1e7)
    path = tmp_path / "a.npz"
    npz(path, numpy_header((5_000_000,)) + bytes(40_000_000))
    assert path.stat().st_size < 1e5
    refused(path, "more than 1e+07 bytes", largest=1e7)
    path = tmp_path / "a.mat"
    for dims in ((5_000_000, 1), (10, 1)):
        path.write_bytes(mat5(bytes(40_000_000), dims))
        assert path.stat().st_size < 1e5
        refused(path, "more than 1e+07 bytes", largest=1e7)
    path = tmp_path / "a.nc"
    data = xr.Dataset({"a": ("time", np.zeros(5_000_000), {"units": "g"})}, attrs={"fs": RATE})
    data.to_netcdf(path, engine="h5netcdf", encoding={"a": {"zlib": True, "complevel": 9}})
    assert path.stat().st_size < 2e5
    refused(path, "more than 1e+07 bytes", largest=1e7)
    refused(path, "more than 1e+07 bytes", largest=1e7, apart=True)


def test_a_header_that_claims_too_much_is_refused(tmp_path):
    huge = 10**12
    np.save(tmp_path / "a.npy", SAMPLES)
    for shape, part in (((huge,), "more than 1e+09 bytes"), ((huge, huge), "more than"), ((9000,), "72000 bytes")):
        (tmp_path / "a.npy").write_bytes(numpy_header(shape) + bytes(800))
        refused(tmp_path / "a.npy", part)
        npz(tmp_path / "a.npz", numpy_header(shape) + bytes(800))
        refused(tmp_path / "a.npz", part)
    for name in ("a.nc", "a.mat"):
        with h5py.File(tmp_path / name, "w") as file:
            file.create_dataset("a", shape=(huge,), chunks=(1000,), dtype="f8")
        refused(tmp_path / name, "more than 1e+09 bytes")
    (tmp_path / "a.mat").write_bytes(mat5(bytes(800), (huge // 10**6, 10**3)))
    refused(tmp_path / "a.mat", "more than 1e+09 bytes")
    (tmp_path / "a.mat").write_bytes(mat5(bytes(800), (100_000, 1)))
    refused(tmp_path / "a.mat", "100000 numbers in")
    size = huge.to_bytes(8, "little")
    (tmp_path / "a.wav").write_bytes(b"RF64" + b"\xff" * 4 + b"WAVEds64" + (28).to_bytes(4, "little") + size + size)
    refused(tmp_path / "a.wav", "more than 1e+09 bytes")
    path = tmp_path / "a.csv"
    path.write_text("a [g]\n" + "1\n" * 3000)
    refused(path, "more than 5000 bytes", largest=5000)


# -- what a recording and its columns are called ----------------------------------------------------------------------


def test_a_recording_prints_in_one_short_line(tmp_path):
    recording = Recording(SAMPLES, RATE, speed=9.0, truth={"a": list(range(1000))}, source="a.csv")
    assert len(repr(recording)) < 150
    assert "300 samples at 20000 Hz" in repr(recording)


@pytest.mark.parametrize("column", [2, "2", "Beschl. rechts", "Beschl. rechts [g]", "beschl. rechts"])
def test_a_column_is_named_by_its_header_or_its_number(tmp_path, column):
    path = tmp_path / "a.csv"
    rows = [f"{t:.6f};{a:.9f};{2 * a:.9f}".replace(".", ",") for t, a in zip(TIMES, SAMPLES, strict=True)]
    path.write_text("\n".join(["Zeit [s];Beschl. links [g];Beschl. rechts [g]", *rows]))
    found = read_recording(path, column=column)
    np.testing.assert_allclose(found.samples, 2 * 9.80665 * SAMPLES, atol=1e-7)
    refused(path, "column: found '3'", "Zeit, Beschl. links", column="3")


def test_the_command_line_takes_a_columns_number_and_header(tmp_path, capsys):
    path = tmp_path / "a.csv"
    noise = 0.007 * np.random.default_rng(1).standard_normal((2, 4000))
    rows = [f"{i / RATE:.6f};{a:.9f};{b:.9f}" for i, (a, b) in enumerate(noise.T)]
    path.write_text("\n".join(["Zeit [s];Beschl. links [g];Beschl. rechts [g]", *rows]))
    for column in ("1", "Beschl. links [g]"):
        assert main(["diagnose", str(path), "--site", "examples/site.toml", "--column", column]) == 0
        assert "no wheel" in capsys.readouterr().out.lower()
    assert main(["diagnose", str(path), "--site", "examples/site.toml", "--column", "3"]) == 2
    assert "column: found '3'" in capsys.readouterr().err

"""How long trains in recordings take, against one low-pass filter of the same samples; their memory; a report's pages.

uv run python benchmarks/wayside.py [--trains 20] [--axles 200] [--format npy] [--workers 2]

Each train is one file with two channels at 10 kHz, of a speed of 15 to 30 m/s; 500 trains are a day. They come in parts
of 100, each of which is measured and reported into the same pages and database, and then deleted. The filter is
Butterworth's of the fourth order, run both ways by SciPy. CPU times are of this process; those of several are by the
clock, and in brackets the CPU time of all of them with their start. The largest memory so far of this process, and of
the others, is told after each part: it shall not grow.
"""

from __future__ import annotations

import resource
import tempfile
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
from options import parser_of
from scipy.io import wavfile
from scipy.signal import butter, sosfiltfilt

import wheeltapper as wt
from wheeltapper.diagnosis.processes import in_processes
from wheeltapper.faces.report.answers import Asked
from wheeltapper.faces.report.run import Places, make_report
from wheeltapper.record.limits.rule import as_rules

RATE, FULL_SCALE, PART = 10e3, 500e3, 100


def site_of(form: str) -> wt.diagnosis.Site:
    """Return a site with two pairs of gauges 3 m apart; columns of arrays bear numbers."""
    names = ("0", "1") if form in ("npy", "wav") else ("first", "second")
    unit = f"{FULL_SCALE / 1e3:g} kN" if form == "wav" else "N"
    sensors = [
        {"kind": "rail shear force", "name": name, "side": "left", "x1": x, "x2": x + 0.4, "unit": unit, "rate": RATE}
        for name, x in zip(names, (0.1, 3.1), strict=True)
    ]
    return wt.diagnosis.Site(sensor=sensors, name="two pairs")


def written(folder: Path, number: int, axles: int, form: str) -> Path:
    """Write a train; return its file."""
    rng = np.random.default_rng(number)
    places = (np.array([0.0, 1.8, 9.0, 10.8]) + 14.4 * np.arange(-(-axles // 4))[:, None]).ravel()[:axles]
    speed, loads = rng.uniform(15.0, 30.0), rng.uniform(3e4, 1.1e5, axles)
    time = np.arange(0.0, (places[-1] + 15.0) / speed, 1.0 / RATE)
    out = 2e3 * rng.standard_normal((2, len(time)))
    for row, x in zip(out, (0.1, 3.1), strict=True):
        for place, load in zip(places, loads, strict=True):
            first, last = (int(RATE * (5.0 + place + x + end) / speed) for end in (-0.1, 0.5))
            here = speed * time[first:last] - 5.0 - place - x
            row[first:last] += load * np.interp(here, [-0.05, 0.05, 0.35, 0.45], [0.0, 1.0, 1.0, 0.0])
    file = folder / f"{number:04}.{form}"
    if form == "npy":
        np.save(file, out.T)
    elif form == "wav":
        wavfile.write(file, int(RATE), (out.T / FULL_SCALE).astype(np.float32))
    else:
        np.savetxt(file, out.T, header=f"rate: {RATE:g} Hz\nfirst [N],second [N]", fmt="%.1f", delimiter=",")
    return file


def axles_in(site: wt.diagnosis.Site, file: Path) -> int:
    """Return the number of axles that are found in a file."""
    return sum(len(train.axles) for train in wt.diagnosis.measure_trains(file, site, name=file.name))


def low_pass(site: wt.diagnosis.Site, files: list[Path]) -> tuple[float, int]:
    """Return the CPU time of the filter alone, s, and the number of samples."""
    sections, filtering, samples = butter(4, 500.0, fs=RATE, output="sos"), 0.0, 0
    for file in files:
        channels = [one.samples for one in wt.diagnosis.read_channels(file, site).values()]
        begun = process_time()
        for channel in channels:
            sosfiltfilt(sections, channel)
        filtering += process_time() - begun
        samples += sum(map(len, channels))
    return filtering, samples


def memory() -> str:
    """Return the largest memory so far."""
    own, others = (resource.getrusage(of).ru_maxrss / 1024 for of in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return f"{own:.0f} MB, of another process {others:.0f} MB"


def others() -> float:
    """Return the CPU time of the processes that have ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Print times and memory."""
    parser = parser_of(__doc__)
    parser.add_argument("--trains", type=int, default=20)
    parser.add_argument("--axles", type=int, default=200)
    parser.add_argument("--format", choices=("npy", "wav", "csv"), default="npy")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    if options.smallest:
        options.trains, options.axles, options.workers = 2, 8, 1
    site = site_of(options.format)
    filtering, alone, together, used, reporting, samples, axles, again = 0.0, 0.0, 0.0, 0.0, 0.0, 0, 0, 0
    with tempfile.TemporaryDirectory() as place:
        folder, output = Path(place) / "in", Path(place) / "out"
        folder.mkdir()
        output.mkdir()
        places = Places(folder, output, output / "findings.db", None)
        for first in range(0, options.trains, PART):
            numbers = range(first, min(first + PART, options.trains))
            files = [written(folder, number, options.axles, options.format) for number in numbers]
            axles_in(site, files[0])  # imports
            took, count = low_pass(site, files)
            filtering, samples = filtering + took, samples + count
            begun = process_time()
            axles += sum(axles_in(site, file) for file in files)
            alone += process_time() - begun
            clock, before = perf_counter(), others()
            again += sum(found for _, found in in_processes(axles_in, site, files, options.workers))
            together, used = together + perf_counter() - clock, used + others() - before
            clock = perf_counter()
            counts = make_report(Asked(site, as_rules(None, None), None), places, options.workers, None)
            reporting += perf_counter() - clock
            for file in files:
                file.unlink()
            print(f"{numbers[-1] + 1} trains: {alone / filtering:.1f} low-passes, at most {memory()}", flush=True)
    known = options.trains * options.axles
    print(f"{options.trains} trains, {axles} of {known} axles, {samples / 1e6:.1f} million samples")
    print(f"low-pass: {filtering:.2f} s; trains: {alone:.2f} s with reading, {alone / filtering:.1f} times as long")
    both = f"{together:.2f} s by the clock ({used:.2f} s), {together / filtering:.1f} times as long"
    print(f"  {options.workers} processes: {both}, {again} axles")
    print(f"report: {reporting:.2f} s, {reporting / options.trains:.3f} s for each train, {counts}")


if __name__ == "__main__":
    main()

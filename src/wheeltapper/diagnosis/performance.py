"""How well a site distinguishes faults: passages are computed, diagnosed, and counted."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.site import Site, as_any_site, as_site
from wheeltapper.diagnosis.case import faults_of
from wheeltapper.diagnosis.detection.detection import Detection
from wheeltapper.diagnosis.detection.hit_miss import hit_miss
from wheeltapper.diagnosis.detection.roc import FalseCalls, Roc, false_calls, roc
from wheeltapper.diagnosis.detection.signal_response import signal_response
from wheeltapper.diagnosis.diagnose import diagnose
from wheeltapper.diagnosis.faults.base import Sizes, fault_named
from wheeltapper.diagnosis.finding import HEALTHY, NO_WHEEL
from wheeltapper.diagnosis.gauges.performance import GaugePerformance, assess_gauges
from wheeltapper.diagnosis.kept import digest_of
from wheeltapper.diagnosis.processes import Lost, ProcessError, in_processes
from wheeltapper.diagnosis.site.neighbours import ends_of
from wheeltapper.diagnosis.site.synthetic import synthesise
from wheeltapper.ground.arguments import as_count, as_names, as_path, as_table
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.progress import Progress, progress_shown, report
from wheeltapper.ground.shown import Shown
from wheeltapper.ground.warned import warn_of
from wheeltapper.lower.plausible import doubts, site_notes

FloatArray = NDArray[np.float64]

LOWEST = -1e9
"""Score of a fault that was not compared in a passage: below every other score."""
ALLOWED = 0.01
"""Rate of false calls at which the JSON gives the detection rate."""


class DiagnosedPassage(NamedTuple):
    """One computed passage, diagnosed."""

    label: str
    number: int
    size: float  # NaN if it is healthy
    verdict: str
    named: bool  # whether the verdict is a fault of the right part
    score: float  # of the faulty part; for a healthy passage the largest of all parts
    scores: dict[str, float]
    estimated: float


@dataclass(frozen=True, eq=False)
class FaultPerformance:
    """How well one fault is recognised.

    Attributes
    ----------
    roc
        ROC of the log odds of a fault in the part concerned, against healthy passages.
    called, named
        Shares of the faulty passages whose verdict is not "healthy", and whose verdict names the part.
    size_error
        Root mean square error of the estimated size over the passages whose fault was named; NaN if none was.
    hit_miss, signal_response
        Probability of detection as a function of size, if sizes were drawn from a range. None otherwise, or if it
        cannot be fitted: `reason` says why.
    """

    roc: Roc
    called: float
    named: float
    size_error: float
    hit_miss: Detection | None
    signal_response: Detection | None
    reason: str
    passages: tuple[DiagnosedPassage, ...]


@dataclass(frozen=True, eq=False)
class Performance(Shown):
    """How well a site distinguishes faults.

    Attributes
    ----------
    false_calls
        Healthy passages that were called faulty.
    faults
        Results for each fault, by its name.
    ceiling
        Share of a wheel's circumference that rolls over the deck during the recording: the largest possible probability
        of detecting a flat.
    """

    site: Site
    healthy: tuple[DiagnosedPassage, ...]
    false_calls: FalseCalls
    faults: dict[str, FaultPerformance]
    ceiling: float

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers, for JSON."""
        return {
            "format": 1,
            "site": self.site.name,
            "healthy": len(self.healthy),
            "false_calls_per_1000": self.false_calls.per_thousand,
            "false_calls_per_1000_interval_95": [self.false_calls.lower, self.false_calls.upper],
            "ceiling": self.ceiling,
            "faults": {name: _performance_table(found) for name, found in self.faults.items()},
        }

    def __str__(self) -> str:
        low, high = self.false_calls.lower, self.false_calls.upper
        lines = [
            f"{len(self.healthy)} healthy passages: {self.false_calls.per_thousand:.3g} false calls per 1,000 axles "
            f"(95 %: {low:.3g} to {high:.3g})",
            f"{'fault':16} {'passages':>8} {'AUC':>8} {'called':>8} {'named':>8} {'rms size error':>15} {'a90':>9} "
            f"{'a90/95':>9}",
        ]
        for name, found in self.faults.items():
            pod = found.hit_miss
            sizes = [
                _number_text(value)
                for value in (found.size_error, *((pod.a90, pod.a90_95) if pod else (np.nan, np.nan)))
            ]
            lines.append(
                f"{name:16} {len(found.passages):8d} {found.roc.auc:8.4f} {found.called:8.3f} {found.named:8.3f} "
                f"{sizes[0]:>15} {sizes[1]:>9} {sizes[2]:>9}"
            )
            if found.reason:
                lines.append(f"    {found.reason}")
        return "\n".join(lines)


def assess(
    site: Site | str | Path,
    faults: Mapping[str, Sizes] | Sequence[str] | None = None,
    *,
    count: int = 200,
    healthy: int | None = None,
    seed: int = 0,
    output: str | Path | None = None,
    workers: int | None = None,
    progress: Progress = True,
    speeds: Sequence[float | str] | None = None,
    static_forces: Sequence[float | str] | None = None,
    noise: float | str | None = None,
) -> Performance | GaugePerformance:
    """Measure how well a site distinguishes faults: a deck by computed passages, gauges by predicted readings.

    At a site with gauges on a `track` the faults are flats. The model that a diagnosis fits predicts whether they are
    found, and how well their lengths are known, at places all around the wheel.

    Parameters
    ----------
    site
        The site, or the path of its TOML file. The true passages are drawn from its uncertainties.
    faults
        Sizes by the names of faults: one size, None for the usual size, or a range from which the size of each passage
        is drawn. A range also gives the probability of detection as a function of size. Names alone stand for usual
        sizes. By default some of the faults that the site's wheelsets can have.
    count, healthy
        Number of passages of each fault, and of healthy ones (by default the same number).
    seed
        Seed of the random numbers.
    output
        File (.jsonl) in which the result of each passage is kept. Results that it already holds are not computed again.
    workers
        Processes; by default one per core.
    progress
        As for `wheeltapper.simulate`.
    speeds, static_forces, noise
        Only for a site with gauges: speeds and static forces of the wheels, m/s and N (20 m/s and 80 kN by default),
        and the standard deviation of a sample, N (0.5 kN by default). `count` wheels without a flaw are drawn at each
        speed and load.

    Returns
    -------
    Performance or GaugePerformance
        GaugePerformance for a site with gauges on a track: its chart is a map of what the site sees around a wheel.

    Raises
    ------
    InputError
        If an argument is wrong.
    ProcessError
        If the processes of some passages died, since all numbers would then be those of the other passages only. The
        others are computed first, and kept.
    """
    count, seed = as_count(count, "count", 2), as_count(seed, "seed", 0)
    place, of_gauges = as_any_site(site), {"speeds": speeds, "static_forces": static_forces, "noise": noise}
    of_deck = {"healthy": healthy, "output": output, "workers": workers}
    for name, value in (of_gauges if place.track is None else of_deck).items():
        if value is not None:
            has = "no track" if place.track is None else "a track"
            raise InputError("", name, f"given, with a site that has {has}", "none of it")
    if place.track is not None:
        warn_of(site_notes(place))
        return assess_gauges(place, faults, count, seed, progress, **of_gauges)
    site = as_site(site)
    warn_of((*site_notes(site), *doubts(site.passage)))
    healthy = count if healthy is None else as_count(healthy, "healthy", 2)
    output = None if output is None else as_path(output, "output", "the path of a .jsonl file")
    faults = _with_sizes(site, faults)
    tasks = [(name, size, number, seed) for name, size in faults.items() for number in range(count)]
    tasks += [(HEALTHY, None, number, seed) for number in range(healthy)]
    digest = "" if output is None else digest_of(site)
    kept = _kept_passages(output, digest)
    found = {i: kept[_task_key(task)] for i, task in enumerate(tasks) if _task_key(task) in kept}
    waiting = [i for i in range(len(tasks)) if i not in found]
    lost: list[str] = []
    waits = [tasks[i] for i in waiting]
    with progress_shown(progress, "passages"), closing(in_processes(_diagnosed_passage, site, waits, workers)) as done:
        report("passages", len(found), len(tasks))
        for number, result in done:
            i = waiting[number]
            if isinstance(result, Lost):
                lost.append(f"{tasks[i][0]} {tasks[i][2]}: {result}")
                continue
            found[i] = result
            _keep_passage(output, digest, tasks[i], result)
            report("passages", len(found), len(tasks))
    if lost:
        raise ProcessError(f"{len(lost)} of {len(tasks)} passages were not computed; {lost[0]}")
    passages = [found[i] for i in range(len(tasks))]
    sound = tuple(p for p in passages if p.label == HEALTHY)
    ceiling = _recorded_circumference(site)
    told = {
        name: _fault_performance(name, size, tuple(p for p in passages if p.label == name), sound, ceiling)
        for name, size in faults.items()
    }
    called = sum(p.verdict not in (HEALTHY, NO_WHEEL) for p in sound)
    return Performance(site, sound, false_calls(called, len(sound)), told, ceiling)


_Task = tuple[str, Sizes, int, int]


def _with_sizes(site: Site, faults: Mapping[str, Sizes] | Sequence[str] | None) -> dict[str, Sizes]:
    """Return the faults to compute with their sizes; by default the usual ones that the site's wheelsets can have."""
    if faults is None:
        possible = faults_of(site.passage)[0]
        return {name: fault.usual_range for name, fault in possible.items() if fault.assessed}
    what = "names of faults, or their sizes by name"
    if isinstance(faults, Mapping):
        sizes = as_table(faults, "faults", what)
    else:
        sizes = dict.fromkeys(as_names(faults, "faults", what))
    faults_of(site.passage, list(sizes))
    for size in sizes.values():
        if size is not None:
            ends_of(size)
    return {name: tuple(size) if isinstance(size, list) else size for name, size in sizes.items()}


def _diagnosed_passage(site: Site, task: _Task) -> DiagnosedPassage:
    """Compute and diagnose one passage."""
    name, size, number, seed = task
    own = int(np.random.SeedSequence([seed, *name.encode(), number]).generate_state(1)[0])
    fault = None if name == HEALTHY else name
    (recording,) = synthesise(site, 1, fault=fault, size=size, seed=own)
    finding = diagnose(recording, site)
    parts = {fault_named(other).part for other in finding.weights if other != HEALTHY}
    scores = {part: max(finding.score(part), LOWEST) for part in sorted(parts)}
    if fault is None:
        score, named = max(scores.values(), default=LOWEST), False
    else:
        part = fault_named(fault).part
        score = scores.get(part, LOWEST)
        named = finding.verdict != HEALTHY and finding.part == part
    true = float(recording.truth.get("size") or np.nan)
    same = finding.size if finding.verdict == fault else np.nan
    return DiagnosedPassage(name, number, true, finding.verdict, named, score, scores, same)


def _fault_performance(
    name: str, size: Sizes, passages: tuple[DiagnosedPassage, ...], sound: tuple[DiagnosedPassage, ...], ceiling: float
) -> FaultPerformance:
    part = fault_named(name).part
    curve = roc([p.scores.get(part, LOWEST) for p in sound], [p.score for p in passages])
    errors = np.array([p.estimated - p.size for p in passages])
    errors = errors[np.isfinite(errors)]
    detected = signal = None
    reason = ""
    if isinstance(size, tuple):
        most = ceiling if part == "wheel" else 1.0
        sizes = [p.size for p in passages]
        try:
            detected = hit_miss(sizes, [p.named for p in passages], ceiling=most)
            reason = detected.reason
            signals = np.array([p.estimated if np.isfinite(p.estimated) else 0.0 for p in passages])
            floor = float(signals[signals > 0.0].min(initial=np.inf))
            signal = signal_response(sizes, signals, floor, floor=0.999 * floor, ceiling=most)
        except InputError as error:
            reason = str(error)
    return FaultPerformance(
        curve,
        float(np.mean([p.verdict not in (HEALTHY, NO_WHEEL) for p in passages])),
        float(np.mean([p.named for p in passages])),
        float(np.sqrt((errors**2).mean())) if len(errors) else np.nan,
        detected,
        signal,
        reason,
        passages,
    )


def _recorded_circumference(site: Site) -> float:
    """Return the share of the circumference that rolls over the deck during the recording."""
    passage = site.passage
    end = float(passage.speed * passage.duration)
    start, length = passage.track.start, passage.track.length
    first = 0.0 if start is None else max(float(start), 0.0)
    last = end if start is None or length is None else min(end, float(start) + float(length))
    return float(min(max(last - first, 0.0) / (2.0 * np.pi * passage.vehicle.radius), 1.0))


def _performance_table(found: FaultPerformance) -> dict[str, Any]:
    out: dict[str, Any] = {
        "passages": len(found.passages), "auc": found.roc.auc, "auc_interval_95": list(found.roc.interval()),
        "detected_at_1_percent_false_calls": found.roc.rate_at(ALLOWED), "called": found.called, "named": found.named,
        "rms_size_error": _or_none(found.size_error), "reason": found.reason,
    }  # fmt: skip
    for kind in ("hit_miss", "signal_response"):
        pod = getattr(found, kind)
        if pod is not None:
            out[kind] = {"a50": _or_none(pod.a50), "a90": _or_none(pod.a90), "a90_95": _or_none(pod.a90_95)}
    return out


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _number_text(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.3g}"


# -- what is kept -----------------------------------------------------------------------------------------------------


def _task_key(task: _Task) -> str:
    return json.dumps(task)


def _kept_passages(output: Path | None, digest: str) -> dict[str, DiagnosedPassage]:
    """Return the results that a file holds, of the site with a digest."""
    out: dict[str, DiagnosedPassage] = {}
    if output is None or not output.exists():
        return out
    written = output.read_bytes()
    for line in written.splitlines():
        try:
            entry = json.loads(line)
            if entry["site"] == digest:
                out[entry["task"]] = DiagnosedPassage(**entry["passage"])
        except (ValueError, TypeError, KeyError):
            continue  # the last line, if the program was stopped while writing it
    if written and not written.endswith(b"\n"):  # else the next result would be lost with that line
        with output.open("ab") as file:
            file.write(b"\n")
    return out


def _keep_passage(output: Path | None, digest: str, task: _Task, passage: DiagnosedPassage) -> None:
    if output is None:
        return
    entry = {"site": digest, "task": _task_key(task), "passage": passage._asdict()}
    with output.open("a", encoding="utf-8") as file:
        file.write(json.dumps(entry) + "\n")

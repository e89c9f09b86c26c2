"""The answer to a recording: its trains, what each wheel shows, and pictures of the worst; in any process."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.alarms import Alarm
from wheeltapper.diagnosis.finding import HEALTHY
from wheeltapper.diagnosis.train import TrainFinding
from wheeltapper.diagnosis.wayside.channels import channels_of, read_channels
from wheeltapper.diagnosis.wayside.deck import Diagnosed
from wheeltapper.diagnosis.wayside.measure import NO_FORCE, NO_STRIKES, STRIKES, trains_in, with_models
from wheeltapper.diagnosis.wayside.measured import Measured
from wheeltapper.diagnosis.wayside.sizes import is_lost
from wheeltapper.diagnosis.wayside.sources import Source
from wheeltapper.diagnosis.wayside.wheels import traces_of
from wheeltapper.faces.report.pictures import evidence, fitted_evidence
from wheeltapper.ground.errors import InputError, printable
from wheeltapper.record.limits.rule import Rule

MEASURED, NO_TRAIN, NOT_READ = "measured", "no train", "not read"
IN_PART, NOT_MEASURED = "measured in part", "not measured"
"""Answers to a recording. The last two: processes of some wheels, or its own, died, or the program failed; the next
time it is tried again."""
UNFINISHED = (IN_PART, NOT_MEASURED)
FLAWED = "flaw by the model"
FINDINGS = ("stop", "maintain", "warning", FLAWED, STRIKES, NO_STRIKES, NO_FORCE)
"""Findings on a wheel, the worst first: the level of its worst alarm, else what a fitted model says, else its verdict.
"""
PICTURES = 4
"""Largest number of wheels of a train whose evidence is drawn."""


class Asked(NamedTuple):
    """What all recordings share."""

    site: Site
    rules: tuple[Rule, ...]
    distances: tuple[str, ...] | None
    diagnosed: Diagnosed = "none"


class Picture(NamedTuple):
    """The evidence of a wheel, as an SVG; and that of the model that was fitted to it, with what it says."""

    axle: int
    side: str | None
    svg: str
    model: str = ""
    said: str = ""


class Train(NamedTuple):
    """A train, what was found on each of its wheels (the rows of its table, with `finding`), the worst ones drawn."""

    finding: TrainFinding
    wheels: tuple[dict[str, Any], ...]
    pictures: tuple[Picture, ...]


class Answer(NamedTuple):
    """What a recording says, and why, if it says nothing."""

    answer: str
    reason: str
    trains: tuple[Train, ...] = ()


def answer_source(shared: tuple[Asked, int | None], source: Source) -> Answer:
    """Return the answer to a recording; nothing in it stops the others.

    What recordings share is what is asked, and how many processes diagnose the wheels of one.
    """
    asked, workers = shared
    try:
        recordings = read_channels(source.files, asked.site, apart=True)
        found = trains_in(
            channels_of(recordings, asked.site), asked.site, asked.rules, asked.distances, source.name, source.when[0]
        )
        found = with_models(found, recordings, asked.site, asked.diagnosed, workers)
        if not found:
            return Answer(NO_TRAIN, "no axle in any channel stands out from noise and drift")
        lost = any(is_lost(one.finding) for one in found)
        return Answer(IN_PART if lost else MEASURED, "", tuple(_train(one) for one in found))
    except InputError as error:
        return Answer(NOT_READ, str(error))
    except Exception as error:  # an error in one recording must not stop the others
        return Answer(NOT_MEASURED, printable(" ".join(f"found {type(error).__name__}: {error}".split())))


def _train(found: Measured) -> Train:
    train = found.finding
    wheels = tuple(
        {**row, "finding": finding_of(row["verdict"], _alarms_at(train, row["axle"], row["side"]), row.get("model"))}
        for row in train.table()
    )
    worst = sorted(wheels, key=_badness)[:PICTURES]
    bad = [row for row in worst if row["finding"] not in (NO_STRIKES, NO_FORCE)] or worst[:1]
    entries = {(n, one["side"]): one for n, axle in enumerate(train.axles, 1) for one in axle["wheels"]}
    pictures = tuple(
        _picture(found, row, entries[row["axle"], row["side"]]) for row in bad if row["finding"] != NO_FORCE
    )
    return Train(train, wheels, pictures)


def _picture(found: Measured, row: dict[str, Any], wheel: dict[str, Any]) -> Picture:
    axle, side = row["axle"], row["side"]
    seen = evidence(row, wheel, traces_of(found.passage, found.pulses, axle - 1, side))
    fitted = found.finding.wheels.get((axle, side))
    if fitted is None:
        return Picture(axle, side, seen)
    model = "" if fitted.sized.shown is None else fitted_evidence(fitted)
    return Picture(axle, side, seen, model, str(fitted))


def _alarms_at(train: TrainFinding, axle: int, side: str | None) -> list[Alarm]:
    return [alarm for alarm in train.alarms_at(axle) if alarm.side in ("", side or "")]


def finding_of(verdict: str, alarms: Sequence[Alarm], model: str | None = None) -> str:
    """Return the finding on a wheel, one of `FINDINGS`; `model` is the verdict of a fitted model, if there is one."""
    levels = {alarm.rule.level for alarm in alarms}
    if model not in (None, HEALTHY):
        levels.add(FLAWED)
    return next((level for level in FINDINGS if level in levels), verdict)


def _badness(row: dict[str, Any]) -> tuple[int, float]:
    return FINDINGS.index(row["finding"]), -(row["dynamic_ratio"] or 0.0)

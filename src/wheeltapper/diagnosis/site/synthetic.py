"""Synthetic recordings: computed passages, with uncertain fields drawn, through the model of the sensor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.site import Site, as_site
from wheeltapper.diagnosis.inference.timing import TIME_ZERO
from wheeltapper.diagnosis.site.neighbours import Condition, Neighbour, Others, deck_motion, neighbours_of
from wheeltapper.ground.arguments import as_count, as_list, as_quantity, as_table, check_flag, check_text
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.progress import Progress, progress_shown, report
from wheeltapper.ground.quantities import to_si
from wheeltapper.ground.warned import warn_of
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.plausible import doubts, site_notes
from wheeltapper.record.recordings.recording import Recording

FloatArray = NDArray[np.float64]

SEARCHED = 0.1
"""Where a site has no trigger, time zero is drawn from this share of the passage's duration."""
OWN = "vehicle."
"""First part of the paths of fields that are drawn for each wheelset of a train. All other fields belong to the site
and are the same for all wheelsets."""
COACH = (0.0, 2.56, 19.0, 21.56)
"""Distances of a coach's wheelsets behind its first one, m (ERRI B176)."""
COUPLED = 26.4
"""Distance from the first wheelset of a coach to that of the next one, m."""
REACH = 6.0
"""Distance, m, beyond which the deck does not feel another wheelset, if none is given."""


def synthesise(
    site: Site | str | Path, count: int = 1, *, fault: str | Condition | None = None,
    size: float | tuple[float, float] | None = None,
    changes: Mapping[str, float] | None = None, seed: int = 0, vary: bool = True,
    noise: float | None = None, neighbour: float | Neighbour | Sequence[Neighbour] | None = None, coupled: bool = True,
    progress: Progress = True,
) -> list[Recording]:  # fmt: skip
    """Compute recordings of passages over a site.

    Parameters
    ----------
    site
        The site, with its sensor and its uncertainties; or the path of its TOML file.
    count
        Number of passages.
    fault, size
        Name in the catalogue, and size in its unit, or a range (low, high) in which it is drawn uniformly; by default
        no fault, and the usual size. Or a `Condition`, which also says where on the wheel's circumference it is.
    changes
        Values that differ from the site's passage, by their paths.
    seed
        Seed of the random numbers. Recording n does not depend on `count`. With a fault it has the same relative
        deviations of speed, height and so on as without.
    vary
        Whether the uncertain fields are drawn at random, about the faulty passage; otherwise they are as stated.
    noise
        Standard deviation of the samples' noise, m/s²; by default the sensor's.
    neighbour
        Wheelsets that pass with it: the spacing to a healthy one, m (positive ahead), or `Neighbour`.
    coupled
        Whether wheelsets react to the motion of the deck due to the others; otherwise they are superposed.
    progress
        As for `wheeltapper.simulate`.

    Returns
    -------
    list of Recording
        `truth` holds label, fault, size, place, scenario, neighbours, and the drawn values by path; where the trigger
        is uncertain also `time_zero`, s: when the wheel is at x = 0.
    """
    count, seed, noise = as_count(count, "count"), as_count(seed, "seed", 0), _noise_or_none(noise)
    check_flag(vary, "vary")
    check_flag(coupled, "coupled")
    site = as_site(site)
    stated = site.passage.replaced(as_table(changes, "changes", "values by path, or None"))
    warn_of((*doubts(stated), *site_notes(site)))
    condition, others = _condition_of(fault, size), neighbours_of(neighbour)
    out = []
    with progress_shown(progress, "recordings"):
        for number in range(count):
            random = np.random.default_rng([seed, number])
            relative = _relative_deviations(site, random) if vary else {}
            passage, truth = _drawn_passage(stated, condition, relative, random)
            truth |= _drawn_time_zero(site, random) if vary else {}
            beside = [
                _neighbour_passage(site, other, relative, np.random.default_rng([seed, number, 1 + i]))
                for i, other in enumerate(others)
            ]
            truth = {"label": condition.label, **truth}
            if others:
                truth["neighbours"] = [{"spacing": spacing, "scenario": scene} for spacing, scene in beside]
            out.append(_synthetic_recording(site, passage, beside, random, noise, coupled, truth))
            report("recordings", number + 1, count)
    return out


def _condition_of(fault: str | Condition | None, size: Any) -> Condition:
    """Return what is wrong with a wheelset."""
    if isinstance(fault, Condition) and size is not None:
        raise InputError("", "size", value_text(size), "none beside a Condition, which has its own")
    found = fault if isinstance(fault, Condition) else Condition(fault, size)
    if found.name is not None:
        check_text(found.name, "name")
    return found


def synthesise_train(
    site: Site | str | Path,
    axles: Sequence[str | Condition | None] | Mapping[int, str | Condition],
    *,
    count: int | None = None,
    positions: Sequence[float] | None = None,
    seed: int = 0,
    speed: float | None = None,
    vary: bool = True,
    noise: float | None = None,
    reach: float = REACH,
    coupled: bool = True,
    progress: Progress = True,
) -> list[Recording]:
    """Compute the recordings of a train's wheelsets, each cut around its own trigger.

    Speed, deck, rail and contact are the same for all wheelsets. The fields of the vehicle are drawn for each wheelset.

    Parameters
    ----------
    site
        The site, with its sensor and its uncertainties; or the path of its TOML file.
    axles
        Condition of each wheelset, beginning with the leading one: the name of a fault, a `Condition`, or None for a
        healthy one. Or only the faulty ones by number, from 1 to `count`.
    positions
        Distances of the wheelsets behind the first one, m, rising from 0; by default those of coaches ERRI B176.
    seed
        Seed of the random numbers.
    speed
        Measured speed, m/s; the true one differs from it by the stated uncertainty. None: no speed was measured, and
        the stated one is that of the site's passage.
    vary, noise, coupled, progress
        As for `synthesise`.
    reach
        Distance, m, beyond which the deck does not feel other wheelsets. Zero: each is alone on the deck.
    """
    site, seed, noise = as_site(site), as_count(seed, "seed", 0), _noise_or_none(noise)
    check_flag(vary, "vary")
    check_flag(coupled, "coupled")
    felt_up_to = to_si(reach, "length", "reach")
    if not felt_up_to >= 0.0:
        raise InputError("", "reach", value_text(reach), "0 m or more; infinite where all are felt")
    speed = None if speed is None else as_quantity(speed, "speed", "speed")
    conditions = _axle_conditions(axles, count)
    places = _axle_positions(positions, len(conditions))
    stated = site.passage if speed is None else site.passage.replaced({"speed": speed})
    warn_of((*doubts(stated), *site_notes(site)))
    shared = _relative_deviations(site, np.random.default_rng([seed])) if vary else {}
    generators = [np.random.default_rng([seed, i]) for i in range(len(conditions))]
    made = []
    for condition, random in zip(conditions, generators, strict=True):
        own = _relative_deviations(site, random) if vary else {}
        relative = {path: own[path] if path.startswith(OWN) else share for path, share in shared.items()}
        passage, truth = _drawn_passage(stated, condition, relative, random)
        made.append((passage, truth | (_drawn_time_zero(site, random) if vary else {})))
    out = []
    with progress_shown(progress, "wheelsets"):
        for i, (passage, truth) in enumerate(made):
            near = [j for j in range(len(made)) if j != i and abs(places[j] - places[i]) <= felt_up_to]
            beside = [(places[i] - places[j], made[j][0]) for j in near]
            truth = {"label": conditions[i].label, "axle": i + 1, "position": places[i], **truth}
            out.append(_synthetic_recording(site, passage, beside, generators[i], noise, coupled, truth, speed))
            report("wheelsets", i + 1, len(made))
    return out


def _axle_conditions(
    axles: Sequence[str | Condition | None] | Mapping[int, str | Condition], count: int | None
) -> list[Condition]:
    if isinstance(axles, Mapping):
        if count is None:
            raise InputError("", "count", "None", "how many wheelsets the train has, since only some are named")
        count = as_count(count, "count")
        wrong = next((number for number in axles if number not in range(1, count + 1)), None)
        if wrong is not None:
            raise InputError("", "axles", f"wheelset {wrong!r}", f"numbers from 1 to {count}")
        listed = [axles.get(number) for number in range(1, count + 1)]
    else:
        listed = as_list(axles, "axles", "what is wrong with each wheelset, as a list or by number")
    if not listed:
        raise InputError("", "axles", "none", "at least one wheelset")
    out = []
    for i, given in enumerate(listed, 1):
        if not (given is None or isinstance(given, str | Condition)):
            raise InputError("", f"axles.{i}", value_text(given), "a fault's name, a Condition, or None")
        known = given if isinstance(given, Condition) else Condition(None if given in (None, "healthy") else given)
        out.append(known)
    return out


def _axle_positions(given: Sequence[float] | None, count: int) -> list[float]:
    if given is None:
        return [COUPLED * (i // len(COACH)) + COACH[i % len(COACH)] for i in range(count)]
    what = f"{count} distances in m that rise from 0"
    listed = as_list(given, "positions", what)
    places = [to_si(place, "length", "positions") for place in listed]
    if len(places) != count or places[0] != 0.0 or not np.all(np.diff(places) > 0.0):
        raise InputError("", "positions", value_text(listed), what)
    return places


def _noise_or_none(given: Any) -> float | None:
    return None if given is None else as_quantity(given, "noise", "acceleration", positive=False)


# -- one passage ------------------------------------------------------------------------------------------------------


def _relative_deviations(site: Site, random: np.random.Generator) -> dict[str, float]:
    """Return drawn relative deviations of the uncertain fields from the stated values, by path."""
    return {path: share * float(random.standard_normal()) for path, share in site.uncertainty.items()}


def _drawn_passage(
    stated: Scenario, condition: Condition, relative: Mapping[str, float], random: np.random.Generator
) -> tuple[Scenario, dict[str, Any]]:
    """Return a wheelset's passage, and the true values of it."""
    fault, size, place = condition.drawn(random)
    passage = stated if fault is None else fault.passage(stated, size, 0.5 if place is None else place)
    drawn = {path: float(Fields(passage)(path)) * (1.0 + share) for path, share in relative.items()}
    scenario = passage.replaced(drawn) if drawn else passage
    return scenario, {"fault": condition.fault, "size": size, "place": place, "scenario": scenario, **drawn}


def _drawn_time_zero(site: Site, random: np.random.Generator) -> dict[str, float]:
    """Return the drawn time zero, s after the trigger; nothing where the trigger is exact."""
    if site.trigger is None:
        return {TIME_ZERO: SEARCHED * float(site.passage.duration) * float(random.uniform())}
    return {TIME_ZERO: site.trigger * float(random.standard_normal())} if site.trigger else {}


def _neighbour_passage(
    site: Site, other: Neighbour, relative: Mapping[str, float], random: np.random.Generator
) -> tuple[float, Scenario]:
    """Return a neighbour's spacing and passage; fields of the site are the same as for the wheelset of interest."""
    drawn = _relative_deviations(site, random)
    own = {path: drawn[path] if path.startswith(OWN) else share for path, share in relative.items()}
    return other.spacing, _drawn_passage(site.passage, other, own, random)[0]


def _synthetic_recording(
    site: Site, passage: Scenario, beside: Others, random: np.random.Generator, noise: float | None, coupled: bool,
    truth: dict[str, Any], speed: float | None = None,
) -> Recording:  # fmt: skip
    sensor, deck = site.sensor, deck_motion(passage, beside, coupled)
    zero = truth.get(TIME_ZERO, 0.0)
    count = int(np.floor((deck.end + zero) * sensor.rate * (1.0 + 1e-12))) + 1
    times = np.arange(count) / sensor.rate
    spread = sensor.noise * np.sqrt(0.5 * sensor.rate) if noise is None else noise
    samples, clipped = sensor.recorded(
        lambda at: deck.at(at - zero), times, spread * random.standard_normal(count)
    )  # fmt: skip
    return Recording(
        samples, float(sensor.rate), clipped=clipped, speed=speed, source=f"synthetic: {truth['label']}", truth=truth
    )

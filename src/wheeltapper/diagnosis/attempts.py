"""Fits of the faults that change more than mass, damping and load, each from its own starting models."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cache, partial
from itertools import chain
from math import ceil, pi, sqrt
from typing import NamedTuple

import numpy as np

from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.case import EXPLAINED, LEFT_OUT, Case, Stretch
from wheeltapper.diagnosis.faults.base import DAMPING, MASS, Fault
from wheeltapper.diagnosis.faults.flat import Flat, flat_starts, same_edge_starts
from wheeltapper.diagnosis.inference.estimate import priors_of
from wheeltapper.diagnosis.inference.fitting import (
    WINDOWS,
    Fit,
    departure_sample,
    fit_over_windows,
    width_of,
)
from wheeltapper.diagnosis.inference.problem import SURE
from wheeltapper.diagnosis.inference.search import NEAR, departs_at, near, ranked
from wheeltapper.diagnosis.inference.timing import zero_of
from wheeltapper.lower.fields import Fields

SPEEDS = 0.05
"""Spacing of the starting speeds, over the stated speed. It is used where a flat strikes at the onset, so that nothing
has determined the speed before."""
FIRM, FIRST = 1.8, (1.62, 1.26, 0.9, 0.54, 0.27)
"""Contact periods after the onset. If the fit of mass, damping and load explains less than FIRM, not even the first
impact, it does not show what came before a strike. A healthy wheelset is then fitted up to each of the times FIRST,
until one of these fits succeeds."""
EARLIER = 1.44
"""Contact periods from the start of the fit windows to the strike of a wheel's fault. The shortest window then ends
half a period after the strike: it holds the impact of the strike and nothing that follows from it."""
SHORTER = 0.25
"""If a healthy fit up to a strike is not clear, the time from the onset to its end is multiplied by SHORTER."""
LASTING = 5.4
"""Contact periods after the onset: three impacts at the example's site. If the fit of mass, damping and load explains
less than this, it has explained little: other families of faults than flats are then tried first. If it explains more,
but nothing explains the whole recording, a note says for how long."""
LONGEST = 2
"""Number of fits, those that explain longest, after which a stretch is left out to see what follows."""
APART = 0.15
"""Contact periods by which models at neighbouring speeds differ where their speed is to be determined."""
BESIDE, DOUBTFUL = 2, 1.5
"""Number of models near a fit from which it starts again, if it explains the recording but leaves more than noise by
DOUBTFUL standard deviations."""
PATIENTLY, NEAREST = 3, 4
"""Of a fault that is fitted alone, number of starts that are fitted again with patience, after hasty fits of all. Of
faults that are ranked together, number of the nearest starts that are fitted, besides the nearest of each."""


class Strike(NamedTuple):
    """A strike: its time, s after the trigger, and models of a healthy wheelset that explain the recording before it.

    It is `sure` if a healthy wheelset explains everything before it, and that is not little.
    """

    time: float
    models: list[Scenario]
    sure: bool


def try_flats(case: Case, strike: Strike | None) -> None:
    """Fit flats to a recording with a strike that mass, damping and load do not explain."""
    if strike is not None:
        case.struck = strike.sure and strike.time > case.after(LASTING)
        _fit_flats(case, strike.time, strike.models)


def try_flats_again(case: Case) -> None:
    """Fit flats that strike together with the site's irregularity, or whose first effect is small."""
    plain = case.fits["plain"]
    if case.moves_too_early:
        return
    if plain.held <= case.begins:
        try_flats(case, strike_at_onset(case))
        return
    held = min(plain.held, case.recording.times[-1]) - case.begins
    spans = (max(FIRM * case.scale.period, SHORTER**power * held) for power in (1, 2, 3))
    begun = (_up_to(case, case.passage, case.begins + span)[0] for span in spans)
    model = next((model for model in begun if model is not None), None)
    struck = np.nan if model is None else departs_at(case.fit_problem(case.passage, {}), model, case.begins)
    if model is not None and np.isfinite(struck):
        _fit_flats(case, struck, [model])


def _fit_flats(case: Case, struck: float, models: list[Scenario]) -> None:
    """Fit flats that strike at a given time; until then one of the given healthy models holds."""
    flats = [fault for fault in case.faults.values() if isinstance(fault, Flat)]
    if not flats:
        return
    healthy = case.fit_problem(case.passage, {})
    for round_ in (0, 1) if len(models) == 1 else (0,):
        patient = struck < case.after(LASTING) and not round_  # what comes before hardly determines speed
        starts = flat_starts(healthy, models, struck, flats, round_)
        longest, before = _first_explaining(case, starts, struck, patient), None
        while longest is not None and longest is not before and len(models) == 1 and not case.is_clear(longest[1]):
            flat, fit = before = longest
            since = fit.held if np.isfinite(fit.held) else struck
            begun = chain(
                _at_other_speeds(case, fit, struck, since), same_edge_starts(healthy, fit.scenario, flat, since)
            )
            others = ((flat, start) for start in begun)
            longest = _first_explaining(case, others, since, False, longest)
        if case.is_clear(case.best_fit):
            break
    for flat in flats:
        if flat.name in case.fits and case.fits[flat.name].reduced <= EXPLAINED:
            for other in flats:
                if other is not flat:
                    alike = other.resembling(case.fits[flat.name].scenario, flat)
                    if case.fit_fault(other, alike, struck, patient=False).held > struck:
                        case.fit_fault(other, alike, struck)
            break


def _first_explaining(
    case: Case,
    starts: Iterable[tuple[Flat, Scenario]],
    struck: float,
    patient: bool,
    longest: tuple[Flat, Fit] | None = None,
) -> tuple[Flat, Fit] | None:
    """Fit starting models until a fit is clear; return the fit that explains the longest part, with its kind."""
    for flat, start in starts:
        found = case.fit_fault(flat, start, struck - EARLIER * case.scale.period, patient)
        if longest is None or (found.held, -found.reduced) > (longest[1].held, -longest[1].reduced):
            longest = flat, found
        if case.is_clear(found):
            break
    return longest


def _at_other_speeds(case: Case, fit: Fit, struck: float, since: float) -> Iterator[Scenario]:
    """Yield models with the fit's flat, which struck when it did, at other speeds, the nearest to what follows first.

    A flat that strikes at the onset leaves the speed open until the site's irregularity is reached, or until the flat's
    next strike.
    """
    share = SURE * case.site.uncertainty.get("speed", 0.0)
    if struck > case.after(1.0) or not share:
        return
    begun, flat, stated = fit.scenario, fit.scenario.irregularities[-1], float(case.stated.passage.speed)
    speed, place = float(begun.speed), f"irregularity.{len(begun.irregularities) - 1}.position"
    own, turn = struck - zero_of(begun), 2.0 * pi * begun.vehicle.radius
    many = ceil(share * (since - zero_of(begun)) / (APART * case.scale.period))
    if many < 1:  # too short a time for speeds to differ
        return
    speeds = (stated * (1.0 + np.linspace(-share, share, 2 * many + 1))).tolist()
    tried = [
        begun.replaced({"speed": other, place: (float(flat.position) + (other - speed) * own) % turn})
        for other in speeds
    ]
    spans = (since + periods * case.scale.period for periods in (-FIRST[-1], WINDOWS[0]))
    yield from ranked(case.fit_problem(case.passage, {}), tried, *spans)[:NEAREST]


def strike_at_onset(case: Case) -> Strike:
    """Return a strike at the onset, with healthy models of several speeds: nothing has determined the speed yet."""
    share = 2.0 * case.site.uncertainty.get("speed", 0.0)
    speeds = float(case.passage.speed) * np.linspace(1.0 - share, 1.0 + share, 2 * int(share / SPEEDS) + 1)
    return Strike(case.begins, [case.passage.replaced({"speed": speed}) for speed in speeds.tolist()], False)


def strike_of(case: Case) -> Strike | None:
    """Return the strike of a wheelset that is healthy before it; None if no healthy model explains that part."""
    plain, healthy = case.fits["plain"], case.fit_problem(case.passage, {})
    if plain.held < case.after(FIRM):
        begun = (_up_to(case, case.passage, case.after(window))[0] for window in FIRST)
        model = next((model for model in begun if model is not None), None)
        struck = departs_at(healthy, model, case.begins) if model is not None else np.nan
        return None if model is None or not struck < case.after(WINDOWS[0]) else Strike(struck, [model], False)
    struck = departs_at(healthy, plain.scenario, plain.held)
    stated = {path: float(Fields(case.passage)(path)) for path in (MASS, DAMPING)}
    if not np.isfinite(struck):
        return None
    model, end = _up_to(case, plain.scenario.replaced(stated), struck)
    return None if model is None else Strike(struck, [model], end == struck)


def _up_to(case: Case, start: Scenario, end: float) -> tuple[Scenario | None, float]:
    """Return the healthy model that explains the recording up to `end`, and the time up to which it does.

    That time is earlier if the first effect of a flat is small: the wheel has nearly flown over it, and the strike that
    was noticed is its next one.
    """
    while True:
        whole = fit_over_windows(case.fit_problem(start, priors_of(case.stated)).until(end), case.begins)
        if np.isfinite(whole.held):
            return (whole.scenario if whole.held >= case.after(LASTING) else None), min(whole.held, end)
        earlier = case.begins + SHORTER * (end - case.begins)
        if case.is_clear(whole) or earlier < case.after(WINDOWS[0]):
            return whole.scenario, end
        end = earlier


class Throughout(NamedTuple):
    """Faults that act throughout a recording and are fitted together, and the models from which their fits start."""

    faults: list[Fault]
    begun: Callable[[], tuple[list[tuple[Fault, Scenario]], int]]  # which computes them when first called

    @property
    def starts(self) -> list[tuple[Fault, Scenario]]:
        """The models from which fits start, with their faults, the most likely first."""
        return self.begun()[0]

    @property
    def always(self) -> int:
        """How many of them are fitted in any case."""
        return self.begun()[1]

    @property
    def alone(self) -> bool:
        """Whether it is a fault that finds its starting models itself."""
        return self.faults[0].alone


def throughout(case: Case) -> list[Throughout]:
    """Return the faults that act throughout: those that the recording shows, those that are ranked together, others."""
    acting = [fault for fault in case.faults.values() if fault.acts == "throughout"]
    if case.moves_too_early:  # the wheel itself is the cause
        acting = [fault for fault in acting if fault.part == "wheel"]
    together = [fault for fault in acting if not fault.alone]
    groups = [Throughout(together, cache(partial(_ranked_starts, case, together)))] if together else []
    alone = [Throughout([one], cache(partial(_own_starts, case, one))) for one in acting if one.alone]
    problem = case.fit_problem(case.passage, {})
    seen = [group for group in alone if group.faults[0].seen(problem, case.begins)]
    return [*seen, *groups, *(group for group in alone if group not in seen)]


def _own_starts(case: Case, fault: Fault) -> tuple[list[tuple[Fault, Scenario]], int]:
    """Return what the fault finds from the plain fit if that explains the recording nearly, or from the passage."""
    plain, healthy = case.fits["plain"], (MASS, DAMPING)
    stated = {path: float(Fields(case.passage)(path)) for path in healthy}
    if np.isfinite(plain.held):
        problem = case.fit_problem(case.passage, priors_of(case.stated))
    else:
        problem = case.fit_problem(plain.scenario, priors_of(case.stated, healthy))
    return [(fault, start.replaced(stated)) for start in fault.starts(problem, case.begins)], 0


def _ranked_starts(case: Case, faults: list[Fault]) -> tuple[list[tuple[Fault, Scenario]], int]:
    """Return faulty passages in the order of their misfit to the recording's beginning, behind those that it shows.

    They are made from a fit near the beginning, and from the plain fit if that explains anything. The best one of each
    fault from each of these comes before all others, because the faults look similar at the beginning. It is fitted in
    any case, and so are those that the recording shows.
    """
    plain, healthy = case.fits["plain"], (MASS, DAMPING)
    loose = case.fit_problem(case.passage, priors_of(case.stated, healthy))
    begun = [loose.model_at(near(loose, case.begins)[0]), *([plain.scenario] if plain.held > case.begins else [])]
    stated = {path: float(Fields(case.passage)(path)) for path in healthy}
    models = [model.replaced(stated) for model in begun]
    kinds = {
        start: (fault, number)
        for number, model in enumerate(models)
        for fault in faults
        for start in fault.tried(model, case.scale)
    }
    order = ranked(case.fit_problem(case.passage, {}), kinds, case.begins, case.after(NEAR[-1]))
    first = [start for i, start in enumerate(order) if kinds[start] not in {kinds[nearer] for nearer in order[:i]}]
    known = case.fit_problem(case.passage, priors_of(case.stated))
    shown = [(fault, start) for fault in faults for start in fault.shown(known, case.begins)]
    nearest = [*first, *(one for one in order[:NEAREST] if one not in first)]
    return [*shown, *((kinds[start][0], start) for start in nearest)], len(shown) + len(first)


def try_mistaken(case: Case) -> None:
    """Fit hastily what a plain fit may have been mistaken for, from the nearest start on until one is explained."""
    found, problem = case.fits["plain"].scenario, case.fit_problem(case.passage, {})
    for fault in case.faults.values():
        starts = fault.mistaken(case.passage, found)
        for start in ranked(problem, starts, case.begins, case.after(NEAR[-1])):
            if case.fit_fault(fault, start, case.begins, patient=False).reduced <= EXPLAINED:
                break


def try_hastily(case: Case, group: Throughout) -> None:
    """Fit faults without patience: of those that are ranked together only the nearest of each, whatever it explains."""
    _fit_starts(case, group.starts if group.alone else group.starts[: group.always], group.always, patient=False)


def try_patiently(case: Case, group: Throughout) -> None:
    """Fit faults with patience until one explains the recording; of a fault that is alone, from the first starts."""
    _fit_starts(case, group.starts[:PATIENTLY] if group.alone else group.starts, 0, patient=True)


def _fit_starts(case: Case, starts: list[tuple[Fault, Scenario]], always: int, patient: bool) -> None:
    """Fit faults until one explains the recording, but each fault of the first `always` starts in any case."""
    for number, (fault, start) in enumerate(starts):
        if number >= always and case.is_clear(case.best_fit):
            return
        if case.is_clear(case.fits.get(fault.name)):
            continue
        begins = case.after(-EARLIER if fault.part == "wheel" else 0.0)
        found = case.fit_fault(fault, start, begins, patient)
        if 1.0 + DOUBTFUL * sqrt(2.0 / max(found.freedom, 1)) < found.reduced <= EXPLAINED:
            problem, end = case.fit_problem(case.passage, {}), float(case.recording.times[-1])
            for other in ranked(problem, fault.beside(found.scenario), case.begins, end)[:BESIDE]:
                case.fit_fault(fault, other, begins, patient=False)


def unexplained_stretches(case: Case) -> list[tuple[str, Stretch]]:
    """Return the stretches that may keep the fits that explain longest from explaining more, and whose fits they are.

    A stretch lies at the end of the recording, or what follows it is longer, and silence does not explain that: only
    then does it show that the fit is right there again.
    """
    times, out = case.recording.times, list[tuple[str, Stretch]]()
    most = int(LEFT_OUT * len(times))
    for name, fit in sorted(case.fits.items(), key=lambda item: -item[1].held)[:LONGEST]:
        problem = case.fit_problem(fit.scenario, {})
        off = problem.residuals(np.empty(0), len(times))
        if off is None or not np.isfinite(fit.held):
            continue
        width = width_of(problem)
        held = max(int(np.searchsorted(times, fit.held)) - width, 0)
        first = max(departure_sample(off, case.noise, width, held) - width, 0)
        last = min(first + most, len(times)) - 1
        rest = case.recording.samples[last + 1 :]
        if not len(rest) or (len(rest) > most and np.nansum(rest**2) > EXPLAINED * len(rest) * case.noise**2):
            out.append((name, Stretch(float(times[first]), float(times[last]))))
    return out

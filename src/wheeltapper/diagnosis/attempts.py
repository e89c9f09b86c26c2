"""Fits of the faults that change more than mass, damping and load, each from its own starting models."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import sqrt
from typing import NamedTuple

import numpy as np

from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.case import EXPLAINED, Case, well
from wheeltapper.diagnosis.faults import PLAIN
from wheeltapper.diagnosis.inference.fitting import WINDOWS, Fit, solve
from wheeltapper.diagnosis.inference.identify import beliefs
from wheeltapper.diagnosis.inference.search import (
    damper_starts,
    departs_at,
    flat_starts,
    harmonic_starts,
    near,
    resembling,
    same_edge_starts,
)
from wheeltapper.lower.fields import Fields

SPEEDS = 0.05
"""Spacing of the starting speeds, over the stated speed. It is used where a flat strikes at the onset, so that nothing
has determined the speed before."""
FIRM, FIRST = 0.01, (0.009, 0.007, 0.005, 0.003, 0.0015)
"""Times after the onset, s. If the fit of mass, damping and load explains less than FIRM, it does not show what came
before a strike. A healthy wheelset is then fitted up to each of the times FIRST, until one of these fits succeeds."""
EARLIER = 0.008
"""Time from the start of the fit windows to the strike of a wheel's fault, s. The shortest window, 11 ms, then ends 3
ms after the strike."""
CLEARLY, SHORTER = 4.0, 0.25
"""A fit is clear if χ² per degree of freedom exceeds one by at most CLEARLY standard deviations of that ratio, which is
√(2/degrees of freedom) for normal noise. If a healthy fit up to a strike is not clear, the time from the onset to its
end is multiplied by SHORTER."""
LASTING = 0.03
"""Time after the onset, s. If the fit of mass, damping and load explains less than this, it has explained little: other
families of faults than flats are then tried first. If it explains more, but nothing explains the whole recording, a
note says for how long."""
PATIENTLY = 3
"""Number of orders of a wheel out of round that are fitted again with patience, after hasty fits of all of them."""
FLATS, DAMPER_ENDS = ("wheel flat", "rounded flat"), ("free play", "soft bush")
"""Names of the faults that are fitted together: the flats, and the faults of the damper's end."""


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
        _fit_flats(case, strike.time, strike.models)


def try_flats_again(case: Case) -> None:
    """Fit flats that strike together with the site's irregularity, or whose first effect is small."""
    plain = case.fits["plain"]
    if case.early:
        return
    if plain.held <= case.begins:
        try_flats(case, strike_at_onset(case))
        return
    held = min(plain.held, case.recording.times[-1]) - case.begins
    spans = (max(FIRM, SHORTER**power * held) for power in (1, 2, 3))
    begun = (_up_to(case, case.passage, case.begins + span)[0] for span in spans)
    model = next((model for model in begun if model is not None), None)
    struck = np.nan if model is None else departs_at(case.problem(case.passage, {}), model, case.begins)
    if model is not None and np.isfinite(struck):
        _fit_flats(case, struck, [model])


def _fit_flats(case: Case, struck: float, models: list[Scenario]) -> None:
    """Fit flats that strike at a given time; until then one of the given healthy models holds."""
    made = {name: case.faults[name].made for name in FLATS if name in case.faults}
    if not made:
        return
    case.struck = struck > case.begins + LASTING
    healthy = case.problem(case.passage, {})
    for round_ in (0, 1) if len(models) == 1 else (0,):
        patient = struck < case.begins + LASTING and not round_  # what comes before hardly determines speed
        starts = flat_starts(healthy, models, struck, made, round_)
        longest, before = _first_explaining(case, starts, struck, patient), None
        while longest is not None and longest is not before and len(models) == 1 and not _clear(longest[1]):
            name, fit = before = longest
            since = fit.held if np.isfinite(fit.held) else struck
            others = ((name, start) for start in same_edge_starts(healthy, fit.scenario, name, since, made))
            longest = _first_explaining(case, others, since, False, longest)
        if well(case.best):
            break
    for name in made:
        if name in case.fits and case.fits[name].reduced <= EXPLAINED:
            for other in made.keys() - {name}:
                alike = resembling(case.fits[name].scenario, name, other, made)
                if case.fit(other, alike, struck, patient=False).held > struck:
                    case.fit(other, alike, struck)
            break


def _first_explaining(
    case: Case,
    starts: Iterable[tuple[str, Scenario]],
    struck: float,
    patient: bool,
    longest: tuple[str, Fit] | None = None,
) -> tuple[str, Fit] | None:
    """Fit starting models until a fit is clear; return the fit that explains the longest part, with its name."""
    for name, start in starts:
        found = case.fit(name, start, struck - EARLIER, patient)
        if longest is None or (found.held, -found.reduced) > (longest[1].held, -longest[1].reduced):
            longest = name, found
        if _clear(found):
            break
    return longest


def _clear(fit: Fit) -> bool:
    """Return True if a fit leaves no more than the stated noise; a neighbouring minimum would leave more."""
    return fit.reduced <= 1.0 + CLEARLY * sqrt(2.0 / max(fit.freedom, 1))


def strike_at_onset(case: Case) -> Strike:
    """Return a strike at the onset, with healthy models of several speeds: nothing has determined the speed yet."""
    share = 2.0 * case.site.uncertainty.get("speed", 0.0)
    speeds = float(case.passage.speed) * np.linspace(1.0 - share, 1.0 + share, 2 * int(share / SPEEDS) + 1)
    return Strike(case.begins, [case.passage.replaced({"speed": speed}) for speed in speeds.tolist()], False)


def strike_of(case: Case) -> Strike | None:
    """Return the strike of a wheelset that is healthy before it; None if no healthy model explains that part."""
    plain, healthy = case.fits["plain"], case.problem(case.passage, {})
    if plain.held < case.begins + FIRM:
        begun = (_up_to(case, case.passage, case.begins + window)[0] for window in FIRST)
        model = next((model for model in begun if model is not None), None)
        struck = departs_at(healthy, model, case.begins) if model is not None else np.nan
        return None if model is None or not struck < case.begins + WINDOWS[0] else Strike(struck, [model], False)
    struck = departs_at(healthy, plain.scenario, plain.held)
    stated = {path: float(Fields(case.passage)(path)) for path in PLAIN[:2]}
    if not np.isfinite(struck):
        return None
    model, end = _up_to(case, plain.scenario.replaced(stated), struck)
    return None if model is None else Strike(struck, [model], end == struck)


def _up_to(case: Case, start: Scenario, end: float) -> tuple[Scenario | None, float]:
    """Return the healthy model that explains the recording up to `end`, and the time up to which it does.

    That time is earlier if the first effect of a flat is small, so that the strike was noticed late.
    """
    while True:
        whole = solve(case.problem(start, beliefs(case.stated)).until(end), case.begins)
        if np.isfinite(whole.held):
            return None, end
        earlier = case.begins + SHORTER * (end - case.begins)
        if _clear(whole) or earlier < case.begins + WINDOWS[0]:
            return whole.scenario, end
        end = earlier


Starts = Callable[[], list[tuple[str, Scenario]]]
"""A function that returns names of faults and starting models with these faults; it computes them when called."""


def damper_end_starts(case: Case) -> list[tuple[str, Scenario]]:
    """Return starting models with free play or a bush: the nearest of each kind first."""
    names = [name for name in DAMPER_ENDS if name in case.faults]
    if not names:
        return []
    loose = case.problem(case.passage, beliefs(case.stated, PLAIN[:2]))
    at, _ = near(loose, case.begins)
    stated = {path: float(Fields(case.passage)(path)) for path in PLAIN[:2]}
    model = loose.scenario(at).replaced(stated)
    family = case.problem(model, {})
    return [*damper_starts(family, model, case.begins, {name: case.faults[name].made for name in names})]


def try_damper_ends(case: Case, starts: Starts, patient: bool) -> None:
    """Fit dampers with free play or a bush; without patience, only the nearest of each."""
    each = len({name for name, _ in starts()})
    for name, start in starts() if patient else starts()[:each]:
        if not (patient and well(case.best)):
            case.fit(name, start, case.begins, patient)


def out_of_round_starts(case: Case) -> list[tuple[str, Scenario]]:
    """Return starting models of wheels that are out of round, those of the most likely orders first."""
    if "out of round" not in case.faults:
        return []
    starts = harmonic_starts(case.problem(case.passage, beliefs(case.stated)), case.begins)
    return [("out of round", start) for start in starts]


def try_harmonics(case: Case, starts: Starts, patient: bool) -> None:
    """Fit wheels that are out of round; with patience, only the first PATIENTLY orders."""
    for name, start in starts()[:PATIENTLY] if patient else starts():
        case.fit(name, start, case.begins - EARLIER, patient)
        if well(case.best):
            return

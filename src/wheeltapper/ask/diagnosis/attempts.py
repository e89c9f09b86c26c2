"""Fits of the faults that mass, damping and load do not explain, each from starts of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from math import sqrt
from typing import NamedTuple

import numpy as np

from wheeltapper.ask.diagnosis.case import EXPLAINED, Case, well
from wheeltapper.ask.diagnosis.faults import PLAIN
from wheeltapper.ask.diagnosis.fitting import WINDOWS, Fit, solve
from wheeltapper.ask.diagnosis.identify import beliefs
from wheeltapper.ask.diagnosis.search import (
    damper_starts,
    departs_at,
    flat_starts,
    harmonic_starts,
    near,
    resembling,
    same_edge_starts,
)
from wheeltapper.describe.scenario import Scenario
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
    """When something strikes a wheelset, s after the trigger, that was healthy up to then; models of it up to then.

    It is `sure` where a healthy wheelset explains all that came before, and that is not little.
    """

    time: float
    models: list[Scenario]
    sure: bool


def try_flats(case: Case, strike: Strike | None) -> None:
    """Fit flats, from where something strikes that mass, damping and load do not explain."""
    if strike is not None:
        _fit_flats(case, strike.time, strike.models)


def try_flats_again(case: Case) -> None:
    """Fit flats that strike together with the site's irregularity, or that are hardly felt at first."""
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
    """Fit flats that strike one of some healthy wheelsets at some time."""
    made = {name: case.faults[name].made for name in FLATS if name in case.faults}
    if not made:
        return
    case.struck = struck > case.begins + LASTING
    healthy = case.problem(case.passage, {})
    for round_ in (0, 1) if len(models) == 1 else (0,):
        patient = struck < case.begins + LASTING and not round_  # little has determined speed and load before
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
    """Fit starts up to the first that explains the recording clearly; return the fit that explains it the longest."""
    for name, start in starts:
        found = case.fit(name, start, struck - EARLIER, patient)
        if longest is None or (found.held, -found.reduced) > (longest[1].held, -longest[1].reduced):
            longest = name, found
        if _clear(found):
            break
    return longest


def _clear(fit: Fit) -> bool:
    """Return True where a fit leaves no more than noise that is as stated: a neighbouring minimum may leave more."""
    return fit.reduced <= 1.0 + CLEARLY * sqrt(2.0 / max(fit.freedom, 1))


def strike_at_onset(case: Case) -> Strike:
    """Return when the recording begins, and healthy wheelsets of several speeds, since the speed is not known yet."""
    share = 2.0 * case.site.uncertainty.get("speed", 0.0)
    speeds = float(case.passage.speed) * np.linspace(1.0 - share, 1.0 + share, 2 * int(share / SPEEDS) + 1)
    return Strike(case.begins, [case.passage.replaced({"speed": speed}) for speed in speeds.tolist()], False)


def strike_of(case: Case) -> Strike | None:
    """Return when something strikes a wheelset that was healthy up to then; None where it was not."""
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
    """Return the healthy wheelset that explains the recording up to some time, and that time.

    It is earlier where a flat is hardly felt.
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
"""Names of faults and passages with them, found when they are asked for."""


def damper_end_starts(case: Case) -> list[tuple[str, Scenario]]:
    """Return dampers with play at their ends, or with a bush, first the nearest of each."""
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
    """Fit dampers with an end of their own; without patience, the nearest of each only."""
    each = len({name for name, _ in starts()})
    for name, start in starts() if patient else starts()[:each]:
        if not (patient and well(case.best)):
            case.fit(name, start, case.begins, patient)


def out_of_round_starts(case: Case) -> list[tuple[str, Scenario]]:
    """Return wheels that are out of round, those of the likeliest orders first."""
    if "out of round" not in case.faults:
        return []
    starts = harmonic_starts(case.problem(case.passage, beliefs(case.stated)), case.begins)
    return [("out of round", start) for start in starts]


def try_harmonics(case: Case, starts: Starts, patient: bool) -> None:
    """Fit wheels that are out of round; with patience, of few orders only."""
    for name, start in starts()[:PATIENTLY] if patient else starts():
        case.fit(name, start, case.begins - EARLIER, patient)
        if well(case.best):
            return

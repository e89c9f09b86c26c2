"""From one recording to a finding: which fault explains it, how large it is, and what else would explain it as well.

plain   One fit with mass, damping and load free serves all faults that change only these; their priors distinguish
        them.
others  If that does not explain the recording, other families are fitted until one does: flats about a strike, faults
        that act throughout the recording, and flats whose strike is hard to locate.

See docs/theory/diagnosis.rst, sections 8.6 and 8.7.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.attempts import (
    LASTING,
    strike_at_onset,
    strike_of,
    throughout,
    try_flats,
    try_flats_again,
    try_hastily,
    try_mistaken,
    try_patiently,
    unexplained_stretches,
)
from wheeltapper.diagnosis.case import EXPLAINED, Case, feels_load
from wheeltapper.diagnosis.faults.base import CATALOGUE, DAMPING, LOAD, MASS, PLAIN, Fault
from wheeltapper.diagnosis.finding import HEALTHY, NO_WHEEL, NOT_EXPLAINED, Finding
from wheeltapper.diagnosis.inference.estimate import estimate_of, priors_of, recorded_at
from wheeltapper.diagnosis.inference.fitting import (
    HOLDS,
    LAST_STEPS,
    Fit,
    fit_over_windows,
    fit_summary,
    fit_window,
    keeps_step,
)
from wheeltapper.diagnosis.inference.problem import Prior
from wheeltapper.diagnosis.inference.search import misfit, ranked
from wheeltapper.diagnosis.inference.timing import untimed, zero_of
from wheeltapper.diagnosis.measured import Forces, forces_with_unexplained, measured_forces
from wheeltapper.ground.arguments import as_quantity
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.progress import Progress, progress_shown, report
from wheeltapper.ground.warned import ModelWarning
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.plausible import site_notes
from wheeltapper.record.recordings.recording import Recording
from wheeltapper.record.simulate import simulate

FloatArray = NDArray[np.float64]

FAULTY = 0.1
"""Prior probability that a wheelset has a fault. It is divided equally among the faults of the catalogue."""
ALIKE = 0.05
"""Another fault is listed as not excluded if its posterior probability is at least this share of that of the
verdict."""
BASIN = 3.6
"""Contact periods after the onset: two impacts at the example's site. A fit of mass, damping and load that explains
more than this is near the right minimum, and no other starting values are tried."""
BEGINNING, SPEEDS, STARTS = (-0.18, 2.52), 0.025, 4
"""Other starting values of mass, damping, load and speed are ranked by the recording from just before the onset to the
first impact's end, in contact periods after the onset.
Neighbouring speeds differ by about the share SPEEDS. The best STARTS of them are fitted."""
SOONER = 1.08
"""Contact periods by which the windows of the second fit begin before the onset. Its shortest window then ends 0.9
periods after the onset and before the first impact: it determines the speed alone."""
UNSEEN = 2.7
"""Change of χ² below which the recording does not tell two models apart: it is exceeded once in ten at the true one."""
VAGUE = 0.3
"""Standard deviation of the logarithm of a field. Above it the likelihood is taken as normal in the field itself
instead of its logarithm, and the size of a fault is given as an interval without a value."""


def diagnose(
    recording: Recording | str | Path, site: Site | str | Path, *, faults: Sequence[str] | None = None,
    noise: float | None = None, speed: float | None = None, progress: Progress = True,
) -> Finding:  # fmt: skip
    """Find what is wrong with a wheelset from the recording of its passage.

    Parameters
    ----------
    recording
        The deck's acceleration, or the path of its file.
    site
        The site of the recording, with the uncertainties of the site and of a healthy wheelset; or the path of its TOML
        file.
    faults
        Names of the catalogue's faults to compare; by default all.
    noise
        Standard deviation of the samples' noise, m/s². By default it is that of the sensor, or it is estimated from the
        recording. The misfit that the site states is added to it.
    speed
        Measured speed, m/s; its error is the site's uncertainty of the speed. By default that of the recording, or else
        that of the site.
    progress
        As for `wheeltapper.simulate`.

    Raises
    ------
    InputError
        If the recording is no acceleration, too short, or of another sample rate than the site's sensor has.
    """
    recording, site, spread = recorded_at(recording, site, noise)
    if speed is not None:
        recording = replace(recording, speed=as_quantity(speed, "speed", "speed"))
    spread = float(np.hypot(spread, site.misfit * np.sqrt(np.nanmean(recording.samples**2))))
    if not spread > 0.0:
        raise InputError(recording.source, "sensor.noise", "samples without noise", "a sensor with its noise stated")
    case = Case(recording, site, faults, spread)
    if not _has_wheel(recording, spread):
        return _no_wheel_finding(recording, site, spread)
    with progress_shown(progress, "fitting"):
        report("fitting", 0.0, 0.0)
        _fit_families(case)
        return _finding_of(case if case.is_explained else _explained_without_stretch(case) or case)


def _fit_families(case: Case) -> None:
    """Fit one family of models after the other until one explains the recording."""
    _try_plain(case)
    for attempt in _attempts_in_order(case):
        if not case.is_clear(case.best_fit) and not case.struck:
            attempt(case)
    if case.is_explained and not case.is_clear(case.fits["plain"]):
        _try_plain_again(case)
    if case.is_clear(case.fits["plain"]):
        try_mistaken(case)


def _explained_without_stretch(case: Case) -> Case | None:
    """Return the case without one stretch, of a recording that a model explains but for this stretch; or None."""
    for name, stretch in unexplained_stretches(case):
        rest, best = case.excluding(stretch), case.fits[name].scenario
        if name in rest.faults:
            rest.fit_fault(rest.faults[name], best, rest.begins)
        else:
            _fit_plain(rest, [(best, rest.begins)])
        if rest.fits[name].held > stretch.end + case.scale.period:
            _fit_families(rest)
            if rest.is_explained:
                return rest
    return None


def _attempts_in_order(case: Case) -> tuple[Callable[[Case], None], ...]:
    """Return the fits of other families in the order in which they are tried.

    If mass and damping explain little, faults that act throughout are fitted before flats: hastily, and later with
    patience. If they explain much, faults that find their starts themselves get no patience: their best starts are
    clear then. A wheel that moves the deck too early, but only after it has rolled on it, has struck.
    """
    if case.is_clear(case.best_fit):
        return ()
    strike = strike_at_onset(case) if case.moves_too_early else strike_of(case)
    flats, groups = partial(try_flats, strike=strike), throughout(case)
    hasty, patient = ([partial(fit, group=group) for group in groups] for fit in (try_hastily, try_patiently))
    if case.moves_too_early:
        return (flats, *hasty, *patient) if case.strikes_on_deck else (*hasty, *patient, flats)
    if case.fits["plain"].held < case.after(LASTING) and not (strike and strike.sure):
        return *hasty, _try_plain_elsewhere, flats, *patient, try_flats_again
    again = (fit for group, fit in zip(groups, patient, strict=True) if not group.alone)
    return flats, *hasty, *again, try_flats_again


def _has_wheel(recording: Recording, noise: float) -> bool:
    """Return True if enough samples exceed the noise for a wheel to have passed."""
    loud = np.abs(np.nan_to_num(recording.samples)) > 6.0 * noise
    return bool(loud.sum() >= 8)


def _no_wheel_finding(recording: Recording, site: Site, noise: float) -> Finding:
    largest = float(np.nanmax(np.abs(recording.samples)))
    said = *site_notes(site), *recording.notes
    note = f"the largest sample is {largest:.3g} m/s², {largest / noise:.2g} deviations of the noise"
    nan = np.nan
    return Finding(
        NO_WHEEL, {}, None, nan, nan, (nan, nan), (), nan, nan, nan, 0, (note, *said), recording, site, noise
    )  # fmt: skip


# -- faults that change mass, damping and load only -------------------------------------------------------------------


def _try_plain(case: Case) -> None:
    """Fit mass, damping and load; compute the evidence of health and of the plain faults."""
    begun = case.passage_with_measured_load
    _fit_plain(case, ((begun, begins) for begins in (case.begins, case.after(-SOONER))))


def _try_plain_elsewhere(case: Case) -> None:
    """Fit mass, damping and load from other starting values, ranked by the beginning of the recording."""
    begun, share = case.passage_with_measured_load, 2.5 * case.site.uncertainty.get("speed", 0.0)
    speeds = float(case.passage.speed) * np.linspace(1.0 - share, 1.0 + share, 2 * int(share / SPEEDS) + 1)
    others = [begun, *(fault.passage(begun) for fault in CATALOGUE.values() if fault.far)]
    tried = [other.replaced({"speed": speed}) for other in others for speed in speeds.tolist()]
    problem = case.fit_problem(case.passage, priors_of(case.stated, _plain_paths(case)))
    nearest = ranked(problem, tried, *map(case.after, BEGINNING))
    _fit_plain(case, ((start, case.begins) for start in nearest[:STARTS]))


def _fit_plain(case: Case, starts: Iterable[tuple[Scenario, float]]) -> None:
    """Fit from starting models, each with the time at which its windows begin, until one fit is good enough."""
    priors, found = priors_of(case.stated, _plain_paths(case)), case.fits.get("plain")
    for start, begins in starts:
        if found is not None and (found.reduced <= EXPLAINED or found.held > case.after(BASIN) or case.moves_too_early):
            break
        trial = fit_over_windows(case.fit_problem(start, priors), begins)
        if found is None or (trial.held, -trial.chi_squared) > (found.held, -found.chi_squared):
            found = trial
    assert found is not None
    _weigh_plain(case, found)


def _try_plain_again(case: Case) -> None:
    """Start the plain fit from the result of another family, so that no fault of negligible size is named."""
    assert case.best_fit is not None
    priors = priors_of(case.stated, _plain_paths(case))
    values = {path: float(Fields(case.best_fit.scenario)(path)) for path in priors}
    problem = case.fit_problem(case.passage.replaced(values), priors)
    if keeps_step(problem, case.begins):
        trial = fit_over_windows(problem, case.begins, patient=False)
        if trial.reduced <= EXPLAINED:
            _weigh_plain(case, trial)


def _plain_paths(case: Case) -> tuple[str, ...]:
    told = [path for path in PLAIN if path != LOAD or feels_load(case.passage)]
    return tuple(path for path in told if float(Fields(case.passage)(path)) > 0.0)


def _weigh_plain(case: Case, found: Fit) -> None:
    """Compute the evidence of health and of the plain faults from one fit and their priors."""
    unknown = _plain_paths(case)
    case.fits["plain"] = found
    for name in (HEALTHY, *(name for name, fault in case.faults.items() if fault.plain and fault.path in unknown)):
        case.evidence[name] = found.evidence + _log_marginal_likelihood(case, case.faults.get(name), found, unknown)


def _log_marginal_likelihood(case: Case, fault: Fault | None, found: Fit, unknown: tuple[str, ...]) -> float:
    """Return the logarithm of the marginal likelihood of a fault over the plain fields, relative to the fit.

    The likelihood is normal in the logarithms of the fields. For a field that is nearly zero (a lost damper) it is
    normal in the field itself.
    """
    passage = case.passage if fault is None else fault.passage(case.passage)
    believed = {} if fault is None else fault.believed(case.passage)
    many = len(unknown)
    if not np.all(np.isfinite(found.covariance)):
        return 0.0  # the recording does not determine some field
    vague = np.sqrt(np.diag(found.covariance)[:many]) > VAGUE
    away, scales, variances = np.empty(many), np.ones(many), np.empty(many)
    for i, path in enumerate(unknown):
        prior, value, stated = believed.get(path), found.values[i], float(Fields(case.passage)(path))
        centre = prior.centre if prior else float(Fields(passage)(path))
        share = prior.deviation if prior else case.site.uncertainty.get(path, 0.0)
        away[i] = (value - centre) / stated if vague[i] else np.log(value / centre)
        scales[i] = value / stated if vague[i] else 1.0
        variances[i] = (share * (centre / stated if vague[i] else 1.0)) ** 2
    return _log_normal_density(away, found.covariance[:many, :many] * np.outer(scales, scales) + np.diag(variances))


def _log_normal_density(away: FloatArray, covariance: FloatArray) -> float:
    """Return the logarithm of a normal density."""
    size = float(np.linalg.slogdet(2.0 * np.pi * covariance)[1])
    return -0.5 * (size + float(away @ np.linalg.solve(covariance, away)))


# -- the verdict ------------------------------------------------------------------------------------------------------


def _finding_of(case: Case) -> Finding:
    each = FAULTY / len(CATALOGUE)
    weights = {
        name: evidence + np.log(1.0 - FAULTY if name == HEALTHY else each) for name, evidence in case.evidence.items()
    }
    explaining = [name for name in weights if case.fits.get(name, case.fits["plain"]).reduced <= EXPLAINED]
    compared = {name: weights[name] for name in explaining or weights}
    top = max(compared.values())
    whole = {name: float(np.exp(weight - top)) for name, weight in compared.items()}
    total = sum(whole.values())
    probabilities = {name: value / total for name, value in sorted(whole.items(), key=lambda item: -item[1])}
    best = next(iter(probabilities))
    fit = case.fits.get(best, case.fits["plain"])
    verdict = best if fit.reduced <= EXPLAINED else NOT_EXPLAINED
    fit = _with_unseen(case, verdict, fit)
    estimate = estimate_of(fit, case.noise)
    alike = tuple(name for name, p in probabilities.items() if name != best and p >= ALIKE * probabilities[best])
    alike += tuple(name for name, fault in case.faults.items() if name not in alike and fault.also(verdict, estimate))
    size, interval = _size_of(case, verdict, fit)
    forces, seen = _model_forces(case, fit)
    if verdict == NOT_EXPLAINED:
        # What nothing explains need not be what the site says it is: its noise tells no error.
        forces, alike = measured_forces(case)._replace(deviation=np.nan), ()
    elif case.omitted is not None:
        forces = forces_with_unexplained(case, forces)
    return Finding(
        verdict, probabilities, None if verdict == NOT_EXPLAINED else estimate, fit.reduced, size, interval, alike,
        forces.speed, forces.static, forces.largest, forces.impacts,
        (*case.whole.notes, *_finding_notes(case), *forces.notes), case.whole, case.site, case.noise, weights,
        forces.source, seen, forces.deviation,
    )  # fmt: skip


def _model_forces(case: Case, fit: Fit) -> tuple[Forces, FloatArray]:
    """Return the forces of the best model, and the acceleration that the sensor shows of it."""
    times, sensor = case.recording.times, case.site.sensor
    own = np.maximum(times - zero_of(fit.scenario), 0.0)  # at zero the deck is at rest
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)  # what is implausible is in the notes of the finding
        record = simulate(untimed(fit.scenario).replaced({"duration": float(own[-1])}))
    shown = sensor.drifted(sensor.filtered(record.at(own).deck_acceleration.values), times)
    largest = float(record.peaks.normal_force.max()) if record.peaks.sizes["peak"] else record.static_force
    impacts = record.impacts.sizes["impact"]
    return Forces(float(fit.scenario.speed), record.static_force, largest, impacts, "model", notes=record.notes), shown


def _with_unseen(case: Case, verdict: str, fit: Fit) -> Fit:
    """Return a fit of a model with as small a misfit whose derivatives tell what the recording does not show.

    The prior may have drawn a fit to where such a thing just begins to be seen; its derivatives are misleading there.
    """
    if verdict not in case.faults:
        return fit
    fault, end = case.faults[verdict], float(case.recording.times[-1])
    believed = priors_of(case.stated) | fault.believed(case.passage)
    healthy = case.fit_problem(case.passage, {})
    alike = ranked(healthy, fault.unseen(fit.scenario), case.begins, end)
    if not alike or misfit(healthy, alike[0], case.begins, end) > HOLDS * case.noise**2:
        return fit
    free = {path: prior if prior.kind == "uniform" else Prior(1.0) for path, prior in believed.items()}
    problem = case.fit_problem(alike[0], free | priors_of(case.stated))
    at, converged = fit_window(problem, np.zeros(len(free)), len(problem.times), case.noise, LAST_STEPS)
    problem = case.fit_problem(problem.model_at(at), believed)
    other = fit_summary(problem, np.zeros(len(believed)), converged, len(problem.times))
    return other if other.misfit <= fit.misfit + UNSEEN else fit


def _size_of(case: Case, verdict: str, fit: Fit) -> tuple[float, tuple[float, float]]:
    nan = (np.nan, (np.nan, np.nan))
    if verdict not in case.faults:
        return nan
    fault = case.faults[verdict]
    path = fault.path.replace(".-1.", f".{len(case.passage.irregularity)}.")
    estimate = estimate_of(fit, case.noise)
    if path not in estimate.paths:
        return nan
    value, (low, high) = estimate[path], estimate.interval(path)
    if not fault.plain:
        return value if estimate.deviation(path) < VAGUE else np.nan, (low, high)
    held = float(Fields(case.passage)(path))
    return fault.size_of(value, held), (fault.size_of(low, held), fault.size_of(high, held))


def _finding_notes(case: Case) -> tuple[str, ...]:
    notes: list[str] = [*site_notes(case.site)]
    notes += [
        f"not compared: {', '.join(name for name in case.left_out if case.left_out[name] == why)} ({why})"
        for why in dict.fromkeys(case.left_out.values())
    ]
    clipped = int(case.whole.clipped.sum())
    if clipped:
        notes.append(f"{clipped} samples are clipped: of them it is only used that the true values lie beyond")
    if case.exit is not None:
        start, end = 1e3 * case.exit.start, 1e3 * case.exit.end
        notes.append(f"{start:.1f} to {end:.1f} ms are left out: the wheel leaves the deck at an uncertain time in it")
    if case.omitted is not None:
        start, end = 1e3 * case.omitted.start, 1e3 * case.omitted.end
        notes.append(
            f"{start:.1f} to {end:.1f} ms are left out: no model explains them; the verdict's model explains the rest"
        )
    if case.site.trigger is None:
        notes.append("the site has no trigger: the passage was found in the recording by its onset")
    plain = case.fits["plain"]
    if not plain.converged and plain.reduced <= EXPLAINED:
        notes.append("the fit of the model has not converged: its values are uncertain")
    if not case.is_explained and plain.held > case.after(LASTING):
        fields = Fields(plain.scenario)
        notes.append(
            f"up to {1e3 * plain.held:.0f} ms a mass of {float(fields(MASS)):.4g} kg and a damping of "
            f"{1e-3 * float(fields(DAMPING)):.4g} kN s/m explain the recording"
        )
    return tuple(notes)

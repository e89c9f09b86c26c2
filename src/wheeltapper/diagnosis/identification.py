"""The parameters of a passage of known fault, from its recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.case import Case
from wheeltapper.diagnosis.inference.estimate import Estimate, estimate_of, priors_of, recorded_at
from wheeltapper.diagnosis.inference.fitting import fit_over_windows
from wheeltapper.ground.arguments import as_names, as_table
from wheeltapper.ground.progress import Progress, progress_shown, report
from wheeltapper.record.recordings.recording import Recording


def identify(
    recording: Recording | str | Path,
    site: Site | str | Path,
    unknown: Sequence[str] = ("vehicle.mass", "vehicle.damping"),
    *,
    start: Mapping[str, float] | None = None,
    noise: float | None = None,
    progress: Progress = True,
) -> Estimate:
    """Estimate the parameters of a passage from its recording.

    Parameters
    ----------
    recording
        The deck's acceleration, or the path of its file. If it has the reading of a speed gauge, this replaces the
        site's speed.
    site
        The site of the recording, or the path of its TOML file. Its uncertain fields are estimated, too, with the
        stated uncertainty as prior.
    unknown
        Paths of the fields that are estimated without a prior.
    start
        Starting values by path, instead of the site's.
    noise
        Standard deviation of the samples' noise, m/s²; by default the sensor's, or what the recording shows.
    progress
        As for `wheeltapper.simulate`.

    Raises
    ------
    InputError
        If the site's sensor cannot have made the recording, or an unknown field holds no number.
    """
    recording, site, spread = recorded_at(recording, site, noise)
    case = Case(recording, site, (), spread)
    model = case.passage.replaced(as_table(start, "start", "values by path, or None"))
    asked = as_names(unknown, "unknown", "paths of fields")
    with progress_shown(progress, "fitting"):
        report("fitting", 0.0, 0.0)
        found = fit_over_windows(case.fit_problem(model, priors_of(case.stated, asked)), case.begins)
        return estimate_of(found, spread)

"""Diagnosis of a train: the findings of all axles as one table and one JSON, compared with alarm rules."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.site import Site, as_site
from wheeltapper.describe.track.stiff import StiffTrack
from wheeltapper.diagnosis.alarms import Alarm, Untested, compared, together, wheel_forces
from wheeltapper.diagnosis.diagnose import diagnose
from wheeltapper.diagnosis.faults.base import CATALOGUE
from wheeltapper.diagnosis.finding import HEALTHY, KIP, NOT_EXPLAINED, Finding
from wheeltapper.diagnosis.folder import undiagnosed_entry
from wheeltapper.diagnosis.gauges.finding import WheelFinding
from wheeltapper.diagnosis.processes import Lost, in_processes
from wheeltapper.ground.arguments import as_count, as_list, check_text
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.progress import Progress, progress_shown, report
from wheeltapper.ground.shown import Shown
from wheeltapper.record.limits.rule import Rule, Rules, as_rules, rule_notes
from wheeltapper.record.recordings.given import as_recordings
from wheeltapper.record.recordings.recording import Recording
from wheeltapper.record.simulate import simulate

FORMAT = 1
"""Version of the layout of a train's JSON."""
COLUMNS = (
    ("vehicle", "vehicle", "d"), ("axle", "axle", "d"), ("side", "side", "s"),
    ("speed_kmh", "km/h", ".1f"), ("static_kn", "static kN", ".1f"),
    ("peak_kn", "peak kN", ".1f"), ("peak_kips", "peak kips", ".1f"), ("dynamic_ratio", "peak/static", ".2f"),
    ("dynamic_increment", "(peak-static)/static", ".2f"),
    ("level_kn", "level kN", ".1f"), ("forces_from", "forces from", "s"), ("verdict", "verdict", "s"),
    ("model", "model", "s"),
    ("probability", "probability", ".3f"), ("size", "size", "s"),
    ("model_kn", "model's peak kN", ".1f"), ("axle_kn", "axle kN", ".1f"),
    ("left_right", "left-right", "+.3f"), ("relative_load", "load/median", ".2f"),
    ("strikes", "strikes", "d"), ("strike_kn", "hardest kN", ".1f"), ("repeats_after", "every m", ".2f"),
    ("alarms", "alarms", "s"),
)  # fmt: skip
"""Columns of the table: key, heading, and the format of the values."""
OF_WHEELS = ("vehicle", "side", "axle_kn", "left_right", "strikes", "strike_kn", "repeats_after")
"""Columns that only trains have whose wheels were measured each by itself."""
OF_SEATS = ("relative_load",)
"""Columns that only trains have that passed over sensors at seats."""
OF_FITS = ("model_kn",)
"""Columns that only trains have of whose wheels models were fitted."""
OF_MODELS = ("level_kn", "probability", "size")
"""Columns that only a model fills."""
VERIFY = "the limits of alarms are copies of documents that change: verify the current edition of each"
"""What is said wherever there is an alarm."""
FEWEST = 6
"""Largest number of alarms of one axle that are printed in full; the rest are counted."""


@dataclass(frozen=True, eq=False)
class TrainFinding(Shown):
    """Findings of all wheelsets of a train.

    Attributes
    ----------
    axles
        Result of `Finding.to_dict` for each wheelset, beginning with the leading one. `level_force` is added: the
        largest force of its model on level track, N; None if no model explains the recording.
    site
        Site of the recordings.
    rules, alarms
        The rules that were given, and the alarms that were raised.
    name, date
        Name of the train, and date of its passage, as given.
    healthy_ratio
        Ratio of the largest to the static force of the site's stated healthy wheelset, which bounces over the site's
        irregularity.
    findings
        The findings themselves, if they were given.
    notes
        Notes on the recordings of a train that was measured without a model.
    vehicles
        Vehicles of such a train. Each has its number, kind, first_axle, last_axle, axles, wheelbases (m), distance of
        its outer axles (m), load (N), and left_right, front_rear and diagonal: (a - b)/(a + b) for the loads of its
        sides, of its outer bogies, and of front left with rear right against the others.
    untested
        The rules that were not, or not wholly, measured, and what was measured of them.
    wheels
        Findings of the wheels to which a model was fitted, by the axle's number from 1 and the side.
    """

    axles: tuple[dict[str, Any], ...]
    site: Site
    rules: tuple[Rule, ...]
    alarms: tuple[Alarm, ...]
    name: str = ""
    date: str = ""
    healthy_ratio: float = np.nan
    findings: tuple[Finding, ...] = ()
    notes: tuple[str, ...] = ()
    vehicles: tuple[dict[str, Any], ...] = ()
    untested: tuple[Untested, ...] = ()
    wheels: Mapping[tuple[int, str | None], WheelFinding] = field(default_factory=dict)

    def alarms_at(self, axle: int) -> tuple[Alarm, ...]:
        """Return the alarms of one wheelset, numbered from 1, without those of its vehicle and of the train."""
        axle = as_count(axle, "axle", 1, len(self.axles))
        return tuple(alarm for alarm in self.alarms if alarm.axle == axle and alarm.of_wheels)

    def table(self) -> list[dict[str, Any]]:
        """Return one row per wheelset, or per wheel where each was measured; None stands for what does not exist.

        Keys: axle, speed_kmh, static_kn, peak_kn, peak_kips, dynamic_ratio (peak over static), dynamic_increment
        ((peak - static) over static), level_kn (peak on level track), forces_from ("model" or "recording"), verdict,
        probability, size (as text), alarms (names of the rules). Forces are those of the wheelset, in kN and in kips.
        In a row of a wheel they are the wheel's, and there are more keys: vehicle, side, axle_kn (static force of the
        axle), left_right ((left - right) over their sum), strikes (their number), strike_kn (the force of the hardest,
        below 2 kHz, while peak_kn is below 500 Hz), repeats_after (m, if it is a wheel's circumference); with sensors
        at seats relative_load (over the train's median wheel); with a model of a deck, or of wheels on the track, model
        (its verdict); with the latter model_kn (largest force of the wheel, wherever it was).
        """
        rows = []
        for number, entry in enumerate(self.axles, 1):
            wheels = entry.get("wheels")
            rows += [self._axle_row(number, entry)] if wheels is None else [
                self._wheel_row(number, entry, wheel) for wheel in wheels
            ]  # fmt: skip
        return rows

    def to_dataframe(self) -> Any:
        """Return the table as a pandas DataFrame."""
        import pandas as pd  # type: ignore[import-untyped]

        return pd.DataFrame(self.table(), columns=[key for key, _, _ in self.columns()])

    def columns(self) -> list[tuple[str, str, str]]:
        """Return the columns that this train can have: key, heading, and the format of the values."""
        measured = any("wheels" in entry for entry in self.axles)
        at_seats = any("relative_load" in wheel for entry in self.axles for wheel in entry.get("wheels", ()))
        fitted = any("finding" in wheel for entry in self.axles for wheel in entry.get("wheels", ()))
        of_decks = any("model" in entry for entry in self.axles)
        models = ("level_kn",) if of_decks or fitted else (*OF_MODELS, "model")
        left_out = (models if measured else (*OF_WHEELS, "model")) + (() if at_seats else OF_SEATS)
        left_out += () if fitted else OF_FITS
        band = " <500 Hz" if measured else ""
        return [
            (key, heading + band if key == "peak_kn" else heading, form)
            for key, heading, form in COLUMNS
            if key not in left_out
        ]

    def _wheel_row(self, number: int, entry: Mapping[str, Any], wheel: Mapping[str, Any]) -> dict[str, Any]:
        row = self._axle_row(number, {**entry, **wheel})
        load, side, model = entry.get("static_force"), wheel["side"], wheel.get("finding", entry.get("model"))
        row["model"] = row["model_kn"] = None
        if model is not None:
            row |= {"model": model["verdict"], "probability": model["probabilities"].get(model["verdict"])}
            row["size"] = _size_text(model)
            largest = model.get("largest_force") if "finding" in wheel else None
            row["model_kn"] = None if largest is None else 1e-3 * largest
        alarms = [one.rule.name for one in self.alarms_at(number) if one.side in ("", side or "")]
        excess = [one["excess"] for one in wheel["strikes"]]
        more = {
            "vehicle": entry["vehicle"], "side": side, "axle_kn": None if load is None else 1e-3 * load,
            "left_right": entry["left_right"], "strikes": len(wheel["strikes"]),
            "strike_kn": 1e-3 * (wheel["static_force"] + max(excess)) if excess else None,
            "repeats_after": wheel["repeats_after"], "relative_load": wheel.get("relative_load"), "alarms": alarms,
        }  # fmt: skip
        return {key: (row | more)[key] for key, _, _ in self.columns()}

    def _axle_row(self, number: int, entry: Mapping[str, Any]) -> dict[str, Any]:
        static, peak, speed = (entry.get(name) for name in ("static_force", "largest_force", "speed"))
        ratio = peak / static if static and peak is not None else None
        verdict = str(entry["verdict"])
        return {
            "axle": number,
            "speed_kmh": None if speed is None else 3.6 * speed,
            "static_kn": None if static is None else 1e-3 * static,
            "peak_kn": None if peak is None else 1e-3 * peak,
            "peak_kips": None if peak is None else peak / KIP,
            "dynamic_ratio": ratio,
            "dynamic_increment": None if ratio is None else ratio - 1.0,
            "level_kn": None if entry.get("level_force") is None else 1e-3 * entry["level_force"],
            "forces_from": entry.get("forces_from"),
            "verdict": verdict,
            "probability": entry.get("probabilities", {}).get(verdict),
            "size": _size_text(entry),
            "alarms": [alarm.rule.name for alarm in self.alarms_at(number)],
        }

    def to_dict(self) -> dict[str, Any]:
        """Return everything for one JSON; in SI units."""
        axles = []
        for number, entry in enumerate(self.axles, 1):
            if "wheels" in entry:
                axles.append({"axle": number, **entry, "alarms": [one.to_dict() for one in self.alarms_at(number)]})
                continue
            row, wheels = self._axle_row(number, entry), self.site.passage.vehicle.wheels
            more = {name: row[name] for name in ("dynamic_ratio", "dynamic_increment")}
            largest = wheel_forces(entry, wheels)[1]
            alarms = [alarm.to_dict() for alarm in self.alarms_at(row["axle"])]
            own = {"axle": row["axle"], **entry, **more, "largest_wheel_force": _or_none(largest), "alarms": alarms}
            axles.append(own)
        return {
            "format": FORMAT,
            "train": self.name,
            "date": self.date,
            "site": self.site.name,
            "healthy_dynamic_ratio": _or_none(self.healthy_ratio),
            "axles": axles,
            **({"vehicles": list(self.vehicles)} if self.vehicles else {}),
            "alarms": [one.to_dict() for one in self.alarms if not one.of_wheels],
            "rules": [rule.to_dict() for rule in self.rules],
            "not_measured": [one.to_dict() for one in self.untested],
            "notes": list(self._train_notes()),
        }

    def __str__(self) -> str:
        """Return the table, the alarms and notes about them."""
        head = ", ".join(part for part in (self.name, self.date, self.site.name) if part)
        count = f"{len(self.axles)} axles, {self._faulty_text()}"
        lines = [f"{head}: {count}" if head else count, *_aligned_lines(self.table(), self.columns())]
        lines += [_vehicle_line(vehicle) for vehicle in self.vehicles]
        lines += [str(alarm) for alarm in self.alarms if not alarm.of_wheels]
        for axle in range(1, len(self.axles) + 1):
            alarms = self.alarms_at(axle)
            lines += [str(alarm) for alarm in alarms[:FEWEST]]
            if len(alarms) > FEWEST:
                lines.append(f"axle {axle}: and {len(alarms) - FEWEST} more alarms")
        return "\n".join([*lines, *map(str, together(self.untested)), *self._train_notes()])

    def _faulty_text(self) -> str:
        rows = self.table()
        if any("wheels" in entry for entry in self.axles):
            struck = [f"{row['axle']} {row['side'] or ''}".strip() for row in rows if row["strikes"]]
            return f"strikes: axle {', '.join(struck)}" if struck else "no strikes"
        faulty = [str(row["axle"]) for row in rows if row["verdict"] != HEALTHY]
        return f"not healthy: {', '.join(faulty)}" if faulty else "all healthy"

    def _train_notes(self) -> tuple[str, ...]:
        if any("wheels" in entry for entry in self.axles):
            verify = (VERIFY,) if self.alarms else ()
            return (*self.notes, *rule_notes(self.rules), *verify)
        notes = ["peaks and ratios are those of the wheelset, over this site's irregularity"]
        if np.isfinite(self.healthy_ratio):
            notes[0] += f", where a healthy wheelset as stated has {self.healthy_ratio:.2f} times its static force"
        notes.append("level: the largest force of the best model on level, rigid track; alarms compare this force")
        if any(entry["verdict"] == NOT_EXPLAINED for entry in self.axles):
            notes.append(
                "not explained: without a model there is no force on level track; forces are from the recording, and "
                "alarms compare the peak, which the site's irregularity makes larger; the speed is measured or stated"
            )
        if any(alarm.rule.per == "wheel" and "length" not in alarm.rule.quantity for alarm in self.alarms):
            notes.append(
                "alarms per wheel: half of the wheelset's force, or all of its dynamic part on one wheel where the "
                "fault is in a wheel or unknown"
            )
        if self.alarms:
            notes.append(VERIFY)
        return (*notes, *rule_notes(self.rules))


def _size_text(entry: Mapping[str, Any]) -> str:
    size, unit = entry.get("size"), entry.get("size_unit", "")
    if size is not None and entry.get("size_interval"):
        low, high = entry.get("sizes", {}).get(entry["verdict"], entry)["size_interval"]
        factor, name = (1e3, "mm") if size >= 1e-3 else (1e6, "um")
        others = [f"{other} {factor * entry['sizes'][other]['size']:.1f} {name}" for other in entry["alike"]]
        return ", or ".join([f"{factor * size:.1f} ± {factor * 0.5 * (high - low):.1f} {name}", *others])
    interval = [end for end in entry.get("size_interval_90", ()) if end is not None]
    return " to ".join(_with_unit(value, unit) for value in (interval if size is None else [size]))


def _with_unit(size: float, unit: str) -> str:
    if unit == "m":
        return f"{1e3 * size:.4g} mm" if abs(size) >= 1e-3 else f"{1e6 * size:.4g} um"
    return f"{size:.4g} {unit}".strip()


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _vehicle_line(vehicle: Mapping[str, Any]) -> str:
    """Return a vehicle as a line of text."""
    first, last = vehicle["first_axle"], vehicle["last_axle"]
    axles = f"axles {first} to {last}" if last > first else f"axle {first}"
    text = f"vehicle {vehicle['vehicle']}: {axles}, {vehicle['kind']}"
    if vehicle["load"] is not None:
        text += f", {1e-3 * vehicle['load']:.1f} kN ({vehicle['load'] / 9.80665e3:.1f} t)"
    names = {"left_right": "left-right", "front_rear": "front-rear", "diagonal": "diagonal"}
    parts = [f"{name} {vehicle[key]:+.3f}" for key, name in names.items() if vehicle[key] is not None]
    return ", ".join([text, *parts])


def cell_text(value: Any, form: str) -> str:
    """Return a value of a table as text: "-" where there is none."""
    if value is None:
        return "-"
    return ", ".join(value) if isinstance(value, list) else format(value, form)


def _aligned_lines(rows: list[dict[str, Any]], columns: Sequence[tuple[str, str, str]]) -> list[str]:
    """Return a table as lines of text: numbers aligned to the right, words to the left."""
    cells = [
        [heading for _, heading, _ in columns],
        *([cell_text(row[key], form) for key, _, form in columns] for row in rows),
    ]
    widths = [max(len(line[i]) for line in cells) for i in range(len(columns))]
    left = [form == "s" for _, _, form in columns]
    return [
        "  ".join(
            cell.ljust(width) if words else cell.rjust(width)
            for cell, width, words in zip(line, widths, left, strict=True)
        ).rstrip()
        for line in cells
    ]  # fmt: skip


def train_of(
    found: Sequence[Mapping[str, Any] | Finding],
    site: Site,
    *,
    rules: Rules = None,
    countries: Sequence[str] | None = None,
    name: str = "",
    date: str = "",
) -> TrainFinding:
    """Combine the findings of a train's wheelsets.

    Parameters
    ----------
    found
        Findings of the wheelsets, beginning with the leading one, or the results of their `to_dict`.
    site
        Site of the recordings.
    rules
        Alarm rules, or a file of them; by default those of the package.
    countries
        Take only rules that name one of these, such as ("SE", "EU").
    name, date
        Name of the train, and date of its passage; both are only repeated in the result.
    """
    if not found:
        raise InputError("", "recordings", "none", "one for each wheelset of the train")
    findings = tuple(one for one in found if isinstance(one, Finding))
    ratio = healthy_ratio(site)
    entries = tuple(_train_entry(one, site, ratio) for one in found)
    chosen = as_rules(rules, countries)
    alarms, untested = compared(entries, chosen, site)
    return TrainFinding(
        entries, site, chosen, alarms, name, date, ratio, findings if len(findings) == len(entries) else (),
        untested=untested,
    )  # fmt: skip


def _train_entry(found: Mapping[str, Any] | Finding, site: Site, ratio: float) -> dict[str, Any]:
    entry = found.to_dict() if isinstance(found, Finding) else dict(found)
    model = found.model if isinstance(found, Finding) else _model_from_json(entry, site)
    return {**entry, "level_force": _or_none(_level_force(entry, model, site, ratio))}


def _model_from_json(entry: Mapping[str, Any], site: Site) -> Scenario | None:
    """Return the best model from a finding's JSON; None if the JSON does not determine it."""
    if entry["verdict"] not in CATALOGUE:
        return None
    values = {path: one["value"] for path, one in entry.get("estimates", {}).items()}
    return CATALOGUE[entry["verdict"]].model(site.passage, {"speed": entry["speed"], **values})


def _level_force(entry: Mapping[str, Any], model: Scenario | None, site: Site, ratio: float) -> float:
    """Return a wheelset's largest force on level, rigid track, N; NaN without a wheel or an explanation.

    For a fault of the wheel without a model, it is the static force plus the excess over a healthy wheelset's force on
    the site's irregularity.
    """
    static, peak = entry.get("static_force"), entry.get("largest_force")
    verdict = entry["verdict"]
    if static is None or peak is None or verdict == NOT_EXPLAINED:
        return np.nan
    if verdict == HEALTHY or (verdict in CATALOGUE and CATALOGUE[verdict].part != "wheel"):
        return float(static)
    if model is None:
        return float(static + max(peak - ratio * static, 0.0))
    own = model.irregularities[len(site.passage.irregularities) :]
    turns = 2.0 * 2.0 * np.pi * float(model.vehicle.radius) / float(model.speed)
    level = model.replaced({"irregularity": own, "track": StiffTrack(), "duration": turns})
    return float(simulate(level).peaks.normal_force.values.max(initial=static))


def healthy_ratio(site: Site) -> float:
    """Return the ratio of the largest to the static force of the site's stated healthy wheelset."""
    record = simulate(site.passage)
    return float(record.peaks.normal_force.values.max(initial=record.static_force) / record.static_force)


def diagnose_train(
    recordings: Sequence[Recording | str | Path],
    site: Site | str | Path,
    *,
    rules: Rules = None,
    countries: Sequence[str] | None = None,
    faults: Sequence[str] | None = None,
    noise: float | None = None,
    name: str = "",
    date: str = "",
    workers: int | None = 1,
    progress: Progress = True,
) -> TrainFinding:
    """Diagnose the wheelsets of a train.

    Parameters
    ----------
    recordings
        One recording of each wheelset, or the path of its file, beginning with the leading one.
    site
        Site of the recordings, or the path of its TOML file.
    rules, countries, name, date
        Alarm rules, or a file of them, by default those of the package; take only rules that name one of these
        countries, such as ("SE", "EU"). Name of the train, and date of its passage; both are only repeated in the
        result.
    faults, noise
        As for `diagnose`.
    workers
        Processes; None: one per core. A wheelset whose process dies twice has the verdict "not diagnosed".
    progress
        As for `wheeltapper.simulate`.
    """
    site, asked, chosen = as_site(site), as_recordings(recordings), as_rules(rules, countries)
    check_text(name, "name")
    check_text(date, "date")
    compared = None if faults is None else tuple(as_list(faults, "faults", "names of faults"))
    found: dict[int, Finding | Lost] = {}
    with (
        progress_shown(progress, "wheelsets"),
        closing(in_processes(_diagnosed_recording, (site, compared, noise), asked, workers)) as done,
    ):
        for number, finding in done:
            found[number] = finding
            report("wheelsets", len(found), len(asked))
    ordered = [
        undiagnosed_entry(asked[i].source, str(one)) if isinstance(one := found[i], Lost) else one
        for i in range(len(asked))
    ]
    return train_of(ordered, site, rules=chosen, name=name, date=date)


def _diagnosed_recording(shared: tuple[Site, tuple[str, ...] | None, float | None], recording: Recording) -> Finding:
    site, faults, noise = shared
    return diagnose(recording, site, faults=faults, noise=noise)

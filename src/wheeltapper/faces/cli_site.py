"""The commands for a site: diagnose recordings, assess how well it distinguishes faults, design it."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from wheeltapper.faces.exits import DONE, NOT_FINISHED, PICTURES, check_target, make_folder, write_whole
from wheeltapper.ground.errors import InputError

if TYPE_CHECKING:
    from wheeltapper.describe.site import Site
    from wheeltapper.diagnosis.finding import Finding

RECORDINGS = (".csv", ".txt", ".tsv", ".gz", ".wav", ".mat", ".npy", ".npz", ".nc", ".tdms", ".mf4", ".mdf")
"""Suffixes of files in a folder that are taken as recordings."""
Output = Annotated[Path | None, Parameter(name=["--output", "-o"])]
SEVERAL = Parameter(consume_multiple=True, negative="")
"""An option that takes all values after it, and may be repeated."""


def diagnose(
    *recordings: Path,
    site: Path,
    output: Output = None,
    figures: Literal["all", "faulty", "none"] | None = None,
    train: bool = False,
    rules: Path | None = None,
    workers: int | None = None,
    unit: str | None = None,
    rate: str | None = None,
    column: str | None = None,
    speed: str | None = None,
    speeds: Path | None = None,
) -> int:
    """Find what is wrong with wheelsets from recordings of a deck, or with wheels from gauges or from an axle box.

    With a site that states a `track`, each file is a passage of trains, and a model is fitted to every wheel. If it
    states the wheel's `static_force` and no sensors, each file is the acceleration of an axle box.

    Exit code 3: some of several files were not read or not diagnosed; the rest is done.

    Parameters
    ----------
    recordings
        Files, or folders of them.
    site
        The site in TOML.
    output
        Folder for each finding's JSON and figure. Findings of a deck that it already holds are not computed again.
    figures
        Findings whose figures are drawn: all (the default for a single recording), faulty (for several), none.
    train
        The recordings are the axles of one train, in this order: print a table with the alarms, write train.json.
    rules
        Alarm rules in TOML instead of those of the package.
    workers
        Processes; by default one per core.
    unit
        Unit of the numbers in the files, if the files do not state it.
    rate
        Samples per second, if the files do not state them.
    column
        Column of the files, if there are several: its name, its header in the file, or its number from 0.
    speed
        Measured speed of the wheelset.
    speeds
        Table of the measured speeds of several recordings: a column "file" and a column "speed [km/h]".
    """
    from wheeltapper.describe.site import as_any_site, as_site
    from wheeltapper.diagnosis.folder import NOT_DIAGNOSED, NOT_READ, diagnose_all
    from wheeltapper.diagnosis.processes import ProcessError

    files = _recording_files(recordings)
    given = {"unit": unit, "rate": rate, "column": column, "speed": speed}
    reading = {name: value for name, value in given.items() if value is not None}
    asked = as_any_site(site)
    if asked.track is not None and asked.static_force is not None and not asked.sensors:
        others = {"train": train, "rules": rules, "speeds": speeds, "workers": workers}
        for name in others:
            if others[name]:
                raise InputError("", f"--{name}", "given, with the acceleration of an axle box", "none of it")
        return _diagnose_axle_boxes(files, asked, output, figures or "faulty", reading)
    if asked.track is not None:
        beside = {**reading, "speeds": speeds, "train": train}
        for name, value in beside.items():
            if value:
                raise InputError("", f"--{name}", "given, with a site that states a track", "none of it")
        return _diagnose_wheels(files, site, output, figures or "faulty", rules, workers)
    place = as_site(site)
    if output is not None:
        make_folder(output)
    chosen = figures or ("all" if len(files) == 1 else "faulty")
    after = {"all": draw_all, "faulty": draw_faulty, "none": None}[chosen] if output is not None else None
    try:
        found = diagnose_all(
            files, place, output=output, workers=workers, reading=reading, speeds=speeds, after=after,
            raising=len(files) == 1,
        )  # fmt: skip
    except (KeyboardInterrupt, OSError, ProcessError) as stop:
        kept = f"what is found is in {output}; the same command goes on" if output else "nothing was kept"
        print(f"wheeltapper: {str(stop) or 'interrupted'}; {kept}", file=sys.stderr)
        return NOT_FINISHED
    for entry in found if not train else []:
        print(entry["paragraph"])
    if train:
        _write_train(found, place, rules, output)
    elif len(found) > 1:
        print(_verdict_counts(found))
    if output is not None:
        print(f"findings: {output}")
    return NOT_FINISHED if any(entry["verdict"] in (NOT_READ, NOT_DIAGNOSED) for entry in found) else DONE


def _diagnose_wheels(
    files: list[Path], site: Path, output: Path | None, figures: str, rules: Path | None, workers: int | None
) -> int:  # fmt: skip
    """Fit a model to every wheel of the trains in files, print and write what it says."""
    from wheeltapper.diagnosis.finding import HEALTHY
    from wheeltapper.diagnosis.processes import ProcessError
    from wheeltapper.diagnosis.wayside.measure import measure_trains
    from wheeltapper.diagnosis.wayside.sizes import is_lost
    from wheeltapper.faces.plot import plot

    _make_output(output, files)
    lost = 0
    for file in files:
        try:
            trains = measure_trains(file, site, rules=rules, name=file.stem, diagnosed="all", workers=workers)
        except (ProcessError, KeyboardInterrupt) as stop:
            kept = f"what is found is in {output}" if output else "nothing was kept"
            print(f"wheeltapper: {str(stop) or 'interrupted'}; {kept}", file=sys.stderr)
            return NOT_FINISHED
        except InputError as error:
            if len(files) == 1:
                raise
            lost += 1
            print(f"{file}: not read: {error}")
            continue
        lost += any(is_lost(train) for train in trains)
        if not trains:
            print(f"{file}: no train")
        for number, train in enumerate(trains, 1):
            stem = file.stem + (f"-{number}" if len(trains) > 1 else "")
            print(train)
            for (axle, side), finding in sorted(train.wheels.items(), key=lambda one: (one[0][0], one[0][1] or "")):
                faulty = finding.verdict != HEALTHY
                if faulty:
                    print(f"axle {axle}{f' {side}' if side else ''}: {finding}")
                if output is not None and (figures == "all" or (figures == "faulty" and faulty)):
                    plot(finding, output / f"{stem}-axle-{axle}{f'-{side}' if side else ''}.png")
            if output is not None:
                told = json.dumps(train.to_dict(), indent=2, ensure_ascii=False) + "\n"
                write_whole(output / f"{stem}.json", told)
    if output is not None:
        print(f"findings: {output}")
    return NOT_FINISHED if lost else DONE


def _make_output(output: Path | None, files: list[Path]) -> None:
    """Make the folder of findings; refuse files whose findings would have one name."""
    if output is None:
        return
    stems: dict[str, Path] = {}
    for file in files:
        if file.stem in stems:
            found = f"{stems[file.stem]} and {file}, whose findings would have one name"
            raise InputError("", "recordings", found, "files whose names differ, or no --output")
        stems[file.stem] = file
    make_folder(output)
    for stem in stems:
        check_target("--output", output / f"{stem}.json", (".json",))


def _diagnose_axle_boxes(
    files: list[Path], site: Site, output: Path | None, figures: str, reading: dict[str, Any]
) -> int:  # fmt: skip
    """Read what axle boxes recorded, print and write what it says."""
    from wheeltapper.diagnosis.axle_box.reading import diagnose_axle_box
    from wheeltapper.diagnosis.finding import HEALTHY
    from wheeltapper.faces.plot import plot
    from wheeltapper.record.recordings.read import read_recording

    _make_output(output, files)
    lost = 0
    for file in files:
        try:
            finding = diagnose_axle_box(read_recording(file, quantity="vertical acceleration", **reading), site)
        except InputError as error:
            if len(files) == 1:
                raise
            lost += 1
            print(f"{file}: not read: {error}")
            continue
        print(f"{file}: {finding}")
        if output is None:
            continue
        told = json.dumps(finding.to_dict(), indent=2, ensure_ascii=False) + "\n"
        write_whole(output / f"{file.stem}.json", told)
        if figures == "all" or (figures == "faulty" and finding.verdict != HEALTHY):
            plot(finding, output / f"{file.stem}.png")
    if output is not None:
        print(f"findings: {output}")
    return NOT_FINISHED if lost else DONE


def _recording_files(recordings: tuple[Path, ...]) -> list[Path]:
    """Return the files, and those in folders, in order."""
    out: list[Path] = []
    for place in recordings:
        if place.is_dir():
            inside = sorted(file for file in place.iterdir() if file.suffix.lower() in RECORDINGS)
            if not inside:
                raise InputError(
                    str(place), "", "a folder without recordings", f"files ending in {', '.join(RECORDINGS)}"
                )
            out += inside
        else:
            out.append(place)
    if not out:
        raise InputError("", "recordings", "none", "files or folders of recordings")
    return out


def _verdict_counts(found: list[dict[str, Any]]) -> str:
    verdicts = [entry["verdict"] for entry in found]
    counts = sorted({name: verdicts.count(name) for name in verdicts}.items(), key=lambda item: -item[1])
    return f"{len(found)} recordings: " + ", ".join(f"{count} {name}" for name, count in counts)


def _write_train(found: list[dict[str, Any]], site: Any, rules: Path | None, output: Path | None) -> None:
    from wheeltapper.diagnosis.train import train_of

    told = train_of(found, site, rules=rules)
    print(told)
    if output is not None:
        target = output / "train.json"
        target.write_text(json.dumps(told.to_dict(), indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def draw_all(finding: Finding, target: Path) -> None:
    """Write the figure of a finding beside its JSON."""
    from wheeltapper.faces.plot import plot

    plot(finding, target.with_suffix(".png"))


def draw_faulty(finding: Finding, target: Path) -> None:
    """Write the figure of a finding beside its JSON, unless the wheelset is healthy."""
    from wheeltapper.diagnosis.finding import HEALTHY

    if finding.verdict != HEALTHY:
        draw_all(finding, target)


def assess(
    site: Path,
    *,
    faults: Annotated[tuple[str, ...] | None, SEVERAL] = None,
    count: int = 200,
    healthy: int | None = None,
    seed: int = 0,
    output: Output = None,
    plot: Path | None = None,
    workers: int | None = None,
    speeds: Annotated[tuple[str, ...] | None, SEVERAL] = None,
    static_forces: Annotated[tuple[str, ...] | None, SEVERAL] = None,
    noise: str | None = None,
) -> int:
    """Measure how well a site distinguishes faults: a deck by computed passages, gauges by predicted readings.

    Parameters
    ----------
    site
        The site in TOML.
    faults
        One or more names of the catalogue, each optionally with a size or a range of sizes in SI units: "broken spring"
        "wheel flat=0.002:0.02". By default some of the catalogue.
    count
        Number of passages of each fault.
    healthy
        Number of healthy passages; by default the same number.
    seed
        Seed of the random numbers.
    output
        Write the numbers here (.json). Each passage is kept beside it (.jsonl), so that the same command continues.
    plot
        Write a picture here (.png, .pdf, .svg).
    workers
        Processes; by default one per core.
    speeds, static_forces
        Speeds and static forces of wheels, for a site with gauges on a track: "20 m/s" "80 kN".
    noise
        Standard deviation of a sample, for such a site: "0.5 kN".
    """
    if output is not None:
        check_target("--output", output, (".json",))
    if plot is not None:
        check_target("--plot", plot, PICTURES)
    from wheeltapper.describe.site import as_any_site, as_site
    from wheeltapper.diagnosis.performance import assess as measure
    from wheeltapper.diagnosis.processes import ProcessError

    place = as_any_site(site)
    if place.track is None:
        place = as_site(site)
    kept = None if output is None or place.track is not None else output.with_suffix(".jsonl")
    chosen = _parsed_faults(faults)
    of_gauges: dict[str, Any] = {"speeds": speeds, "static_forces": static_forces, "noise": noise}
    try:
        found = measure(
            place, chosen, count=count, healthy=healthy, seed=seed, output=kept, workers=workers, **of_gauges
        )
    except (KeyboardInterrupt, OSError, ProcessError) as stop:
        begun = kept is not None and kept.exists()
        where = f"what is computed is in {kept}; the same command goes on" if begun else "nothing was kept"
        print(f"wheeltapper: {str(stop) or 'interrupted'}; {where}", file=sys.stderr)
        return NOT_FINISHED
    print(found)
    if output is not None:
        output.write_text(json.dumps(found.to_dict(), indent=2) + "\n", encoding="utf-8")
        print(f"performance: {output}")
    if plot is not None:
        from wheeltapper.faces.plot import plot as draw

        draw(found, plot)
        print(f"picture: {plot}")
    return DONE


def _parsed_faults(texts: tuple[str, ...] | None, option: str = "--faults") -> dict[str, Any] | None:
    """Return the given faults and sizes; None: the usual ones."""
    if texts is None:
        return None
    _check_given(option, texts)
    chosen: dict[str, Any] = {}
    for text in texts:
        name, size = _parsed_fault(text, option)
        if chosen.get(name, size) != size:
            raise InputError("", option, f"{name!r} with two different sizes", "each fault once")
        chosen[name] = size
    return chosen


def _given(**options: Any) -> dict[str, Any]:
    """Return the options that are given."""
    return {name: value for name, value in options.items() if value is not None}


def _check_given(option: str, values: tuple[Any, ...]) -> None:
    """Refuse an option without a value."""
    if not values:
        raise InputError("", option, "nothing", "one or more values")


def _parsed_fault(text: str, option: str) -> tuple[str, Any]:
    """Return the name and the size, or range of sizes, from NAME=SIZE or NAME=LOW:HIGH."""
    name, mark, size = text.partition("=")
    if not mark:
        return name, None
    try:
        numbers = tuple(float(part) for part in size.split(":"))
    except ValueError:
        numbers = ()
    if len(numbers) not in (1, 2):
        raise InputError("", option, repr(text), "NAME, NAME=SIZE or NAME=LOW:HIGH, in SI units")
    return name, numbers[0] if len(numbers) == 1 else numbers


@dataclass(frozen=True)
class OnRail:
    """What may be on a rail that is designed.

    Attributes
    ----------
    number
        Number of features on the rail, by default 2; or of pairs of gauges, by default 6.
    shapes
        Shapes that each feature may have: bump, dip, step up, step down; by default bump and dip.
    largest_force
        Limit of the contact force, N per wheelset; by default 400 kN.
    total_length
        Limit from the first feature's start to the last one's end, m; by default 2 m.
    cribs
        Of gauges: number of bays that may have a pair, from the first pair's on; by default 12.
    flats
        Of gauges: flats with a length, m; by default "wheel flat=0.03".
    static_force
        Of gauges: static force of a wheel, by default "80 kN".
    noise
        Of gauges: standard deviation of a sample, by default "0.5 kN".
    front
        Of gauges: other numbers of pairs for which places are found, too.
    rates
        Of gauges: other sample rates at which the pairs found are judged: "2 kHz" "10 kHz".
    """

    number: int | None = None
    shapes: Annotated[tuple[str, ...] | None, SEVERAL] = None
    largest_force: float | None = None
    total_length: float | None = None
    cribs: int | None = None
    flats: Annotated[tuple[str, ...] | None, SEVERAL] = None
    static_force: str | None = None
    noise: str | None = None
    front: Annotated[tuple[int, ...] | None, SEVERAL] = None
    rates: Annotated[tuple[str, ...] | None, SEVERAL] = None


def design(
    site: Path,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    plot: Path | None = None,
    parameters: Annotated[tuple[str, ...] | None, SEVERAL] = None,
    speeds: Annotated[tuple[float, ...] | None, SEVERAL] = None,
    rail: Annotated[OnRail | None, Parameter(name="*")] = None,
    criterion: Literal["determinant", "worst interval", "root mean square", "90 % quantile"] | None = None,
    budget: int | None = None,
    seed: int | None = None,
) -> int:
    """Find the irregularity over a deck that gives most information within limits, or the best places of gauges.

    Parameters
    ----------
    site
        The site in TOML.
    output
        Write the site with the designed irregularity, or with the pairs of gauges, here (.toml).
    plot
        Write a picture here (.png, .pdf, .svg): the design, and from what it was chosen.
    parameters
        Fields in question, over a deck; by default "vehicle.mass" and "vehicle.damping".
    speeds
        Speeds of the passages, m/s; by default 6, 9 and 12 over a deck, 20 with gauges.
    rail
        What may be on the rail.
    criterion
        Over a deck: determinant of the marginal information, or worst interval of a parameter. With gauges: root mean
        square, or 90 % quantile, of the standard deviations of the length. By default the first one of each.
    budget
        Approximate number of rails that are judged, over a deck; by default 2000.
    seed
        Seed of the random numbers, over a deck.
    """
    check_target("--output", output, (".toml",))
    if plot is not None:
        check_target("--plot", plot, PICTURES)
    on_rail = {} if rail is None else _given(**vars(rail))
    options = _given(parameters=parameters, speeds=speeds, budget=budget, seed=seed)
    for option, values in (options | on_rail).items():
        if isinstance(values, tuple):
            _check_given(f"--{option}", values)
    from wheeltapper.describe.scenario import write_toml
    from wheeltapper.describe.site import as_any_site, as_site
    from wheeltapper.diagnosis.site.design import Interrupted, design_site

    place = as_any_site(site)
    if "flats" in on_rail:
        on_rail["flats"] = _parsed_faults(on_rail["flats"], "--flats")
    if place.track is None:
        place, options = as_site(site), options | _given(criterion=criterion)
    else:
        on_rail |= _given(criterion=criterion)
    try:
        found = design_site(place, rail=on_rail, **options)
    except Interrupted as stop:
        kept = "nothing was found yet"
        if stop.site is not None:
            write_toml(stop.site, output)
            kept = f"the best rail so far is in {output}"
        print(f"wheeltapper: interrupted; {kept}", file=sys.stderr)
        return NOT_FINISHED
    except InputError as error:
        raise error.at(str(site)) from error
    print(found)
    found.to_toml(output)
    print(f"site: {output}")
    if plot is not None:
        from wheeltapper.faces.plot import plot as draw

        draw(found, plot)
        print(f"picture: {plot}")
    return DONE

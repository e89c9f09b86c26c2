"""The command line. Heavy imports wait until a command needs them."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, CycloptsError, Parameter

from wheeltapper._version import __version__
from wheeltapper.faces.cli_cache import cache
from wheeltapper.faces.cli_calibrate import calibrate
from wheeltapper.faces.cli_conicity import conicity
from wheeltapper.faces.cli_explore import explore
from wheeltapper.faces.cli_limits import limits
from wheeltapper.faces.cli_orbits import orbits
from wheeltapper.faces.cli_report import report
from wheeltapper.faces.cli_site import assess, design, diagnose
from wheeltapper.faces.cli_validate import validate
from wheeltapper.faces.exits import DONE, NOT_FINISHED, PICTURES, WRONG_INPUT, check_target, make_folder
from wheeltapper.faces.usage import as_input_error, refuse_fractions
from wheeltapper.ground.arguments import as_count
from wheeltapper.ground.errors import InputError


def _version() -> str:
    from wheeltapper.march.compiling import prebuilt

    return f"{__version__}\nkernels: {prebuilt.told()}"


app = App(
    name="wheeltapper",
    version=_version,
    help="Exact vibro-impacts of railway wheels on irregular rails.",
    help_format="plaintext",
    suppress_keyboard_interrupt=False,
    config=refuse_fractions,
)
app.register_install_completion_command(help="Install completion for this shell (bash, zsh, fish).")

for command in (limits, conicity, diagnose, assess, design, calibrate, report, orbits, explore, validate, cache):
    app.command(command)


@app.command
def run(
    file: Path,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    plot: Path | None = None,
    method: str = "default",
    as_json: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> int:
    """Simulate a scenario.

    Parameters
    ----------
    file
        A scenario in TOML.
    output
        Write the record here (.nc; opens in plain xarray).
    plot
        Write a picture here (.png, .pdf, .svg).
    method
        default or strict.
    as_json
        Print one JSON object instead of lines; warnings go to stderr.
    """
    for option, target, suffixes in (("--output", output, (".nc",)), ("--plot", plot, PICTURES)):
        if target is not None:
            check_target(option, target, suffixes)
    from wheeltapper.faces.running import simulated_file, told_as_json, told_as_lines
    from wheeltapper.ground.outcome import Outcome

    found = simulated_file(file, method)
    if not as_json:
        print(told_as_lines(found))
    if output is not None:
        found.record.save(output)
    if plot is not None:
        from wheeltapper.faces.plot import plot as draw

        draw(found.record, plot)
    written = {"record": output, "picture": plot}
    if as_json:
        print(told_as_json(found, written))
    else:
        print(*(f"{what}: {path}\n" for what, path in written.items() if path is not None), sep="", end="")
    outcome = found.record.outcome
    if outcome is Outcome.COMPLETED:
        return DONE
    print(f"wheeltapper: {outcome.sentence}; {outcome.remedy}", file=sys.stderr)
    return NOT_FINISHED


@app.command
def sweep(
    study: Path,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    workers: int = 0,
    scheduler: str | None = None,
    resume: bool = False,
    threads: int | None = None,
) -> int:
    """Compute a study, and write it into a store that opens in plain xarray.

    Parameters
    ----------
    study
        A study in TOML.
    output
        The store (.zarr).
    workers
        Number of processes on this machine that compute.
    scheduler
        Compute on the Dask cluster at this address.
    resume
        Continue a store that exists; only missing chunks are computed.
    threads
        Without workers: number of threads; by default one per core.
    """
    check_target("--output", output, (".zarr",), folder=True)
    _check_workers(workers, scheduler)
    if threads is not None:
        as_count(threads, "--threads")
        if workers or scheduler:
            raise InputError(
                "", "--threads", f"{threads} with processes or a cluster", "no --threads: each has its own"
            )
    from wheeltapper.ask.fill import fill_store
    from wheeltapper.ask.spec import read_study
    from wheeltapper.ask.store import Store

    def filled() -> list[str]:
        store = Store(output, read_study(study))
        return fill_store(store, resume=resume, workers=workers, scheduler=scheduler, threads=threads)

    return _told_filling(study, output, "cells", filled)


def _told_filling(file: Path, output: Path, things: str, filled: Callable[[], list[str]]) -> int:
    """Fill a store as a file describes it; say what is not computed, and return the exit code."""
    from wheeltapper.ask.fill import ClusterError
    from wheeltapper.ground.progress import progress_shown

    try:
        with progress_shown(True, things):
            failed = filled()
    except InputError as error:
        raise error.at(str(file)) from error
    except KeyboardInterrupt:
        print(f"wheeltapper: interrupted; what is computed is in {output}; --resume goes on", file=sys.stderr)
        return NOT_FINISHED
    except (OSError, ClusterError) as error:
        print(f"wheeltapper: {error}; what is computed is in {output}; --resume goes on", file=sys.stderr)
        return NOT_FINISHED
    print(f"store: {output}")
    for what in failed:
        print(f"wheeltapper: not computed: {what}", file=sys.stderr)
    return NOT_FINISHED if failed else DONE


@app.command
def dataset(
    plan: Path,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    count: int | None = None,
    workers: int = 0,
    scheduler: str | None = None,
    resume: bool = False,
) -> int:
    """Compute labelled passages as sensors record them, for programs that learn.

    Parameters
    ----------
    plan
        The description of the data set in TOML.
    output
        The store (.zarr), which opens in plain xarray. Its card is written beside it.
    count
        Number of passages, instead of that of the file.
    workers
        Number of processes on this machine that compute; 0: this one.
    scheduler
        Compute on the Dask cluster at this address.
    resume
        Continue a store that exists; only missing chunks are computed.
    """
    check_target("--output", output, (".zarr",), folder=True)
    _check_workers(workers, scheduler)
    from wheeltapper.diagnosis.dataset.make import fill_dataset
    from wheeltapper.diagnosis.dataset.plan import DatasetPlan

    def filled() -> list[str]:
        asked = DatasetPlan.from_toml(plan)
        if count is not None:
            asked = asked.model_copy(update={"count": as_count(count, "--count")})
        return fill_dataset(asked, output, resume=resume, workers=workers, scheduler=scheduler)

    return _told_filling(plan, output, "passages", filled)


def _check_workers(workers: int, scheduler: str | None) -> None:
    if workers and scheduler:
        raise InputError("", "--workers", "both --workers and --scheduler", "one of them")
    as_count(workers, "--workers", 0)


@app.command
def wear(
    file: Path,
    *,
    passes: int,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    plot: Path | None = None,
    hardening: float = 1.0,
    speed_scatter: float = 0.0,
    load_scatter: float = 0.0,
    start_scatter: float = 0.0,
    seed: int = 0,
    every: int = 10,
    samples: int = 4,
    method: str = "default",
) -> int:
    """Let many wheels pass over a rail, each over the marks of all wheels before it.

    Parameters
    ----------
    file
        A scenario in TOML, with an elastic-plastic contact and rolling = "point".
    passes
        Total number of wheels that pass.
    output
        Keep the evolution here (.nc; opens in plain xarray). A file that exists is continued.
    plot
        Write a picture here (.png, .pdf, .svg).
    hardening
        1: a place yields again only beyond its largest indentation so far; 0: as early as a virgin one.
    speed_scatter, load_scatter
        Relative standard deviations of the speeds and loads of the passes.
    start_scatter
        Length, m, over which the starting places of the wheels are spread.
    seed
        Seed of the random numbers.
    every
        Number of passes after which the profile is kept each time.
    samples
        Number of places per quarter of the contact patch's length at which indentations are computed.
    method
        default or strict.
    """
    check_target("--output", output, (".nc",))
    if plot is not None:
        check_target("--plot", plot, PICTURES)
    from wheeltapper.ask.wear import wear_in
    from wheeltapper.describe.scenario import Scenario

    scenario = Scenario.from_toml(file)
    try:
        found = wear_in(
            scenario, passes, hardening=hardening, seed=seed, every=every, samples=samples, method=method,
            scatter={"speed": speed_scatter, "load": load_scatter, "start": start_scatter}, store=output,
        )  # fmt: skip
    except InputError as error:
        raise error.at(str(file)) from error
    except KeyboardInterrupt:
        print(f"wheeltapper: interrupted; what is computed is in {output}; the same command goes on", file=sys.stderr)
        return NOT_FINISHED
    over = found.largest_force.values / found.attrs["static_force"]
    left = found.permanent_indentation.values.reshape(found.sizes["kept"], -1).max(axis=1)
    print(
        f"{len(over)} passes: largest force {over[0]:.3f} of static in the first, {over[-1]:.3f} in the last; "
        f"marks up to {1e6 * left[-1]:.2f} µm"
    )
    for note in json.loads(found.attrs["notes"]):
        print(f"note: {note}")
    print(f"evolution: {output}")
    if plot is not None:
        from wheeltapper.faces.plot import plot as draw

        draw(found, plot)
        print(f"picture: {plot}")
    if len(over) >= passes:
        return DONE
    print(f"wheeltapper: {found.attrs['ended']}", file=sys.stderr)
    return NOT_FINISHED


@app.command
def paper(
    *which: str, output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None, page: Path | None = None
) -> int:  # fmt: skip
    """Measure the claims of the paper: confirmed, within limits, or contradicted.

    Parameters
    ----------
    which
        all (the default), a figure (fig2, deck, missed …) or a claim (C08).
    output
        Write the table of measures (claims.csv) and the figures into this folder; it is created if it does not exist. A
        later call continues with what is there.
    page
        Write a page of documentation with each claim, its verdict and its numbers.
    """
    from wheeltapper.diagnosis.processes import ProcessError
    from wheeltapper.faces.paper.run import chosen_claims, measure_claims
    from wheeltapper.ground.progress import progress_shown

    names = list(which) or ["all"]
    chosen_claims(names)
    if output is not None:
        make_folder(output)
    if page is not None:
        check_target("--page", page, (".rst",))
    try:
        with progress_shown(True, "claims"):
            return measure_claims(names, output, page)
    except (KeyboardInterrupt, OSError, ProcessError) as stop:
        kept = f"what is measured is in {output}; the same command goes on" if output else "nothing was kept"
        print(f"wheeltapper: {str(stop) or 'interrupted'}; {kept}", file=sys.stderr)
        return NOT_FINISHED


@app.command
def schema(of: Literal["scenario", "site", "dataset"] = "scenario") -> int:
    """Print the JSON schema of the TOML files, for editors.

    Parameters
    ----------
    of
        scenario, site, or dataset for the plan of a data set.
    """
    from wheeltapper.describe.schema import json_schema

    if of == "dataset":  # imports much that the others do without
        from wheeltapper.diagnosis.dataset.plan import DatasetPlan

        found = json_schema(DatasetPlan)
    else:
        from wheeltapper.describe.scenario import Scenario
        from wheeltapper.describe.site import Site

        found = json_schema(Site if of == "site" else Scenario)
    print(json.dumps(found, indent=2))
    return DONE


@app.command
def completion(shell: Literal["bash", "zsh", "fish"]) -> int:
    """Print the script with which a shell completes commands, options and files.

    Parameters
    ----------
    shell
        bash, zsh or fish.
    """
    print(app.generate_completion(shell=shell))
    return DONE


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code: 0 done, 1 a claim or limit failed, 2 wrong input, 3 not finished."""
    import warnings

    from wheeltapper.faces.interrupts import interruptible

    warnings.showwarning = lambda message, *_: print(f"warning: {message}", file=sys.stderr)
    try:
        with interruptible():
            result = app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
        sys.stdout.flush()
    except CycloptsError as error:
        print(f"wheeltapper: {as_input_error(error)}", file=sys.stderr)
        return WRONG_INPUT
    except InputError as error:
        print(f"wheeltapper: {error}", file=sys.stderr)
        return WRONG_INPUT
    except BrokenPipeError:  # who read the output has gone, as after `| head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # else Python complains at its end
        return NOT_FINISHED
    except KeyboardInterrupt:
        print("wheeltapper: interrupted", file=sys.stderr)
        return NOT_FINISHED
    except SystemExit as stop:
        return NOT_FINISHED if stop.code else DONE
    return result if isinstance(result, int) else DONE


if __name__ == "__main__":
    sys.exit(main())

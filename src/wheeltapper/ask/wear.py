"""The evolution of a rail under many wheels."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack, overload

import numpy as np
from numpy.typing import NDArray

from wheeltapper._version import __version__
from wheeltapper.ask.marks import Marks, marks
from wheeltapper.ask.passes import PassResult, Scatter, after_pass
from wheeltapper.ask.spec import file_digests
from wheeltapper.ask.wear_files import beside_of, locked_file, unwritable_error
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.base import Vehicle
from wheeltapper.ground.arguments import as_count, as_path, as_quantity, as_table
from wheeltapper.ground.errors import InputError, value_text, with_suggestion
from wheeltapper.ground.needs import SEVERAL_BODIES
from wheeltapper.ground.progress import Progress, progress_counter, progress_shown
from wheeltapper.ground.warned import warn_of
from wheeltapper.lower.door import line_of
from wheeltapper.lower.lines.base import Line
from wheeltapper.lower.marks.marks import Surface
from wheeltapper.march import run
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.blocks import core_count
from wheeltapper.record.arguments import as_scenario, as_scenarios, check_method
from wheeltapper.record.beyond import beyond_plastic
from wheeltapper.record.files.checksum import CHECKSUM, checksum, is_damaged
from wheeltapper.record.labels import WEAR_TITLE
from wheeltapper.record.outcomes import OUTCOMES

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Marks", "marks", "wear_in"]

FloatArray = NDArray[np.float64]

RUNAWAY = 20.0
"""Ratio of the largest force of a pass to the static force. The evolution ends after a pass with a larger one, because
the model does not hold there."""
SAVE_AFTER = 10.0
"""Shortest time between two writings of a file, s."""
SCATTER = {"speed": "number", "load": "number", "start": "length"}
"""What may differ from pass to pass, and its dimension."""
PER_PASS: dict[str, tuple[str, str]] = {
    "speed": ("m/s", "speed of the pass"),
    "applied_load": ("N", "load on the wheelset, without its weight"),
    "start": ("m", "where the wheel begins"),
    "largest_force": ("N", "largest normal force of the pass, per wheelset"),
    "impacts_per_metre": ("1/m", "impacts per metre of rail"),
    "plastic_work": ("J", "plastic work of the pass, one loading for every patch's length of rail"),
    "elastic": ("", "share of the length with a contact pressure below first yield of the virgin surface"),
    "shakedown": ("", "share of the length with a pressure between first yield and the shakedown limit"),
    "ratcheting": ("", "share of the length with a pressure beyond the shakedown limit"),
}
"""Variables of the result that have one value per pass: unit and meaning."""


class Options(TypedDict, total=False):
    """Options of `wear_in`."""

    hardening: float
    scatter: Mapping[str, Any] | None
    seed: int
    every: int
    samples: int
    method: str
    store: str | Path | None
    threads: int | None
    progress: Progress


@overload
def wear_in(scenario: Scenario | str | Path, passes: int, **options: Unpack[Options]) -> xr.Dataset: ...
@overload
def wear_in(scenario: Iterable[Scenario | Path], passes: int, **options: Unpack[Options]) -> list[xr.Dataset]: ...
def wear_in(
    scenario: Scenario | str | Path | Iterable[Scenario | Path],
    passes: int,
    *,
    hardening: float = 1.0,
    scatter: Mapping[str, Any] | None = None,
    seed: int = 0,
    every: int = 10,
    samples: int = 4,
    method: str = "default",
    store: str | Path | None = None,
    threads: int | None = None,
    progress: Progress = True,
) -> xr.Dataset | list[xr.Dataset]:
    """Let many wheels pass over a rail; each pass starts with the surface that the last one left.

    The loading curve of the contact governs the motion. The permanent part of the largest indentation at each place is
    the mark. Marks are averaged over the length of the contact patch. Each wheel is round and virgin.

    Parameters
    ----------
    scenario
        A scenario with an elastic-plastic contact and `rolling="point"`; or several, which are computed in parallel.
        Several wheelsets of a vehicle meet the marks of those before them.
        Each wheel begins at the scenario's start: at rest, or, with `orbit.record.scenario` of an orbit, in a motion
        that lasts.
    passes
        Number of wheels that pass.
    hardening
        1: a place yields again only beyond its largest indentation so far (shakedown). 0: it yields as early as a
        virgin one; near the contact resonance the wear then grows without limit. Values between them interpolate.
    scatter
        How passes differ. "speed", "load": standard deviations over the mean. For a wagon, "load" means the loads of
        its wheelsets, and the weight of the bodies that no element joins to a wheelset (of all bodies, if each is
        joined to one). "start": the wheels begin, at rest, at places that are spread evenly over this length, m, so
        that their bouncing has another phase. A start on an orbit would lose its phase. "vehicles": a list of vehicles
        that pass in turn, instead of the scenario's vehicle. The yielding of the rail, and the static force in the
        results, are then those of the most heavily loaded wheelset.
    seed
        Seed of the random numbers. The draws of pass n do not depend on the number of passes.
    every
        Number of passes between two profiles that are kept. The profile after the last pass is kept, too.
    samples
        Number of places per quarter of the patch's length at which indentations are computed.
    method
        "default" or "strict".
    store
        A netCDF file (.nc) in which the evolution is kept. A later call continues it, with exactly the result of a
        single call.
    threads
        Number of scenarios that are computed at a time; by default one per core.
    progress
        As for `wheeltapper.simulate`.

    Returns
    -------
    xarray.Dataset or list of xarray.Dataset
        Over `pass`: largest force, impacts per metre, plastic work, the drawn numbers, and the shares of the length
        that stay elastic, shake down and ratchet. Over `kept` (numbers of passes, 0 for the virgin rail) and
        `position`: height of the rail, and permanent indentation of rail and wheels together. Over `kept` and
        `wavelength`: amplitude spectrum of the height, and its growth rate per pass. The attribute `ended` says whether
        all passes were made.

    Raises
    ------
    InputError
        If the contact leaves no marks, the wheel does not roll or not as a point, or a file is damaged, of another
        evolution, or holds more passes than are asked.
    """
    passes, every, samples = as_count(passes, "passes"), as_count(every, "every"), as_count(samples, "samples")
    check_method(method)
    given = as_table(scatter, "scatter", f"a table over {', '.join(SCATTER)}, vehicles")
    passing = _checked_vehicles(given.pop("vehicles", ()))
    options = _checked_scatter(hardening, given, seed)
    if isinstance(scenario, Scenario | str | Path):
        file = None if store is None else as_path(store, "store", "a path with the suffix .nc")
        with locked_file(file), progress_shown(progress, "passes"):
            one = _Evolution(as_scenario(scenario), options, every, samples, method, file, passing)
            return one.continue_until(passes)
    if store is not None:
        raise InputError("", "store", str(store), "none with several scenarios, or a call for each with its own")
    scenarios = as_scenarios(scenario)
    with (
        progress_shown(progress, "passes"),
        ThreadPoolExecutor(core_count() if threads is None else as_count(threads, "threads")) as pool,
    ):
        count = progress_counter("passes", passes * len(scenarios))
        evolutions = pool.map(lambda one: _Evolution(one, options, every, samples, method, None, passing), scenarios)
        return list(pool.map(lambda one: one.continue_until(passes, count), evolutions))


def _checked_scatter(hardening: Any, scatter: dict[str, Any], seed: Any) -> Scatter:
    hardening = as_quantity(hardening, "hardening", "number", positive=False)
    if hardening > 1.0:
        raise InputError("", "hardening", f"{hardening:g}", "0 to 1")
    for name in scatter:
        if name not in SCATTER:
            raise InputError(
                "", f"scatter.{name}", f"the unknown name {name!r}", with_suggestion(name, [*SCATTER, "vehicles"])
            )
    spread = {
        name: as_quantity(scatter.get(name, 0.0), f"scatter.{name}", dimension, positive=False)
        for name, dimension in SCATTER.items()
    }
    return Scatter(hardening, **spread, seed=as_count(seed, "seed", 0))


def _checked_vehicles(vehicles: Any) -> tuple[Any, ...]:
    allowed = "Wheelset, Wheelsets, Bogie or Wagon"
    if not isinstance(vehicles, Iterable) or isinstance(vehicles, str):
        raise InputError("", "scatter.vehicles", value_text(vehicles), f"a list of {allowed}")
    out = tuple(vehicles)
    for i, one in enumerate(out):
        if not isinstance(one, Vehicle):
            raise InputError("", f"scatter.vehicles.{i}", value_text(one), allowed)
    return out


def _line_of(scenario: Scenario, options: Scatter, samples: int, method: str, vehicles: tuple[Any, ...]) -> Line:
    """Return the rail over which a scenario, or vehicles in turn, pass again and again."""
    run.choose(run.WEAR_IN, scenario.needs)
    are_wagons = SEVERAL_BODIES in scenario.needs
    for i, vehicle in enumerate(vehicles):
        if (SEVERAL_BODIES in vehicle.needs) != are_wagons:
            allowed = "a Wagon, as the scenario has one" if are_wagons else "no Wagon, as the scenario has none"
            raise InputError("", f"scatter.vehicles.{i}", value_text(vehicle), allowed)
    for wagon in (vehicles or (scenario.vehicle,)) if are_wagons and options.load else ():
        if not wagon.bodies and not any(axle.load for axle in wagon.axles):
            found = f"{options.load:g} with a Wagon that has neither bodies nor loads on its wheelsets"
            raise InputError("", "scatter.load", found, "0")
    return line_of(scenario, options.start, samples, method, vehicles)


class _Evolution:
    """The state of an evolution: the surface, the results of the passes, and the surfaces that are kept."""

    def __init__(
        self, scenario: Scenario, options: Scatter, every: int, samples: int, method: str, store: Path | None,
        vehicles: tuple[Any, ...] = (),
    ) -> None:  # fmt: skip
        self._line, self._scatter = _line_of(scenario, options, samples, method, vehicles), options
        warn_of(self._line.notes)
        self._every, self._store = every, store
        self._request = json.dumps(
            {
                "scenario": repr(scenario),
                "options": asdict(options),
                "every": every,
                "samples": samples,
                "method": method,
            }
            | ({"contents": named} if (named := file_digests(scenario)) else {})
            | ({"vehicles": [repr(vehicle) for vehicle in vehicles]} if vehicles else {})
        )
        self._state = self._line.virgin, 0  # surface and number of passes, set at once
        self._passes: list[PassResult] = []
        self._snapshots: dict[int, FloatArray] = {0: self._present_surface.left}
        self._ended = ""
        if store is not None and store.exists():
            self._read_file(store)

    @property
    def _present_surface(self) -> Surface:
        return self._state[0]

    @property
    def _pass_results(self) -> list[PassResult]:
        return self._passes[: self._state[1]]

    @property
    def _kept_profiles(self) -> dict[int, FloatArray]:
        return {number: left for number, left in self._snapshots.items() if number <= self._state[1]}

    def continue_until(self, passes: int, count: Callable[[int], None] | None = None) -> xr.Dataset:
        """Let so many wheels pass, all in all, each told to `count`; return the evolution."""
        if passes < self._state[1]:
            done = self._state[1]
            what = f"{passes}, where the file holds {done}"
            raise InputError(str(self._store), "passes", what, f"{done} or more, or a new name for a shorter evolution")
        saved = time.monotonic()
        count = count or progress_counter("passes", passes, self._state[1])
        try:
            while self._state[1] < passes and not self._ended:
                surface, told = after_pass(self._line, self._scatter, *self._state)
                done = self._state[1] + 1
                self._passes[done - 1 :] = [told]
                if done % self._every == 0:
                    self._snapshots[done] = surface.left
                self._state = surface, done
                self._ended = self._why_it_ends(told)
                count(1)
                if self._store is not None and time.monotonic() - saved > SAVE_AFTER:
                    self._write_file(self._store)
                    saved = time.monotonic()
        finally:
            if self._store is not None:
                self._write_file(self._store)
        return self.dataset()

    def _why_it_ends(self, told: PassResult) -> str:
        """Return the reason why the evolution ends with this pass; "" if it goes on."""
        number, ratio = self._state[1], told.largest_force / self._line.static_force
        if told.status != contract.DONE:
            return f"pass {number}: {OUTCOMES[told.status].sentence}"
        if ratio > RUNAWAY:
            return (
                f"pass {number} reached {ratio:.1f} times the static force: the marks run away, and the model does not "
                "hold"
            )
        return ""

    # -- the dataset --------------------------------------------------------------------------------------------------

    def dataset(self) -> xr.Dataset:
        """Return the evolution so far."""
        import xarray as xr

        line, told = self._line, self._pass_results
        kept = self._kept_profiles | {len(told): self._present_surface.left}
        numbers = np.array(sorted(kept))
        x = line.sample_positions
        surfaces = [replace(self._present_surface, left=kept[n]) for n in numbers]
        heights = np.array([line.rail_heights(surface) for surface in surfaces])
        left = np.array([line.settled(surface) for surface in surfaces])
        wavelength, amplitude = spectrum(x, heights, 2.0 * line.semi_axis)
        growth = np.full_like(amplitude, np.nan)
        with np.errstate(divide="ignore", invalid="ignore"):
            growth[1:] = np.diff(np.log(amplitude), axis=0) / np.diff(numbers).reshape(-1, *[1] * (amplitude.ndim - 1))
        columns = {name: np.array([getattr(one, name, np.nan) for one in told], dtype=float) for name in PER_PASS}
        columns["impacts_per_metre"] = np.array([one.impacts / one.length for one in told])
        variables: dict[str, Any] = {
            name: ("pass", columns[name], {"units": unit, "long_name": words})
            for name, (unit, words) in PER_PASS.items()
        }
        sides: tuple[str, ...] = ("side",) if line.sides else ()
        along, waves = ("kept", *sides, "position"), ("kept", *sides, "wavelength")
        variables |= {
            "height": (along, heights, {"units": "m", "long_name": "height of the rail"}),
            "permanent_indentation": (
                along, left,
                {"units": "m", "long_name": "permanent indentation of rail and wheels, averaged over the patch"},
            ),
            "amplitude": (
                waves, amplitude, {"units": "m", "long_name": "amplitude of the rail's height"},
            ),
            "growth_rate": (
                waves, growth,
                {"units": "1", "long_name": "growth of the amplitude's logarithm per pass since the last kept one"},
            ),
        }  # fmt: skip
        coordinates: dict[str, Any] = {
            "pass": np.arange(1, len(told) + 1),
            "kept": ("kept", numbers, {"long_name": "passes made"}),
            "position": ("position", x, {"units": "m", "long_name": "position along the rail"}),
            "wavelength": ("wavelength", wavelength, {"units": "m", "long_name": "wavelength"}),
        }
        if sides:
            coordinates["side"] = [*line.sides]
        return xr.Dataset(variables, coordinates, self._evolution_attributes())

    def _evolution_attributes(self) -> dict[str, Any]:
        line, reached = self._line, max((one.largest_force for one in self._pass_results), default=0.0)
        return {
            "title": WEAR_TITLE,
            "wheeltapper": __version__,
            "request": self._request,
            "summary": repr(line.scenario.contact),
            "static_force": line.static_force,
            "patch_length": 2.0 * line.semi_axis,
            "ended": self._ended or "all passes made",
            "notes": json.dumps([
                *line.notes,
                *beyond_plastic(line.scenario.contact, [line.law], [reached]),
                f"marks are averaged over the contact patch, {2e3 * line.semi_axis:.2f} mm long: shorter ones are not "
                "resolved",
            ]),
        }  # fmt: skip

    # -- files --------------------------------------------------------------------------------------------------------

    def _write_file(self, path: Path) -> None:
        data = self.dataset()
        data["state_borne"] = ("sample", self._present_surface.borne)
        data["state_left"] = ("sample", self._present_surface.left)
        data["state_kept"] = (
            ("kept_state", "sample"),
            np.array([self._kept_profiles[n] for n in sorted(self._kept_profiles)]),
        )
        data["state_kept_passes"] = ("kept_state", np.array(sorted(self._kept_profiles)))
        data["state_told"] = (
            ("pass", "told"),
            np.array([list(one) for one in self._pass_results], dtype=float).reshape(-1, len(PassResult._fields)),
        )
        data.attrs[CHECKSUM] = checksum(data)
        beside = beside_of(path)
        try:
            data.to_netcdf(beside, engine="h5netcdf")
            beside.replace(path)
        except OSError as error:
            beside.unlink(missing_ok=True)
            raise unwritable_error(path, error) from error

    def _read_file(self, path: Path) -> None:
        import xarray as xr

        try:
            with xr.open_dataset(path, engine="h5netcdf") as opened:
                data = opened.load()
        except Exception as error:  # HDF5 raises various errors for a damaged file
            reason = f"{type(error).__name__}: {error}".partition("\n")[0]
            raise InputError(str(path), "store", f"no readable netCDF file ({reason})", "a file of wear_in") from error
        if data.attrs.get("title") != WEAR_TITLE:
            raise InputError(str(path), "store", "a file that wear_in did not write", "one of its files, or a new name")
        if is_damaged(data) or "request" not in data.attrs:
            raise InputError(str(path), "store", "a damaged file", "a file as wear_in wrote it, or a new name")
        if data.attrs["request"] != self._request:
            raise InputError(
                str(path), "store", "an evolution of another scenario, or with other options",
                "the same scenario and options, or a new name",
            )  # fmt: skip
        surface = replace(self._present_surface, borne=data.state_borne.values, left=data.state_left.values)
        self._snapshots = dict(
            zip((int(n) for n in data.state_kept_passes.values), data.state_kept.values, strict=True)
        )
        names = zip(PassResult._fields, data.state_told.values.T, strict=True)
        whole = {"status", "impacts"}
        columns = [values.astype(int) if name in whole else values for name, values in names]
        self._passes = [PassResult(*values) for values in zip(*(column.tolist() for column in columns), strict=True)]
        self._state = surface, len(self._passes)
        ended = str(data.attrs["ended"])
        self._ended = "" if ended == "all passes made" else ended


def spectrum(x: FloatArray, heights: FloatArray, shortest: float) -> tuple[FloatArray, FloatArray]:
    """Return wavelengths (m) and amplitudes (m) of profiles over uniform places, with a Hann window.

    Parameters
    ----------
    x
        Places, m.
    heights
        (profiles, places), or with the sides of a wagon between both, m.
    shortest
        Shortest wavelength, m.
    """
    spacing = float(x[1] - x[0])
    window = np.hanning(len(x) + 1)[:-1]
    off = heights - heights.mean(axis=-1, keepdims=True)
    found = 2.0 * np.abs(np.fft.rfft(off * window, axis=-1)) / window.sum()
    frequency = np.fft.rfftfreq(len(x), spacing)
    wanted = (frequency > 0) & (frequency <= 1.0 / shortest)
    return np.asarray(1.0 / frequency[wanted], dtype=np.float64), np.asarray(found[..., wanted], dtype=np.float64)

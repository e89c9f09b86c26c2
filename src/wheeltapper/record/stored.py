"""Checks of the contents of a file before a kernel uses them: shapes, finite numbers, indices in their ranges."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper._version import __version__
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note
from wheeltapper.lower.numbers import METHODS
from wheeltapper.march import program as contract
from wheeltapper.march.program import Program

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
UNDAMAGED = "a file as wheeltapper wrote it"
"""What a file must be, for messages."""
LATER = {contract.START_SHIFT: 0.0, contract.LAST_IMPACT: -1.0, contract.LAST_LOSS: -1.0, contract.MEMORY: 0.0}
"""Numbers of a program that older files lack, and the values that they have for such files."""


def check_format(version: Any, newest: int) -> int:
    """Return the version of a layout; refuse a newer one than this program knows."""
    try:
        number = int(version)
    except (TypeError, ValueError):
        raise InputError("", "format", repr(version)[:80], str(newest)) from None
    if number > newest:
        raise InputError("", "format", str(number), f"at most {newest}; wheeltapper {__version__} cannot read it")
    return number


def table(data: xr.Dataset, name: str, *shape: int | Iterable[int] | None, ends: bool = False) -> FloatArray:
    """Return a variable as numbers.

    Parameters
    ----------
    data
        The file's contents.
    name
        Name of the variable.
    *shape
        The length of each of its axes, or the lengths that it may have; None: any.
    ends
        Whether it may hold infinities.
    """
    if name not in data.variables:
        raise InputError("", name, "nothing", UNDAMAGED)
    values = data[name].values
    allowed = [None if n is None else [n] if isinstance(n, int) else list(n) for n in shape]
    fits = len(values.shape) == len(allowed) and all(
        lengths is None or n in lengths for n, lengths in zip(values.shape, allowed, strict=True)
    )
    if not fits or values.dtype.kind not in "fiu":
        text = " x ".join("any" if n is None else " or ".join(map(str, n)) for n in allowed)
        raise InputError("", name, f"{values.dtype} of shape {values.shape}", f"numbers, {text}")
    numbers = np.ascontiguousarray(values, dtype=float)
    bad = np.isnan(numbers) if ends else ~np.isfinite(numbers)
    check(name, numbers, ~bad, "no NaN" if ends else "finite numbers")
    return numbers


def check(name: str, values: NDArray[Any], good: NDArray[np.bool_] | bool, allowed: str) -> None:
    """Refuse values unless all are good, naming the first that is not."""
    good = np.broadcast_to(good, np.shape(values))
    if not good.all():
        place = np.argwhere(~good)[0].tolist()
        raise InputError("", name, f"{np.asarray(values)[tuple(place)]:.9g} at {place}", f"{allowed}; {UNDAMAGED}")


def whole(name: str, values: NDArray[Any], low: float, high: float) -> None:
    """Refuse values that are no whole numbers from low to high."""
    good = (np.rint(values) == values) & (values >= low) & (values <= high)
    check(name, np.asarray(values), good, f"whole numbers from {low:g} to {high:g}")


def rising(name: str, values: FloatArray, end: float) -> None:
    """Refuse times that fall, or lie outside a run."""
    within = (values >= 0.0) & (values <= end * (1.0 + 1e-9))
    check(name, values, within & (np.diff(values, prepend=0.0) >= 0.0), f"rising times from 0 to {end:.6g}")


def attribute(data: xr.Dataset, name: str, kind: type) -> Any:
    """Return an attribute of a given type; a list is stored as JSON."""
    try:
        value = data.attrs[name]
        if kind is not list:
            return kind(value)
        found = json.loads(value)
    except (KeyError, TypeError, ValueError, OverflowError, RecursionError):
        found = None
    if not isinstance(found, list):
        raise InputError("", name, repr(data.attrs.get(name, "nothing"))[:80], UNDAMAGED)
    return found


def notes(data: xr.Dataset) -> tuple[Note, ...]:
    """Return the notes."""
    return tuple(Note(str(note)) for note in attribute(data, "notes", list))


def choice(data: xr.Dataset, name: str, kind: type, allowed: Iterable[Any]) -> Any:
    """Return an attribute that is one of those allowed."""
    value = attribute(data, name, kind)
    known = list(allowed)
    if value not in known:
        raise InputError("", name, repr(value)[:80], ", ".join(map(str, known)))
    return value


def method_of(data: xr.Dataset) -> str:
    """Return the method."""
    return str(choice(data, "method", str, METHODS))


def check_pieces(name: str, pieces: FloatArray) -> None:
    """Refuse pieces of a path without a length, or whose degrees are beyond their columns."""
    degrees = {contract.DEGREE: 0, contract.FACTOR_DEGREE: -1}
    if pieces.shape[1] == contract.MARKED_COLUMNS:
        degrees |= {contract.RESIDUAL_DEGREE: -1, contract.BEARS_DEGREE: -1}
    for column, low in degrees.items():
        whole(name, pieces[:, column], low, contract.MAX_DEGREE)
    whole(name, pieces[:, contract.JOIN], contract.SOFT, contract.JUMP)
    check(name, pieces[:, contract.SCALE], pieces[:, contract.SCALE] > 0.0, "positive scales")
    check(name, pieces[:, contract.STOP], pieces[:, contract.STOP] > pieces[:, contract.START], "pieces with a length")
    others = np.delete(pieces, [contract.START, contract.STOP], axis=1)
    check(name, others, np.isfinite(others), "finite numbers")


def program_of(data: xr.Dataset) -> tuple[Program, int, int]:
    """Return the checked program of one wheel, with the piece with which its path continues, and the joint."""
    pieces = table(data, "program_pieces", None, (contract.PIECE_COLUMNS, contract.MARKED_COLUMNS), ends=True)
    law = contract.ELASTIC
    if "program_law" in data.variables:
        law = table(data, "program_law", None, contract.LAW_COLUMNS)
        starts = law[:, contract.LAW_START]
        check("program_law", starts, np.diff(starts, prepend=-np.inf) > 0.0, "rising starts")
        check("program_law", law[:, contract.LAW_SCALE], law[:, contract.LAW_SCALE] > 0.0, "positive scales")
        table(data, "program_pieces", None, contract.MARKED_COLUMNS, ends=True)
    numbers = table(data, "program_numbers", range(contract.START_SHIFT, contract.NUMBERS + 1), ends=True)
    numbers = np.append(numbers, [LATER[k] for k in range(len(numbers), contract.NUMBERS)])
    open_ended = np.isin(np.arange(contract.NUMBERS), (contract.DECK_FROM, contract.DECK_TO))
    check("program_numbers", numbers, np.isfinite(numbers) | open_ended, "finite numbers")
    if numbers[contract.ORDER] not in (contract.DEFAULT_ORDER, contract.STRICT_ORDER):
        raise InputError("", "program_numbers", f"the order {numbers[contract.ORDER]:g}", UNDAMAGED)
    loop, join = _loop(data, len(pieces))
    whole("program_numbers", numbers[[contract.LOOP]], loop, loop)
    check_pieces("program_pieces", pieces)
    damper = contract.PLAIN
    if "program_damper" in data.variables:
        damper = table(data, "program_damper", contract.DAMPER_ENTRIES)
        check("program_damper", damper, (damper >= 0.0) | (np.arange(len(damper)) == contract.DAMPER_START), "positive")
    return Program(pieces, numbers, law, damper), loop, join


def _loop(data: xr.Dataset, count: int) -> tuple[int, int]:
    if count == 0:
        raise InputError("", "program_pieces", "no pieces of a path", UNDAMAGED)
    try:
        loop, join = (float(value) for value in data.attrs["loop"])
    except (KeyError, TypeError, ValueError):
        raise InputError("", "loop", repr(data.attrs.get("loop", "nothing"))[:80], UNDAMAGED) from None
    whole("loop", np.array([loop]), 0, count)
    whole("loop", np.array([join]), contract.SOFT, contract.JUMP)
    return int(loop), int(join)


def march_of(data: xr.Dataset, program: Program) -> tuple[FloatArray, ...]:
    """Return the checked steps, events, peaks, last state and stops of a wheel's march."""
    width = contract.ENDED_COLUMNS if len(program.damper) else contract.STEP_COLUMNS
    steps = table(data, "march_steps", None, width)
    state = table(data, "march_state", range(contract.LENGTH, width + 1))
    end = float(state[contract.TIME])
    check("march_state", state[[contract.TIME]], end > 0.0, "a positive time")
    if len(steps) == 0:
        raise InputError("", "march_steps", "no steps", UNDAMAGED)
    rising("march_steps", steps[:, contract.TIME], end)
    check("march_steps", steps[:, contract.LENGTH], steps[:, contract.LENGTH] >= 0.0, "lengths of 0 or more")
    for rows in (steps, state[None]):
        whole("march_steps", rows[:, contract.PHASE], 0, contract.YIELDING + len(program.law) - 1)
        whole("march_steps", rows[:, contract.PIECE], 0, len(program.pieces) - 1)
        whole("march_steps", rows[:, contract.ON_DECK], 0, 1)
    if len(program.damper):
        whole("march_steps", steps[:, contract.END_MODE], contract.LOWER, contract.LINKED)
    events = table(data, "march_events", None, contract.EVENT_COLUMNS)
    rising("march_events", events[:, contract.EVENT_TIME], end)
    whole("march_events", events[:, contract.EVENT_KIND], contract.LOSS, contract.YIELD)
    peaks = table(data, "march_peaks", None, (contract.PEAK_COLUMNS - 1, contract.PEAK_COLUMNS))
    rising("march_peaks", peaks[:, contract.PEAK_TIME], end)
    stops = np.empty((0, contract.STOP_COLUMNS))
    if len(program.damper):
        stops = table(data, "march_stops", None, contract.STOP_COLUMNS)
        rising("march_stops", stops[:, contract.STOP_TIME], end)
        whole("march_stops", stops[:, contract.STOP_KIND], contract.REACHED, contract.LEFT)
    return steps, events, peaks, state, stops

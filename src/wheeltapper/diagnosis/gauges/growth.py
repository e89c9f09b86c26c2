"""How the flat of one wheel grows over its passages of a site, and when the wheel was turned or replaced.

Theory: docs/theory/gauges.rst, section 16.8.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import mode
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.diagnosis.finding import HEALTHY
from wheeltapper.diagnosis.gauges.finding import WheelFinding
from wheeltapper.diagnosis.gauges.lines import Lengths, Lines, around, changes, lines_of
from wheeltapper.diagnosis.gauges.scan import FOUND_FROM
from wheeltapper.diagnosis.gauges.sizing import LONGER
from wheeltapper.diagnosis.gauges.verdicts import INTERVAL, NAMES
from wheeltapper.ground.arguments import as_list, as_quantity, check_text
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.shown import Shown

FloatArray = NDArray[np.float64]
DRAWS = 4000
"""Lines that are drawn for the time at which a length is reached."""
RENEWED, STRUCK = "renewed", "new flat"
"""How a course begins that is not the first."""


class Passed(NamedTuple):
    """What one passage of a wheel shows.

    Attributes
    ----------
    at
        Time of the passage, or the distance run until then.
    length
        Length of the flat, m; NaN for a healthy wheel.
    kind
        "wheel flat", "rounded flat", or "healthy".
    own
        Relative standard deviation of the length from causes of this passage alone.
    common
        Relative error of the length if a value that all passages share is wrong by its standard deviation; by the
        value's name.
    unseen
        Lengths of fresh flats that would have been found on half and on nine tenths of the circumference, m.
    """

    at: float
    length: float
    kind: str
    own: float
    common: Mapping[str, float]
    unseen: tuple[float, float]


class Course(NamedTuple):
    """Passages between which the wheel was neither turned nor replaced.

    Attributes
    ----------
    first, last
        When the first and the last passage were.
    begins
        "renewed": the flat has gone, or is much shorter; "new flat": it is much longer. "" for the first course.
    kinds
        Kinds of the flat, each with the passage from which on it has this kind.
    found, healthy
        Numbers of passages that show the flat, and of those that show none.
    line
        Length, m, at `centre`, and its rate, m per unit; none without a flat.
    covariance
        Covariance of these two.
    centre
        Time or distance at which the line has that length.
    """

    first: float
    last: float
    begins: str
    kinds: tuple[tuple[str, float], ...]
    found: int
    healthy: int
    line: FloatArray
    covariance: FloatArray
    centre: float

    def length(self, at: float) -> tuple[float, float]:
        """Return the line's length, m, and its standard deviation."""
        by = np.array([1.0, at - self.centre])
        return float(by @ self.line), float(np.sqrt(by @ self.covariance @ by))


@dataclass(frozen=True, eq=False, repr=False)
class Growth(Shown):
    """How the flat of one wheel grows.

    Attributes
    ----------
    passages
        Passages in the order of time, without those that say nothing about a flat.
    courses
        Courses, each from one renewal of the wheel to the next.
    unit
        Unit of `Passed.at`; rates are per this unit.
    start
        The time at which `at` is 0, if passages had times; else "".
    reduced
        χ² of the lines per degree of freedom; None without any degrees of freedom.
    holds
        Whether lines explain the lengths. If not, intervals are wider by the square root of `reduced` as a factor.
    silent
        Number of passages that say nothing about a flat: the wheel was not examined, was out of round, or was not
        explained.
    """

    passages: tuple[Passed, ...]
    courses: tuple[Course, ...]
    unit: str
    start: str
    reduced: float | None
    holds: bool
    silent: int

    @property
    def renewals(self) -> tuple[float, ...]:
        """Times or distances of the first passages after the wheel was turned or replaced."""
        return tuple(one.first for one in self.courses if one.begins == RENEWED)

    @property
    def rate(self) -> float | None:
        """Growth since the last renewal, m per unit; None if fewer than two passages show a flat."""
        last = self.courses[-1]
        return float(last.line[1]) if last.found > 1 else None

    @property
    def rate_interval(self) -> tuple[float, float] | None:
        """The 90 % interval of `rate`."""
        if self.rate is None:
            return None
        half = INTERVAL * float(np.sqrt(self.courses[-1].covariance[1, 1]))
        return self.rate - half, self.rate + half

    @property
    def length(self) -> float | None:
        """Length of the flat at the last passage, m; None without a flat."""
        last = self.courses[-1]
        return last.length(last.last)[0] if last.found else None

    @property
    def length_interval(self) -> tuple[float, float] | None:
        """The 90 % interval of `length`, with the error that all passages share."""
        last = self.courses[-1]
        if not last.found:
            return None
        length, deviation = last.length(last.last)
        return length - INTERVAL * deviation, length + INTERVAL * deviation

    def reached(self, length: float | str) -> dict[str, float | None]:
        """Return when the flat will reach a length; None: never, if it grows as it does now.

        Parameters
        ----------
        length
            Length, m or as "60 mm". `WheelFinding.breaking_length` gives the one from which on a limit is exceeded.

        Returns
        -------
        dict
            Time or distance in `unit`: its "median", and "low" and "high", between which it lies with a probability of
            nine in ten. It is that of the last passage if the flat has the length already.
        """
        asked = as_quantity(length, "length", "length", positive=True)
        last = self.courses[-1]
        if self.rate is None:
            raise InputError("", "", "a wheel that shows a flat less than twice since its last renewal", "two or more")
        drawn = np.random.default_rng(0).multivariate_normal(last.line, last.covariance, DRAWS, method="eigh")
        lacks = np.maximum(asked - drawn[:, 0] - drawn[:, 1] * (last.last - last.centre), 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            after = np.where(lacks > 0.0, np.where(drawn[:, 1] > 0.0, lacks / drawn[:, 1], np.inf), 0.0)
        parts = np.quantile(after, [0.05, 0.5, 0.95], method="higher").tolist()
        return {
            name: last.last + part if np.isfinite(part) else None
            for name, part in zip(("low", "median", "high"), parts, strict=True)
        }

    def time(self, at: float) -> str:
        """Return a time (to the minute) or a distance as text."""
        if not self.start:
            return f"{self.unit} {at:.6g}"
        return str(np.datetime64(self.start, "m") + np.timedelta64(round(1440.0 * at), "m")).replace("T", " ")

    def __repr__(self) -> str:
        return f"<Growth: {self}>"

    def __str__(self) -> str:
        """Return a few sentences."""
        said = []
        if self.length is None or self.length_interval is None:
            said.append(f"no flat since {self.time(self.courses[-1].first)}")
        else:
            low, high = (1e3 * one for one in self.length_interval)
            said.append(f"{1e3 * self.length:.1f} mm long at the last passage (90 %: {low:.1f} to {high:.1f})")
        if self.rate is not None and self.rate_interval is not None:
            low, high = (1e3 * one for one in self.rate_interval)
            said.append(f"grows by {1e3 * self.rate:.3g} mm a {self.unit} (90 %: {low:.3g} to {high:.3g})")
        return "; ".join([*said, *self.notes])

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on renewals, changed kinds, lines that do not explain the lengths, and passages that say nothing."""
        said = [f"{one.begins} before {self.time(one.first)}" for one in self.courses if one.begins]
        for course in self.courses:
            said += [f"a {kind} from {self.time(at)} on" for kind, at in course.kinds[1:]]
        kinds = [one.kind for one in self.passages]
        healthy = next((n for n, kind in enumerate(reversed(kinds)) if kind != HEALTHY), 0)
        if self.courses[-1].found and healthy:
            said.append(f"no flat was seen at the last {healthy} passages, which may be chance")
        if not self.holds:
            said.append(
                f"a steady growth does not explain the lengths: χ² {self.reduced:.2g} times as large as expected"
            )
        if self.silent:
            said.append(f"{self.silent} passages say nothing of a flat")
        return tuple(said)

    def to_dict(self) -> dict[str, Any]:
        """Return everything, in SI units except for `unit`."""
        return {
            "unit": self.unit, "start": self.start, "length": self.length, "length_interval": self.length_interval,
            "rate": self.rate, "rate_interval": self.rate_interval, "renewals": list(self.renewals),
            "chi_squared_reduced": self.reduced, "line_holds": self.holds, "notes": list(self.notes),
            "courses": [
                {"first": one.first, "last": one.last, "begins": one.begins, "found": one.found,
                 "healthy": one.healthy, "rate": float(one.line[1]) if one.found > 1 else None}
                for one in self.courses
            ],
            "passages": [
                {"at": one.at, "kind": one.kind, "length": one.length if one.kind != HEALTHY else None, "own": one.own}
                for one in self.passages
            ],
        }  # fmt: skip


def wheel_growth(
    passages: Sequence[WheelFinding | Mapping[str, Any]], at: Sequence[Any], *, unit: str = "passage"
) -> Growth:
    """Return how the flat of one wheel grows from passage to passage at one site with gauges and a `track`.

    A line is fitted to the lengths. Errors of track, contact, wheel and gains are the same at all passages: they affect
    the length, but hardly its growth. Passages at which the wheel seemed healthy are used, too, with the lengths that
    would have been found. If the flat has gone, or is suddenly much shorter or longer, a new line begins.

    Parameters
    ----------
    passages
        What each passage showed of this wheel: a `WheelFinding`, the entry of the wheel in `TrainFinding.axles`, or its
        "finding".
    at
        When the passages were, in any order: times, as "2026-11-23T08:12" or `numpy.datetime64`; or numbers, such as
        kilometres run.
    unit
        Unit of these numbers; for times it is the day.

    Returns
    -------
    Growth
        Rate, length now, their intervals, and renewals.

    Raises
    ------
    InputError
        If the numbers of passages and times differ, something given is no passage, or no passage says whether there is
        a flat.
    """
    given = as_list(passages, "passages", "findings of one wheel")
    check_text(unit, "unit")
    places, start = _places(at)
    if len(places) != len(given):
        raise InputError("", "at", f"{len(places)} of them, with {len(given)} passages", "one for each")
    told = [what_is_told(one) for one in given]
    silent = sum(one is None for one in told)
    order = [n for n in np.argsort(places, kind="stable").tolist() if told[n] is not None]
    if not order:
        raise InputError("", "passages", "none that says whether the wheel has a flat", "one or more")
    known = _passed([told[n] or {} for n in order], [float(places[n]) for n in order])
    data = _lengths_of(known)
    starts = changes(data)
    lines, reduced, holds = lines_of(data, starts)
    courses = _courses(known, data, starts, lines)
    return Growth(tuple(known), courses, "day" if start else unit, start, reduced, holds, silent)


def what_is_told(wheel: WheelFinding | Mapping[str, Any]) -> dict[str, Any] | None:
    """Return what growth needs of a wheel's finding, for JSON; None if it does not say whether there is a flat.

    `wheel` is as in `wheel_growth`, or what this function returned.
    """
    if isinstance(wheel, WheelFinding):
        wheel = wheel.to_dict()
    if not isinstance(wheel, Mapping):
        raise InputError("", "passages", value_text(wheel), "findings of wheels, or their entries in a train's `axles`")
    held = wheel.get("finding", wheel)
    if "flats" in held or FOUND_FROM not in held:
        return dict(held) if "flats" in held else None
    errors = held.get("errors", {})
    verdict = held["verdict"] if "errors" in held else HEALTHY  # a wheel that was looked at, and not fitted
    if verdict != HEALTHY and verdict not in errors:
        return None
    flats = {name: {"length": held["sizes"][name]["size"], **error} for name, error in errors.items()}
    return {
        "verdict": verdict,
        "alike": list(held.get("alike", ())),
        "flats": flats,
        FOUND_FROM: dict(held[FOUND_FROM]),
    }


def _places(at: Sequence[Any]) -> tuple[FloatArray, str]:
    """Return when passages were, in days from the first one where times are given, and that time."""
    given = np.array(as_list(at, "at", "numbers, or times"))
    if given.dtype.kind in "iuf" and np.isfinite(given).all():
        return given.astype(float), ""
    try:
        times = given.astype("datetime64[s]")
    except (ValueError, TypeError):
        times = np.array(["NaT"], "datetime64[s]")
    if given.dtype.kind not in "UMO" or np.isnat(times).any():
        raise InputError("", "at", value_text(at), "numbers, or times such as '2026-11-23T08:12'")
    first = times.min()
    return (times - first) / np.timedelta64(1, "D"), str(first)


def _passed(told: Sequence[Mapping[str, Any]], at: Sequence[float]) -> list[Passed]:
    """Return what passages show. Where kinds are not told apart, the nearest passage that tells them has its kind."""
    flats = [n for n, one in enumerate(told) if one["verdict"] != HEALTHY]
    sure = [n for n in flats if not told[n]["alike"]]
    usual = mode(told[n]["verdict"] for n in flats) if flats else NAMES["fresh"]
    out = []
    for n, (one, place) in enumerate(zip(told, at, strict=True)):
        near = told[min(sure, key=lambda m, n=n: abs(m - n))]["verdict"] if sure else usual  # type: ignore[misc]
        unseen = [one[FOUND_FROM][share] for share in ("half", "nine_tenths")]
        if one["verdict"] == HEALTHY:
            longer = next(LONGER[shape] for shape, name in NAMES.items() if name == near)
            out.append(Passed(place, np.nan, HEALTHY, 0.0, {}, (longer * unseen[0], longer * unseen[1])))
            continue
        kind = near if near in one["flats"] and one["alike"] else one["verdict"]
        flat = one["flats"][kind]
        out.append(Passed(place, flat["length"], kind, flat["own"], flat["common"], (unseen[0], unseen[1])))
    return out


def _lengths_of(passages: Sequence[Passed]) -> Lengths:
    names = sorted({name for one in passages for name in one.common})
    half, most = np.array([one.unseen for one in passages]).T
    return Lengths(
        np.array([one.at for one in passages]), np.array([one.length for one in passages]),
        np.array([one.own for one in passages]),
        np.array([[one.common.get(name, 0.0) for name in names] for one in passages]).reshape(len(passages), -1),
        half, most,
    )  # fmt: skip


def _courses(passages: Sequence[Passed], data: Lengths, starts: Sequence[int], lines: Lines) -> tuple[Course, ...]:
    out = []
    for number, first in enumerate((0, *starts)):
        own = [one for one, course in zip(passages, data.course(starts), strict=True) if course == number]
        flats = [one for one in own if one.kind != HEALTHY]
        kinds = tuple((one.kind, one.at) for n, one in enumerate(flats) if n == 0 or one.kind != flats[n - 1].kind)
        before, after = around(data, first, lines, starts) if number else (0.0, 0.0)
        begins = "" if not number else RENEWED if after < before else STRUCK
        (at,) = np.nonzero(lines.courses == number)
        part = slice(2 * at[0], 2 * at[0] + 2) if len(at) else slice(0, 0)
        out.append(Course(
            own[0].at, own[-1].at, begins, kinds, len(flats), len(own) - len(flats), lines.values[part],
            lines.covariance[part, part], float(lines.centres[at[0]]) if len(at) else own[0].at,
        ))  # fmt: skip
    return tuple(out)

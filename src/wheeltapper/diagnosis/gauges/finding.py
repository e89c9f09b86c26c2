"""What gauges show of a wheel: its fault, its size, and its force over the whole passage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wheeltapper.diagnosis.faults.out_of_round import OutOfRoundWheel
from wheeltapper.diagnosis.finding import HEALTHY, NOT_EXPLAINED
from wheeltapper.diagnosis.gauges.fit import Fit
from wheeltapper.diagnosis.gauges.free_shape import FreeShape
from wheeltapper.diagnosis.gauges.known import Known
from wheeltapper.diagnosis.gauges.orders import OutOfRound
from wheeltapper.diagnosis.gauges.outlook import FittedFlat, outlook
from wheeltapper.diagnosis.gauges.passing import FORCE, LENGTH, POSITION, SPEED, Passing
from wheeltapper.diagnosis.gauges.scan import FOUND_FROM
from wheeltapper.diagnosis.gauges.shares import shares_of
from wheeltapper.diagnosis.gauges.sizing import Sized
from wheeltapper.diagnosis.gauges.verdicts import (
    EXPLAINED,
    INTERVAL,
    NAMES,
    OTHER,
    flat_words,
    interval_over,
    odds_of,
    order_size,
    order_words,
    probabilities_of,
)
from wheeltapper.ground.arguments import as_quantity
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.shown import Shown
from wheeltapper.record.arrays import as_array

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
LENGTHS = (0.015, 0.025, 0.035, 0.05, 0.07, 0.1)
"""Of flats whose peaks are told by `breaking_length`, m; between them peaks are interpolated."""
SPEEDS = (10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0)
"""At which peaks are told if none are asked for, m/s."""


@dataclass(frozen=True, eq=False, repr=False)
class WheelFinding(Shown):
    """What gauges show about one wheel.

    Attributes
    ----------
    sized
        The fitted flats.
    passing
        What was recorded of the wheel.
    known
        What is known of the site's track and its wheels.
    direction
        1 or -1: places in `sized`, `passing` and `known` grow in the direction in which the train runs. The site's x is
        `direction` times such a place.
    """

    sized: Sized
    passing: Passing
    known: Known
    direction: int = 1

    @property
    def reduced(self) -> float | None:
        """χ² per reading that the best flat leaves; None without a flat."""
        best = self.sized.best
        return None if best is None else best.chi / best.readings

    @property
    def verdict(self) -> str:
        """The fault's name in the catalogue, "healthy" or "not explained"."""
        unlike = self.sized.free is not None or (self.reduced or 0.0) > EXPLAINED
        return NOT_EXPLAINED if unlike else self.sized.verdict

    @property
    def free_shape(self) -> FreeShape | None:
        """The tread of free shape, if only that explains the readings, and neither a flat nor waves; otherwise None."""
        return self.sized.free

    @property
    def out_of_round(self) -> OutOfRound | None:
        """The waves of a wheel that is out of round; None for other verdicts."""
        return self.sized.seen.orders if self.verdict == OutOfRoundWheel.name else None

    @property
    def unseen(self) -> tuple[float, float]:
        """Lengths of fresh flats, m, that would be found on half of the circumference, and on nine tenths of it."""
        return self.sized.seen.unseen

    @property
    def probabilities(self) -> dict[str, float]:
        """Probabilities of "healthy", fitted flats and "other" (a free shape); without a fit, of the verdict alone."""
        best, free = self.sized.best, self.sized.free
        if free is not None:
            flats = {} if best is None else {NAMES[one.shape]: one.misfit for one in self.sized.fits.values()}
            sound = free.misfit + free.flawless - free.chi
            return odds_of({OTHER: free.misfit, **flats, HEALTHY: sound}, free.reduced)
        if best is None:
            return {self.verdict: 1.0}
        return probabilities_of(self.sized.fits.values(), best, self.sized.gain)

    @property
    def sizes(self) -> dict[str, tuple[float, tuple[float, float]]]:
        """Size, m, and its 90 % interval of each fault that was fitted, by its name.

        The size of a flat is its length. That of a wheel out of round is the amplitude of the order that stands out
        most.
        """
        out = {}
        if self.out_of_round is not None:
            out[self.verdict] = order_size(self.out_of_round)
        for shape, fit in self.sized.fits.items() if self.sized.best is not None else ():
            length, half = fit.values[LENGTH], INTERVAL * self.sized.deviation(shape)
            out[NAMES[shape]] = length, (length - half, length + half)
        return out

    def __repr__(self) -> str:
        return f"<WheelFinding: {self}>"

    def __str__(self) -> str:
        """Return one or two sentences."""
        if self.sized.free is not None:
            return f"not explained by a flat or waves: {self.sized.free.words(self.direction)}"
        if self.verdict == NOT_EXPLAINED:
            return f"not explained: the nearest model, {self.sized.verdict}, leaves χ² = {self.reduced:.2g} per reading"
        if self.verdict not in self.sizes:
            half, most = (1e3 * length for length in self.unseen)
            said = f"{self.verdict}: no flat explains the readings; a fresh one would be found from {half:.0f} mm on"
            said += f" at half of the circumference, from {most:.0f} mm on at nine tenths of it"
            return f"{said}, a rounded one only if it is longer"
        if self.out_of_round is not None:
            found = self.out_of_round
            rest = f"; hardly known: orders {', '.join(map(str, found.unknown))}" if found.unknown else ""
            return f"{self.verdict}: {order_words(found)}{rest}"
        return flat_words(self.verdict, self.probabilities[self.verdict], self.sizes, self.sized.alike)

    def outlook(self, speeds: ArrayLike = SPEEDS, static_forces: ArrayLike | None = None) -> xr.Dataset:
        """Return the peak forces that the wheel will cause at other speeds and loads.

        Parameters
        ----------
        speeds
            Speeds, m/s or as "80 km/h".
        static_forces
            Static forces of the wheel, N or as "90 kN"; by default that of the passage.

        Returns
        -------
        xarray.Dataset
            Over `speed`, `static_force` and `quantile`: largest_force and largest_below_500, N. The quantiles "low",
            "median" and "high" are those of 5, 50 and 95 %: over what the fit leaves open, including the flat's kind,
            and over the place of the strike in a bay.

        Raises
        ------
        InputError
            If the wheel has no flat that explains its readings.
        """
        _, asked = self._flat_and(speeds, static_forces)
        left, likely = (self.verdict, *self.sized.alike), self.probabilities
        kinds = [
            FittedFlat(fit, self.sized.deviation(shape), likely[NAMES[shape]])
            for shape, fit in self.sized.fits.items()
            if NAMES[shape] in left
        ]
        return outlook(self.known.scene, kinds, *asked)

    def breaking_speed(
        self, limit: float | str, *, below_500: bool = False, static_force: float | str | None = None
    ) -> dict[str, float | None]:
        """Return the lowest speed at which the wheel's peak will exceed a limit, m/s; None: none up to 40 m/s.

        Parameters
        ----------
        limit
            Limit of one wheel's force, N or as "350 kN".
        below_500
            Whether the limit is one of the force below 500 Hz.
        static_force
            Static force of the wheel, as for `outlook`.

        Returns
        -------
        dict
            The speed for the "median" peak, and for the "high" and "low" ones, between which nine of ten peaks lie.
        """
        most = as_quantity(limit, "limit", "force")
        peaks = self.outlook(static_forces=static_force)["largest_below_500" if below_500 else "largest_force"]
        speeds = np.linspace(SPEEDS[0], SPEEDS[-1], 301)
        out: dict[str, float | None] = {}
        for name in peaks["quantile"].values.tolist():
            over = np.interp(speeds, SPEEDS, peaks.sel(quantile=name).values[:, 0]) > most
            out[name] = float(speeds[np.argmax(over)]) if over.any() else None
        return out

    def breaking_length(
        self, limit: float | str, speed: float | str, *, below_500: bool = False,
        static_force: float | str | None = None,
    ) -> dict[str, float | None]:  # fmt: skip
        """Return the length from which on the wheel's peak at a speed exceeds a limit, m; None: none up to 0.1 m does.

        Parameters
        ----------
        limit
            Limit of one wheel's force, N or as "350 kN".
        speed
            Speed, m/s or as "80 km/h".
        below_500, static_force
            As for `breaking_speed`.

        Returns
        -------
        dict
            The length for the "median" peak, and for the "high" and "low" ones, between which nine of ten peaks lie.
        """
        most = as_quantity(limit, "limit", "force")
        name = "largest_below_500" if below_500 else "largest_force"
        best, asked = self._flat_and([speed], static_force)
        row, at = best.covariance[best.names.index(LENGTH)], best.names.index(LENGTH)
        known = best._replace(covariance=best.covariance - np.outer(row, row) / row[at])  # as if the length were known
        fits = [known._replace(values={**best.values, LENGTH: one}) for one in LENGTHS]
        peaks = [outlook(self.known.scene, [FittedFlat(fit, 0.0)], *asked)[name] for fit in fits]
        lengths = np.linspace(LENGTHS[0], LENGTHS[-1], 301)
        out: dict[str, float | None] = {}
        for quantile in peaks[0]["quantile"].values.tolist():
            over = np.interp(lengths, LENGTHS, [float(one.sel(quantile=quantile).squeeze()) for one in peaks]) > most
            out[quantile] = float(lengths[np.argmax(over)]) if over.any() else None
        return out

    def _flat_and(self, speeds: ArrayLike, static_forces: ArrayLike | None) -> tuple[Fit, list[FloatArray]]:
        """Return the flat, and speeds, m/s, and static forces, N, as arrays; refuse a wheel without a flat."""
        best = self.sized.best
        if best is None or self.verdict == NOT_EXPLAINED:
            raise InputError("", "", f"a wheel that is {self.verdict}", "one with a flat")
        forces = [best.values[FORCE]] if static_forces is None else static_forces
        return best, [
            np.atleast_1d(as_array(values, name, "numbers", kind))
            for values, name, kind in ((speeds, "speeds", "speed"), (forces, "static_forces", "force"))
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return everything except samples, in SI units."""
        best, shown = self.sized.best, self.sized.shown
        own, free = best is not None and self.verdict != NOT_EXPLAINED, self.sized.free
        told = self.sized.flaw if own or free is not None else None
        size, _ = self.sizes.get(self.verdict, (None, None))
        alike = self.sized.alike if own else ()
        values = {} if best is None or not own else {
            name: {"value": best.values[name], "interval_90": list(best.interval(name, INTERVAL))}
            for name in best.names
        }  # fmt: skip
        return {
            "verdict": self.verdict,
            "probabilities": self.probabilities,
            "alike": list(alike),
            "size": size,
            "size_interval": interval_over((self.verdict, *alike), self.sizes),
            "size_unit": "" if size is None else "m",
            "sizes": {name: {"size": one, "size_interval": list(ends)} for name, (one, ends) in self.sizes.items()},
            "errors": self._errors(),
            "place": self.direction * best.values[POSITION] if best is not None and own else None,
            "speed": self.passing.speed if told is None else told.values[SPEED],
            "static_force": self.passing.static_force if told is None else told.values[FORCE],
            "largest_force": None if shown is None or told is None else shown.largest,
            "largest_below_500": None if shown is None or told is None else shown.below,
            "chi_squared_reduced": self.reduced,
            "gain": self.sized.gain,
            "estimates": values,
            "free_shape": None if free is None else free.to_dict(self.direction),
            "orders": [] if self.out_of_round is None else self.out_of_round.rows(),
            FOUND_FROM: self.sized.seen.found_from,
        }

    def _errors(self) -> dict[str, dict[str, Any]]:
        """Return by fault what part of its length's error is of this passage, and which of what others share."""
        gains = {one.name: one.gain_uncertainty for one in self.passing.sensors}
        fits = self.sized.fits.values() if self.sized.best is not None else ()
        told = {NAMES[one.shape]: shares_of(one, self.known.spread, gains) for one in fits}
        return {name: {"own": own, "common": common} for name, (own, common) in told.items()}

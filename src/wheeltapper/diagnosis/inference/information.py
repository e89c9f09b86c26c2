"""Fisher information: how well recordings of passages will determine their parameters.

sample       The deck's acceleration behind the sensor's filter, plus white noise of the sensor's density.
coordinates  Logarithms of the fields (of the magnitude of negative ones).
information  Σ ∂a·∂aᵀ/σ² over the samples, plus the inverse covariance of the prior. It is kept as the triangle R of the
             QR factorisation of these rows, with RᵀR the information. The condition of R reaches 1e8; that of RᵀR is
             its square, beyond double precision.
marginal     The information on the named fields if all others are unknown, too: their columns less the projections on
             all other columns. Its inverse is the block of the named fields in the inverse of the whole matrix, the
             bound of Cramér and Rao.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity.base import PLACES
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.sensor.deck_acceleration import DeckAcceleration
from wheeltapper.describe.site import Site, as_site
from wheeltapper.diagnosis.inference.passages import PassageMotion, Passages
from wheeltapper.diagnosis.inference.problem import number_at
from wheeltapper.ground.arguments import as_count, as_list, as_names, as_quantities, as_quantity, check_choice
from wheeltapper.ground.errors import ComputationError, InputError, value_text
from wheeltapper.ground.quantities import to_si
from wheeltapper.ground.shown import Shown
from wheeltapper.lower.fields import Fields
from wheeltapper.march.common import program as contract
from wheeltapper.record.outcomes import OUTCOMES

FloatArray = NDArray[np.float64]

NAMED = ("vehicle.mass", "vehicle.damping")
"""Fields whose information is computed if none are named."""
NOTHING = 1e-12
"""Relative size below which a singular value, or the part of a column that is orthogonal to the others, counts as zero.
It is above the rounding errors of double precision."""
BLOCK = 128
"""Rows in one block of the QR factorisation; small blocks are faster than one large matrix."""
OWN = "speed"
"""Path of the field that each passage has for itself: passages of the same wheelset share all other fields."""


@dataclass(frozen=True, eq=False)
class Information(Shown):
    """The information of a passage, at one or several speeds.

    Attributes
    ----------
    site
        The site in question.
    paths
        The fields whose logarithms are the coordinates: the named ones first, then the uncertain ones of the site.
    named
        Number of named fields; they have no prior.
    speeds
        (passages,) speeds, m/s.
    factors
        (passages, paths, paths) triangle R of the information from the samples alone.
    beliefs
        (paths,) reciprocal of the standard deviation of the prior of each logarithm; zero without a prior.
    largest_force, signal
        (passages,) largest contact force, N, and rms of the deck's acceleration, m/s².
    """

    site: Site
    paths: tuple[str, ...]
    named: int
    speeds: FloatArray
    factors: FloatArray
    beliefs: FloatArray
    largest_force: FloatArray
    signal: FloatArray

    def rows(self, passage: int = 0) -> FloatArray:
        """Return the rows of samples and priors of one passage, divided by their standard deviations."""
        chosen = self.factors[as_count(passage, "passage", 0, len(self.speeds) - 1)]
        return np.vstack([chosen, np.diag(self.beliefs)])

    @cached_property
    def marginal(self) -> FloatArray:
        """The information (passages, named, named) on the named fields' logarithms, all others being uncertain."""
        return np.array([rows.T @ rows for rows in self._marginal_rows])

    @cached_property
    def determinants(self) -> FloatArray:
        """(passages,) determinants of the marginal information."""
        return np.array([np.prod(np.diag(qr_triangle(rows))) ** 2 for rows in self._marginal_rows])

    @cached_property
    def _marginal_rows(self) -> list[FloatArray]:
        asked = np.arange(len(self.paths)) < self.named
        return [marginal_columns(self.rows(i), asked) for i in range(len(self.speeds))]

    @cached_property
    def deviations(self) -> FloatArray:
        """(passages, paths) smallest standard deviations of the logarithms; infinite for a field without effect."""
        single = np.eye(len(self.paths), dtype=bool)
        found = [[marginal_columns(self.rows(i), one) for one in single] for i in range(len(self.speeds))]
        with np.errstate(divide="ignore"):
            return np.array([[1.0 / np.linalg.norm(rows) for rows in passage] for passage in found])

    @property
    def determinant(self) -> float:
        """Mean of the determinant over the passages, each of them taken by itself."""
        return float(self.determinants.mean())

    @property
    def worst(self) -> float:
        """The largest standard deviation of a named field's logarithm at any speed."""
        return float(self.deviations[:, : self.named].max())

    def deviation(self, path: str) -> FloatArray:
        """Return (passages,) the smallest relative standard deviations of a field."""
        return np.asarray(self.deviations[:, self.index(path)])

    def correlation(self, path: str, other: str, passage: int = 0) -> float:
        """Return the correlation of the errors of two fields."""
        unit = np.eye(len(self.paths))
        rows = self.rows(passage)
        one, two = (error_vector(rows, unit[self.index(name)]) for name in (path, other))
        return float(one @ two / np.sqrt((one @ one) * (two @ two)))

    def index(self, path: str) -> int:
        """Return the number of the coordinate of a field."""
        check_choice(path, "path", self.paths)
        return self.paths.index(path)

    def joint(self) -> Information:
        """Return the information of all passages of the same wheelset together; it counts as one passage.

        Uncertain fields have the same values in all of them, except the speed.
        """
        kept = np.array([path != OWN for path in self.paths])
        own = np.diag(self.beliefs)[~kept]
        stacked = np.vstack([marginal_columns(np.vstack([factor, own]), kept) for factor in self.factors])
        return replace(
            self, paths=tuple(path for path in self.paths if path != OWN), beliefs=self.beliefs[kept],
            speeds=self.speeds[:1], factors=qr_triangle(stacked)[None],
            largest_force=self.largest_force.max(keepdims=True), signal=np.sqrt((self.signal**2).mean(keepdims=True)),
        )  # fmt: skip


def information(
    site: Site | str | Path,
    parameters: Sequence[str] = NAMED,
    speeds: Sequence[float] | None = None,
    *,
    together: Sequence[Sequence[str]] = (),
    trigger: float = 0.0,
    noise: float | None = None,
    rate: float | None = None,
) -> Information:
    """Return the Fisher information of passages over a site on some fields, given how well the site is known.

    Parameters
    ----------
    site
        The site, or the path of its TOML file. Its uncertain fields are unknown, too, with normal priors. Clipped
        samples do not count.
    parameters
        Paths of the fields in question. They have no prior, whatever the site states.
    speeds
        Speeds, m/s; by default that of the passage. Recordings have the same duration at all speeds.
    together
        Groups of paths with one common relative error, such as heights measured by one gauge; the uncertainty is that
        of the first. Fields in no group err independently.
    trigger
        Standard deviation of the time of the trigger, s. Zero if time zero is exactly at x = 0. Infinite if only the
        recording itself shows when the wheel arrived.
    noise
        Standard deviation of the samples, m/s²; by default as the sensor states it.
    rate
        Samples per second; by default the sensor's. The density of the noise does not depend on it.

    Raises
    ------
    InputError
        If a field holds no number, or the motion has no exact derivatives: an elastic-plastic contact, a damper with
        play or a bush.
    """
    site, asked = as_site(site), as_names(parameters, "parameters", "paths of fields")
    groups = [
        as_names(group, "together", "groups of paths") for group in as_list(together, "together", "groups of paths")
    ]
    trigger, passing = as_trigger(trigger), as_speeds([site.passage.speed] if speeds is None else speeds)
    noise = None if noise is None else as_quantity(noise, "noise", "acceleration", positive=False)
    rate = None if rate is None else as_quantity(rate, "rate", "frequency")
    plan = Plan.checked_plan(site, asked, groups, trigger, noise, rate)
    passages = plan.plan_passages(site.passage, passing)
    return plan.information_of(site, passages)


def as_speeds(given: Any) -> list[float]:
    """Return speeds of passages, m/s."""
    return as_quantities(given, "speeds", "speed", "one or more positive speeds, m/s")


def as_trigger(given: Any) -> float:
    """Return the standard deviation of a trigger's time, s: zero, positive or infinite."""
    deviation = to_si(given, "time", "trigger")
    if not deviation >= 0.0:
        raise InputError("", "trigger", value_text(given), "0 s or more; infinite where there is no trigger")
    return deviation


@dataclass(frozen=True)
class Plan:
    """The arguments of `information`, checked."""

    named: int
    paths: tuple[str, ...]
    groups: dict[str, tuple[str, ...]]
    beliefs: FloatArray
    sensor: DeckAcceleration
    trigger: float
    spread: float

    @staticmethod
    def checked_plan(
        site: Site, parameters: tuple[str, ...], together: Sequence[Sequence[str]], trigger: float,
        noise: float | None, rate: float | None,
    ) -> Plan:  # fmt: skip
        """Return the plan; refuse wrong arguments."""
        density = site.sensor.noise if noise is None else noise / np.sqrt(0.5 * site.sensor.rate)
        sensor = site.sensor.model_copy(update={"rate": float(rate or site.sensor.rate), "noise": density})
        spread = sensor.spread(sensor.rate)
        if not spread > 0.0:
            raise InputError("", "sensor.noise", f"{sensor.noise:g}", "a positive density, m/s²/√Hz, or noise = …")
        for path in (*parameters, *(path for group in together for path in group)):
            number_at(site.passage, path)
        groups = {group[0]: tuple(group) for group in together}
        joined = {path for group in groups.values() for path in group[1:]}
        uncertain = [path for path, share in site.uncertainty.items() if share > 0.0 and path not in joined]
        paths = tuple(dict.fromkeys((*parameters, *uncertain)))
        beliefs = np.array([0.0 if path in parameters else 1.0 / site.uncertainty[path] for path in paths])
        return Plan(len(parameters), paths, groups, beliefs, sensor, trigger, spread)

    def plan_passages(self, scenario: Scenario, speeds: Sequence[float]) -> Passages:
        """Return the passages, with the derivatives that the plan needs."""
        members = [path for first in self.paths for path in self.groups.get(first, (first,))]
        for path in members:
            if float(Fields(scenario)(path)) == 0.0:
                raise InputError("", path, "0", "a field that is not zero: its logarithm is the coordinate")
        fields = dict.fromkeys([*members, *self._shifted_fields(scenario)])
        return Passages(scenario, np.array(speeds, dtype=float), tuple(fields))

    def _shifted_fields(self, scenario: Scenario) -> tuple[str, ...]:
        return _place_fields(scenario) if self.trigger > 0.0 else ()

    def information_of(self, site: Site, passages: Passages) -> Information:
        """Return their information."""
        times = np.arange(int(site.passage.duration * self.sensor.rate * (1.0 + 1e-12)) + 1) / self.sensor.rate
        found = passages.motions_at(times)
        for one in found:
            if one.status not in (contract.DONE, contract.ENOUGH):
                raise ComputationError(OUTCOMES[one.status])
        factors = [
            self._passage_triangle(
                site.passage, speed, dict(zip(passages.parameters, self._filtered_slopes(one), strict=True))
            )
            for speed, one in zip(passages.speeds.tolist(), found, strict=True)
        ]
        signal = [float(np.sqrt((one.deck_acceleration**2).mean())) for one in found]
        return Information(
            site, self.paths, self.named, passages.speeds, np.array(factors), self.beliefs, passages.largest_forces,
            np.array(signal),
        )  # fmt: skip

    def _passage_triangle(self, scenario: Scenario, speed: float, slopes: dict[str, FloatArray]) -> FloatArray:
        """Return R of one passage's samples."""
        held = Fields(scenario)
        groups = [self.groups.get(path, (path,)) for path in self.paths]
        value = {OWN: speed}
        columns = [np.sum([value.get(p, float(held(p))) * slopes[p] for p in group], axis=0) for group in groups]
        if not self.trigger > 0.0:
            return qr_triangle(np.array(columns).T / self.spread)
        late = speed * np.sum(
            [slopes[path] for path in self._shifted_fields(scenario)], axis=0
        )  # by a shift of the whole rail
        rows = np.array([*columns, late]).T / self.spread
        asked = np.arange(rows.shape[1]) < len(columns)
        return qr_triangle(marginal_columns(np.vstack([rows, ~asked / self.trigger]), asked))

    def _filtered_slopes(self, found: PassageMotion) -> list[FloatArray]:
        """Return the derivatives behind the sensor's filter; zero where samples are clipped."""
        seen = self.sensor.filtered(found.deck_acceleration) + self.sensor.offset
        lost = np.zeros(len(seen), dtype=bool) if self.sensor.range is None else np.abs(seen) >= self.sensor.range
        return [np.where(lost, 0.0, self.sensor.filtered(row)) for row in found.slopes]


def _place_fields(scenario: Scenario) -> tuple[str, ...]:
    """Return the fields that shift everything that the wheel meets, as a late trigger does."""
    out = ["track.start"] if scenario.track.start is not None else []
    for i, item in enumerate(scenario.irregularities):
        path = f"irregularity.{i}"
        while hasattr(item, "of"):
            path, item = f"{path}.of", item.of
        names = [name for name in PLACES if getattr(item, name, None) is not None]
        if not names:
            raise InputError(
                "", "trigger", f"an uncertain one with a {type(item).__name__}", "0, or a rail with places"
            )
        out += [f"{path}.{name}" for name in names]
    return tuple(out)


def error_vector(rows: FloatArray, exponents: FloatArray) -> FloatArray:
    """Return a vector e; eᵀe is the variance of the logarithm of a product of powers.

    Scalar products of two such vectors are covariances. e is huge, but finite, if the rows do not determine the
    product.
    """
    held = qr_triangle(rows)
    size = np.linalg.norm(held, axis=0)
    size[size == 0.0] = 1.0
    _, singular, turned = np.linalg.svd(held / size)
    return np.asarray(turned @ (exponents / size) / np.maximum(singular, NOTHING * singular[0]))


def qr_triangle(rows: FloatArray) -> FloatArray:
    """Return R (columns, columns) of rows, by QR factorisation block by block, in a fiftieth of the time."""
    columns = rows.shape[1]
    blocks = -(-len(rows) // BLOCK)
    padded = np.zeros((blocks * max(BLOCK, columns), columns))
    padded[: len(rows)] = rows
    each = np.asarray(np.linalg.qr(padded.reshape(blocks, -1, columns), mode="r"))
    return np.asarray(np.linalg.qr(each.reshape(-1, columns), mode="r"))


def marginal_columns(rows: FloatArray, asked: NDArray[np.bool_]) -> FloatArray:
    """Return the asked columns less their projections on the other columns."""
    held = qr_triangle(rows)
    others, mine = held[:, ~asked], held[:, asked]
    if not others.shape[1]:
        return mine
    size = np.linalg.norm(others, axis=0)
    base, singular, _ = np.linalg.svd(others / np.where(size > 0.0, size, 1.0), full_matrices=False)
    base = base[:, singular > NOTHING * singular[0]]
    left = mine
    for _ in range(2):  # the second pass removes what rounding has left
        left = left - base @ (base.T @ left)
    return np.where(np.linalg.norm(left, axis=0) > NOTHING * np.linalg.norm(mine, axis=0), left, 0.0)

"""A site: a deck with an irregularity, its sensor, and the uncertainties of all of it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, field_serializer, field_validator, model_validator

from wheeltapper.describe.noun import Noun, Share, Spread
from wheeltapper.describe.scenario import Scenario, relative_paths, toml_table
from wheeltapper.describe.sensor import Sensor
from wheeltapper.ground.arguments import as_path
from wheeltapper.ground.errors import InputError
from wheeltapper.march import run

NO_TRIGGER = "none"
"""What a file says where there is no trigger: TOML has no word for None."""


def _none_or_given(value: Any) -> Any:
    return None if value == NO_TRIGGER else value


class Site(Noun):
    """A floating deck in the track that weighs wheelsets as they bounce.

    Parameters
    ----------
    passage
        A healthy wheelset's passage: vehicle, deck, irregularity, contact, speed; time zero is the trigger, at x = 0.
    sensor
        Sensor on the deck.
    uncertainty
        By path ("contact.constant", "irregularity.0.height", "speed", "track.mass"), the relative standard deviation of
        the stated value, which is normally distributed. Fields that are not named are known exactly, except those that
        a diagnosis estimates.
    misfit
        Rms of the part of healthy recordings that the model of one wheelset leaves unexplained, over the rms of these
        recordings. It is measured with known wheelsets. A diagnosis adds it to the noise.
    trigger
        Standard deviation of the trigger's time, s; 0 if time zero of a recording is exactly at x = 0. None (in a file
        "none"): there is no trigger, and the passage is found in the recording.
    name
        Name of the site.
    """

    passage: Scenario
    sensor: Sensor = Sensor()
    uncertainty: dict[str, Share] = Field(default_factory=dict)
    misfit: Share = 0.0
    trigger: Annotated[Spread | None, BeforeValidator(_none_or_given)] = 0.0
    name: str = ""

    @field_validator("uncertainty", mode="after")
    @classmethod
    def _sorted_uncertainty(cls, value: dict[str, float]) -> dict[str, float]:
        return dict(sorted(value.items()))

    @field_serializer("trigger")
    def _trigger_in_words(self, value: float | None) -> float | str:
        return NO_TRIGGER if value is None else value

    @model_validator(mode="after")
    def _check_passage(self) -> Site:
        try:
            run.choose(run.DIAGNOSE, self.passage.needs)
        except InputError as error:
            raise error.within("passage") from None
        for path in self.uncertainty:
            try:
                self.passage.replaced({path: None})
            except InputError as error:
                if "no such field" in error.found:
                    raise InputError("", "uncertainty", repr(path), "paths of numbers in the passage") from error
            held: Any = self.passage
            for part in path.split("."):
                held = held[int(part)] if part.isdigit() else getattr(held, part)
            if isinstance(held, bool) or not isinstance(held, int | float):
                raise InputError("", "uncertainty", f"{path!r}, where there is no number", "paths of numbers")
        return self

    def __hash__(self) -> int:
        return hash((self.passage, self.sensor, tuple(self.uncertainty.items()), self.misfit, self.trigger, self.name))

    @classmethod
    def from_toml(cls, path: str | Path) -> Site:
        """Read a site; files that it names are taken relative to it."""
        path = as_path(path, "path", "the path of a TOML file with a site")
        data = toml_table(path, "a site")
        return cls.of(relative_paths(data, path.parent), str(path))

    @classmethod
    def of(cls, data: dict[str, Any], source: str = "") -> Site:
        """Return the site that a table describes; errors name `source`."""
        try:
            return cls.model_validate(data)
        except InputError as error:
            raise error.at(source) from None


def as_site(given: Any) -> Site:
    """Return a site; for a path, the one that the TOML file describes."""
    if isinstance(given, Site):
        return given
    return Site.from_toml(as_path(given, "site", "a Site, or the path of its TOML file"))

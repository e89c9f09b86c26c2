"""A floating deck used as a scale (the paper, Fig. 1b)."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field, model_validator

from wheeltapper.describe.noun import Damping, Length, Mass, PositiveLength, Stiffness
from wheeltapper.describe.track.base import Track
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import DECK, DECK_ENDS, Need


class FloatingDeck(Track):
    """A rigid deck of mass M on a bearing K-C_d, prestressed: at rest at zero under the static wheel load N0.

    M·ÿ_M = -(N - N0) - K·y_M - C_d·ẏ_M (the paper, equation 2.3, with the bearing's damping, which it omits). While the
    wheel is off the deck, a constant force equal to the prestress acts instead. At entry the wheel replaces it, and the
    indentation jumps by y_M; at exit it jumps by -y_M. Below several wheelsets, N and N0 are sums over the wheelsets on
    the deck, each of which replaces its own static force.

    Parameters
    ----------
    mass
        M, kg.
    stiffness
        K of the bearing, N/m.
    damping
        C_d of the bearing, N·s/m.
    start
        Position of the entry, m; None: the whole track is the deck.
    length
        Length, m; None: the deck has no end.
    wheelset
        Number of the only wheelset that the deck carries, of several. None: it carries every wheelset between its ends.
        Below a wagon the N0 of a deck with ends is the static force of one wheelset. It acts while no wheelset is on
        the deck.
    """

    example: ClassVar[dict[str, Any]] = {"mass": 5000.0, "stiffness": 2e7, "damping": 1e4}
    mass: Mass
    stiffness: Stiffness
    damping: Damping = 0.0
    start: Length | None = None
    length: PositiveLength | None = None
    wheelset: int | None = Field(default=None, ge=1)

    @model_validator(mode="after")
    def _length_needs_a_start(self) -> FloatingDeck:
        if self.length is not None and self.start is None:
            raise InputError("", "", "a length without a start", "both, a start alone, or neither")
        return self

    @property
    def needs(self) -> frozenset[Need]:
        """What the march has to handle: the deck, and its ends, where it has one."""
        return frozenset({DECK}) if self.start is None else frozenset({DECK, DECK_ENDS})

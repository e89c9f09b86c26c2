"""Linear contact, for comparison with the literature's bilateral models."""

from __future__ import annotations

from typing import Any, ClassVar

from wheeltapper.describe.contact.base import Contact
from wheeltapper.describe.noun import PositiveStiffness
from wheeltapper.ground.needs import BILATERAL, LINEAR, Need


class Linear(Contact):
    """A linear contact spring, N = k_H·δ.

    Parameters
    ----------
    stiffness
        k_H per wheelset, N/m; each wheel of a wagon has half of it. The value (3/2)·C·sqrt(δ0) linearises a Hertz
        contact at its static indentation δ0.
    bilateral
        True: the contact also pulls (N < 0) and is never lost, as in the models that the paper criticises.
        False: it can only push.
    """

    example: ClassVar[dict[str, Any]] = {"stiffness": 1.9e9}
    stiffness: PositiveStiffness
    bilateral: bool = False

    @property
    def needs(self) -> frozenset[Need]:
        """What the march has to handle: a linear contact, and that it pulls if it does."""
        return frozenset({LINEAR, BILATERAL} if self.bilateral else {LINEAR})

"""The functions that make steps, by number: which a wheel needs, and where kernels find them."""

from __future__ import annotations

from itertools import accumulate
from typing import cast

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import inlined_uncounted_kernel, uncounted_kernel
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.steps.equations import BENT, FLAT, WAVE, Free, Terms
from wheeltapper.march.steps.held_end import damper_ends
from wheeltapper.march.steps.layout import int64_positions
from wheeltapper.march.steps.steplength import SLOW

PATHS = (FLAT, WAVE, BENT)
OVER_WAVE, OVER_BENT = 1, 2
OF_LOSSY, OF_DECK, OF_ENDED, OF_YIELDING = 3, 6, 12, 20
"""Where in their list terms stand, from the number of the path on; with a damper's end there are two paths."""
VARIANTS = (
    *(Terms(path, lossy, deck) for deck in (False, True) for lossy in (False, True) for path in PATHS),
    *(
        Terms(path, lossy, deck, end=True)
        for deck in (False, True) for lossy in (False, True) for path in (FLAT, BENT)
    ),
    *(Terms(path, deck=deck, yields=True) for deck in (False, True) for path in (FLAT, BENT)),
)  # fmt: skip
"""What a contact step may have, by the number of its function."""
FLIES = len(VARIANTS)
FREE = tuple(
    Free(bonded, deck, end) for bonded, end in ((False, False), (True, False), (False, True)) for deck in (False, True)
)
"""What a step in time may have, by the number of its function, counted from FLIES."""
BEGINS_TO_YIELD, PUSHES = int64_positions([FLIES + len(FREE), FLIES + len(FREE) + 1])
"""Which functions tell where a surface begins to yield that does not bear the same everywhere, and the force by s."""
ONE_WHEEL = int(PUSHES) + 1
"""How many functions one wheel has."""
TURN_PIECE, TURN_JOINT, TURN_PUSH = int64_positions(
    OF_ENDED + sum(not terms.end for terms in FREE) + k for k in range(3)
)
"""Which functions differentiate a piece of the path about a step's start, and at a joint of two, and the force by s."""
TURNED = int(TURN_PUSH) + 1
"""How many functions differentiate: elastic contacts, steps in time without a damper's end, then these."""


def _numbered(*counts: int) -> tuple[int, ...]:
    """Return where groups of functions begin, and how many there are in all; NumPy integers, as kernels want them."""
    return cast("tuple[int, ...]", tuple(np.int64(n) for n in accumulate(counts, initial=0)))


(
    STEPS, FLIGHTS, FLIGHT_ENDS, SEEK_LOSS, SEEK_TURN, SEEK_EXTREME, SEEK_TIME, SCAN, SHARPEN, AT_ROOT, DECK_AT_END,
    BUSH_AT_END, SCAN_FLIGHT, SHARPEN_FLIGHT, BASES, ALONGS, TURN_LEVEL, TURN_BENT, IN_LANES,
) = _numbered(OF_YIELDING, 4, 4, *(1,) * 11, OF_ENDED, OF_ENDED, 1, 1)  # fmt: skip
"""Functions of eight cells at a time: steps of each kind, flights beside a deck and over one, the same with a bush, and
what ends them; then tangents of steps of each kind, and of what they go over. IN_LANES is how many there are."""


@uncounted_kernel
def variant_of(numbers: FloatArray, piece: FloatArray, yields: bool) -> int:
    """Return the number of the function that makes contact steps over a piece of the path."""
    lossy = 1 if numbers[contract.HYSTERESIS] != 0.0 else 0
    deck = 1 if numbers[contract.DECK_MASS] > 0.0 else 0
    bent, wavy = piece[contract.DEGREE] > 0.0, piece[contract.WAVENUMBER] != 0.0
    if yields:
        return OF_YIELDING + 2 * deck + (1 if bent or wavy else 0)
    bent = bent or piece[contract.FACTOR_DEGREE] >= 0.0
    if damper_ends(numbers):
        return OF_ENDED + 4 * deck + 2 * lossy + (1 if bent or wavy else 0)
    return OF_DECK * deck + OF_LOSSY * lossy + (OVER_BENT if bent else OVER_WAVE if wavy else 0)


@inlined_uncounted_kernel
def is_bent(variant: int) -> bool:
    """Return True for elastic contacts over a bent path."""
    return variant % OF_LOSSY == OVER_BENT if variant < OF_ENDED else variant % 2 == 1


@inlined_uncounted_kernel
def is_flat(variant: int) -> bool:
    """Return True for elastic contacts over a level path."""
    return variant % OF_LOSSY == 0


@inlined_uncounted_kernel
def is_lossy(variant: int) -> bool:
    """Return True for elastic contacts with hysteresis."""
    return variant % OF_DECK >= OF_LOSSY if variant < OF_ENDED else variant % 4 >= 2


@inlined_uncounted_kernel
def has_deck(variant: int) -> bool:
    """Return True for elastic contacts on a deck."""
    return variant >= (OF_DECK if variant < OF_ENDED else OF_ENDED + 4)


@inlined_uncounted_kernel
def has_bush(variant: int) -> bool:
    """Return True for elastic contacts of wheels whose dampers have ends; in lanes all of them are held by bushes."""
    return variant >= OF_ENDED


@inlined_uncounted_kernel
def in_flight_of(variant: int) -> int:
    """Return the number of the flights that belong to an elastic contact, counted from FLIGHTS."""
    return (1 if has_deck(variant) else 0) + (2 if has_bush(variant) else 0)


@inlined_uncounted_kernel
def touching_of(flight: int) -> int:
    """Return a contact over a bent path with what a flight has."""
    deck = flight % 2
    return OF_ENDED + 4 * deck + 1 if flight >= 2 else OF_DECK * deck + OVER_BENT


@uncounted_kernel
def free_variant_of(numbers: FloatArray) -> int:
    """Return the number of the function that makes steps in time."""
    kind = 4 if damper_ends(numbers) else 2 if numbers[contract.BILATERAL] != 0.0 else 0
    return FLIES + kind + (1 if numbers[contract.DECK_MASS] > 0.0 else 0)


@uncounted_kernel
def variants_over(numbers: FloatArray, pieces: FloatArray, yields: bool) -> int:
    """Return which functions one wheel over a path needs, as the bits of a number."""
    out = 1 << free_variant_of(numbers)
    for i in range(pieces.shape[0]):
        out |= 1 << variant_of(numbers, pieces[i], False)
        if yields:
            out |= 1 << variant_of(numbers, pieces[i], True)
            if pieces[i, contract.BEARS_DEGREE] > 0.0:
                out |= 1 << BEGINS_TO_YIELD
        if numbers[contract.MEMORY] != 0.0:  # over what a contact leaves of its spot there is a factor on the force
            out |= 1 << (variant_of(numbers, pieces[i], False) // OF_LOSSY * OF_LOSSY + OVER_BENT)
    return out


@uncounted_kernel
def variants_of_cells(numbers: FloatArray, pieces: FloatArray) -> int:
    """Return which functions the marches of cells (cells, NUMBERS) over some pieces need, one by one or in lanes."""
    seen, out = 0, 0
    for cell in range(numbers.shape[0]):
        own = numbers[cell]
        fast = own[contract.STIFFNESS] + own[contract.DAMPING] > SLOW
        kind = (1 if own[contract.HYSTERESIS] != 0.0 else 0) + (2 if own[contract.DECK_MASS] > 0.0 else 0)
        kind += 4 if damper_ends(own) else 0
        if not seen >> kind & 1:
            seen |= 1 << kind
            out |= variants_over(own, pieces, False)
        if fast:
            out |= 1 << OVER_BENT
    return out

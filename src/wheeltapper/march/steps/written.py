"""The functions that make steps, written and compiled when a march first needs them.

A process runs only lines that it has derived itself. What is kept in the folder of compiled kernels is their machine
code, by the name of the function; like that of all kernels it belongs to one state of the sources.

    print(written.text(Terms("bent", factor=True), 12))      # what such a function does, line by line
"""

from __future__ import annotations

import linecache
import math
from functools import cache
from typing import Any

import numpy as np

from wheeltapper.march import layout, steplength
from wheeltapper.march import program as contract
from wheeltapper.march.compiling.sources import FOLDER
from wheeltapper.march.kernel import kernel
from wheeltapper.march.program import FloatArray
from wheeltapper.march.series import harmonic_at
from wheeltapper.march.steps import scalar
from wheeltapper.march.steps.calling import address_of
from wheeltapper.march.steps.equations import BENT, FLAT, WAVE, Free, Terms

PATHS = (FLAT, WAVE, BENT)
OVER_WAVE, OVER_BENT = 1, 2
FORGIVEN = 2.0
"""Binary logarithm of how much larger than by a steady decay earlier terms may be before they shorten a step."""
SAME_PLACE = 1e-12
"""Displacements and velocities (scaled) that differ by less are the same."""
OF_LOSSY, OF_DECK, OF_YIELDING, OF_ENDED = 3, 6, 12, 16
"""Where in their list terms stand, from the number of the path on."""
VARIANTS = (
    *(Terms(path, lossy, deck) for deck in (False, True) for lossy in (False, True) for path in PATHS),
    *(Terms(path, deck=deck, yields=True) for deck in (False, True) for path in (FLAT, BENT)),
    *(
        Terms(path, lossy, deck, end=True)
        for deck in (False, True) for lossy in (False, True) for path in (FLAT, BENT)
    ),
)  # fmt: skip
"""What a contact step may have, by the number of its function."""
FLIES = len(VARIANTS)
FREE = tuple(
    Free(bonded, deck, end) for bonded, end in ((False, False), (False, True), (True, False)) for deck in (False, True)
)
"""What a step in time may have, by the number of its function, counted from FLIES."""
_addresses = {order: np.zeros(FLIES + len(FREE)) for order in (contract.DEFAULT_ORDER, contract.STRICT_ORDER)}
_written: dict[int, int] = dict.fromkeys(_addresses, 0)
"""The functions that are there, as the bits of a number for each order."""


@kernel
def variant_of(numbers: FloatArray, piece: FloatArray, yields: bool, ended: bool) -> int:
    """Return the number of the function that makes contact steps over a piece of the path."""
    lossy = 1 if numbers[contract.HYSTERESIS] != 0.0 else 0
    deck = 1 if numbers[contract.DECK_MASS] > 0.0 else 0
    bent, wavy = piece[contract.DEGREE] > 0.0, piece[contract.WAVENUMBER] != 0.0
    if yields:
        return OF_YIELDING + 2 * deck + (1 if bent or wavy else 0)
    bent = bent or piece[contract.FACTOR_DEGREE] >= 0.0
    if ended:
        return OF_ENDED + 4 * deck + 2 * lossy + (1 if bent or wavy else 0)
    return OF_DECK * deck + OF_LOSSY * lossy + (OVER_BENT if bent else OVER_WAVE if wavy else 0)


@kernel
def free_variant_of(numbers: FloatArray, ended: bool) -> int:
    """Return the number of the function that makes steps in time."""
    kind = 2 if ended else 4 if numbers[contract.BILATERAL] != 0.0 else 0
    return FLIES + kind + (1 if numbers[contract.DECK_MASS] > 0.0 else 0)


@kernel
def variants_over(numbers: FloatArray, pieces: FloatArray, yields: bool, ended: bool) -> int:
    """Return which functions a path needs, as the bits of a number."""
    out = 1 << free_variant_of(numbers, ended)
    for i in range(pieces.shape[0]):
        out |= 1 << variant_of(numbers, pieces[i], False, ended)
        if yields:
            out |= 1 << variant_of(numbers, pieces[i], True, ended)
        if numbers[contract.MEMORY] != 0.0:  # over what a contact leaves of its spot there is a factor on the force
            out |= 1 << (variant_of(numbers, pieces[i], False, False) // OF_LOSSY * OF_LOSSY + OVER_BENT)
    return out


def text(terms: Terms | Free, order: int) -> str:
    """Return the source of a function; steps in time have one order."""
    return scalar.free_source(terms) if isinstance(terms, Free) else scalar.source(terms, order)


@cache
def function(terms: Terms | Free, order: int) -> Any:
    """Return a function, ready to be compiled; tracebacks and debuggers see its lines."""
    code, name = text(terms, order), f"{terms.name}_{order}"
    file = str(FOLDER / "steps" / f"{name}.py")
    linecache.cache[file] = len(code), None, code.splitlines(keepends=True), file
    made: dict[str, Any] = vars(contract) | vars(layout) | vars(math) | vars(steplength)
    made |= {"harmonic_at": harmonic_at, "np": np, "FORGIVEN": FORGIVEN, "SAME_PLACE": SAME_PLACE, "__name__": __name__}
    exec(compile(code, file, "exec"), made)
    return kernel(made[name])


def write_all(order: int) -> None:
    """Write all functions of an order that are not there yet."""
    _with_functions(order, (1 << FLIES + len(FREE)) - 1)


def _with_functions(order: int, needed: int) -> FloatArray:
    """Return scratch memory with functions, whose bits `needed` has, and write those that are not there yet."""
    missing = needed & ~_written[order]
    if missing:
        for number, terms in enumerate((*VARIANTS, *FREE)):
            if missing >> number & 1:
                made = function(terms, int(layout.FLIGHT_ORDER) if isinstance(terms, Free) else order)
                _addresses[order][number] = address_of(made)
        _written[order] |= missing
    S = np.zeros(layout.SCRATCH)
    S[[layout.U_CEILING, layout.PLACE_FLOOR, layout.PLACE_CEILING]] = np.inf, -np.inf, np.inf
    S[layout.FUNCTIONS : layout.FUNCTIONS + FLIES + len(FREE)] = _addresses[order]
    return S


def scratch_for(program: contract.Program) -> FloatArray:
    """Return scratch memory for a program's march, with the functions for its steps in it."""
    numbers, pieces = program.numbers, program.pieces
    needed = variants_over(numbers, pieces, len(program.law) > 0, len(program.damper) > 0)
    return _with_functions(int(numbers[contract.ORDER]), needed)


def scratch_of_cells(numbers: FloatArray, pieces: FloatArray) -> FloatArray:
    """Return scratch memory for the marches of cells (cells, NUMBERS), all of one order, over these pieces."""
    if len(numbers) == 0:
        return np.zeros(layout.SCRATCH)
    lossy, with_deck = numbers[:, contract.HYSTERESIS] != 0.0, numbers[:, contract.DECK_MASS] > 0.0
    needed = 0
    for first in np.unique(2 * lossy + with_deck, return_index=True)[1]:
        needed |= variants_over(numbers[first], pieces, False, False)
    return _with_functions(int(numbers[0, contract.ORDER]), needed)

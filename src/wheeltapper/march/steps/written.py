"""The functions that make steps, written and compiled when a march first needs them.

A process runs only lines that it has derived itself. What is kept in the folder of compiled kernels is their machine
code, by the name of the function; like that of all kernels it belongs to one state of the sources.

    print(scalar.source(Terms("bent", hysteresis=True), 12))      # what such a function does, line by line
"""

from __future__ import annotations

import linecache
import math
import threading
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.compiling.sources import STEPS as FOLDER
from wheeltapper.march.steps import lane_rows as at
from wheeltapper.march.steps import lanes, layout, powers, scalar, steplength, tangent_path, tangents, variants
from wheeltapper.march.steps.calling import EIGHT, ONE, TURNED, address_of
from wheeltapper.march.steps.condensed import condensed
from wheeltapper.march.steps.equations import Free
from wheeltapper.march.steps.series import harmonic_at
from wheeltapper.march.steps.variants import FLIES, FREE, OF_ENDED, VARIANTS, variants_of_cells, variants_over

FORGIVEN = 2.0
"""Binary logarithm of how much larger than by a steady decay earlier terms may be before they shorten a step."""
SAME_PLACE = 1e-12
"""Displacements and velocities (scaled) that differ by less are the same."""
ORDERS = contract.DEFAULT_ORDER, contract.STRICT_ORDER
_SEARCHES = {
    variants.SEEK_LOSS: lanes.seek_loss, variants.SEEK_TURN: lanes.seek_turn,
    variants.SEEK_EXTREME: lanes.seek_extreme, variants.SEEK_TIME: lanes.seek_time, variants.SCAN: lanes.scan,
    variants.SHARPEN: lanes.sharpen, variants.AT_ROOT: lanes.at_root, variants.DECK_AT_END: lanes.deck_at_end,
    variants.BUSH_AT_END: lanes.bush_at_end,
}  # fmt: skip


def source(number: int, order: int) -> str:
    """Return the source of a function for one wheel."""
    if number < FLIES:
        return scalar.source(VARIANTS[number], order)
    if number < variants.BEGINS_TO_YIELD:
        return scalar.free_source(FREE[number - FLIES])
    return scalar.yielding_source(order) if number == variants.BEGINS_TO_YIELD else scalar.pushing_source(order)


def source_in_lanes(number: int, order: int) -> str:
    """Return the source of a function for eight cells at a time."""
    if number < variants.FLIGHTS:
        return lanes.contact_source(VARIANTS[number], order)
    if number < variants.SEEK_LOSS:
        way = lanes.free_source if number < variants.FLIGHT_ENDS else lanes.free_end_source
        have = int(number - variants.FLIGHTS)
        return way(Free(deck=bool(have % 2), end=bool(have // 2 % 2)))
    if number in _SEARCHES:
        return _SEARCHES[number](order)
    if number in (variants.SCAN_FLIGHT, variants.SHARPEN_FLIGHT):
        return (lanes.scan if number == variants.SCAN_FLIGHT else lanes.sharpen)(int(layout.FLIGHT_ORDER))
    if number >= variants.TURN_LEVEL:
        return tangents.turn_source(bent=bool(number == variants.TURN_BENT))
    base, along = tangents.pair(VARIANTS[int(number - variants.BASES) % OF_ENDED], order)
    return base if number < variants.ALONGS else along


def source_of_tangents(number: int, order: int) -> str:
    """Return the source of a function that differentiates a step of one wheel, or the path under it."""
    if number < OF_ENDED:
        return tangents.turned_source(VARIANTS[number], order)
    if number == variants.TURN_PUSH:
        return tangents.turned_push_source(order)
    if number >= variants.TURN_PIECE:
        return tangents.turned_piece_source() if number == variants.TURN_PIECE else tangents.turned_joint_source()
    return tangents.free_turned_source(FREE[number - OF_ENDED])


def _known() -> dict[str, Any]:
    """Return what the names in a source mean."""
    known = vars(contract) | vars(layout) | vars(at) | vars(math) | vars(steplength) | vars(tangent_path)
    own = {"harmonic_at": harmonic_at, "np": np, "FORGIVEN": FORGIVEN, "SAME_PLACE": SAME_PLACE}
    return known | own | {"__name__": __name__}


def interpreted(code: str) -> Any:
    """Return the function of a source, in Python; tracebacks and debuggers see its lines."""
    name = code[len("def ") : code.index("(")]
    file = str(FOLDER / f"{name}.py")
    linecache.cache[file] = len(code), None, code.splitlines(keepends=True), file
    made = _known()
    exec(compile(code, file, "exec"), made)
    return made[name]


@cache
def compiled(code: str) -> Any:
    """Return the function of a source, ready to be compiled, with calls in place of its long runs."""
    function = interpreted(code)
    kernel = uncounted_kernel(function)

    def shortened() -> Any:
        made = _known()
        short, runs = condensed(code, made)
        made |= runs
        exec(compile(short, function.__code__.co_filename, "exec"), made)
        return made[function.__name__]

    if kernel is not function:  # as it is where Numba is switched off
        kernel.shortened = shortened
    return kernel


class _Functions:
    """Functions by number, of which those that were needed are there; by order, where their machine code is."""

    def __init__(self, count: int, source: Callable[[int, int], str], signature: Any) -> None:
        self.source, self.signature = source, signature
        self.all = (1 << int(count)) - 1
        self.addresses = {order: np.zeros(count) for order in ORDERS}
        self._there = dict.fromkeys(ORDERS, 0)
        self._writing = threading.Lock()

    def with_bits(self, order: int, needed: int) -> FloatArray:
        """Return all addresses; those whose bits are set are there afterwards."""
        found = self.addresses[order]
        if needed & ~self._there[order]:
            with self._writing:  # threads that need the same one write it once
                for number in range(len(found)):
                    if needed & ~self._there[order] & 1 << number:
                        found[number] = address_of(compiled(self.source(number, order)), self.signature)
                        self._there[order] |= 1 << number
        return found


one_wheel = _Functions(variants.ONE_WHEEL, source, ONE)
in_lanes = _Functions(variants.IN_LANES, source_in_lanes, EIGHT)
of_one_wheel = _Functions(variants.TURNED, source_of_tangents, TURNED)
of_energy = _Functions(len(powers.KINDS), lambda number, order: powers.source(number), EIGHT)
EVERY = one_wheel, in_lanes, of_one_wheel, of_energy


def write_all(order: int) -> None:
    """Write all functions of an order that are not there yet."""
    for functions in EVERY:
        functions.with_bits(order, functions.all)


def _scratch(order: int, needed: int) -> FloatArray:
    """Return scratch memory with the functions of one wheel whose bits are set."""
    S = np.zeros(layout.SCRATCH)
    S[[layout.U_CEILING, layout.PLACE_FLOOR, layout.PLACE_CEILING]] = np.inf, -np.inf, np.inf
    S[layout.FUNCTIONS : layout.FUNCTIONS + variants.ONE_WHEEL] = one_wheel.with_bits(order, needed)
    return S


def scratch_for(program: contract.Program, pushes: bool = False) -> FloatArray:
    """Return scratch memory for a program's march, with the functions for its steps; `pushes`: for impulses, too."""
    numbers, pieces = program.numbers, program.pieces
    needed = variants_over(numbers, pieces, len(program.law) > 0) | int(pushes) << int(variants.PUSHES)
    return _scratch(int(numbers[contract.ORDER]), needed)


def _order_of_cells(numbers: FloatArray) -> int:
    """Return the order of the series, the same for all cells."""
    return int(numbers[0, contract.ORDER]) if len(numbers) else contract.DEFAULT_ORDER


def scratch_of_cells(
    numbers: FloatArray, pieces: FloatArray, turned: bool = False, lossy: bool = False, pushes: bool = False
) -> FloatArray:
    """Return scratch memory for the marches of cells (cells, NUMBERS), all of one order, over these pieces.

    `turned`: with tangents; `lossy`: by the hysteresis of their contacts, too; `pushes`: with impulses.
    """
    order = _order_of_cells(numbers)
    needed = variants_of_cells(numbers, pieces) | int(pushes) << int(variants.PUSHES)
    S = _scratch(order, needed)
    if turned:
        bits = _turned_kinds(needed, lossy) | needed >> FLIES << OF_ENDED
        bits |= 1 << int(variants.TURN_PIECE) | 1 << int(variants.TURN_JOINT) | int(pushes) << int(variants.TURN_PUSH)
        S[layout.DERIVATIVES : layout.DERIVATIVES + variants.TURNED] = of_one_wheel.with_bits(order, bits)
    return S


def _turned_kinds(needed: int, lossy: bool) -> int:
    """Return the kinds of elastic contacts that are differentiated; what they are differentiated by counts as there."""
    kinds = needed & ((1 << OF_ENDED) - 1)
    if lossy:
        plain = sum(1 << one for one in range(OF_ENDED) if not VARIANTS[one].hysteresis)
        kinds = (kinds | (kinds & plain) << variants.OF_LOSSY) & ~plain
    return kinds


def functions_of_energy(yields: bool) -> FloatArray:
    """Return the addresses of the functions for energies (powers.py); `yields`: of a wheel whose contact may yield."""
    return of_energy.with_bits(contract.DEFAULT_ORDER, 0b111 if yields else 0b011)


def functions_of_cells(numbers: FloatArray, pieces: FloatArray) -> FloatArray:
    """Return the addresses of the functions by which such cells march in lanes."""
    bits = variants_of_cells(numbers, pieces) & ((1 << variants.OF_YIELDING) - 1)
    for terms in [terms for one, terms in enumerate(VARIANTS) if bits >> one & 1]:
        flight = terms.deck + 2 * terms.end
        bits |= 1 << int(variants.FLIGHTS) + flight | 1 << int(variants.FLIGHT_ENDS) + flight
        bits |= terms.deck << int(variants.DECK_AT_END) | terms.end << int(variants.BUSH_AT_END)
    for one in (*range(variants.SEEK_LOSS, variants.DECK_AT_END), variants.SCAN_FLIGHT, variants.SHARPEN_FLIGHT):
        bits |= 1 << int(one)
    return in_lanes.with_bits(_order_of_cells(numbers), bits)


def tangents_of_cells(numbers: FloatArray, pieces: FloatArray, lossy: bool) -> FloatArray:
    """Return the addresses of the functions that differentiate their steps; `lossy`: by their hysteresis, too."""
    kinds = _turned_kinds(variants_of_cells(numbers, pieces), lossy)
    bits = kinds << int(variants.BASES) | kinds << int(variants.ALONGS)
    for number in range(OF_ENDED):
        if kinds >> number & 1:
            bits |= 1 << int(variants.TURN_BENT if variants.is_bent(number) else variants.TURN_LEVEL)
    return in_lanes.with_bits(_order_of_cells(numbers), bits)

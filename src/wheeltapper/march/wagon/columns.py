"""Sums of weighted columns, eight rows at a time. Only here the kernels use vector types of the machine.

In Numba's loops over eight rows the sums do not stay in registers. Written as vectors they do, and the linear part of a
coach costs a tenth.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload
from numba.np import arrayobj

from wheeltapper.march.common.program import FloatArray, IntArray

ROWS = 8
TOGETHER = 4
"""The number of columns is a multiple of this, because that many sums are formed side by side."""
VECTOR = ir.VectorType(ir.DoubleType(), ROWS)
FUSED = ("contract",)
SPLAT = ir.Constant(ir.VectorType(ir.IntType(32), ROWS), [0] * ROWS)


def add_columns(
    data: FloatArray, columns: int, plan: IntArray, index: int, first: int, last: int, x: FloatArray, out: FloatArray,
    at: int,
) -> None:  # fmt: skip
    """Add to out[at : at + 8] the sum over c in first:last of the columns data[columns + 8·c + …]·x[plan[index + c]].

    The number of columns is a multiple of four.
    """
    held = data[columns + ROWS * first : columns + ROWS * last].reshape(-1, ROWS)
    out[at : at + ROWS] += held.T @ x[plan[index + first : index + last]]


def _generate_sum(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    data, columns, plan, index, first, last, x, out, at = arguments
    kinds = signature.args

    def start_sums(number: int, value: Any) -> Any:
        return arrayobj.make_array(kinds[number])(context, builder, value).data

    weights = builder.gep(start_sums(0, data), [columns])
    places = builder.gep(start_sums(2, plan), [index])
    values = start_sums(6, x)
    sums = [cgutils.alloca_once_value(builder, ir.Constant(VECTOR, [0.0] * ROWS)) for _ in range(TOGETHER)]
    size = first.type
    with cgutils.for_range_slice(builder, first, last, ir.Constant(size, TOGETHER)) as (column, _):
        for k, total in enumerate(sums):
            here = builder.add(column, ir.Constant(size, k))
            value = builder.load(builder.gep(values, [builder.load(builder.gep(places, [here]))]))
            lane = builder.insert_element(ir.Constant(VECTOR, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
            spread = builder.shuffle_vector(lane, ir.Constant(VECTOR, ir.Undefined), SPLAT)
            place = builder.gep(weights, [builder.mul(here, ir.Constant(size, ROWS))])
            weight = builder.load(builder.bitcast(place, VECTOR.as_pointer()), align=8)
            product = builder.fmul(weight, spread, flags=FUSED)
            builder.store(builder.fadd(product, builder.load(total), flags=FUSED), total)
    one, two, three, four = (builder.load(total) for total in sums)
    target = builder.bitcast(builder.gep(start_sums(7, out), [at]), VECTOR.as_pointer())
    whole = builder.fadd(builder.fadd(one, two), builder.fadd(three, four))
    builder.store(builder.fadd(builder.load(target, align=8), whole), target, align=8)
    return context.get_dummy_value()


@intrinsic
def _add_columns(
    _: Any, data: Any, columns: Any, plan: Any, index: Any, first: Any, last: Any, x: Any, out: Any, at: Any
) -> Any:
    size = types.intp
    return types.void(data, size, plan, size, size, size, x, out, size), _generate_sum


@overload(add_columns, inline="always")
def _compiled_sum(
    data: Any, columns: Any, plan: Any, index: Any, first: Any, last: Any, x: Any, out: Any, at: Any
) -> Any:
    def call_sum(
        data: Any, columns: Any, plan: Any, index: Any, first: Any, last: Any, x: Any, out: Any, at: Any
    ) -> None:
        _add_columns(data, columns, plan, index, first, last, x, out, at)  # type: ignore[call-arg]

    return call_sum


def packed_columns(columns: list[tuple[int, FloatArray]]) -> tuple[list[int], list[FloatArray]]:
    """Return indices and columns of eight, filled up with zeros to a multiple of four."""
    missing = -len(columns) % TOGETHER
    filled = [*columns, *[(0, np.zeros(ROWS))] * missing]
    return [place for place, _ in filled], [column for _, column in filled]

"""Modes of a track: what they show a contact over a macro step, and what its force does to them.

Tables hold Legendre coefficients over the macro step, one row each for degree l, real and imaginary part; modes are
ordered by their rates, and in row l those before `first[l]` are left out, since so slow a mode has nothing of degree l.
"""

from __future__ import annotations

from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.general.layout import IM, RE

TOGETHER = 4
"""Columns, of cells or of directions, that are multiplied at a time."""
IN_1, IN_2, IN_3, IN_4 = range(TOGETHER)
ROWS_TOGETHER = 5
OF_1, OF_2, OF_3, OF_4, OF_5 = range(ROWS_TOGETHER)
"""Columns and rows of such a product."""


@uncounted_kernel
def read_modes(rows: FloatArray, first: IntArray, re: FloatArray, im: FloatArray, c: FloatArray) -> None:
    """Add to the coefficients c what the modes' free motion gives; `rows` is (q, 2, modes)."""
    for m in range(len(c)):
        begin = first[m]
        real = rows[m, RE, begin:]  # with views from the first mode on, loops are known to be in range, and vectorised
        imaginary = rows[m, IM, begin:]
        x = re[begin:]
        y = im[begin:]
        total = 0.0
        for n in range(len(x)):
            total += real[n] * x[n] + imaginary[n] * y[n]
        c[m] += total


@uncounted_kernel
def _write_pair(one: float, two: float, first: FloatArray, second: FloatArray, x: FloatArray) -> None:
    for n in range(len(x)):
        x[n] += one * first[n] + two * second[n]


@uncounted_kernel
def write_modes(rows: FloatArray, first: IntArray, moments: FloatArray, re: FloatArray, im: FloatArray) -> None:
    """Add to the amplitudes what the moments of a force give."""
    q = len(moments)
    for m in range(0, q, 2):
        other = min(m + 1, q - 1)
        begin = first[m]
        two = moments[other] if other > m else 0.0
        _write_pair(moments[m], two, rows[m, RE, begin:], rows[other, RE, begin:], re[begin:])
        _write_pair(moments[m], two, rows[m, IM, begin:], rows[other, IM, begin:], im[begin:])


@uncounted_kernel
def turned(factor: FloatArray, re: FloatArray, im: FloatArray, out_re: FloatArray, out_im: FloatArray) -> None:
    """Write amplitudes times complex factors, (2, modes)."""
    real = factor[RE]
    imaginary = factor[IM]
    for n in range(len(re)):
        x = re[n]
        y = im[n]
        out_re[n] = x * real[n] - y * imaginary[n]
        out_im[n] = x * imaginary[n] + y * real[n]


@uncounted_kernel
def turn(factor: FloatArray, re: FloatArray, im: FloatArray) -> None:
    """Multiply amplitudes by complex factors, (2, modes)."""
    real = factor[RE]
    imaginary = factor[IM]
    for n in range(len(re)):
        x = re[n]
        re[n] = x * real[n] - im[n] * imaginary[n]
        im[n] = x * imaginary[n] + im[n] * real[n]


@uncounted_kernel
def add_turned_back(factor: FloatArray, more_re: FloatArray, more_im: FloatArray, re: FloatArray, im: FloatArray) -> None:  # fmt: skip  # noqa: E501
    """Add amplitudes times the conjugate factors."""
    real = factor[RE]
    imaginary = factor[IM]
    for n in range(len(re)):
        re[n] += more_re[n] * real[n] + more_im[n] * imaginary[n]
        im[n] += more_im[n] * real[n] - more_re[n] * imaginary[n]


@uncounted_kernel
def seen_from_first(rows: FloatArray, factor: FloatArray, out: FloatArray) -> None:
    """Write a contact's rows, (q, 2, modes), for amplitudes as the first contact sees them."""
    real, imaginary = factor[RE], factor[IM]
    for m in range(len(rows)):
        x, y = rows[m, RE], rows[m, IM]
        to_re, to_im = out[m, RE], out[m, IM]
        for n in range(len(x)):
            to_re[n] = x[n] * real[n] + y[n] * imaginary[n]
            to_im[n] = y[n] * real[n] - x[n] * imaginary[n]


@uncounted_kernel
def _products(one: FloatArray, two: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> tuple[float, float, float, float, float, float, float, float]:  # fmt: skip  # noqa: E501
    """Return the products of two rows with each of four columns."""
    a1, b1, c1, d1, a2, b2, c2, d2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for n in range(len(one)):
        first, second = float(one[n]), float(two[n])
        a1 += first * a[n]
        b1 += first * b[n]
        c1 += first * c[n]
        d1 += first * d[n]
        a2 += second * a[n]
        b2 += second * b[n]
        c2 += second * c[n]
        d2 += second * d[n]
    return a1, b1, c1, d1, a2, b2, c2, d2


@uncounted_kernel
def _products_of_one(one: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> tuple[float, float, float, float]:  # fmt: skip  # noqa: E501
    """Return the products of a row with each of four columns."""
    a1, b1, c1, d1 = 0.0, 0.0, 0.0, 0.0
    for n in range(len(one)):
        first = float(one[n])
        a1 += first * a[n]
        b1 += first * b[n]
        c1 += first * c[n]
        d1 += first * d[n]
    return a1, b1, c1, d1


@uncounted_kernel
def _products_with_pair(one: FloatArray, two: FloatArray, a: FloatArray, b: FloatArray) -> tuple[float, float, float, float]:  # fmt: skip  # noqa: E501
    """Return the products of two rows with each of two columns."""
    a1, b1, a2, b2 = 0.0, 0.0, 0.0, 0.0
    for n in range(len(one)):
        first, second = float(one[n]), float(two[n])
        a1 += first * a[n]
        b1 += first * b[n]
        a2 += second * a[n]
        b2 += second * b[n]
    return a1, b1, a2, b2


@uncounted_kernel
def read_lanes(rows: FloatArray, first: IntArray, modes: FloatArray, out: FloatArray) -> None:
    """Write what the modes' free motion gives each lane, (lanes, q), even in number; `rows` is (q, 2, modes)."""
    q, fours = len(rows), len(modes) - len(modes) % TOGETHER
    for w in range(len(modes)):
        for m in range(q):
            out[w, m] = 0.0
    for part in range(2):
        for m in range(0, q, 2):
            other = min(m + 1, q - 1)
            begin, both = first[m], first[other]
            row, pair = rows[m, part, both:], rows[other, part, both:]
            more = 1.0 if other > m else 0.0
            for w in range(0, fours, TOGETHER):
                if both > begin:  # modes of which the second row has nothing
                    a1, b1, c1, d1 = _products_of_one(
                        rows[m, part, begin:both], modes[w, part, begin:both], modes[w + 1, part, begin:both],
                        modes[w + 2, part, begin:both], modes[w + 3, part, begin:both],
                    )  # fmt: skip
                    out[w, m] += a1
                    out[w + 1, m] += b1
                    out[w + 2, m] += c1
                    out[w + 3, m] += d1
                a1, b1, c1, d1, a2, b2, c2, d2 = _products(
                    row, pair, modes[w, part, both:], modes[w + 1, part, both:], modes[w + 2, part, both:],
                    modes[w + 3, part, both:],
                )  # fmt: skip
                out[w, m] += a1
                out[w + 1, m] += b1
                out[w + 2, m] += c1
                out[w + 3, m] += d1
                out[w, other] += more * a2
                out[w + 1, other] += more * b2
                out[w + 2, other] += more * c2
                out[w + 3, other] += more * d2
            if fours < len(modes):
                a1, b1, a2, b2 = _products_with_pair(
                    rows[m, part, begin:], rows[other, part, begin:], modes[fours, part, begin:],
                    modes[fours + 1, part, begin:],
                )  # fmt: skip
                out[fours, m] += a1
                out[fours + 1, m] += b1
                out[fours, other] += more * a2
                out[fours + 1, other] += more * b2


@uncounted_kernel
def _add_five(one: FloatArray, two: FloatArray, three: FloatArray, four: FloatArray, five: FloatArray, shares: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> None:  # fmt: skip  # noqa: E501
    """Add five rows to each of four columns, times their `shares`, (column, row)."""
    by = shares[IN_1]
    a1, a2, a3, a4, a5 = by[OF_1], by[OF_2], by[OF_3], by[OF_4], by[OF_5]
    by = shares[IN_2]
    b1, b2, b3, b4, b5 = by[OF_1], by[OF_2], by[OF_3], by[OF_4], by[OF_5]
    by = shares[IN_3]
    c1, c2, c3, c4, c5 = by[OF_1], by[OF_2], by[OF_3], by[OF_4], by[OF_5]
    by = shares[IN_4]
    d1, d2, d3, d4, d5 = by[OF_1], by[OF_2], by[OF_3], by[OF_4], by[OF_5]
    for n in range(len(one)):
        r1, r2, r3, r4, r5 = float(one[n]), float(two[n]), float(three[n]), float(four[n]), float(five[n])
        a[n] += a1 * r1 + a2 * r2 + a3 * r3 + a4 * r4 + a5 * r5
        b[n] += b1 * r1 + b2 * r2 + b3 * r3 + b4 * r4 + b5 * r5
        c[n] += c1 * r1 + c2 * r2 + c3 * r3 + c4 * r4 + c5 * r5
        d[n] += d1 * r1 + d2 * r2 + d3 * r3 + d4 * r4 + d5 * r5


@uncounted_kernel
def _add_five_to_pair(one: FloatArray, two: FloatArray, three: FloatArray, four: FloatArray, five: FloatArray, shares: FloatArray, a: FloatArray, b: FloatArray) -> None:  # fmt: skip  # noqa: E501
    """Do so to each of two columns."""
    by = shares[IN_1]
    a1, a2, a3, a4, a5 = by[OF_1], by[OF_2], by[OF_3], by[OF_4], by[OF_5]
    by = shares[IN_2]
    b1, b2, b3, b4, b5 = by[OF_1], by[OF_2], by[OF_3], by[OF_4], by[OF_5]
    for n in range(len(one)):
        r1, r2, r3, r4, r5 = float(one[n]), float(two[n]), float(three[n]), float(four[n]), float(five[n])
        a[n] += a1 * r1 + a2 * r2 + a3 * r3 + a4 * r4 + a5 * r5
        b[n] += b1 * r1 + b2 * r2 + b3 * r3 + b4 * r4 + b5 * r5


@uncounted_kernel
def write_lanes(rows: FloatArray, first: IntArray, moments: FloatArray, modes: FloatArray) -> None:
    """Add to the amplitudes of each lane, of an even number, what the moments of its force give, (lanes, q)."""
    q = len(rows)
    fives, fours = q - q % ROWS_TOGETHER, len(modes) - len(modes) % TOGETHER
    for part in range(2):
        for m in range(0, fives, ROWS_TOGETHER):
            begin = first[m]
            one, two, three = rows[m, part, begin:], rows[m + 1, part, begin:], rows[m + 2, part, begin:]
            four, five = rows[m + 3, part, begin:], rows[m + 4, part, begin:]
            for w in range(0, fours, TOGETHER):
                _add_five(
                    one, two, three, four, five, moments[w : w + TOGETHER, m : m + ROWS_TOGETHER],
                    modes[w, part, begin:], modes[w + 1, part, begin:], modes[w + 2, part, begin:],
                    modes[w + 3, part, begin:],
                )  # fmt: skip
            if fours < len(modes):
                _add_five_to_pair(
                    one, two, three, four, five, moments[fours:, m : m + ROWS_TOGETHER], modes[fours, part, begin:],
                    modes[fours + 1, part, begin:],
                )  # fmt: skip
        for m in range(fives, q):
            begin = first[m]
            for column in range(len(modes)):
                row, out = rows[m, part, begin:], modes[column, part, begin:]
                share = moments[column, m]
                for n in range(len(row)):
                    out[n] += share * row[n]

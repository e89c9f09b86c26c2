"""Modes of a track: what they show a contact over a macro step, and what its force does to them.

Tables hold Legendre coefficients over the macro step, one row each for degree l, real and imaginary part; modes are
ordered by their rates, and in row l those before `first[l]` are left out, since so slow a mode has nothing of degree l.
"""

from __future__ import annotations

from wheeltapper.march.general.layout import IM, RE
from wheeltapper.march.kernel import uncounted_kernel
from wheeltapper.march.program import FloatArray, IntArray


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
def read_modes_of_all(rows: FloatArray, first: IntArray, modes: FloatArray, c: FloatArray) -> None:
    """Do as `read_modes` for several amplitudes, (many, 2, modes), three at a time: c is (many, q)."""
    many = len(modes)
    for one in range(0, many, 3):
        two = min(one + 1, many - 1)
        three = min(one + 2, many - 1)
        for m in range(c.shape[1]):
            begin = first[m]
            real, imaginary = rows[m, RE, begin:], rows[m, IM, begin:]
            x1, y1 = modes[one, RE, begin:], modes[one, IM, begin:]
            x2, y2 = modes[two, RE, begin:], modes[two, IM, begin:]
            x3, y3 = modes[three, RE, begin:], modes[three, IM, begin:]
            total1, total2, total3 = 0.0, 0.0, 0.0
            for n in range(len(x1)):
                total1 += real[n] * x1[n] + imaginary[n] * y1[n]
                total2 += real[n] * x2[n] + imaginary[n] * y2[n]
                total3 += real[n] * x3[n] + imaginary[n] * y3[n]
            c[one, m] += total1
            if two > one:
                c[two, m] += total2
            if three > two:
                c[three, m] += total3


@uncounted_kernel
def _write_three(
    first: FloatArray, second: FloatArray, a1: float, b1: float, a2: float, b2: float, a3: float, b3: float,
    x1: FloatArray, x2: FloatArray, x3: FloatArray,
) -> None:  # fmt: skip
    for n in range(len(x1)):
        x1[n] += a1 * first[n] + b1 * second[n]
        x2[n] += a2 * first[n] + b2 * second[n]
        x3[n] += a3 * first[n] + b3 * second[n]


@uncounted_kernel
def write_modes_of_all(rows: FloatArray, first: IntArray, moments: FloatArray, modes: FloatArray) -> None:
    """Do as `write_modes` for several moments, (many, q), and amplitudes, (many, 2, modes), three at a time."""
    many, q = moments.shape
    for one in range(0, many, 3):
        if one + 2 >= many:
            for left in range(one, many):
                write_modes(rows, first, moments[left], modes[left, RE], modes[left, IM])
            break
        for m in range(0, q, 2):
            other = min(m + 1, q - 1)
            begin = first[m]
            pair = 1.0 if other > m else 0.0
            a1, b1 = moments[one, m], pair * moments[one, other]
            a2, b2 = moments[one + 1, m], pair * moments[one + 1, other]
            a3, b3 = moments[one + 2, m], pair * moments[one + 2, other]
            for part in range(2):
                _write_three(
                    rows[m, part, begin:], rows[other, part, begin:], a1, b1, a2, b2, a3, b3,
                    modes[one, part, begin:], modes[one + 1, part, begin:], modes[one + 2, part, begin:],
                )  # fmt: skip

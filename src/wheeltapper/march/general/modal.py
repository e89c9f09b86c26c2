"""Modes of a track: what they show a contact over a macro step, and what its force does to them.

Tables hold Legendre coefficients over the macro step, one row each for degree l, real and imaginary part; modes are
ordered by their rates, and in row l those before `first[l]` are left out, since so slow a mode has nothing of degree l.
"""

from __future__ import annotations

from wheeltapper.march.general.layout import IM, RE
from wheeltapper.march.kernel import kernel
from wheeltapper.march.program import FloatArray, IntArray


@kernel
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


@kernel
def _write_pair(one: float, two: float, first: FloatArray, second: FloatArray, x: FloatArray) -> None:
    for n in range(len(x)):
        x[n] += one * first[n] + two * second[n]


@kernel
def write_modes(rows: FloatArray, first: IntArray, moments: FloatArray, re: FloatArray, im: FloatArray) -> None:
    """Add to the amplitudes what the moments of a force give."""
    q = len(moments)
    for m in range(0, q, 2):
        other = min(m + 1, q - 1)
        begin = first[m]
        two = moments[other] if other > m else 0.0
        _write_pair(moments[m], two, rows[m, RE, begin:], rows[other, RE, begin:], re[begin:])
        _write_pair(moments[m], two, rows[m, IM, begin:], rows[other, IM, begin:], im[begin:])


@kernel
def turned(factor: FloatArray, re: FloatArray, im: FloatArray, out_re: FloatArray, out_im: FloatArray) -> None:
    """Write amplitudes times complex factors, (2, modes)."""
    real = factor[RE]
    imaginary = factor[IM]
    for n in range(len(re)):
        x = re[n]
        y = im[n]
        out_re[n] = x * real[n] - y * imaginary[n]
        out_im[n] = x * imaginary[n] + y * real[n]


@kernel
def turn(factor: FloatArray, re: FloatArray, im: FloatArray) -> None:
    """Multiply amplitudes by complex factors, (2, modes)."""
    real = factor[RE]
    imaginary = factor[IM]
    for n in range(len(re)):
        x = re[n]
        re[n] = x * real[n] - im[n] * imaginary[n]
        im[n] = x * imaginary[n] + im[n] * real[n]


@kernel
def add_turned_back(factor: FloatArray, more_re: FloatArray, more_im: FloatArray, re: FloatArray, im: FloatArray) -> None:  # fmt: skip  # noqa: E501
    """Add amplitudes times the conjugate factors."""
    real = factor[RE]
    imaginary = factor[IM]
    for n in range(len(re)):
        re[n] += more_re[n] * real[n] + more_im[n] * imaginary[n]
        im[n] += more_im[n] * real[n] - more_re[n] * imaginary[n]

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
    modes = len(re)
    for m in range(len(c)):
        real = rows[m, RE]
        imaginary = rows[m, IM]
        total = 0.0
        for n in range(first[m], modes):
            total += real[n] * re[n] + imaginary[n] * im[n]
        c[m] += total


@kernel
def write_modes(rows: FloatArray, first: IntArray, moments: FloatArray, re: FloatArray, im: FloatArray) -> None:
    """Add to the amplitudes what the moments of a force give."""
    modes = len(re)
    q = len(moments)
    for m in range(0, q - 1, 2):
        one = moments[m]
        two = moments[m + 1]
        begin = first[m + 1]
        for n in range(first[m], begin):
            re[n] += one * rows[m, RE, n]
            im[n] += one * rows[m, IM, n]
        for n in range(begin, modes):
            re[n] += one * rows[m, RE, n] + two * rows[m + 1, RE, n]
            im[n] += one * rows[m, IM, n] + two * rows[m + 1, IM, n]
    if q % 2 == 1:
        one = moments[q - 1]
        for n in range(first[q - 1], modes):
            re[n] += one * rows[q - 1, RE, n]
            im[n] += one * rows[q - 1, IM, n]


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

"""Derivatives of the smooth force maxima inside a step."""

from __future__ import annotations

from wheeltapper.march.common import program as contract
from wheeltapper.march.common.kernel import uncounted_kernel
from wheeltapper.march.common.program import CONTACT, LENGTH, PHASE, TIME, FloatArray
from wheeltapper.march.steps.layout import FLIGHT_ORDER, N, T, U
from wheeltapper.march.steps.tangent_path import LANES, OF_SIZE, OF_TIME, sum_at
from wheeltapper.march.wheel.roots import evaluate
from wheeltapper.march.wheel.step import time_to


@uncounted_kernel
def is_inside(peaks: FloatArray, peak: int, end: float) -> bool:
    """Return True where the next force maximum lies before `end` and at no breakpoint."""
    return peak < len(peaks) and peaks[peak, contract.PEAK_TIME] <= end and peaks[peak, contract.PEAK_CORNER] == 0.0


@uncounted_kernel
def peaks_inside(
    numbers: FloatArray, step: FloatArray, end: float, peaks: FloatArray, peak: int, of_peaks: FloatArray,
    S: FloatArray, D: FloatArray,
) -> int:  # fmt: skip
    """Write the derivatives of the smooth force maxima inside a step; return the next maximum's row."""
    contact = step[PHASE] == CONTACT
    order = int(numbers[contract.ORDER]) if contact else int(FLIGHT_ORDER)
    while is_inside(peaks, peak, end):
        after = peaks[peak, contract.PEAK_TIME] - step[TIME]
        x = time_to(S, order, step[LENGTH], after) if contact else after
        for lane in range(LANES):
            if not contact:
                of_peaks[peak, OF_SIZE, lane] = sum_at(D, N, order - 1, x, lane)
                bend = _force_second(S, N, order, x)
                of_peaks[peak, OF_TIME, lane] = -_force_slope(D, N, order - 1, x, lane) / bend
            else:
                u = evaluate(S, U, order, x)
                bend = _force_second(S, N, order - 1, x)
                of_peaks[peak, OF_SIZE, lane] = sum_at(D, N, order - 1, x, lane)
                of_peaks[peak, OF_TIME, lane] = (
                    sum_at(D, T, order, x, lane) - u * _force_slope(D, N, order - 1, x, lane) / bend
                )
        peak += 1
    return peak


@uncounted_kernel
def _force_slope(D: FloatArray, row: int, n: int, x: float, lane: int) -> float:
    total = 0.0
    for k in range(n, 0, -1):
        total = total * x + k * D[row + k, lane]
    return total


@uncounted_kernel
def _force_second(S: FloatArray, row: int, n: int, x: float) -> float:
    total = 0.0
    for k in range(n, 1, -1):
        total = total * x + k * (k - 1) * S[row + k]
    return total

"""Hunt-Crossley damping from a coefficient of restitution, exactly."""

from __future__ import annotations

from math import log1p

__all__ = ["hysteresis_from_restitution"]


def hysteresis_from_restitution(restitution: float) -> float:
    """Return h of N = C·δ^1.5·(1 + h·δ'/v0) for an impact at v0 with the given coefficient of restitution e.

    Solves ln[(1 + h)/(1 - h·e)] = h·(1 + e), the exact first integral of a free Hunt-Crossley impact; the approximate
    laws of the literature agree with it only near e = 1.

    Parameters
    ----------
    restitution
        e, 0 < e ≤ 1.

    Returns
    -------
    h, dimensionless; h·e < 1.
    """
    e = restitution
    if e == 1.0:
        return 0.0

    def residual(h: float) -> float:
        return log1p(h) - log1p(-h * e) - h * (1.0 + e)

    # Near h = 0 the residual is -(1 - e²)·h²/2 + (1 + e³)·h³/3: negative, then positive up to +inf at h = 1/e.
    low, high = 0.0, 1.0 / e
    h = min(1.5 * (1.0 - e) / e, 0.999 / e)
    for _ in range(200):
        if residual(h) < 0.0:
            low = h
        else:
            high = h
        slope = 1.0 / (1.0 + h) + e / (1.0 - h * e) - (1.0 + e)
        new = h - residual(h) / slope if slope > 0.0 else low
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - h) <= 1e-15 * h:
            return new
        h = new
    return h

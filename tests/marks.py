"""Cases of which only some are run by default: what takes a second or more runs with `-m slow`."""

import pytest


def slow(cases, *those):
    """Return cases, of which those are slow."""
    return [
        pytest.param(*(one if isinstance(one, tuple) else (one,)), marks=pytest.mark.slow) if one in those else one
        for one in cases
    ]


def slow_but(cases, *those):
    """Return cases, all of which but those are slow."""
    return slow(cases, *(one for one in cases if one not in those))

"""The contract between lowering and the kernels: all that a kernel may know, as plain numbers and arrays.

Scaled units (the project's numerics reference, section 1.1): force P + mg, length d0 at which the contact carries that
force, time sqrt(m·d0/(P + mg)). In these units the wheel has mass one, weight one and static indentation near one.
Positions stay in metres: a table serves every speed and height by `pace` and `lift`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

MAX_DEGREE = 8
"""Highest polynomial degree of a piece of a table."""

# Phases of the motion.
FLIGHT, CONTACT, RELEASED, BONDED = 0, 1, 2, 3
# Kinds of events.
LOSS, IMPACT = 0, 1
# Joins between pieces.
SOFT, KINK, JUMP = 0, 1, 2
# Why a kernel returned.
RUNNING, DONE, FULL, TOO_MANY_EVENTS, NOT_FINITE, STALLED, END_OF_PATH = 0, 1, 2, 3, 4, 5, 6

# Columns of the state, and of a row of steps (a row is the state at the step's start, then its length).
PHASE, TIME, A, B, DECK_Y, DECK_V, PIECE, SHIFT, ON_DECK, LENGTH = range(10)
STEP_COLUMNS = 10
# Columns of events and of peaks.
EVENT_TIME, EVENT_KIND, EVENT_RATE, EVENT_CAUSE = range(4)
EVENT_COLUMNS = 4
PEAK_TIME, PEAK_FORCE, PEAK_CORNER = range(3)
PEAK_COLUMNS = 3


class Path(NamedTuple):
    """The path of the rolling wheel's centre over position, and the factor on the contact force, as pieces.

    Piece i holds on [breaks[i], breaks[i+1]]. With ξ = (x - centre[i])/scale[i], the height in m is
    Σ coefficient[i, k]·ξ^k + harmonic[i, 0]·sin φ + harmonic[i, 1]·cos φ, φ = harmonic[i, 2]·(x - centre[i]).
    The factor on the contact force is Σ factor[i, k]·ξ^k.
    After the last piece the table goes on with piece `loop`; loop = number of pieces where it just ends.
    """

    breaks: FloatArray  # (n + 1,) m
    centre: FloatArray  # (n,) m
    scale: FloatArray  # (n,) m
    degree: IntArray  # (n,)
    coefficient: FloatArray  # (n, MAX_DEGREE + 1) m
    harmonic: FloatArray  # (n, 3) m, m, 1/m
    factor_degree: IntArray  # (n,) -1 where the factor is one
    factor: FloatArray  # (n, MAX_DEGREE + 1)
    join: IntArray  # (n,) SOFT, KINK or JUMP: how piece i is entered from piece i - 1
    loop: int
    loop_join: int  # how piece `loop` is entered from the last piece


class Program(NamedTuple):
    """One wheel on a stiff rail or a deck, ready to march. Scaled units throughout."""

    path: Path
    pace: float  # m of travel per unit of time
    lift: float  # units of length per m
    stiffness: float  # K of the suspension
    damping: float  # G of the suspension
    quadratic: float  # contact force: quadratic·u² + cubic·u³, u = sqrt(indentation)
    cubic: float
    hysteresis: float  # η: the contact force is multiplied by 1 + η·w, w the indentation rate
    bonded: bool  # the contact also pulls (bilateral)
    deck_mass: float  # μ; zero without a deck
    deck_stiffness: float  # κ
    deck_damping: float  # γ
    prestress: float  # static force that the deck's bearing is prestressed with
    deck_from: float  # time of entry on the deck
    deck_to: float  # time of exit
    start_height: float  # wheel's displacement at time zero
    start_velocity: float
    end: float  # time at which the march ends
    order: int
    tolerance: float
    event_limit: int

"""The interface between lowering and the kernels: everything that a kernel may use, as plain numbers and arrays.

Scaled units (docs/theory/integration.rst, section 5.2): force P + mg, length d0 at which the contact carries that
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

DEFAULT_ORDER, STRICT_ORDER = 12, 20
"""Orders of the contact series that a program may ask for."""

# Phases of the motion; those from YIELDING on count the pieces of the plastic law.
FLIGHT, CONTACT, RELEASED, BONDED, YIELDING = range(5)
# Kinds of events.
LOSS, IMPACT, YIELD = range(3)
# Joins between pieces.
SOFT, KINK, JUMP = 0, 1, 2
# Why a kernel returned.
RUNNING, DONE, FULL, TOO_MANY_EVENTS, NOT_FINITE, STALLED, END_OF_PATH, ENOUGH = range(8)

# Columns of the state, and of a row of steps (a row is the state at the step's start, then its length).
PHASE, TIME, A, B, DECK_Y, DECK_V, PIECE, SHIFT, ON_DECK, LENGTH = range(10)
STEP_COLUMNS = 10
# Columns that follow, in the state too, where the damper has an end of its own: what holds the end, its displacement
# while nothing does, and the deflection of its bush.
END_MODE, END_PLACE, END_DEFLECTION = range(10, 13)
ENDED_COLUMNS = 13
# What holds the damper's end: nothing, its upper or its lower stop, or the wheel itself (a bush without play).
FREE, UPPER, LOWER, LINKED = 0.0, 1.0, -1.0, 2.0
# Columns of the events of the damper's end, and their kinds.
STOP_TIME, STOP_KIND, STOP_SIDE = range(3)
STOP_COLUMNS = 3
REACHED, LEFT = 0, 1
NO_STOPS = np.empty((0, STOP_COLUMNS))
"""Events of a damper without an end of its own."""
# Columns of events and of peaks.
EVENT_TIME, EVENT_KIND, EVENT_RATE, EVENT_CAUSE = range(4)
EVENT_COLUMNS = 4
PEAK_TIME, PEAK_FORCE, PEAK_CORNER, PEAK_IMPACT = range(4)  # the last: how many impacts came before
PEAK_COLUMNS = 4
EVENT_CONTACT = PEAK_CONTACT = 3
"""Of a vehicle with several contacts: which one; one wheel has the cause, and the impacts before, there."""


# Columns of a piece of the path. With ξ = (x - CENTRE)/SCALE, its height in m is Σ COEFFICIENT[k]·ξ^k
# + SINE·sin φ + COSINE·cos φ, φ = WAVENUMBER·(x - CENTRE), and the factor on the contact force Σ FACTOR[k]·ξ^k.
TERMS = MAX_DEGREE + 1
START, STOP, CENTRE, SCALE, JOIN, DEGREE, COEFFICIENT = range(7)
SINE = COEFFICIENT + TERMS
COSINE, WAVENUMBER, FACTOR_DEGREE, FACTOR = range(SINE + 1, SINE + 5)
PIECE_COLUMNS = FACTOR + TERMS
# Columns that follow where the contact yields, polynomials in ξ, m: the residual indentation of the surface as it is,
# and the indentation from there at which it yields.
RESIDUAL_DEGREE = PIECE_COLUMNS
RESIDUAL = RESIDUAL_DEGREE + 1
BEARS_DEGREE = RESIDUAL + TERMS
BEARS = BEARS_DEGREE + 1
MARKED_COLUMNS = BEARS + TERMS

# Columns of a piece of the plastic law, over the indentation d of the virgin surface (scaled units): with
# η = (d - LAW_CENTRE)/LAW_SCALE the force is Σ LAW_FORCE[k]·η^k, the residual indentation Σ LAW_RESIDUAL[k]·η^k.
LAW_START, LAW_CENTRE, LAW_SCALE, LAW_FORCE = range(4)
LAW_RESIDUAL = LAW_FORCE + TERMS
LAW_COLUMNS = LAW_RESIDUAL + TERMS

# Entries of the numbers, in scaled units except PACE and LIFT.
PACE = 0  # m of travel per unit of time
LIFT = 1  # units of length per m
STIFFNESS = 2  # K of the suspension
DAMPING = 3  # G of the suspension
QUADRATIC = 4  # contact force: quadratic·u² + cubic·u³, u = sqrt(indentation)
CUBIC = 5
HYSTERESIS = 6  # η: the contact force is multiplied by 1 + η·w, w the indentation rate
BILATERAL = 7  # 1 where the contact also pulls
DECK_MASS = 8  # μ; zero without a deck
DECK_STIFFNESS = 9  # κ
DECK_DAMPING = 10  # γ
PRESTRESS = 11  # static force that the deck's bearing is prestressed with
DECK_FROM = 12  # time of entry on the deck
DECK_TO = 13  # time of exit
START_HEIGHT = 14  # the wheel's displacement and velocity at time zero
START_VELOCITY = 15
END = 16  # time at which the march ends
ORDER = 17
TOLERANCE = 18
EVENT_LIMIT = 19
LOOP = 20  # the table goes on with this piece after its last one; the number of pieces where it just ends
LOOP_JOIN = 21  # the joint between the last piece and that one
START_SHIFT = 22  # the table's position at time zero is its negative, m
LAST_IMPACT = 23  # the march ends at this impact; -1: it does not
LAST_LOSS = 24  # the march ends at the first loss after this number of impacts; -1: it does not
MEMORY = 25  # 1 where every contact is at one spot, which remembers its largest indentation
# Of a damper whose end can move (DAMPING is then zero): its damping, half the gap of its play, the stiffness of its
# bush (0: rigid), and the position of the end in the gap at the start, from -1 to 1.
DAMPER_DAMPING, DAMPER_PLAY, DAMPER_BUSH, DAMPER_START = range(26, 30)
NUMBERS = 30


ELASTIC = np.empty((0, LAW_COLUMNS))
"""The empty plastic law of elastic contacts."""


class Program(NamedTuple):
    """One wheel on a stiff rail or a deck, ready to march: pieces of the path, and numbers."""

    pieces: FloatArray  # (n, PIECE_COLUMNS), where the contact yields (n, MARKED_COLUMNS)
    numbers: FloatArray  # (NUMBERS,)
    law: FloatArray = ELASTIC  # (pieces of the plastic law, LAW_COLUMNS)

    @property
    def law_or_none(self) -> FloatArray | None:
        """The law as kernels take it: None where the contact does not yield."""
        return self.law if len(self.law) else None

    @property
    def damper_ends(self) -> bool:
        """Whether the damper has an end of its own."""
        return bool(self.numbers[DAMPER_PLAY] > 0.0 or self.numbers[DAMPER_BUSH] > 0.0)

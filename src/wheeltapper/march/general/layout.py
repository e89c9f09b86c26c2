"""Names of the columns that the kernels of the general march index."""

from __future__ import annotations

# A contact's state. Times are parts of the macro step, counted from its start: of the last impact, and of the loss that
# is foreseen. BEGAN: the indentation at the part's start. SMOOTH: the last step was smooth. STOP_AT: where the free end
# of a damper with play rests, or the anchor of dry friction. STRETCH_NOW: the stretch of a law with kinks
# (plastic_law.py, laws/slider.py, corners.py). JOINED: 1 or -1 where a part begins at the upper or the lower border of
# that stretch, 1 also where a released contact begins to press, 0 elsewhere. LAGS: 1 where a lag of the indentation was
# resolved last (local.py).
FREE_NOW, IMPACT_AT, LOSS_AT, PIECE_NOW, SHIFT_NOW, BEGAN, SMOOTH, STOP_AT, STRETCH_NOW, JOINED, LAGS = range(11)
STATE_COLUMNS = 11

# What FREE_NOW says: in contact, in flight, or released, where the surfaces indent each other but their law would pull.
# The end of a damper with play flies, or goes along at one of its stops. An element whose law has stretches stays.
TOUCHING, FLYING, RELEASED, AT_UPPER, AT_LOWER, STAYING = 0.0, 1.0, 2.0, 3.0, 4.0, 5.0

# Of a contact's table of pieces: its first row, the one behind its last, the piece it goes on with, and how that joins.
TABLE_BEGIN, TABLE_END, TABLE_LOOP, TABLE_JOIN = range(4)

# How a step between events maps σ from 0 to 1 to the part θ of a macro step; with s = S0 + (S1 - S0)·σ
# EVENLY: θ from FROM to TO. AFTER_IMPACT: θ = ORIGIN + s². BEFORE_LOSS: θ = ORIGIN - s².
# IMPACT_TO_LOSS: θ = ORIGIN + SPAN·s²·(3 - 2·s).
EVENLY, AFTER_IMPACT, BEFORE_LOSS, IMPACT_TO_LOSS = range(4)

# A row of the log: macro step, contact, part of the step from and to, the map, number of nodes, and forces there.
ROW_STEP, ROW_CONTACT, ROW_FROM, ROW_TO, ROW_MAP, ROW_ORIGIN, ROW_SPAN, ROW_S0, ROW_S1, ROW_NODES, ROW_FORCES = range(
    11
)
MOST_NODES = 16
ROW_COLUMNS = ROW_FORCES + MOST_NODES

# Events: as rows of `contract.py`, with the macro step and its part for the time.
EVENT_STEP, EVENT_PART, EVENT_KIND_IS, EVENT_RATE_IS, EVENT_CONTACT_IS = range(5)
EVENT_COLUMNS_GENERAL = 5

# How a contact's force has gone: whether a maximum waits to be logged, where it is, the lowest force since the last.
TOP_WAITS, TOP_STEP, TOP_PART, TOP_SIZE, LOWEST_SINCE = range(5)
TREND_COLUMNS = 5
MAXIMUM_STEP, MAXIMUM_PART, MAXIMUM_FORCE, MAXIMUM_CONTACT = range(4)
MAXIMUM_COLUMNS = 4

# Counts of the logs.
LOGGED_ROWS, LOGGED_EVENTS, LOGGED_PEAKS, LOGGED_STEPS = range(4)

# Parts of a complex number in tables of the modes.
RE, IM = 0, 1
BEGIN = 0

# Tolerances of a march, its units and its speed.
NEWTON_LIMIT, TAIL_LIMIT, SWEEP_LIMIT, LOSS_LIMIT, PROMINENT, LENGTH_UNIT, FORCE_UNIT, SPEED_NOW = range(8)
SETTINGS = 8

# Of the present macro step, s: when it begins, how long it, the one before and the next one last.
STEP_BEGINS, STEP_LASTS, LAST_ONE_LASTED, NEXT_ONE_LASTS = range(4)
STEP_NUMBERS = 4

# Limits of one run of the kernel.
MOST_PARTS = 200
"""Steps between events in one macro step of one contact."""

# Why the kernel returned, beside those of `wheeltapper.march.common.program`; a wagon's march has others.
UNSOLVED = 30
"""A step between events did not converge, however short."""
CHATTERS = 31
"""More than MOST_PARTS steps between events in one macro step."""

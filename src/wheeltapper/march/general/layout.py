"""What the rows are that the kernels of the general march write and read."""

from __future__ import annotations

import numpy as np

from wheeltapper.march.common.rows import named

STATE = named("phase impact loss piece shift began smooth stop stretch joined lags")
"""A contact's state. Times are parts of the macro step, counted from its start: of the last `impact`, and of the `loss`
that is foreseen. `began`: the indentation at the part's start. `smooth`: the last step was smooth. `stop`: where the
free end of a damper with play rests, or the anchor of dry friction. `stretch`: that of a law with kinks
(plastic_law.py, laws/slider.py, corners.py). `joined`: 1 or -1 where a part begins at the upper or the lower border of
that stretch, 1 also where a released contact begins to press, 0 elsewhere. `lags`: 1 where a lag of the indentation was
resolved last (local.py)."""

# Phases: in contact, in flight, or released, where the surfaces indent each other but their law would pull.
# The end of a damper with play flies, or goes along at one of its stops. An element whose law has stretches stays.
TOUCHING, FLYING, RELEASED, AT_UPPER, AT_LOWER, STAYING = 0.0, 1.0, 2.0, 3.0, 4.0, 5.0

ENDS = named("begin end loop join", np.int64)
"""Of a contact's table of pieces: its first row, the one behind its last, the piece it goes on with, how that joins."""

# How a step between events maps σ from 0 to 1 to the part θ of a macro step; with s = s0 + (s1 - s0)·σ
# EVENLY: θ from `from` to `to`. AFTER_IMPACT: θ = origin + s². BEFORE_LOSS: θ = origin - s².
# IMPACT_TO_LOSS: θ = origin + span·s²·(3 - 2·s).
EVENLY, AFTER_IMPACT, BEFORE_LOSS, IMPACT_TO_LOSS = range(4)

MOST_NODES = 16
ROW = np.dtype([*named("step contact from to map origin span s0 s1 nodes").descr, ("forces", np.float64, MOST_NODES)])
"""A row of the log: macro step, contact, part of the step from and to, the map, number of nodes, and forces there."""

EVENT = named("step part kind rate contact")
"""An event, with the macro step and its part for the time."""

TREND = named("waits step part size lowest")
"""How a contact's force has gone: whether a maximum waits to be logged, where it is, the lowest force since."""
MAXIMUM = named("step part force contact")
"""A maximum of a contact's force."""

USED = named("rows events peaks steps", np.int64)
"""Counts of the logs."""

# Parts of a complex number in tables of the modes.
RE, IM = 0, 1
BEGIN = 0

SETTINGS = named("newton_limit tail_limit sweep_limit loss_limit prominent length_unit force_unit speed")
"""Tolerances of a march, its units and its speed."""

NOW = named("begins lasts last_lasted next_lasts")
"""Of the present macro step, s: when it begins, how long it, the one before and the next one last."""

# Limits of one run of the kernel.
MOST_PARTS = 200
"""Steps between events in one macro step of one contact."""

# Why the kernel returned, beside those of `wheeltapper.march.common.program`; a wagon's march has others.
UNSOLVED = 30
"""A step between events did not converge, however short."""
CHATTERS = 31
"""More than MOST_PARTS steps between events in one macro step."""

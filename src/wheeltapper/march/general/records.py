"""Records that the kernels of the general march take: arrays by their names."""

from __future__ import annotations

from typing import Any, NamedTuple

from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.common.rows import Row, Rows


class Nodes(NamedTuple):
    """The Gauss nodes of an interval from 0 to 1, and what is linear in values there; n nodes.

    Attributes
    ----------
    places, weights
        (n,).
    values
        Legendre's polynomials at the nodes, P_l(2θ - 1), (node, l).
    transform
        From values to coefficients of Legendre's polynomials, (l, node).
    integrals
        From values to the integral from 0 to each node, (node, node).
    end, end_slope, end_bend
        From values to the value, the first and the second derivative at 1, (n,).
    bernstein
        From values to Bernstein coefficients, (n, n).
    ended
        From the value at 0, the values at the nodes and the value at 1 to Bernstein coefficients, (n + 2, n + 2).
    slopes
        From the value at 0 and the values at the nodes to the derivative at the nodes, (n, n + 1).
    own_slopes
        The same from the nodes alone: the first column is zero.
    reach
        From the value at 0 and the values at the nodes to the value at 1, (n + 1,).
    ahead
        From values to those of the same polynomial, without what is above its third degree, one interval later.
    """

    places: FloatArray
    weights: FloatArray
    values: FloatArray
    transform: FloatArray
    integrals: FloatArray
    end: FloatArray
    end_slope: FloatArray
    end_bend: FloatArray
    bernstein: FloatArray
    ended: FloatArray
    slopes: FloatArray
    own_slopes: FloatArray
    reach: FloatArray
    ahead: FloatArray


class Tables(NamedTuple):
    """What a structure is to the kernels; q nodes a macro step, `phases` places in a bay.

    Attributes
    ----------
    reads, writes
        Of the modes, (sets, phases, q, 2, modes).
    first
        First mode of each degree, (q,).
    decay
        exp(λH), (lengths, 2, modes).
    turns
        What a port sees that stands some bays ahead, (bays, 2, modes).
    sets, phase, bay
        Of each contact: which set of tables, and phase and bay at the start.
    bodies_read, bodies_write, bodies_step
        The same for bodies: (contacts, q, states), (contacts, q, states), (states, states), each behind an axis of the
        lengths of steps; the last state is 1.
    kernels, matrices
        The answer of the structure to a contact's own force: Legendre coefficients, and its collocation matrix,
        (contacts, phases, q, q) both.
    cross
        The answer at the nodes of a contact to the force at those of another: (contact, other, phases, q, q).
    coupled
        Which of these are not zero, (contact, other).
    residual, residual_nodes
        Local compliance: Legendre coefficients, and at the nodes, (contacts, phases, q).
    fixed_reads, fixed_writes
        As `reads` and `writes`, of the contacts that stay where they are, (ports, lengths, q, 2, modes). `sets`,
        `phase` and `bay` are those of the wheels.
    which, seconds
        Which of the different lengths the step from each place has, (phases,), and these, s, (lengths,).
    clock
        When the steps begin from the first place on, and when the last one ends, s, (phases + 1,).
    """

    reads: FloatArray
    writes: FloatArray
    first: IntArray
    decay: FloatArray
    turns: FloatArray
    sets: IntArray
    phase: IntArray
    bay: IntArray
    bodies_read: FloatArray
    bodies_write: FloatArray
    bodies_step: FloatArray
    kernels: FloatArray
    matrices: FloatArray
    cross: FloatArray
    coupled: IntArray
    residual: FloatArray
    residual_nodes: FloatArray
    fixed_reads: FloatArray
    fixed_writes: FloatArray
    which: IntArray
    seconds: FloatArray
    clock: FloatArray


class Site(NamedTuple):
    """What a contact's problem depends on in one macro step.

    Attributes
    ----------
    c, B
        As above, (q,) and (q, q).
    local
        Coefficients of r, (q,).
    pieces, place, ends
        Path, the contact's state, and where its table of pieces begins, ends and loops.
    law, table
        Numbers of the law, and tables of tabulated laws.
    x0, stride, lift
        Position at the macro step's start and its length, m, in the table of the path; units of length per m.
    seconds
        Length of the macro step.
    """

    c: FloatArray
    B: FloatArray
    local: FloatArray
    pieces: FloatArray
    place: Row
    ends: Row
    law: FloatArray
    table: FloatArray
    x0: float
    stride: float
    lift: float
    seconds: float


class Room(NamedTuple):
    """Scratch memory of a contact's problem: at the nodes, and for the moments."""

    theta: FloatArray
    pace: FloatArray  # dθ/dσ
    height: FloatArray
    factor: FloatArray
    left: FloatArray  # what earlier wheels have left, where the contact yields
    d: FloatArray  # D without the force of this part
    r: FloatArray
    delta: FloatArray
    rate: FloatArray
    N: FloatArray
    slope: FloatArray
    viscous: FloatArray
    F: FloatArray
    free: FloatArray  # coefficients of D without the force of this part
    moments: FloatArray  # at the start of this part
    after: FloatArray  # and at its end
    spare: FloatArray
    bernstein: FloatArray
    P: FloatArray
    T: FloatArray
    K: FloatArray
    J: FloatArray
    stack: FloatArray


class Data(NamedTuple):
    """What a march is given beside its tables.

    Attributes
    ----------
    macro, part
        Nodes of a macro step, and of a part between events.
    places, matrix
        Of a flight's search.
    pieces, ends
        All paths, and where each contact's table begins, ends and loops.
    laws, table
        Numbers of each contact's law, (contacts, LAW_NUMBERS), and cells of tabulated laws.
    starts
        Position of each contact in its table at time zero, m.
    settings
        Tolerances, units and speed (layout.py).
    """

    macro: Nodes
    part: Nodes
    places: FloatArray
    matrix: FloatArray
    pieces: FloatArray
    ends: Rows
    laws: FloatArray
    table: FloatArray
    starts: FloatArray
    settings: Row


class Motion(NamedTuple):
    """What moves on: amplitudes, bodies, contacts.

    Attributes
    ----------
    modes
        Real and imaginary parts, (2, modes), as seen from the bay of the first contact.
    bodies
        (states,).
    contacts
        (contacts,), rows as `STATE`.
    guess
        Indentations at the last macro step's nodes, (contacts, q).
    forces
        Forces at the last macro step's nodes, (contacts, q).
    trend
        How each force has gone, (contacts,), rows as `TREND`.
    """

    modes: FloatArray
    bodies: FloatArray
    contacts: Rows
    guess: FloatArray
    forces: FloatArray
    trend: Rows

    def copy(self) -> Motion:
        """Return the same in memory of its own."""
        tables: Any = (table.copy() for table in self)
        return Motion._make(tables)


class Stage(NamedTuple):
    """Scratch memory of a macro step: rows and events of each contact, and what the contacts exchange."""

    rows: Rows
    events: Rows
    counts: IntArray
    before: Rows  # contacts at the macro step's start
    free: FloatArray  # c without the others' forces
    c: FloatArray
    felt: FloatArray  # at the nodes, of the others' forces
    shares: FloatArray  # (contacts, node, node): integral of the force times Lagrange's polynomials
    sums: FloatArray
    moments: FloatArray
    modes: FloatArray
    now: Row  # when the macro step begins, how long it, the one before and the next one last, s (layout.py)


class Logs(NamedTuple):
    """What a march writes: parts, events, maxima; of each macro step c, moments and bodies; modes now and then.

    `used` counts rows, events, maxima and macro steps.
    """

    rows: Rows
    events: Rows
    peaks: Rows
    gaps: FloatArray
    moments: FloatArray
    bodies: FloatArray
    modes: FloatArray
    used: Row

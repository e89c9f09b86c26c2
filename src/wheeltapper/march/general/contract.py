"""The interface between lowering and the general march: a structure as blocks, contacts, and how exact it shall be.

Everything is in SI units; the march scales by itself. Deflections and displacements of the structure are positive
downwards, the heights of a path upwards, and forces press the wheel up and the rail down.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple, Protocol

import numpy as np

from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.general.structure import ComplexArray, Ring


class Bodies(NamedTuple):
    """A block of masses, springs and dampers: M·y'' + C·y' + K·y = load - shapes·N.

    A freedom without mass, whose row and column of M are zero, has to have damping of its own: M·y'' is nothing there.

    Attributes
    ----------
    mass, damping, stiffness
        (freedoms, freedoms).
    shapes
        What each freedom adds to the indentation of each contact, (freedoms, contacts): 1 for the displacement of a
        wheel, -1 for that of a deck below it.
    load
        Constant forces, (freedoms,), N.
    raised
        What the first freedoms, which are those of the wheels, start with, all others being at rest: heights above
        that of first touch, m, and velocities upwards, m/s, (2, wheels). Empty: everything starts at rest.
    follows
        1 for each freedom that starts displaced with a wheel, (freedoms, wheels); needed with `raised` and `guides`.
    guides
        Stiffness of each wheel's spring against a fixed guide, (wheels,), N/m, which `stiffness` has too. Displacements
        then count from the static state on level track, whatever the paths' heights at the start. Empty: from that in
        which all start, on whose paths no spring of the bodies is stretched.
    """

    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    shapes: FloatArray
    load: FloatArray
    raised: FloatArray = np.empty((2, 0))
    follows: FloatArray = np.empty((0, 0))
    guides: FloatArray = np.empty(0)


class Law(NamedTuple):
    """A contact law: its kind in `laws/switch.py`, its numbers in SI units, and its table."""

    kind: int
    numbers: FloatArray
    table: FloatArray = np.empty((0, 0))


class Port(NamedTuple):
    """A place of the structure, or of the bodies, at which a contact stays: what meets there is no wheel.

    Attributes
    ----------
    deflection, drive
        As Φ and Ψ of a ring of one bay, (modes,); the direction is that in which the contact's force acts. Between
        bodies, which meet by the shapes of `Bodies`, both are zero.
    gap
        To be closed before there is a force, m.
    residual
        Local compliance that the modes leave out, m/N.
    """

    deflection: ComplexArray
    drive: ComplexArray
    gap: float
    residual: float = 0.0


class Contact(NamedTuple):
    """One contact.

    Attributes
    ----------
    pieces
        The path of the wheel's centre, m, as in `wheeltapper.march.common.program`.
    law
        Of the force.
    position
        Along the track at time zero, m from the beginning of a bay.
    start
        In the table of the path at time zero, m.
    loop, join
        The piece with which the table goes on after its last one, and how; the number of pieces where it ends.
    port
        Where a contact that does not move acts; None: under a wheel. Such contacts come after those of the wheels.
    """

    pieces: FloatArray
    law: Law
    position: float = 0.0
    start: float = 0.0
    loop: int = 1 << 30
    join: int = 0
    port: Port | None = None


class Change(NamedTuple):
    """What changes of the bodies at a time: a deck begins or ends below some wheels.

    Attributes
    ----------
    time
        s.
    shapes, load
        As in `Bodies`, from then on.
    """

    time: float
    shapes: FloatArray
    load: FloatArray


class System(NamedTuple):
    """What is marched.

    Attributes
    ----------
    bodies
        Vehicle, and what else moves below it, as they are at the start.
    contacts
        One to sixteen.
    speed
        m/s.
    ring
        The track; None for a rigid rail.
    changes
        Of the bodies, in order, without a ring only.
    """

    bodies: Bodies
    contacts: tuple[Contact, ...]
    speed: float
    ring: Ring | None = None
    changes: tuple[Change, ...] = ()

    @property
    def wheels(self) -> tuple[Contact, ...]:
        """The contacts that move along the track."""
        return tuple(contact for contact in self.contacts if contact.port is None)

    @property
    def ports(self) -> tuple[Port, ...]:
        """Where the others act."""
        return tuple(contact.port for contact in self.contacts if contact.port is not None)


class Method(NamedTuple):
    """How a march is made.

    Attributes
    ----------
    step
        Longest macro step, s.
    nodes, careful_nodes
        Gauss nodes of a macro step, and of a step of a contact between events.
    newton, tail, sweep, loss
        Largest error of the solved indentation, of the force's polynomials, of the forces between contacts, all in
        static units, and of a loss in steps.
    prominence
        Smallest height of a force maximum above its surroundings, over one plus the force, static units.
    single
        True where the modes' tables are of single precision; the state never is.
    negligible
        Share of a mode that its table may leave out.
    """

    step: float
    nodes: int
    careful_nodes: int
    newton: float
    tail: float
    sweep: float
    loss: float
    prominence: float
    single: bool
    negligible: float


class Marking(Protocol):
    """What wheels leave on their way for others, while a march is under way."""

    def ahead(self, way: float) -> Iterator[tuple[int, FloatArray]]:
        """Return each wheel with the places that it has passed since the last time when it has rolled so far, m."""
        ...

    def take(self, wheel: int, depths: FloatArray, pressures: FloatArray) -> None:
        """Take how deep a wheel has indented the virgin surface there, m, and its forces over that at first yield."""
        ...

    def pieces(self) -> list[FloatArray]:
        """Return the paths of all wheels as they are known now, up to the memory's `reach`."""
        ...


class Memory(Protocol):
    """A rail that remembers."""

    @property
    def reach(self) -> float:
        """How far the wheels may roll before they must be told of new paths, m."""
        ...

    def begin(self) -> Marking:
        """Return what a march begins with."""
        ...


class Task(NamedTuple):
    """A system, how it is marched, and for how long, s; and what of its paths only becomes known on the way."""

    system: System
    method: Method
    duration: float
    memory: Memory | None = None


DEFAULT = Method(2e-4, 10, 10, 1e-10, 1e-6, 1e-7, 1e-8, 1e-5, True, 1e-9)
STRICT = Method(1e-4, 12, 12, 1e-14, 1e-10, 1e-11, 1e-11, 1e-6, False, 1e-15)

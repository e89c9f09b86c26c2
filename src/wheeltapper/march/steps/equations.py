"""The equations of a wheel's step, each written once (docs/theory/integration.rst, sections 5.3 and 5.4).

In contact the step runs in s, dt = u ds, where u² is the indentation and w its rate in time:

    t' = u     u' = w/2     w' = u·(F + K·(Y - u²) + G·(Z - w) + A + B·e - N)     F = 1 + K·y_k + G·y_k' + y_k''
    Y' = u·Z     Z' = u·A     A = (prestress - stiffness·Y - damping·Z - N)/mass of the deck
    e' = u·(v - β·e)     v the wheel's velocity, e the deflection of a bush that holds the damper's end
    N = factor(t)·(quadratic·u² + cubic·u³)·(1 + η·w), or that of a plastic law at the indentation u² + residual(t)

With N = u·m it is u·N = q·m, q = u². Where the path has a harmonic, F has one, too: h with h' = u·g, g' = -Ω²·u·h. What
in w' is a derivative is taken to the other side:

    w = p - G·(q - Y) + Z      p' = u·F - K·u·(q - Y) - q·m + B·u·e

A damper's end needs the wheel's velocity, too, and so that of the path. There h is the path's own harmonic, whose part
of F is (K - Ω²)·h + G·g.
"""

from __future__ import annotations

from typing import NamedTuple

from wheeltapper.march.common.program import MAX_DEGREE
from wheeltapper.march.steps.tape import Series, Sum, Tape, constant, sum_of

FLAT, WAVE, BENT = "flat", "wave", "bent"
"""Paths: level; one harmonic about a level; a polynomial and a harmonic, with a factor on an elastic force."""


class Terms(NamedTuple):
    """What the equations of a contact step have: a whole term is there, or it is not."""

    path: str = FLAT
    hysteresis: bool = False
    deck: bool = False
    yields: bool = False
    end: bool = False

    @property
    def name(self) -> str:
        """The path and the other terms, in one word."""
        more = [term for term in self._fields[1:] if getattr(self, term)]
        return "_".join([self.path, *more])

    @property
    def factor(self) -> bool:
        """Whether there is a factor on the contact's force."""
        return self.path == BENT and not self.yields


def _forcing(tape: Tape, terms: Terms, t: Series, u: Series) -> tuple[Sum, Sum]:
    """Return F and, for a damper's end, the path's velocity."""
    if terms.path == FLAT:
        return constant("f0"), Sum()
    h, g = tape.state("wave"), tape.state("rise")
    tape.rate(h, tape.product(u, g))
    tape.rate(g, "-omega2" * tape.product(u, h))
    level = constant("f0") if terms.path == WAVE else sum_of(tape.of_time("forcing", "c", MAX_DEGREE, t))
    if not terms.end:
        return level + h, Sum()
    velocity = sum_of(g) if terms.path == WAVE else tape.of_time("slope", "s", MAX_DEGREE - 1, t) + g
    return level + "stiff_wave" * h + "G" * g, velocity


class Free(NamedTuple):
    """What the equations of a step in time have: a bond with the rail, a deck, a damper's end."""

    bonded: bool = False
    deck: bool = False
    end: bool = False

    @property
    def name(self) -> str:
        """The kind of step, and the terms, in one word."""
        more = [term for term in self._fields[1:] if getattr(self, term)]
        return "_".join(["bonded" if self.bonded else "flight", *more])


def free(terms: Free) -> Tape:
    """Return the tape of a step in time: in flight, or in a bilateral contact, whose force is factor·indentation.

    Its states are y and v of the wheel, h and g of the path's harmonic, Y and Z of a deck, e of a damper's end; further
    series are the path, the indentation `clear` and, of a bilateral contact, the force N.
    """
    tape = Tape()
    y, v, h, g = (tape.state(name) for name in ("y", "v", "wave", "rise"))
    tape.rate(h, g)
    tape.rate(g, "-omega2" * h)
    path = tape.named("path", tape.polynomial("p", MAX_DEGREE) + h)
    rise = constant(-1.0) - "K" * y - "G" * v
    lifted = path - y
    if terms.deck:
        Y, Z = tape.state("Y"), tape.state("Z")
        tape.rate(Y, Z)
        sink = constant("prestress") - "deck_stiff" * Y - "deck_drag" * Z
        lifted = lifted + "on" * Y
    clear = tape.named("clear", lifted)
    if terms.bonded:
        N = tape.product(tape.polynomial("b", MAX_DEGREE), clear, "N")
        rise = rise + N
    if terms.deck:
        tape.rate(Z, sink - "share" * N if terms.bonded else sink)
    if terms.end:
        e = tape.state("e")
        rise = rise - "bush" * e
        tape.rate(e, "gives" * v - "bush_rate" * e)
    tape.rate(y, v)
    tape.rate(v, rise)
    return tape


def contact(terms: Terms) -> Tape:
    """Return the tape of a step in contact.

    Its states are t, u and p, h and g of a harmonic, Y and Z of a deck, of a damper's end e and the wheel's
    displacement x. Further series that one may want: w, the force N, the wheel's velocity v, and the indentation of the
    virgin surface where that yields.
    """
    tape = Tape()
    t, u, p = tape.state("t", first=1, is_early=True), tape.state("u"), tape.state("p")
    F, path_velocity = _forcing(tape, terms, t, u)
    q = tape.product(u, u, "q")
    m: Series | Sum = "cubic" * q + "quadratic" * u
    if terms.factor:
        m = tape.product(tape.of_time("factor", "b", MAX_DEGREE, t), m)
    below, sinking = sum_of(q), Sum()
    if terms.deck:
        Y, Z = tape.state("Y"), tape.state("Z")
        below, sinking = q - "on" * Y, "on" * Z
    w = tape.named("w", p - "G" * below + sinking)
    if terms.yields:
        depth = tape.named("depth", tape.of_time("residual", "r", MAX_DEGREE, t) + q)
        away = tape.named("away", Sum({depth: 1.0}), first=1)
        N = tape.named("N", tape.composed("law", MAX_DEGREE, away))
        push = tape.product(u, N)
    elif terms.hysteresis:
        m = tape.named("m", sum_of(m))
        m = tape.named("damped", m + "eta" * tape.product(m, w))
    if terms.deck:
        F = F - "K" * below
        push = push if terms.yields else tape.product(q, m)
        pull = tape.product(u, F) - push
        uY, uZ = tape.product(u, Y), tape.product(u, Z)
        tape.rate(Y, uZ)
        tape.rate(Z, "prestress" * u - "deck_stiff" * uY - "deck_drag" * uZ - "share" * push)
    elif terms.yields:
        pull = tape.product(u, F - "K" * q) - push
    else:
        forced = "f0" * u if terms.path == FLAT else tape.product(u, F)
        pull = forced - tape.product(q, m + "K" * u)
    if not terms.yields:
        tape.product(u, m, "N")
    if terms.end:
        e, x = tape.state("e"), tape.state("x")
        v = tape.named("v", path_velocity - p + "G" * below)
        uv, ue = tape.product(u, v), tape.product(u, e)
        tape.rate(x, uv)
        tape.rate(e, "gives" * uv - "bush_rate" * ue)
        pull = pull + "bush" * ue
    tape.rate(t, u)
    tape.rate(u, 0.5 * w)
    tape.rate(p, pull)
    return tape


def yielding(order: int) -> Tape:
    """Return the tape of how far the indentation of a step in contact is beyond what the surface bears, `beyond`.

    The time t and u are those of the step, as they were found.
    """
    tape = Tape()
    t, u = tape.polynomial("t", order, first=1), tape.polynomial("u", order)
    tape.named("beyond", tape.product(u, u) - tape.of_time("bears", "c", MAX_DEGREE, t))
    return tape


def pushing(order: int) -> Tape:
    """Return the tape of `push`, N·u: a step in contact's force by time, in s. N and u are those that were found."""
    tape = Tape()
    tape.product(tape.polynomial("u", order - 1), tape.polynomial("N", order - 1), "push")
    return tape


def powers(terms: Terms | Free) -> Tape:
    """Return the tape of a step with two further series: the power that dampers take, `lost`, and `power`.

    The latter is what contact force and dampers give to wheel and deck; in contact times dt/ds = u.
    """
    tape = contact(terms) if isinstance(terms, Terms) else free(terms)
    v, e, N, Z = (tape.called(name) for name in ("v", "e", "N", "Z"))
    lost = tape.named("lost", tape.product("G" * v + "bush" * e, v) + "bearing" * tape.product(Z, Z))
    power = tape.product(N, v - "on" * Z) - lost
    if isinstance(terms, Terms):
        tape.product(tape.called("u"), power, "power")
    else:
        tape.named("power", power)
    return tape

"""Equations of a step as a tape: power series that are sums and products of others, and states that have rates.

    tape = Tape()
    t, u = tape.state("t"), tape.state("u")
    q = u * u                              # a product is a series of its own
    tape.rate(u, "K" * t - 2.0 * q)        # a sum is written out where it is used

Numbers are Python's, or names of what is known when the step begins. A tape computes nothing: `derive` writes code.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import count

Number = float | str
"""A number, or the name of one: also a product of names."""


def times(a: Number, b: Number) -> Number:
    """Return the product of two numbers."""
    if isinstance(a, str) or isinstance(b, str):
        return b if a == 1.0 else a if b == 1.0 else f"{a} * {b}"
    return a * b


def plus(a: Number, b: Number) -> Number:
    """Return the sum of two numbers."""
    if isinstance(a, str) or isinstance(b, str):
        return b if a == 0.0 else a if b == 0.0 else f"({a} + {b})"
    return a + b


@dataclass(frozen=True, eq=False)
class Series:
    """One series with coefficients of its own: a state, a product, or a sum that was given a name.

    Attributes
    ----------
    name
        Its coefficients are name0, name1 ...
    first, last
        Number of its first coefficients that are zero, and of the last one that is not; None: there is none.
    factors
        What it is the product of.
    total
        What it is the sum of; the first coefficients are nevertheless zero.
    is_early
        Whether coefficient n needs only coefficients n - 1 of the states, as those of the time do by its rate u.
    """

    name: str
    first: int = 0
    last: int | None = None
    factors: tuple[Series, Series] | None = None
    total: Sum | None = None
    is_early: bool = False

    def has(self, n: int) -> bool:
        """Return True where coefficient n may be other than zero."""
        return self.first <= n and (self.last is None or n <= self.last)

    def __add__(self, other: Term) -> Sum:
        return sum_of(self) + other

    def __sub__(self, other: Term) -> Sum:
        return sum_of(self) - other

    def __rmul__(self, number: Number) -> Sum:
        return number * sum_of(self)


@dataclass(frozen=True, eq=False)
class Sum:
    """A sum of series times numbers, and of a constant."""

    terms: dict[Series, Number] = field(default_factory=dict)
    constant: Number = 0.0

    def __add__(self, other: Term) -> Sum:
        added, terms = sum_of(other), dict(self.terms)
        for one, number in added.terms.items():
            terms[one] = plus(terms.get(one, 0.0), number)
        return Sum(terms, plus(self.constant, added.constant))

    def __sub__(self, other: Term) -> Sum:
        return self + -1.0 * sum_of(other)

    def __rmul__(self, number: Number) -> Sum:
        constant = times(number, self.constant) if self.constant != 0.0 else 0.0
        return Sum({one: times(number, by) for one, by in self.terms.items()}, constant)


Term = Series | Sum


def sum_of(term: Term) -> Sum:
    """Return a series as a sum of one."""
    return term if isinstance(term, Sum) else Sum({term: 1.0})


def constant(value: Number) -> Sum:
    """Return a series that is a number."""
    return Sum(constant=value)


class Tape:
    """Series in the order in which their coefficients can be computed, and the rates of the states.

    Attributes
    ----------
    series
        Products and named sums.
    rates
        Of each state its derivative.
    compositions
        The names of series that are polynomials of the time, with those of the polynomials.
    powers
        Powers of the time, as far as a composition has taken them.
    """

    def __init__(self) -> None:
        self.series: list[Series] = []
        self.rates: dict[Series, Sum] = {}
        self.compositions: dict[str, str] = {}
        self.powers: dict[int, Series] = {}
        self._numbers = count(1)
        self._called: dict[str, Series] = {}
        self._products: dict[tuple[Series, Series], Series] = {}

    def state(self, name: str, first: int = 0, is_early: bool = False) -> Series:
        """Return a new state, whose first coefficient is known when the step begins."""
        one = self._new(Series(name, first, is_early=is_early))
        self.rates[one] = Sum()
        return one

    def _new(self, one: Series) -> Series:
        if one.name in self._called:
            raise ValueError(f"two series are called {one.name}")
        self._called[one.name] = one
        return one

    def called(self, name: str) -> Series:
        """Return the series with a name."""
        return self._called[name]

    def polynomial(self, name: str, degree: int, first: int = 0) -> Series:
        """Return a series of which all coefficients are known when the step begins."""
        return self._new(Series(name, first, last=degree, is_early=True))

    def rate(self, state: Series, rate: Term) -> None:
        """Set the derivative of a state."""
        self.rates[state] = sum_of(rate)

    def named(self, name: str, total: Term, first: int = 0) -> Series:
        """Return a sum as a series of its own; with `first` the first coefficients are left out."""
        is_early = all(term.is_early for term in sum_of(total).terms)
        one = self._new(Series(name, first, total=sum_of(total), is_early=is_early))
        self.series.append(one)
        return one

    def product(self, a: Term, b: Term, name: str = "") -> Series:
        """Return the product of two series."""
        left, right = self._whole(a), self._whole(b)
        known = self._products.get((left, right)) or self._products.get((right, left))
        if known is not None:
            return known
        name = name or f"z{next(self._numbers)}_"
        is_early = left.is_early and right.is_early
        one = self._new(Series(name, left.first + right.first, factors=(left, right), is_early=is_early))
        self.series.append(one)
        self._products[left, right] = one
        return one

    def _whole(self, term: Term) -> Series:
        """Return a term as one series."""
        if isinstance(term, Series):
            return term
        if list(term.terms.values()) == [1.0] and term.constant == 0.0:
            return next(iter(term.terms))
        return self.named(f"z{next(self._numbers)}_", term)

    def composed(self, polynomial: str, degree: int, away: Series) -> Sum:
        """Return Σ polynomial_k·away^k; `away` begins with zero."""
        return self._composed(polynomial, degree, {1: away})

    def of_time(self, name: str, polynomial: str, degree: int, time: Series) -> Series:
        """Return Σ polynomial_k·time^k as a series with a name; the time is that after the step's start."""
        self.powers.setdefault(1, time)
        self.compositions[name] = polynomial
        return self.named(name, self._composed(polynomial, degree, self.powers))

    def _composed(self, polynomial: str, degree: int, powers: dict[int, Series]) -> Sum:
        out = Sum({powers[1]: f"{polynomial}1"}, f"{polynomial}0")
        for k in range(2, degree + 1):
            if k not in powers:
                powers[k] = self.product(powers[k // 2], powers[k - k // 2])
            out += f"{polynomial}{k}" * powers[k]
        return out

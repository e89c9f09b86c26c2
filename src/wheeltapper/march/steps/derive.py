"""Code for the coefficients of a tape's series: straight lines, order after order.

Coefficient n of a product is Σ a_j·b_{n-j}, that of a state's next order the rate's divided by n + 1. In code for one
step the processor waits for one sum after the other; so what enters last is taken out of the sums. Coefficient n of
anything is what the orders before n give, and beside that linear in the states' coefficients n, by numbers that are the
same for each n: those of the first derivative. For code for many steps at a time that would be more work, for nothing.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from wheeltapper.march.steps.tape import Number, Series, Sum, Tape, times

_NAME = re.compile(r"[A-Za-z_]\w*")


def total(terms: Iterable[str]) -> str:
    """Return the sum of terms."""
    return " + ".join(terms).replace("+ -", "- ") or "0.0"


def scaled(number: Number, what: str) -> str:
    """Return a number times what has a name."""
    return what if number == 1.0 else f"-{what}" if number == -1.0 else f"{number} * {what}"


def inner(a: Series, b: Series, n: int, first: int = 0) -> list[str]:
    """Return the terms of coefficient n of a product, but for those with an index below `first`; the newest last."""
    low, high = max(first, a.first), n - max(first, b.first)
    low, high = low if b.last is None else max(low, n - b.last), high if a.last is None else min(high, a.last)
    if a is b:
        pairs = [f"{a.name}{j} * {a.name}{n - j}" for j in range(low, (n + 1) // 2)]
        middle = [f"{a.name}{n // 2} * {a.name}{n // 2}"] if n % 2 == 0 and n // 2 >= low else []
        doubled = [f"2.0 * ({total(pairs[::-1])})"] if pairs else []
        return middle + doubled
    return [f"{a.name}{j} * {b.name}{n - j}" for j in sorted(range(low, high + 1), key=lambda j: max(j, n - j))]


def coefficients(tape: Tape, order: int) -> list[str]:
    """Return the lines for all coefficients, as the equations say."""
    out = []
    for n in range(order + 1):
        for one in tape.series:
            if n < one.first:
                continue
            terms = inner(*one.factors, n) if one.factors else _terms(one.total or Sum(), n)
            out.append(f"{one.name}{n} = {total(terms)}")
        if n < order:
            for state, rate in tape.rates.items():
                out.append(f"{state.name}{n + 1} = {1 / (n + 1)!r} * ({total(_terms(rate, n))})")
    return out


def _terms(of: Sum, n: int) -> list[str]:
    constant = [str(of.constant)] if n == 0 and of.constant != 0.0 else []
    return constant + [scaled(by, f"{one.name}{n}") for one, by in of.terms.items() if one.has(n)]


class _Split:
    """Coefficients split into what earlier orders give (`early`) and what the newest of the states add (`slopes`)."""

    def __init__(self, tape: Tape, order: int) -> None:
        self.tape, self.order = tape, order
        self.lines: list[str] = []
        self.slopes: dict[Series, dict[Series, Number]] = {}
        """Of each series: by which number each state's newest coefficient enters."""
        self.early: dict[Series, str] = {}
        """Of each series: the name of what earlier orders give, in the present order; without one there is nothing."""

    def write(self) -> list[str]:
        tape = self.tape
        for state in tape.rates:
            self.slopes[state] = {} if state.is_early else {state: 1.0}
        for one in tape.series:
            terms = inner(*one.factors, 0) if one.factors else _terms(one.total or Sum(), 0)
            if one.first == 0:
                self.lines.append(f"{one.name}0 = {total(terms)}")
            self.slopes[one] = self._product_slopes(one) if one.factors else self._sum_slopes(one.name, one.total)
        rates = {state: self._sum_slopes(f"{state.name}_by_", rate) for state, rate in tape.rates.items()}
        for state, rate in tape.rates.items():
            self.lines.append(f"{state.name}1 = {total(_terms(rate, 0))}")
        for n in range(1, self.order + 1):
            self._next_order(n, rates)
        return self.lines

    def _slope(self, name: str, state: Series, terms: list[str]) -> Number:
        if len(terms) == 1 and not any(sign in terms[0] for sign in "+-*"):
            return terms[0]
        self.lines.append(f"{name}_{state.name} = {total(terms)}")
        return f"{name}_{state.name}"

    def _product_slopes(self, one: Series) -> dict[Series, Number]:
        assert one.factors
        a, b = one.factors
        found: dict[Series, list[str]] = {}
        for here, other in ((a, b), (b, a)) if a is not b else ((a, a),):
            if other.first == 0:
                for state, by in self.slopes[here].items():
                    by = times(2.0, by) if a is b else by
                    found.setdefault(state, []).append(scaled(by, f"{other.name}0"))
        return {state: self._slope(one.name, state, terms) for state, terms in found.items()}

    def _sum_slopes(self, name: str, of: Sum | None) -> dict[Series, Number]:
        found: dict[Series, list[tuple[Number, Number]]] = {}
        for one, number in (of or Sum()).terms.items():
            for state, by in self.slopes[one].items():
                found.setdefault(state, []).append((number, by))
        out: dict[Series, Number] = {}
        for state, pairs in found.items():
            if len(pairs) == 1 and 1.0 in pairs[0]:
                out[state] = times(*pairs[0])
            else:
                out[state] = self._slope(name, state, [str(times(*pair)) for pair in pairs])
        return out

    def _newest(self, slopes: dict[Series, Number], n: int) -> list[str]:
        return [scaled(by, f"{state.name}{n}") for state, by in slopes.items()]

    def _early_terms(self, of: Sum, n: int) -> list[str]:
        return [scaled(by, self._early_name(one, n)) for one, by in of.terms.items() if self._early_name(one, n)]

    def _early_name(self, one: Series, n: int) -> str:
        if one in self.tape.rates:
            return f"{one.name}{n}" if one.is_early and n >= one.first else ""
        return self.early.get(one, "")

    def _next_order(self, n: int, rates: dict[Series, dict[Series, Number]]) -> None:
        self.early = {}
        full = []
        for one in self.tape.series:
            if n < one.first:
                continue
            if one.factors:
                a, b = one.factors
                terms = inner(a, b, n, 1)
                for here, other in ((a, b), (b, a)) if a is not b else ((a, a),):
                    if other.first == 0 and self._early_name(here, n):
                        by = times(2.0, f"{other.name}0") if a is b else f"{other.name}0"
                        terms.append(scaled(by, self._early_name(here, n)))
            else:
                terms = self._early_terms(one.total or Sum(), n)
            newest = self._newest(self.slopes[one], n)
            if not newest:
                self.lines.append(f"{one.name}{n} = {total(terms)}")
                self.early[one] = f"{one.name}{n}"
                continue
            if terms:
                self.early[one] = f"{one.name}_{n}"
                self.lines.append(f"{one.name}_{n} = {total(terms)}")
            full.append(f"{one.name}{n} = {total([*([self.early[one]] if terms else []), *newest])}")
        if n == self.order:
            self.lines += full
            return
        by = repr(1 / (n + 1))
        for state, rate in self.tape.rates.items():
            early, newest = self._early_terms(rate, n), self._newest(rates[state], n)
            parts = [f"{by} * ({total(early)})"] if early else []
            parts += [f"{by} * ({total(newest)})"] if newest else []
            self.lines.append(f"{state.name}{n + 1} = {total(parts)}")
        self.lines += full


def quick_coefficients(tape: Tape, order: int) -> list[str]:
    """Return the lines for all coefficients, in the form that one step is computed by soonest."""
    return _Split(tape, order).write()


def needed(lines: Iterable[str], names: Iterable[str]) -> list[str]:
    """Return the lines that what has these names depends on, and those of the names themselves."""
    wanted, out = set(names), []
    for line in reversed([*lines]):
        name, code = line.split(" = ", 1)
        if name in wanted:
            wanted.update(_NAME.findall(code))
            out.append(line)
    return out[::-1]

"""The source of functions that differentiate steps in contact, eight steps at a time.

The lines of a step in lanes are differentiated one by one: sums and products, and the composition of a polynomial with
t(s) by its chain rule. So values and tangents have one description. Each kind of step becomes

base     the series of eight steps of known length; what the tangents need of them is kept in L
along    one direction: how t, u, w and the deck's motion at the end of the step change, at fixed s
turn     over a bent path: how forcing and factor, as polynomials about the step's start, change with parameters
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable

from wheeltapper.march.program import MAX_DEGREE
from wheeltapper.march.steps.common import POWERS, at_end, over_path, powers_of_length, time_at_end
from wheeltapper.march.steps.derive import total
from wheeltapper.march.steps.equations import BENT, FLAT, Terms, contact
from wheeltapper.march.steps.lanes import at, function, given, read, read_block, series

ENDS = {"t": "T", "u": "U", "w": "W", "Y": "DECK_Y", "Z": "DECK_V"}
"""What a step leads to, and how its rows are called."""
Line = tuple[str, str]
"""A name, and the code of its value."""


def ends_of(terms: Terms) -> list[str]:
    """Return the names of what a step leads to."""
    return list(ENDS)[: 5 if terms.deck else 3]


def _names_in(code: str) -> set[str]:
    return {node.id for node in ast.walk(ast.parse(code, mode="eval")) if isinstance(node, ast.Name)}


def _split(lines: Iterable[str]) -> list[Line]:
    """Return assignments, with names for sums that are factors: their values are used twice."""
    out: list[Line] = []
    for line in lines:
        target, code = line.split(" = ", 1)
        out.append((target, _named_factors(code, out)))
    return out


def _named_factors(code: str, made: list[Line]) -> str:
    """Give each sum that is a factor, beside something that is no constant, a name."""

    def visit(node: ast.expr) -> ast.expr:
        if isinstance(node, ast.BinOp):
            node.left, node.right = visit(node.left), visit(node.right)
            if isinstance(node.op, ast.Mult) and not any(_is_constant(side) for side in (node.left, node.right)):
                node.left, node.right = named(node.left), named(node.right)
        elif isinstance(node, ast.UnaryOp):
            node.operand = visit(node.operand)
        return node

    def named(node: ast.expr) -> ast.expr:
        if isinstance(node, ast.Name | ast.Constant):
            return node
        made.append((f"part{len(made)}", ast.unparse(node)))
        return ast.Name(made[-1][0])

    tree = ast.parse(code, mode="eval").body
    if not isinstance(tree, ast.BinOp | ast.UnaryOp | ast.Name | ast.Constant):
        return code
    return ast.unparse(visit(tree))


def _is_constant(node: ast.expr) -> bool:
    return _is_constant(node.operand) if isinstance(node, ast.UnaryOp) else isinstance(node, ast.Constant)


def rate_of(code: str, active: set[str]) -> str | None:
    """Return the derivative of an expression in which the names `active` change; None where it does not change."""

    def of(node: ast.expr) -> str | None:
        if isinstance(node, ast.Name):
            return f"d{node.id}" if node.id in active else None
        if isinstance(node, ast.UnaryOp):
            inner = of(node.operand)
            return None if inner is None else f"-({inner})"
        if not isinstance(node, ast.BinOp):
            return None
        left, right = of(node.left), of(node.right)
        if isinstance(node.op, ast.Mult):
            terms = [] if left is None else [f"{_bracketed(left)} * {_bracketed(ast.unparse(node.right))}"]
            terms += [] if right is None else [f"{_bracketed(ast.unparse(node.left))} * {_bracketed(right)}"]
            return " + ".join(terms) or None
        sign = "+" if isinstance(node.op, ast.Add) else "-"
        if left is None or right is None:
            return left if right is None else (right if sign == "+" else f"-({right})")
        return f"{left} {sign} {right if sign == '+' else _bracketed(right)}"

    return of(ast.parse(code, mode="eval").body)


def _bracketed(code: str) -> str:
    return code if re.fullmatch(r"[\w.]+", code) else f"({code})"


def _rates(lines: list[Line], active: set[str], told: dict[str, str]) -> list[Line]:
    """Return the derivatives of assignments; `told` holds those that a rule gives."""
    out = []
    for name, code in lines:
        rate = told.get(name) or (None if name in active else rate_of(code, active))
        if rate is not None:
            active.add(name)
            out.append((f"d{name}", rate))
    return out


def _needed(lines: list[Line], wanted: Iterable[str]) -> list[Line]:
    """Return the assignments on which some names depend."""
    names, out = set(wanted), []
    for name, code in reversed(lines):
        if name in names:
            names |= _names_in(code)
            out.append((name, code))
    return out[::-1]


def _values(terms: Terms, order: int) -> list[Line]:
    """Return the assignments of a step of known length h1."""
    out = [*given(terms), *read({"h1": "LANE_LENGTH"}), *series(terms, order)]
    for one, polynomial in contact(terms).compositions.items():
        slopes = [f"{k + 1}.0 * {polynomial}{k + 1}" for k in range(MAX_DEGREE)]
        out += [f"slope_{polynomial}{k} = {slope}" for k, slope in enumerate(slopes)]
        powers = contact(terms).powers
        for n in range(order):
            bend = [f"slope_{polynomial}0"] if n == 0 else []
            bend += [f"slope_{polynomial}{k} * {powers[k].name}{n}" for k in POWERS[1:-1] if powers[k].has(n)]
            out.append(f"bend_{one}{n} = {total(bend)}")
    out += [*powers_of_length(order), f"t = {time_at_end(order)}"]
    return _split([*out, *(f"{name} = {at_end(name, order)}" for name in ends_of(terms)[1:])])


def _turning(terms: Terms) -> dict[str, str]:
    """Return the names that change along a direction, with the rows of their changes."""
    rows = {"u0": "U", "w0": "W", "K": "K", "G": "G"} | ({} if terms.path == BENT else {"f0": "LOAD"})
    if terms.path != FLAT:
        rows |= {"amp_sin": "AMP_SIN", "amp_cos": "AMP_COS", "omega": "OMEGA"}
    if terms.deck:
        rows |= {"Y0": "DECK_Y", "Z0": "DECK_V", "prestress": "PRESTRESS", "deck_stiff": "DECK_STIFF"}
        rows |= {"deck_drag": "DECK_DRAG", "share": "SHARE"}
    return rows | ({"eta": "ETA"} if terms.hysteresis else {})


def _along(terms: Terms, order: int, lines: list[Line]) -> list[Line]:
    """Return the assignments for one direction."""
    before = [("dt0", at("LANE_OF_TIME"))]
    before += [(f"d{name}", at(f"LANE_OF_{row}")) for name, row in _turning(terms).items()]
    active, told = {"t0", *_turning(terms)}, {}
    if terms.path != FLAT:
        before += [("dphase", f"{at('LANE_OF_PHASE')} + omega * dt0"), ("ds", "c * dphase"), ("dc", "-(s * dphase)")]
        active |= {"s", "c"}
    tape = contact(terms)
    for one, polynomial in tape.compositions.items():
        row = {"c": "LANE_OF_FORCING", "b": "LANE_OF_FACTOR_HERE"}[polynomial]
        before += [(f"d{polynomial}{k}", at(row, k)) for k in POWERS]
        active |= {f"{polynomial}{k}" for k in POWERS}
        for n in range(order):
            moved = [f"d{polynomial}0"] if n == 0 else []
            moved += [f"d{polynomial}{k} * {tape.powers[k].name}{n}" for k in POWERS[1:] if tape.powers[k].has(n)]
            told[f"{one}{n}"] = total([*moved, *(f"bend_{one}{k} * dt{n - k}" for k in range(n + 1))])
    made = _rates(lines, active, told)
    made = [(name, f"dt0 + {code}" if name == "dt" else code) for name, code in made]
    return _needed([*before, *made], {f"d{name}" for name in ends_of(terms)})


def pair(terms: Terms, order: int) -> tuple[str, str]:
    """Return the functions `base` and `along` of a kind."""
    lines = _values(terms, order)
    known = {name for name, _ in lines}
    made = _along(terms, order, lines)
    assigned = {name for name, _ in made}
    kept = sorted({name for _, code in made for name in _names_in(code)} & known - assigned, key=_natural)
    loaded = {name: code for name, code in lines if code.startswith("L[")}
    places = {name: k for k, name in enumerate(name for name in kept if name not in loaded)}
    body = []
    for name, code in _needed(lines, {*kept, *ends_of(terms)}):
        body.append(f"{name} = {code}")
        body += [f"{at('LANE_BASE', places[name])} = {name}"] if name in places else []
    body += [f"L[LANE_{ENDS[name]}_END + i] = {name}" for name in ends_of(terms)]
    base = function(f"base_{terms.name}_{order}", f"Make the series of steps of known length ({terms.name}).", body)
    held = loaded | {name: at("LANE_BASE", k) for name, k in places.items()}
    body = []
    for name, code in made:  # what is kept is read where it is used first
        body += [f"{other} = {held.pop(other)}" for other in sorted(_names_in(code), key=_natural) if other in held]
        body.append(f"{name} = {code}")
    body += [f"L[LANE_OF_{ENDS[name]}_END + i] = d{name}" for name in ends_of(terms)]
    return base, function(f"along_{terms.name}_{order}", f"Go in one direction ({terms.name}).", body)


def _natural(name: str) -> list[str]:
    """Return a key by which u2 comes before u10."""
    return [part.zfill(4) for part in re.split(r"(\d+)", name)]


def turn_source() -> str:
    """Return the function that turns changes of a path into those of polynomials about the step's start."""
    names = {"time": "LANE_TIME", "K": "LANE_K", "G": "LANE_G", "pace": "LANE_PACE", "origin": "LANE_ORIGIN"}
    out = [*read(names), "at_y = pace * time - origin", "rate_y = pace", *read_block("piece_y", "LANE_PATH")]
    lines = _split([*out, *read_block("piece_b", "LANE_FACTOR"), *over_path(Terms(BENT))])
    rows = {"K": "K", "G": "G", "rate_y": "PACE", "at_y": "AHEAD"}
    before = [(f"d{name}", at(f"LANE_OF_{row}")) for name, row in rows.items()]
    for k in POWERS:
        before += [(f"dpiece_y{k}", at("LANE_OF_PATH", k)), (f"dpiece_b{k}", at("LANE_OF_FACTOR", k))]
    made = _rates(lines, {name[1:] for name, _ in before}, {})
    ends = [(f"dc{k}", at("LANE_OF_FORCING", k)) for k in POWERS]
    ends += [(f"db{k}", at("LANE_OF_FACTOR_HERE", k)) for k in POWERS]
    body = [f"{name} = {code}" for name, code in _needed([*lines, *before, *made], {name for name, _ in ends})]
    body += [f"{place} = {name}" for name, place in ends]
    return function("turn_path", "Find how forcing and factor change about the step's start.", body)

"""The source of functions that differentiate steps: eight steps at a time, or one step in eight directions.

The lines of a step are differentiated one by one: sums and products, and the composition of a polynomial with t(s) by
its chain rule. So values and tangents have one description. Each kind of step in contact becomes

base     the series of eight steps of known length; what the tangents need of them is kept in L
along    one direction: how t, u, w and the deck's motion at the end of the step change, at fixed s
turn     how what such steps take changes with a cell's numbers and pieces of its path
turned   of one step: how its series change in eight directions, at fixed s; of a step in time, at fixed time; and how
         the path about its start does, or at a joint of two pieces, and the force by s
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable

from wheeltapper.march.common import program
from wheeltapper.march.common.program import MAX_DEGREE
from wheeltapper.march.steps import common
from wheeltapper.march.steps.derive import coefficients, needed, total
from wheeltapper.march.steps.equations import BENT, FLAT, Free, Terms, contact, free, pushing
from wheeltapper.march.steps.lanes import at, function, given, read, series
from wheeltapper.march.steps.layout import FLIGHT_ORDER
from wheeltapper.march.steps.scalar import given_to_push
from wheeltapper.march.steps.tape import Tape

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
    kept = needed((" = ".join(line) for line in lines), wanted)
    return [(name, code) for name, _, code in (line.partition(" = ") for line in kept)]


def _values(terms: Terms, order: int) -> list[Line]:
    """Return the assignments of a step of known length h1."""
    out = [*given(terms), *read({"h1": "LANE_LENGTH"}), *series(terms, order), *_bends(contact(terms), order)]
    out += [*common.powers_of_length(order), f"t = {common.time_at_end(order)}"]
    return _split([*out, *(f"{name} = {common.at_end(name, order)}" for name in ends_of(terms)[1:])])


def _bends(tape: Tape, order: int) -> list[str]:
    """Return the lines for the derivatives, by the time, of what is a polynomial of the time."""
    out = []
    for one, polynomial in tape.compositions.items():
        out += [f"slope_{polynomial}{k} = {k + 1}.0 * {polynomial}{k + 1}" for k in range(MAX_DEGREE)]
        for n in range(order):
            bend = [f"slope_{polynomial}0"] if n == 0 else []
            bend += [
                f"slope_{polynomial}{k} * {tape.powers[k].name}{n}"
                for k in common.POWERS[1:-1]
                if tape.powers[k].has(n)
            ]
            out.append(f"bend_{one}{n} = {total(bend)}")
    return out


def _moved(tape: Tape, order: int) -> dict[str, str]:
    """Return the derivatives of what is a polynomial of the time, by name: the polynomial changes, and the time."""
    out = {}
    for one, polynomial in tape.compositions.items():
        for n in range(order):
            moved = [f"d{polynomial}0"] if n == 0 else []
            moved += [
                f"d{polynomial}{k} * {tape.powers[k].name}{n}" for k in common.POWERS[1:] if tape.powers[k].has(n)
            ]
            out[f"{one}{n}"] = total([*moved, *(f"bend_{one}{k} * dt{n - k}" for k in range(n + 1))])
    return out


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
    active = {"t0", *_turning(terms)}
    if terms.path != FLAT:
        before += [("dphase", f"{at('LANE_OF_PHASE')} + omega * dt0"), ("ds", "c * dphase"), ("dc", "-(s * dphase)")]
        active |= {"s", "c"}
    tape = contact(terms)
    for polynomial in tape.compositions.values():
        row = {"c": "LANE_OF_FORCING", "b": "LANE_OF_FACTOR_HERE"}[polynomial]
        before += [(f"d{polynomial}{k}", at(row, k)) for k in common.POWERS]
        active |= {f"{polynomial}{k}" for k in common.POWERS}
    made = _rates(lines, active, _moved(tape, order))
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


_COLUMNS = {"centre": program.CENTRE, "sine": program.SINE, "cosine": program.COSINE, "wavenumber": program.WAVENUMBER}
"""Columns of a piece of the path that change with parameters, beside those of its polynomials."""
_DECK = {"mass": "DECK_MASS", "bearing": "DECK_STIFFNESS", "dashpot": "DECK_DAMPING", "loaded": "PRESTRESS"}
_PER_MASS = {"per_mass": "-(per_mass * per_mass * dmass)"}


def _columns(bent: bool) -> dict[str, int]:
    """Return names for what changes of a piece of the path, and their columns."""
    many = common.POWERS if bent else (0,)
    out = _COLUMNS | {f"path{k}": program.COEFFICIENT + k for k in many}
    return out | {f"factor{k}": program.FACTOR + k for k in many if bent}


def _deck() -> list[str]:
    """Return the lines for what the equations need of a deck."""
    out = ["per_mass = 1.0 / mass", "deck_stiff = per_mass * bearing", "deck_drag = per_mass * dashpot"]
    return [*out, "share = on * per_mass", "prestress = share * loaded"]


def turn_source(bent: bool) -> str:
    """Return the function that turns changes of a cell's numbers, and of pieces of its path, into those of steps."""
    numbers = {"pace": "PACE", "lift": "LIFT", "K": "STIFFNESS", "G": "DAMPING", "eta": "HYSTERESIS", **_DECK}
    same = [f"{name} = L[LANE_NUMBERS + {entry}]" for name, entry in numbers.items()]
    same += [f"d{name} = L[LANE_OF_NUMBERS + {entry}]" for name, entry in numbers.items()]
    lines = read({"time": "LANE_TIME", "shift": "LANE_SHIFT", "on": "LANE_ON"})
    lines += [f"{name} = {at('LANE_PIECE', column)}" for name, column in _columns(bent).items()]
    lines += [*_deck(), f"per_scale = 1.0 / {at('LANE_PIECE', program.SCALE)}", *common.about_start(bent)]
    lines += [f"c{k} = {common.forcing(k)}" for k in common.POWERS] if bent else ["f0 = 1.0 + K * y0"]
    changes = [(f"d{name}", at("LANE_OF_PIECE", column)) for name, column in _columns(bent).items()]
    changes += [("dshift", at("LANE_OF_SHIFT"))]
    split = _split(lines)
    made = _rates(split, {*numbers, *(name[1:] for name, _ in changes)}, _PER_MASS)
    rows = {"K": "K", "G": "G", "eta": "ETA", "amp_sin": "AMP_SIN", "amp_cos": "AMP_COS", "omega": "OMEGA"}
    rows |= {"phase": "PHASE", "share": "SHARE", "prestress": "PRESTRESS", "deck_stiff": "DECK_STIFF"}
    rows |= {"deck_drag": "DECK_DRAG"} | ({} if bent else {"f0": "LOAD"})
    ends = {f"d{name}": at(f"LANE_OF_{row}") for name, row in rows.items()}
    for name, row in (("c", "LANE_OF_FORCING"), ("b", "LANE_OF_FACTOR_HERE")):
        ends |= {f"d{name}{k}": at(row, k) for k in common.POWERS if bent}
    body = [f"{name} = {code}" for name, code in _needed([*split, *changes, *made], ends)]
    body += [f"{place} = {name}" for name, place in ends.items()]
    name = f"turn_{'bent' if bent else 'level'}"
    return function(name, "Find how what steps take changes with the numbers of a cell and its path.", body, same)


# -- one step in eight directions --------------------------------------------------------------------------------------


_MOTION = {"Y0": ("DECK_Y", "DY"), "Z0": ("DECK_V", "DZ")}


def _one_given(deck: bool, motion: dict[str, tuple[str, str]], numbers: dict[str, str]) -> tuple[list[str], list[Line]]:
    """Return the lines that read a state and the numbers, and those that read their changes."""
    motion, numbers = motion | (_MOTION if deck else {}), numbers | (_DECK if deck else {})
    lines = [f"{name} = S[STATE + {column}]" for name, (column, _) in motion.items()]
    lines += [f"{name} = numbers[{entry}]" for name, entry in numbers.items()]
    changes = [(f"d{name}", f"D[CARRIED + {row}, i]") for name, (_, row) in motion.items()]
    changes += [(f"d{name}", f"D[OF_NUMBERS + {entry}, i]") for name, entry in numbers.items()]
    if deck:
        lines += ["on = S[STATE + ON_DECK]", *_deck()]
    return lines, changes


def _wave(changes: list[Line]) -> list[str]:
    """Return the lines that read the path's harmonic; those that read its changes are added."""
    names = {"amp_sin": "HERE_AMP_SIN", "amp_cos": "HERE_AMP_COS", "omega": "HERE_OMEGA"}
    changes += [(f"d{name}", f"D[{entry}, i]") for name, entry in names.items()]
    out = [f"{name} = S[{entry}]" for name, entry in names.items()]
    return [*out, "phase = S[HERE_PHASE0]", "s = sin(phase)", "c = cos(phase)"]


def _polynomial(name: str, entry: str, degree: str, changes: list[Line], first: str = "0.0") -> list[str]:
    """Return the lines that read a polynomial; those that read its changes are added."""
    changes += [(f"d{name}{k}", f"D[{entry} + {k}, i]") for k in common.POWERS]
    return common.given_polynomial(name, f"S[{entry}", degree, first)


def _coefficients_of(rows: dict[str, tuple[str, int]]) -> dict[str, str]:
    """Return the changes of the coefficients of series, and where they are written."""
    return {f"d{series}{n}": f"D[{row} + {n}, i]" for row, (series, last) in rows.items() for n in range(last + 1)}


def _directions(
    name: str, lines: list[Line], changes: list[Line], made: list[Line], ends: dict[str, str],
    values: dict[str, str] | None = None,
) -> str:  # fmt: skip
    """Return the function: values once, those of `values` kept, and their changes eight times."""
    there, values = {one for one, _ in made} | {one for one, _ in changes}, values or {}
    inner = _needed([*changes, *made], ends.keys() & there)
    outer = _needed(lines, {*values, *(one for _, code in inner for one in _names_in(code))})
    body = [*(f"{one} = {code}" for one, code in outer), *(f"{place} = {one}" for one, place in values.items())]
    body += ["for i in range(8):", *(f"    {one} = {code}" for one, code in inner)]
    body += [f"    {place} = {one if one in there else '0.0'}" for one, place in ends.items()]
    return "\n".join([f"def {name}(numbers, S, D):", *("    " + line for line in body), ""])


def _piece() -> tuple[list[Line], list[Line], list[Line]]:
    """Return the lines for a piece of the path about S[PIECE_TIME], those that read changes, and the changes."""
    numbers = {"pace": "PACE", "lift": "LIFT"}
    lines = ["time = S[PIECE_TIME]", "shift = S[PIECE_SHIFT]", "per_scale = 1.0 / S[PIECE_ROW + SCALE]"]
    lines += [f"{name} = numbers[{entry}]" for name, entry in numbers.items()]
    lines += [f"{name} = S[PIECE_ROW + {column}]" for name, column in _columns(True).items()]
    lines += [*common.about_start(True), "s = sin(phase)", "c = cos(phase)", "wave = amp_sin * s + amp_cos * c"]
    lines += ["height = y0 + wave", "velocity = y1 + omega * (amp_sin * c - amp_cos * s)"]
    lines += ["acceleration = 2.0 * y2 - omega * omega * wave"]
    changes = [("dshift", "D[CARRIED + DSHIFT, i]")]
    changes += [(f"d{name}", f"D[OF_NUMBERS + {entry}, i]") for name, entry in numbers.items()]
    changes += [(f"d{name}", f"D[PIECE_ROW + {column}, i]") for name, column in _columns(True).items()]
    split = _split(lines)
    told = {"s": "c * dphase", "c": "-(s * dphase)"}
    return split, changes, _rates(split, {name[1:] for name, _ in changes}, told)


def turned_piece_source() -> str:
    """Return the function for the changes of a piece of the path about a step's start, at fixed time."""
    ends = _coefficients_of({"HERE_POLY": ("y", MAX_DEGREE), "HERE_FACTOR": ("b", MAX_DEGREE)})
    rows = {"amp_sin": "HERE_AMP_SIN", "amp_cos": "HERE_AMP_COS", "omega": "HERE_OMEGA", "phase": "HERE_PHASE0"}
    return _directions("turned_piece", *_piece(), ends | {f"d{name}": f"D[{row}, i]" for name, row in rows.items()})


def turned_joint_source() -> str:
    """Return the function for the path at a joint of two pieces, on one of them, and for its changes at fixed time."""
    changed = {"height": "JOINT_HEIGHT", "velocity": "JOINT_VELOCITY"}
    ends = {f"d{name}": f"D[{row}, i]" for name, row in changed.items()}
    values = {name: f"S[{row}]" for name, row in changed.items()}
    values |= {"acceleration": "S[JOINT_ACCELERATION]", "b0": "S[JOINT_FACTOR]"}
    return _directions("turned_joint", *_piece(), ends, values)


def turned_push_source(order: int) -> str:
    """Return the function for the changes of a step's force by s, from those of u and of the force."""
    split = _split([*given_to_push(order), *coefficients(pushing(order), order - 1)])
    changes = [(f"d{name}{n}", f"D[{name.upper()} + {n}, i]") for name in "uN" for n in range(order)]
    made = _rates(split, {name[1:] for name, _ in changes}, {})
    return _directions(f"turned_push_{order}", split, changes, made, _coefficients_of({"PUSH": ("push", order - 1)}))


def turned_source(terms: Terms, order: int) -> str:
    """Return the function for the changes of a step's series at fixed s: T, U, W, Y, Z, and N."""
    numbers = {"K": "STIFFNESS", "G": "DAMPING", "quadratic": "QUADRATIC", "cubic": "CUBIC"}
    numbers |= {"eta": "HYSTERESIS"} if terms.hysteresis else {}
    lines, changes = _one_given(terms.deck, {"u0": ("A", "DA"), "w0": ("B", "DB")}, numbers)
    changes += [("dt0", "D[CARRIED + DT, i]")]
    lines += ["degree = S[HERE_DEGREE]", "factor_degree = S[HERE_FACTOR_DEGREE]"]
    if terms.path == BENT:
        lines += _polynomial("y", "HERE_POLY", "degree", changes) + [
            f"c{k} = {common.forcing(k)}" for k in common.POWERS
        ]
        lines += _polynomial("b", "HERE_FACTOR", "factor_degree", changes, "1.0")
    else:
        lines += ["y0 = S[HERE_POLY]", "f0 = 1.0 + K * y0"]
        changes += [("dy0", "D[HERE_POLY, i]")]
    if terms.path != FLAT:
        lines += [*_wave(changes), *common.gains(terms), "wave0 = gain_sin * s + gain_cos * c"]
        lines += ["rise0 = omega * (gain_sin * c - gain_cos * s)"]
        changes += [("dphase", "D[HERE_PHASE0, i] + omega * dt0"), ("ds", "c * dphase"), ("dc", "-(s * dphase)")]
    tape = contact(terms)
    split = _split([*lines, *series(terms, order), *_bends(tape, order)])
    told = _moved(tape, order) | _PER_MASS
    made = _rates(split, {"t0", *(name[1:] for name, _ in changes)}, told)
    rows = {"T": ("t", order), "U": ("u", order), "W": ("w", order), "N": ("N", order - 1)}
    rows |= {"Y": ("Y", order), "Z": ("Z", order)} if terms.deck else {}
    return _directions(f"turned_{terms.name}_{order}", split, changes, made, _coefficients_of(rows))


def free_turned_source(terms: Free) -> str:
    """Return the function for the changes of the series of a step in time: U (y), W (v), Y, Z, and N of a bond."""
    order = int(FLIGHT_ORDER)
    lines, changes = _one_given(terms.deck, {"y0": ("A", "DA"), "v0": ("B", "DB")}, {"K": "STIFFNESS", "G": "DAMPING"})
    rows = {"U": ("y", order), "W": ("v", order)} | ({"Y": ("Y", order), "Z": ("Z", order)} if terms.deck else {})
    if terms.bonded:
        lines += ["degree = S[HERE_DEGREE]", "factor_degree = S[HERE_FACTOR_DEGREE]"]
        lines += _polynomial("p", "HERE_POLY", "degree", changes)
        lines += _polynomial("b", "HERE_FACTOR", "factor_degree", changes, "1.0")
        lines += [*_wave(changes), "omega2 = omega * omega", "wave0 = amp_sin * s + amp_cos * c"]
        lines += ["rise0 = omega * (amp_sin * c - amp_cos * s)"]
        changes += [("dphase", "D[HERE_PHASE0, i]"), ("ds", "c * dphase"), ("dc", "-(s * dphase)")]
        rows["N"] = ("N", order)
    split = _split([*lines, *coefficients(free(terms), order)])
    made = _rates(split, {name[1:] for name, _ in changes}, _PER_MASS)
    return _directions(f"turned_{terms.name}_{order}", split, changes, made, _coefficients_of(rows))

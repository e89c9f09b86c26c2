"""Runs of plain statements in a function's source, given to the compiler as one operation each.

Numba finds types for each operation, and writes code for it: in a function of some thousand sums and products that is
nearly all of the time that its compilation takes. All values are floats there. So a run of assignments that only add,
subtract and multiply, of what has a name or stands at a fixed place of an array, becomes one call, whose code is
written here in one go.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np import arrayobj

from wheeltapper.march.steps.lane_rows import LANES

FEWEST = 12
"""Assignments that are worth a call."""
_OPERATIONS = {ast.Add: "fadd", ast.Sub: "fsub", ast.Mult: "fmul"}
ARRAYS = {"L": 1, "S": 1, "D": LANES}
"""Arrays of floats, and how many stand in a row: one, or one for each direction."""
LANE = "i"
"""The only name that may stand in a place of an array beside constants: the lane."""


@dataclass(frozen=True)
class _Place:
    """A place in a flat array: which, and how far from its start, or from the lane's entry there."""

    array: str
    entry: int
    has_lane: bool


class _Reader:
    """What of a source is plain; constants have the values that they have in the function's module."""

    def __init__(self, known: dict[str, Any]) -> None:
        self.known = known

    def place(self, node: ast.expr) -> _Place | None:
        """Return the place that a subscript means, if it is a fixed one."""
        if not (isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and node.value.id in ARRAYS):
            return None
        inside, width = node.slice, ARRAYS[node.value.id]
        parts = inside.elts if isinstance(inside, ast.Tuple) else [inside]
        entry, lanes, rest = 0, 0, list(parts)
        while rest:
            part = rest.pop()
            if isinstance(part, ast.BinOp) and isinstance(part.op, ast.Add):
                rest += [part.left, part.right]  # beside the lane all counts rows
            elif isinstance(part, ast.Name) and part.id == LANE:
                lanes += 1
            elif isinstance(part, ast.Name) and part.id in self.known:
                entry += int(self.known[part.id])
            elif isinstance(part, ast.Constant) and isinstance(part.value, int):
                entry += part.value
            else:
                return None
        return _Place(node.value.id, width * entry, lanes == 1) if lanes <= 1 else None

    def fits(self, node: ast.expr) -> bool:
        """Return True for what only adds, subtracts and multiplies."""
        if isinstance(node, ast.BinOp):
            return type(node.op) in _OPERATIONS and self.fits(node.left) and self.fits(node.right)
        if isinstance(node, ast.UnaryOp):
            return isinstance(node.op, ast.USub) and self.fits(node.operand)
        if isinstance(node, ast.Subscript):
            return self.place(node) is not None
        return isinstance(node, ast.Name) or (isinstance(node, ast.Constant) and isinstance(node.value, float))

    def is_plain(self, statement: ast.stmt) -> bool:
        """Return True for an assignment of such a value to a name or to a fixed place."""
        if not isinstance(statement, ast.Assign) or len(statement.targets) != 1:
            return False
        target = statement.targets[0]
        return (isinstance(target, ast.Name) or self.place(target) is not None) and self.fits(statement.value)


def condensed(code: str, known: dict[str, Any]) -> tuple[str, dict[str, Any]]:
    """Return the source of a function with calls in place of long runs, and what these call, by name.

    `known` are the constants of the function's module.
    """
    tree = ast.parse(code)
    called: dict[str, Any] = {}
    _condense(tree, tree, _Reader(known), called)
    return ast.unparse(tree), called


def _condense(block: Any, tree: ast.Module, reader: _Reader, called: dict[str, Any]) -> None:
    for name in ("body", "orelse"):
        statements = getattr(block, name, None)
        if not isinstance(statements, list):
            continue
        for one in statements:
            _condense(one, tree, reader, called)
        out: list[ast.stmt] = []
        for run, is_plain in _runs(statements, reader):
            out += _call(run, tree, reader, called) if is_plain and len(run) >= FEWEST else run
        setattr(block, name, out)


def _assigned(statement: ast.stmt) -> str | None:
    target = statement.targets[0] if isinstance(statement, ast.Assign) else None
    return target.id if isinstance(target, ast.Name) else None


def _runs(statements: list[ast.stmt], reader: _Reader) -> Iterator[tuple[list[Any], bool]]:
    """Split statements into runs of plain ones, each of which assigns to a new name or place, and of others."""
    run: list[ast.stmt] = []
    names: set[str | None] = set()
    was_plain = False
    for one in statements:
        is_plain = reader.is_plain(one)
        if run and (is_plain != was_plain or (is_plain and _assigned(one) in names)):
            yield run, was_plain
            run, names = [], set()
        run.append(one)
        was_plain = is_plain
        if is_plain and _assigned(one):
            names.add(_assigned(one))
    if run:
        yield run, was_plain


def _call(run: list[ast.Assign], tree: ast.Module, reader: _Reader, called: dict[str, Any]) -> list[ast.stmt]:
    """Return the statement that stands for a run."""
    inside = {id(node) for one in run for node in ast.walk(one)}
    made, given = set[str](), dict[str, None]()
    for one in run:
        for node in (*ast.walk(one.value), *ast.walk(one.targets[0])):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id not in made:
                given[node.id] = None
        made.add(_assigned(one) or "")
    elsewhere = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and id(node) not in inside}
    wanted = [name for name in map(_assigned, run) if name in elsewhere]
    inputs = [name for name in given if name not in reader.known]
    name = f"run{len(called)}"
    called[name] = _operation(run, reader, inputs, [one for one in wanted if one])
    text = f"{name}({', '.join(inputs)})"
    return ast.parse(f"{', '.join(str(one) for one in wanted)} = {text}" if wanted else text).body


def _operation(run: list[ast.Assign], reader: _Reader, given: list[str], wanted: list[str]) -> Any:
    """Return the function that is called: what is `given` comes in, what is `wanted` goes out."""
    result = types.UniTuple(types.float64, len(wanted)) if len(wanted) > 1 else types.float64 if wanted else types.none

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        known: dict[str, Any] = {}
        for name, value, kind in zip(given, values, signature.args, strict=True):
            if name in ARRAYS:
                known[name] = arrayobj.make_array(kind)(context, builder, value).data
            else:
                wants = types.intp if name == LANE else types.float64
                known[name] = context.cast(builder, value, kind, wants)

        def pointer(place: _Place) -> Any:
            entry = ir.Constant(cgutils.intp_t, place.entry)
            return builder.gep(known[place.array], [builder.add(known[LANE], entry) if place.has_lane else entry])

        def write(node: ast.expr) -> Any:
            if isinstance(node, ast.Name):
                return known[node.id]
            if isinstance(node, ast.Constant):
                return ir.Constant(ir.DoubleType(), node.value)
            if isinstance(node, ast.UnaryOp):
                return builder.fneg(write(node.operand))
            if isinstance(node, ast.BinOp):
                return getattr(builder, _OPERATIONS[type(node.op)])(write(node.left), write(node.right))
            place = reader.place(node)
            assert place
            return builder.load(pointer(place))

        for one in run:
            value, place = write(one.value), reader.place(one.targets[0])
            if place is None:
                known[_assigned(one) or ""] = value
            else:
                builder.store(value, pointer(place))
        found = [known[name] for name in wanted]
        if not found:
            return context.get_dummy_value()
        return found[0] if len(found) == 1 else context.make_tuple(builder, result, found)

    def typed(*args: Any) -> Any:
        return result(*args), generate

    made: dict[str, Any] = {"typed": typed}  # Numba wants each argument by name
    names = ", ".join(f"x{k}" for k in range(len(given)))
    exec(f"def operation(typing, {names}):\n    return typed({names})", made)
    return intrinsic(made["operation"])

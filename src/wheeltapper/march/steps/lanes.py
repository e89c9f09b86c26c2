"""The source of functions that make steps of eight cells at a time, and find what ends them.

Each is one loop over a literal 8 whose body has no branch and no call, and every number stands in one flat array at an
offset that is known when it is compiled (lane_rows.py): then LLVM turns the lanes into vectors.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import comb, factorial

from wheeltapper.march.common.program import DEFAULT_ORDER, MAX_DEGREE
from wheeltapper.march.steps import common
from wheeltapper.march.steps.derive import coefficients, needed, quick_coefficients
from wheeltapper.march.steps.equations import BENT, FLAT, Free, Terms, contact, free
from wheeltapper.march.steps.layout import FLIGHT_ORDER

NOISE = 1e-13
CLOSE = 1e-13
_MOTION = {"Y0": "LANE_DECK_Y", "Z0": "LANE_DECK_V"}
_DECK = {
    "on": "LANE_ON", "prestress": "LANE_PRESTRESS", "deck_stiff": "LANE_DECK_STIFF", "deck_drag": "LANE_DECK_DRAG",
    "share": "LANE_SHARE",
}  # fmt: skip
_WAVE = {
    "omega": "LANE_OMEGA", "turn_rate": "LANE_RATE", "turn_offset": "LANE_OFFSET", "amp_sin": "LANE_AMP_SIN",
    "amp_cos": "LANE_AMP_COS",
}  # fmt: skip
_PATH = {"pace": "LANE_PACE", "origin": "LANE_ORIGIN"}
_END = {"e0": "LANE_BUSH_Y", "bush": "LANE_BUSH", "bush_rate": "LANE_BUSH_RATE", "gives": "LANE_GIVES"}
_LAW = {"centre_law": "LANE_LAW_CENTRE", "rate_law": "LANE_LAW_RATE"}


def function(name: str, says: str, body: list[str], before: Iterable[str] = ()) -> str:
    """Return the source of a function that does the same in all lanes, and something before."""
    out = [f"def {name}(L):", f'    """{says}"""', *(f"    {line}" for line in before), "    for i in range(8):"]
    return "\n".join([*out, *("        " + line for line in body), ""])


def at(row: str, n: int = 0) -> str:
    """Return the place of coefficient n of a series, or of entry n of a block of rows."""
    return f"L[{row} + {8 * n} + i]" if n else f"L[{row} + i]"


def read(names: dict[str, str]) -> list[str]:
    """Return lines that read rows into names."""
    return [f"{name} = {at(row)}" for name, row in names.items()]


def read_block(name: str, row: str, many: int = MAX_DEGREE + 1) -> list[str]:
    """Return lines that read a block of rows."""
    return [f"{name}{k} = {at(row, k)}" for k in range(many)]


def written(row: str, name: str, last: int) -> list[str]:
    """Return lines that write the coefficients of a series."""
    return [f"{at(row, n)} = {name}{n}" for n in range(last + 1)]


def horner(coefficients: list[str], x: str) -> str:
    """Return the polynomial with these coefficients by Horner's rule."""
    out = coefficients[-1]
    for c in reversed(coefficients[:-1]):
        out = f"({c} + {x} * {out})"
    return out


def sincos(turns: str) -> list[str]:
    """Return lines for s and c, sine and cosine of `turns` turns: quarters are split off, then Taylor's series."""
    sine = [repr((-1) ** k / factorial(2 * k + 1)) for k in range(8)]
    cosine = [repr((-1) ** k / factorial(2 * k)) for k in range(9)]
    return [
        f"turn = {turns}",
        "quarter = np.rint(4.0 * turn)",
        "angle = (turn - 0.25 * quarter) * 6.283185307179586",
        "angle2 = angle * angle",
        f"sa = angle * {horner(sine, 'angle2')}",
        f"ca = {horner(cosine, 'angle2')}",
        "m = quarter - 4.0 * np.floor(0.25 * quarter)",
        "odd = m == 1.0 or m == 3.0",
        "s_of = ca if odd else sa",
        "c_of = sa if odd else ca",
        "s = -s_of if m >= 2.0 else s_of",
        "c = -c_of if m == 1.0 or m == 2.0 else c_of",
    ]


def harmonic(sine: str, cosine: str) -> list[str]:
    """Return lines for a harmonic with these factors, and its rate, at a step's start."""
    out = sincos("turn_rate * time - turn_offset")
    return [*out, f"wave0 = {sine} * s + {cosine} * c", f"rise0 = omega * ({sine} * c - {cosine} * s)"]


def given(terms: Terms) -> list[str]:
    """Return lines that read what a step in contact is given."""
    names = {"time": "LANE_TIME", "u0": "LANE_U0", "w0": "LANE_W0", "K": "LANE_K", "G": "LANE_G"}
    names |= {"cubic": "LANE_CUBIC", "quadratic": "LANE_QUADRATIC"}
    names |= {} if terms.path == BENT else {"f0": "LANE_LOAD"}
    names |= {} if terms.path == FLAT else _WAVE
    names |= _PATH if terms.path == BENT else {}
    names |= (_MOTION | _DECK if terms.deck else {}) | ({"eta": "LANE_ETA"} if terms.hysteresis else {})
    names |= (_END if terms.end else {}) | (_LAW if terms.yields else {})
    names |= {"y0": "LANE_LEVEL"} if terms.end and terms.path == FLAT else {}
    out = read(names)
    if terms.path == BENT:
        out += ["at_y = pace * time - origin", "rate_y = pace", *read_block("piece_y", "LANE_PATH")]
        out += [*(read_block("piece_b", "LANE_FACTOR") if terms.factor else []), *common.over_path(terms)]
    if terms.path != FLAT:
        out += [*common.gains(terms), *harmonic("gain_sin", "gain_cos")]
    if terms.yields:
        out += ["at_r = at_y", "rate_r = rate_y", *read_block("piece_r", "LANE_RESIDUAL")]
        out += [*common.shifted("r", "piece_r"), *read_block("terms", "LANE_LAW"), *common.law()]
    return [*out, *common.begins(terms)]


def given_in_time(terms: Free) -> list[str]:
    """Return lines that read what a step in time is given."""
    names = {"time": "LANE_TIME", "y0": "LANE_U0", "v0": "LANE_W0", "K": "LANE_K", "G": "LANE_G", **_WAVE, **_PATH}
    out = read(names | (_MOTION | _DECK if terms.deck else {}) | (_END if terms.end else {}))
    out += ["omega2 = omega * omega", *harmonic("amp_sin", "amp_cos"), "at_p = pace * time - origin", "rate_p = pace"]
    out += [*read_block("piece_y", "LANE_PATH"), *common.shifted("p", "piece_y")]
    if terms.bonded:
        out += [
            "at_b = at_p",
            "rate_b = rate_p",
            *read_block("piece_b", "LANE_FACTOR"),
            *common.shifted("b", "piece_b"),
        ]
    return out


def series(terms: Terms, order: int) -> list[str]:
    """Return lines for the coefficients of a step in contact."""
    waits = terms == Terms(FLAT) and order == DEFAULT_ORDER  # so short that the processor waits for it
    lines = (quick_coefficients if waits else coefficients)(contact(terms), order)
    return [line for line in lines if not line.startswith("w0 = ")]  # it is given


def _length(terms: Terms, order: int) -> list[str]:
    """Return lines for h1, as in steplength.py."""
    out = _reaching("reach", order, common.last_terms(terms, order - 1), common.last_terms(terms, order), "goal")
    if terms.end:
        few = order - 2
        out += [f"earlier = goal * {(few - 1) / (order - 1)!r} + FORGIVEN", "gain = max(1.0, bush)"]
        out += _reaching("sooner", few, common.last_terms(terms, few - 1), common.last_terms(terms, few), "earlier")
        out += _reaching("giving", order, [f"gain * abs(e{order - 1})"], [f"gain * abs(e{order})"], "goal")
        out += ["reach_of_all = min(reach, min(sooner, giving))"]
    reach = "reach_of_all" if terms.end else "reach"
    return [
        *out,
        f"h1 = min({reach}, STABLE * {order}.0 / max({common.fastest(terms)}, FLOOR))"
        if _may_be_fast(terms)
        else f"h1 = {reach}",
        *common.powers_of_length(order),
    ]


def _reaching(name: str, n: int, before: list[str], last: list[str], goal: str) -> list[str]:
    """Return lines for the length at which terms n - 1 and n reach a goal."""
    return [
        f"{name}_before = {_largest(before)}",
        f"{name}_last = {_largest(last)}",
        f"{name}_start = UNIT * ({goal} / {n - 1} + LOG_SAFETY + BIAS)",
        f"{name}_first = {name}_start + (UNIT * BIAS - np.float64(np.float64({name}_before).view(np.int64))) / {n - 1}",
        f"{name}_second = {name}_start + (UNIT * BIAS - np.float64(np.float64({name}_last).view(np.int64))) / {n}",
        f"{name} = min(LONGEST, np.int64(min({name}_first, {name}_second)).view(np.float64))",
    ]


def _largest(terms: list[str]) -> str:
    out = "FLOOR"
    for term in terms:
        out = f"max({term}, {out})"
    return out


def _may_be_fast(terms: Terms) -> bool:
    """Return False where cells whose suspension limits a step do not come: they take the path for a bent one."""
    return terms.path == BENT or terms.hysteresis or terms.deck or terms.end


def contact_source(terms: Terms, order: int) -> str:
    """Return the function that makes one contact step; where it may hold an event, it stays at its start."""
    rows = {"LANE_U": ("u", order), "LANE_W": ("w", order)}
    rows |= {"LANE_Y": ("Y", order), "LANE_V": ("Z", order)} if terms.deck else {}
    rows |= {"LANE_N": ("N", order - 1)} if common.follows_force(terms) else {}
    rows |= {"LANE_E": ("e", order)} if terms.end else {}
    names = [f"{name}{n}" for name, last in rows.values() for n in range(last + 1)]
    body = [*given(terms), *read({"until": "LANE_UNTIL", "goal": "LANE_GOAL"}), *needed(series(terms, order), names)]
    body += [*_length(terms, order), *common.ends(terms, order)]
    body += [f"go = calm and u > 0.0 and time + t < until{' and holds' if terms.hysteresis else ''}"]
    moved = {"LANE_TIME": ("time + t", "time"), "LANE_U0": ("u", "u0"), "LANE_W0": ("w", "w0")}
    found = {"LANE_LENGTH": "h1", "LANE_T_END": "t", "LANE_U_END": "u", "LANE_W_END": "w"}
    if terms.deck:
        body += [f"Y = {common.at_end('Y', order)}", f"Z = {common.at_end('Z', order)}"]
        moved |= {"LANE_DECK_Y": ("Y", "Y0"), "LANE_DECK_V": ("Z", "Z0")}
        found |= {"LANE_DECK_Y_END": "Y", "LANE_DECK_V_END": "Z"}
    if terms.end:
        body += [f"e = {common.at_end('e', order)}"]
        moved |= {"LANE_BUSH_Y": ("e", "e0")}
        found |= {"LANE_BUSH_Y_END": "e"}
    found |= {"LANE_HOLDS": "1.0 if holds else 0.0"} if terms.hysteresis else {}
    found |= {"LANE_CALM": "1.0 if calm else 0.0", "LANE_GO": "1.0 if go else 0.0"}
    body += [f"{at(row)} = {behind} if go else {before}" for row, (behind, before) in moved.items()]
    body += [f"{at(row)} = {value}" for row, value in found.items()]
    body += [line for row, (name, last) in rows.items() for line in written(row, name, last)]
    return function(f"lanes_{terms.name}_{order}", f"Make one contact step in each lane ({terms.name}).", body)


def free_source(terms: Free) -> str:
    """Return the function for the series of a flight, and of the indentation in it.

    In a flight that begins where the indentation is zero, the latter is divided by time.
    """
    order = int(FLIGHT_ORDER)
    body = [*given_in_time(terms), *read({"until": "LANE_UNTIL", "fresh": "LANE_FRESH"})]
    fast = "np.sqrt(K) + G + abs(omega)" + (" + np.sqrt(deck_stiff) + deck_drag" if terms.deck else "")
    fast += " + np.sqrt(bush) + bush_rate" if terms.end else ""
    body += [f"x = min(min(16.0, 2.0 / max({fast}, 0.001)), until - time)", f"{at('LANE_LENGTH')} = x"]
    rows = {"LANE_Y": "y", "LANE_V": "v"} | ({"LANE_U": "Y", "LANE_W": "Z"} if terms.deck else {})
    rows |= {"LANE_E": "e"} if terms.end else {}
    wanted = [f"{name}{n}" for name in (*rows.values(), "clear") for n in range(order + 1)]
    body += needed(coefficients(free(terms), order), wanted)
    body += [line for row, name in rows.items() for line in written(row, name, order)]
    body += [f"{at('LANE_RAIL', n)} = clear{n} + y{n}" for n in range(order + 1)]
    body += ["x1 = x", *(f"x{n} = x{n - 1} * x" for n in range(2, order + 1))]
    body += ["gap0 = 0.0 if fresh != 0.0 else clear0", *(f"gap{n} = clear{n} * x{n}" for n in range(1, order + 1))]
    body += [f"{at('LANE_POLYNOMIAL', n)} = gap{n + 1} if fresh != 0.0 else gap{n}" for n in range(order)]
    body += [f"{at('LANE_POLYNOMIAL', order)} = 0.0 if fresh != 0.0 else gap{order}"]
    return function(f"lanes_{terms.name}_{order}", f"Put a flight's series in L ({terms.name}).", body)


def free_end_source(terms: Free) -> str:
    """Return the function that evaluates a flight after LANE_T_ROOT."""
    order = int(FLIGHT_ORDER)

    def value(row: str) -> str:
        return horner([at(row, n) for n in range(order + 1)], "x")

    rises = [at("LANE_RAIL", 1), *(f"{n}.0 * {at('LANE_RAIL', n)}" for n in range(2, order + 1))]
    ends_at = {"LANE_U_END": "LANE_Y", "LANE_W_END": "LANE_V"}
    ends_at |= {"LANE_DECK_Y_END": "LANE_U", "LANE_DECK_V_END": "LANE_W"} if terms.deck else {}
    ends_at |= {"LANE_BUSH_Y_END": "LANE_E"} if terms.end else {}
    body = ["x = L[LANE_T_ROOT + i]", *(f"{at(end)} = {value(row)}" for end, row in ends_at.items())]
    body += [f"{at('LANE_W_ROOT')} = {horner(rises, 'x')} - {at('LANE_W_END')}"]
    return function(f"lanes_end_of_{terms.name}_{order}", "Evaluate flights: y, v, and the indentation's rate.", body)


# -- what ends a step --------------------------------------------------------------------------------------------------


def _scaled(terms: list[str]) -> list[str]:
    """Return lines that write a polynomial, whose coefficients are given, as one of the share of the step's length."""
    out = ["x = L[LANE_LENGTH + i]", f"{at('LANE_POLYNOMIAL')} = {terms[0]}", "x1 = x"]
    out += [f"x{n} = x{n - 1} * x" for n in range(2, len(terms))]
    return out + [f"{at('LANE_POLYNOMIAL', n)} = {term} * x{n}" for n, term in enumerate(terms) if n]


def seek_loss(order: int) -> str:
    """Return the function that seeks a root of u in the step."""
    terms = [at("LANE_U", n) for n in range(order + 1)]
    return function(f"seek_loss_{order}", "Seek a root of u in the step.", _scaled(terms))


def seek_turn(order: int) -> str:
    """Return the function that seeks a root of w in the step."""
    terms = [at("LANE_W", n) for n in range(order + 1)]
    return function(f"seek_turn_{order}", "Seek a root of w in the step.", _scaled(terms))


def seek_extreme(order: int) -> str:
    """Return the function that seeks a root of the force's rate in the step."""
    rates = [f"{n + 1}.0 * {at('LANE_N', n + 1)}" if n <= order - 2 else "0.0" for n in range(order + 1)]
    terms = [f"({at('LANE_W', n)} if steady else {rates[n]})" for n in range(order + 1)]
    body = ["steady = L[LANE_STEADY + i] != 0.0", *_scaled(terms)]
    return function(f"seek_extreme_{order}", "Seek a root of the rate of the contact force in the step.", body)


def seek_time(order: int) -> str:
    """Return the function that seeks where the step reaches the breakpoint."""
    terms = ["(L[LANE_TIME + i] - L[LANE_UNTIL + i])"]
    terms += [f"{1 / n!r} * {at('LANE_U', n - 1)}" for n in range(1, order + 1)]
    return function(f"seek_time_{order}", "Seek the place where the step reaches the breakpoint.", _scaled(terms))


def scan(order: int) -> str:
    """Return the function that counts sign changes in the Bernstein basis, and guesses where the first root is."""
    body = [f"b{k}_0 = {at('LANE_POLYNOMIAL', k)} * {1 / comb(order, k)!r}" for k in range(order + 1)]
    now = {k: f"b{k}_0" for k in range(order + 1)}
    for i in range(1, order + 1):
        for k in range(order, i - 1, -1):
            body.append(f"b{k}_{i} = {now[k]} + {now[k - 1]}")
            now[k] = f"b{k}_{i}"
    body += ["changes_0 = 0.0", "sign_0 = 0.0"]
    for k in range(order + 1):
        body += [
            f"now_{k} = 1.0 if {now[k]} > {NOISE!r} else (-1.0 if {now[k]} < -{NOISE!r} else 0.0)",
            f"changes_{k + 1} = changes_{k} + 1.0 if now_{k} * sign_{k} < 0.0 else changes_{k}",
            f"sign_{k + 1} = now_{k} if now_{k} != 0.0 else sign_{k}",
        ]
    changes, sign = f"changes_{order + 1}", f"sign_{order + 1}"
    body += [
        f"guess = b0_0 / (b0_0 - {now[order]})",
        f"L[LANE_CHANGES + i] = {changes}",
        f"L[LANE_SIGN + i] = -{sign} if {changes} == 1.0 else {sign}",
        "L[LANE_X + i] = guess if guess > 0.0 and guess < 1.0 else 0.5",
        "L[LANE_LOW + i] = 0.0",
        "L[LANE_HIGH + i] = 1.0",
        f"L[LANE_DONE + i] = 0.0 if {changes} == 1.0 else 1.0",
    ]
    return function(f"scan_{order}", "Count the roots in (0, 1) by Descartes' rule, exact for 0 and 1; guess.", body)


def sharpen(order: int) -> str:
    """Return the function that makes one step of Newton's method, kept inside the bracket."""
    names = {"x": "LANE_X", "low_before": "LANE_LOW", "high_before": "LANE_HIGH", "sign": "LANE_SIGN"}
    body = read(names | {"done": "LANE_DONE"})
    body += [f"value_{order} = {at('LANE_POLYNOMIAL', order)}", f"slope_{order} = 0.0"]
    for k in range(order - 1, -1, -1):
        body += [f"slope_{k} = slope_{k + 1} * x + value_{k + 1}"]
        body += [f"value_{k} = value_{k + 1} * x + {at('LANE_POLYNOMIAL', k)}"]
    body += [
        "before = value_0 * sign > 0.0",
        "low = x if before else low_before",
        "high = high_before if before else x",
        "newton = x - value_0 / slope_0",
        f"close = abs(newton - x) <= {CLOSE!r} * newton and low <= newton and newton <= high",
        "inside = low < newton and newton < high",
        "middle = 0.5 * (low + high)",
        "stuck = not inside and (middle == low or middle == high)",
        "new = newton if close or inside else middle",
        "L[LANE_X + i] = new if done == 0.0 else x",
        "L[LANE_LOW + i] = low",
        "L[LANE_HIGH + i] = high",
        "L[LANE_DONE + i] = 1.0 if close or stuck else done",
    ]
    return function(f"sharpen_{order}", "Improve each root that is not found yet by one step of Newton's method.", body)


def at_root(order: int) -> str:
    """Return the function that evaluates a contact step at the root."""
    time = [f"{1 / (n + 1)!r} * {at('LANE_U', n)}" for n in range(order)]
    body = ["x = L[LANE_X + i] * L[LANE_LENGTH + i]", f"L[LANE_T_ROOT + i] = x * {horner(time, 'x')}"]
    for row in "UW":
        value = horner([at(f"LANE_{row}", n) for n in range(order + 1)], "x")
        body.append(f"L[LANE_{row}_ROOT + i] = {value}")
    return function(f"at_root_{order}", "Evaluate t, u and w of the contact step at the root.", body)


def deck_at_end(order: int) -> str:
    """Return the function that evaluates the deck's motion at the end of a shortened step."""
    return _at_end("deck", {"LANE_Y": "LANE_DECK_Y_END", "LANE_V": "LANE_DECK_V_END"}, order)


def bush_at_end(order: int) -> str:
    """Return the function that evaluates the deflection of a damper's bush there."""
    return _at_end("bush", {"LANE_E": "LANE_BUSH_Y_END"}, order)


def _at_end(name: str, rows: dict[str, str], order: int) -> str:
    body = ["x = L[LANE_LENGTH + i]", "shorter = L[LANE_ENDS + i] != 0.0"]
    for row, end in rows.items():
        value = horner([at(row, n) for n in range(order + 1)], "x")
        body.append(f"{at(end)} = {value} if shorter else {at(end)}")
    return function(f"{name}_at_end_{order}", f"Evaluate the {name} at the end of a shortened step.", body)

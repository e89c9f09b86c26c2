"""The source of functions that make the steps of one wheel.

One in contact makes step after step, up to one that may hold an event. It finds the start in S, logs the steps before
the last one, and leaves the last one's start and series in S. Its result: the length of that step in s, t, u and w at
its end, and whether the force may have an extreme within it. Rows `limit` and on of `steps` stay free: with zero there,
it makes one step. One in time makes one step, and leaves its series. The arguments are those of single.py.
"""

from __future__ import annotations

from wheeltapper.march.steps import common
from wheeltapper.march.steps.derive import coefficients, needed, quick_coefficients
from wheeltapper.march.steps.equations import BENT, FLAT, WAVE, Free, Terms, contact, free, pushing, yielding
from wheeltapper.march.steps.layout import FLIGHT_ORDER

LOGGED = {
    "PHASE": "CONTACT", "TIME": "time", "A": "u0", "B": "w0", "DECK_Y": "0.0", "DECK_V": "0.0",
    "PIECE": "S[STATE + PIECE]", "SHIFT": "S[STATE + SHIFT]", "ON_DECK": "S[STATE + ON_DECK]", "LENGTH": "h1",
}  # fmt: skip
"""What is logged of a step, without a deck, a law that yields or a damper's end."""


def _in_memory(terms: Terms | Free) -> dict[str, str]:
    """Return what moves beside the wheel, and where it stands; there it goes on from step to step."""
    deck = {"Y0": "S[STATE + DECK_Y]", "Z0": "S[STATE + DECK_V]"} if terms.deck else {}
    return deck | ({"e0": "S[STATE + END_DEFLECTION]"} if terms.end else {})


def _deck_and_end(terms: Terms | Free) -> list[str]:
    """Return the lines that read what a deck and a damper's end are, and how they move."""
    out = []
    if terms.deck:
        out += [
            "on, per_mass = S[STATE + ON_DECK], 1.0 / numbers[DECK_MASS]",
            "deck_stiff, deck_drag = per_mass * numbers[DECK_STIFFNESS], per_mass * numbers[DECK_DAMPING]",
            "share = on * per_mass", "prestress = share * numbers[PRESTRESS]",
        ]  # fmt: skip
    if terms.end:
        out += ["bush, bush_rate = S[END_B], S[END_BETA]"]
        out += ["gives = 1.0 if bush > 0.0 else 0.0"]
    return [*out, f"G = {'S[END_G]' if terms.end else 'numbers[DAMPING]'}", "K = numbers[STIFFNESS]"]


def _prologue(terms: Terms, order: int) -> list[str]:
    """Return the lines that read what does not change from step to step."""
    out = [
        *_deck_and_end(terms), "row, time = int(S[COUNT]), S[STATE + TIME]", "u0, w0 = S[STATE + A], S[STATE + B]",
        "quadratic, cubic = numbers[QUADRATIC], numbers[CUBIC]", "goal = np.log2(numbers[TOLERANCE])",
        "floor, ceiling = S[U_FLOOR], S[U_CEILING]",
    ]  # fmt: skip
    out += ["eta = numbers[HYSTERESIS]"] if terms.hysteresis else []
    if terms.end:
        out += ["place_floor, place_ceiling, heading = S[PLACE_FLOOR], S[PLACE_CEILING], S[HEADING]"]
        out += [f"earlier = goal * {(order - 3) / (order - 1)!r} + FORGIVEN"]
    if terms.path != BENT:
        out += ["y0 = S[HERE_POLY]", "f0 = 1.0 + K * y0"]
    if terms.path != FLAT:
        out += ["piece, pace = int(S[STATE + PIECE]), numbers[PACE]"]
        out += ["origin = S[STATE + SHIFT] + pieces[piece, CENTRE]"]
    if terms.path == BENT:
        out += ["scale, lift = pieces[piece, SCALE], numbers[LIFT]"]
        out += ["degree, factor_degree = int(S[HERE_DEGREE]), int(S[HERE_FACTOR_DEGREE])"]
        out += common.given_polynomial("piece_y", "lift * pieces[piece, COEFFICIENT", "degree")
    out += common.given_polynomial("piece_b", "pieces[piece, FACTOR", "factor_degree", "1.0") if terms.factor else []
    if terms.path != FLAT:
        out += ["omega, number = S[HERE_OMEGA], pieces[piece, WAVENUMBER]"]
        out += ["amp_sin, amp_cos = S[HERE_AMP_SIN], S[HERE_AMP_COS]"]
        out += common.gains(terms)
    return out


def _start(terms: Terms) -> list[str]:
    """Return the lines for what the series begin with and for the path, at the start of each step."""
    out = [f"{name} = {entry}" for name, entry in _in_memory(terms).items()]
    if terms.path == BENT:
        out += ["at_y, rate_y = (pace * time - origin) / scale, pace / scale", *common.over_path(terms)]
    if terms.path != FLAT:
        out += [
            "angle = number * (pace * time - origin)",
            "wave0, rise0 = harmonic_at(gain_sin, gain_cos, omega, angle)",
        ]
    if terms.yields:
        out += [f"terms{k} = S[HERE_LAW + {k}]" for k in common.POWERS] + common.given_polynomial(
            "r", "S[HERE_RESIDUAL", "S[HERE_RESIDUAL_DEGREE]"
        )
        out += ["rate_law, centre_law = 1.0 / S[HERE_LAW_SCALE], S[HERE_LAW_CENTRE]", *common.law()]
    return [*out, *common.begins(terms)]


def _length(terms: Terms, order: int) -> list[str]:
    """Return the lines for the step's length, and its powers."""
    half = len(common.last_terms(terms, 0)) // 2
    groups = [
        part
        for n in (order - 1, order)
        for part in (common.last_terms(terms, n)[:half], common.last_terms(terms, n)[half:])
    ]
    parts = ", ".join(group[0] if half == 1 else f"max({', '.join(group)})" for group in groups)
    reach = f"stable_step({order}, steplength({order}, {parts}, goal), {common.fastest(terms)})"
    if terms.end:
        few = order - 2
        last = ", ".join(f"abs({name}{n})" for n in (few - 1, few) for name in "uw")
        reach = f"min({reach}, steplength({few}, {last}, earlier))"
        reach = f"min({reach}, steplength_of_bush({order}, bush, abs(e{order - 1}), abs(e{order}), goal))"
    return [f"h1 = {reach}", *common.powers_of_length(order)]


def _goes_on(terms: Terms, order: int) -> list[str]:
    """Return the lines for whether nothing may happen within the step."""
    out = []
    goes = [f"calm and (ceiling == inf or ({common.STEADY}))" if common.follows_force(terms) else "calm"]
    goes += ["floor < u and u < ceiling and time + t < until and t > BRIEFEST * (1.0 + time)"]
    goes += ["holds"] if terms.hysteresis else []
    if terms.end:
        for name, last in (("x", order), ("v", order - 1), ("e", order)):
            out += [f"sway_{name} = {common.change(name, last)}", f"{name} = {common.at_end(name, last)}"]
        goes += ["2.0 * place_floor < x0 + x - sway_x and x0 + x + sway_x < 2.0 * place_ceiling"]
        held = "gives * (heading * (e0 + e) - sway_e) + (1.0 - gives) * (heading * (v0 + v) - sway_v)"
        goes += [f"(heading == 0.0 or {held} > SAME_PLACE)"]
    return [*out, f"goes = {' and '.join(goes)}"]


def _rows(terms: Terms, order: int) -> dict[str, tuple[str, int]]:
    """Return rows of S, the series that they are given, and the last coefficient."""
    out = {"U": ("u", order), "W": ("w", order), "N": ("N", order - 1)}
    out |= {"Y": ("Y", order), "Z": ("Z", order)} if terms.deck else {}
    out |= {"DEPTH": ("depth", order - 1)} if terms.yields else {}
    return out | ({"WHEEL_Y": ("x", order), "WHEEL_V": ("v", order - 1), "BUSH": ("e", order)} if terms.end else {})


def _stored(rows: dict[str, tuple[str, int]]) -> list[str]:
    return [f"S[{row} + {n}] = {name}{n}" for row, (name, last) in rows.items() for n in range(last + 1)]


def _names(rows: dict[str, tuple[str, int]]) -> list[str]:
    return [f"{name}{n}" for name, last in rows.values() for n in range(last + 1)]


def source(terms: Terms, order: int) -> str:
    """Return the whole function of steps in contact."""
    waits = terms in (Terms(FLAT), Terms(WAVE))  # so short that the processor waits for it
    derived = (quick_coefficients if waits else coefficients)(contact(terms), order)
    derived = [line for line in derived if not line.startswith("w0 = ")]  # it is given
    rows = _rows(terms, order)
    within = {
        row: rows[row] for row in rows if row not in ("N", "DEPTH") or (row == "N" and common.follows_force(terms))
    }
    looped = needed(derived, _names(within))
    behind = [line for line in needed(derived, _names(rows)) if line not in set(looped)]
    logged, carried = dict(LOGGED), {"time": "time + t", "u0": "u", "w0": "w"}
    carried |= {place: common.at_end(name[0], order) for name, place in _in_memory(terms).items()}
    if terms.deck:
        logged |= {"DECK_Y": "Y0", "DECK_V": "Z0"}
    if terms.yields:
        logged["PHASE"] = "S[STATE + PHASE]"
    if terms.end:
        logged |= {"END_MODE": "S[STATE + END_MODE]", "END_PLACE": "S[STATE + END_PLACE]", "END_DEFLECTION": "e0"}
    loop = [*_start(terms), *looped, *_length(terms, order), *common.ends(terms, order)]
    loop += [*_goes_on(terms, order), "if row >= limit or not goes:"]
    ends_at = {"Y0": "NEXT_Y", "Z0": "NEXT_Z", "e0": "NEXT_BUSH"}
    last = [f"S[{ends_at[name]}] = {common.at_end(name[0], order)}" for name in _in_memory(terms)]
    loop += ["    break", *(f"steps[row, {column}] = {value}" for column, value in logged.items()), "row += 1"]
    loop += [f"{name} = {value}" for name, value in carried.items()]
    out = [f"S[STATE + {column}] = {logged[column]}" for column in ("TIME", "A", "B")] + ["S[COUNT] = row"]
    out += ["S[HERE_PHASE0] = angle"] if terms.path != FLAT else []
    out += [f"S[HERE_POLY + {k}] = y{k}" for k in common.POWERS] if terms.path == BENT else []
    out += [f"S[HERE_FACTOR + {k}] = b{k}" for k in common.POWERS] if terms.factor else []
    out += [
        *last,
        *behind,
        "S[T] = 0.0",
        *(f"S[T + {n + 1}] = {1 / (n + 1)!r} * u{n}" for n in range(order)),
        *_stored(rows),
    ]
    body = [*_prologue(terms, order), "while True:", *("    " + line for line in loop), *out]
    says = f"Make contact steps of order {order} ({terms.name.replace('_', ', ')}) up to one that may hold an event."
    return _function(f"{terms.name}_{order}", says, [*body, "return h1, t, u, w, not calm"])


def free_source(terms: Free) -> str:
    """Return the whole function of a step in time; what it returns means nothing."""
    order = int(FLIGHT_ORDER)
    rows = {"U": ("y", order), "W": ("v", order), "CLEAR": ("clear", order)}
    rows |= {"N": ("N", order)} if terms.bonded else {}
    rows |= {"Y": ("Y", order), "Z": ("Z", order)} if terms.deck else {}
    rows |= {"BUSH": ("e", order)} if terms.end else {}
    body = ["y0, v0 = S[STATE + A], S[STATE + B]", *(f"{name} = {entry}" for name, entry in _in_memory(terms).items())]
    body += [*_deck_and_end(terms), *common.given_polynomial("p", "S[HERE_POLY", "S[HERE_DEGREE]")]
    body += common.given_polynomial("b", "S[HERE_FACTOR", "S[HERE_FACTOR_DEGREE]", "1.0") if terms.bonded else []
    body += ["omega = S[HERE_OMEGA]", "omega2 = omega * omega"]
    body += ["wave0, rise0 = harmonic_at(S[HERE_AMP_SIN], S[HERE_AMP_COS], omega, S[HERE_PHASE0])"]
    body += [*needed(coefficients(free(terms), order), _names(rows)), *_stored(rows)]
    says = f"Put the series of a step in time ({terms.name.replace('_', ', ')}) in S."
    return _function(f"{terms.name}_{order}", says, [*body, "return 0.0, 0.0, 0.0, 0.0, False"])


def yielding_source(order: int) -> str:
    """Return the function that puts in TREND how far a step that was made goes beyond what the surface bears."""
    body = [f"{name}{n} = S[{name.upper()} + {n}]" for name in "tu" for n in range(order)]
    body += common.given_polynomial("c", "S[HERE_BEARS", "S[HERE_BEARS_DEGREE]")
    rows = {"TREND": ("beyond", order - 1)}
    body = [*needed([*body, *coefficients(yielding(order), order - 1)], _names(rows)), *_stored(rows)]
    says = "Find how far the indentation is beyond that at which the surface yields."
    return _function(f"yielding_{order}", says, [*body, "return 0.0, 0.0, 0.0, 0.0, False"])


def pushing_source(order: int) -> str:
    """Return the function that puts in PUSH what the impulse of a step that was made is the integral of."""
    rows = {"PUSH": ("push", order - 1)}
    body = [*given_to_push(order), *coefficients(pushing(order), order - 1), *_stored(rows)]
    return _function(f"pushing_{order}", "Find the force by time in s.", [*body, "return 0.0, 0.0, 0.0, 0.0, False"])


def given_to_push(order: int) -> list[str]:
    """Return the lines that read the series of u and of the force of a step that was made."""
    return [f"{name}{n} = S[{name.upper()} + {n}]" for name in "uN" for n in range(order)]


def _function(name: str, says: str, body: list[str]) -> str:
    lines = [f'"""{says}"""', *body]
    return "\n".join([f"def {name}(numbers, pieces, until, limit, steps, S):", *("    " + one for one in lines), ""])

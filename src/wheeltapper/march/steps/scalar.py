"""The source of functions that make the steps of one wheel.

One in contact makes step after step, up to one that may hold an event. It finds the start in S, logs the steps before
the last one, and leaves the last one's start and series in S. Its result: the length of that step in s, t, u and w at
its end, and whether the force may have an extreme within it. Rows `limit` and on of `steps` stay free: with zero there,
it makes one step. One in time makes one step, and leaves its series. The arguments are those of single.py.
"""

from __future__ import annotations

from wheeltapper.march.layout import FLIGHT_ORDER
from wheeltapper.march.program import MAX_DEGREE
from wheeltapper.march.steps.derive import coefficients, needed, quick_coefficients, total
from wheeltapper.march.steps.equations import BENT, FLAT, WAVE, Free, Terms, contact, free

POWERS = range(MAX_DEGREE + 1)
LOGGED = {
    "PHASE": "CONTACT", "TIME": "time", "A": "u0", "B": "w0", "DECK_Y": "0.0", "DECK_V": "0.0",
    "PIECE": "S[STATE + PIECE]", "SHIFT": "S[STATE + SHIFT]", "ON_DECK": "S[STATE + ON_DECK]", "LENGTH": "h1",
}  # fmt: skip
"""What is logged of a step, without a deck, a law that yields or a damper's end."""


def estrin(terms: list[str], power: int = 1) -> str:
    """Return the polynomial in h1 with these coefficients by halving; h2, h4, ... are its powers."""
    if len(terms) == 1:
        return terms[0]
    pairs = [
        f"({terms[k]} + h{power} * {terms[k + 1]})" if k + 1 < len(terms) else terms[k] for k in range(0, len(terms), 2)
    ]
    return estrin(pairs, 2 * power)


def at_end(name: str, last: int) -> str:
    """Return the value of a series at the step's end."""
    return estrin([f"{name}{n}" for n in range(last + 1)])


def change(name: str, last: int, of_rate: bool = False) -> str:
    """Return a bound on how much a series, or its derivative, changes within the step."""
    if of_rate:
        return f"h1 * ({estrin([f'{n * (n - 1)}.0 * abs({name}{n})' for n in range(2, last + 1)])})"
    return f"h1 * ({estrin([f'{n}.0 * abs({name}{n})' for n in range(1, last + 1)])})"


def follows_force(terms: Terms) -> bool:
    """Return True where the extremes of the force are not those of the indentation."""
    return terms.factor or terms.hysteresis or terms.yields


def _given(name: str, entry: str, degree: str, first: str = "0.0") -> list[str]:
    """Return the lines that read a polynomial up to its degree; `first` is what it is where it has none."""
    return [f"{name}{k} = {entry} + {k}] if {degree} >= {k} else {'0.0' if k else first}" for k in POWERS]


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
    else:
        out += ["piece, pace, lift = int(S[STATE + PIECE]), numbers[PACE], numbers[LIFT]"]
        out += ["scale, origin = pieces[piece, SCALE], S[STATE + SHIFT] + pieces[piece, CENTRE]"]
        out += ["degree, factor_degree = int(S[HERE_DEGREE]), int(S[HERE_FACTOR_DEGREE])"]
        out += _given("path", "lift * pieces[piece, COEFFICIENT", "degree")
    out += _given("factor", "pieces[piece, FACTOR", "factor_degree", "1.0") if terms.factor else []
    if terms.path != FLAT:
        out += ["omega, phase, begin = S[HERE_OMEGA], S[HERE_PHASE0], time"]
        out += ["amp_sin, amp_cos = S[HERE_AMP_SIN], S[HERE_AMP_COS]"]
        out += ["omega2 = omega * omega", "stiff_wave = K - omega2"]
    return out


def _shifted(name: str, source: str) -> list[str]:
    """Return the lines for the polynomial Σ source_k·(at + rate·τ)^k as one of τ.

    No name is given twice: for each one that is, the compiler goes through the whole function once more.
    """
    out = []
    now = {k: f"{source}{k}" for k in POWERS}
    for i in range(MAX_DEGREE):
        for k in range(MAX_DEGREE - 1, i - 1, -1):
            out.append(f"{name}{k}_{i} = {now[k]} + at_{name} * {now[k + 1]}")
            now[k] = f"{name}{k}_{i}"
    out.append(f"{name}0 = {now[0]}")
    power = f"rate_{name}"
    for k in POWERS[1:]:
        out.append(f"{name}{k} = {now[k]} * {power}")
        if k < MAX_DEGREE:
            out.append(f"rate_{name}{k + 1} = {power} * rate_{name}")
            power = f"rate_{name}{k + 1}"
    return out


def _forcing(k: int) -> str:
    """Return coefficient k of 1 + K·y + G·y' + y'', y the path's polynomial."""
    out = ["1.0"] if k == 0 else []
    out += [f"K * y{k}"]
    out += [f"G * ({k + 1}.0 * y{k + 1})"] if k + 1 <= MAX_DEGREE else []
    return total(out + ([f"{(k + 1) * (k + 2)}.0 * y{k + 2}"] if k + 2 <= MAX_DEGREE else []))


def _start(terms: Terms) -> list[str]:
    """Return the lines for what the series begin with and for the path, at the start of each step."""
    out = [f"{name} = {entry}" for name, entry in _in_memory(terms).items()]
    if terms.path == BENT:
        out += ["at_y, rate_y = (pace * time - origin) / scale, pace / scale", *_shifted("y", "path")]
        out += ["at_b, rate_b = at_y, rate_y", *_shifted("b", "factor")] if terms.factor else []
        out += [f"c{k} = {_forcing(k)}" for k in POWERS]
        out += [f"s{k} = {k + 1}.0 * y{k + 1}" for k in POWERS[:-1]] if terms.end else []
    if terms.path != FLAT:
        out += ["angle = phase + omega * (time - begin)", "h0, g0 = harmonic_at(amp_sin, amp_cos, omega, angle)"]
    if terms.yields:
        out += _given("r", "S[HERE_RESIDUAL", "S[HERE_RESIDUAL_DEGREE]") + [
            f"terms{k} = S[HERE_LAW + {k}]" for k in POWERS
        ]
        out += ["rate_law = 1.0 / S[HERE_LAW_SCALE]", "at_law = rate_law * (u0 * u0 + r0 - S[HERE_LAW_CENTRE])"]
        out += _shifted("law", "terms")
    below = "u0 * u0" + (" - on * Y0" if terms.deck else "") + (" - h0" if terms.path != FLAT else "")
    out.append(f"p0 = w0 + G * ({below}){' - on * Z0' if terms.deck else ''}")
    return out + ([f"x0 = y0 - ({below})"] if terms.end else [])


def _length(terms: Terms, order: int) -> list[str]:
    """Return the lines for the step's length, and its powers."""

    def largest(n: int, rows: str) -> str:
        return f"abs({rows[0]}{n})" if len(rows) == 1 else f"max(abs({rows[0]}{n}), {largest(n, rows[1:])})"

    slow, quick = ("uY", "wZ") if terms.deck else ("u", "w")
    parts = (largest(n, rows) for n in (order - 1, order) for rows in (slow, quick))
    fastest = "K + G" + (" + bush + bush_rate" if terms.end else "")
    if terms.hysteresis:
        law = "u0 * u0 * (quadratic + cubic * u0)"
        fastest += f" + eta * {'(1.0 + share) * ' if terms.deck else ''}{law}"
    if terms.deck:
        fastest += " + deck_drag + sqrt(deck_stiff + share * (quadratic + 1.5 * cubic * u0))"
    reach = f"stable_step({order}, steplength({order}, {', '.join(parts)}, goal), u0 * ({fastest}))"
    if terms.end:
        few = order - 2
        last = ", ".join(f"abs({name}{n})" for n in (few - 1, few) for name in "uw")
        reach = f"min({reach}, steplength({few}, {last}, earlier))"
        reach = f"min({reach}, steplength_of_bush({order}, bush, abs(e{order - 1}), abs(e{order}), goal))"
    return [f"h1 = {reach}", *(f"h{2 * k} = h{k} * h{k}" for k in (1, 2, 4, 8) if 2 * k <= order)]


def _ends(terms: Terms, order: int) -> list[str]:
    """Return the lines for the motion at the step's end, and whether anything may happen before."""
    times = ["u0", *(f"{1 / (n + 1)!r} * u{n}" for n in range(1, order))]
    out = [f"t = h1 * ({estrin(times)})", f"u = {at_end('u', order)}", f"w = {at_end('w', order)}"]
    out += [f"sway = {change('w', order)}"]
    steady = "w0 * w > 0.0 and abs(w0) + abs(w) > sway"
    if follows_force(terms):
        out += [f"behind = {estrin(['N1', *(f'{n}.0 * N{n}' for n in range(2, order))])}"]
        out += [f"moves = {change('N', order - 1, of_rate=True)}"]
        out += ["calm = N1 * behind > 0.0 and abs(N1) + abs(behind) > moves"]
        steady = f"calm and (ceiling == inf or ({steady}))"
    else:
        out += [f"calm = {steady}"]
        steady = "calm"
    goes = [steady, "floor < u and u < ceiling and time + t < until"]
    if terms.hysteresis:
        goes += ["min(1.0 + eta * w0, 1.0 + eta * w) > 0.0 and 2.0 + eta * (w0 + w) > eta * sway"]
    if terms.end:
        for name, last in (("x", order), ("v", order - 1), ("e", order)):
            out += [f"sway_{name} = {change(name, last)}", f"{name} = {at_end(name, last)}"]
        goes += ["2.0 * place_floor < x0 + x - sway_x and x0 + x + sway_x < 2.0 * place_ceiling"]
        held = "gives * (heading * (e0 + e) - sway_e) + (1.0 - gives) * (heading * (v0 + v) - sway_v)"
        goes += [f"(heading == 0.0 or {held} > SAME_PLACE)"]
    return [*out, f"goes = {' and '.join(goes)}"]


def _rows(terms: Terms, order: int) -> dict[str, tuple[str, int]]:
    """Return rows of S, the series that they are given, and the last coefficient."""
    out = {"U": ("u", order), "W": ("w", order), "N": ("N", order - 1)}
    out |= {"Y": ("Y", order), "Z": ("Z", order)} if terms.deck else {}
    out |= {"Q": ("q", order - 1), "DEPTH": ("depth", order - 1)} if terms.yields else {}
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
    within = {row: rows[row] for row in rows if row not in ("N", "Q", "DEPTH") or (row == "N" and follows_force(terms))}
    looped = needed(derived, _names(within))
    behind = [line for line in needed(derived, _names(rows)) if line not in set(looped)]
    logged, carried = dict(LOGGED), {"time": "time + t", "u0": "u", "w0": "w"}
    carried |= {place: at_end(name[0], order) for name, place in _in_memory(terms).items()}
    if terms.deck:
        logged |= {"DECK_Y": "Y0", "DECK_V": "Z0"}
    if terms.yields:
        logged["PHASE"] = "S[STATE + PHASE]"
    if terms.end:
        logged |= {"END_MODE": "S[STATE + END_MODE]", "END_PLACE": "S[STATE + END_PLACE]", "END_DEFLECTION": "e0"}
    loop = [*_start(terms), *looped, *_length(terms, order), *_ends(terms, order), "if row >= limit or not goes:"]
    loop += ["    break", *(f"steps[row, {column}] = {value}" for column, value in logged.items()), "row += 1"]
    loop += [f"{name} = {value}" for name, value in carried.items()]
    out = [f"S[STATE + {column}] = {logged[column]}" for column in ("TIME", "A", "B")] + ["S[COUNT] = row"]
    out += ["S[HERE_PHASE0] = angle"] if terms.path != FLAT else []
    out += [f"S[HERE_POLY + {k}] = y{k}" for k in POWERS] if terms.path == BENT else []
    out += [f"S[HERE_FACTOR + {k}] = b{k}" for k in POWERS] if terms.factor else []
    out += [*behind, "S[T] = 0.0", *(f"S[T + {n + 1}] = {1 / (n + 1)!r} * u{n}" for n in range(order)), *_stored(rows)]
    body = [*_prologue(terms, order), "while True:", *("    " + line for line in loop), *out]
    says = f"Make contact steps of order {order} ({terms.name.replace('_', ', ')}) up to one that may hold an event."
    return _function(f"{terms.name}_{order}", says, [*body, "return h1, t, u, w, not calm"])


def free_source(terms: Free) -> str:
    """Return the whole function of a step in time; what it returns means nothing."""
    order = int(FLIGHT_ORDER)
    rows = {"U": ("y", order), "W": ("v", order), "CLEAR": ("clear", order)}
    rows |= {"F": ("path", order), "N": ("N", order)} if terms.bonded else {}
    rows |= {"Y": ("Y", order), "Z": ("Z", order)} if terms.deck else {}
    rows |= {"BUSH": ("e", order)} if terms.end else {}
    body = ["y0, v0 = S[STATE + A], S[STATE + B]", *(f"{name} = {entry}" for name, entry in _in_memory(terms).items())]
    body += [*_deck_and_end(terms), *_given("p", "S[HERE_POLY", "S[HERE_DEGREE]")]
    body += _given("b", "S[HERE_FACTOR", "S[HERE_FACTOR_DEGREE]", "1.0") if terms.bonded else []
    body += ["omega = S[HERE_OMEGA]", "omega2 = omega * omega"]
    body += ["h0, g0 = harmonic_at(S[HERE_AMP_SIN], S[HERE_AMP_COS], omega, S[HERE_PHASE0])"]
    body += [*needed(coefficients(free(terms), order), _names(rows)), *_stored(rows)]
    says = f"Put the series of a step in time ({terms.name.replace('_', ', ')}) in S."
    return _function(f"{terms.name}_{order}", says, [*body, "return 0.0, 0.0, 0.0, 0.0, False"])


def _function(name: str, says: str, body: list[str]) -> str:
    lines = [f'"""{says}"""', *body]
    return "\n".join([f"def {name}(numbers, pieces, until, limit, steps, S):", *("    " + one for one in lines), ""])

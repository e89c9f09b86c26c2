"""Parts of the source of a step that one step and eight at a time have in common."""

from __future__ import annotations

from wheeltapper.march.common.program import MAX_DEGREE
from wheeltapper.march.steps.derive import total
from wheeltapper.march.steps.equations import BENT, FLAT, Terms

POWERS = range(MAX_DEGREE + 1)


def estrin(terms: list[str], power: int = 1) -> str:
    """Return the polynomial in h1 with these coefficients by halving; h2, h4, ... are its powers."""
    if len(terms) == 1:
        return terms[0]
    pairs = [
        f"({terms[k]} + h{power} * {terms[k + 1]})" if k + 1 < len(terms) else terms[k] for k in range(0, len(terms), 2)
    ]
    return estrin(pairs, 2 * power)


def powers_of_length(last: int) -> list[str]:
    """Return the lines for the powers of the step's length that `estrin` takes."""
    return [f"h{2 * k} = h{k} * h{k}" for k in (1, 2, 4, 8) if 2 * k <= last]


def at_end(name: str, last: int) -> str:
    """Return the value of a series at the step's end."""
    return estrin([f"{name}{n}" for n in range(last + 1)])


def time_at_end(order: int) -> str:
    """Return the time that a step in contact takes."""
    return f"h1 * ({estrin(['u0', *(f'{1 / (n + 1)!r} * u{n}' for n in range(1, order))])})"


def change(name: str, last: int, of_rate: bool = False) -> str:
    """Return a bound on how much a series, or its derivative, changes within the step."""
    if of_rate:
        return f"h1 * ({estrin([f'{n * (n - 1)}.0 * abs({name}{n})' for n in range(2, last + 1)])})"
    return f"h1 * ({estrin([f'{n}.0 * abs({name}{n})' for n in range(1, last + 1)])})"


def given_polynomial(name: str, entry: str, degree: str, first: str = "0.0") -> list[str]:
    """Return the lines that read a polynomial up to its degree; `first` is what it is where it has none."""
    return [f"{name}{k} = {entry} + {k}] if {degree} >= {k} else {'0.0' if k else first}" for k in POWERS]


def shifted(name: str, source: str) -> list[str]:
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


def forcing(k: int) -> str:
    """Return coefficient k of 1 + K·y + G·y' + y'', y the path's polynomial."""
    out = ["1.0"] if k == 0 else []
    out += [f"K * y{k}"]
    out += [f"G * ({k + 1}.0 * y{k + 1})"] if k + 1 <= MAX_DEGREE else []
    return total(out + ([f"{(k + 1) * (k + 2)}.0 * y{k + 2}"] if k + 2 <= MAX_DEGREE else []))


def about_start(bent: bool) -> list[str]:
    """Return the lines for a piece of the path about a step's start, from its numbers and where it stands.

    With `bent` for its polynomials, too; without, y0 is its level.
    """
    out = ["away = pace * time - shift - centre", "phase = wavenumber * away", "omega = wavenumber * pace"]
    out += ["amp_sin = lift * sine", "amp_cos = lift * cosine"]
    if not bent:
        return [*out, "y0 = lift * path0"]
    out += ["at_y = away * per_scale", "rate_y = pace * per_scale", *(f"piece_y{k} = lift * path{k}" for k in POWERS)]
    return [*out, *shifted("y", "piece_y"), "at_b = at_y", "rate_b = rate_y", *shifted("b", "factor")]


def over_path(terms: Terms) -> list[str]:
    """Return the lines for a bent path about the step's start: at_y and rate_y say where on its piece that is."""
    if terms.path != BENT:
        return []
    out = shifted("y", "piece_y") + [f"c{k} = {forcing(k)}" for k in POWERS]
    out += ["at_b = at_y", "rate_b = rate_y", *shifted("b", "piece_b")] if terms.factor else []
    return out + ([f"s{k} = {k + 1}.0 * y{k + 1}" for k in POWERS[:-1]] if terms.end else [])


def law() -> list[str]:
    """Return the lines for a plastic law about the step's start, where the surface's residual indentation is r0."""
    return ["at_law = rate_law * (u0 * u0 + r0 - centre_law)", *shifted("law", "terms")]


def begins(terms: Terms) -> list[str]:
    """Return the lines for what the series begin with, beside what is known."""
    below = "u0 * u0" + (" - on * Y0" if terms.deck else "")
    out = [f"p0 = w0 + G * ({below}){' - on * Z0' if terms.deck else ''}"]
    if not terms.end:
        return out
    return [*out, f"x0 = y0 - ({below})" + (" + wave0" if terms.path != FLAT else "")]


def gains(terms: Terms) -> list[str]:
    """Return the lines for the factors of sine and cosine in what is a harmonic: F, or the path for a damper's end."""
    out = ["omega2 = omega * omega", "stiff_wave = K - omega2"]
    if terms.end:
        return [*out, "gain_sin = amp_sin", "gain_cos = amp_cos"]
    out += ["gain_sin = stiff_wave * amp_sin - G * omega * amp_cos"]
    return [*out, "gain_cos = stiff_wave * amp_cos + G * omega * amp_sin"]


def fastest(terms: Terms) -> str:
    """Return the rate in s of the fastest part of the motion at the step's start.

    The contact's own stiffness under the wheel does not count: what it does is never small in the series.
    """
    out = "K + G" + (" + bush + bush_rate" if terms.end else "")
    if terms.hysteresis:
        out += f" + eta * {'(1.0 + share) * ' if terms.deck else ''}u0 * u0 * (quadratic + cubic * u0)"
    if terms.deck:
        out += " + deck_drag + np.sqrt(deck_stiff + share * (quadratic + 1.5 * cubic * u0))"
    return f"u0 * ({out})"


def last_terms(terms: Terms, n: int) -> list[str]:
    """Return coefficients n of what limits a step, by amount."""
    return [f"abs({name}{n})" for name in ("uYwZ" if terms.deck else "uw")]


def follows_force(terms: Terms) -> bool:
    """Return True where the extremes of the force are not those of the indentation."""
    return terms.factor or terms.hysteresis or terms.yields


STEADY = "w0 * w > 0.0 and abs(w0) + abs(w) > sway"
"""Whether the indentation rises, or falls, all through the step."""


def ends(terms: Terms, order: int) -> list[str]:
    """Return the lines for t, u and w at the step's end, and for whether the force has no extreme before."""
    out = [f"t = {time_at_end(order)}", f"u = {at_end('u', order)}", f"w = {at_end('w', order)}"]
    out += [f"sway = {change('w', order)}"]
    if follows_force(terms):
        out += [f"behind = {estrin(['N1', *(f'{n}.0 * N{n}' for n in range(2, order))])}"]
        out += [f"moves = {change('N', order - 1, of_rate=True)}"]
        out += ["calm = N1 * behind > 0.0 and abs(N1) + abs(behind) > moves"]
    else:
        out += [f"calm = {STEADY}"]
    if terms.hysteresis:
        out += ["holds = min(1.0 + eta * w0, 1.0 + eta * w) > 0.0 and 2.0 + eta * (w0 + w) > eta * sway"]
    return out

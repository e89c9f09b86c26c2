"""Pictures of laws: contact force over indentation, creep force over creepage, and forces of suspension elements."""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.contact.base import Contact
from wheeltapper.describe.contact.elastic_plastic import ElasticPlastic
from wheeltapper.describe.contact.force_law import ForceLaw
from wheeltapper.describe.contact.hertz import Hertz
from wheeltapper.describe.contact.law import Law
from wheeltapper.describe.contact.linear import Linear
from wheeltapper.describe.creep.base import CreepLaw
from wheeltapper.describe.creep.fastsim import Fastsim
from wheeltapper.describe.vehicle.element import Damper, Element, Link, Sliding, Spring, Stop
from wheeltapper.describe.vehicle.freight import CompressionSpring
from wheeltapper.faces.panels import BLUE, COLOURS, legend_above, panels, spaced
from wheeltapper.ground.errors import InputError, value_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FloatArray = NDArray[np.float64]
RADIUS, CROWN, MODULUS, POISSON = 0.46, 0.3, 210e9, 0.3
"""Wheel, rail and steel of laws that are drawn alone, m and Pa."""
FORCE, PRESSED = 4e5, 75e3
"""Largest force in a picture of a contact, per wheelset, and that of a wheel in one of creep, N."""
RATES = (-0.2, 0.0, 0.2)
"""Rates of the indentation at which a law with damping is drawn, m/s."""
POINTS = 200
SLIDING = 0.01
"""Largest creepage in a picture."""
MOST = 8


class Curve(NamedTuple):
    """A line of a picture: indentations (m) and forces (N), what it is called, and how it is drawn."""

    x: FloatArray
    force: FloatArray
    label: str = ""
    line: str = "-"


# -- contact ----------------------------------------------------------------------------------------------------------


@singledispatch
def curves_of(law: Contact) -> list[Curve]:
    """Return the force of a contact law over the indentation; a law that yields also unloads."""
    raise InputError("", "what", value_text(law), "a law whose force is known without a run")


@curves_of.register
def _(law: Linear) -> list[Curve]:
    delta = np.linspace(-0.3 if law.bilateral else 0.0, 1.0, POINTS) * FORCE / law.stiffness
    return [Curve(delta, law.stiffness * delta)]


@curves_of.register
def _(law: Hertz) -> list[Curve]:
    constant, factor = elastic_constant(law), law.hysteresis_factor
    delta = np.linspace(0.0, 1.0, POINTS) * (FORCE / constant) ** (2.0 / 3.0)
    rates = RATES if factor else (0.0,)
    return [
        Curve(delta, constant * delta**1.5 * np.maximum(1.0 + factor * rate, 0.0), *_at_rate(rate, len(rates)))
        for rate in rates
    ]


@curves_of.register
def _(law: ForceLaw) -> list[Curve]:
    delta = np.linspace(0.0, law.largest, POINTS + 1)[1:]
    rates = RATES if law.takes_rate else (0.0,)
    return [
        Curve(delta, np.maximum(law.values(delta, np.full(POINTS, rate)), 0.0), *_at_rate(rate, len(rates)))
        for rate in rates
    ]


@curves_of.register
def _(law: ElasticPlastic) -> list[Curve]:
    constant = elastic_constant(law)
    unit = law.yield_indentation(constant, 2, 0.25 * FORCE)
    at_yield = constant * unit**1.5
    out = []
    elastic = np.linspace(0.0, 1.0, POINTS // 4)
    for number, top in enumerate((2.0, 4.0)):
        loaded, left = np.linspace(1.0, top, POINTS), float(law.residual(top))
        back = np.linspace(left, top, POINTS)
        high = float(law.loading(top))
        if number == 1:
            force = np.append(elastic**1.5, law.loading(loaded))
            out.append(Curve(unit * np.append(elastic, loaded), at_yield * force, "loading"))
        unloading = high * ((back - left) / (top - left)) ** 1.5
        out.append(Curve(unit * back, at_yield * unloading, "unloading" if number == 0 else "", "--"))
    return [out[1], out[0], out[2]]


def _at_rate(rate: float, count: int) -> tuple[str, str]:
    line = "-" if rate == 0.0 else "--" if rate > 0.0 else ":"
    return ("" if count == 1 else f"at a rate of {rate:g} m/s", line)


def elastic_constant(law: Any) -> float:
    """Return C of a wheelset, N/m^1.5, for wheels of the usual radius where it is computed."""
    from wheeltapper.lower.laws.ellipse import contact_constant

    if law.constant is not None:
        return float(law.constant)
    if law.constant_per_wheel is not None:
        return 2.0 * float(law.constant_per_wheel)
    return 2.0 * float(contact_constant(RADIUS, law.rail_radius, law.youngs_modulus, law.poisson))


def draw_contact(law: Contact) -> Figure:
    """Draw the force of a wheelset's contact over the indentation."""
    figure, (axis,) = panels()
    draw_force_of_contact(axis, law)
    computed = getattr(law, "constant", 0.0) is None and getattr(law, "constant_per_wheel", 0.0) is None
    wheel = f", on wheels of {RADIUS:g} m" if computed else ""
    figure.suptitle(f"contact law: {_name(law)}{wheel}")
    return figure


def draw_force_of_contact(axis: Axes, law: Contact, per_wheel: bool = False) -> None:
    """Draw the force of a contact law into a panel: of a wheelset, or of one of its two wheels."""
    found, share = curves_of(law), 0.5 if per_wheel else 1.0
    for curve in found:
        axis.plot(1e6 * curve.x, share * curve.force / 1e3, curve.line, color=BLUE, label=curve.label or None)
    axis.set(xlabel="indentation [µm]", ylabel=f"normal force of a {'wheel' if per_wheel else 'wheelset'} [kN]")
    if any(curve.label for curve in found):
        legend_above(axis)


def draw_contacts(laws: Sequence[Contact]) -> Figure:
    """Draw the forces of several laws over each other."""
    figure, (axis,) = _of_several(laws)
    others: dict[str, list[str]] = {}  # what lines that are not solid stand for, by their style
    for number, law in enumerate(laws):
        for curve in curves_of(law):
            label = f"{number + 1}: {_name(law)}" if curve.line == "-" else None
            axis.plot(1e6 * curve.x, curve.force / 1e3, curve.line, color=COLOURS[number], label=label)
            if curve.line != "-" and curve.label and curve.label not in others.setdefault(curve.line, []):
                others[curve.line].append(curve.label)
    for line, labels in others.items():
        axis.plot([], [], line, color="0.5", label=" or ".join(labels))
    axis.set(xlabel="indentation [µm]", ylabel="normal force of a wheelset [kN]")
    legend_above(axis, 4)
    figure.suptitle(f"{len(laws)} contact laws", x=0.02, ha="left")
    return figure


def _of_several(laws: Sequence[Any]) -> tuple[Figure, Any]:
    if len(laws) > MOST:
        raise InputError("", "what", f"a list of {len(laws)}", f"1 to {MOST} laws")
    return panels()


def _name(law: Any) -> str:
    """Return the name of a law's class, or of the function that a `Law` holds."""
    held = law.force if isinstance(law, Law) else None
    return str(getattr(held, "__name__", type(law).__name__)).replace("_", " ").strip("<>")


# -- creep ------------------------------------------------------------------------------------------------------------


def creep_force(law: CreepLaw, creepage: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the longitudinal creep force of a wheel, and that of the linear theory, N.

    The wheel of steel is pressed with 75 kN on a crown of 0.3 m; there is no spin.
    """
    from wheeltapper.lower.laws.ellipse import semi_axes
    from wheeltapper.lower.laws.kalker import coefficients

    along, across = (
        float(axis[0]) * np.cbrt(PRESSED)
        for axis in semi_axes(np.array([0.5 / RADIUS]), np.array([0.5 / CROWN]), MODULUS, POISSON)
    )
    shear = 0.5 * MODULUS / (1.0 + POISSON)
    linear = shear * along * across * coefficients(along, across, POISSON).c11 * creepage
    limit = law.friction * PRESSED
    if isinstance(law, Fastsim):
        from wheeltapper.march.wagon.fastsim import saturation

        return limit * saturation(linear / limit, law.bound == "parabolic", law.cells, law.strips), linear
    return linear * law.saturation(linear / limit), linear  # type: ignore[attr-defined]


def draw_creep_law(law: CreepLaw) -> Figure:
    """Draw the longitudinal force over the creepage, beside the linear theory and the limit of friction."""
    return draw_creep_laws([law])


def draw_creep_laws(laws: Sequence[CreepLaw]) -> Figure:
    """Draw the longitudinal forces of several laws over the creepage."""
    figure, (axis,) = _of_several(laws)
    creepage = np.linspace(0.0, SLIDING, POINTS)
    linear = np.zeros(POINTS)
    for number, law in enumerate(laws):
        force, linear = creep_force(law, creepage)
        label = f"{_name(law)}, friction {law.friction:g}"
        named = label if len(laws) == 1 else f"{number + 1}: {label}"
        axis.plot(100.0 * creepage, force / 1e3, color=COLOURS[number], label=named)
    most = max(law.friction for law in laws) * PRESSED
    for friction in sorted({law.friction for law in laws}):
        axis.axhline(friction * PRESSED / 1e3, color="0.5", linewidth=0.8, linestyle=":")
    axis.plot(100.0 * creepage, linear / 1e3, "--", color="0.5", linewidth=0.8, label="linear theory")
    axis.set(xlabel="longitudinal creepage [%]", ylabel="creep force of a wheel [kN]", ylim=(0.0, 1.15 * most / 1e3))
    legend_above(axis, 4)
    figure.suptitle(
        f"creep force of a wheel under {PRESSED / 1e3:g} kN without spin; dotted: the limit of friction",
        x=0.02, ha="left", fontsize=9,
    )  # fmt: skip
    return figure


# -- elements of suspensions ------------------------------------------------------------------------------------------

AXES = "xyz"
STROKE, PACE = 0.05, 0.5
"""Deflection, m, and rate, m/s, to which linear elements are drawn."""


class Characteristic(NamedTuple):
    """Forces over a deflection or a rate: the label of the axis, and lines by their names."""

    x_label: str
    lines: dict[str, tuple[FloatArray, FloatArray]]
    y_label: str = "force [kN]"


@singledispatch
def characteristic_of(element: Element) -> Characteristic:
    """Return the force of an element over what it resists, mm or m/s, and kN."""
    raise InputError("", "what", value_text(element), "an element whose force is known without a run")


@characteristic_of.register
def _(element: Spring) -> Characteristic:
    x = np.linspace(-STROKE, STROKE, POINTS)
    named = zip(AXES, element.stiffness, strict=True)
    lines = {f"along {axis}": (1e3 * x, stiffness * x / 1e3) for axis, stiffness in named if stiffness}
    if lines:
        return Characteristic("deflection [mm]", lines)
    turned = zip(AXES, element.bending, strict=True)
    about = {f"about {axis}": (1e3 * x, bending * x / 1e3) for axis, bending in turned if bending}
    return Characteristic("rotation [mrad]", about, "moment [kN m]")


@characteristic_of.register
def _(element: Damper) -> Characteristic:
    if element.damping is not None:
        rate = np.linspace(-PACE, PACE, POINTS)
        named = zip(AXES, element.damping, strict=True)
        return Characteristic(
            "rate [m/s]", {f"along {axis}": (rate, damping * rate / 1e3) for axis, damping in named if damping}
        )
    corners, force = np.array(element.rate, dtype=float), np.array(element.force, dtype=float)
    return Characteristic("rate [m/s]", {f"along {element.along}": _piecewise(corners, force, 1.0)})


@characteristic_of.register
def _(element: Stop) -> Characteristic:
    corners, force = np.array(element.deflection, dtype=float), np.array(element.force, dtype=float)
    return Characteristic("deflection [mm]", {f"along {element.along}": _piecewise(corners, force, 1e3)})


@characteristic_of.register
def _(element: Sliding) -> Characteristic:
    pressed = element.pressed_by is not None
    (back, forth), (back_limit, forth_limit) = element.bounds
    unit = 1.0 if pressed else 1e3  # over the force that presses, or kN
    give = 0.0 if pressed or not element.series_stiffness else forth_limit / float(element.series_stiffness)
    swing = max(0.01, 3.0 * give)
    x = 1e3 * np.array([0.0, give, give, swing, swing - 2 * give, swing - 2 * give, -swing, 2 * give - swing, swing])
    y = np.array([0.0, forth_limit, forth, forth, -back_limit, -back, -back, forth_limit, forth]) / unit
    x[-1], y[-1] = x[1] if give else x[-1], y[2]
    way = np.linspace(0.0, 1.0, 25)[:-1]
    dense = [np.concatenate([a + (b - a) * way for a, b in zip(v[:-1], v[1:], strict=True)]) for v in (x, y)]
    turns = element.direction not in AXES
    what = "moment [kN m]" if turns else "force [kN]"
    if pressed:
        what = f"{'moment [m]' if turns else 'force'} over that of {element.pressed_by}"
    way_text = f"{'about' if turns else 'along'} {element.direction}, there and back"
    return Characteristic("angle [mrad]" if turns else "deflection [mm]", {way_text: (dense[0], dense[1])}, what)


@characteristic_of.register
def _(element: CompressionSpring) -> Characteristic:
    corners, heights = np.array(element.compression, dtype=float), np.array(element.force, dtype=float)
    places = np.union1d(np.linspace(-0.25 * corners[-1], corners[-1], POINTS), corners)
    force = np.interp(places, corners, heights, left=0.0)
    return Characteristic("pressed by [mm]", {f"along {element.along}": (1e3 * places, force / 1e3)})


@characteristic_of.register
def _(element: Link) -> Characteristic:
    x, force = np.zeros(2), np.array([-1.0, 1.0]) * FORCE / 1e3
    return Characteristic("deflection [mm]", {f"along {', '.join(element.along)}: rigid": (x, force)})


def _piecewise(corners: FloatArray, force: FloatArray, scale: float) -> tuple[FloatArray, FloatArray]:
    """Return a characteristic between its corners and half as far beyond; odd, where it begins at zero."""
    if corners[0] == 0.0:
        corners, force = np.append(-corners[:0:-1], corners), np.append(-force[:0:-1], force)
    beyond = 0.5 * (corners[-1] - corners[0]) / 2.0
    x = np.linspace(corners[0] - beyond, corners[-1] + beyond, POINTS)
    x = np.union1d(x, corners)
    y = np.interp(x, corners, force)
    for end, inner, out in ((0, 1, x < corners[0]), (-1, -2, x > corners[-1])):
        slope = (force[end] - force[inner]) / (corners[end] - corners[inner])
        y[out] = force[end] + slope * (x[out] - corners[end])
    return scale * x, y / 1e3


def draw_element(element: Element) -> Figure:
    """Draw the force of an element over its deflection, or its rate."""
    found = characteristic_of(element)
    figure, (axis,) = panels()
    for number, (label, (x, y)) in enumerate(found.lines.items()):
        axis.plot(x, y, label=label, color=COLOURS[number])
    for line in (axis.axhline, axis.axvline):
        line(0.0, color="0.5", linewidth=0.8, zorder=0)
    axis.set(xlabel=found.x_label, ylabel=found.y_label)
    if found.lines:
        legend_above(axis)
    ends = " and ".join(element.between)
    figure.suptitle(f"{spaced(type(element).__name__)} “{element.name}” between {ends}", x=0.02, ha="left")
    return figure

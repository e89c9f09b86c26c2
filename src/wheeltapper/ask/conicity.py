"""Equivalent conicity of a pair of profiles over the amplitude, as EN 15302 defines it, and beside it the elastic one.

A wheelset runs on cones of the equivalent conicity with the wavelength that it has on its profiles: one period of
y'' + Δr(y)/(e·r0) = 0 with the amplitude, Δr the difference of the rolling radii. On cones the wavelength is that of
Klingel's formula. See docs/theory/wagon.rst, section 7.9.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.profile.s1002 import FLANGE_BACK
from wheeltapper.describe.profile.wheel_rail import Cones, WheelRail
from wheeltapper.ground.arguments import as_quantities, check_choice
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.lower.laws.geometry import radius_difference
from wheeltapper.lower.laws.patches import geometry_of
from wheeltapper.lower.laws.rigid_contact import BESIDE, Touching, touching_of
from wheeltapper.record.labels import CONICITIES, CONICITY_TITLE

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
AMPLITUDES = tuple(1e-3 * np.arange(1.0, 7.45, 0.1))
"""As the standard quotes them, m."""
QUOTED, NEAR, FAR = 3e-3, 2e-3, 4e-3
"""Amplitude, m, for which one figure is quoted; and those between which the nonlinearity parameter is a slope."""
ROOM = 3e-3
"""By how much farther than the largest amplitude differences are computed, m: the middle of a motion is not always
where the wheelset stands straight."""
LARGEST = 15e-3
"""Largest amplitude, m."""
MIDDLES = 120
"""Middles of the motion that are looked at; none of them is zero."""
CROWN = 0.3
"""Radius of the head of rails on which cones roll, m."""
NODE = 1e-4
"""Distance of shifts at which the difference of elastic contacts is computed, m."""
ROUNDING = 1e-12
"""Differences of radii that are smaller are none, m."""
ANGLES = 1000
"""Places of one half wave at which the wavelength is summed up."""


class Difference:
    """The difference of the rolling radii over the shift of the wheelset to the left, m, linear between nodes."""

    def __init__(self, shift: FloatArray, values: FloatArray) -> None:
        self.shift, self.values = shift, values
        self._rates = np.diff(values) / np.diff(shift)
        self._sums = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(shift))])

    def integral(self, y: FloatArray) -> FloatArray:
        """Return the integral from the first node on, m²."""
        at = np.clip(np.searchsorted(self.shift, y, side="right") - 1, 0, len(self._rates) - 1)
        beyond = y - self.shift[at]
        return np.asarray(self._sums[at] + beyond * (self.values[at] + 0.5 * self._rates[at] * beyond))


def conicity(
    profiles: WheelRail | Cones,
    amplitudes: float | str | Sequence[Any] = AMPLITUDES,
    *,
    right: WheelRail | None = None,
    radius: float | str | Sequence[Any] = 0.46,
    contact: Literal["rigid", "elastic"] = "rigid",
) -> xr.Dataset:
    """Return the equivalent conicity of wheels on rails over the amplitude of their lateral motion.

    Parameters
    ----------
    profiles
        `WheelRail`, or `Cones`.
    amplitudes
        m, one or several, up to 15 mm; by default 1 to 7.4 mm, as the standard quotes them.
    right
        Profiles of the right side where they are others, with the same gauge and flanges.
    radius
        Nominal radius of the wheels, m; two where the left and the right one differ.
    contact
        "rigid": one place of contact on each wheel, without roll of the wheelset, as the standard has it. "elastic":
        places within the profiles' `smoothing` share the contact, and the wheelset rolls, as in runs of a `Wagon`.

    Returns
    -------
    xarray.Dataset
        Over "amplitude": `equivalent_conicity` (of elastic contact `elastic_conicity`) and `wavelength`, m. NaN where
        the motion is no wave: the difference of the radii leads away from the middle. Over "lateral_shift", m, of the
        wheelset to the left: `radius_difference`, left less right, m. Of rigid contact over "side", too:
        `place_on_wheel`, m from the tread datum to the field side, `place_on_rail`, m from the track's middle, and
        `contact_angle`, rad; and over "jump" `jump_shift`, at which contact jumps from place to place, and
        `jump_of_radius`, by how much the difference jumps then, m. The attributes say the figure at 3 mm (`at_3_mm`),
        and the `nonlinearity`, its mean slope from 2 to 4 mm, 1/mm.

    Raises
    ------
    InputError
        If an argument is wrong, or a profile's file is.
    """
    import xarray as xr

    check_choice(contact, "contact", ("rigid", "elastic"))
    if not isinstance(profiles, WheelRail | Cones):
        raise InputError("", "profiles", value_text(profiles), "WheelRail or Cones")
    asked = np.array(_lengths(amplitudes, "amplitudes", "amplitudes of the lateral motion"))
    if asked.max() > LARGEST:
        raise InputError("", "amplitudes", f"{asked.max():g} m", f"at most {LARGEST:g} m")
    radii = _radii(radius)
    both = _checked_sides(profiles, right)
    farthest = max(float(asked.max()), FAR) + ROOM
    arm = _between_circles(profiles) * sum(radii) / 2.0
    more: dict[str, Any] = {}
    if contact == "elastic":
        difference = _elastic(both, radii, farthest)
    elif isinstance(profiles, Cones):
        difference = _of_cones(profiles, radii, farthest)
    else:
        left = touching_of(both[0], farthest)
        difference, more = _rigid(left, left if right is None else touching_of(both[1], farthest), radii)
    name = CONICITIES[contact]
    figures, waves = np.array([_figure(difference, float(one), arm) for one in asked]).T
    quoted, near, far = (_figure(difference, one, arm)[0] for one in (QUOTED, NEAR, FAR))
    variables = {
        name: ("amplitude", figures, {"units": "", "long_name": name.replace("_", " ")}),
        "wavelength": ("amplitude", waves, {"units": "m", "long_name": "wavelength of the free motion"}),
        "radius_difference": (
            "lateral_shift", difference.values,
            {"units": "m", "long_name": "difference of rolling radii, left less right"},
        ),
        **more,
    }  # fmt: skip
    coordinates = {
        "amplitude": ("amplitude", asked, {"units": "m", "long_name": "amplitude of the lateral motion"}),
        "lateral_shift": (
            "lateral_shift",
            difference.shift,
            {"units": "m", "long_name": "shift of the wheelset to the left"},
        ),
    }
    attributes = {
        "title": CONICITY_TITLE, "contact": contact, "profiles": _words(profiles, right), "at_3_mm": quoted,
        "nonlinearity": (far - near) / (1e3 * (FAR - NEAR)), "radius": list(radii),
    }  # fmt: skip
    return xr.Dataset(variables, coordinates | ({"side": ["left", "right"]} if more else {}), attributes)


def _lengths(given: Any, field: str, what: str) -> list[float]:
    """Return one length or several, m."""
    return as_quantities([given] if np.ndim(given) == 0 else given, field, "length", what)


def _radii(given: Any) -> tuple[float, float]:
    """Return the radii of the left and the right wheel."""
    radii = _lengths(given, "radius", "a radius, or those of the left and the right wheel")
    if len(radii) > 2:
        raise InputError("", "radius", f"{len(radii)} radii", "one, or those of the left and the right wheel")
    return radii[0], radii[-1]


def _checked_sides(profiles: WheelRail | Cones, right: Any) -> tuple[Any, Any]:
    """Return the profiles of both sides."""
    if right is None:
        return profiles, profiles
    if not isinstance(right, WheelRail) or not isinstance(profiles, WheelRail):
        raise InputError("", "right", value_text(right), "WheelRail, as on the left")
    for field in ("gauge", "flange_backs"):
        if getattr(right, field) != getattr(profiles, field):
            found = f"{getattr(right, field):g} m, {getattr(profiles, field):g} m on the left"
            raise InputError("", f"right.{field}", found, "the same on both sides: they are distances between them")
    return profiles, right


def _between_circles(profiles: WheelRail | Cones) -> float:
    """Return the distance between the two circles of nominal radius, m."""
    return 2.0 * float(profiles.arm) if isinstance(profiles, Cones) else profiles.flange_backs + 2e-3 * FLANGE_BACK


def _of_cones(profiles: Cones, radii: tuple[float, float], farthest: float) -> Difference:
    shift = np.linspace(-farthest, farthest, 201)
    return Difference(shift, 2.0 * profiles.conicity * shift + radii[0] - radii[1])


def _elastic(both: tuple[Any, Any], radii: tuple[float, float], farthest: float) -> Difference:
    """Return the difference of contacts that are smooth, with roll."""
    if both[0] != both[1] or radii[0] != radii[1]:
        raise InputError("", "contact", '"elastic", with two sides that differ', '"rigid", or two equal sides')
    geometry, values = geometry_of(both[0], radii[0], CROWN), [0.0]
    for number in range(1, round(farthest / NODE) + 1):
        try:
            values.append(radius_difference(geometry, NODE * number, radii[0]))
        except InputError:  # a flange has climbed its rail: larger amplitudes have no figure
            break
    half = np.array(values)
    return Difference(NODE * np.arange(1.0 - len(half), len(half)), np.concatenate([-half[:0:-1], half]))


def _rigid(left: Touching, right: Touching, radii: tuple[float, float]) -> tuple[Difference, dict[str, Any]]:
    """Return the difference of rigid contacts, and where they are."""
    shift = np.union1d(left.shift, -right.shift)
    values = radii[0] + left.at("radius", shift) - radii[1] - right.at("radius", -shift)
    sides = {
        "place_on_wheel": ("wheel", 1.0, "m", "place on the wheel from its tread datum, to the field side"),
        "place_on_rail": ("rail", 1.0, "m", "place on the rail from the track's middle"),
        "contact_angle": ("slope", -1.0, "rad", "angle of the contact, positive towards the flange"),
    }
    more: dict[str, Any] = {}
    for name, (row, sign, unit, meaning) in sides.items():
        found = sign * np.stack([left.at(row, shift), right.at(row, -shift)])
        more[name] = ("side", "lateral_shift"), np.arctan(found) if unit == "rad" else found, {
            "units": unit, "long_name": meaning,
        }  # fmt: skip
    jumps = np.sort(np.concatenate([left.jumps, -right.jumps]))
    by = np.interp(jumps + 2.0 * BESIDE, shift, values) - np.interp(jumps - 2.0 * BESIDE, shift, values)
    more["jump_shift"] = "jump", jumps, {"units": "m", "long_name": "shift at which contact jumps"}
    more["jump_of_radius"] = "jump", by, {"units": "m", "long_name": "jump of the difference of radii"}
    return Difference(shift, values), more


def _figure(difference: Difference, amplitude: float, arm: float) -> tuple[float, float]:
    """Return the equivalent conicity and the wavelength, m, of one amplitude; `arm` is e·r0, m². NaN without a wave."""
    from scipy.optimize import brentq

    if np.all(np.abs(difference.values[np.abs(difference.shift) <= amplitude]) < ROUNDING):
        return 0.0, np.inf
    reach = min(ROOM, float(difference.shift[-1]) - amplitude)

    def uneven(middle: Any) -> Any:
        return difference.integral(middle + amplitude) - difference.integral(middle - amplitude)

    middles = np.linspace(-reach, reach, MIDDLES)
    excess = uneven(middles)
    rising = np.flatnonzero((excess[:-1] < 0.0) & (excess[1:] >= 0.0))
    if reach <= 0.0 or not len(rising):
        return np.nan, np.nan
    first = int(rising[np.argmin(np.abs(middles[rising] + middles[rising + 1]))])
    middle = float(brentq(uneven, middles[first], middles[first + 1], xtol=1e-18, rtol=1e-15))
    angles = np.pi * (np.arange(ANGLES) + 0.5) / ANGLES
    most = difference.integral(np.array([middle + amplitude]))
    fall = most - difference.integral(middle - amplitude * np.cos(angles))
    if np.any(fall <= 0.0):
        return np.nan, np.nan
    speed = np.sqrt(2.0 * fall / arm)
    wavelength = 2.0 * np.pi / ANGLES * float((amplitude * np.sin(angles) / speed).sum())
    return 2.0 * arm * (np.pi / wavelength) ** 2, wavelength


def _words(profiles: WheelRail | Cones, right: WheelRail | None) -> str:
    """Return what lies on what."""
    if isinstance(profiles, Cones):
        return f"cones of {profiles.conicity:g}"
    said = [f"{one.wheel} on {one.rail}" for one in (profiles, right) if one is not None]
    return ", right ".join(said)

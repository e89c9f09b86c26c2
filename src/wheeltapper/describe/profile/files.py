"""Profiles of wheels and rails from files: two columns, MiniProf, SIMPACK.

All lengths are in mm. Files are converted to the conventions of this package:

- wheel: y from the tread datum, positive to the field side, so that the flange lies at negative y; z positive away from
  the axle (the radius at y is r0 + z);
- rail: y from the rail's middle, the gauge side at negative y; z upwards from the crown; upright. A rail that was
  measured as it lies already leans: use it with inclination 0.

Two columns are y and z as above. MiniProf: a wheel's x counts from the flange's back to the field side and its Y away
from the axle (y = x - 70, z = Y, zero at the datum); a rail's x grows to the gauge side, Y up (y = -x, z = Y). SIMPACK:
y to the field side, z down for both (a wheel's y, z; a rail's y, -z).

MiniProf's 70 mm are replaced by its header WheelDiameterTaperline, if it is given. SIMPACK's settings act in the order
of their numbers in the file, in the file's units: point.dist.min, shift, bounds (off if min ≥ max; y drops points, z
clips them), mirror, units.len.f (file's units per metre). rotate is refused, as its sense is not public. The formula of
approx.smooth is not public either. Here it is that of FITPACK: the largest sum of squared distances of the spline from
the points, in the file's unit.

The rail of a file is moved sideways until its two points 14 mm below the crown have the same distance from y = 0. If
the field side is not that deep, the distance of the gauge point is 36 mm. The choice of y = 0 has no effect, because a
rail is laid by its gauge point.

Source: the readers and example files of CONTACT (Vtech CMCC; m_profile.f90, Manchester benchmark, MiniProf recordings
of 2015 and 2020); the comments in SIMPACK's files; Greenwood Engineering, MiniProf standard alignments.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.irregularity import spline
from wheeltapper.describe.irregularity.samples import converted_values
from wheeltapper.describe.profile.file import PLAIN, ProfileFile, numbered_profile, read_profile
from wheeltapper.describe.profile.named import NAMED, Kind, Shape
from wheeltapper.describe.profile.s1002 import FLANGE_BACK
from wheeltapper.describe.table.content import numbered_lines
from wheeltapper.describe.table.text import text_table
from wheeltapper.ground.errors import InputError

FloatArray = NDArray[np.float64]
Lines = list[tuple[int, str]]

FEWEST = 10
"""Smallest number of points of a profile."""
WIDTH = {"wheel": (80.0, 200.0), "rail": (40.0, 120.0)}
"""Range of the width of a profile, mm. Outside it the file probably has another unit."""
UNITS = {"metres": 1e3, "inches": 25.4, "centimetres": 10.0, "micrometres": 1e-3}
"""Units that a file may have by mistake, and their length in mm: for the hint."""
PER_METRE = {"m": 1.0, "cm": 1e2, "mm": 1e3, "in": 1 / 0.0254, "inch": 1 / 0.0254}
FLANGE, TIP = 15.0, (-65.0, -40.0)
"""A flange is at least FLANGE high, mm. Its tip lies in the range TIP, mm from the tread datum, if its back is 70 mm
from it."""
OFF_DATUM, OFF_MIDDLE = 10.0, 20.0
"""Largest height of a wheel's profile at y = 0, mm, and half the width of the part about it that is taken as the tread.
Largest distance of a rail's crown from y = 0, mm."""
GAUGE_DEPTH, HALF_HEAD, FALL = 14.0, 36.0, 0.2
"""Depth below the crown at which the gauge is measured, half the width of a rail's head there, and the smallest fall
from the crown to the lower end, mm."""
TURN = 0.1
"""Largest step, mm, by which a point may turn back as noise; such points are dropped. A larger step is an overhang, and
the profile ends there."""
NEAREST, STEEPEST = 1e-3, 100.0
"""Smallest distance of two points, mm, and largest slope. Where a profile is steeper, its height is no function of
y."""


@dataclass(frozen=True)
class Outline:
    """The points of a file, in its order, mm; `noise`: rms distance of the spline from the points."""

    y: FloatArray
    z: FloatArray
    noise: float = 0.0


def wheel_profile(name_or_path: str | ProfileFile) -> Shape:
    """Return the profile of a wheel.

    Parameters
    ----------
    name_or_path
        "S1002", or "EN 15302 A" (B, C, H, I); or a file: two columns (.txt, .dat, .csv), MiniProf (.whl, .mpt) or
        SIMPACK (.prw). One of several profiles in a file is "worn.mpt#2". Or a file that is read already.

    Returns
    -------
    callable
        From lateral positions in mm, of any shape, to heights in mm of the same shape: y from the tread datum, positive
        to the field side, z positive away from the axle; NaN beyond the ends. The cubic spline through the file's
        points (twice continuously differentiable), or near them if a SIMPACK file asks for smoothing. From the tread
        outwards, it ends where the points turn back by more than 0.1 mm or are steeper than 100:1.

    Raises
    ------
    InputError
        The file is missing, unreadable, a rail's, mirrored, in another unit or not from the tread datum.
    """
    return _shape_of(name_or_path, "wheel")


def rail_profile(name_or_path: str | ProfileFile) -> Shape:
    """Return the profile of an upright rail.

    Parameters
    ----------
    name_or_path
        "60E1", or "EN 15302 A"; or a file: two columns (.txt, .dat, .csv), MiniProf (.ban, .mpt) or SIMPACK (.prr). One
        of several profiles in a file is "worn.mpt#2". Or a file that is read already.

    Returns
    -------
    callable
        From lateral positions in mm, of any shape, to heights in mm of the same shape: y from the rail's middle, the
        gauge side negative, z upwards from the crown; NaN beyond the ends. The spline is that of `wheel_profile`, from
        the crown outwards.

    Raises
    ------
    InputError
        The file is missing, unreadable, a wheel's, mirrored, in another unit or not as deep as the gauge point.
    """
    return _shape_of(name_or_path, "rail")


def _shape_of(name_or_path: str | ProfileFile, kind: Kind) -> Shape:
    given = read_profile(name_or_path, kind)
    return _from_file(given, kind) if isinstance(given, ProfileFile) else NAMED[kind][given]


def _from_file(file: ProfileFile, kind: Kind) -> Shape:
    """Return the function through a file's points; every error names the file."""
    try:
        outline = _file_outline(file, kind)
        _check_size(outline, kind)
        return _profile_curve(*(_wheel_points(outline) if kind == "wheel" else _rail_points(outline)), outline.noise)
    except InputError as error:
        raise error.at(file.name) from None


def _profile_curve(y: FloatArray, z: FloatArray, noise: float) -> Shape:
    """Return the spline through, or near, points in the order of y."""
    form = spline.smoothing_spline(y, z, noise) if noise else spline.interpolating_spline(y, z)

    def height_at(places: FloatArray) -> FloatArray:
        places = np.asarray(places, dtype=float)
        inside = (places >= y[0]) & (places <= y[-1])
        return np.where(inside, form.derivative(places, 0), np.nan)

    return height_at


def _file_outline(file: ProfileFile, kind: Kind) -> Outline:
    """Return the points of a file; its format follows from its suffix, or from its text."""
    path = Path(file.name)
    name, number = (path.name, 0) if path.is_file() else numbered_profile(path.name)
    suffix, text = Path(name).suffix.lower(), file.text
    lines = [(number, line.strip()) for number, line in numbered_lines(text)]
    if suffix in (".prw", ".prr") or re.search(r"^\s*point\.begin", text, re.MULTILINE):
        return _simpack_outline(lines, kind)
    if suffix not in PLAIN or re.search(r"^(XYPoints|ColumnDef)\s*=", text, re.MULTILINE | re.IGNORECASE):
        return _miniprof_outline(_of_one_profile(lines, name, number), kind)
    return _two_columns(lines)


def _two_columns(lines: Lines) -> Outline:
    """Return the points of a file with columns y and z, in mm unless its header says otherwise."""
    return Outline(*_profile_points(lines, two=True))


def _profile_points(lines: Lines, first: int = 0, second: int = 1, two: bool = False) -> FloatArray:
    """Return two columns of rows of numbers, (2, rows), converted to mm if a header states another unit."""
    table = text_table(lines, ("length",), fewest=2)
    if len(table.columns) <= max(first, second) or (two and len(table.columns) > 2):
        found = f"{len(table.columns)} columns"
        raise InputError("", f"line {table.lines[0]}", found, "2" if two else f"at least {max(first, second) + 1}")
    points = np.array(converted_values(table, *((table.columns[k], "length", "mm") for k in (first, second))))
    bad = np.flatnonzero(~np.isfinite(points).all(axis=0))
    if len(bad):
        found = f"{points[0, bad[0]]:g} and {points[1, bad[0]]:g}"
        raise InputError("", f"line {table.lines[bad[0]]}", found, "2 finite numbers")
    return points


def _is_row(text: str) -> bool:
    """Return whether a line begins with a number, even one that no profile can have."""
    return re.match(r"[-+]?(\.?\d|nan|inf)", text.strip(), re.IGNORECASE) is not None


def _header_number(settings: dict[str, str], key: str, default: float) -> float:
    """Return a number from a header; an empty one is the default."""
    text = settings.get(key, "")
    try:
        return float(text) if text else default
    except ValueError:
        raise InputError("", key, repr(text), "a number") from None


def _miniprof_outline(lines: Lines, kind: Kind) -> Outline:
    """Return the points of a MiniProf file: a header of KEY=VALUE, a blank line, rows of numbers.

    An old one begins with MINIPROF and has numbers in its header, too. One with sections has KEY=VALUE in several.
    """
    old = bool(lines) and lines[0][1].upper().startswith("MINIPROF")
    begin = next((i for i, (_, text) in enumerate(lines) if not text or (_is_row(text) and not old)), len(lines))
    pairs = [text.partition("=") for _, text in lines[:begin] if "=" in text and text[0] not in '"#!']
    header = {key.strip().upper(): value.strip() for key, _, value in pairs}
    body = [(number, text) for number, text in lines[begin:] if text]
    said = _header_number(header, "XYPOINTS", 0.0)
    if len(body) < said:
        raise InputError("", "XYPoints", f"{len(body)} of {said:g} points", "a file that is not cut off")
    names = [name.strip().upper() for name in header.get("COLUMNDEF", "X,Y").split(",")]
    if "X" not in names or "Y" not in names:
        raise InputError("", "ColumnDef", repr(header["COLUMNDEF"]), "columns X and Y")
    rows = [(number, re.split('["#!%]', text)[0].strip()) for number, text in body]  # some are commented out
    across, up = _profile_points(rows, names.index("X"), names.index("Y")) if body else np.empty((2, 0))
    x, z = across + _header_number(header, "XOFFSET", 0.0), up + _header_number(header, "YOFFSET", 0.0)
    if kind == "wheel":
        y = x - _header_number(header, "WHEELDIAMETERTAPERLINE", FLANGE_BACK)
        return Outline(y, z - _at_datum(y, z))
    return Outline(x[np.argmax(z)] - x, z) if len(x) else Outline(x, z)  # x = 0 is the position of the instrument


def _of_one_profile(lines: Lines, file: str, number: int) -> Lines:
    """Return the lines of a file with sections as those of a file without: its header, a blank line, its points.

    `number` is that of the profile whose points are taken; 0: there is only one.
    """
    begins = [i for i, (_, text) in enumerate(lines) if re.fullmatch(r"\[Profile\d+Points\]", text, re.IGNORECASE)]
    if not begins:
        return lines
    ends = [next((j for j in range(i + 1, len(lines)) if lines[j][1].startswith("[")), len(lines)) for i in begins]
    held = [(lines[i][1], lines[i + 1 : end]) for i, end in zip(begins, ends, strict=True)]
    held = [one for one in held if any(_is_row(text) for _, text in one[1])]
    numbers = [int(re.sub(r"\D", "", name)) for name, _ in held]
    if not held or number not in (numbers if len(held) > 1 or number else (0,)):
        found = f"{len(held)} profiles with points ({', '.join(name for name, _ in held)})" if held else "no points"
        allowed = f"one of them, as {f'{file}#{numbers[-1]}'!r}" if held else "a file with the points of a profile"
        raise InputError("", "sections", found, allowed)
    name, points = held[numbers.index(number) if number else 0]
    wanted = ("[fileinfo]", name.lower().replace("points", "info"))
    header: Lines = []
    section = ""
    for line in lines:
        section = line[1].lower() if line[1].startswith("[") else section
        header += [line] if "=" in line[1] and section in wanted else []
    return [*header, (lines[begins[0]][0], ""), *points]


def _at_datum(y: FloatArray, z: FloatArray) -> float:
    """Return the height of a tread at y = 0; zero if there is no tread."""
    tread = np.flatnonzero(np.abs(y) < OFF_DATUM)
    tread = tread[np.argsort(y[tread])]
    return float(np.interp(0.0, y[tread], z[tread])) if len(tread) else 0.0


def _simpack_sections(lines: Lines) -> tuple[dict[str, str], Lines]:
    """Return the settings of a SIMPACK file, as section.key, and the rows of its points."""
    settings: dict[str, str] = {}
    points: Lines = []
    section = ""
    for number, line in lines:
        text = re.sub(r"^((?:[^'!%]|'[^']*')*)[!%].*", r"\1", line).strip()
        if text.endswith((".begin", ".end")):
            section = {"point.end": "spline"}.get(text, text.removesuffix(".begin"))
        elif section == "point" and text:
            points.append((number, text))
        elif "=" in text:
            key, _, value = text.partition("=")
            settings[f"{section}.{key.strip()}"] = value.strip().strip("'")
    if section == "point" or not points:
        found = "the end of the file" if points else "no points"
        raise InputError("", "point", found, "rows y z between point.begin and point.end")
    return settings, points


def _simpack_outline(lines: Lines, kind: Kind) -> Outline:
    """Return the points of a SIMPACK file, after its settings."""
    settings, points = _simpack_sections(lines)

    def setting_value(key: str) -> float:
        return _header_number(settings, f"spline.{key}", 0.0)

    if _header_number(settings, "header.type", float(kind == "wheel")) != float(kind == "wheel"):
        other = "rail" if kind == "wheel" else "wheel"
        raise InputError("", "header.type", f"{settings['header.type']} (a {other})", f"the profile of a {kind}")
    if setting_value("rotate"):
        raise InputError("", "spline.rotate", settings["spline.rotate"], "0; turn the points themselves instead")
    y, z = _thinned_outline(_profile_points(points).T, setting_value("point.dist.min")).T
    y, z = y + setting_value("shift.y"), z + setting_value("shift.z")
    if (low := setting_value("bound.y.min")) < (high := setting_value("bound.y.max")):
        y, z = y[(y >= low) & (y <= high)], z[(y >= low) & (y <= high)]
    if (low := setting_value("bound.z.min")) < (high := setting_value("bound.z.max")):
        z = np.clip(z, low, high)
    y, z = (-y if setting_value("mirror.y") else y), (-z if setting_value("mirror.z") else z)
    scale = 1e3 / _per_metre(settings)
    noise = float(np.sqrt(_allowed_squares(setting_value("approx.smooth"), points) / max(len(y), 1)))
    return Outline(scale * y, scale * (z if kind == "wheel" else -z), scale * noise)


def _thinned_outline(points: FloatArray, distance: float) -> FloatArray:
    """Return the points without those nearer than a distance to the last one kept."""
    kept = [points[0]]
    for point in points[1:]:
        kept += [point] if np.hypot(*(point - kept[-1])) >= distance else []
    return np.array(kept)


def _per_metre(settings: dict[str, str]) -> float:
    """Return the number of length units of a SIMPACK file per metre; its factor overrides the unit's name."""
    name = settings.get("spline.units.len", "m")
    factor = _header_number(settings, "spline.units.len.f", PER_METRE.get(name, 0.0))
    if not factor > 0.0:
        found = settings.get("spline.units.len.f") or repr(name)
        raise InputError("", "spline.units.len.f", found, "a positive number of the file's length units per metre")
    return factor


def _allowed_squares(squares: float, points: Lines) -> float:
    """Return a SIMPACK file's allowed sum of squares; refuse weights, which would change its meaning."""
    if squares < 0.0:
        raise InputError("", "spline.approx.smooth", f"{squares:g}", "0 (through the points) or more")
    if squares:
        table = text_table(points, ("length",))
        weights = table.columns[2].values if len(table.columns) > 2 else np.ones(1)
        if (weights != 1.0).any():
            where = f"line {table.lines[np.argmax(weights != 1.0)]}"
            raise InputError("", where, "a weight other than 1", "equal weights where approx.smooth > 0")
    return squares


def _check_size(outline: Outline, kind: Kind) -> None:
    """Refuse too few points and other units than mm."""
    if len(outline.y) < FEWEST:
        raise InputError("", "points", f"{len(outline.y)} points", f"at least {FEWEST}")
    low, high = WIDTH[kind]
    width = float(np.ptp(outline.y))
    if not low <= width <= high:
        unit = next((name for name, factor in UNITS.items() if low <= width * factor <= high), None)
        found = f"{width:.4g}, probably in {unit}" if unit else f"{width:.4g} mm"
        raise InputError("", f"width of the {kind}", found, f"{low:g} mm to {high:g} mm")


def _wheel_points(outline: Outline) -> tuple[FloatArray, FloatArray]:
    """Return the points of a wheel that are a function of y; refuse an impossible wheel."""
    y, z = outline.y, outline.z
    _check_flange(y, z, float(y[np.argmax(z)]))
    start = int(np.argmin(np.abs(y)))
    if abs(z[start]) > OFF_DATUM:
        raise InputError("", "tread", f"z = {z[start]:.4g} mm at y = 0", f"up to {OFF_DATUM:g} mm; z counts from there")
    kept_y, kept_z = _outward_points(y, z, start)
    if kept_y[0] > y[np.argmax(z)] or np.ptp(kept_y) < WIDTH["wheel"][0]:
        raise _order_error(kept_y, "from the tread to the flange's tip and to the field side")
    return kept_y, kept_z


def _check_flange(y: FloatArray, z: FloatArray, tip: float) -> None:
    """Refuse a wheel without a flange, or with the flange elsewhere than 70 mm from the tread datum."""
    order = np.argsort(y)
    tread = np.median(np.interp(np.linspace(y.min(), y.max(), 101), y[order], z[order]))  # mostly tread
    side = f"a flange at least {FLANGE:g} mm high on the side of negative y, z positive away from the axle"
    if z.max() - tread < FLANGE:
        hint = "; mirror the file: z to -z (SIMPACK: mirror.z)" if tread - z.min() >= FLANGE else ""
        raise InputError("", "flange", f"no flange: {z.max() - tread:.3g} mm above the tread", side + hint)
    if tip > 0.5 * (y.min() + y.max()):
        hint = "; mirror the file: y to -y (SIMPACK: mirror.y)"
        raise InputError("", "flange", f"its tip at y = {tip:.4g} mm, on the wrong side", side + hint)
    if not TIP[0] <= tip <= TIP[1]:
        allowed = f"{TIP[0]:g} mm to {TIP[1]:g} mm; y counts from the tread datum, 70 mm from the flange's back"
        raise InputError("", "flange", f"its tip at y = {tip:.4g} mm", allowed)


def _rail_points(outline: Outline) -> tuple[FloatArray, FloatArray]:
    """Return the points of a rail that are a function of y, relative to middle and crown; refuse an impossible rail."""
    y, z = outline.y, outline.z
    crown = int(np.argmax(z))
    if z[crown] - max(z[np.argmin(y)], z[np.argmax(y)]) < FALL:
        allowed = "a crown that falls on both sides; if z counts downwards, mirror it: z to -z (SIMPACK: mirror.z)"
        raise InputError("", "crown", f"the highest point at y = {y[crown]:.4g} mm, where the rail ends", allowed)
    if abs(y[crown]) > OFF_MIDDLE:
        raise InputError(
            "", "crown", f"at y = {y[crown]:.4g} mm", f"within {OFF_MIDDLE:g} mm of y = 0, the rail's middle"
        )
    y, z = _outward_points(y, z - z[crown], crown)
    if np.ptp(y) < WIDTH["rail"][0]:
        raise _order_error(y, "from the crown to both sides")
    crown = int(np.argmax(z))
    if z[0] > -GAUGE_DEPTH:
        turned = "; mirror the file, if its gauge side is at positive y" if z[-1] <= -GAUGE_DEPTH else ""
        allowed = f"{GAUGE_DEPTH:g} mm at least, where the gauge is measured{turned}"
        raise InputError("", "gauge side", f"points to {-z[0]:.3g} mm below the crown at negative y", allowed)
    inner = float(np.interp(-GAUGE_DEPTH, z[: crown + 1], y[: crown + 1]))
    outer = float(np.interp(-GAUGE_DEPTH, z[crown:][::-1], y[crown:][::-1]))
    return y - (0.5 * (inner + outer) if z[-1] <= -GAUGE_DEPTH else inner + HALF_HEAD), z


def _order_error(kept: FloatArray, way: str) -> InputError:
    found = f"points that turn back at y = {kept[0]:.4g} mm or {kept[-1]:.4g} mm"
    return InputError("", "order", found, f"points in order {way}")


def _outward_points(y: FloatArray, z: FloatArray, start: int) -> tuple[FloatArray, FloatArray]:
    """Return the points that lie further out than all before, on either side of the start, in the order of y."""
    rising = y[-1] > y[0]
    forward = list(_outward_indices(y, z, range(start, len(y)), 1.0 if rising else -1.0))
    backward = list(_outward_indices(y, z, range(start, -1, -1), -1.0 if rising else 1.0))
    order = backward[:0:-1] + forward if rising else forward[:0:-1] + backward
    return y[order], z[order]


def _outward_indices(y: FloatArray, z: FloatArray, way: range, sign: float) -> Iterator[int]:
    """Yield the indices of points that lie further out than all before them."""
    last = way[0]
    yield last
    for i in way[1:]:
        step = sign * (y[i] - y[last])
        if step < -TURN or abs(z[i] - z[last]) > STEEPEST * max(step, NEAREST) + TURN:
            return
        if step >= NEAREST:
            yield i
            last = i

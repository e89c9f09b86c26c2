"""Text tables in every dialect, written here digit by digit, are read as exactly those numbers, for every purpose."""

import random
from fractions import Fraction
from itertools import product
from math import pi

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.profile.files import rail_profile, wheel_profile
from wheeltapper.describe.profile.rail_60e1 import rail_60e1
from wheeltapper.describe.profile.s1002 import s1002
from wheeltapper.record.recordings.read import read_recording

COUNT = 1500
SEPARATORS = {"semicolon": ";", "tab": "\t", "comma": ",", "blanks": "   ", "comma and blank": ", "}
ENDS = ("\n", "\r\n", "\r")
ENCODINGS = ("utf-8", "utf-8-sig", "latin-1", "utf-16")
HEADERS = ("names [units]", "names (units)", "names / units", "names_units", "names in units", "units below", "units")
PREAMBLES = (
    "", "# Messung 3\n# R = 460 mm\n", "Gleis: Süd, Höhe über Niveau\nDatum; 12.03.2024\n\n",
    "Mesure n° 7\nkilomètre 12\n% fin\n", "Kanal;1\nZähler\t2\nDatei, A1\n",
)  # fmt: skip
NAMES = {"x": "Weg", "z": "Höhe"}


def dialects():
    """Yield every separator with every mark before decimals that it allows, in drawn company."""
    dice = random.Random(7)
    chosen = [
        (name, decimal) for name, decimal in product(SEPARATORS, ".,") if decimal == "." or "comma" not in name
    ]  # fmt: skip
    for number in range(40):
        separator, decimal = chosen[number % len(chosen)]
        trailing = dice.random() < 0.5 and separator in ("semicolon", "tab")
        company = [dice.choice(ENCODINGS), dice.choice(HEADERS), dice.choice(PREAMBLES), trailing, dice.choice(ENDS)]
        yield pytest.param((SEPARATORS[separator], decimal, *company), id=f"{number} {separator} {decimal}")


def header(style, names, units, separator):
    """Return the header's lines; blanks between columns leave no room for those in a name."""
    between = "\t" if separator == "   " else separator
    pairs = list(zip(names, units, strict=True))
    if style == "units below":
        return [between.join(names), between.join(units)]
    if style == "units":
        return [between.join(units)]
    written = {
        "names [units]": "{} [{}]", "names (units)": "{} ({})", "names / units": "{} / {}", "names_units": "{}_{}",
        "names in units": "{} in {}",
    }[style]  # fmt: skip
    return [between.join(written.format(*pair) for pair in pairs)]


def digits(values, places):
    """Return decimal texts of numbers, made of whole numbers alone."""
    scaled = [int(v) for v in np.rint(np.asarray(values) * 10**places)]
    return [f"{'-' if n < 0 else ''}{abs(n) // 10**places}.{abs(n) % 10**places:0{places}d}" for n in scaled]


def write(path, columns, units, dialect):
    separator, decimal, encoding, style, preamble, trailing, end = dialect
    rows = [separator.join(row).replace(".", decimal) for row in zip(*columns, strict=True)]
    titles = header(style, list(NAMES.values()), units, separator)
    text = preamble + "\n".join([*titles, *(row + separator * trailing for row in rows)]) + "\n"
    path.write_bytes(text.replace("\n", end).encode(encoding))
    return path


def exact(texts, factor=Fraction(1)):
    """Return the doubles nearest to decimal numbers, times a factor; reading may round once more."""
    return np.array([float(Fraction(text) * factor) for text in texts])


def same(found, texts, factor=Fraction(1)):
    np.testing.assert_allclose(found, exact(texts, factor), rtol=3e-16, atol=0)
    if factor == 1:
        np.testing.assert_array_equal(found, exact(texts))


def measured(path, dialect):
    places, heights = np.arange(COUNT) * 0.0037, np.sin(np.arange(COUNT))
    x, z = digits(places + 0.0011, 4), digits(heights, 5)
    read = wt.Measured(path=write(path, (x, z), ("m", "mm"), dialect)).samples
    same(read[0], x)
    same(read[1], z, Fraction(1, 1000))


def out_of_round(path, dialect):
    turn, deviations = np.arange(COUNT) * (2 * pi / COUNT), np.cos(np.arange(COUNT))
    x, z = digits(turn, 6), digits(deviations, 4)
    read = wt.OutOfRound(path=write(path, (x, z), ("rad", "µm"), dialect), over="angle").samples
    same(read[0], x)
    same(read[1], z, Fraction(1, 10**6))


def profile(path, dialect, reader, shape, y):
    x, z = digits(y, 2), digits(shape(y), 7)
    found = reader(str(write(path.with_suffix(".csv"), (x, z), ("mm", "mm"), dialect)))
    np.testing.assert_allclose(found(exact(x)), exact(z), rtol=0, atol=1e-12)  # a spline through the points


def wheel(path, dialect):
    profile(path, dialect, wheel_profile, s1002, np.arange(-6000, 5800, 50) / 100)


def rail(path, dialect):
    y = np.arange(-3600, 3650, 50) / 100
    shift = float(np.interp(-14.0, rail_60e1(y)[: len(y) // 2], y[: len(y) // 2]))
    profile(path, dialect, rail_profile, rail_60e1, y[np.abs(y) < abs(shift) + 1])


def recording(path, dialect):
    steps = np.arange(COUNT)
    t, a = digits(steps / 20e3, 5), digits(3.0 * np.sin(0.37 * steps), 6)
    found = read_recording(write(path, (t, a), ("s", "m/s^2"), dialect))
    same(found.samples, a)
    assert found.rate == 20e3


@pytest.mark.parametrize("purpose", [measured, out_of_round, wheel, rail, recording])
@pytest.mark.parametrize("dialect", list(dialects()))
def test_every_dialect_is_read_exactly_for_every_purpose(tmp_path, purpose, dialect):
    purpose(tmp_path / "a.csv", dialect)


def test_decimal_commas_between_semicolons_are_no_four_columns(tmp_path):
    rows = "x [m];z [mm]\n1,5;0,01\n2,5;0,02\n3,5;0,9\n4,5;0,01\n5,5;0,0\n"
    (tmp_path / "a.csv").write_text(rows)
    x, z = wt.Measured(path=tmp_path / "a.csv").samples
    assert x.tolist() == [1.5, 2.5, 3.5, 4.5, 5.5]
    np.testing.assert_allclose(z, [1e-5, 2e-5, 9e-4, 1e-5, 0.0], rtol=1e-15)


def test_quoted_cells_may_hold_commas_between_commas(tmp_path):
    (tmp_path / "a.csv").write_text('"x [m]","z [mm]"\n"1,5","0,01"\n"2,5","0,02"\n"3,5","0,9"\n"4,5","0"\n')
    x, z = wt.Measured(path=tmp_path / "a.csv").samples
    assert x.tolist() == [1.5, 2.5, 3.5, 4.5]
    np.testing.assert_allclose(z, [1e-5, 2e-5, 9e-4, 0.0], rtol=1e-15)


def test_columns_are_chosen_by_name_header_or_number(tmp_path):
    (tmp_path / "a.csv").write_text("Nr;Weg [m];Höhe [mm]\n" + "".join(f"{i};{i},5;0,{i}\n" for i in range(6)))
    for columns in (("Weg", "Höhe"), ("weg", "Höhe [mm]"), (1, 2), ("1", "2")):
        x, z = wt.Measured(path=tmp_path / "a.csv", columns=columns).samples
        assert x.tolist() == [0.5, 1.5, 2.5, 3.5, 4.5, 5.5]
        np.testing.assert_allclose(z, 1e-4 * np.arange(6), rtol=1e-15)
    for columns, found in ((("Weg", "z"), "'z'"), ((1, 3), "3"), ((1, 1), "two columns")):
        with pytest.raises(wt.InputError, match=found) as caught:
            _ = wt.Measured(path=tmp_path / "a.csv", columns=columns).samples
        assert str(caught.value).startswith(f"{tmp_path / 'a.csv'}: columns: found ")


def test_a_moved_measurement_lies_where_it_was_moved_to(tmp_path):
    (tmp_path / "a.csv").write_text("".join(f"{i}.5 0.{i}\n" for i in range(6)))
    item = wt.Measured(path=tmp_path / "a.csv", beyond="flat")
    assert item.samples[0][0] == 0.5
    assert item.moved(2.0).samples[0].tolist() == [2.5, 3.5, 4.5, 5.5, 6.5, 7.5]

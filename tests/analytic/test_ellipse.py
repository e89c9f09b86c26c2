"""Hertz's ellipse against tables computed elsewhere."""

import numpy as np
import pytest

from wheeltapper.lower.laws.ellipse import axis_ratio_squared, contact_constant

from ..cases import reference, rows

STEEL = {"youngs_modulus": 210e9, "poisson": 0.3}


def test_reference_digits():
    for row in reference()["static"]["hertz_ellipse"]["rows"]:
        value = contact_constant(
            float(row["R_wheel"]),
            float(row["R_rail_transverse"]),
            rail_curvature=float(row["rail_long_curvature_convex"]),
            **STEEL,
        )
        assert float(value) == pytest.approx(float(row["C_per_contact"]), rel=1e-13)


@pytest.mark.parametrize(
    ("wheel", "rail", "curvature", "expected"),
    [
        (0.46, 0.3, 0.0, 9.4125e10), (0.46, 0.08, 0.0, 7.164e10), (0.46, 0.23, 0.0, 8.862e10),
        (0.46, 0.46, 0.0, 10.43e10),
        (0.46, 0.6, 0.0, 11.167e10), (0.46, 0.3, 0.78957, 8.6804e10), (0.46, 0.3, -0.78957, 10.665e10),
        (0.42, 0.3, 0.0, 9.188e10), (0.43, 0.3, 0.0, 9.245e10), (0.49, 0.3, 0.0, 9.574e10), (0.50, 0.3, 0.0, 9.626e10),
    ],
)  # fmt: skip
def test_table_of_contact_constants(wheel, rail, curvature, expected):
    assert float(contact_constant(wheel, rail, rail_curvature=curvature, **STEEL)) == pytest.approx(
        expected, rel=5e-4
    )  # four digits are printed


def test_the_axis_ratio_follows_hertzs_table():
    compared = 0
    for row in rows("hertz_theta.csv"):
        theta = np.radians(float(row["theta_deg"]))
        if theta >= np.pi / 2:
            continue  # a circle: both curvatures are equal, and the ratio's derivative is infinite
        ratio = (1 + np.cos(theta)) / (1 - np.cos(theta))
        b_over_a = float(row["n"]) / float(row["m"])
        assert float(np.sqrt(axis_ratio_squared(ratio)[0])) == pytest.approx(b_over_a, rel=1e-5)  # six digits are given
        compared += 1
    assert compared == 24


def test_a_sphere_on_a_plane_has_the_closed_form():
    modulus = 210e9 / (2 * (1 - 0.3**2))
    assert float(contact_constant(0.46, 0.46, **STEEL)) == pytest.approx(4 / 3 * modulus * np.sqrt(0.46), rel=1e-13)


@pytest.mark.parametrize("ratio", [1.0, 1 + 1e-12, 1.0001, 2.0, 50.0, 1e4, 1e8])
def test_every_ratio_is_met(ratio):
    from wheeltapper.lower.laws.ellipse import _curvature_ratio

    assert _curvature_ratio(axis_ratio_squared(ratio))[0] == pytest.approx(ratio, rel=1e-12)

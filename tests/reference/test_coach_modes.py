"""The coach's linear modes against those of other programs."""

import numpy as np
import pytest

from tests.cases import reference
from wheeltapper.describe.vehicle.element import Damper, Spring
from wheeltapper.describe.vehicle.wagon import Wagon
from wheeltapper.faces.validation.comparison import table_of
from wheeltapper.lower.structure import structure_of


def held(wagon, bodies, axles):
    """Return the wagon with other motions held."""
    return Wagon(
        bodies=tuple(body.model_copy(update={"held": bodies}) for body in wagon.bodies),
        axles=tuple(axle.model_copy(update={"held": axles}) for axle in wagon.axles),
        elements=wagon.elements,
    )


def frequencies(mass, stiffness):
    return np.sqrt(np.linalg.eigvalsh(stiffness / np.sqrt(np.outer(mass, mass)))) / (2 * np.pi)


def test_the_modes_on_fixed_wheelsets_are_those_of_another_program():
    expected = table_of("coach_modes.toml")
    wagon = held(Wagon.erri_b176(), (), ("x", "y", "z", "roll", "pitch", "yaw"))
    structure = structure_of(wagon)
    found = frequencies(structure.mass, structure.stiffness)
    assert len(found) == 18
    for name, value in expected.items():
        if name.endswith("_Hz"):
            assert np.abs(found / value - 1.0).min() < 5e-3, name
    n = len(found)
    system = np.block([
        [np.zeros((n, n)), np.eye(n)],
        [-structure.stiffness / structure.mass[:, None], -structure.damping / structure.mass[:, None]],
    ])  # fmt: skip
    roots = np.linalg.eigvals(system)
    for name, frequency in (("zeta_bounce", 1.08), ("zeta_pitch", 1.29)):
        root = roots[np.argmin(np.abs(np.abs(roots) / (2 * np.pi) - frequency))]
        assert -root.real / abs(root) == pytest.approx(expected[name], abs=1e-3)


def test_the_seventeen_vertical_modes_on_the_rails():
    expected = reference()["static"]["wagon_modes_hz"]["f"]
    plain = Wagon.erri_b176(wheelset_mass=1500.0)
    springs = []
    for element in plain.elements:
        if isinstance(element, Spring):
            upright = element.name.startswith("anti-roll")
            bending = element.bending if upright else (0.0, 0.0, 0.0)
            springs.append(element.model_copy(update={"stiffness": (0, 0, element.stiffness[2]), "bending": bending}))
    wagon = held(
        Wagon(bodies=plain.bodies, axles=plain.axles, elements=tuple(springs)), ("x", "y", "yaw"),
        ("x", "y", "pitch", "yaw"),
    )  # fmt: skip
    structure = structure_of(wagon)
    constant, arm, load = 7.025e10, 0.75, 53010.7875
    assert structure.prestress.weight / 8 == pytest.approx(load, rel=1e-12)
    contact = 1.5 * constant * (load / constant) ** (1 / 3)
    stiffness = structure.stiffness.copy()
    for number in range(1, 5):
        for side in (1, -1):
            row = structure.motion_row(f"wheelset {number}", "z") + side * arm * structure.motion_row(
                f"wheelset {number}", "roll"
            )
            stiffness += contact * np.outer(row, row)
    np.testing.assert_allclose(frequencies(structure.mass, stiffness), expected, rtol=1e-8)


def test_the_coach_has_the_motions_and_the_weight_that_it_should_have():
    wagon = Wagon.erri_b176()
    structure = structure_of(wagon)
    assert len(structure.motions) == 41
    assert wagon.mass == 44_482
    assert structure.prestress.weight / 8 == pytest.approx(54_546.05, abs=0.01)
    free = structure_of(wagon.without_dampers())
    assert not free.damping.any()
    assert not any(isinstance(element, Damper) for element in wagon.without_dampers().elements)
    with_bushes = structure_of(Wagon.erri_b176(series_springs=True))
    assert len(with_bushes.series) == 8 + 4 * 2
    # A rigid displacement or turn of all bodies strains no element, but for the turn of wheelsets in their boxes.
    centre = {name: body.position for name, body in zip(wagon.names, wagon.bodies, strict=False)}
    centre |= {f"wheelset {i + 1}": (axle.position, 0.0, axle.radius) for i, axle in enumerate(wagon.axles)}
    everywhere = Wagon(bodies=tuple(b.model_copy(update={"held": ()}) for b in wagon.bodies), axles=wagon.axles,
                       elements=wagon.elements)  # fmt: skip
    whole = structure_of(everywhere)
    for turn in np.eye(6):
        move, angle = turn[:3], turn[3:]
        q = []
        for name, motion in whole.motions:
            shift = move + np.cross(angle, centre[name])
            q.append(
                {"x": shift[0], "y": shift[1], "z": shift[2]}.get(
                    motion, dict(zip(("roll", "pitch", "yaw"), angle, strict=True)).get(motion)
                )
            )
        strained = whole.stiffness @ np.array(q)
        assert np.abs(strained).max() < 1e-6 * np.abs(whole.stiffness).max()

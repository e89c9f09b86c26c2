"""Systems of wheels on rails for the general march, and paths, without going through a scenario."""

import json
from functools import cache
from pathlib import Path

import numpy as np

import wheeltapper as wt
from wheeltapper.lower.paths.table import blank_rows
from wheeltapper.lower.track import ring as rings
from wheeltapper.lower.track.section import section_of
from wheeltapper.march.common import program as contract
from wheeltapper.march.general.contract import Bodies, Contact, Law, System
from wheeltapper.march.general.laws.switch import HERTZ

CASES = json.loads((Path(__file__).parent / "data" / "track_cases.json").read_text(encoding="utf-8"))
HERTZIAN = Law(HERTZ, np.array([9.4125e10]))
MASS, LOAD, RADIUS = 600.0, 1e5, 0.46


@cache
def ring(name, bays=80, cutoff=5e3):
    return rings.ring_of(section_of(wt.tracks.Ballasted.named(name)), bays, cutoff).ring


def level():
    """Return the path over a level rail."""
    rows = blank_rows(1)
    rows[0, [contract.START, contract.STOP]] = -np.inf, np.inf
    return rows


def wave(amplitude, length, start):
    """Return the path over a sine that begins somewhere."""
    rows = blank_rows(2)
    rows[0, [contract.START, contract.STOP]] = -np.inf, start
    rows[1, [contract.START, contract.STOP, contract.CENTRE]] = start, np.inf, start
    rows[1, [contract.SINE, contract.WAVENUMBER, contract.JOIN]] = amplitude, 2.0 * np.pi / length, contract.KINK
    return rows


def pieces_of(height, edges, kinks=()):
    """Return a path of a function's interpolants of degree 8 between edges, zero outside."""
    rows = blank_rows(len(edges) + 1)
    rows[0, [contract.START, contract.STOP]] = -np.inf, edges[0]
    rows[-1, [contract.START, contract.STOP]] = edges[-1], np.inf
    xi = np.cos(np.pi * (np.arange(9) + 0.5) / 9)
    for row, a, b in zip(rows[1:], edges[:-1], edges[1:], strict=False):
        middle, half = 0.5 * (a + b), 0.5 * (b - a)
        row[contract.COEFFICIENT : contract.COEFFICIENT + 9] = np.linalg.solve(
            np.vander(xi, increasing=True), height(middle + half * xi)
        )
        row[[contract.DEGREE, contract.START, contract.STOP]] = 8, a, b
        row[[contract.CENTRE, contract.SCALE]] = middle, half
        row[contract.JOIN] = contract.KINK if a in kinks else contract.SOFT
    return rows


def flat_height(length, middle):
    """Return the path over a fresh chord flat whose middle meets the rail somewhere, as a function."""

    def height(x):
        u = np.maximum(0.5 * length - np.abs(x - middle), 0.0)
        return -(u**2) / (RADIUS + np.sqrt(RADIUS**2 - u**2))

    return height


def flat(length, middle, pieces=4):
    """Return the path over a fresh chord flat."""
    edges = middle + np.linspace(-0.5 * length, 0.5 * length, 2 * pieces + 1)
    edges[pieces] = middle
    return pieces_of(flat_height(length, middle), edges, (middle,))


def free_wheels(count=1, mass=MASS, load=LOAD):
    """Return wheels that nothing couples."""
    one = np.eye(count)
    return Bodies(mass * one, 0.0 * one, 0.0 * one, one, np.full(count, load))


def one_wheel(pieces, speed, track=None, law=HERTZIAN, position=0.0):
    """Return one free wheel on a track."""
    return System(free_wheels(), (Contact(pieces, law, position),), speed, track)


def flat_60mm():
    """Return the wheel with a flat of 60 mm."""
    case = CASES["flat_60mm_10ms"]
    pieces = flat(case["flat_length_m"], case["flat_position_m"])
    return one_wheel(pieces, case["speed_m_s"], ring("rolland_UIC60_example"))


def two_wheels():
    """Return two wheels with a flat each; paths are over the way made, the second wheel begins 2.56 m behind."""
    contacts = Contact(flat(0.04, 3.0), HERTZIAN), Contact(flat(0.04, 3.06), HERTZIAN, -2.56)
    return System(free_wheels(2), contacts, 20.0, ring("rolland_UIC60_example"))


def bogie(wheelbase=2.56):
    """Return a half bogie: two wheels under a frame that moves down and pitches."""
    arms = np.array([[-1.0, 0.0], [0.0, -1.0], [1.0, 1.0], [0.5 * wheelbase, -0.5 * wheelbase]])
    springs = 1.2e6 * arms @ arms.T
    dampers = 2e4 * arms @ arms.T
    springs[2, 2] += 4e5
    dampers[2, 2] += 1e4
    return Bodies(
        np.diag([600.0, 600.0, 1500.0, 1200.0]), dampers, springs, np.eye(4)[:, :2], np.array([LOAD, LOAD, 0.0, 0.0])
    )

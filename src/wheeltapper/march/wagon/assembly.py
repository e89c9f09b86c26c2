"""The contract between lowering and the kernels of vehicles with many bodies: plain numbers and arrays, SI units.

Bodies stand one after the other in the state w, each with eight places for its displacements (x, y, z, roll, pitch,
yaw, two unused), then eight for its velocities; after the bodies come the displacements inside series elements, in
eights. Contacts come in octets: four wheelsets, their left wheels first, then their right ones. Behind those of treads
and flanges come voids: four sleepers, the ballast below their left halves first.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheeltapper.march.common.law_columns import PLASTIC_PIECES, YIELD_COLUMNS
from wheeltapper.march.common.program import FloatArray, IntArray

LANES = 8
HALF = 4
PLACES = 16
"""Number of places of a body in the state."""
MOTIONS = 6
MOTION_X, MOTION_Y, MOTION_Z, ROLL, PITCH, YAW = range(MOTIONS)
TO_RATE = 8
"""Distance from the place of a displacement to that of its velocity, in the state."""

# Why a march ended, beside those of one wheel: a wheel left the rails.
DERAILED = 20

# Numbers.
SPEED = 0
RUN_END = 1
STEP_TOLERANCE = 2  # of a step, relative to the scales of the state
STATIC_INDENTATION = 3  # static indentation of a wheel, m
PULSE = 4  # time, s, in which a wheelset on its contacts turns by one radian of phase
FRICTION = 5
CREEP = 6  # NO_CREEP, CURVE, STRIPS
QUASI_STATIC = 7  # 1 if the wheelsets' spin is quasi-static
FIRST_SHIFT = 8  # where the tables of the contact geometry begin, m, and how many cells they have per m
CELLS_PER_M = 9
DECK = 10  # index of the body that is a deck; -1 without
DECK_PRESTRESS = 11
MOST_EVENTS = 12
LARGEST_SHIFT = 13  # of a wheel from its middle position, m; beyond it is off the rail
STRIP_CELLS = 14  # FASTSIM: cells of a strip, strips of a diameter, bound
STRIP_COUNT = 15
STRIP_BOUND = 16
LONGEST_STEP = 17  # longest step, s
TREADS = 18  # octets of tread contacts; as many of flange contacts may follow
FLANGE_FROM = 19  # least shift of a wheel, m, at which its flange may touch
CONTACT_LAW = 20  # one of those below
MATERIAL_LOSS = 21  # χ of a lossy contact, s/m; of a law of one's own what corresponds to it at rest
YIELD_LAW = 22  # numbers of a law that yields, as `law_columns` has them, for C = 1 N/m^1.5 and δ_Y in m
OWN_WIDTH = YIELD_LAW  # or columns of a row of a law of one's own
ASSEMBLY_NUMBERS = YIELD_LAW + PLASTIC_PIECES + 1
NO_CREEP, CURVE, STRIPS = range(3)
HERTZIAN, LOSSY, STRAIGHT, PLASTIC_TREADS, PULLING, OWN_FORCE, OWN_RATED = range(7)
"""Laws of all contacts: Hertz's; Hunt and Crossley's; a linear one; an elastic-plastic one of the treads; a linear one
that also pulls, of the treads; one's own of the indentation, and of its rate as well."""
AT_LAW = ASSEMBLY_NUMBERS
"""Where the rows of a law that yields, or of one's own, begin in the flat data: behind the numbers."""

# Tables of the contact geometry: each a polynomial of degree 5 in a cell.
TABLE_LIFT, TABLE_PLACE, TABLE_RADIUS, ROOT_CONSTANT, ALONG, ACROSS, SPIN, SPIN_MOMENT, SLENDER = range(9)
TABLES = 9
TABLE_DEGREE = 5
TABLE_TERMS = TABLE_DEGREE + 1
TREAD, FLANGE, BELOW_SLEEPERS = range(3)
SATURATION_CELLS = 64

# Columns of a row of steps; the pieces of the elements follow, then the stretches of the treads' laws if they yield.
# The closed contacts are one bit each; one more bit says that the step is a macro step solved at once (`whole_steps`).
STEP_TIME, STEP_LENGTH, STEP_CLOSED, STEP_ELEMENTS = range(4)

# Numbers of the rails that give way: when the macro step began, its length in s, Gauss nodes, fours of wheelsets, and
# where the moments of the forces begin in the state, how far behind the answers of the rails together those of the
# rails against one another are, a force near a static one, and whether macro steps are solved at once if they can.
(
    RAIL_BEGAN, RAIL_SECONDS, RAIL_LONGEST, RAIL_NODES, RAIL_FOURS, RAIL_STATES, RAIL_AGAINST, RAIL_FORCE, RAIL_AT_ONCE,
) = range(9)  # fmt: skip
RAIL_NUMBERS = 9

# Columns of a corner of an element: its deflection (or rate), the force there, and the rate of the damper in series.
# Columns of a slider: its force, that at which it begins to slide, the stiffness of its spring (0: rigid), and a mark
# where the march has something to search in a step. Pieces of a slider's path: it slides towards negative or positive
# deflections, or sticks, also with the largest force to either side, while others hold it (resting.py); one that is
# LOOSE has neither rate nor force until it is decided; one that is PARTED is not pressed.
# Columns of what presses a slider: its forces back and forth over the pressing force, and those at which it begins to
# slide; the pressing force at rest, N, which grows with the states by weights; and the nonlinear element whose force it
# is, or -1. All are zero where forces are constant; else the slider's own are those at rest, or near it.
CORNER_PLACE, CORNER_FORCE, CORNER_RATE = range(3)
CORNER_COLUMNS = 3
SLIDER_FORCE, SLIDER_LIMIT, SLIDER_STIFFNESS, SLIDER_MARK = range(4)
SLIDER_COLUMNS = 4
BACK, STICKS, FORTH, FULL_BACK, FULL_FORTH, LOOSE, PARTED = range(7)
PRESSED_BACK, PRESSED_FORTH, BEGINS_BACK, BEGINS_FORTH, PRESSED_LOAD, PRESSED_BY = range(6)
PRESSED_COLUMNS = 6

# Columns of a lane: its side (+1 left, -1 right; 0 if the octet has no such wheel), the nominal radius of the wheel,
# the index of its body, the first and the last piece of its path, the piece after the last and the joint before it, and
# the times between which it is on the deck.
SIDE, NOMINAL, BODY, FIRST_PIECE, LAST_PIECE, PATH_LOOP, PATH_LOOP_JOIN, WHEEL_DECK_FROM, WHEEL_DECK_TO = range(9)
LANE_COLUMNS = 9

# Columns of a void: stiffness in N/m and damping in N·s/m of the ballast, and how far the sleeper is above it, m.
VOID_STIFFNESS, VOID_DAMPING, VOID_GAP = range(3)
VOID_COLUMNS = 3


class Assembly(NamedTuple):
    """A vehicle on its track, ready to march.

    Attributes
    ----------
    numbers
        (NUMBERS,).
    scales
        (states,): reciprocal error scale of each state.
    lanes
        (octets, LANE_COLUMNS, LANES).
    kinds
        (octets,): TREAD, FLANGE or BELOW_SLEEPERS.
    cells
        (surfaces, cells, TABLES, TERMS): contact geometry; coefficient k of the k-th power of the place in the cell.
        RADIUS is the difference to the wheel's nominal one.
    saturation
        (SATURATION_CELLS, TERMS): saturation·(1 + q) over q/(1 + q), q = F/(μ·N).
    pieces
        (pieces, PIECE_COLUMNS): all paths, over the distance travelled; FACTOR is that of C^(1/3). Where treads yield
        (pieces, MARKED_COLUMNS): FACTOR is then that of the elastic force, and RESIDUAL and BEARS tell what earlier
        wheels have left.
    spans, sources, columns
        Accelerations of body i are the sum over c in spans[i]:spans[i + 1] of columns[8·c : 8·c + 8]·w[sources[c]].
    mobility
        (bodies·LANES,): factor from the force on each motion to its acceleration.
    force_spans, force_sources, force_columns
        The same columns for forces on other motions (where links tie them), (bodies·LANES,).
    loads
        (bodies, LANES): constant forces.
    element_spans, element_index, element_weight
        The deflection of nonlinear element i is the sum over j in its span of weight[j]·w[index[j]].
        Where these are velocities, it is a rate. All sliders come after all other elements, rigid ones last.
    element_corners, corners
        Element i is piecewise linear between corners[element_corners[i]:element_corners[i + 1]], (corners, COLUMNS);
        sliders have none.
    element_inside
        (elements,): index of the state inside an element with a spring in series; -1 without.
    start
        (states,): the state at time zero.
    rails
        The first macro step of rails that give way, flat (rail_motion.py); empty where they do not.
    sliders
        (sliders, SLIDER_COLUMNS): dry friction.
    yields, thrusts
        Of rigid sliders: the acceleration of each by a unit force of each, and that of all motions, (rigid, rigid) and
        (rigid, bodies·LANES).
    law
        Pieces of the treads' elastic-plastic law, (pieces, YIELD_COLUMNS), lengths over δ_Y and forces over N_Y; or
        the rows of a law of one's own for one wheel (`contact_laws.py`). None of other laws.
    voids
        (octets of voids, VOID_COLUMNS, LANES).
    pressed, press_spans, press_index, press_weight
        What presses sliders, (sliders, PRESSED_COLUMNS), and the parts of its growth, as those of deflections of
        elements; empty where none is pressed.
    """

    numbers: FloatArray
    scales: FloatArray
    lanes: FloatArray
    kinds: IntArray
    cells: FloatArray
    saturation: FloatArray
    pieces: FloatArray
    spans: IntArray
    sources: IntArray
    columns: FloatArray
    mobility: FloatArray
    force_spans: IntArray
    force_sources: IntArray
    force_columns: FloatArray
    loads: FloatArray
    element_spans: IntArray
    element_index: IntArray
    element_weight: FloatArray
    element_corners: IntArray
    corners: FloatArray
    element_inside: IntArray
    start: FloatArray
    rails: FloatArray = np.zeros(0)
    sliders: FloatArray = np.zeros((0, SLIDER_COLUMNS))
    yields: FloatArray = np.zeros((0, 0))
    thrusts: FloatArray = np.zeros((0, 0))
    law: FloatArray = np.zeros((0, YIELD_COLUMNS))
    voids: FloatArray = np.zeros((0, VOID_COLUMNS, LANES))
    pressed: FloatArray = np.zeros((0, PRESSED_COLUMNS))
    press_spans: IntArray = np.zeros(1, dtype=np.int64)
    press_index: IntArray = np.zeros(0, dtype=np.int64)
    press_weight: FloatArray = np.zeros(0)

    @property
    def wheel_octets(self) -> int:
        """Number of octets of treads and flanges."""
        return len(self.kinds) - len(self.voids)

    @property
    def stretch_columns(self) -> int:
        """Number of columns of a step that tell the stretches of the treads' laws."""
        return int(self.numbers[TREADS]) * LANES if self.numbers[CONTACT_LAW] == PLASTIC_TREADS else 0


# Where the arrays begin in the two flat ones that the kernels read (a kernel that takes many arrays spends more time on
# counting their references than on mechanics), and how many there are of some of them. LAWS is the number of elements
# with corners, RIGID_FROM that of all but rigid sliders; AT_HOLDS is scratch memory (sliders.py), and AT_MARKS tells
# which corners an element may pass in a step. AT_OWN_MOBILITY is the mobility while rigid friction sticks, for each
# force what it does to its own motion. PIECE_WIDTH is the number of columns of a piece of a path, WHEEL_OCTETS
# that of octets before those of voids. Pieces stand last, since new ones may be longer.
(
    AT_CELLS, CELLS_EACH, AT_SATURATION, AT_PIECES, AT_COLUMNS, AT_MOBILITY, AT_FORCE_COLUMNS, AT_LOADS, AT_WEIGHTS,
    AT_CORNERS, AT_INSIDE, AT_LANES, AT_SPANS, AT_INDEX, AT_FORCE_SPANS, AT_FORCE_INDEX, AT_ELEMENT_SPANS,
    AT_ELEMENT_INDEX, AT_ELEMENT_CORNERS, AT_KINDS, BODIES, AT_RAILS, AT_SLIDERS, AT_YIELDS, AT_THRUSTS, AT_HOLDS,
    LAWS, RIGID_FROM, PIECE_WIDTH, AT_VOIDS, WHEEL_OCTETS, AT_PRESSED, AT_PRESS_SPANS, AT_PRESS_INDEX,
    AT_PRESS_WEIGHTS, AT_MARKS, AT_OWN_MOBILITY,
) = range(37)  # fmt: skip
HEADER = 37
HOLD_ROWS = 4
"""Rows of scratch memory of rigid sliders beside the matrix that is held there."""


class FlatAssembly(NamedTuple):
    """An assembly as two arrays: `data` begins with the numbers, `plan` with where everything is."""

    data: FloatArray
    plan: IntArray


def flattened_assembly(assembly: Assembly) -> FlatAssembly:
    """Return an assembly as the kernels read it."""
    data: list[FloatArray] = [assembly.numbers, assembly.law.ravel()]
    header, rigid = np.zeros(HEADER, dtype=np.int64), len(assembly.yields)
    plan: list[IntArray] = [header]
    places = {}
    floats = {
        AT_CELLS: assembly.cells, AT_SATURATION: assembly.saturation,
        AT_COLUMNS: assembly.columns, AT_MOBILITY: assembly.mobility, AT_FORCE_COLUMNS: assembly.force_columns,
        AT_LOADS: assembly.loads, AT_WEIGHTS: assembly.element_weight, AT_CORNERS: assembly.corners,
        AT_LANES: assembly.lanes, AT_SLIDERS: assembly.sliders, AT_YIELDS: assembly.yields,
        AT_THRUSTS: assembly.thrusts, AT_VOIDS: assembly.voids, AT_PRESS_WEIGHTS: assembly.press_weight,
        AT_PRESSED: assembly.pressed if len(assembly.pressed) else np.zeros((len(assembly.sliders), PRESSED_COLUMNS)),
        AT_OWN_MOBILITY: assembly.mobility, AT_MARKS: np.zeros(len(assembly.element_inside)),
        AT_HOLDS: np.full(rigid * (rigid + HOLD_ROWS), np.nan),
    }  # fmt: skip
    integers = {
        AT_SPANS: assembly.spans, AT_INDEX: assembly.sources, AT_FORCE_SPANS: assembly.force_spans,
        AT_FORCE_INDEX: assembly.force_sources, AT_ELEMENT_SPANS: assembly.element_spans,
        AT_ELEMENT_INDEX: assembly.element_index, AT_ELEMENT_CORNERS: assembly.element_corners,
        AT_KINDS: assembly.kinds, AT_INSIDE: assembly.element_inside, AT_PRESS_SPANS: assembly.press_spans,
        AT_PRESS_INDEX: assembly.press_index,
    }  # fmt: skip
    for place, array in floats.items():
        places[place] = sum(len(part) for part in data)
        data.append(array.ravel())
    for place, whole in integers.items():
        places[place] = sum(len(part) for part in plan)
        plan.append(whole.ravel())
    for place, start in places.items():
        header[place] = start
    if assembly.rails.size:
        header[AT_RAILS] = sum(len(part) for part in data)
        data.append(assembly.rails)
    header[AT_PIECES] = sum(len(part) for part in data)
    data.append(assembly.pieces.ravel())
    header[PIECE_WIDTH] = assembly.pieces.shape[1]
    header[CELLS_EACH] = assembly.cells.shape[1]
    header[BODIES] = len(assembly.spans) - 1
    header[WHEEL_OCTETS] = assembly.wheel_octets
    header[LAWS] = len(assembly.element_inside) - len(assembly.sliders)
    header[RIGID_FROM] = len(assembly.element_inside) - rigid
    return FlatAssembly(np.concatenate(data), np.concatenate(plan))


def with_paths(flat: FlatAssembly, lanes: FloatArray, pieces: FloatArray) -> FlatAssembly:
    """Return a flattened assembly, as it is now, with other paths."""
    data = np.concatenate([flat.data[: flat.plan[AT_PIECES]], pieces.ravel()])
    data[flat.plan[AT_LANES] : flat.plan[AT_LANES] + lanes.size] = lanes.ravel()
    return FlatAssembly(data, flat.plan)

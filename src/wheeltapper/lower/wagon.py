"""From a scenario with a wagon to an assembly: bodies, elements, contacts and paths as plain numbers."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.contact.elastic_plastic import ElasticPlastic
from wheeltapper.describe.contact.force_law import ForceLaw
from wheeltapper.describe.contact.linear import Linear
from wheeltapper.describe.creep import Fastsim
from wheeltapper.describe.profile.wheel_rail import Cones
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.track.deck import FloatingDeck
from wheeltapper.describe.vehicle.body import MOTIONS
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note
from wheeltapper.lower.build import path_table
from wheeltapper.lower.known import check_known
from wheeltapper.lower.laws.ellipse import contact_constant
from wheeltapper.lower.laws.own_law import flat_law, indentation_under, loss_at, table_note
from wheeltapper.lower.laws.patches import (
    WIDTH,
    Surface,
    cells_of,
    elastic_of,
    flange_from,
    geometry_of,
    patch_tables,
    saturation_cells,
)
from wheeltapper.lower.lowered.base import DECK
from wheeltapper.lower.lowered.wagon import LoweredWagon, StateLayout
from wheeltapper.lower.numbers import METHODS, Method
from wheeltapper.lower.paths.table import PathTable
from wheeltapper.lower.plausible import doubts
from wheeltapper.lower.standing import level_assembly, normal_forces, standing_on, steady_state
from wheeltapper.lower.structure import Characteristic, SeriesDamper, Structure, structure_of
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.assembly import HALF, LANES, PLACES, TO_RATE, Assembly
from wheeltapper.march.wagon.columns import packed_columns
from wheeltapper.march.wagon.fastsim import ELLIPTIC, PARABOLIC

if TYPE_CHECKING:
    from wheeltapper.lower.marks.wagon_marks import WagonRails, WornRails

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
TOLERANCES = {"default": 1e-7, "strict": 3e-11}
"""Tolerance of a step of each method, relative to the scales of the state."""
EVENT_LIMIT = 1_000_000
"""Largest number of events of a march; a march with more is ended, and its outcome says so."""
LONGEST = 2e-3
"""Longest step, s."""
MOST_AXLES = 12
"""Largest number of wheelsets. Twelve of them have 48 contacts, with treads and flanges; the open and closed ones are
stored as the bits of one floating-point number, which is exact up to 53 bits."""


def _mobility_matrix(structure: Structure, held: NDArray[np.bool_]) -> FloatArray:
    """Return accelerations from forces, with the ties and the held motions at rest."""
    count = len(structure.motions)
    ties = np.vstack([structure.ties, np.eye(count)[held]])
    _, sizes, rows = np.linalg.svd(ties) if len(ties) else (None, np.zeros(0), np.eye(count))
    free = rows[int((sizes > 1e-12).sum()) :].T
    if len(structure.ties) == 0:
        free = np.eye(count)[:, ~held]
    return np.asarray(free @ np.linalg.inv(free.T @ (structure.mass[:, None] * free)) @ free.T)


def _sparse_columns(
    matrix: FloatArray, target: IntArray, source: IntArray, layout: StateLayout
) -> tuple[Any, Any, FloatArray]:
    """Return the nonzero part of a matrix as columns of eight rows, by bodies.

    `target` are the positions of the rows, in bodies of LANES rows; `source` those of the factors.
    """
    spans, index, held = [0], list[int](), list[FloatArray]()
    for body in range(len(layout.bodies)):
        rows = np.flatnonzero(target // LANES == body)
        columns = []
        for j in np.flatnonzero(np.any(matrix[rows] != 0.0, axis=0)):
            column = np.zeros(LANES)
            column[target[rows] % LANES] = matrix[rows, j]
            columns.append((int(source[j]), column))
        places, filled = packed_columns(columns)
        index += places
        held += filled
        spans.append(len(index))
    return np.array(spans, dtype=np.int64), np.array(index, dtype=np.int64), np.concatenate([np.zeros(0), *held])


def _element_arrays(structure: Structure, layout: StateLayout, mobility: FloatArray) -> tuple[dict[str, Any], int]:
    """Return the arrays of all elements that are not linear, and the number of states inside them."""
    spans, index, weight, corner_spans = [0], list[int](), list[float](), [0]
    corners, inside = list[FloatArray](), list[int]()
    places, own = layout.displacement_places, layout.state_count
    laws: list[tuple[FloatArray, bool, FloatArray | None]]
    laws = [(item.row, item.of_rate, _corners_of(item)) for item in structure.characteristics]
    laws += [(item.row, False, _series_corners(item)) for item in structure.series]
    laws += [(item.row, item.stiffness is None, None) for item in structure.sliders]
    springs = [False] * len(structure.characteristics) + [True] * len(structure.series)
    springs += [item.stiffness is not None for item in structure.sliders]
    for (row, of_rate, law), has_state in zip(laws, springs, strict=True):
        used = np.flatnonzero(row)
        index += list(places[used] + TO_RATE * of_rate)
        weight += list(row[used])
        inside.append(own + sum(springs[: len(inside)]) if has_state else -1)
        if has_state:
            index.append(inside[-1])
            weight.append(-1.0)
        spans.append(len(index))
        if law is not None:
            corners.append(law)
            corner_spans.append(corner_spans[-1] + len(law))
    integers = {"element_spans": spans, "element_index": index, "element_corners": corner_spans}
    out: dict[str, Any] = {name: np.array(values, dtype=np.int64) for name, values in integers.items()}
    out["element_weight"] = np.array(weight, dtype=float)
    out["corners"] = np.vstack([np.zeros((0, asm.CORNER_COLUMNS)), *corners])
    out["element_inside"] = np.array(inside, dtype=np.int64)
    numbers = [[item.force, item.limit, item.stiffness or 0.0, 0.0] for item in structure.sliders]
    out["sliders"] = np.array(numbers).reshape(-1, asm.SLIDER_COLUMNS)
    out |= _pressing_arrays(structure, layout)
    rows = np.zeros((0, len(places)))
    rigid = [np.pad(item.row, (0, len(places) - len(item.row))) for item in structure.sliders if item.stiffness is None]
    rows = np.vstack([rows, *rigid])
    out["yields"] = rows @ mobility @ rows.T
    out["thrusts"] = np.zeros((len(rows), len(layout.bodies) * LANES))
    out["thrusts"][:, places // PLACES * LANES + places % PLACES] = rows @ mobility
    return out, sum(springs)


def _pressing_arrays(structure: Structure, layout: StateLayout) -> dict[str, Any]:
    """Return the arrays of what presses sliders; none where nothing does."""
    if not any(item.pressing for item in structure.sliders):
        return {}
    numbers, spans, index, weight = list[list[float]](), [0], list[int](), list[float]()
    for item in structure.sliders:
        row = np.zeros(len(structure.motions)) if item.pressing is None else item.pressing.row
        used = np.flatnonzero(row)
        index += list(layout.displacement_places[used])
        weight += list(row[used])
        spans.append(len(index))
        pressing = item.pressing
        if pressing is None:
            numbers.append([0.0, 0.0, 0.0, 0.0, 0.0, -1.0])
        else:
            by = -1.0 if pressing.by is None else float(pressing.by)
            numbers.append([*pressing.slides, *pressing.begins, pressing.load, by])
    integers = {"press_spans": spans, "press_index": index}
    out: dict[str, Any] = {name: np.array(values, dtype=np.int64) for name, values in integers.items()}
    return out | {"pressed": np.array(numbers), "press_weight": np.array(weight, dtype=float)}


def _corners_of(item: Characteristic) -> FloatArray:
    """Return the corners of a characteristic; of one that ends at its last corner one far behind it."""
    if not item.one_way:
        return _both_sides(item.deflection, item.force)
    corners = np.column_stack([item.deflection, item.force, np.zeros(len(item.force))])
    return np.vstack([corners, corners[-1] + [1e3, 0.0, 0.0]])


def _series_corners(damper: SeriesDamper) -> FloatArray:
    """Return the corners of the spring of a series damper over its deflection: its force, and the damper's rate."""
    half = 0.5 * damper.free_play
    both = _both_sides(damper.rate, damper.force)
    rate, force = both[1:-1, 0], both[1:-1, 1]
    rows = np.column_stack([force / damper.stiffness + half * np.sign(force), force, rate])
    if half > 0.0:
        rows = rows[force != 0.0]
        rows = np.insert(rows, int((rows[:, 0] < 0.0).sum()), [[-half, 0.0, 0.0], [half, 0.0, 0.0]], axis=0)
    return _extended(rows)


def _both_sides(place: FloatArray, force: FloatArray) -> FloatArray:
    """Return the corners (place, force, 0) of a characteristic; an odd one, which begins at zero, has none there."""
    if place[0] == 0.0:
        place, force = (np.concatenate([-half[:0:-1], half[1:]]) for half in (place, force))
    return _extended(np.column_stack([place, force, np.zeros(len(place))]))


def _extended(corners: FloatArray) -> FloatArray:
    """Return corners continued straight, by 1 km or 1 km/s beyond the outermost ones."""
    first, last = (
        end + (end - beside) * (1e3 / abs(end[0] - beside[0]))
        for end, beside in ((corners[0], corners[1]), (corners[-1], corners[-2]))
    )
    return np.vstack([first, corners, last])


def layout_of(scenario: Scenario, structure: Structure) -> StateLayout:
    """Return the layout of the state of a scenario."""
    names = scenario.vehicle.names
    if not isinstance(scenario.track, FloatingDeck):
        return StateLayout(names, structure.motions)
    return StateLayout((*names, DECK), (*structure.motions, (DECK, "z")))


def lower_wagon(
    scenario: Scenario, method: str = "default", worn: WornRails | None = None,
    friction_at: tuple[float, float] | None = None,
) -> LoweredWagon:  # fmt: skip
    """Lower a scenario with a wagon to an assembly, without its start; `worn`: rails with marks of others.

    `friction_at`: with friction replaced by its equivalent at this amplitude, m, and frequency, Hz.
    """
    check_known(scenario)
    wagon, chosen = scenario.vehicle, METHODS[method]
    if len(wagon.axles) > MOST_AXLES:
        raise InputError("", "vehicle.axles", f"{len(wagon.axles)} wheelsets", f"{MOST_AXLES} at most")
    structure = structure_of(wagon)
    if friction_at is not None:
        structure = structure.with_equivalent_friction(*friction_at)
    loads = structure.prestress.loads
    wheelsets = [f"wheelset {i + 1}" for i in range(len(wagon.axles))]
    per_wheelset = np.array([-loads @ structure.motion_row(name, "z") for name in wheelsets])
    if np.any(per_wheelset <= 0.0):
        worst = int(np.argmin(per_wheelset))
        raise InputError(
            "", "vehicle", f"a static load of {per_wheelset[worst]:.6g} N on {wheelsets[worst]}", "wheelsets that carry"
        )
    deck = isinstance(scenario.track, FloatingDeck)
    spinning = scenario.creep is not None and scenario.creep.wheel_spin == "full"
    held = np.array([motion == "pitch" and body in wheelsets and not spinning for body, motion in structure.motions])
    mobility = _mobility_matrix(structure, held)
    layout = layout_of(scenario, structure)
    stiffness, damping, resting = structure.stiffness, structure.damping, loads
    if deck:
        mobility, stiffness, damping, resting = _with_deck(scenario.track, mobility, stiffness, damping, loads)
    motion = np.hstack([-mobility @ stiffness, -mobility @ damping])
    rows = layout.displacement_places // PLACES * LANES + layout.displacement_places % PLACES
    spans, sources, columns = _sparse_columns(
        motion, rows, np.append(layout.displacement_places, layout.displacement_places + TO_RATE), layout
    )
    others = mobility - np.diag(np.diag(mobility))
    force_spans, force_sources, force_columns = _sparse_columns(others, rows, rows, layout)
    own = np.zeros(len(layout.bodies) * LANES)
    own[rows] = np.diag(mobility)
    elements, inside = _element_arrays(replace(structure, sliders=()), layout, mobility)
    lanes, pieces, notes, paths = _tread_lanes(scenario, layout, wheelsets, chosen)
    held_loads = np.zeros((len(layout.bodies), LANES))
    for value, (body, name) in zip(resting, layout.motions, strict=True):
        held_loads[layout.bodies.index(body), MOTIONS.index(name)] = value
    radius = wagon.axles[0].radius
    shifts = geometry_of(scenario.profiles, radius, elastic_of(scenario.contact).rail_radius).shift
    surfaces: tuple[Surface, ...] = ("tread",) if isinstance(scenario.profiles, Cones) else ("tread", "flange")
    patches = [patch_tables(scenario.profiles, scenario.contact, radius, surface) for surface in surfaces]
    cells = np.array([cells_of(shifts, patch) for patch in patches])
    middle = float(patches[0][asm.ROOT_CONSTANT, len(shifts) // 2] ** 3)
    force = 0.5 * float(per_wheelset.max())
    numbers = _assembly_numbers(scenario, TOLERANCES[method], force, middle, layout)
    numbers[asm.TREADS] = len(lanes)
    if len(surfaces) > 1:
        numbers[asm.FLANGE_FROM] = flange_from(scenario.profiles, radius)
        lanes = np.concatenate([lanes, lanes])
    kinds = np.repeat(np.arange(len(surfaces)), len(lanes) // len(surfaces))
    indentation, pulse = numbers[asm.STATIC_INDENTATION], numbers[asm.PULSE]
    states = layout.state_count + LANES * -(-inside // LANES)
    assembly = Assembly(
        numbers=numbers, scales=_error_scales(structure, layout, states, indentation, pulse), lanes=lanes, kinds=kinds,
        cells=cells, saturation=_saturation_curve(scenario), pieces=pieces, spans=spans,
        sources=sources, columns=columns, mobility=own, force_spans=force_spans, force_sources=force_sources,
        force_columns=force_columns, loads=held_loads.ravel(), start=np.zeros(states), **elements,
    )  # fmt: skip
    if isinstance(scenario.contact, ElasticPlastic):
        from wheeltapper.lower.marks.wagon_marks import remembered, yielding_treads

        heaviest = float(per_wheelset.max()) if worn is None else worn.heaviest
        assembly = yielding_treads(assembly, scenario.contact, middle, heaviest)
    if isinstance(scenario.contact, ForceLaw):
        table_rows, table = flat_law(scenario.contact)
        numbers[asm.OWN_WIDTH] = table_rows.shape[1]
        assembly, middle = assembly._replace(law=table_rows), 0.5 * table.constant
        notes = (*notes, table_note(table.error))
    even = level_assembly(assembly, layout)
    resting_state = steady_state(even, layout, mobility)
    static = normal_forces(even, resting_state, len(wheelsets))
    numbers[asm.DECK_PRESTRESS] = static[_prestressing(scenario)].sum()
    positions = tuple(axle.position for axle in wagon.axles)
    memory: WagonRails | None = None
    said = (*doubts(scenario), *notes)
    if isinstance(scenario.contact, ElasticPlastic):
        memory, more = remembered(scenario, assembly, paths, float(static[0].mean()), worn)
        said = (*said, *more)
    if memory is not None:
        lanes, pieces = memory.begin().paths()
        assembly = assembly._replace(lanes=lanes, pieces=pieces)
    start = standing_on(assembly._replace(start=resting_state), layout, mobility, positions)
    assembly = _with_sliders(assembly._replace(start=start), structure, layout, mobility, inside)
    return LoweredWagon(scenario, assembly, layout, structure, static, middle, said, memory=memory)


def started(lowered: LoweredWagon, scenario: Scenario) -> LoweredWagon:
    """Return a wagon, which stands, with its wheelsets where they start, and as fast."""
    if isinstance(scenario.start, str):
        return lowered
    structure, assembly = lowered.structure, lowered.assembly
    begin = assembly.start.copy()
    deck = int(assembly.numbers[asm.DECK])
    sunk = float(begin[deck * PLACES + asm.MOTION_Z]) if deck >= 0 else 0.0  # there a wheel first touches it
    for number in range(1, len(scenario.vehicle.axles) + 1):
        name = f"wheelset {number}"
        if (name, "z") not in structure.motions or structure.ties[:, structure.motions.index((name, "z"))].any():
            raise InputError("", "start", f"a start of {name}, which a link or `held` ties", '"equilibrium"')
        place = lowered.layout.bodies.index(name) * PLACES + asm.MOTION_Z
        begin[place], begin[place + TO_RATE] = sunk + scenario.start.displacement, scenario.start.velocity
    if scenario.start.velocity and len(assembly.yields):
        found = "a velocity against dry friction without a spring, which sticks"
        raise InputError("", "start.velocity", found, "0 m/s, or a stiffness of that friction")
    return lowered.with_assembly(assembly._replace(start=begin))


def _with_sliders(
    assembly: Assembly, structure: Structure, layout: StateLayout, mobility: FloatArray, inside: int
) -> Assembly:
    """Return the assembly, which stands, with its dry friction; it sticks without a force."""
    if not structure.sliders:
        return assembly
    elements, more = _element_arrays(structure, layout, mobility)
    states = layout.state_count + LANES * -(-more // LANES)
    start, scales = (np.append(held, np.zeros(states - len(held))) for held in (assembly.start, assembly.scales))
    scales[layout.state_count :] = 1.0 / assembly.numbers[asm.STATIC_INDENTATION]
    q = start[layout.displacement_places[: len(structure.motions)]]
    springs = [item.row @ q for item in structure.sliders if item.stiffness is not None]
    start[layout.state_count + inside : layout.state_count + more] = springs
    return assembly._replace(start=start, scales=scales, **elements)


def _with_deck(
    deck: FloatingDeck, mobility: FloatArray, stiffness: FloatArray, damping: FloatArray, loads: FloatArray
) -> tuple[FloatArray, ...]:
    """Return the matrices with a deck as the last motion."""
    count = len(loads)
    out = []
    for matrix, value in ((mobility, 1.0 / deck.mass), (stiffness, deck.stiffness), (damping, deck.damping)):
        larger = np.zeros((count + 1, count + 1))
        larger[:count, :count] = matrix
        larger[count, count] = value
        out.append(larger)
    return (*out, np.append(loads, 0.0))


def _assembly_numbers(
    scenario: Scenario, tolerance: float, force: float, constant: float, layout: StateLayout
) -> FloatArray:
    wagon, creep = scenario.vehicle, scenario.creep
    exponent = 1.0 if isinstance(scenario.contact, Linear) else getattr(scenario.contact, "exponent", 1.5)
    if isinstance(scenario.contact, ForceLaw):
        indentation = indentation_under(scenario.contact, 2.0 * force)
    else:
        indentation = (force / constant) ** (1.0 / exponent)
    lightest = min(axle.mass for axle in wagon.axles)
    out = np.zeros(asm.ASSEMBLY_NUMBERS)
    out[asm.SPEED] = scenario.speed
    out[asm.RUN_END] = scenario.duration
    out[asm.STEP_TOLERANCE] = tolerance
    out[asm.STATIC_INDENTATION] = indentation
    out[asm.PULSE] = np.sqrt(0.5 * lightest * indentation / (exponent * force))
    out[asm.CREEP] = asm.NO_CREEP
    if creep is not None:
        out[asm.FRICTION] = creep.friction
        out[asm.CREEP] = asm.STRIPS if isinstance(creep, Fastsim) else asm.CURVE
        out[asm.QUASI_STATIC] = creep.wheel_spin == "quasi-static"
    if isinstance(creep, Fastsim):
        out[asm.STRIP_CELLS], out[asm.STRIP_COUNT] = creep.cells, creep.strips
        out[asm.STRIP_BOUND] = PARABOLIC if creep.bound == "parabolic" else ELLIPTIC
    shifts = geometry_of(scenario.profiles, wagon.axles[0].radius, elastic_of(scenario.contact).rail_radius).shift
    out[asm.FIRST_SHIFT] = shifts[0]
    out[asm.CELLS_PER_M] = (len(shifts) - 1) / (shifts[-1] - shifts[0])
    out[asm.DECK] = layout.bodies.index(DECK) if DECK in layout.bodies else -1
    out[asm.MOST_EVENTS] = EVENT_LIMIT
    out[asm.LARGEST_SHIFT] = WIDTH
    out[asm.LONGEST_STEP] = LONGEST
    out[asm.CONTACT_LAW], out[asm.MATERIAL_LOSS] = law_numbers(scenario)
    if out[asm.CONTACT_LAW] == asm.OWN_RATED:
        out[asm.MATERIAL_LOSS] = loss_at(scenario.contact, indentation)
    return out


def law_numbers(scenario: Scenario) -> tuple[int, float]:
    """Return the law of all contacts, and its factor of hysteresis, s/m."""
    if isinstance(scenario.contact, Linear):
        return asm.PULLING if scenario.contact.bilateral else asm.STRAIGHT, 0.0
    if isinstance(scenario.contact, ForceLaw):
        return asm.OWN_RATED if scenario.contact.takes_rate else asm.OWN_FORCE, 0.0
    if isinstance(scenario.contact, ElasticPlastic):
        return asm.PLASTIC_TREADS, 0.0
    loss = float(scenario.contact.hysteresis_factor)
    return (asm.LOSSY if loss else asm.HERTZIAN), loss


def _error_scales(
    structure: Structure, layout: StateLayout, states: int, indentation: float, pulse: float
) -> FloatArray:
    """Return the reciprocal error scale of each state: the indentation for lengths, that over an arm for angles."""
    out = np.zeros(states)
    heavy = {
        body: mass for (body, motion), mass in zip(structure.motions, structure.mass, strict=True) if motion == "z"
    }
    for place, (body, motion), mass in zip(
        layout.displacement_places, layout.motions, np.append(structure.mass, 1.0), strict=False
    ):
        arm = np.sqrt(mass / heavy[body]) if motion in MOTIONS[3:] and body in heavy else 1.0
        out[place] = arm / indentation
        out[place + TO_RATE] = out[place] * pulse
    out[layout.state_count :] = 1.0 / indentation
    return out


def _saturation_curve(scenario: Scenario) -> FloatArray:
    creep = scenario.creep
    if creep is None or isinstance(creep, Fastsim):
        return np.zeros((asm.SATURATION_CELLS, asm.TABLE_TERMS))
    return saturation_cells(creep)


def _root_constant_factor(scenario: Scenario, radius: float) -> Any:
    """Return the factor on C^(1/3) as a function of the irregularity's second derivative; None if C is constant."""
    contact = scenario.contact
    if isinstance(contact, Linear | ElasticPlastic | ForceLaw) or not contact.follows_curvature:
        return None
    geometry = geometry_of(scenario.profiles, radius, contact.rail_radius)
    crown = 0.5 / geometry.curvature[len(geometry.shift) // 2]

    def constant_at(kappa: FloatArray) -> FloatArray:
        return contact_constant(radius, crown, contact.youngs_modulus, contact.poisson, kappa)

    smooth = constant_at(np.zeros(1))[0]
    return lambda second: np.cbrt(constant_at(-np.asarray(second)) / smooth)


def _tread_lanes(
    scenario: Scenario, layout: StateLayout, wheelsets: list[str], method: Method
) -> tuple[FloatArray, FloatArray, tuple[Note, ...], tuple[tuple[PathTable, PathTable], ...]]:
    """Return the lanes of the treads' contacts, all paths, notes on them, and the paths' tables by wheelset."""
    wagon = scenario.vehicle
    octets = -(-len(wheelsets) // HALF)
    lanes = np.zeros((octets, asm.LANE_COLUMNS, LANES))
    pieces: list[FloatArray] = []
    count = 0
    held: dict[Any, tuple[PathTable, int]] = {}
    notes: list[Note] = []
    tables: list[PathTable] = []
    end = float(scenario.speed * scenario.duration)
    for number, (name, axle) in enumerate(zip(wheelsets, wagon.axles, strict=True), 1):
        for side, sign in (("left", 1.0), ("right", -1.0)):
            items = scenario.irregularities_on(number, side)
            key = (items, axle.position if items else 0.0, axle.radius)
            if key not in held:
                courses = [item.course(axle.radius).moved(-axle.position) for item in items]
                table, said = path_table(
                    courses, end, method, scenario.rolling, axle.radius, _root_constant_factor(scenario, axle.radius)
                )
                held[key] = table, count
                pieces.append(table.rows)
                count += len(table.rows)
                where = f"{name} {side}" + (f", x from {axle.position:g} m" if axle.position else "")
                notes += [note.reworded(f"{where}: {note}") for note in said]
            table, first = held[key]
            tables.append(table)
            octet, lane = (number - 1) // HALF, (number - 1) % HALF + (0 if side == "left" else HALF)
            lanes[octet, :, lane] = _wheel_lane(sign, axle.radius, layout.bodies.index(name), table, first)
            lanes[octet, [asm.WHEEL_DECK_FROM, asm.WHEEL_DECK_TO], lane] = _on_deck(scenario, number, axle.position)
    return lanes, np.vstack(pieces), tuple(notes), tuple(zip(tables[::2], tables[1::2], strict=True))


def _wheel_lane(sign: float, radius: float, body: int, table: PathTable, first: int) -> list[float]:
    out = [0.0] * asm.LANE_COLUMNS
    out[asm.SIDE], out[asm.NOMINAL], out[asm.BODY] = sign, radius, body
    out[asm.FIRST_PIECE], out[asm.LAST_PIECE] = first, first + len(table.rows) - 1
    out[asm.PATH_LOOP], out[asm.PATH_LOOP_JOIN] = first + table.loop, table.loop_join
    return out


def _prestressing(scenario: Scenario) -> slice:
    """Return the wheelsets whose static forces prestress the deck: all where each is always on it, otherwise one."""
    deck = scenario.track
    if isinstance(deck, FloatingDeck) and deck.start is None and deck.wheelset is None:
        return slice(None)
    first = deck.wheelset - 1 if isinstance(deck, FloatingDeck) and deck.wheelset is not None else 0
    return slice(first, first + 1)


def _on_deck(scenario: Scenario, number: int, position: float) -> tuple[float, float]:
    """Return the times at which a wheelset enters and leaves the deck."""
    deck = scenario.track
    if not isinstance(deck, FloatingDeck) or deck.wheelset not in (None, number):
        return inf, inf
    if deck.start is None:
        return -inf, inf
    if scenario.speed == 0.0:
        return (-inf if deck.start <= position else inf), inf
    enters = (deck.start - position) / scenario.speed
    return enters, (inf if deck.length is None else enters + deck.length / scenario.speed)

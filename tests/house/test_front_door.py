"""The front door: what `import wheeltapper` offers, and what it must not load."""

import runpy
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import wheeltapper as wt
from wheeltapper.describe.irregularity.base import Irregularity
from wheeltapper.describe.registry import makeable_nouns
from wheeltapper.describe.track.base import Track

ROOT = Path(__file__).parents[2]
NAMES = [
    "Corrugation",
    "CosineBump",
    "FloatingDeck",
    "Hertz",
    "InputError",
    "Linear",
    "Measured",
    "OutOfRound",
    "Profile",
    "Record",
    "Repeated",
    "Scenario",
    "Step",
    "StiffTrack",
    "Wagon",
    "WheelFlat",
    "Wheelset",
    "__version__",
    "border",
    "contact",
    "creep",
    "design_site",
    "diagnose",
    "diagnosis",
    "features",
    "gradient",
    "irregularities",
    "limits",
    "load",
    "modes",
    "orbits",
    "plot",
    "profiles",
    "read_recording",
    "reduced",
    "sensors",
    "show",
    "simulate",
    "stability",
    "sweep",
    "synthesise",
    "tracks",
    "vehicles",
    "wear",
    "wear_in",
]
ROOMS = {
    "contact",
    "creep",
    "diagnosis",
    "features",
    "irregularities",
    "limits",
    "orbits",
    "profiles",
    "sensors",
    "show",
    "stability",
    "tracks",
    "vehicles",
    "wear",
}
"""Modules, which are no names of functions or classes."""
HEAVY = {"numba", "xarray", "matplotlib", "scipy", "pint", "pandas", "h5netcdf"}


def loaded_by(statement: str) -> set[str]:
    code = f"import sys\n{statement}\nprint(*{{name.partition('.')[0] for name in sys.modules}})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_the_public_names_are_these_and_at_most_thirty() -> None:
    assert sorted(wt.__all__) == NAMES
    assert len(set(NAMES) - ROOMS - {"__version__"}) <= 30


@pytest.mark.parametrize("name", NAMES)
def test_each_name_is_there(name: str) -> None:
    assert getattr(wt, name) is not None


@pytest.mark.parametrize("name", NAMES)
def test_each_name_is_listed(name: str) -> None:
    assert name in dir(wt)


@pytest.mark.parametrize("name", [name for name in NAMES if name[0].isalpha()])
def test_each_name_is_documented(name: str) -> None:
    text = getattr(wt, name).__doc__
    assert text
    assert text.strip()


@pytest.mark.parametrize("name", sorted(ROOMS))
def test_a_room_offers_its_public_names_only(name: str) -> None:
    room = getattr(wt, name)
    assert dir(room) == sorted(room.__all__)
    for offered in dir(room):
        assert not offered.startswith("_")
        assert not isinstance(getattr(room, offered), ModuleType)
        assert getattr(getattr(room, offered), "__module__", "wheeltapper").startswith("wheeltapper")


def test_every_irregularity_and_every_track_that_a_scenario_takes_is_in_its_room() -> None:
    for room, family in ((wt.irregularities, Irregularity), (wt.tracks, Track)):
        for kind in makeable_nouns(family):
            assert getattr(room, kind.__name__) is kind
            assert kind.__name__ in dir(room)


def test_editors_read_of_each_room_what_it_offers() -> None:
    tool = runpy.run_path(str(ROOT / "tools" / "rooms.py"))
    rooms = tool["rooms"]()
    assert len(rooms) == 8
    for room, path in rooms.items():
        assert path.read_text(encoding="utf-8") == tool["written"](room), "uv run python tools/rooms.py writes it"


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="Whellset"):
        wt.Whellset  # noqa: B018


def test_importing_the_package_loads_nothing_heavy() -> None:
    assert not loaded_by("import wheeltapper") & HEAVY


def test_describing_a_scenario_loads_nothing_heavy() -> None:
    statement = (
        "import wheeltapper as wt; "
        "wt.Scenario(vehicle=wt.Wheelset(mass=1500, load=91307, stiffness=2.44e6, damping=2e4, radius=0.46), "
        "track=wt.StiffTrack(), contact=wt.Hertz(constant=1.405e11), speed=5.0, duration=0.5)"
    )
    assert not loaded_by(statement) & HEAVY


def test_the_command_line_loads_nothing_heavy() -> None:
    assert not loaded_by("import wheeltapper.faces.cli") & HEAVY

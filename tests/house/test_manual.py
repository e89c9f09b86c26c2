"""What help() and editors show of a noun: its fields, each described, and nothing of how they are checked."""

import inspect
import pydoc
import tomllib
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

import wheeltapper as wt
from wheeltapper.describe.manual import HEADING, field_descriptions
from wheeltapper.describe.noun import Noun, nouns_by_name
from wheeltapper.describe.registry import makeable_nouns
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.schema import json_schema
from wheeltapper.describe.site import Site
from wheeltapper.describe.track.base import Track
from wheeltapper.describe.vehicle.base import Vehicle
from wheeltapper.diagnosis.dataset.plan import DatasetPlan

KINDS = {name: kind for name, kind in nouns_by_name().items() if kind.__module__.startswith("wheeltapper.")}


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_every_field_is_described_in_the_docstring(kind: type[Noun]) -> None:
    words = field_descriptions(kind)
    assert [name for name in kind.model_fields if len(words.get(name, "")) < 2] == []
    assert set(words) == set(kind.model_fields)
    assert (kind.__doc__ or "").count(HEADING) == bool(kind.model_fields)


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_help_shows_what_may_be_given_and_nothing_of_validation(kind: type[Noun]) -> None:
    page = pydoc.render_doc(kind, renderer=pydoc.plaintext)
    for word in ("Annotated", "Validator", "pydantic_", "model_config", "Discriminator", "FieldInfo", "Tag("):
        assert word not in page
    assert len(page.splitlines()) < 150
    assert list(inspect.signature(kind).parameters) == list(kind.model_fields)


def test_signatures_read_as_one_would_write_them() -> None:
    page = pydoc.render_doc(wt.Wheelset, renderer=pydoc.plaintext)
    assert "mass: float | str, load: float | str = 0.0" in page
    assert "bush_stiffness: float | str | None = None" in page
    vehicles, tracks = (" | ".join(kind.__name__ for kind in makeable_nouns(family)) for family in (Vehicle, Track))
    assert {"Wagon", "Wheelset"} <= set(vehicles.split(" | "))
    assert f"vehicle: {vehicles}, track: {tracks} = StiffTrack()" in str(inspect.signature(Scenario))
    assert "rolling: Literal['circle', 'point'] = 'circle'" in str(inspect.signature(Scenario))
    assert "inertia: tuple[float | str, float | str, float | str]" in str(inspect.signature(wt.vehicles.Body))
    assert "function: Callable[..., Any]" in str(inspect.signature(wt.Profile))


def test_completion_offers_fields_and_methods_only() -> None:
    wheelset = wt.Wheelset(mass=1500)
    offered = {"damper_end", "loads", "needs", "plane", "plot", "suspensions", "weight", "words"}
    assert set(dir(wt.Wheelset)) == offered
    assert set(dir(wheelset)) == {*offered, *wt.Wheelset.model_fields}
    assert {"from_toml", "to_toml", "replaced", "irregularities"} <= set(dir(wt.Scenario))


@pytest.mark.parametrize("of", [Scenario, Site, DatasetPlan])
def test_the_schema_describes_every_field(of: type[Noun]) -> None:
    schema = json_schema(of)
    for table in (schema, *schema["$defs"].values()):
        assert "Parameters" not in table["description"]
        for name, field in table.get("properties", {}).items():  # a choice of kinds has none
            assert name in ("type", "format") or field["description"], name
    assert schema["$defs"]["Spring"]["properties"]["between"]["description"].startswith("What it connects")


def test_the_schema_of_a_data_set_takes_the_example_and_refuses_what_no_plan_has() -> None:
    given = tomllib.loads(Path("examples/flats_dataset.toml").read_text(encoding="utf-8"))
    sensor = given["sensor"][0]
    schema = Draft202012Validator(json_schema(DatasetPlan))
    for right in (given, given | {"scenario": "bump.toml"}, given | {"sensor": sensor}):
        schema.validate(right)
    nothing = {name: held for name, held in given.items() if name != "sensor"}
    for wrong in (given | {"cuont": 3}, nothing, given | {"sensor": [sensor | {"raet": 1}]}):
        assert not schema.is_valid(wrong)


def test_every_kind_that_a_file_may_name_is_in_a_room_or_at_the_front_door() -> None:
    rooms = (wt, wt.contact, wt.creep, wt.irregularities, wt.profiles, wt.sensors, wt.tracks, wt.vehicles, wt.diagnosis)
    offered = {name for room in rooms for name in dir(room)}
    assert set(KINDS) - offered == {"Start", "FaultShare"}  # which a file need not name

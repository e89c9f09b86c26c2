"""Whatever stands in a study's file is a study, or is refused in one line that names the file."""

import copy
import tomllib
from pathlib import Path

import numpy as np
import pytest
import tomli_w

import wheeltapper as wt
from wheeltapper.ask import spec
from wheeltapper.ask.store import Store
from wheeltapper.faces.cli import main
from wheeltapper.ground import memory

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
STUDY = tomllib.loads((EXAMPLES / "bump_study.toml").read_text()) | {
    "scenario": str(EXAMPLES / "bump.toml"),
    "features": ["impact_interval", {"type": "force_ratio", "first": 2, "second": 3, "name": "later"}],
    "gradient": ["speed"], "zipped": False, "seed": 0, "method": "default", "sampling": "sobol", "chaos_limit": 1e4,
    "chunk": 100,
}  # fmt: skip
STUDY["over"]["speed"] = [9.0, "30 km/h"]
ODD = [5, -1, 0, 2.5, 5e4, float("nan"), float("inf"), "", "odd", "5 m", True, False, [], [1], ["a"], [[1.0]], [True],
       [{}], {}, {"a": 1}, {"from": 1}, {"type": []}, {"from": 1, "to": 2, "count": 3, "spacing": []}]  # fmt: skip


def places(value, path=()):
    """Return the paths of everything in nested tables and lists."""
    yield from [path] if path else []
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for name, part in inside:
        yield from places(part, (*path, name))


def replaced(path, value):
    study = copy.deepcopy(STUDY)
    holder = study
    for name in path[:-1]:
        holder = holder[name]
    holder[path[-1]] = value
    return study


def complaint(study, store):
    try:
        Store(store, spec.read_study(study))
    except wt.InputError as error:
        return error
    return None


@pytest.mark.parametrize("path", list(places(STUDY)), ids=lambda path: ".".join(map(str, path)))
def test_any_value_anywhere_is_a_study_or_refused_in_one_line(path, tmp_path):
    file, refused = tmp_path / "study.toml", 0
    for value in ODD:
        file.write_text(tomli_w.dumps(replaced(path, value)))
        error = complaint(file, tmp_path / "map.zarr")
        if error is not None:
            assert "\n" not in str(error), value
            assert error.found
            assert error.allowed
            refused += 1
    assert refused > 5


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"over": 5}, "over: found 5; allowed: a table"),
        ({"over": {"vehicle.damping": 5e4}}, "over.vehicle.damping: found 50000.0; allowed: a list, or"),
        ({"features": 3}, "features: found 3; allowed: names of features"),
        ({"features": [["impact_interval"]]}, "features: found ['impact_interval']; allowed: "),
        ({"features": [{"type": "impulse", "impact": 1.5}]}, "impact: found 1.5"),
        ({"features": [{"type": "impulse", "name": "status"}]}, "the name 'status', which charts use"),
        ({"features": [{"type": "impulse", "name": "a/b"}]}, "the name 'a/b'; allowed: a name that begins"),
        ({"chunk": 1, "over": {"speed": {"from": 1, "to": 2, "count": 2_000_000}}}, "makes 2000000 chunks"),
    ],
)  # fmt: skip
def test_what_is_of_the_wrong_kind_is_named(changes, said, tmp_path, capsys):
    file = tmp_path / "study.toml"
    file.write_text(tomli_w.dumps(STUDY | {"gradient": False} | changes))
    assert main(["sweep", str(file), "--output", str(tmp_path / "map.zarr")]) == 2
    message = capsys.readouterr().err
    assert said in message
    assert str(file) in message
    assert message.count("\n") == 1
    assert not (tmp_path / "map.zarr").exists()


def test_what_does_not_fit_in_memory_is_refused_with_the_number(tmp_path):
    scene = wt.load(EXAMPLES / "bump.toml")
    side = np.linspace(1.0, 2.0, 100_000)
    features = [wt.features.impact_interval(), wt.features.force_ratio()]
    with pytest.raises(wt.InputError, match=r"over: found 1e\+10 cells, 1.12 TB; allowed: fewer cells"):
        wt.sweep(scene, {"speed": side, "vehicle.mass": 1500 * side}, features)
    with pytest.raises(wt.InputError, match=r"samples: found 1e\+12 samples, 24 TB"):
        wt.sweep(scene, {"speed": [1.0, 2.0]}, features, samples=10**12)
    study = STUDY | {"gradient": False, "over": {"speed": {"from": 1, "to": 2, "count": 10**12}}}
    (tmp_path / "study.toml").write_text(tomli_w.dumps(study))
    with pytest.raises(wt.InputError, match=r"over.speed: found 1e\+12 values, 24 TB"):
        Store(tmp_path / "map.zarr", spec.read_study(tmp_path / "study.toml"))
    assert 1e8 < memory.available_bytes() < 1e15


@pytest.mark.parametrize(
    ("path", "ends", "found"),
    [
        ("vehicle.stiffness", ("50 N/mm", "0.1 kN/mm"), [5e4, 7.5e4, 1e5]),
        ("vehicle.stiffness", (5e4, "100 N/mm"), [5e4, 7.5e4, 1e5]),
        ("speed", ("18 km/h", "36 km/h"), [5.0, 7.5, 10.0]),
        ("irregularity.0.height", ("100 um", "0.3 mm"), [1e-4, 2e-4, 3e-4]),
    ],
)
def test_ends_of_a_range_may_have_units(path, ends, found, tmp_path):
    file = tmp_path / "study.toml"
    span = {"from": ends[0], "to": ends[1], "count": 3}
    file.write_text(tomli_w.dumps(STUDY | {"over": {path: span}, "gradient": False}))
    study = spec.described_study(spec.read_study(file))
    np.testing.assert_allclose(study.axes[0].values, found, rtol=1e-15)
    file.write_text(tomli_w.dumps(STUDY | {"over": {path: span | {"to": "3 kg"}}, "gradient": False}))
    assert "'3 kg', which is not a" in str(complaint(file, tmp_path / "map.zarr"))


def test_an_unknown_name_at_the_top_is_refused_with_the_nearest(tmp_path):
    file = tmp_path / "study.toml"
    file.write_text(tomli_w.dumps(STUDY | {"sampels": 3}))
    assert "(did you mean 'samples'?)" in str(complaint(file, tmp_path / "map.zarr"))

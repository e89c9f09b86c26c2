"""The examples: every scenario runs on the command line, every script runs, and each yields its number."""

import json
import re
import runpy
from pathlib import Path

import pytest

import wheeltapper as wt
from wheeltapper.faces.animation import animate
from wheeltapper.faces.cli import main

EXAMPLES = Path(__file__).parents[2] / "examples"

# Scenario: impacts, largest force over static.
SCENARIOS = {
    "bogie_over_weld.toml": (0, 1.562),
    "bump.toml": (11, 5.566),
    "coach_on_ballast.toml": (2, 2.881),
    "coach_step.toml": (4, 3.488),
    "corrugation.toml": (0, 2.342),
    "corrugation_on_slab.toml": (0, 1.723),
    "corrugation_wear.toml": (0, 2.333),
    "deck.toml": (31, 3.318),
    "dipped_joint.toml": (0, 2.003),
    "drop_test.toml": (3, 4.662),
    "flat_on_ballast.toml": (0, 2.170),
    "flat_on_named_track.toml": (0, 2.036),
    "hanging_sleeper.toml": (0, 1.032),
    "joint.toml": (0, 2.055),
    "measured_flat.toml": (9, 21.920),
    "measured_flat_deck.toml": (9, 22.697),
    "rough_rail_on_ballast.toml": (0, 1.218),
    "two_axle_wagon.toml": (0, 1.936),
    "wheel_flat.toml": (10, 3.161),
}
# Script: what it prints, and the number in it.
SCRIPTS = {
    "bouncing_for_ever.py": (r"two motions from ([\d.]+) to", 2.996),
    "bump.py": (r"first interval ([\d.]+) ms", 8.7033),
    "flats_on_tracks.py": (r"40 mm at 216 km/h on sleepers: ([\d.]+) times", 2.666),
    "freight_wagon.py": (r"wheelset 2 left: ([\d.]+) kN more", 65.2),
    "joint_over_speed.py": (r"P2 at 50 m/s: ([\d.]+) kN per wheel", 240.7),
    "compare_bilateral.py": (r"two-sided contact: no impact, largest force ([\d.]+)", 21.2),
    "own_contact_law.py": (r"squeezed layer: 2 impacts, largest force ([\d.]+) of static", 2.968),
    "recorded_train.py": (r"axle 7 right strikes: it bears ([\d.]+) kN", 33.57),
    "rough_rail.py": (r"over a sleeper: the largest difference is ([\d.]+) dB", 5.1),
    "measured_flat.py": (r"lands at ([\d.]+) m", 0.5273),
    "flat_across_the_tread.py": (r"as the rail feels it: ([\d.]+) mm", 1.138),
    "week_of_traffic.py": (r"2026-11-08T06-41: the largest reading is ([\d.]+) kN", 145.7),
    "lectures/contact_resonance.py": (r"largest force at ([\d.]+) m/s, by the formula at 9.00", 9.00),
    "lectures/hertz_impact.py": (r"over Hertz's formula: ([\d.]+)", 1.0193),
    "lectures/hunting.py": (r"wavelength ([\d.]+) m, by Klingel 16.505", 16.505),
    "lectures/joint_at_two_speeds.py": (r"P1 - P0 grows ([\d.]+) times, P2", 1.882),
    "lectures/pinned_pinned.py": (r"pinned-pinned frequency ([\d.]+) Hz", 1071.0),
}


LONG = ("bouncing_for_ever.py", "freight_wagon.py", "rough_rail.py", "week_of_traffic.py")
"""Scripts that take more than five seconds: the documentation runs them; `.ci/run --all` compares their numbers."""
# Study: a feature, and its mean over the cells.
STUDIES = {
    "bump_study.toml": ("impact_interval", 0.0095148269),
    "joint_study.toml": ("P2", 317447.613),
    "flat_map.toml": ("largest_force", 481734.541),
}
# Site: a recording made there, its verdict, and the fault's size.
SITES = {"site.toml": ("deck_flat.csv.gz", "wheel flat", 0.04)}
DATASETS = {"flats_dataset.toml"}  # tested with data sets
DETECTORS = {"detector.toml": ("rail shear force", 6), "week.toml": ("rail shear force", 8)}


@pytest.mark.parametrize("name", DETECTORS)
def test_a_detector_has_its_sensors(name):
    kind, count = DETECTORS[name]
    site = wt.load(EXAMPLES / name)
    assert [sensor.kind for sensor in site.sensors] == [kind] * count


def test_every_example_has_its_number() -> None:
    held = {path.name for path in EXAMPLES.glob("*.toml")}
    assert held == set(SCENARIOS) | set(STUDIES) | set(SITES) | set(DETECTORS) | DATASETS
    assert {path.relative_to(EXAMPLES).as_posix() for path in EXAMPLES.rglob("*.py")} == set(SCRIPTS)


def test_every_script_has_its_thumbnail() -> None:
    drawn = (EXAMPLES.parent / "docs" / "gallery_figures.py").read_text(encoding="utf-8")
    assert set(re.findall(r'^    "(\w+)": Small\(', drawn, re.MULTILINE)) == {Path(name).stem for name in SCRIPTS}


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENARIOS)
def test_the_scenario_runs_on_the_command_line(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output, picture = tmp_path / "record.nc", tmp_path / "picture.png"
    assert main(["run", str(EXAMPLES / name), "--output", str(output), "--plot", str(picture)]) == 0
    impacts, force = SCENARIOS[name]
    printed = capsys.readouterr().out
    assert f"{impacts} impact" in printed
    assert f"{force:.3f} of static" in printed
    assert wt.load(output).impacts.sizes["impact"] == impacts
    assert picture.stat().st_size > 10_000


@pytest.mark.slow
@pytest.mark.parametrize("name", SITES)
def test_the_recording_is_diagnosed_on_the_command_line(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording, verdict, size = SITES[name]
    command = ["diagnose", str(EXAMPLES / "data" / recording), "--site", str(EXAMPLES / name), "-o", str(tmp_path)]
    assert main(command) == 0
    assert f"{recording}: {verdict} (probability" in capsys.readouterr().out
    finding = json.loads((tmp_path / f"{recording}.json").read_text(encoding="utf-8"))
    assert finding["size"] == pytest.approx(size, abs=1e-4)
    assert (tmp_path / f"{recording}.png").stat().st_size > 10_000


@pytest.mark.slow
@pytest.mark.parametrize("name", STUDIES)
def test_the_study_fills_a_store_on_the_command_line(name: str, tmp_path: Path) -> None:
    store = tmp_path / "map.zarr"
    assert main(["sweep", str(EXAMPLES / name), "--output", str(store)]) == 0
    feature, mean = STUDIES[name]
    chart = wt.load(store)
    assert float(chart[feature].mean()) == pytest.approx(mean, rel=1e-6)
    assert int(chart.status.max()) == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=pytest.mark.whole) if one in LONG else one for one in SCRIPTS]
)
def test_the_script_runs_and_prints_its_number(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "examples").symlink_to(EXAMPLES)
    monkeypatch.chdir(tmp_path)  # where films are written
    whole = animate.animate
    short = {"seconds": 0.2, "frames_per_second": 10}
    monkeypatch.setattr(animate, "animate", lambda *given, **options: whole(*given, **options | short))
    runpy.run_path(str(EXAMPLES / name), run_name="__main__")  # a process of its own would load all kernels again
    pattern, number = SCRIPTS[name]
    printed = capsys.readouterr().out
    found = re.search(pattern, printed)
    assert found is not None, printed
    assert float(found[1]) == pytest.approx(number, rel=1e-4)


def test_the_readme_example_is_the_bump_scenario() -> None:
    assert wt.load(EXAMPLES / "bump.toml") == wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4, radius=0.46),
        track=wt.StiffTrack(),
        contact=wt.Hertz(constant=1.405e11),
        irregularity=wt.CosineBump(height="0.2 mm", length="50 mm", start=0.009),
        rolling="point",
        speed=9.0,
        duration=0.12,
    )

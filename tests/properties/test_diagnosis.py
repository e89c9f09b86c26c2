"""Findings: a simulated fault is found, sized, and distinguished; what cannot be distinguished is said."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.diagnosis import CATALOGUE, Condition, Recording, Site, diagnose_all, processes, write_recording
from wheeltapper.diagnosis.inference.search import misfit

SITE = wt.load("examples/site.toml")
SHORT = Site.model_validate(SITE.model_dump() | {"passage": SITE.passage.replaced({"duration": 0.2})})


def found(fault, size=None, seed=1, site=SHORT, **options):
    (recording,) = wt.synthesise(site, fault=fault, size=size, seed=seed, **options)
    return wt.diagnose(recording, site), recording


@pytest.mark.parametrize("seed", range(2))
def test_a_healthy_wheelset_is_called_healthy(seed):
    finding, recording = found(None, seed=seed)
    assert finding.verdict == "healthy"
    assert finding.probabilities["healthy"] > 0.8
    assert sum(finding.probabilities.values()) == pytest.approx(1.0)
    assert finding.reduced == pytest.approx(1.0, abs=0.1)
    assert finding.speed == pytest.approx(recording.truth["speed"], rel=1e-2)
    record = wt.simulate(recording.truth["scenario"])
    assert finding.largest_force == pytest.approx(float(record.peaks.normal_force.max()), rel=0.01)
    assert finding.static_force == pytest.approx(record.static_force, rel=0.01)
    assert finding.impacts == pytest.approx(record.impacts.sizes["impact"], abs=1)


@pytest.mark.parametrize(
    ("fault", "size", "within"),
    [
        ("broken spring", None, 100.0),
        ("lost damper", None, 0.02),
        ("weak damper", None, 0.05),
        ("mass deviation", 1.1, 0.05),
        ("mass deviation", 0.9, 0.05),
        ("load deviation", 1.8, 0.02),
    ],
)
def test_plain_faults_are_named_and_sized(fault, size, within):
    finding, recording = found(fault, size)
    assert finding.verdict == fault
    true = recording.truth["size"] if finding.part != "load" else recording.truth["vehicle.load"] / 91_307
    assert finding.size == pytest.approx(true, abs=within)
    assert finding.interval[0] < finding.size < finding.interval[1]
    assert finding.part == CATALOGUE[fault].part
    assert finding.score(finding.part) > 3.0


@pytest.mark.slow
@pytest.mark.parametrize(("size", "seed"), [(0.02, 1), pytest.param(0.08, 3, marks=pytest.mark.slow)])
def test_flats_are_sized_clipped_or_not(size, seed):
    finding, recording = found("wheel flat", size, seed, SITE)
    assert finding.verdict == "wheel flat"
    assert finding.size == pytest.approx(size, abs=1e-4)
    assert np.any(recording.clipped) == (size == 0.08)


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "seed", "place"),
    [
        (0.0507, 1, None),  # felt at its edge
        (0.0683, 5, None),  # landed on: the first turn tells one edge only
        (0.0719, 13, None),  # landed on near its middle
        (0.0591, 10, 0.0253),  # strikes 5 ms after the trigger, where the wheel has hardly left the bump
    ],
)
def test_a_flat_is_sized_wherever_it_strikes(size, seed, place):
    finding, _ = found(Condition("wheel flat", size, place), None, seed, SITE)
    assert finding.verdict == "wheel flat"
    assert finding.size == pytest.approx(size, abs=1e-4)
    assert finding.reduced < 1.05


@pytest.mark.whole
@pytest.mark.slow
def test_a_flat_is_found_where_the_noise_is_misjudged():
    """What is left is more than noise then, to the end of the recording."""
    (recording,) = wt.synthesise(SITE, fault="wheel flat", size=0.0357, seed=2)
    finding = wt.diagnose(recording, SITE, noise=0.0666 / 1.1)
    assert finding.verdict == "wheel flat"
    assert finding.size == pytest.approx(0.0357, abs=1e-4)
    assert finding.reduced == pytest.approx(1.21, abs=0.05)


@pytest.mark.slow
def test_a_soft_bush_is_not_a_lost_damper():
    """A lost damper explains it within the threshold, but not as well."""
    finding, _ = found("soft bush", 3.04e6, 8, SITE)
    assert finding.verdict == "soft bush"
    assert finding.size == pytest.approx(3.04e6, rel=0.05)


@pytest.mark.slow
def test_a_rounded_flat_is_not_a_fresh_one():
    finding, _ = found("rounded flat", 0.05, 4, SITE)
    assert finding.verdict == "rounded flat"
    assert finding.size == pytest.approx(0.05, abs=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(("size", "seed"), [(2.4e-5, 3), (1e-4, 2), (1.75e-4, 4)])
def test_a_wheel_out_of_round_shows_its_order(size, seed):
    finding, _ = found("out of round", size, seed, SITE)
    assert finding.verdict == "out of round"
    assert finding.size == pytest.approx(size, rel=0.02)
    assert finding.model.irregularities[-1].orders == (12,)


def test_pure_noise_holds_no_wheel():
    noise = np.random.default_rng(1).standard_normal(4000) * 0.0666
    finding = wt.diagnose(Recording(noise, 20e3), SHORT)
    assert finding.verdict == "no wheel"
    assert finding.probabilities == {}
    assert "nothing rises from the noise" in str(finding)


@pytest.mark.whole
@pytest.mark.slow
def test_a_recording_of_another_site_is_not_explained():
    other = SHORT.passage.replaced({"track.mass": 9000.0, "irregularity.0.height": 4e-4, "irregularity.0.length": 0.08})
    (recording,) = wt.synthesise(Site.model_validate(SHORT.model_dump() | {"passage": other}), seed=1)
    finding = wt.diagnose(recording, SHORT)
    assert finding.verdict == "not explained"
    assert finding.reduced > 10.0
    assert finding.alike == ()
    assert "neither a healthy wheelset nor a fault" in str(finding)


@pytest.mark.slow
def test_a_recording_that_is_clipped_nearly_everywhere_says_so():
    tight = Site.model_validate(SHORT.model_dump() | {"sensor": SHORT.sensor.model_copy(update={"range": 1.0})})
    finding, recording = found(None, seed=5, site=tight)
    assert recording.clipped.mean() > 0.2
    assert any("samples are clipped: of them" in note for note in finding.notes)
    assert finding.verdict == "healthy"


def test_recordings_that_cannot_be_diagnosed_are_refused():
    (recording,) = wt.synthesise(SHORT, seed=1)
    for wrong, field in (
        (replace(recording, rate=10e3), "rate"),
        (replace(recording, samples=np.full(len(recording.samples), np.nan)), "samples"),
        (replace(recording, quantity="force"), "quantity"),
    ):
        with pytest.raises(wt.InputError) as refused:
            wt.diagnose(wrong, SHORT)
        assert refused.value.field == field
    with pytest.raises(wt.InputError, match="broken spring"):
        wt.diagnose(recording, SHORT, faults=["no such fault"])


@pytest.mark.slow
def test_a_finding_is_json_and_a_figure(tmp_path):
    finding, _ = found("broken spring")
    told = json.loads(json.dumps(finding.to_dict(), allow_nan=False))
    assert told["verdict"] == "broken spring"
    assert (
        told["estimates"]["vehicle.mass"]["interval_90"][0] < 2170 < told["estimates"]["vehicle.mass"]["interval_90"][1]
    )
    figure = wt.plot(finding, tmp_path / "finding.png")
    assert (tmp_path / "finding.png").stat().st_size > 10_000
    assert len(figure.axes) == 4


def recordings(folder, count):
    for number, recording in enumerate(wt.synthesise(SHORT, count, seed=7)):
        write_recording(recording, folder / f"{number}.csv")
    return sorted(folder.glob("*.csv"))


@pytest.mark.slow
def test_a_folder_is_diagnosed_and_goes_on(tmp_path, monkeypatch):
    files = recordings(tmp_path, 3)
    (tmp_path / "3.csv").write_text("not a recording\n")
    files.append(tmp_path / "3.csv")
    seen = []
    first = diagnose_all(files, SHORT, output=tmp_path / "found", workers=1, progress=lambda *now: seen.append(now))
    assert [entry["verdict"] for entry in first] == ["healthy"] * 3 + ["not read"]
    assert seen == [("recordings", done, 4) for done in range(5)]
    (tmp_path / "found" / "1.csv.json").write_text("{")  # as a kill might leave it
    computed = []
    whole = processes.in_processes
    monkeypatch.setattr(
        "wheeltapper.diagnosis.folder.in_processes",
        lambda function, site, tasks, workers: computed.extend(tasks) or whole(function, site, tasks, workers),
    )
    again = diagnose_all(files, SHORT, output=tmp_path / "found", workers=1)
    assert [task[0].name for task in computed] == ["1.csv"]
    assert again == first
    other = Site.model_validate(SHORT.model_dump() | {"uncertainty": {"speed": 0.2}})
    computed.clear()
    diagnose_all(files[:1], other, output=tmp_path / "found", workers=1)
    assert len(computed) == 1


@pytest.mark.whole
@pytest.mark.slow
def test_processes_find_the_same(tmp_path):
    files = recordings(tmp_path, 4)
    many, few = (diagnose_all(files, SHORT, workers=workers) for workers in (2, 1))
    for one, other in zip(many, few, strict=True):
        assert one["verdict"] == other["verdict"]
        for path, found in one["estimates"].items():  # linear algebra on more threads rounds in another order
            assert found["value"] == pytest.approx(other["estimates"][path]["value"], rel=1e-6)


@pytest.mark.parametrize(("fault", "size", "seed"), [("free play", 5e-5, 300), ("soft bush", 1e7, 301)])
@pytest.mark.slow
def test_dampers_with_an_end_of_their_own_are_named_and_sized(fault, size, seed):
    finding, _ = found(fault, size, seed)
    assert finding.verdict == fault
    assert finding.part == "damper"
    assert finding.size == pytest.approx(size, rel=5e-3)


@pytest.mark.slow
def test_play_that_is_never_crossed_looks_like_no_damper():
    finding, _ = found("free play", 1e-3, 300)
    assert finding.verdict == "lost damper"
    assert finding.alike == ("free play",)
    assert "does not exclude: free play" in str(finding)


@pytest.mark.slow
@pytest.mark.parametrize("cutoff", [4e3])
def test_a_sensor_with_a_filter_is_seen_through(cutoff):
    sensor = SHORT.sensor.model_copy(update={"cutoff": cutoff, "offset": 0.3, "drift": 0.5})
    finding, _ = found(None, seed=1, site=Site.model_validate(SHORT.model_dump() | {"sensor": sensor}))
    assert finding.verdict == "healthy"
    assert finding.reduced == pytest.approx(1.0, abs=0.1)


def test_a_model_is_not_compared_where_nothing_was_recorded():
    samples = np.zeros(10)
    problem = SimpleNamespace(
        times=np.arange(10.0), samples=samples, there=np.arange(10) < 5, recording=SimpleNamespace(rate=1.0),
        model_samples=lambda model, last, first: samples[first:last] + 2.0,
    )  # fmt: skip
    assert misfit(problem, None, 2.0, 8.0) == 4.0
    assert misfit(problem, None, 6.0, 8.0, over=2.0) == np.inf


@pytest.mark.whole
@pytest.mark.slow
def test_a_misfit_of_the_model_is_noise():
    (recording,) = wt.synthesise(SHORT, seed=1)
    ripple = 0.1 * np.sin(2.0 * np.pi * 37.0 * recording.times)
    disturbed = replace(recording, samples=recording.samples + ripple)
    tolerant = Site.model_validate(SHORT.model_dump() | {"misfit": 0.015})
    assert wt.diagnose(disturbed, SHORT).verdict != "healthy"
    finding = wt.diagnose(disturbed, tolerant)
    assert finding.verdict == "healthy"
    rms = np.sqrt((disturbed.samples**2).mean())
    assert finding.noise == pytest.approx(np.hypot(np.sqrt(0.5 * 20e3) * 6.66e-4, 0.015 * rms), rel=1e-3)


@pytest.mark.whole
@pytest.mark.slow
def test_what_is_explained_of_a_recording_that_is_not_is_told():
    (recording,) = wt.synthesise(SHORT, seed=1)
    late = recording.times > 0.1
    finding = wt.diagnose(replace(recording, samples=np.where(late, -recording.samples, recording.samples)), SHORT)
    assert finding.verdict == "not explained"
    assert any(note.startswith("up to ") and "explain the recording" in note for note in finding.notes)


@pytest.mark.slow
def test_a_length_that_the_recording_does_not_tell_is_not_given():
    """The wheel lands near one edge of the flat, and the recording ends before the next turn shows the other."""
    finding, recording = found("wheel flat", (0.02, 0.08), 188_923_824, SITE)
    assert finding.verdict == "wheel flat"
    assert np.isnan(finding.size)
    assert finding.interval[0] < recording.truth["size"] < finding.interval[1]
    assert "Length hardly determined by this recording" in str(finding)
    assert finding.to_dict()["size"] is None
    assert finding.to_dict()["size_interval_90"][0] == pytest.approx(finding.interval[0])


@pytest.mark.few(4)
@pytest.mark.parametrize("fault", CATALOGUE)
def test_a_site_that_is_certain_of_everything_is_diagnosed(fault):
    """Nothing is left to fit but the fault's own size."""
    certain = Site(passage=SITE.passage, sensor=SITE.sensor)
    finding, recording = found(fault, site=certain)
    assert finding.verdict == fault
    assert finding.size == pytest.approx(recording.truth["size"], rel=5e-3)


@pytest.fixture(scope="module")
def unexplained():
    """A flat of 40 mm that makes a force of 980 kN, compared with faults that cannot explain it."""
    recording = wt.diagnosis.synthesise_train(SITE, [None, "wheel flat"], seed=2, reach=0.0)[1]
    return wt.diagnose(recording, SITE, faults=["broken spring", "lost damper", "weak damper"]), recording


@pytest.mark.slow
def test_forces_of_what_is_not_explained_are_those_of_the_recording(unexplained):
    finding, recording = unexplained
    record = wt.simulate(recording.truth["scenario"])
    true = float(record.peaks.normal_force.max())
    assert finding.verdict == "not explained"
    assert true == pytest.approx(980e3, rel=0.01)
    assert finding.largest_force == pytest.approx(true, rel=0.01)
    assert finding.static_force == pytest.approx(record.static_force, rel=0.02)
    assert finding.to_dict()["forces_from"] == finding.forces_from == "recording"
    assert "From the recording: static force 124.2 kN (27.9 kips), largest 980.2 kN (220.4 kips)" in str(finding)


@pytest.mark.slow
def test_no_parameters_are_given_of_a_model_that_does_not_explain_the_recording(unexplained):
    finding, _ = unexplained
    told = finding.to_dict()
    assert finding.reduced > 1000.0
    assert finding.estimate is None
    assert (told["estimates"], told["combinations"], told["impacts"]) == ({}, {}, None)
    assert "90 %" not in str(finding)
    assert told["largest_force_deviation"] is None
    assert "±" not in str(finding)
    wt.plot(finding)


@pytest.mark.slow
def test_no_parameters_are_given_of_a_model_that_nearly_explains_the_recording():
    (recording,) = wt.synthesise(SHORT, seed=1)
    ripple = 0.1 * np.sin(2.0 * np.pi * 37.0 * recording.times)
    disturbed = replace(recording, samples=recording.samples + ripple)
    finding = wt.diagnose(disturbed, SHORT, faults=["broken spring"])
    assert finding.verdict == "not explained"
    assert 1.3 < finding.reduced < 10.0
    assert finding.estimate is None
    assert finding.forces_from == "recording"


@pytest.mark.slow
def test_the_forces_of_clipped_recordings_that_nothing_explains_are_bounds():
    tight = SITE.sensor.model_copy(update={"range": 20.0})
    site = Site.model_validate(SITE.model_dump() | {"sensor": tight})
    (recording,) = wt.synthesise(site, fault="wheel flat", size=0.04, seed=1)
    finding = wt.diagnose(recording, site, faults=["broken spring"])
    true = float(wt.simulate(recording.truth["scenario"]).peaks.normal_force.max())
    assert finding.verdict == "not explained"
    assert recording.clipped.sum() > 10
    assert 15_000 * 19.9 < finding.largest_force < true
    assert any("may lie beyond" in note for note in finding.notes)


@pytest.mark.parametrize("fault", [None, "broken spring", "free play"])
@pytest.mark.slow
def test_the_irregularity_may_lie_far_behind_the_trigger(fault):
    """Speeds that are known to 10 % tell to 10 ms when the wheel gets there: the recording tells it better."""
    late = SITE.passage.replaced({"irregularity.0.start": 0.9, "duration": 0.4})
    finding, _ = found(fault, seed=2, site=Site.model_validate(SITE.model_dump() | {"passage": late}))
    assert finding.verdict == (fault or "healthy")


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("seed", [2_392_737_485, 2_464_715_917])
def test_flats_that_are_hard_to_place(seed):
    """Under the wheel as it comes onto the deck; hardly felt in the first turn."""
    finding, recording = found("wheel flat", (0.02, 0.08), seed, SITE)
    assert finding.verdict == "wheel flat"
    assert finding.size == pytest.approx(recording.truth["size"], abs=2e-4)


@pytest.mark.parametrize("fault", [None, *wt.diagnosis.CATALOGUE])
def test_a_spring_never_leaves_its_seat(fault):
    """Play in a spring's seat is held closed by the static load: why the catalogue has none."""
    (recording,) = wt.synthesise(SITE, fault=fault, seed=1)
    scenario = recording.truth["scenario"]
    pressed = scenario.vehicle.load / scenario.vehicle.stiffness
    moved = wt.simulate(scenario).at(recording.times).wheel_displacement.values
    assert np.abs(moved).max() < 0.1 * pressed

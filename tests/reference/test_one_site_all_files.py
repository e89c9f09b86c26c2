"""One site reads the same train from files of all formats, in forces, volts, shares of the excitation and strains."""

import numpy as np
import pytest
from scipy.io import savemat

from tests.wayside import plain_train
from wheeltapper.diagnosis import Recording, Site, measure_trains
from wheeltapper.ground.errors import InputError
from wheeltapper.record.recordings.read import read_recording

RATE = 5e3
SENSITIVITY = 250e3
"""N for a volt."""
PAIRS = [(side, k) for side in ("left", "right") for k in range(3)]
SENSORS = [
    {"kind": "rail shear force", "name": f"{side} {k}", "side": side, "x1": 1.2 * k + 0.1, "x2": 1.2 * k + 0.5}
    for side, k in PAIRS
]


def site(**more):
    return Site(sensor=[one | {"rate": RATE} | more for one in SENSORS], radius=0.46)


TRUE = plain_train(site().sensors, rate=RATE)
(WANTED,) = measure_trains({name: Recording(row, RATE, "force") for name, row in TRUE.items()}, site())


def same(found):
    assert len(found.axles) == len(WANTED.axles) == 12
    for one, other in zip(found.axles, WANTED.axles, strict=True):
        assert one["static_force"] == pytest.approx(other["static_force"], rel=1e-5)
        assert one["speed"] == pytest.approx(other["speed"], rel=1e-5)


def csv(path, factor, unit, names=None):
    header = ",".join(f"{name} [{unit}]" if unit else name for name in names or TRUE)
    np.savetxt(path, factor * np.array(list(TRUE.values())).T, delimiter=",", header=header, comments="", fmt="%.9g")
    return path


@pytest.mark.parametrize(
    ("unit", "factor", "more"),
    [
        ("kN", 1e-3, {"unit": "250 kN/V"}),  # the file knows its unit
        ("N", 1.0, {"unit": "kN"}),
        ("V", 1.0 / SENSITIVITY, {"unit": "250 kN/V"}),
        ("mV", 1e3 / SENSITIVITY, {"unit": "250 kN/V"}),
        ("mV", 1e3 / SENSITIVITY, {"unit": "4 mV/kN"}),
        ("mV/V", 1.0 / 12e3, {"unit": "12 kN/(mV/V)"}),
        ("um/m", 1.0 / 800.0, {"unit": "0.8 kN/(um/m)"}),
        ("µm/m", 1.0 / 800.0, {"unit": "0.8 kN/(µm/m)"}),
        ("mV", 1.0 / 12e3 * 5.0, {"unit": "12 kN/(mV/V)", "excitation": "5 V"}),
        # a full bridge, k = 2.05: 1 um/m puts out 2.05e-3 mV/V
        ("mV/V", 2.05e-3 / 800.0, {"unit": "0.8 kN/(um/m)", "gauge_factor": 2.05, "bridge_factor": 4}),
        ("V", 1e-3 * 2.05e-3 / 800.0 * 10.0,
         {"unit": "0.8 kN/(um/m)", "gauge_factor": 2.05, "bridge_factor": 4, "excitation": 10.0}),
        ("", 1e-3, {"unit": "kN"}),
        ("", 1.0 / 250e3, {"unit": "250 kN"}),
    ],
)  # fmt: skip
def test_a_site_knows_what_its_sensors_put_out(tmp_path, unit, factor, more):
    (found,) = measure_trains(csv(tmp_path / "train.csv", factor, unit), site(**more))
    same(found)


def test_names_are_known_as_formats_spell_them(tmp_path):
    from nptdms import ChannelObject, TdmsWriter

    one = site(unit="kN", column=None)
    rows = {name: 1e-3 * row for name, row in TRUE.items()}
    savemat(tmp_path / "train.mat", {name.replace(" ", "_"): row for name, row in rows.items()})
    np.savez(tmp_path / "train.npz", **{name.replace(" ", "_"): row for name, row in rows.items()})
    csv(tmp_path / "train.csv", 1e-3, "kN", [f"WILD/{name.replace(' ', '-')}" for name in TRUE])
    properties = {"wf_increment": 1.0 / RATE, "unit_string": "kN"}
    with TdmsWriter(tmp_path / "train.tdms") as writer:
        writer.write_segment([ChannelObject("WILD", name, row, properties) for name, row in rows.items()])
    for suffix in ("mat", "npz", "csv", "tdms"):
        (found,) = measure_trains(tmp_path / f"train.{suffix}", one)
        same(found)


def test_an_array_has_numbers_of_columns(tmp_path):
    np.save(tmp_path / "train.npy", 1e-3 * np.array(list(TRUE.values())).T)
    numbered = Site(sensor=[one | {"rate": RATE, "unit": "kN", "column": k} for k, one in enumerate(SENSORS)])
    (found,) = measure_trains(tmp_path / "train.npy", numbered)
    same(found)
    (found,) = measure_trains(csv(tmp_path / "train.csv", 1e-3, "kN"), numbered)  # and named ones elsewhere
    same(found)


def test_a_renamed_column_costs_its_channel_and_is_told(tmp_path):
    names = ["lefft 1" if name == "left 1" else name for name in TRUE]
    (found,) = measure_trains(csv(tmp_path / "train.csv", 1e-3, "kN", names), site())
    assert len(found.axles) == 12
    assert "not in the recording: the channels 'left 1'" in found.notes
    assert "all channels: there are columns of no channel: lefft 1" in found.notes


def test_two_sensors_have_no_column_in_common(tmp_path):
    sensors = [one | {"rate": RATE} for one in SENSORS]
    twice = Site(sensor=[*sensors[:-1], sensors[-1] | {"name": "right two", "column": "left 0"}])
    with pytest.raises(InputError, match=r"right two: found the column 'left 0', which is that of 'left 0'"):
        measure_trains(csv(tmp_path / "train.csv", 1e-3, "kN"), twice)


@pytest.mark.parametrize(
    ("more", "parts"),
    [
        ({"unit": "V"}, ("unit", "'V'", "250 kN/V")),
        ({"unit": "250 kN/Q"}, ("unit", "250 kN/Q")),
        ({"unit": "0 kN/V"}, ("unit", "0 kN/V")),
        ({"unit": "100 mV/g"}, ("unit", "100 mV/g", "a force")),
        ({"excitation": "5 mm"}, ("excitation", "5 mm")),
        ({"bridge_factor": -1}, ("bridge_factor", "-1")),
    ],
)
def test_a_wrong_sensitivity_is_refused_when_the_site_is_read(more, parts):
    with pytest.raises(InputError) as caught:
        site(**more)
    assert all(part in str(caught.value) for part in ("sensor", *parts)), str(caught.value)


@pytest.mark.parametrize(
    ("unit", "more", "parts"),
    [
        ("V", {}, ("'V'", "of what a sensor puts out", "sensitivity")),
        ("", {"unit": "250 kN/V"}, ("'250 kN/V', where the file has no unit", "a file in V, mV")),
        ("mV", {"unit": "12 kN/(mV/V)"}, ("excitation", "none", "voltage")),
        ("mV/V", {"unit": "0.8 kN/(um/m)"}, ("gauge_factor", "none", "2.05")),
        ("mV/V", {"unit": "0.8 kN/(um/m)", "gauge_factor": 2.0}, ("bridge_factor", "none", "arms")),
    ],
)
def test_what_a_file_puts_out_needs_what_the_sensor_is(tmp_path, unit, more, parts):
    file = csv(tmp_path / "train.csv", 1.0, unit)
    with pytest.raises(InputError) as caught:
        measure_trains(file, site(**more))
    assert str(file) in str(caught.value)
    assert all(part in str(caught.value) for part in parts), str(caught.value)


def test_an_accelerometers_sensitivity_is_taken(tmp_path):
    text = "t [s],deck [mV]\n" + "".join(f"{k / 1e4:.4f},{50.0 * np.sin(k / 9.0):.6f}\n" for k in range(2000))
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    found = read_recording(tmp_path / "a.csv", unit="100 mV/g")
    assert found.quantity == "deck acceleration"
    assert found.samples.max() == pytest.approx(0.5 * 9.80665, rel=1e-3)

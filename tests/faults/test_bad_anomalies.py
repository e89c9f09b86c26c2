"""Anomalies that cannot be: one clear message each."""

import pytest

import wheeltapper as wt

BALLASTED = wt.tracks.Ballasted.named("rolland_UIC60_example")
FIELDS = {name: getattr(BALLASTED, name) for name in type(BALLASTED).model_fields}
SLAB = {"rail": "UIC60", "spacing": 0.65, "pad_stiffness": 40e6, "pad_damping": 12e3}
HANGING, PAD = wt.tracks.HangingSleeper(seat=3), wt.tracks.MissingPad(seat=3)
SCATTERED = wt.tracks.Scatter(ballast=0.1)


def ballasted(*anomalies, **more):
    return wt.tracks.Ballasted(**FIELDS | {"anomalies": anomalies} | more)


def run(track, **more):
    scene = {"vehicle": wt.Wheelset(mass=1200, load=188e3), "speed": 20.0, "duration": 0.1, "track": track} | more
    return wt.simulate(wt.Scenario(**scene))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: wt.tracks.HangingSleeper(seat=1, void="-1 mm"), ["void", "-1 mm", "greater than or equal to 0"]),
        (lambda: wt.tracks.HangingSleeper(seat=1.5), ["seat", "1.5"]),
        (lambda: wt.tracks.Scatter(pads=0.6), ["pads", "0.6", "0.5"]),
        (lambda: wt.tracks.Scatter(), ["neither pads nor ballast"]),
        (lambda: wt.tracks.Scatter(pads=0.1, seed=-1), ["seed", "-1"]),
        (lambda: ballasted(HANGING, wt.tracks.HangingSleeper(seat=3, void=1e-3)), ["second HangingSleeper at seat 3"]),
        (lambda: ballasted(SCATTERED, wt.tracks.Scatter(pads=0.1)), ["anomalies.1", "second Scatter"]),
        (lambda: wt.tracks.Slab(**SLAB, anomalies=HANGING), ["HangingSleeper of ballast on a Slab"]),
        (lambda: wt.tracks.Slab(**SLAB, anomalies=SCATTERED), ["Scatter of ballast on a Slab"]),
        (lambda: ballasted({"type": "Nothing"}), ["Nothing", "HangingSleeper"]),
        (lambda: run(ballasted(wt.tracks.MissingPad(seat=300))), ["track.anomalies.0.seat", "300", "180 m", "-5 to 8"]),
        (lambda: run(ballasted(HANGING, PAD)), ["neither pad nor ballast at seat 3"]),
        (
            lambda: run(ballasted(wt.tracks.MissingPad(seat=1), wt.tracks.MissingPad(seat=9), bays=8)),
            ["track.anomalies.1.seat", "seat 1 again", "ring of 8 bays"],
        ),
        (lambda: run(ballasted(wt.tracks.Scatter(ballast=0.5, seed=2))), ["ballast", "0.5", "draws"]),
        (lambda: wt.tracks.static_deflection(ballasted(SCATTERED), 0.0), ["track.anomalies.0", "Scatter of all seats"]),
        (
            lambda: wt.tracks.receptance(ballasted(wt.tracks.HangingSleeper(seat=3, void=1e-3)), 100.0, 0.0),
            ["over a void, which is not linear"],
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_is_said_in_one_line(make, words):
    with pytest.raises(wt.InputError) as caught:
        make()
    assert "\n" not in str(caught.value)
    for word in words:
        assert word in str(caught.value)

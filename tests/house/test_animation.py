"""Moving pictures: what moves is the record, and the title tells how slow and how exaggerated."""

import json
import re
import shutil
import sys

import numpy as np
import pytest
from matplotlib import rc_context
from matplotlib.animation import FFMpegWriter
from matplotlib.colors import to_rgb
from PIL import Image

import wheeltapper as wt
from wheeltapper.faces.animation.pictures import Canvas, _palette
from wheeltapper.faces.animation.scenes import Interval, film_of
from wheeltapper.faces.panels import COLOURS

from .test_charts import BUMP


def filmed(record, count=12, seconds=1.0, start=0.0, stop=None, exaggeration=None):
    stop = record.end if stop is None else stop
    return film_of(Interval(record, np.linspace(start, stop, count), seconds, 10.0), exaggeration)


@pytest.fixture(scope="module")
def record():
    return wt.simulate(BUMP.replaced({"rolling": "circle"}))


def test_the_wheel_is_where_the_record_says_and_touches_where_it_is_pressed(record):
    film = filmed(record, 40)
    history = record.at(film.times)
    rail, wheel = film.shapes
    for frame in range(40):
        x, y = wheel.at(frame)
        lowest = int(np.argmin(y))
        assert y[lowest] == pytest.approx(float(history.wheel_displacement[frame]), abs=1e-12)
        assert x[lowest] == pytest.approx(9.0 * film.times[frame], abs=1e-9)
        gap = float((y - np.interp(x, *rail.at(frame))).min())  # of the drawn arc above the drawn rail
        indentation = float(history.indentation[frame])
        assert gap == pytest.approx(-indentation, abs=5e-7)  # of a drawn arc of straight pieces


def test_losses_are_shaded_as_long_as_the_wheel_is_in_the_air(record):
    film = filmed(record)
    assert np.diff(film.losses, axis=1).sum() == pytest.approx(record.time_in_air, rel=1e-6)
    assert film.forces.max() == float(record.peaks.normal_force.max())


def test_a_flat_is_seen_on_the_wheel():
    flat = BUMP.replaced(
        {"irregularity": wt.WheelFlat(depth=2e-4, position=0.3), "rolling": "circle", "duration": 0.05}
    )
    film = filmed(wt.simulate(flat), 3, start=0.3 / 9.0 - 0.002, stop=0.3 / 9.0 + 0.002)
    _, wheel = film.shapes
    x, y = wheel.at(1)  # the middle of the flat is below: the arc is straight there
    level = np.abs(x - 0.3) < 0.01
    assert np.ptp(y[level]) < 1e-7
    x, y = wheel.at(0)
    assert np.ptp(y[np.abs(x - 0.282) < 0.01]) > 1e-6


def test_the_title_tells_slowness_and_exaggeration(record):
    film = filmed(record, seconds=3.0, exaggeration=50.0)
    assert film.exaggeration == pytest.approx(50.0)
    assert film.motion == "the wheel on the rail: 25 times slower, heights 50 times larger than lengths"


@pytest.mark.slow
def test_rail_and_sleepers_give_way_below_the_wheel():
    changes = {"duration": 0.06, "irregularity.0.position": 0.9}
    run = wt.simulate(wt.load("examples/flat_on_ballast.toml").replaced(changes))
    film = filmed(run, 7)
    rail, *sleepers = film.shapes
    readings = run.track(100.0, seat=[0])
    x, y = rail.at(3)
    under = float(np.interp(film.discs[0].x[3], x[: len(x) // 2], y[: len(x) // 2]))
    assert under == pytest.approx(float(run.at([film.times[3]]).rail_displacement[0]), rel=0.02)
    (first,) = [one for one in sleepers if abs(one.x.mean()) < 1e-9]
    np.testing.assert_allclose(first.shift[:, 1], readings.sleeper_displacement[:, 0], rtol=1e-9)


def test_a_deck_and_a_wagon_move():
    deck = wt.simulate(wt.load("examples/deck.toml").replaced({"duration": 0.2}))
    film = filmed(deck, 5)
    (rail,) = [shape for shape in film.shapes if shape.colour == "deck"]
    np.testing.assert_allclose(rail.shift[:, 1], deck.at(film.times).deck_displacement)
    coach = wt.simulate(wt.load("examples/coach_step.toml").replaced({"duration": 0.05}))
    film = filmed(coach, 3)
    assert len(film.discs) == 4
    assert len([shape for shape in film.shapes if shape.colour == "body"]) == 3
    assert film.names[1] == "1 right"
    assert "displacements" in film.motion
    canvas = Canvas(film)  # bodies are drawn to the scale of lengths: no numbers of millimetres beside them
    assert len(canvas.motion.get_yticks()) == 0
    assert [text.get_text() for text in canvas.motion.texts] == [f"displacement of {1e3 * film.ruler:g} mm"]
    said = [text.get_text() for text in canvas.force.get_legend().get_texts()]
    assert said[:8] == list(film.names)
    canvas.figure.canvas.draw()
    words = canvas.motion.xaxis.label.get_window_extent()
    assert not canvas.force.get_legend().get_window_extent().overlaps(words)
    image = next(iter(canvas.images()))
    kept = np.asarray(_palette(image).getpalette()).reshape(-1, 3)
    for colour in COLOURS:  # lines of two wheels do not become one colour
        assert np.abs(kept - 255.0 * np.array(to_rgb(colour))).max(axis=1).min() < 12


def test_the_files(record, tmp_path):
    page = wt.show.animate(record, tmp_path / "a.html", seconds=1.0, frames_per_second=12)
    text = page.read_text(encoding="utf-8")
    data = json.loads(re.search(r'<script id="film" type="application/json">(.*?)</script>', text)[1])
    assert data["frames"] == len(data["times"]) == 12
    assert max(data["forces"][0]) == pytest.approx(float(record.peaks.normal_force.max()) / 1e3, rel=1e-4)
    assert "http" not in text.replace('lang="en"', "")  # nothing is loaded from elsewhere
    assert page.stat().st_size < 200_000
    moving = wt.show.animate(record, tmp_path / "a.gif", start="10 ms", stop="20 ms", seconds=0.5, frames_per_second=8)
    with Image.open(moving) as image:
        assert image.n_frames == 4
        assert image.info["duration"] == pytest.approx(125, abs=5)
        first = np.asarray(image.convert("RGB")).astype(int)
        image.seek(3)
        assert np.abs(np.asarray(image.convert("RGB")).astype(int) - first).max() > 50


def test_a_frame_has_labels_with_units_and_no_legend_over_the_force(record):
    canvas = Canvas(filmed(record, 3))
    canvas.show(1)
    assert canvas.motion.get_xlabel() == "position along the rail [m]"
    assert canvas.motion.get_ylabel() == "height [mm]"
    assert canvas.force.get_ylabel() == "normal force [kN]"
    canvas.figure.canvas.draw()
    legend = canvas.force.get_legend().get_window_extent()
    assert not legend.overlaps(canvas.force.bbox.shrunk(1.0, 0.98))
    assert canvas.dots[0].get_ydata()[0] == pytest.approx(
        float(record.at([record.end / 2]).normal_force[0]) / 1e3, rel=1e-3
    )


@pytest.mark.parametrize(
    ("path", "options", "match"),
    [
        ("a.avi", {}, "suffix"), ("a.gif", {"start": 0.5, "stop": 0.4}, "part of the run"),
        ("a.gif", {"stop": 9.0}, "part of the run"),
        ("a.gif", {"seconds": 1e6}, "frames"), ("a.gif", {"seconds": 0.01}, "frames"), (3, {}, "path"),
        ("missing/a.html", {"seconds": 0.5}, "writable"),
    ],
)  # fmt: skip
def test_wrong_arguments_are_one_line(record, tmp_path, path, options, match):
    where = tmp_path / path if isinstance(path, str) else path
    with pytest.raises(wt.InputError, match=match):
        wt.show.animate(record, where, **options)
    with pytest.raises(wt.InputError, match="record"):
        wt.show.animate(BUMP, tmp_path / "a.gif")


def test_without_ffmpeg_one_line_says_what_to_install(record, tmp_path, monkeypatch):
    monkeypatch.setattr(FFMpegWriter, "isAvailable", classmethod(lambda cls: False))
    with pytest.raises(
        wt.InputError, match=r"ffmpeg, which is not installed; allowed: \.html or \.gif, or install ffmpeg"
    ):
        wt.show.animate(record, tmp_path / "a.mp4")


FAKE = """#!{python}
import sys
from pathlib import Path

given = sys.argv[1:]
size = given[given.index("-s") + 1] if "-s" in given else given[given.index("-video_size") + 1]
wide, tall = map(int, size.split("x"))
raw = sys.stdin.buffer.read()
frames, rest = divmod(len(raw), 4 * wide * tall)
assert rest == 0
frame = 4 * wide * tall
same = sum(raw[i * frame : (i + 1) * frame] == raw[:frame] for i in range(frames))
Path(given[-1]).write_text(f"{{frames}} {{same}} {{' '.join(given)}}")
"""


def test_what_ffmpeg_is_given_for_an_mp4(record, tmp_path):
    """A program that stands for ffmpeg counts the frames that it is given, and those that are like the first one."""
    program = tmp_path / "ffmpeg"
    program.write_text(FAKE.format(python=sys.executable), encoding="utf-8")
    program.chmod(0o755)
    with rc_context({"animation.ffmpeg_path": str(program)}):
        made = wt.show.animate(record, tmp_path / "a.mp4", start="5 ms", stop="10 ms", seconds=1.0, frames_per_second=5)
    frames, same, *given = made.read_text(encoding="utf-8").split()
    assert (frames, same) == ("5", "1")
    assert given[given.index("-framerate" if "-framerate" in given else "-r") + 1] in ("5", "5.0")
    assert given[given.index("-pix_fmt", given.index("-i")) + 1] == "yuv420p"  # what browsers and phones play


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="needs the program ffmpeg")
def test_a_film_as_mp4(record, tmp_path):
    made = wt.show.animate(record, tmp_path / "a.mp4", seconds=0.5)
    assert made.read_bytes()[4:8] == b"ftyp"

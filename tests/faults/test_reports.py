"""Reports of folders of recordings: pages that stand alone, and findings that survive any end of the process."""

import csv
import json
import os
import random
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt
from tests.wayside import plain_train
from wheeltapper.diagnosis.wayside import database
from wheeltapper.diagnosis.wayside.identities import Identity, named_wheels, read_identities, tagged
from wheeltapper.diagnosis.wayside.sources import sources_in
from wheeltapper.faces.cli import main
from wheeltapper.ground.locks import locked

ROOT = Path(__file__).parents[2]
SITE = ROOT / "examples" / "detector.toml"
SENSORS = wt.load(SITE).sensors
RATE = 10e3


def written(file, **more):
    np.savez(file, **plain_train(SENSORS, rate=RATE, **more), unit="N", rate=RATE)


def reported(folder, *more):
    return main(["report", str(folder), "--site", str(SITE), "-o", str(folder.parent / "out"), "--workers", "1", *more])


@pytest.fixture(scope="module")
def site_report(tmp_path_factory):
    """Return the folder of a report: two trains over several days, one with a flat at last, and what is no train."""
    folder = tmp_path_factory.mktemp("report") / "in"
    folder.mkdir()
    for day in range(5):
        flat = (5, "left") if day == 4 else None
        written(folder / f"2026-11-2{day}T08-12_id={4711 + day % 2}.npz", seed=day, speed=18.0 + day, flat=flat)
    (folder / "broken.npz").write_bytes(b"PK, and no more")
    (folder / "notes.pdf").write_text("no recording")
    quiet = {one.name: 1e3 * np.random.default_rng(1).standard_normal(20_000) for one in SENSORS}
    np.savez(folder / "2026-11-29T10-00 quiet.npz", **quiet, unit="N", rate=RATE)
    apart = folder / "2026-11-26T09-00 channels"
    apart.mkdir()
    for name, samples in plain_train(SENSORS, speed=25.0, rate=5e3).items():
        np.savetxt(apart / f"{name}.csv", samples / 1e3, header="rate: 5000 Hz\nunit: kN", fmt="%.3f")
    assert reported(folder) == 0
    return folder.parent / "out"


class Page(HTMLParser):
    """What a page holds: elements with their attributes, and its text."""

    def __init__(self, file):
        super().__init__()
        self.elements, self.text, self.open = [], "", []
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_data(self, data):
        self.text += f"{data} "

    def wheels(self):
        return [held["id"] for tag, held in self.elements if tag == "circle" and "wheel" in held.get("class", "")]


def rows_of(file):
    with file.open(encoding="utf-8", newline="") as text:
        return list(csv.DictReader(text))


@pytest.mark.slow
def test_every_recording_has_a_row_and_every_train_a_page(site_report):
    rows = rows_of(site_report / "index.csv")
    assert len(rows) == 8
    assert {row["answer"] for row in rows} == {"measured", "no train", "not read"}
    (broken,) = (row for row in rows if row["name"] == "broken.npz")
    assert "no readable numpy file" in broken["reason"]
    told = json.loads((site_report / "index.json").read_text(encoding="utf-8"))
    assert told["counts"] == {"measured": 6, "no train": 1, "not read": 1}
    assert told["others"] == ["notes.pdf"]
    (channels,) = (row for row in rows if "channels" in row["name"])
    assert abs(float(channels["speed_kmh"]) / 90.0 - 1.0) < 3e-3
    for one in told["recordings"]:
        for train in one["trains"]:
            assert (site_report / train["page"]).is_file()
            assert (site_report / train["page"]).with_suffix(".json").is_file()


def test_pages_stand_alone_and_show_every_wheel(site_report):
    pages = sorted(site_report.glob("*.html"))
    assert len(pages) == 7
    for file in pages:
        page = Page(file)
        for tag, held in page.elements:
            assert tag not in ("script", "link", "iframe", "object")
            for name in ("src", "href"):
                target = held.get(name, "data:")
                local = re.fullmatch(r"[\w.%-]+\.(html|csv)", target) is not None
                assert target.startswith(("data:", "#")) or (name == "href" and local), target
        assert "prefers-color-scheme: dark" in page.text
        if file.name != "index.html":
            table = rows_of(file.with_suffix(".csv"))
            assert page.wheels() == [f"wheel-{row['axle']}-{row['side']}" for row in table]
            assert len(table) == 24
            assert "vehicle axle side alarms" in " ".join(page.text.split())  # in sight of a narrow window


def test_the_struck_wheel_is_coloured_and_its_evidence_drawn(site_report):
    (file,) = site_report.glob("2026-11-24*.html")
    page = Page(file)
    (struck,) = (held["id"] for _, held in page.elements if held.get("class") == "wheel warning")
    assert struck == "wheel-6-left"  # what strikes exceeds 200 kN, which the peak below 500 Hz does not
    (row,) = (one for one in rows_of(file.with_suffix(".csv")) if one["finding"] == "warning")
    assert float(row["peak_kn"]) < 200.0 < float(row["strike_kn"])
    assert "at least" in page.text
    assert "Not measured" in page.text
    assert "limits a wheel's force at all frequencies; measured was that below 500 Hz" in page.text
    (figure,) = (held["id"] for tag, held in page.elements if tag == "figure")
    assert figure == "evidence-6-left"
    assert "every 2.89 m" in page.text
    (picture,) = (held["src"] for tag, held in page.elements if tag == "img")
    assert picture.startswith("data:image/svg+xml,")


def test_a_wheel_is_known_again_at_its_next_passage(site_report):
    (file,) = site_report.glob("2026-11-24*.html")
    text = " ".join(Page(file).text.split())
    assert re.search(r"4711 wheelset 6 left 3 1\.\d\d 2\.\d\d \+1\.\d\d", text)  # three passages, and rises in the last
    assert "24 of 24 wheels that passed before" in text
    assert "4711 wheelset 6 left" in Page(site_report / "index.html").text


def test_a_wheel_keeps_its_name_where_the_train_goes_back_or_is_turned():
    def axles(direction):
        return [{"vehicle": 1 + n // 2, "direction": direction, "wheels": [{"side": "left"}, {"side": "right"}]}
                for n in range(4)]  # fmt: skip

    names, _ = named_wheels(axles(1), [Identity("A")])
    back, _ = named_wheels(axles(-1), [Identity("A")])
    turned, _ = named_wheels(axles(-1), [Identity("A", turned=True)])
    assert names[1, "left"] == back[4, "left"] == turned[1, "right"] == "A wheelset 1 left"
    assert named_wheels(axles(1), [Identity("B", 2)])[0][4, "right"] == "B wheelset 2 right"
    assert named_wheels(axles(1), [Identity("B", 3)]) == ({}, ["identity B: there is no vehicle 3"])


@pytest.mark.parametrize(
    ("name", "tag"),
    [
        ("a_id=4711.npz", "4711"),
        ("id=IC-7.csv.gz", "IC-7"),
        ("id=7 b", "7"),
        ("id=94.80.npy", "94.80"),
        ("a.npz", None),
    ],
)
def test_tags_in_names_of_files(name, tag):
    assert [one.name for one in tagged(name)] == [tag] * (tag is not None)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("file;id\na.npz;7\nb.npz;8\n", None),
        ("recording,identity,vehicle,turned\na.npz,7,1,yes\na.npz,8,2,\n", None),
        ("file;tag;colour\na;b;c\n", "line 1: found 'file;tag;colour'"),
        ("file,id\na,7\na,8\n", "line 3: found a second identity of a"),
        ("file,id,vehicle\na,7,x\n", "line 2, vehicle: found 'x'"),
        ("file,id,turned\na,7,left\n", "line 2, turned: found 'left'"),
        ("file,id\na,\n", "line 2: found 'a,'"),
    ],
)
def test_tables_of_identities(text, said, tmp_path):
    table = tmp_path / "tags.csv"
    table.write_text(text)
    if said is None:
        assert [one.name for own in read_identities(table).values() for one in own] == ["7", "8"]
    else:
        with pytest.raises(wt.InputError, match=said):
            read_identities(table)


def test_times_of_passages(tmp_path):
    names = ["20261123_081205.npy", "2026-11-23T08-12.npy", "2026-99-23T08-12.npy", "x.npy"]
    for name in names:
        (tmp_path / name).write_bytes(b"x")
        os.utime(tmp_path / name, (0, 86400))
    found = {source.name: source.when for source in sources_in(tmp_path)[0]}
    assert [found[name] for name in names] == [
        ("2026-11-23T08:12:05", True), ("2026-11-23T08:12:00", True), ("1970-01-02T00:00:00", False),
        ("1970-01-02T00:00:00", False),
    ]  # fmt: skip


@pytest.mark.slow
def test_only_what_has_changed_is_answered_again(tmp_path, monkeypatch):
    from wheeltapper.faces.report import run

    folder = tmp_path / "in"
    folder.mkdir()
    for number in range(3):
        written(folder / f"{number}.npz", seed=number)
    asked = []
    answer = run.answer_source
    monkeypatch.setattr(
        run, "answer_source", lambda shared, source: asked.append(source.name) or answer(shared, source)
    )
    assert reported(folder) == 0
    assert reported(folder) == 0
    assert sorted(asked) == ["0.npz", "1.npz", "2.npz"]
    written(folder / "1.npz", seed=7, wagons=2)
    (tmp_path / "out" / "2.npz.html").unlink()
    asked.clear()
    assert reported(folder) == 0
    assert sorted(asked) == ["1.npz", "2.npz"]
    asked.clear()
    assert reported(folder, "--countries", "SE") == 0  # other rules
    assert len(asked) == 3
    (tmp_path / "tags.csv").write_text("file,id\n0.npz,7\n")
    asked.clear()
    assert reported(folder, "--countries", "SE", "--identities", str(tmp_path / "tags.csv")) == 0
    assert asked == ["0.npz"]


DAMAGES = {
    "UPDATE trains SET summary = '{' WHERE train = 2": "train 2 without a whole summary",
    "UPDATE trains SET summary = '[1]' WHERE train = 2": "train 2 without a whole summary",
    "UPDATE trains SET summary = json_remove(summary, '$.axles') WHERE train = 1": "train 1 without a whole summary",
    "UPDATE trains SET number = 'first' WHERE train = 1": "train 1 with numbers for texts, or texts for numbers",
    "UPDATE recordings SET passed = x'ff00' WHERE recording = 2": "recording 2 with numbers for texts",
    "ALTER TABLE wheels RENAME COLUMN speed TO velocity": "a table wheels without speed",
    "ALTER TABLE recordings RENAME COLUMN mark TO marks": "a table recordings without mark",
    "DROP TABLE alarms": "no table alarms",
    "PRAGMA foreign_keys = OFF; DELETE FROM trains WHERE train = 1": "a row of wheels without its row of trains",
    "UPDATE wheels SET told = '{}', identity = 'x' WHERE train = 1": "a wheel of train 1 without all that a model",
    "PRAGMA user_version = 3": "a database with the version 3 and 10 tables",
}  # fmt: skip


def damaged(site_report, tmp_path):
    """Return a copy of a report's database, in one file, and a folder without recordings."""
    (tmp_path / "in").mkdir()
    held = sqlite3.connect(site_report / "findings.db")
    held.execute("VACUUM INTO ?", (str(tmp_path / "held.db"),))
    held.close()
    return tmp_path / "held.db", tmp_path / "in"


def refused_database(folder, file, capsys):
    """Return the one line in which a database is refused."""
    capsys.readouterr()
    assert reported(folder, "--database", str(file)) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert f"{file}: database: found " in line
    return line


@pytest.mark.parametrize(("change", "told"), DAMAGES.items())
def test_a_database_that_was_changed_is_refused_in_one_line(site_report, tmp_path, capsys, change, told):
    file, folder = damaged(site_report, tmp_path)
    assert reported(folder, "--database", str(file)) == 0
    held = sqlite3.connect(file)
    held.executescript(change)
    held.close()
    assert told in refused_database(folder, file, capsys)


def test_a_database_of_an_older_version_is_taken_on(site_report, tmp_path):
    file, folder = damaged(site_report, tmp_path)
    held = sqlite3.connect(file)
    for column in ("model", "size", "told"):
        held.execute(f"ALTER TABLE wheels DROP COLUMN {column}")
    held.execute("PRAGMA user_version = 1")
    (before,) = held.execute("SELECT count(*) FROM wheels").fetchone()
    held.close()
    assert reported(folder, "--database", str(file)) == 0
    assert "4711 wheelset 6 left" in Page(tmp_path / "out" / "index.html").text
    held = sqlite3.connect(file)
    assert held.execute("PRAGMA user_version").fetchone() == (2,)
    assert held.execute("SELECT count(*), count(told) FROM wheels").fetchone() == (before, 0)
    held.close()


@pytest.mark.slow
def test_a_flat_is_followed_over_its_passages_until_the_wheel_is_renewed(tmp_path, monkeypatch):
    from wheeltapper.faces.report import answers

    lengths = [0.030, 0.031, 0.032, 0.033, 0.0, 0.0, 0.0, 0.0]
    folder = tmp_path / "in"
    folder.mkdir()
    for day in range(len(lengths)):
        written(folder / f"2026-11-2{day}T08-12_id=4711.npz", seed=day, wagons=1)

    def with_models(found, *_):
        """Answer as if the site had a track: the third axle's wheel has a flat, or none; others were only looked at."""
        seen = {"fresh_flat_found_from": {"half": 0.015, "nine_tenths": 0.018}}
        for axle in found[0].finding.axles:
            axle["wheels"][0].update(seen)
        length = lengths[int(found[0].finding.name[9])]
        interval = [0.98 * length, 1.02 * length]
        if length:
            found[0].finding.axles[2]["wheels"][0]["finding"] = seen | {
                "verdict": "wheel flat", "probabilities": {"wheel flat": 1.0}, "alike": [], "size": length,
                "size_interval": interval, "size_unit": "m", "largest_force": 2e5,
                "sizes": {"wheel flat": {"size": length, "size_interval": interval}},
                "errors": {"wheel flat": {"own": 0.01, "common": {"contact.constant_per_wheel": 0.01}}},
            }  # fmt: skip
        return found

    monkeypatch.setattr(answers, "with_models", with_models)
    assert reported(folder) == 0
    page = Page(tmp_path / "out" / "index.html")
    assert "Flats over their passages" in page.text
    assert "renewed before 2026-11-24 08:12" in page.text
    dots = [held for tag, held in page.elements if tag == "circle" and held["class"] in ("flaw", "fine")]
    assert [one["class"] for one in dots].count("flaw") == 4
    (flat,) = json.loads((tmp_path / "out" / "index.json").read_text(encoding="utf-8"))["flats"]
    assert flat["identity"].startswith("4711 wheelset")
    assert flat["renewals"] == [4.0]
    assert "renewed before 2026" not in Page(next((tmp_path / "out").glob("2026-11-23*.html"))).text
    before = " ".join(Page(next((tmp_path / "out").glob("2026-11-23*.html"))).text.split())
    assert re.search(r"33\.0 ± \d\.\d 30\.\d ± \d", before)  # mm now, and in 30 days
    held = sqlite3.connect(tmp_path / "out" / "findings.db")
    sizes = held.execute("SELECT model, size FROM wheels WHERE told IS NOT NULL AND size IS NOT NULL").fetchall()
    (healthy,) = held.execute("SELECT count(*) FROM wheels WHERE model = 'healthy'").fetchone()
    held.close()
    assert sizes == [("wheel flat", one) for one in lengths if one]
    assert healthy == 4 * len(lengths) - 4


def test_a_database_with_a_damaged_page_is_refused_when_it_is_opened(site_report, tmp_path, capsys):
    file, folder = damaged(site_report, tmp_path)
    held = sqlite3.connect(file)
    ((first,),) = held.execute("SELECT rootpage FROM sqlite_master WHERE name = 'wheels'").fetchall()
    ((size,),) = held.execute("PRAGMA page_size").fetchall()
    held.close()
    content = bytearray(file.read_bytes())
    content[size * (first - 1) : size * (first - 1) + 64] = bytes(64)
    file.write_bytes(content)
    assert "a damaged file" in refused_database(folder, file, capsys)


def test_a_database_that_another_process_holds_is_not_called_a_foreign_one(site_report, tmp_path, capsys, monkeypatch):
    file, folder = damaged(site_report, tmp_path)
    monkeypatch.setattr(database, "WAITING", 0.1)
    other = sqlite3.connect(file, isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    assert "one that another process has held for 0.1 s; allowed: one process" in refused_database(folder, file, capsys)
    other.execute("ROLLBACK")
    assert reported(folder, "--database", str(file)) == 0


def test_what_is_no_folder_no_database_or_no_site(tmp_path, capsys):
    folder = tmp_path / "in"
    assert reported(folder) == 2
    assert "folder: found no readable folder" in capsys.readouterr().err
    folder.mkdir()
    (tmp_path / "other.db").write_text("no database at all, but a text that is long enough to be taken for one" * 20)
    assert reported(folder, "--database", str(tmp_path / "other.db")) == 2
    assert "database: found a file that is no database of findings" in capsys.readouterr().err
    foreign = sqlite3.connect(tmp_path / "foreign.db")
    foreign.execute("CREATE TABLE a (b)")
    foreign.close()
    assert reported(folder, "--database", str(tmp_path / "foreign.db")) == 2
    assert "found a database with the version 0 and 1 tables" in capsys.readouterr().err
    assert reported(folder, "--every", "2 m") == 2
    assert "--every" in capsys.readouterr().err


def test_a_site_with_seats_alone_has_pages_without_forces(tmp_path):
    site, folder = tmp_path / "site.toml", tmp_path / "in"
    folder.mkdir()
    places = (0.0, 3.0)
    site.write_text("".join(
        f'[[sensor]]\nname = "{name}"\nkind = "pad force"\nside = "left"\nx = {x}\n'
        for name, x in zip("ab", places, strict=True)
    ))  # fmt: skip
    t, channels = np.arange(0.0, 3.0, 1.0 / RATE), {}
    for name, x in zip("ab", places, strict=True):
        where = 20.0 * t - 5.0 - x - np.array([0.0, 9.0, 18.0])[:, None]
        channels[name] = (np.array([[4e4], [2e4], [4e4]]) * np.exp(-((where / 0.6) ** 2))).sum(axis=0)
        channels[name] += 100.0 * np.random.default_rng(1).standard_normal(len(t))
    np.savez(folder / "a.npz", **channels, unit="N", rate=RATE)
    output = tmp_path / "out"
    assert main(["report", str(folder), "--site", str(site), "-o", str(output), "--workers", "1"]) == 0
    page = Page(output / "a.npz.html")
    assert page.wheels() == ["wheel-1-left", "wheel-2-left", "wheel-3-left"]
    assert "No wheel has a force" in page.text
    assert [round(float(row["relative_load"]), 1) for row in rows_of(output / "a.npz.csv")] == [1.0, 0.5, 1.0]


# -- odd entries ------------------------------------------------------------------------------------------------------

ODD = (b"\xff.npz", b"a" * 240 + b".npz", b"index", b"a.npz", b"a.npz.2", b"=HYPERLINK(1).npz", b"line\nbreak.npz")
"""Names of recordings: no UTF-8, too long for its page, that of the index, those of one page, and formulae."""


def odd_recordings(folder, whole):
    """Put a recording under all odd names into a folder."""
    written(whole, wagons=2, flat=(1, "right"))
    for name in ODD:
        place = os.fsencode(folder) + b"/" + name
        if name.endswith(b".npz"):
            shutil.copyfile(os.fsencode(whole), place)
        else:
            os.mkdir(place)
            shutil.copyfile(os.fsencode(whole), place + b"/passage.npz")


def odd_entries(folder):
    """Make what cannot be a recording: links to itself and to nothing, a pipe, an empty and a half-written file."""
    (folder / "loop.csv").symlink_to("loop.csv")
    (folder / "loops").symlink_to("loops")
    (folder / "dangling.npz").symlink_to("nowhere.npz")
    os.mkfifo(folder / "pipe.csv")
    (folder / "empty.npz").write_bytes(b"")
    (folder / "half.npz").write_bytes((folder / "a.npz").read_bytes()[:5000])
    (folder / "empty folder").mkdir()
    shut = folder / "shut"
    shut.mkdir(mode=0)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="file systems elsewhere refuse such names")
def test_odd_names_and_entries_have_rows_and_pages_of_their_own(tmp_path, capsys):
    folder, output = tmp_path / "in", tmp_path / "out"
    folder.mkdir()
    odd_recordings(folder, tmp_path / "whole.npz")
    odd_entries(folder)
    assert reported(folder) == 0
    said = capsys.readouterr()
    assert f"{len(ODD) + 2} recordings: {len(ODD)} measured, 2 not read" in said.out
    told = json.loads((output / "index.json").read_text(encoding="utf-8"))
    pages = {one["name"]: one["trains"][0]["page"] for one in told["recordings"] if one["trains"]}
    assert len(set(pages.values())) == len(ODD)
    for name, page in pages.items():
        assert len(Page(output / page).wheels()) == 16, name
    assert "index.html" not in pages.values()
    assert sorted(told["others"]) == ["dangling.npz", "empty folder", "loop.csv", "loops", "pipe.csv", "shut"]
    (formula,) = (row["name"] for row in rows_of(output / "index.csv") if "HYPERLINK" in row["name"])
    assert formula.startswith("'=")
    changed = {page: (output / page).stat().st_mtime_ns for page in pages.values()}
    assert reported(folder) == 0  # whatever is answered is not answered again
    assert changed == {page: (output / page).stat().st_mtime_ns for page in pages.values()}


def test_a_second_report_with_the_same_findings_is_refused(tmp_path, capsys):
    folder, findings = tmp_path / "in", tmp_path / "out" / "findings.db"
    folder.mkdir()
    assert reported(folder) == 0
    with locked(findings):
        assert reported(folder) == 2
    assert "findings.db: database: found a file that another process is filling" in capsys.readouterr().err
    assert reported(folder) == 0


# -- watching, and being killed ---------------------------------------------------------------------------------------

KILLS = int(os.environ.get("WHEELTAPPER_KILLS", "10"))
"""Of the command; each costs a start of a process."""


@pytest.mark.whole
@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="file systems elsewhere refuse such names")
def test_every_recording_is_answered_once_however_often_the_command_is_killed(tmp_path):
    folder, output, before = tmp_path / "in", tmp_path / "out", tmp_path / "all"
    folder.mkdir()
    before.mkdir()
    for number in range(60):
        if number % 10 == 9:
            (before / f"{number:02}.npz").write_bytes(b"PK")
        else:
            written(before / f"{number:02}.npz", seed=number, wagons=2, flat=(number % 8, "right"))
    files, rng, pages, said = sorted(before.iterdir()), random.Random(1), [], []
    odd_recordings(folder, tmp_path / "whole.npz")
    odd_entries(folder)
    watching = [sys.executable, "-m", "wheeltapper.faces.cli", "report", str(folder), "--site", str(SITE), "--output",
                str(output), "--database", str(tmp_path / "findings.db"), "--workers", "1"]  # fmt: skip
    os.rename(files[0], folder / files[0].name)
    begun = time.monotonic()
    assert subprocess.run(watching, capture_output=True, check=False).returncode == 0
    start = time.monotonic() - begun
    for number in range(KILLS):
        for file in files[1 + 59 * number // KILLS : 1 + 59 * (number + 1) // KILLS]:
            os.rename(file, folder / file.name)
        with subprocess.Popen(
            [*watching, "--watch", "--every", "10 ms"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        ) as process:
            if number % 2:  # at any moment of a start
                time.sleep(start * rng.uniform(0.0, 1.5))
            else:  # at any moment of the work: a recording at least is new
                said.append(process.stdout.readline().strip())
                time.sleep(rng.uniform(0.0, 0.1 * start))
            process.kill()
            said += process.communicate()[0].splitlines()
        assert process.returncode == -signal.SIGKILL  # it was at work
        pages.append(len(list(output.glob("*.html"))))
    assert subprocess.run(watching, stderr=subprocess.PIPE, check=False).returncode == 0
    assert len(set(pages)) >= KILLS / 2  # all kills but those of starts came amid the work
    assert len(said) == len(set(said))  # an answer that is kept is not given again
    held = sqlite3.connect(tmp_path / "findings.db")
    assert held.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
    assert held.execute("PRAGMA foreign_key_check").fetchall() == []
    assert held.execute("SELECT count(*), count(DISTINCT name) FROM recordings").fetchone() == (69, 69)
    assert held.execute("SELECT answer, count(*) FROM recordings GROUP BY 1 ORDER BY 1").fetchall() == [
        ("measured", 61), ("not read", 8),
    ]  # fmt: skip
    assert held.execute("SELECT count(*) FROM trains").fetchone() == (61,)
    assert held.execute("SELECT DISTINCT n FROM (SELECT count(*) AS n FROM wheels GROUP BY train)").fetchall() == [
        (16,)
    ]
    struck = "SELECT count(DISTINCT train) FROM wheels WHERE strikes > 0"
    assert held.execute(struck).fetchone() == (61,)
    held.close()
    assert len(list(output.glob("*.html"))) == 62
    assert len(rows_of(output / "index.csv")) == 69


@pytest.mark.slow
def test_watching_takes_a_file_once_it_has_stopped_growing(tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    whole = tmp_path / "whole.npz"
    written(whole, wagons=2)
    process = subprocess.Popen(
        [sys.executable, "-m", "wheeltapper.faces.cli", "report", str(folder), "--site", str(SITE), "-o",
         str(tmp_path / "out"), "--watch", "--every", "0.3 s", "--workers", "1"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT,
    )  # fmt: skip
    try:
        index = tmp_path / "out" / "index.html"
        until(index.exists)
        content = whole.read_bytes()
        with (folder / "a.npz").open("wb") as growing:
            for part in range(8):
                growing.write(content[len(content) * part // 8 : len(content) * (part + 1) // 8])
                growing.flush()
                time.sleep(0.1)
        until((tmp_path / "out" / "a.npz.html").exists)
        until(lambda: "measured" in index.read_text(encoding="utf-8"))
    finally:
        process.send_signal(2)
        said, errors = process.communicate(timeout=60)
    assert process.returncode == 3, errors
    assert said.splitlines() == ["a.npz: measured"]  # once, and never as a broken file
    assert "the same command goes on" in errors


def until(holds):
    ends = time.monotonic() + 120.0
    while not holds():
        assert time.monotonic() < ends
        time.sleep(0.05)


# -- a browser --------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.skipif(not any(map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), reason="no browser")
def test_a_browser_shows_a_page_and_prints_it(site_report, tmp_path):
    program = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    (file,) = site_report.glob("2026-11-24*.html")
    options = [program, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={tmp_path / 'user'}",
               "--host-resolver-rules=MAP * ~NOTFOUND"]  # fmt: skip
    shown = subprocess.run(
        [*options, "--dump-dom", file.as_uri()], capture_output=True, text=True, timeout=300, check=True
    )
    assert shown.stdout.count('class="wheel ') == 24
    subprocess.run([*options, f"--print-to-pdf={tmp_path / 'page.pdf'}", file.as_uri()], timeout=300, check=True,
                   capture_output=True)  # fmt: skip
    assert (tmp_path / "page.pdf").read_bytes().startswith(b"%PDF")


# -- mutilated recordings ---------------------------------------------------------------------------------------------

CLOCKS = "clocks run apart|clock is wrong|clocks or places|lost in"


def cut(channels, rng):
    name = rng.choice(list(channels))
    whole = channels[name]
    return channels | {name: whole[: int(len(whole) * rng.uniform(0.3, 0.85))]}, f"channel '{name}' ends at"


def drifting(channels, rng):
    name, rate = rng.choice(list(channels)), 1.0 + rng.choice([-1, 1]) * rng.uniform(2e-3, 2e-2)
    whole = channels[name]
    return channels | {name: np.interp(np.arange(len(whole)) * rate, np.arange(len(whole)), whole)}, CLOCKS


def ten_times(channels, rng):
    name, factor = rng.choice(list(channels)), rng.choice([0.1, 10.0])
    return channels | {name: factor * channels[name]}, f"channel '{name}' reads .* does not count"


def without_signs(channels, rng):
    name = rng.choice(list(channels))
    counts = np.rint(channels[name] / 10.0)
    if rng.random() < 0.5:
        return channels | {name: -channels[name]}, f"channel '{name}': axles press downwards"
    return channels | {name: 10.0 * (counts % 65536)}, f"channel '{name}': .* jumps"


def swapped(channels, rng):
    number = rng.integers(1, 4)
    a, b = f"left {number}", f"right {number}"
    return channels | {a: channels[b], b: channels[a]}, f"channel '{a}' shows the wheels of the right rail"


MUTILATIONS = [cut, drifting, ten_times, without_signs, swapped]


@pytest.mark.whole
@pytest.mark.slow
def test_two_hundred_mutilated_recordings_have_honest_rows(tmp_path):
    folder, expected = tmp_path / "in", {}
    folder.mkdir()
    whole = {}
    for number in range(200):
        rng = np.random.default_rng(number)
        speed, wagons = float(rng.choice([12.0, 20.0, 35.0])), int(rng.integers(2, 5))
        if (speed, wagons) not in whole:
            whole[speed, wagons] = plain_train(SENSORS, speed=speed, wagons=wagons, noise=1500.0, seed=number)
        channels, said = MUTILATIONS[number % 5](whole[speed, wagons], rng)
        expected[f"{number:03}.npz"] = said, speed, wagons
        np.savez(folder / f"{number:03}.npz", **channels, unit="N", rate=RATE)
    assert reported(folder) == 0
    told = json.loads((tmp_path / "out" / "index.json").read_text(encoding="utf-8"))["recordings"]
    assert sorted(one["name"] for one in told) == sorted(expected)
    wrong = [why for one in told if (why := dishonest(one, *expected[one["name"]], tmp_path / "out"))]
    assert not wrong, "\n".join(wrong)


def dishonest(one, said, speed, wagons, output):
    """Return what is wrong with the row of a recording; nothing, if it says what can be known."""
    if one["answer"] != "measured" or len(one["trains"]) != 1:
        return f"{one}"
    (train,) = one["trains"]
    notes, off = "\n".join(train["notes"]), train["speed_kmh"] / 3.6 / speed - 1.0
    told = re.search(said, notes) or (said == CLOCKS and abs(off) < 3e-3)  # so small that the speed bears it
    if train["axles"] != 4 * wagons or not told:
        return f"{one['name']}: {train['axles']} axles of {4 * wagons}, {said!r} not in {train['notes']}"
    if abs(off) > 5e-3 and "speeds are uncertain" not in notes:
        return f"{one['name']}: speed off by {off:.1e}, {train['notes']}"
    if "shows the wheels" in notes and "shows the wheels" not in said:
        return f"{one['name']}: sides are accused, {train['notes']}"
    known, bar = np.random.default_rng(77), 0.05 if said == CLOCKS else 0.02  # forces are as uncertain as speeds
    loads = {side: known.uniform(40, 110, 4 * wagons) for side in ("left", "right")}
    for row in rows_of(output / f"{one['name']}.csv"):  # the channels that are left show the loads
        true = loads[row["side"]][int(row["axle"]) - 1]
        if abs(float(row["static_kn"]) / true - 1.0) > bar:
            return f"{one['name']}: {row['static_kn']} kN of {true}, {train['notes']}"
    return ""

"""The explorer's server: who may talk to it, what it answers, and that no scene is lost."""

import gzip
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.registry import unregister
from wheeltapper.faces.cli import main
from wheeltapper.faces.explore.drops import safe_name
from wheeltapper.faces.explore.form import changed, form_of
from wheeltapper.faces.explore.frames import Frame, decoded
from wheeltapper.faces.explore.launch import Explorer
from wheeltapper.faces.explore.paths import Files
from wheeltapper.faces.explore.sampling import Shown, run_frame, surface_frame
from wheeltapper.faces.explore.scenes import python_of, start_scene, table_of, toml_of

from .pages import EXTRA, Page, origin, request

pytestmark = EXTRA
ROOT = Path(__file__).parents[2]
SCENES = sorted(path for path in (ROOT / "examples").glob("*.toml") if "[vehicle" in path.read_text("utf-8"))
PAGE = ROOT / "src" / "wheeltapper" / "faces" / "explore" / "page"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("explorer") / "inside"


@pytest.fixture(scope="module")
def explorer(folder: Path) -> Iterator[Explorer]:
    folder.mkdir()
    (folder.parent / "secret.csv").write_text("x [m];z [mm]\n0;0\n1;0\n")
    held = Explorer(start_scene(), folder=folder).start()
    yield held
    held.close()


# -- who may talk to it ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("host", ["evil.example", "evil.example:8377", "127.0.0.1", "127.0.0.1:1", "[::1]:8377", ""])
def test_a_foreign_host_is_refused(explorer: Explorer, host: str) -> None:
    answer = request(explorer, headers={"Host": host})
    assert answer.status in (400, 403)
    assert b"wheeltapper" not in answer.body


@pytest.mark.parametrize("path", ["", "page/main.js", "lib/bokeh.min.js", "export/x/scene.toml"])
def test_a_foreign_origin_is_refused(explorer: Explorer, path: str) -> None:
    for foreign in ("https://evil.example", "null", f"http://127.0.0.1:{explorer.port + 1}"):
        assert request(explorer, path, headers={"Origin": foreign}).status == 403


@pytest.mark.parametrize("token", ["", "x", "page", ".."])
def test_an_address_without_the_token_is_refused(explorer: Explorer, token: str) -> None:
    for path in ("", "page/main.js", "export/x/scene.toml"):
        assert request(explorer, path, token=token).status == 403


def test_a_file_from_nowhere_is_refused(explorer: Explorer) -> None:
    assert request(explorer, "drop?session=x&name=a.csv", "POST").status == 403


def test_a_connection_from_elsewhere_is_refused(explorer: Explorer) -> None:
    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect

    address = explorer.address.replace("http:", "ws:") + "link"
    for where, given in (
        (address, "https://evil.example"), (address, None),
        (f"ws://127.0.0.1:{explorer.port}/x/link", origin(explorer)),
    ):  # fmt: skip
        with pytest.raises(InvalidStatus) as refused, connect(where, origin=given):  # type: ignore[arg-type]
            pass
        assert refused.value.response.status_code == 403


@pytest.mark.parametrize(
    "path", ["page/../server.py", "page/%2e%2e/server.py", "page/..%2fserver.py", "lib/bokeh.json", "server.py", "../"]
)
def test_nothing_but_the_page_is_served(explorer: Explorer, path: str) -> None:
    assert request(explorer, path).status in (403, 404)


def test_the_page_and_all_that_it_loads_are_served_and_come_from_nowhere_else(explorer: Explorer) -> None:
    page = request(explorer)
    assert page.status == 200
    policy = page.headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe-eval" not in policy
    text = page.body.decode()
    loaded = re.findall(r'(?:src|href)="((?:page|lib)/[^"]+)"', text)
    modules = {
        name for path in PAGE.glob("*.js") for name in re.findall(r'from "\./(\w+\.js)"', path.read_text("utf-8"))
    }
    for path in [*loaded, *(f"page/{name}" for name in modules)]:
        assert request(explorer, path).status == 200, path
    for path in PAGE.iterdir():
        foreign = set(re.findall(r"https?://[^\s\"'`]+", path.read_text("utf-8"))) - {"http://www.w3.org/2000/svg"}
        assert not foreign, path.name


@pytest.mark.parametrize("path", ["../secret.csv", "/etc/passwd", "a/../../secret.csv", "\0", "~/x.csv/../../../x"])
def test_files_outside_the_working_folder_are_refused(explorer: Explorer, path: str) -> None:
    with Page(explorer) as page:
        before = page.scene["table"]
        for edit in (
            {"do": "set", "path": "irregularity.0", "value": {"type": "Measured", "path": path, "noise": 1e-6}},
            {"do": "bring", "scene": before | {"irregularity": [{"type": "Measured", "path": path, "noise": 1e-6}]}},
            {"do": "set", "path": "profiles.wheel", "value": path},
        ):
            page.socket.send(json.dumps(edit))
            refused, _ = page.next("refused")
            assert "the working folder" in refused["lines"][0][1] or "regular" in refused["lines"][0][1]
            page.scene, _ = page.next("scene")
            assert page.scene["table"] == before


def test_a_file_that_the_first_scene_names_may_be_anywhere(tmp_path: Path) -> None:
    given = {"irregularity": [{"type": "Measured", "path": "elsewhere.csv"}]}
    assert Files(tmp_path, given).path("elsewhere.csv", "path") == Path("elsewhere.csv")
    with pytest.raises(wt.InputError, match="the working folder"):
        Files(tmp_path, given).path("/elsewhere.csv", "path")


def test_names_of_dropped_files_lose_their_folders() -> None:
    assert safe_name("../../etc/passwd") == "passwd"
    assert safe_name("C:\\x\\rec ording.csv") == "rec ording.csv"
    assert safe_name("..") == "file"
    assert "/" not in safe_name("a/\0b?.csv")


# -- what it answers ---------------------------------------------------------------------------------------------------


def test_the_page_draws_what_simulate_returns(explorer: Explorer) -> None:
    record = wt.simulate(start_scene())
    with Page(explorer) as page:
        time = page.arrays[page.run["time"]]
        force = page.arrays[page.run["force"]["lines"][0]["values"]] / page.run["force"]["factor"]
        marks = {name: page.arrays[number] for name, number in page.run["events"][0].items() if name != "name"}
        spectrum = page.run["spectrum"]
        level = page.arrays[spectrum["y"]]
    assert page.run["summary"] == str(record)
    np.testing.assert_allclose(force, record.at(time).normal_force.values, rtol=1e-12)
    assert force.max() == pytest.approx(float(record.peaks.normal_force.max()), rel=1e-12)
    kinds, when = record.events.kind.values, record.events.time.values
    np.testing.assert_allclose(marks["from"], when[kinds == "loss"])
    np.testing.assert_allclose(marks["impacts"], when[kinds == "impact"])
    assert np.all(marks["to"] > marks["from"])
    assert level.max() > 0.0


def test_the_spectrum_of_a_sine_has_its_amplitude_at_its_frequency() -> None:
    from wheeltapper.faces.explore.sampling import SPECTRUM, Channel, Part, _spectrum_panel

    end, frequency, amplitude = 0.5, 240.0, 3.0
    time = np.arange(SPECTRUM) * end / SPECTRUM
    force = 7.0 + amplitude * np.sin(2 * np.pi * frequency * time)
    data = {"normal_force": (("time",), force), "time": (("time",), time)}
    frame = Frame("run")
    channel = Channel("normal_force", "normal_force", "", "", "", {})
    panel = _spectrum_panel(frame, end, Part(data), {"normal_force": channel}, "normal_force")
    _, arrays = decoded(frame.encoded())
    found = arrays[panel["y"]].argmax()
    assert arrays[panel["x"]][found] == pytest.approx(frequency)
    assert arrays[panel["y"]][found] == pytest.approx(amplitude, rel=1e-3)


def test_every_contact_has_its_losses_and_impacts_and_each_wheel_its_own_tread() -> None:
    flat = wt.Scenario.from_toml(ROOT / "examples" / "flat_on_ballast.toml")
    row = {"type": "Wheelsets", "wheelsets": [flat.vehicle] * 2, "positions": [0.0, -2.56]}
    second = {"wheelset 2": [wt.WheelFlat(length="60 mm", position=1.8)]}
    record = wt.simulate(flat.replaced({"vehicle": row, "irregularity": second, "duration": 0.3}))
    head, arrays = decoded(run_frame(record, Shown(), 1).encoded())
    assert [one["name"] for one in head["events"]] == ["1", "2"]
    for number, marks in enumerate(head["events"], start=1):
        mine = record.events.wheelset.values == number
        for name, kind in (("from", "loss"), ("impacts", "impact")):
            when = record.events.time.values[mine & (record.events.kind.values == kind)]
            np.testing.assert_allclose(arrays[marks[name]], when)
    assert len(arrays[head["events"][1]["impacts"]]) > 0, "the flat strikes"
    surface, arrays = decoded(surface_frame(record).encoded())
    depths = [np.ptp(arrays[number]) for number in surface["wheels"]]
    assert depths[0] == 0.0
    assert depths[1] > 1e-4


def test_of_a_wagon_the_side_that_meets_the_irregularity_is_drawn() -> None:
    record = wt.simulate(wt.Scenario.from_toml(ROOT / "examples" / "coach_step.toml").replaced({"duration": 0.03}))
    head, arrays = decoded(run_frame(record, Shown(), 1).encoded())
    assert head["motion"]["side"] == "right"
    force = record.at(arrays[head["motion"]["time"]]).normal_force.sel(wheelset=1, side="right")
    np.testing.assert_allclose(arrays[head["motion"]["wheels"][0]["force"]], force)
    assert head["below"]["key"].endswith("motion=z")
    surface, arrays = decoded(surface_frame(record).encoded())
    assert arrays[surface["rail"]].max() == pytest.approx(1e-4)


def test_of_many_edits_the_last_one_is_shown(explorer: Explorer) -> None:
    with Page(explorer) as page:
        for damping in np.linspace(1e4, 9e4, 40):
            page.send("set", path="vehicle.damping", value=float(damping), settled=False)
        page.send("set", path="vehicle.damping", value="77 kN s/m")
        page.scene, _ = page.next("scene")
        assert page.scene["table"]["vehicle"]["damping"] == 77e3
        assert page.set("vehicle.mass", "1.6 t")["vehicle"]["mass"] == 1600.0
    assert page.run["summary"] == str(
        wt.simulate(start_scene().replaced({"vehicle.damping": 77e3, "vehicle.mass": 1600.0}))
    )


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("vehicle.mass", -1.0, "greater than 0"),
        ("vehicle.mass", "nan", "mass"),
        ("vehicle.mass", "1e999", "mass"),
        ("vehicle.mass", "12 kN", "not a mass"),
        ("vehicle.mass", None, "mass"),
        ("vehicle.mass", [1, 2], "mass"),
        ("vehicle.mess", 1.0, "no such field"),
        ("speed", 0.0, "0 m/s"),
        ("duration", 1e12, "duration"),
        ("track", {"type": "Nothing"}, "type"),
        ("irregularity.7", {"type": "Step"}, "no such field"),
        ("vehicle", {"type": "ErriB176"}, "contact.constant"),
        ("", 1.0, "path"),
    ],
)
def test_absurd_values_are_refused_beside_their_field_and_nothing_is_lost(
    explorer: Explorer, path: str, value: Any, said: str
) -> None:
    with Page(explorer) as page:
        before = page.scene["table"]
        page.send("set", path=path, value=value)
        refused, _ = page.next("refused")
        assert said in refused["lines"][0][0] + refused["lines"][0][1]
        assert "\n" not in refused["lines"][0][1]
        page.send("back")
        assert page.set("vehicle.mass", 1500.0)["vehicle"] == before["vehicle"]


def test_what_no_page_sends_ends_the_connection_and_not_the_server(explorer: Explorer) -> None:
    from websockets.exceptions import ConnectionClosed

    odd = ('{"do": "look", "seq": "abc"}', '{"do": "look", "seq": 1e400}', "[" * 200_000, '{"do":' * 100_000)
    for text in ("{", "[]", '"x"', *odd):
        with Page(explorer) as page:
            page.socket.send(text)
            with pytest.raises(ConnectionClosed) as closed:
                page.next("nothing")
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 4400
    with Page(explorer) as page:
        assert page.run["summary"]


def test_a_change_can_be_undone_and_done_again(explorer: Explorer) -> None:
    with Page(explorer) as page:
        page.set("speed", 7.0)
        for do, speed in (("back", 9.0), ("forth", 7.0)):
            page.send(do)
            page.scene, _ = page.next("scene")
            assert page.scene["table"]["speed"] == speed


# -- pages -------------------------------------------------------------------------------------------------------------


def test_two_pages_have_scenes_of_their_own(explorer: Explorer) -> None:
    with Page(explorer) as one, Page(explorer) as other:
        one.set("speed", 6.0)
        assert other.set("vehicle.mass", 1400.0)["speed"] == 9.0
        assert one.set("vehicle.damping", 3e4)["vehicle"]["mass"] == 1500.0


def test_a_page_that_is_loaded_again_finds_its_scene(explorer: Explorer) -> None:
    with Page(explorer) as page:
        page.set("speed", 6.5)
    with Page(explorer, session=page.hello["session"]) as again:
        assert again.hello["session"] == page.hello["session"]
        assert again.scene["table"]["speed"] == 6.5
        with Page(explorer, session=again.hello["session"]) as copy:  # the same tab, doubled
            assert copy.hello["session"] != again.hello["session"]
            assert copy.scene["table"]["speed"] == 6.5
            copy.set("speed", 5.0)
        assert again.set("vehicle.mass", 1450.0)["speed"] == 6.5


def test_a_new_server_takes_the_scene_that_the_page_has_kept(explorer: Explorer, tmp_path: Path) -> None:
    with Page(explorer) as page:
        kept = page.set("speed", 6.25)
    with Explorer(None, folder=tmp_path).start() as other, Page(other, session="before", scene=kept) as page:
        assert page.scene["table"] == kept
        assert other.scenario == wt.Scenario.of(kept)


def test_a_kept_scene_that_is_none_any_more_is_told_in_a_line(explorer: Explorer) -> None:
    with Page(explorer, scene={"vehicle": {"type": "Hovercraft"}}) as page:
        assert "cannot be brought back" in page.hello["line"]
        assert page.scene["table"] == table_of(start_scene())


# -- the map -----------------------------------------------------------------------------------------------------------


@pytest.mark.filterwarnings("ignore:the irregularity is more sharply hollow")
def test_the_map_is_what_sweep_returns_and_so_are_its_arrows(explorer: Explorer) -> None:
    size, low, high = 16, (6.0, 1e-4), (12.0, 3e-4)
    values = np.full((size, size), np.nan)
    with Page(explorer) as page:
        axes = [
            {"path": path, "low": low[i], "high": high[i]} for i, path in enumerate(("speed", "irregularity.0.height"))
        ]
        page.send("map", number=3, feature="largest_force", x=axes[0], y=axes[1], size=size)
        done = 0
        while done < size**2:
            tile, arrays = page.next("map tile")
            done = tile["done"]
            assert tile["number"] == 3
            rows, columns = slice(*tile["rows"]), slice(*tile["columns"])
            values[rows, columns] = arrays[tile["values"]].reshape(values[rows, columns].shape)
        arrows, arrays = page.next("map arrows")
        session = page.hello["session"]
        x, y, by_x = (arrays[arrows[name]] for name in ("x", "y", "by_x"))
        speeds, heights = (low[i] + (high[i] - low[i]) * (np.arange(size) + 0.5) / size for i in range(2))
        found = wt.sweep(start_scene(), {"irregularity.0.height": heights, "speed": speeds}, ["largest_force"])
        np.testing.assert_allclose(values, found.largest_force.values, rtol=1e-13)  # lanes of tiles round otherwise
        one = wt.gradient(
            start_scene().replaced({"speed": float(x[5]), "irregularity.0.height": float(y[5])}),
            "largest_force",
            ["speed"],
        )
        assert by_x[5] == pytest.approx((high[0] - low[0]) * float(one.largest_force_gradient[0]), rel=1e-9)
        assert request(explorer, f"export/{session}/map.nc").status == 200


def test_a_map_of_one_field_or_of_nonsense_is_refused_in_a_line(explorer: Explorer) -> None:
    good = {"path": "speed", "low": 6.0, "high": 9.0}
    with Page(explorer) as page:
        for x, y, size, feature in (
            (good, good, 8, "largest_force"), (good, {"path": "vehicle.mass", "low": 2, "high": 1}, 8, "largest_force"),
            (good, {"path": "vehicle.mass", "low": 1000, "high": 2000}, 10**6, "largest_force"),
            (good, {"path": "vehicle.wheels", "low": 1, "high": 2}, 8, "largest_force"), (good, None, 8, "x"),
            (good, {"path": "vehicle.mass", "low": 1000, "high": 2000}, 8, "largest_farce"),
        ):  # fmt: skip
            page.send("map", number=1, feature=feature, x=x, y=y, size=size)
            assert page.next("map refused")[0]["line"]


# -- the form, and what can be taken -----------------------------------------------------------------------------------


def quantities(entry: dict[str, Any]) -> Iterator[dict[str, Any]]:
    if entry["kind"] == "quantity":
        yield entry
    for held in [*entry.get("fields", ()), *entry.get("items", ())]:
        yield from quantities(held)


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_every_continuous_field_has_a_unit_and_a_range_about_its_value(path: Path) -> None:
    scene = wt.Scenario.from_toml(path)
    found = [entry for entry in quantities(form_of(scene)) if entry["value"] is not None]
    assert len(found) > 8
    for number, entry in enumerate(found):
        assert entry["low"] <= entry["value"] <= entry["high"], entry["path"]
        assert entry["low"] < entry["high"]
        shown = f"{entry['value'] / entry['factor']!r} {entry['unit']}"
        if entry["unit"] and number % (1 + len(found) // 12) == 0 and not entry["path"].startswith("profiles."):
            again = scene.replaced({entry["path"]: shown})
            assert {e["path"]: e["value"] for e in quantities(form_of(again))}[entry["path"]] == pytest.approx(
                entry["value"]
            )


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_the_copied_program_and_file_make_the_same_scene(path: Path, tmp_path: Path) -> None:
    scene = wt.Scenario.from_toml(path)
    names: dict[str, Any] = {}
    exec(python_of(scene).partition("record =")[0], names)
    assert names["scenario"] == scene
    (tmp_path / "scene.toml").write_text(toml_of(scene), encoding="utf-8")
    assert wt.Scenario.from_toml(tmp_path / "scene.toml") == scene


def test_a_noun_that_is_registered_anywhere_is_offered_with_its_fields() -> None:
    from wheeltapper.describe.irregularity.base import Irregularity
    from wheeltapper.describe.noun import PositiveLength

    class Dent(Irregularity):
        """A dent of a test.

        Parameters
        ----------
        depth
            How deep it is, m.
        """

        example = {"depth": 1e-4}  # noqa: RUF012 - as all irregularities have it
        depth: PositiveLength

    try:
        offered = next(entry for entry in form_of(start_scene())["fields"] if entry["path"] == "irregularity")
        assert "Dent" in offered["types"]
        scene = changed(start_scene(), "irregularity.0", {"type": "Dent"})
        depth = next(entry for entry in quantities(form_of(scene)) if entry["path"] == "irregularity.0.depth")
        assert (depth["value"], depth["unit"], depth["description"]) == (1e-4, "mm", "How deep it is, m.")
    finally:
        unregister(Dent)


def test_another_kind_keeps_what_it_shares_with_the_one_before() -> None:
    scene = changed(start_scene(), "irregularity.0.height", "0.3 mm")
    weld = changed(scene, "irregularity.0", {"type": "Step"})
    assert weld.irregularity[0].height == pytest.approx(3e-4)
    assert weld.irregularity[0].position == wt.irregularities.Step.example["position"]
    assert isinstance(changed(scene, "contact", {"type": "Linear"}).contact, wt.Linear)


@pytest.mark.slow
def test_everything_that_can_be_taken_holds_the_scene_of_the_page(explorer: Explorer, tmp_path: Path) -> None:
    with Page(explorer) as page:
        page.set("speed", 8.0)
        key = page.hello["session"]
        taken = {
            name: request(explorer, f"export/{key}/{name}") for name, _ in page.hello["exports"] if "map" not in name
        }
        bodies = {name: answer.body for name, answer in taken.items()}
    assert {answer.status for answer in taken.values()} == {200}
    (tmp_path / "record.nc").write_bytes(bodies["record.nc"])
    loaded = wt.load(tmp_path / "record.nc")
    assert isinstance(loaded, wt.Record)
    assert loaded.scenario.speed == 8.0
    head, first = bodies["history.csv"].decode().split("\n")[:2]
    assert head.startswith("time [s],wheel_displacement [m]")
    assert len(first.split(",")) == len(head.split(","))
    assert bodies["events.csv"].decode().startswith("time [s],kind")
    assert bodies["run.png"].startswith(b"\x89PNG")
    assert b"<svg" in bodies["run.svg"]
    assert request(explorer, f"export/{key}/../../secret").status in (403, 404)
    assert request(explorer, f"export/{key}/passwd").status == 400
    assert request(explorer, "export/none/scene.toml").status == 404


@pytest.mark.slow
def test_a_dropped_scenario_becomes_the_scene_and_other_files_are_told_in_a_line(explorer: Explorer) -> None:
    with Page(explorer) as page:

        def drop(name: str, body: bytes) -> tuple[int, dict[str, Any]]:
            where = f"drop?session={page.hello['session']}&name={name}"
            answer = request(explorer, where, "POST", {"Origin": origin(explorer)}, body)
            return answer.status, json.loads(answer.body)

        status, told = drop("flat.toml", (ROOT / "examples" / "wheel_flat.toml").read_bytes())
        assert (status, told["scene"]) == (200, True)
        page.send("show")
        assert page.next("scene")[0]["table"]["irregularity"][0]["type"] == "WheelFlat"
        for name, body, said in (
            ("x.exe", b"MZ", "suffix"), ("x.toml", b"[", "TOML"), ("x.toml", b"speed = 1", "vehicle"),
            ("site.toml", b'[passage]\n[[passage.irregularity]]\ntype="Measured"\npath="../../secret.csv"', "folder"),
        ):  # fmt: skip
            status, told = drop(name, body)
            assert status == 400
            assert said in told["wrong"]
        assert drop("recording.csv", b"t;a\n")[1]["words"].startswith("recording.csv is kept")
        assert drop("site.toml", (ROOT / "examples" / "site.toml").read_bytes())[0] == 400  # that file is no recording
        status, told = drop("long.csv.gz", gzip.compress(b"a [g]\n" + b"0.1234567\n" * 10_000_000, compresslevel=1))
        assert (status, "up to 2000000 samples on a page" in told["wrong"]) == (400, True)


def test_numbers_that_are_none_are_null_in_a_frame() -> None:
    frame = Frame("x", value=np.float64("nan"), held=[np.int64(3), float("inf")])
    frame.head["array"] = frame.array(np.arange(3.0))
    head, arrays = decoded(frame.encoded())
    assert (head["value"], head["held"]) == (None, [3, None])
    np.testing.assert_array_equal(arrays[head["array"]], [0.0, 1.0, 2.0])


# -- the door ----------------------------------------------------------------------------------------------------------


def test_without_the_extra_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.setattr("wheeltapper.faces.explore.launch.find_spec", lambda name: None if name == "bokeh" else name)
    assert main(["explore", "--no-browser"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "pip install 'wheeltapper[explore]'" in said


def test_a_port_that_is_taken_is_told_in_a_line(explorer: Explorer, capsys: Any) -> None:
    assert main(["explore", "--no-browser", "--port", str(explorer.port)]) == 2
    assert "a free port" in capsys.readouterr().err


def test_a_file_that_is_none_is_told_before_anything_begins(capsys: Any) -> None:
    assert main(["explore", "nothing.toml", "--no-browser"]) == 2
    assert "no readable file" in capsys.readouterr().err

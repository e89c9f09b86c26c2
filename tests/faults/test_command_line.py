"""The command line: wrong usage is one line with exit code 2; Ctrl-C is one line with exit code 3, at any moment."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from wheeltapper.faces.cli import main

ROOT = Path(__file__).parents[2]
BUMP = str(ROOT / "examples" / "bump.toml")


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (("run", BUMP, "--plto", "x.png"), ("run: --plto", "unknown", "--output", "did you mean '--plot'?")),
        (("run", BUMP, "--plto=x.png"), ("run: --plto", "did you mean '--plot'?")),
        (("run", BUMP, "--plot"), ("run: --plot: found nothing", "a picture here")),
        (("run",), ("run: FILE: found nothing", "a scenario in TOML")),
        (("run", BUMP, "other.toml"), ("'other.toml' left over", "run --help")),
        (("rum", BUMP), ("command: found 'rum'", "sweep", "did you mean 'run'?")),
        (("--versoin",), ("found '--versoin'", "did you mean '--version'?")),
        (("diagnose", "axle.csv"), ("diagnose: --site: found nothing", "the site in TOML")),
        (("schema", "sitte"), ("found 'sitte'", "scenario, site", "did you mean 'site'?")),
        (("wear", BUMP, "--output", "x.nc", "--passes", "many"), ("--passes: found 'many'", "a whole number")),
        (("wear", BUMP, "--output", "x.nc", "--passes", "2.5"), ("--passes: found '2.5'", "a whole number")),
        (
            ("wear", BUMP, "--output", "x.nc", "--passes", "2", "--hardening", "x"),
            ("--hardening: found 'x'", "a number"),
        ),
        (("completion",), ("completion: SHELL: found nothing", "bash, zsh or fish")),
        (("paper", "fig3"), ("paper: found 'fig3'", "fig2, fig2b", "C01 to C65", "did you mean")),
        (("paper", "C9"), ("paper: found 'C9'", "did you mean 'C59'?")),
    ],
)
def test_wrong_usage_is_one_line_that_says_what_is_allowed(arguments, parts, capsys):
    assert main(list(arguments)) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("wheeltapper: ")
    assert said.err.count("\n") == 1
    for part in parts:
        assert part in said.err
    assert len(said.err) < 400


@pytest.mark.slow
def test_the_result_is_one_json_object(tmp_path, capsys):
    file, output, picture = tmp_path / "scene.toml", tmp_path / "record.nc", tmp_path / "picture.png"
    text = Path(BUMP).read_text(encoding="utf-8").replace("duration = 0.12", "duration = 0.03")
    file.write_text(text, encoding="utf-8")
    assert main(["run", str(file), "--json", "--output", str(output), "--plot", str(picture)]) == 0
    found = json.loads(capsys.readouterr().out)
    import wheeltapper as wt

    record = wt.load(output)
    assert found["outcome"] == "COMPLETED"
    counted = [int((record.events.kind == kind).sum()) for kind in ("impact", "loss")]
    assert [found["impacts"], found["losses"]] == counted == [3, 4]
    assert found["largest_force"] == pytest.approx(float(record.peaks.normal_force.max()))
    assert found["largest_force"] == pytest.approx(found["largest_force_over_static"] * found["static_force"])
    assert (found["per"], found["end"]) == ("wheelset", 0.03)
    assert found["time_in_air"] == pytest.approx(record.time_in_air)
    assert set(found["versions"]) == {"wheeltapper", "numpy", "numba", "format"}
    assert found["versions"]["wheeltapper"] == wt.__version__
    assert (found["file"], found["record"], found["picture"]) == (str(file), str(output), str(picture))
    assert found["notes"] == list(record.notes)
    assert found["seconds"] > 0.0


def test_warnings_of_a_run_go_to_stderr_and_into_the_object(tmp_path, capsys):
    text = Path(BUMP).read_text(encoding="utf-8").replace("duration = 0.12", "duration = 0.03")
    sharp = text.replace('length = "50 mm"', 'length = "15 mm"')
    assert sharp != text
    file = tmp_path / "scene.toml"
    file.write_text(sharp, encoding="utf-8")
    assert main(["run", str(file), "--json"]) == 0
    said = capsys.readouterr()
    (warning,) = json.loads(said.out)["warnings"]
    assert "cannot follow" in warning
    assert f"warning: {warning}\n" in said.err


def test_a_run_that_cannot_finish_is_an_object_too(monkeypatch, capsys):
    from wheeltapper.lower import numbers

    monkeypatch.setattr(numbers, "EVENT_LIMIT", 6)
    assert main(["run", BUMP, "--json"]) == 3
    said = capsys.readouterr()
    assert json.loads(said.out)["outcome"] == "EVENT_LIMIT"
    assert "limit" in said.err


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_completion_script_knows_commands_and_options(shell, capsys):
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    for word in ("wheeltapper", "diagnose", "completion", "scheduler", "json"):
        assert word in script


def test_bash_completes_a_command_and_an_option(capsys, tmp_path):
    assert main(["completion", "bash"]) == 0
    script = tmp_path / "completion.bash"
    script.write_text(capsys.readouterr().out, encoding="utf-8")
    ask = """
source "$1"
name=$(complete -p wheeltapper | sed 's/.*-F \\([^ ]*\\) .*/\\1/')
COMP_WORDS=(wheeltapper di) COMP_CWORD=1; $name wheeltapper di wheeltapper; echo "${COMPREPLY[@]}"
COMP_WORDS=(wheeltapper run --me) COMP_CWORD=2; $name wheeltapper --me run; echo "${COMPREPLY[@]}"
"""
    done = subprocess.run(["bash", "-c", ask, "bash", str(script)], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["diagnose", "--method"]


def test_completion_is_installed_where_the_shell_finds_it(tmp_path):
    command = [sys.executable, "-c", "from wheeltapper.faces.cli import main; main(['--install-completion'])"]
    environment = os.environ | {"HOME": str(tmp_path), "SHELL": "/bin/bash"}
    subprocess.run(command, env=environment, capture_output=True, check=True)
    (script,) = tmp_path.rglob("completions/wheeltapper")
    assert "diagnose" in script.read_text(encoding="utf-8")


def interrupted(code, said, environment=None):
    """Run Python code, press Ctrl-C when it has said something, and return its exit code, its words and the seconds."""
    command, pipe = [sys.executable, "-c", code], subprocess.PIPE
    both = {"stdout": pipe, "stderr": subprocess.STDOUT}
    with subprocess.Popen(command, **both, text=True, cwd=ROOT, env=os.environ | (environment or {})) as process:
        heard = ""
        while said not in heard:
            line = process.stdout.readline()
            assert line, heard
            heard += line
        time.sleep(0.2)
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        rest, _ = process.communicate(timeout=60)
    return process.returncode, rest, time.monotonic() - begin


COMPILING = f"""
import sys
from wheeltapper.faces.cli import main
sys.exit(main(["run", {BUMP!r}]))
"""
IN_A_KERNEL = """
import sys
import numba
from wheeltapper.faces import cli


@numba.njit(nogil=True)
def spin(rounds):
    total = 0.0
    for i in range(rounds):
        total += (i % 7) ** 0.5
    return total


@cli.app.command
def wait() -> int:
    spin(1)
    print("spinning", flush=True)
    return int(spin(10**15))


sys.exit(cli.main(["wait"]))
"""
IN_PYTHON = """
import sys, time
from wheeltapper.faces import cli


@cli.app.command
def wait() -> int:
    print("waiting", flush=True)
    time.sleep(100)


sys.exit(cli.main(["wait"]))
"""


LOST = IN_PYTHON.replace(
    "time.sleep(100)",
    """
    from wheeltapper.faces import interrupts

    interrupts.CLEARING = 0.5
    try:
        time.sleep(100)
    except KeyboardInterrupt:
        pass
    time.sleep(100)""",
)


@pytest.mark.slow
@pytest.mark.parametrize(("code", "said"), [(IN_A_KERNEL, "spinning"), (IN_PYTHON, "waiting"), (LOST, "waiting")])
def test_ctrl_c_ends_a_command_with_one_line_and_code_3(code, said):
    returned, rest, seconds = interrupted(code, said)
    assert (returned, rest) == (3, "wheeltapper: interrupted\n")
    assert seconds < 20.0


@pytest.mark.slow
def test_ctrl_c_ends_a_command_that_compiles(tmp_path):
    returned, rest, seconds = interrupted(COMPILING, "compiling", {"WHEELTAPPER_CACHE": str(tmp_path)})
    assert returned == 3
    assert rest.endswith("wheeltapper: interrupted\n")
    assert "Traceback" not in rest
    assert seconds < 20.0


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [("schema", "site"), ("completion", "bash"), ("--help",), ("--version",)])
def test_a_command_whose_reader_has_gone_ends_without_a_word(arguments):
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "wheeltapper.faces.cli", *arguments]
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writer)
    assert (done.returncode, done.stderr) == (3, "")


def test_a_wrong_method_is_not_the_file_s(capsys):
    assert main(["run", BUMP, "--method", "quick"]) == 2
    assert capsys.readouterr().err == "wheeltapper: method: found 'quick'; allowed: 'default', 'strict'\n"

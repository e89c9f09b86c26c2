"""Print how far some questions travel through the package: files entered, changes of file, calls upward.

    uv run python tools/trip.py [-v]

Python calls inside the package are followed by sys.setprofile, from caller to callee, in the second call of each question:
what is compiled or kept by the first is no part of the trip. A call is upward where its callee stands on a higher floor
than its caller. Methods that a lower floor is handed are calls upward, too; -v names them, and the files.
"""

from __future__ import annotations

import sys
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import wheeltapper as wt
from wheeltapper.ground.progress import reporting

ROOT = Path(wt.__file__).parent
EXAMPLES = Path(__file__).parents[1] / "examples"
FLOORS = ("ground", "march", "describe", "lower", "record", "ask", "orbits", "diagnosis", "faces")
LEVEL = {
    name: min(level, FLOORS.index("orbits")) if name == "diagnosis" else level for level, name in enumerate(FLOORS)
}


class Trip:
    """The files through which calls go."""

    def __init__(self) -> None:
        self.files, self.changes, self.upward = Counter[str](), 0, Counter[tuple[str, str]]()

    def follow(self, frame: FrameType, event: str, argument: Any) -> None:
        """Take one event of the interpreter."""
        callee = _file_of(frame)
        if event != "call" or callee is None:
            return
        self.files[callee] += 1
        before = frame.f_back
        while before is not None and _file_of(before) is None:  # through other packages
            before = before.f_back
        caller = None if before is None else _file_of(before)
        if caller is None or caller == callee:
            return
        self.changes += 1
        if _level(callee) > _level(caller):
            self.upward[caller, callee] += 1


def _file_of(frame: FrameType) -> str | None:
    """Return the file of a call below the package, if it is one of its functions."""
    name = frame.f_code.co_filename
    if not name.startswith(str(ROOT)) or frame.f_code.co_name in ("<module>", "__getattr__"):
        return None
    return name[len(str(ROOT)) + 1 :]


def _level(file: str) -> int:
    return LEVEL.get(file.split("/")[0], len(FLOORS))


def questions() -> dict[str, Callable[[], Any]]:
    """Return what is asked, by name."""
    flat, coach = wt.load(EXAMPLES / "wheel_flat.toml"), wt.load(EXAMPLES / "coach_on_ballast.toml")
    site, recording = wt.load(EXAMPLES / "site.toml"), wt.read_recording(EXAMPLES / "data" / "deck_flat.csv.gz")
    over = {"speed": [float(flat.speed), 1.01 * float(flat.speed)], "vehicle.damping": [4e4, 5e4]}
    return {
        "simulate": lambda: wt.simulate(flat),
        "sweep": lambda: wt.sweep(flat, over, ["largest_force"]),
        "coach": lambda: wt.simulate(coach.replaced({"duration": 0.05})),
        "diagnose": lambda: wt.diagnose(recording, site),
    }


def main() -> None:
    """Print a line for each question."""
    print(f"{'question':12}{'files':>8}{'changes':>10}{'upward':>9}")
    for name, ask in questions().items():
        ask()
        trip = Trip()
        sys.setprofile(trip.follow)
        try:
            ask()
        finally:
            sys.setprofile(None)
        print(f"{name:12}{len(trip.files):8}{trip.changes:10}{trip.upward.total():9}")
        if "-v" in sys.argv:
            print("  ", *sorted(trip.files))
            for (caller, callee), calls in trip.upward.most_common():
                print(f"   upward {calls:5}  {caller} -> {callee}")


if __name__ == "__main__":
    with reporting(lambda *_: None, lambda _: None), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        main()

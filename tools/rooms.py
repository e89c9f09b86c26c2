"""Write what editors and type checkers read of the rooms, which find their modules only when they are asked.

`uv run python tools/rooms.py` rewrites the imports in each room's `__init__.py`; a test compares them with its modules.
"""

import re
from importlib import import_module
from pathlib import Path

SOURCES = Path(__file__).parents[1] / "src"
SEEN = re.compile(r"(?<=^if TYPE_CHECKING:\n).*?(?=^else:$)", re.MULTILINE | re.DOTALL)


def rooms() -> dict[str, Path]:
    """Return the `__init__.py` of each room by the room's name."""
    files = [path for path in sorted(SOURCES.rglob("__init__.py")) if "= room(__name__)" in path.read_text("utf-8")]
    return {".".join(path.parent.relative_to(SOURCES).parts): path for path in files}


def imports(room: str) -> str:
    """Return the lines that import what a room offers, but for what is registered outside the package."""
    offered = import_module(room)
    homes = {name: getattr(offered, name).__module__ for name in offered.__all__}
    lines = [f"    from {home} import {name} as {name}\n" for name, home in homes.items() if home.startswith(room)]
    return "".join(sorted(lines))


def written(room: str) -> str:
    """Return the whole of the room's `__init__.py` as it should be."""
    return SEEN.sub(lambda _: imports(room), rooms()[room].read_text("utf-8"))


if __name__ == "__main__":
    for room, path in rooms().items():
        path.write_text(written(room), "utf-8")

"""Draw the picture of the README: a fresh flat of 19 mm strikes the rail, and the wheel bounces after it.

``uv run python docs/readme_picture.py`` writes ``docs/_static/wheel_flat.png``.
"""

from pathlib import Path

import wheeltapper as wt

PICTURE = Path(__file__).parent / "_static" / "wheel_flat.png"


def draw(picture: Path = PICTURE) -> None:
    scene = wt.load(Path(__file__).parents[1] / "examples" / "wheel_flat.toml")
    record = wt.simulate(scene.replaced({"irregularity.0.position": 0.03, "duration": 0.06}))
    figure = wt.plot(record)
    times = record.impacts.sizes["impact"]
    figure.suptitle(
        f"A fresh wheel flat of 19 mm, at 5 m/s: the wheel leaves the rail (shaded) and strikes {times} times"
    )
    figure.savefig(picture, dpi=100)


if __name__ == "__main__":
    draw()

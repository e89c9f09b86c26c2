"""A wheel that brings compiled kernels is for one Python and one platform; hatch asks this when it builds."""

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class WheelTag(BuildHookInterface):  # type: ignore[type-arg]
    """Choose the wheel's tag."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Tell hatch whether the wheel is for every machine."""
        if version != "editable" and Path(self.root, "src/wheeltapper/march/prebuilt").is_dir():
            build_data["pure_python"], build_data["infer_tag"] = False, True

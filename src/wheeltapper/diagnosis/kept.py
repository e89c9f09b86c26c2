"""What results on disk depend on, so that only those that still hold are taken for done."""

from __future__ import annotations

import hashlib
import json
from typing import Any

from pydantic_core import PydanticSerializationError

from wheeltapper._version import __version__
from wheeltapper.ask.spec import file_digests
from wheeltapper.describe.site import Site
from wheeltapper.ground.errors import InputError


def digest_of(site: Site, *more: Any) -> str:
    """Return a digest of this program, a site, the files that it names, and what else a result depends on."""
    try:
        named = {} if site.passage is None else file_digests(site.passage)
        told = [__version__, site.model_dump(mode="json"), named, *more]
    except PydanticSerializationError as error:
        raise InputError(
            "", "output", "a site with a Profile, a Python function that nobody can compare the next time",
            "none, or samples of it in a `Measured`",
        ) from error  # fmt: skip
    return hashlib.sha256(json.dumps(told, sort_keys=True, default=str).encode()).hexdigest()

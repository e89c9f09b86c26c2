"""What shows itself: nouns and results that have `.plot()`, and a page of their own in notebooks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

draw: Callable[..., Any] | None = None
"""What draws a noun or a result: `wheeltapper.plot`. The front door sets it: pictures are made some floors above."""
page: Callable[[Any], str] | None = None
"""What returns it as HTML. The front door sets it, too."""


def picture_of(what: Any, path: Any = None, **options: Any) -> Any:
    """Return the picture of a noun or a result; with a path, save it, too."""
    assert draw is not None  # nobody has a noun or a result without the front door
    return draw(what, path, **options)


def page_of(what: Any) -> str:
    """Return what a notebook shows of a noun or a result."""
    assert page is not None
    return page(what)


class Shown:
    """The base of everything that has a picture."""

    __slots__ = ()

    def plot(self, path: Any = None, **options: Any) -> Any:
        """Return its picture, as `wheeltapper.plot` draws it with these options; with a path, save it, too."""
        return picture_of(self, path, **options)

    def _repr_html_(self) -> str:
        return page_of(self)

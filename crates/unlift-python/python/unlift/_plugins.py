"""Schemes and sources that are functions."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any, Literal, TypeVar, overload

F = TypeVar("F", bound=Callable[..., Any])


@overload
def scheme(function: F) -> F: ...
@overload
def scheme(function: None = None, *, name: str | None = None) -> Callable[[F], F]: ...
def scheme(function: Any = None, *, name: str | None = None) -> Any:
    """Names a function as a scheme: of points `(n, 3)`, and a `numpy.random.Generator` if it takes two arguments, to Lines,
    Rays, Planes or Candidates. All chance must come from that generator. Of images it is a function of keypoints `(n, 2)` in
    pixels from the middle of the image, to records of two columns.

    >>> @scheme(name="upright")
    ... def lines(points):
    ...     import numpy, unlift
    ...     return unlift.Lines(points, numpy.tile([0.0, 0.0, 1.0], (len(points), 1)))
    >>> lines.name
    'upright'
    """
    if function is None:
        return functools.partial(scheme, name=name)
    function.name = name or function.__name__
    return function


@overload
def source(function: F) -> F: ...
@overload
def source(
    function: None = None,
    *,
    name: str | None = None,
    needs: Literal["descriptors", "nothing"] = "descriptors",
    k: int = 50,
) -> Callable[[F], F]: ...
def source(
    function: Any = None,
    *,
    name: str | None = None,
    needs: Literal["descriptors", "nothing"] = "descriptors",
    k: int = 50,
) -> Any:
    """Names a function as a source of neighborhoods: of a Released (of a map or an image), and a `numpy.random.Generator` if it takes two arguments, to
    an array `(n_slots, k)` of records, likeliest first, padded by -1; or to this and scores; or to Neighborhoods.

    needs: "nothing" if it looks at records alone. Otherwise row i is about descriptor row i.
    k: records of a list that are looked at.
    """
    if function is None:
        return functools.partial(source, name=name, needs=needs, k=k)
    function.name = name or function.__name__
    function.needs, function.k = needs, k
    return function

"""Decorators that turn functions into schemes and sources."""

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
    """Turns a function into a scheme.

    The function takes points `(n, 3)`, and a `numpy.random.Generator` if it has two parameters. It returns Lines, Rays, Planes or
    Candidates. All randomness must come from that generator. For images it takes keypoints `(n, 2)` in pixels from the middle of
    the image, and returns records of two columns.

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
    """Turns a function into a source, which makes neighbor lists.

    The function takes a Released (of a map or an image), and a `numpy.random.Generator` if it has two parameters. It returns an array
    `(n_slots, k)` of records, likeliest first, padded by -1; or this and scores; or Neighborhoods.

    needs: "nothing" if the function uses records only. Otherwise row i belongs to descriptor row i.
    k: number of records of a list that the attack uses.
    """
    if function is None:
        return functools.partial(source, name=name, needs=needs, k=k)
    function.name = name or function.__name__
    function.needs, function.k = needs, k
    return function

"""The laws that every scheme, source and solver keeps, for your tests: a broken one is an AssertionError that says which.

A scheme is called with 0 to 700 points: of a made-up room, at random, many in one place. By an exception it refuses points, which
it may but for 200, 600 and 700 of a room. With `images=True` with keypoints `(n, 2)` in their place.

>>> import numpy, unlift
>>> @unlift.scheme
... def upright(points):
...     return unlift.Lines(points, numpy.tile([0.0, 0.0, 1.0], (len(points), 1)))
>>> unlift.testing.check_scheme(upright)
"""

from ._unlift import check_scheme, check_solver, check_source

__all__ = ["check_scheme", "check_solver", "check_source"]

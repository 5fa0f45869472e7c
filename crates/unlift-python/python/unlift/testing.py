"""Property tests for schemes, sources and solvers of your own: an AssertionError names the property that fails.

`check_scheme` calls a scheme with 0 to 700 points: of a made-up room, at random, many in one place; with `images=True`, keypoints
`(n, 2)`. A scheme may refuse points by an exception, except 200, 600 and 700 points of a room.

>>> import numpy, unlift
>>> @unlift.scheme
... def upright(points):
...     return unlift.Lines(points, numpy.tile([0.0, 0.0, 1.0], (len(points), 1)))
>>> unlift.testing.check_scheme(upright)
"""

from ._unlift import check_scheme, check_solver, check_source

__all__ = ["check_scheme", "check_solver", "check_source"]

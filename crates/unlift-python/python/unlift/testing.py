"""The laws that every scheme and source keeps, for your tests: a broken one is an AssertionError that says which.

>>> import numpy, unlift
>>> @unlift.scheme
... def upright(points):
...     return unlift.Lines(points, numpy.tile([0.0, 0.0, 1.0], (len(points), 1)))
>>> unlift.testing.check_scheme(upright)
"""

from ._unlift import check_scheme, check_source

__all__ = ["check_scheme", "check_source"]

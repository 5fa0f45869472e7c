"""A made-up room as CSV: floor, walls, a table and a shelf, in meters. No picture of anybody's home is shown."""

import random

draw = random.Random(1)


def between(low, high):
    return low + (high - low) * draw.random()


def on(corner, one, other):
    """A point on the rectangle that two edges span at a corner, a few millimeters off."""
    s, t = draw.random(), draw.random()
    return [c + s * a + t * b + between(-0.004, 0.004) for c, a, b in zip(corner, one, other)]


SURFACES = [  # corner, edge, edge, points per square meter
    ([0, 0, 0], [4, 0, 0], [0, 3, 0], 60),  # floor
    ([0, 0, 0], [4, 0, 0], [0, 0, 2.5], 60),  # walls
    ([0, 0, 0], [0, 3, 0], [0, 0, 2.5], 60),
    ([4, 0, 0], [0, 3, 0], [0, 0, 2.5], 60),
    ([1, 1, 0.75], [1.4, 0, 0], [0, 0.8, 0], 300),  # table
    ([0.2, 0.3, 1.2], [0.9, 0, 0], [0, 0.25, 0], 400),  # shelves
    ([0.2, 0.3, 1.6], [0.9, 0, 0], [0, 0.25, 0], 400),
    ([2.9, 2.6, 0], [0, 0, 1.9], [0.8, 0, 0], 200),  # cupboard
]


def size(edge):
    return sum(x * x for x in edge) ** 0.5


print("x,y,z")
for corner, one, other, density in SURFACES:
    for _ in range(round(size(one) * size(other) * density)):
        print(",".join(f"{x:.4f}" for x in on(corner, one, other)))

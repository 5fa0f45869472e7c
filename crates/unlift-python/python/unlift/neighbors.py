"""Neighbor lists: for every hidden point, the records whose points are said to be near.

`oracle` makes them from the true points, the other functions from a released map alone, as an attacker does.

>>> import numpy as np, unlift
>>> points = np.random.default_rng(1).uniform(0, 4, (200, 3))
>>> hidden = unlift.obfuscate(unlift.Map(points, scale=1.0), "olc", seed=1)
>>> unlift.neighbors.oracle(hidden, 0.5, k=20)
<unlift.Neighborhoods: 200 lists of up to 20>
"""

from __future__ import annotations

from ._unlift import Hidden, Neighborhoods, Released, find, oracle

__all__ = ["descriptors", "find", "geometric", "learned", "oracle", "overlap", "similarity"]


def similarity(
    released: Released | Hidden, *, k: int | None = None, seed: int = 0, threads: int | None = None
) -> Neighborhoods:
    """Lists the records with the most similar descriptors, of any kind; learned ones also by a short random walk."""
    return find(released, "similarity", k=k, seed=seed, threads=threads)


def overlap(
    released: Released | Hidden, *, k: int | None = None, seed: int = 0, threads: int | None = None
) -> Neighborhoods:
    """Lists records whose SIFT patches overlap, and others by a short walk from these; needs no training."""
    return find(released, "overlap", k=k, seed=seed, threads=threads)


def descriptors(
    released: Released | Hidden, *, k: int | None = None, seed: int = 0, threads: int | None = None
) -> Neighborhoods:
    """Makes the best lists that descriptors allow without training: `overlap` for SIFT, `similarity` for others."""
    return find(released, "descriptors", k=k, seed=seed, threads=threads)


def learned(
    released: Released | Hidden, *, k: int | None = None, seed: int = 0, threads: int | None = None
) -> Neighborhoods:
    """Lists records that a network, trained on photos, rates as near; needs SIFT or ALIKED descriptors."""
    return find(released, "learned", k=k, seed=seed, threads=threads)


def geometric(
    released: Released | Hidden, *, k: int | None = None, seed: int = 0, threads: int | None = None
) -> Neighborhoods:
    """Lists records that meet where many records meet; needs no descriptors."""
    return find(released, "geometric", k=k, seed=seed, threads=threads)

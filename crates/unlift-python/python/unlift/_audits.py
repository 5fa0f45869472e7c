"""Audits of maps and of images."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Protocol, TypedDict, TypeVar

import numpy.typing as npt

from ._report import Report
from ._unlift import SCHEMES, SOURCES, Map, Records
from ._unlift import Report as _Report
from ._unlift import audit as _audit
from ._unlift import audit_images as _audit_images

T = TypeVar("T")

#: Options that are lists.
SEVERAL = {
    "schemes",
    "neighbors",
    "inlier_ratios",
    "oracle_noise",
    "solvers",
    "thresholds",
    "gates",
    "show",
}

#: A name of ours, or a function (`scheme`).
Scheme = str | Callable[..., Records]
#: A name of ours, or a function (`source`).
Source = str | Callable[..., Any]
#: A name of ours, or a function of a Released and its Neighborhoods that returns positions.
Solver = str | Callable[..., Any]


class _Keypoints(TypedDict):
    keypoints: npt.ArrayLike
    width: int
    height: int


class Features(_Keypoints, total=False):
    """What is known of an image.

    keypoints: `(n, 2)`, x and y in pixels; the middle of the first pixel is (0, 0), as hloc has it (COLMAP: (0.5, 0.5)).
    width, height: of the image in pixels.
    descriptors: `(n, d)` uint8 or floats, a row per keypoint, or None; hloc's files have them the other way round.
    scores: `(n,)`, as extractors give them, or None; no figure depends on them.
    """

    descriptors: npt.ArrayLike | None
    scores: npt.ArrayLike | None


class Named(Protocol):
    """Images by name, looked up when their turn comes: a dict, or what reads them from a disk."""

    def keys(self) -> Iterable[str]: ...
    def __getitem__(self, name: str, /) -> Features: ...


def audit(
    map: Map,
    schemes: Sequence[Scheme] | Scheme | None = None,
    neighbors: Sequence[Source] | Source = ("oracle",),
    *,
    inlier_ratios: Sequence[float] | None = None,
    oracle_noise: Sequence[str] | str | None = None,
    solvers: Sequence[Solver] | Solver | None = None,
    thresholds: Iterable[float | str] | str | None = None,
    k: int = 50,
    source_k: int | None = None,
    tile_points: int | None = None,
    tile: int | None = None,
    delta: float | None = None,
    exact_constraints: bool = True,
    records_alone: bool = True,
    reference: bool = False,
    seed: int = 0,
    repeats: int = 1,
    gates: Sequence[str] | str = (),
    threads: int | None = None,
    progress: bool | Callable[[int, int, str], object] = False,
) -> Report:
    """How much of `map` comes back under each of `schemes`, attacked with each of `neighbors`.

    map: points in meters (with a scale), else in the usual distance to the K-th neighbor.
    schemes: names of `SCHEMES`, or functions (`scheme`); all of ours without it. Where several may stand, so may one.
    neighbors: "oracle", names of `SOURCES`, or functions (`source`).
    inlier_ratios: shares of true neighbors to try (oracle); six without it.
    oracle_noise: how the oracle errs: "uniform", "near", "clustered".
    solvers: names of `SOLVERS`, or functions; the strongest ones for this size without it. A function takes a Released and its
        Neighborhoods, and a `numpy.random.Generator` if it has a third parameter. It returns positions `(n_slots, 3)` about
        `released.origin`; a row of NaN says that a point was not recovered.
    thresholds: errors up to which a point counts as recovered, in the unit of the map; texts are kept as written.
    k: true neighbors per point. source_k: records per list of a source of ours, which chooses itself without it.
    tile_points: cut a large map into tiles of at most so many points, and audit each as a map of its own. tile: only the tile with this
        number, from 0, as a task of a cluster.
    delta: the distance that decides support; the attack chooses without it.
    exact_constraints: whether rules that tie records together are used.
    records_alone: whether maps are also attacked without lists. reference: also with the neighbors' true places.
    seed, repeats: of everything that is drawn; figures are means over repeats.
    gates: bounds to hold, as in "olc@0.5:0.10<=20"; `Report.passed` says whether they did.
    threads: never change a result.
    progress: True for a bar (tqdm if it is there), or a function of done, total and what comes next.

    A scheme or source of your own that fails, and a scheme that breaks a law, has no row and is told by a warning. Raises UnliftError in one line, also where
    no scheme has a row; KeyboardInterrupt at once.
    """
    asked = _asked(
        schemes=schemes,
        neighbors=neighbors,
        inlier_ratios=inlier_ratios,
        oracle_noise=oracle_noise,
        solvers=solvers,
        thresholds=thresholds,
        k=k,
        source_k=source_k,
        tile_points=tile_points,
        tile=tile,
        delta=delta,
        exact_constraints=exact_constraints,
        records_alone=records_alone,
        reference=reference,
        seed=seed,
        repeats=repeats,
        gates=gates,
        threads=threads,
    )
    report = Report(_told(lambda tell: _audit(map, asked, tell), progress, "row"))
    for one in report.document.get("not_audited") or []:
        if one["scheme"] not in SCHEMES or one.get("neighbors") not in (None, "oracle", *SOURCES):
            by = f" with neighbors by {one['neighbors']}" if one.get("neighbors") else ""
            warnings.warn(f"{one['scheme']}{by} was not audited: {one['reason']}", stacklevel=2)
    return report


def audit_images(
    images: str | os.PathLike[str] | Named | Mapping[str, Features] | Iterable[tuple[str, Features]],
    schemes: Sequence[Scheme] | Scheme | None = None,
    neighbors: Sequence[Source] | Source = ("oracle",),
    *,
    features: str | None = None,
    max_features: int | None = None,
    min_score: float | None = None,
    max_images: int | None = None,
    show: Sequence[str] | str | None = None,
    photos: str | os.PathLike[str] | None = None,
    inlier_ratios: Sequence[float] | None = None,
    oracle_noise: Sequence[str] | str | None = None,
    solvers: Sequence[Solver] | Solver | None = None,
    thresholds: Iterable[float | str] | str | None = None,
    k: int = 20,
    source_k: int | None = None,
    delta: float | None = None,
    exact_constraints: bool = True,
    reference: bool = False,
    seed: int = 0,
    repeats: int = 1,
    gates: Sequence[str] | str = (),
    threads: int | None = None,
    progress: bool | Callable[[int, int, str], object] = False,
) -> Report:
    """How many keypoints of `images` come back under each of `schemes`, attacked with each of `neighbors`.

    images: a dict of names to `Features` (dicts of arrays), or pairs of both; or a path, as `unlift audit images` takes it: a
        folder of photos, features of hloc (.h5), a database of COLMAP. The same features under the same names give the rows of
        the command line, byte for byte.
        A dict, or any object with `keys()` and `[name]`, is asked for an image when its turn comes, from other threads, a few
        ahead, and again for those that the page draws: what reads them from a disk keeps memory small. Pairs, an iterator of
        them too, are all taken before the audit begins, as it goes by sorted names; their arrays are not copied until then.
    schemes: names of `IMAGE_SCHEMES`, or functions (`scheme`) of keypoints `(n, 2)` in pixels from the middle of the image, to
        Lines, Rays or Candidates of as many columns; all of ours without it. Where several may stand, so may one.
    neighbors: "oracle", names of `IMAGE_SOURCES`, or functions (`source`).
    features, max_features, min_score: what is extracted from photos: "sift", "aliked", "superpoint"; how many; above which score.
    max_images: use at most so many, evenly spaced over their sorted names.
    show: names of images to draw, none where it is empty; the least, the median and the most recovered without it. photos: the folder of photos, where
        `images` is none, to draw.
    solvers: names of `IMAGE_SOLVERS`, or functions as `audit` takes them, with positions `(n_slots, 2)`.
    thresholds: errors in pixels up to which a keypoint counts as recovered.
    k: true neighbors per keypoint.
    progress: True for a bar, or a function of images done, all, and the one at work.
    The others as `audit` has them. Nothing is painted: that is `unlift audit images --invert`.

    What cannot be used of arrays raises UnliftError in one line: which image, what was expected, what was found. An image of a
    path that cannot be used is told by a warning and left out; `Report.passed` is False then. KeyboardInterrupt at once.
    """
    asked = _asked(
        schemes=schemes,
        neighbors=neighbors,
        inlier_ratios=inlier_ratios,
        oracle_noise=oracle_noise,
        solvers=solvers,
        thresholds=thresholds,
        k=k,
        source_k=source_k,
        tile_points=None,
        tile=None,
        delta=delta,
        exact_constraints=exact_constraints,
        records_alone=True,
        reference=reference,
        seed=seed,
        repeats=repeats,
        gates=gates,
        threads=threads,
        features=features,
        max_features=max_features,
        min_score=min_score,
        max_images=max_images,
        photos=None if photos is None else os.fspath(photos),
        show=show,
    )
    found: tuple[_Report, list[str]] = _told(lambda tell: _audit_images(images, asked, tell), progress, "image")
    report, said = found
    for line in said:
        warnings.warn(line, stacklevel=2)
    return Report(report)


def _several(given: Any) -> list[Any]:
    """What stands alone as a list: the letters of a name are none."""
    return [given] if isinstance(given, str) or callable(given) else list(given)


def _asked(**options: Any) -> dict[str, Any]:
    """What an audit is asked for, as the native part takes it."""
    return {
        name: _several(given) if name in SEVERAL and given is not None else given
        for name, given in options.items()
    }


def _told(
    audit: Callable[[Callable[[int, int, str], object] | None], T],
    progress: bool | Callable[[int, int, str], object],
    unit: str,
) -> T:
    """What `audit` gives, which is told how to tell of its progress."""
    if progress is True:
        with _Bar(unit) as bar:
            return audit(bar.tell)
    return audit(progress or None)


class _Bar:
    """Tells how far an audit is: by tqdm where it is installed, else in lines on stderr."""

    def __init__(self, unit: str) -> None:
        self._unit = unit

    def __enter__(self) -> _Bar:
        try:
            from tqdm.auto import tqdm  # type: ignore[import-untyped,unused-ignore]

            self._bar: Any = tqdm(unit=self._unit)
        except ImportError:
            self._bar = None
        return self

    def tell(self, done: int, total: int, what: str) -> None:
        if self._bar is None:
            print(f"unlift: {done}/{total} {what}", file=sys.stderr, flush=True)
            return
        self._bar.total = total
        self._bar.set_description(what, refresh=False)
        self._bar.update(done - self._bar.n)

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()

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

#: Options that take a list or a single item.
SEVERAL = {"schemes", "neighbors", "inlier_ratios", "oracle_noise", "solvers", "thresholds", "gates"}

#: A name in `SCHEMES`, or a function (`scheme`).
Scheme = str | Callable[..., Records]
#: A name in `SOURCES`, or a function (`source`).
Source = str | Callable[..., Any]
#: A name in `SOLVERS`, or a function of a Released and its Neighborhoods that returns positions.
Solver = str | Callable[..., Any]


class _Keypoints(TypedDict):
    keypoints: npt.ArrayLike
    width: int
    height: int


class Features(_Keypoints, total=False):
    """The keypoints of one image, and optional descriptors.

    keypoints: `(n, 2)`, x and y in pixels; the middle of the first pixel is (0, 0), as in hloc (COLMAP: (0.5, 0.5)).
    width, height: size of the image in pixels.
    descriptors: `(n, d)` uint8 or floats, a row per keypoint, or None; files of hloc hold the transpose.
    """

    descriptors: npt.ArrayLike | None


class Named(Protocol):
    """A mapping from names to images: a dict, or an object that reads each image from a disk when asked for it."""

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
    tile_points: int | None = None,
    tile: int | None = None,
    records_alone: bool = True,
    seed: int = 0,
    repeats: int = 1,
    gates: Sequence[str] | str = (),
    threads: int | None = None,
    progress: bool | Callable[[int, int, str], object] = False,
) -> Report:
    """Hides `map` under each of `schemes`, attacks it with each of `neighbors`, and reports how much comes back.

    map: the unprotected map. Lengths are in meters if it has a scale, else in the median distance to the K-th neighbor.
    schemes: names in `SCHEMES`, or functions (`scheme`). Default: all names. Arguments that take several items also take one.
    neighbors: what makes the neighbor lists: "oracle" (from the true points), names in `SOURCES`, or functions (`source`).
    inlier_ratios: shares of true neighbors in the lists of the oracle. Default: 0.5 and 0.1; for images six values.
    oracle_noise: where wrong entries of the oracle lie: "uniform", "near", "clustered".
    solvers: names in `SOLVERS`, or functions. Default: the strongest for the size of the map. A function takes a Released and its
        Neighborhoods, and a `numpy.random.Generator` if it has a third parameter. It returns positions `(n_slots, 3)` relative to
        `released.origin`; a row of NaN means that the point was not recovered.
    thresholds: errors up to which a point counts as recovered, in the unit of the map. Strings are kept as written.
    k: number of true neighbors per point.
    tile_points: cut a large map into tiles of at most this many points, and audit each as a map of its own. tile: audit only the tile
        with this number, from 0, for tasks on a cluster.
    records_alone: whether to attack maps without neighbor lists, too.
    seed: random seed. repeats: number of seeds; results are means over them.
    gates: bounds, such as "olc@0.5:0.10<=20"; `Report.passed` is True if all hold.
    threads: number of threads; no result depends on it.
    progress: True for a progress bar (tqdm if it is installed), or a function of done, total and the next item.

    If a scheme or source of your own fails, or a scheme fails a property test, it has no row and a warning names it. Raises UnliftError
    for a wrong argument, or if no scheme has a row. KeyboardInterrupt takes effect at once.
    """
    options = _options(locals())
    report = Report(_run(lambda tell: _audit(map, options, tell), progress, "row"))
    for missing in report.document.get("not_audited") or []:
        if missing["scheme"] not in SCHEMES or missing.get("neighbors") not in (None, "oracle", *SOURCES):
            by = f" with neighbors by {missing['neighbors']}" if missing.get("neighbors") else ""
            warnings.warn(f"{missing['scheme']}{by} was not audited: {missing['reason']}", stacklevel=2)
    return report


def audit_images(
    images: str | os.PathLike[str] | Named | Mapping[str, Features],
    schemes: Sequence[Scheme] | Scheme | None = None,
    neighbors: Sequence[Source] | Source = ("oracle",),
    *,
    features: str | None = None,
    max_features: int | None = None,
    max_images: int | None = None,
    pictures: bool = True,
    photos: str | os.PathLike[str] | None = None,
    inlier_ratios: Sequence[float] | None = None,
    oracle_noise: Sequence[str] | str | None = None,
    solvers: Sequence[Solver] | Solver | None = None,
    thresholds: Iterable[float | str] | str | None = None,
    k: int = 20,
    seed: int = 0,
    repeats: int = 1,
    gates: Sequence[str] | str = (),
    threads: int | None = None,
    progress: bool | Callable[[int, int, str], object] = False,
) -> Report:
    """Hides the keypoints of `images` under each of `schemes`, attacks them with each of `neighbors`, and reports how many come back.

    images: a dict of names to `Features` (dicts of arrays), or a path, as for `unlift audit images`: a folder of
        photos, features of hloc (.h5), a database of COLMAP. The same features under the same names give rows that are
        byte-identical to those of the command line.
        To save memory, give an object with `keys()` and `[name]` that reads images from a disk. It is called when an
        image is needed, a few images ahead, and again for those that the page draws.
    schemes: names in `IMAGE_SCHEMES`, or functions (`scheme`) of keypoints `(n, 2)` in pixels from the middle of the image, to
        Lines, Rays or Candidates of two columns. Default: all names. Arguments that take several items also take one.
    neighbors: "oracle", names in `IMAGE_SOURCES`, or functions (`source`).
    features: what to extract from photos: "sift", "aliked", "superpoint". max_features: how many.
    max_images: use at most this many, evenly spaced over their sorted names.
    pictures: whether the page draws the images with the least, the median and the most recovered keypoints.
    photos: the folder of photos to draw, if `images` is not one.
    solvers: names in `IMAGE_SOLVERS`, or functions as for `audit`, with positions `(n_slots, 2)`.
    thresholds: errors in pixels up to which a keypoint counts as recovered.
    k: number of true neighbors per keypoint.
    progress: True for a progress bar, or a function of images done, all images, and the current image.
    The other arguments are those of `audit`. To paint pictures, use `unlift audit images --invert`.

    Raises UnliftError for wrong arrays; the message names the image, what was expected and what was found. If an image of a path cannot
    be used, a warning names it, the audit leaves it out, and `Report.passed` is False. KeyboardInterrupt takes effect at once.
    """
    photos = None if photos is None else os.fspath(photos)
    options = _options(locals())
    native: tuple[_Report, list[str]] = _run(lambda tell: _audit_images(images, options, tell), progress, "image")
    report, messages = native
    for line in messages:
        warnings.warn(line, stacklevel=2)
    return Report(report)


def _several(given: Any) -> list[Any]:
    """Returns `given` as a list: a string or a function becomes a list of one item."""
    return [given] if isinstance(given, str) or callable(given) else list(given)


def _options(arguments: dict[str, Any]) -> dict[str, Any]:
    """Returns arguments by name in the form that the native module takes, which ignores those that are no options."""
    return {
        name: _several(given) if name in SEVERAL and given is not None else given
        for name, given in arguments.items()
    }


def _run(
    audit: Callable[[Callable[[int, int, str], object] | None], T],
    progress: bool | Callable[[int, int, str], object],
    unit: str,
) -> T:
    """Runs `audit` with a callback for its progress: of the caller, a bar of tqdm if it is installed, or lines on stderr."""
    if progress is not True:
        return audit(progress or None)
    try:
        from tqdm.auto import tqdm  # type: ignore[import-untyped,unused-ignore]
    except ImportError:
        return audit(lambda done, total, what: print(f"unlift: {done}/{total} {what}", file=sys.stderr, flush=True))
    with tqdm(unit=unit) as bar:

        def tell(done: int, total: int, what: str) -> None:
            bar.total = total
            bar.set_description(what, refresh=False)
            bar.update(done - bar.n)

        return audit(tell)

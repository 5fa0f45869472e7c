"""Draws pages/pictures: for each scheme a made-up scene, what unlift releases of it, and what comes back.

    python3 docs/guide/make_pictures.py            # draws; needs unlift, matplotlib, and the program (UNLIFT_PROGRAM)
    python3 docs/guide/make_pictures.py --check    # compares the shares beside the pictures with those of today; draws nothing
"""

from __future__ import annotations

import json
import os
import pathlib
import sqlite3
import subprocess
import sys
import tempfile

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
PICTURES = HERE / "pages" / "pictures"
PROGRAM = os.environ.get("UNLIFT_PROGRAM", str(HERE.parents[1] / "target" / "debug" / "unlift"))
MAPS = ["olc", "ppl", "ppl+", "ray", "ray-voxel", "plane", "cp"]
IMAGES = ["lines2d", "cp2d", "dcl2d"]
RATIO = 0.5
SEED = 1
#: Errors at which the color ends: meters, pixels.
WORST = {3: 0.25, 2: 25.0}
#: Colors of errors.
STEPS = 5


def room() -> np.ndarray:
    """Returns the points of the tutorial's room, (n, 3)."""
    text = subprocess.run([sys.executable, HERE / "pages" / "room.py"], check=True, capture_output=True, text=True).stdout
    return np.array([[float(x) for x in line.split(",")] for line in text.splitlines()[1:]])


def drawing() -> np.ndarray:
    """Returns keypoints of a made-up image of 640 x 480: edges of a house, a sun and a fence, (n, 2) in pixels."""
    random = np.random.default_rng(SEED)
    corners = [(180, 400), (180, 220), (300, 130), (420, 220), (420, 400), (180, 400)]
    strokes = list(zip(corners, corners[1:]))
    strokes += [((180, 220), (420, 220)), ((270, 400), (270, 310)), ((270, 310), (330, 310)), ((330, 310), (330, 400))]
    strokes += [((20 + 40 * i, 440), (20 + 40 * i, 380)) for i in (0, 1, 2, 12, 13, 14, 15)]
    parts = []
    for a, b in strokes:
        a, b = np.array(a, float), np.array(b, float)
        n = int(np.linalg.norm(b - a) / 3)
        parts.append(a + random.uniform(0, 1, (n, 1)) * (b - a) + random.normal(0, 1.5, (n, 2)))
    angle = random.uniform(0, 2 * np.pi, 110)
    parts.append(np.array([540, 90]) + 42 * np.stack([np.cos(angle), np.sin(angle)], 1) + random.normal(0, 1.5, (110, 2)))
    return np.concatenate(parts)


def of_map(scheme: str) -> dict:
    """Attacks a scheme for maps by the Python package."""
    import unlift

    hidden = unlift.obfuscate(unlift.Map(room(), scale=1.0), scheme, seed=SEED)
    lists = unlift.neighbors.oracle(hidden, RATIO, seed=SEED)
    back = unlift.recover(hidden.released, lists, seed=SEED)
    shares = unlift.evaluate(back, hidden)["recovered_percent"]
    truth, released = hidden.truth, hidden.released
    columns = {name: np.asarray(column) for name, column in released.columns.items()}
    columns = {name: c + released.origin if name in ("foot", "centers", "position") else c for name, c in columns.items()}
    originals = truth.positions[np.asarray(truth.hidden)]
    if columns.get("axis") is not None:
        columns["offset"] = columns["offset"] + released.origin[columns["axis"]]
    return {"family": released.family, "columns": columns, "originals": originals, "recovered": back.positions, "shares": shares}


def of_image(scheme: str) -> dict:
    """Attacks a scheme for images by the program, with keypoints in a COLMAP database."""
    def unlift(*arguments: str) -> str:
        run = subprocess.run([PROGRAM, *arguments], check=True, capture_output=True, text=True, cwd=folder)
        return run.stdout

    with tempfile.TemporaryDirectory() as folder:
        keypoints = drawing()
        with sqlite3.connect(os.path.join(folder, "database.db")) as db:
            db.execute("create table cameras (camera_id integer primary key, model integer, width integer, height integer, params blob)")
            db.execute("create table images (image_id integer primary key, name text, camera_id integer)")
            db.execute("create table keypoints (image_id integer primary key, rows integer, cols integer, data blob)")
            db.execute("create table descriptors (image_id integer primary key, rows integer, cols integer, data blob)")
            db.execute("insert into cameras values (1, 0, 640, 480, ?)", [np.array([600.0, 320.0, 240.0]).tobytes()])
            db.execute("insert into images values (1, 'house.png', 1)")
            data = (keypoints + 0.5).astype("<f4")  # COLMAP's middle of the first pixel is (0.5, 0.5)
            db.execute("insert into keypoints values (1, ?, 2, ?)", [len(data), data.tobytes()])
        db.close()
        unlift("obfuscate", "database.db", "--schemes", scheme, "--seed", str(SEED), "--out", "hidden")
        oracle = ["--neighbors", "oracle", "--truth", "hidden/truth.npz", "--inlier-ratios", str(RATIO), "--k", "20"]
        unlift("neighbors", "hidden/released.npz", *oracle, "--seed", str(SEED), "--out", "lists.npz")
        unlift("recover", "hidden/released.npz", "--neighbors", "lists.npz", "--seed", str(SEED), "--out", "back.npz")
        told = json.loads(unlift("evaluate", "back.npz", "--truth", "hidden/truth.npz", "--thresholds", "10,25", "--json"))
        rows = told["results"][0] if "results" in told else told
        released, truth, back = (arrays(os.path.join(folder, name)) for name in ("hidden/released.npz", "hidden/truth.npz", "back.npz"))
    origin = released.get("origin", np.zeros(2))
    columns = {name: released[name] for name in ("foot", "direction", "center", "centers", "position") if name in released}
    columns = {name: c + origin if name in ("foot", "centers", "position") else c for name, c in columns.items()}
    originals = truth["position"][np.argsort(truth["slot"])][-np.sum(truth["slot"] >= 0):]
    family = "axis_candidates" if "position" in columns else "rays" if "centers" in columns else "lines"
    return {"family": family, "columns": columns, "originals": originals, "recovered": back["position"], "shares": rows["recovered_percent"]}


def arrays(path: str) -> dict[str, np.ndarray]:
    """Returns the arrays of the one image of a stage file."""
    with np.load(path) as file:
        return {name.removeprefix("house.png/"): file[name] for name in file.files}


def seen(points: np.ndarray) -> np.ndarray:
    """Projects points of a map, seen from the open side of the room and a little from above. Keypoints stay where they are."""
    if points.shape[1] == 2:
        return points * [1, -1]
    turn, lift = np.radians(-62), np.radians(28)
    x, y, z = (points - [2, 1.5, 1.0]).T
    right = -np.sin(turn) * x + np.cos(turn) * y
    depth = np.cos(turn) * x + np.sin(turn) * y
    return np.stack([right, np.cos(lift) * z - np.sin(lift) * depth], 1)


def segments(found: dict, some: np.ndarray, reach: float) -> list[np.ndarray]:
    """Converts records to lines to draw, (m, dimension) each."""
    columns, family = found["columns"], found["family"]
    drawn = []
    for record in some:
        if family == "lines":
            foot, along = columns["foot"][record], columns["direction"][record]
            drawn.append(np.stack([foot - reach * along, foot + reach * along]))
        elif family == "rays":
            center = columns["centers"][columns["center"][record]]
            drawn.append(np.stack([center, center + reach * columns["direction"][record]]))
        elif family == "axis_planes":
            axis, offset = columns["axis"][record], columns["offset"][record]
            low, high = found["originals"].min(0), found["originals"].max(0)
            corners = np.array([[0, 0], [0, 1], [1, 1], [1, 0], [0, 0]])
            frame = np.full((5, 3), offset)
            others = [a for a in range(3) if a != axis]
            frame[:, others] = low[others] + corners * (high - low)[others]
            drawn.append(frame)
        else:
            at = columns["position"][record]
            for axis in range(len(at)):
                step = np.eye(len(at))[axis] * reach
                drawn.append(np.stack([at - step, at + step]))
    return drawn


def draw(scheme: str, found: dict, path: pathlib.Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt
    from matplotlib.collections import LineCollection
    from PIL import Image

    colors = plt.get_cmap("viridis", STEPS)
    dimension = found["originals"].shape[1]
    random = np.random.default_rng(SEED)
    figure, (*panes, scale) = plt.subplots(1, 4, figsize=(10, 2.8), dpi=90, layout="constrained", width_ratios=[1, 1, 1, 0.03])
    dots = seen(found["originals"])
    size = 2 if dimension == 3 else 3
    low, high = dots.min(0), dots.max(0)
    margin = 0.12 * (high - low)
    panes[0].scatter(*dots.T, s=size, color="#1a1a1a", linewidths=0)
    panes[0].set_title("original", fontsize=10)

    n = {"lines": 90, "rays": 110, "axis_planes": 24, "axis_candidates": 24}[found["family"]]
    records = len(next(c for name, c in found["columns"].items() if name not in ("centers",)))
    some = random.choice(records, min(n, records), replace=False)
    reach = 8.0 if dimension == 3 else 900.0
    if found["family"] == "axis_candidates":
        panes[1].scatter(*seen(found["columns"]["position"]).T, s=size, color="#9db7d5", linewidths=0)
    lines = [seen(s) for s in segments(found, some, reach)]
    panes[1].add_collection(LineCollection(lines, colors="#2b6cb0", linewidths=0.6, alpha=0.75))
    words = {"lines": "lines", "rays": "rays", "axis_planes": "planes", "axis_candidates": "points, %d lines each" % dimension}
    panes[1].set_title(f"released: {len(some)} of {records} {words[found['family']]}", fontsize=10)

    error = np.linalg.norm(found["recovered"] - found["originals"], axis=1)
    kept = np.isfinite(error)
    order = np.argsort(-error[kept])
    places = seen(found["recovered"][kept])[order]
    shown = panes[2].scatter(*places.T, c=error[kept][order], s=size, vmin=0, vmax=WORST[dimension], cmap=colors, linewidths=0)
    threshold, share = next(iter(found["shares"].items()))
    unit = "m" if dimension == 3 else "px"
    panes[2].set_title(f"recovered: {share:.0f} % within {threshold} {unit}", fontsize=10)
    figure.colorbar(shown, cax=scale, label=f"error, {unit}")
    for pane in panes:
        pane.set(xlim=(low[0] - margin[0], high[0] + margin[0]), ylim=(low[1] - margin[1], high[1] + margin[1]), xticks=[], yticks=[], aspect="equal")
        for side in pane.spines.values():
            side.set_color("#cccccc")
    figure.savefig(path, metadata={"Software": None})
    plt.close(figure)
    # Few colors, each in some steps toward white: small files.
    inks = [(26, 26, 26), (43, 108, 176), (157, 183, 213), *(tuple(int(255 * c) for c in colors(i)[:3]) for i in range(STEPS))]
    tints = [tuple(round(255 + (c - 255) * part) for c in ink) for ink in inks for part in (1, 0.75, 0.5, 0.25)]
    palette = Image.new("P", (1, 1))
    palette.putpalette([c for tint in [(255, 255, 255), *tints] for c in tint])
    Image.open(path).convert("RGB").quantize(palette=palette, dither=Image.Dither.NONE).save(path, optimize=True)
    assert path.stat().st_size < 60_000, f"{path}: {path.stat().st_size} bytes"


def main() -> None:
    check = "--check" in sys.argv[1:]
    noted = PICTURES / "shares.json"
    shares = {}
    for scheme in MAPS + IMAGES:
        found = of_map(scheme) if scheme in MAPS else of_image(scheme)
        shares[scheme] = {name: round(share, 1) for name, share in found["shares"].items()}
        if not check:
            PICTURES.mkdir(exist_ok=True)
            draw(scheme, found, PICTURES / f"{scheme.replace('+', '-plus')}.png")
    if check:
        before = json.loads(noted.read_text())
        assert before == shares, f"the pictures are of another attack: {before}, today {shares}: run make_pictures.py"
        print(f"{len(shares)} pictures show what comes back today")
    else:
        noted.write_text(json.dumps(shares, indent=1) + "\n")
        print(noted.read_text())


if __name__ == "__main__":
    main()

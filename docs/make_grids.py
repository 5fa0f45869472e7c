#!/usr/bin/env python3
"""Draws grids of recovered pictures like the paper's figures, and tells what texture has to do with them.

    cargo build --release && python3 docs/make_grids.py PHOTOS OUT [--features aliked] [--max-images 3]
    python3 docs/make_grids.py PHOTOS OUT --model MODEL --descriptors FILE --scale 1      # as a map's cameras see it

needs numpy and Pillow. OUT gets a grid per photo: a row per scheme; the photo, the picture of the true points, and those of the points
recovered from lists of inlier ratio 1.0, 0.5, 0.2 and 0.1, and from lists that an attacker makes of descriptors.

With photos alone it prints a table (Supp. D of the paper): blocks of 16 x 16 pixels of the pictures, in four equal parts by the standard
deviation of the photo's gray values; per part the share of keypoints in it, the share of these recovered within 10 px, and SSIM.
"""
import argparse, pathlib, subprocess, tempfile

import numpy as np
from PIL import Image, ImageDraw

PROGRAM = pathlib.Path(__file__).resolve().parent.parent / "target/release/unlift"
RATIOS = ["1.0", "0.5", "0.2", "0.1"]
OWN = "own lists"
BLOCK, WITHIN_PX = 16, 10.0


def unlift(*words):
    subprocess.run([str(word) for word in (PROGRAM, *words)], check=True, stdout=subprocess.DEVNULL)


def true_points(recovered, truth, out):
    """Writes what an attack that recovers every point would have written."""
    arrays, known = dict(np.load(recovered)), np.load(truth)
    for name in [name for name in arrays if name.rsplit("/", 1)[-1] == "position"]:
        of = name[: -len("position")]
        slot, position = known[f"{of}slot"], known[f"{of}position"]
        is_hidden = slot >= 0
        places = np.empty_like(arrays[name])
        places[slot[is_hidden]] = position[is_hidden]
        arrays[name] = places
        if f"{of}descriptor_row" in arrays:
            arrays[f"{of}descriptor_row"][slot[is_hidden]] = known[f"{of}descriptor_row"][is_hidden]
        for gone in ("origin", "status", "support", "evidence", "found", "error_scale", "axis"):
            arrays.pop(of + gone, None)
    np.savez(out, **arrays)


def attack(args, folder, schemes):
    """Runs the stages. Returns the pictures by scheme and column, and per scheme and column the stage files."""
    pictures, files = {}, {}
    points = folder / "features.h5"
    of_map = ["--cameras", args.model, "--scale", args.scale] if args.model else []
    if args.model:
        points = args.model
    else:
        unlift("features", args.photos, "--features", args.features, "--as-stored", "--quiet", "--out", points)
    for scheme in schemes:
        hidden = folder / scheme
        descriptors = ["--descriptors", args.descriptors, "--scale", args.scale] if args.model else []
        unlift("obfuscate", points, "--schemes", scheme, "--seed", "0", *descriptors, "--out", hidden)
        released, truth = hidden / "released.npz", hidden / "truth.npz"
        for column in [*RATIOS, OWN, "true points"]:
            lists, recovered, out = (hidden / f"{column}-{name}" for name in ("lists.npz", "recovered.npz", "pictures"))
            if column == "true points":
                true_points(hidden / f"{RATIOS[0]}-recovered.npz", truth, recovered)
            else:
                oracle = ["oracle", "--truth", truth, "--inlier-ratios", column]
                unlift("neighbors", released, "--neighbors", *(["descriptors"] if column == OWN else oracle), "--out", lists)
                unlift("recover", released, "--neighbors", lists, "--out", recovered)
            unlift("invert", released, recovered, *of_map, "--max-images", args.max_images, "--out", out)
            pictures[scheme, column] = {str(path.relative_to(out))[: -len(".png")]: path for path in out.rglob("*.png")}
            files[scheme, column] = recovered, truth
    return pictures, files


def gray(image):
    return np.asarray(image.convert("L"), dtype=float)


def ssim(a, b, side=7):
    """Returns structural similarity in all windows, with the constants of scikit-image."""
    mean = lambda x: np.lib.stride_tricks.sliding_window_view(x, (side, side)).mean((2, 3))
    ma, mb, sample = mean(a), mean(b), side**2 / (side**2 - 1)
    va, vb, vab = (sample * (mean(x * y) - mx * my) for x, y, mx, my in ((a, a, ma, ma), (b, b, mb, mb), (a, b, ma, mb)))
    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    return (2 * ma * mb + c1) * (2 * vab + c2) / ((ma**2 + mb**2 + c1) * (va + vb + c2))


def textures(args, pictures, files, scheme, column):
    """Returns per block its texture, its keypoints, how many of them are recovered, and its SSIM."""
    recovered, truth = (np.load(path) for path in files[scheme, column])
    rows = []
    for name, path in pictures[scheme, column].items():
        picture = Image.open(path)
        photo = Image.open(args.photos / name).resize(picture.size, Image.BOX)
        known, slot = truth[f"{name}/position"], truth[f"{name}/slot"]
        error = np.full(len(known), np.inf)
        error[slot >= 0] = np.linalg.norm(recovered[f"{name}/position"][slot[slot >= 0]] - known[slot >= 0], axis=1)
        similar = np.pad(ssim(gray(photo), gray(picture)), 3, constant_values=np.nan)
        at = (known // (2 * BLOCK)).astype(int)
        for y in range(picture.height // BLOCK):
            for x in range(picture.width // BLOCK):
                part = np.s_[y * BLOCK : (y + 1) * BLOCK, x * BLOCK : (x + 1) * BLOCK]
                inside = (at == (x, y)).all(axis=1)
                rows.append((gray(photo)[part].std(), inside.sum(), (error[inside] <= WITHIN_PX).sum(), np.nanmean(similar[part])))
    return np.array(rows)


def texture_table(args, pictures, files, schemes):
    print("| scheme | lists | texture | keypoints, % | recovered, % | SSIM |\n| --- | --- | --- | --- | --- | --- |")
    for scheme in schemes:
        for column in ("0.5", OWN):
            rows = textures(args, pictures, files, scheme, column)
            quarter = np.argsort(np.argsort(rows[:, 0], kind="stable")) * 4 // len(rows)
            for part, name in enumerate(("least", "second", "third", "most")):
                of = rows[quarter == part]
                n = of[:, 1].sum()
                print(f"| {scheme} | {column} | {name} | {100 * n / rows[:, 1].sum():.0f} | {100 * of[:, 2].sum() / max(n, 1):.1f} | {of[:, 3].mean():.3f} |")


def grids(args, pictures, schemes):
    columns = ["true points", *RATIOS, OWN]
    for name in pictures[schemes[0], columns[0]]:
        width, height = Image.open(pictures[schemes[0], columns[0]][name]).size
        cell, edge = (width // 2, height // 2), 16
        grid = Image.new("RGB", ((len(columns) + 1) * cell[0], len(schemes) * (cell[1] + edge)), "white")
        draw = ImageDraw.Draw(grid)
        for row, scheme in enumerate(schemes):
            top = row * (cell[1] + edge)
            sources = [("photo", args.photos / name), *((column, pictures[scheme, column][name]) for column in columns)]
            for at, (label, path) in enumerate(sources):
                draw.text((at * cell[0] + 3, top + 2), f"{scheme}, {label}" if at else label, fill="black")
                grid.paste(Image.open(path).convert("RGB").resize(cell), (at * cell[0], top + edge))
        out = args.out / f"{name}.png"
        out.parent.mkdir(parents=True, exist_ok=True)
        grid.save(out)
        print(out)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("photos", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--features", default="sift")
    parser.add_argument("--max-images", type=int, default=3)
    parser.add_argument("--model", type=pathlib.Path)
    parser.add_argument("--descriptors", type=pathlib.Path)
    parser.add_argument("--scale", default="1")
    args = parser.parse_args()
    schemes = ["olc", "ppl", "ppl+", "ray", "plane", "cp"] if args.model else ["lines2d", "cp2d", "dcl2d"]
    with tempfile.TemporaryDirectory() as folder:
        pictures, files = attack(args, pathlib.Path(folder), schemes)
        grids(args, pictures, schemes)
        if not args.model:
            texture_table(args, pictures, files, schemes)


main()

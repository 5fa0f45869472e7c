"""The tables of sequences in docs/benchmarks.md: keypoints of several queries with known poses.

Used by make_benchmarks.py; standard library only. Alone, it prints the tables: sequence_tables.py PROGRAM SHARED.
"""
import json, pathlib, subprocess, sys, tempfile

SCHEMES = ["lines2d", "cp2d", "dcl2d"]
# Scene, features, model, photos, options.
SCENES = [("RedKitchen", "SIFT", "redkitchen", "redkitchen", []),
          ("RedKitchen", "ALIKED", "redkitchen-aliked", "redkitchen", ["--features", "aliked"]),
          # All 74,301 keypoints would take four times as long.
          ("Castle", "SIFT, 2,000 and more a photo", "castle", "castle", ["--max-features", "2000"]),
          ("Castle", "ALIKED", "castle", "castle", ["--features", "aliked"])]
POSES = ["perturbed:1,0.1", "perturbed:5,0.5"]


def audit(program, shared, model, photos, *options):
    with tempfile.TemporaryDirectory() as out:
        data = shared / "data"
        command = [program, "audit", "sequence", data / model / "model", data / photos / "images", "--quiet", "--queries", "3,5,10,20",
                   "--out", f"{out}/audit", *options]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return json.loads(pathlib.Path(out, "audit/audit.json").read_text())


def head(names):
    yield "| " + " | ".join(names) + " |"
    yield "|" + " --- |" * len(names)


def by_queries(document):
    return {(row["scheme"], row["neighbors"]): row for row in document["results"]}


def percents(row):
    return " / ".join(f"{x:.1f}" for x in row["recovered_percent"].values())


def numbers(document):
    return sorted({row["k"] for row in document["results"]})


def cell(own, true):
    """Percent within 10 px of all keypoints; of those that the model tracks [with its tracks]; sure ones, how many are right."""
    of, right = "tracked_within_10_percent", own.get("sure_correct_percent")
    sure = f"{own['sure_percent']:.1f}" + (f", {right:.1f}" if right is not None else "")
    return f"{own['recovered_percent']['10']:.1f}; {own['metrics'][of]:.1f} [{true['metrics'][of]:.1f}]; {sure}"


def lines(scene, document):
    """The rows of one scene."""
    rows = by_queries(document)
    for n in [n for n in numbers(document) if n >= 3]:
        own, true = ([rows[s, f"{by}@{n}"] for s in SCHEMES] for by in ("sequence", "tracks"))
        metrics, right = own[0]["metrics"], 100 * own[0]["inlier_ratio"]
        cells = [f"{metrics['tracked_percent']:.0f}", f"{metrics['linked_percent']:.0f}, {right:.0f}", *map(cell, own, true)]
        yield f"| {scene} | {n} | " + " | ".join(cells) + " |"


def off(documents):
    """The table with perturbed poses, by their option."""
    yield from ["RedKitchen, ALIKED, with an error of the poses, percent of all keypoints within 5 / 10 / 25 px:", "",
                *head(["cm, degrees", "queries", *SCHEMES])]
    for poses, document in documents.items():
        rows = by_queries(document)
        for n in [n for n in numbers(document) if n >= 5]:
            cells = [percents(rows[s, f"sequence@{n}"]) for s in SCHEMES]
            yield f"| {poses.split(':')[1].replace(',', ', ')} | {n} | " + " | ".join(cells) + " |"
    yield ""


def lists(scenes):
    """The table with lists of neighbors within each query, by scene; and keypoints that the service's map does not have."""
    yield from ["Links by descriptors, alone -> combined with lists of neighbors within each query (`--neighbors descriptors`), and the combined "
                "figure for keypoints that show no point of the map [their share]; percent within 10 px:", "",
                *head(["scene", "queries", *SCHEMES, "new things: " + ", ".join(SCHEMES) + " [share]"])]
    for scene, document in scenes.items():
        rows = by_queries(document)
        for n in [n for n in numbers(document) if n >= 3]:
            alone, both = ([rows[s, f"{by}@{n}"] for s in SCHEMES] for by in ("sequence", "sequence+lists"))
            cells = [f"{a['recovered_percent']['10']:.1f} -> {b['recovered_percent']['10']:.1f}" for a, b in zip(alone, both)]
            new = [b["metrics"]["new_within_10_percent"] for b in both]
            cells.append(", ".join(f"{x:.1f}" for x in new) + f" [{both[0]['metrics']['new_percent']:.0f}]")
            yield f"| {scene} | {n} | " + " | ".join(cells) + " |"
    yield ""


def defended(documents):
    """The table with changed descriptors, by their option."""
    yield from ["RedKitchen, ALIKED, with Gaussian noise on the unit descriptors of each query, percent of all keypoints within 10 px:", "",
                *head(["noise", "queries", "links right", *SCHEMES])]
    for name, document in documents:
        rows = by_queries(document)
        for n in [n for n in numbers(document) if n >= 5]:
            cells = [rows[s + name, f"sequence@{n}"] for s in SCHEMES]
            right = f"{100 * cells[0]['inlier_ratio']:.0f}"
            yield f"| {name[6:] or 'none'} | {n} | {right} | " + " | ".join(f"{c['recovered_percent']['10']:.1f}" for c in cells) + " |"
    yield ""


def tables(program, shared):
    found, with_lists = [], {}
    for kind in ("SIFT", "ALIKED"):
        rows, names = [], []
        for scene, features, model, photos, options in SCENES:
            if features.startswith(kind):
                lists_too = ["--neighbors", "descriptors"] if kind == "ALIKED" else []
                document = audit(program, shared, model, photos, *options, *lists_too)
                with_lists |= {scene: document} if lists_too else {}
                images, points = document["input"]["images"]["used"], document["input"]["n_points"]
                names.append(f"{scene} ({images} images, {points:,} keypoints)")
                rows += lines(scene, document)
        found += [f"{kind}, " + " and ".join(names) + ":", "",
                  *head(["scene", "queries", "tracked", "linked, right", *SCHEMES]), *rows, ""]
    found += lists(with_lists)
    scene, features, model, photos, options = SCENES[1]
    noisy = audit(program, shared, model, photos, *options, "--mitigate", "noise:0.05", "--mitigate", "noise:0.1")
    found += defended((name, noisy) for name in ["", "_noise0.05", "_noise0.1"])
    found += off({poses: audit(program, shared, model, photos, *options, "--scale", "1", "--poses", poses) for poses in POSES})
    return found


if __name__ == "__main__":
    print("\n".join(tables(sys.argv[1], pathlib.Path(sys.argv[2]).resolve())))

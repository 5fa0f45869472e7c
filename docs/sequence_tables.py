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


def tables(program, shared):
    found = []
    for kind in ("SIFT", "ALIKED"):
        rows, names = [], []
        for scene, features, model, photos, options in SCENES:
            if features.startswith(kind):
                document = audit(program, shared, model, photos, *options)
                images, points = document["input"]["images"]["used"], document["input"]["n_points"]
                names.append(f"{scene} ({images} images, {points:,} keypoints)")
                rows += lines(scene, document)
        found += [f"{kind}, " + " and ".join(names) + ":", "",
                  *head(["scene", "queries", "tracked", "linked, right", *SCHEMES]), *rows, ""]
    scene, features, model, photos, options = SCENES[1]
    found += off({poses: audit(program, shared, model, photos, *options, "--scale", "1", "--poses", poses) for poses in POSES})
    return found


if __name__ == "__main__":
    print("\n".join(tables(sys.argv[1], pathlib.Path(sys.argv[2]).resolve())))

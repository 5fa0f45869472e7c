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
        command = [program, "audit", "sequence", data / model / "model", data / photos / "images", "--quiet",
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


def shares(document):
    """Percent of all keypoints, with links by descriptors [by the model's tracks]."""
    rows = by_queries(document)
    yield from head(["queries", *SCHEMES])
    for n in numbers(document):
        cells = [f"{percents(rows[s, f'sequence@{n}'])} [{percents(rows[s, f'tracks@{n}'])}]" for s in SCHEMES]
        yield f"| {n} | " + " | ".join(cells) + " |"


def linked(document):
    """Percent within 10 px among the keypoints that the model's tracks link, by descriptors and by these tracks."""
    rows = by_queries(document)
    yield from head(["queries", "tracked", "linked", "right", *SCHEMES])
    for n in numbers(document):
        if n < 3:
            continue
        own = [rows[s, f"sequence@{n}"] for s in SCHEMES]
        true = [rows[s, f"tracks@{n}"] for s in SCHEMES]
        of = "tracked_within_10_percent"
        cells = [f"{a['metrics'][of]:.1f} of {b['metrics'][of]:.1f}" for a, b in zip(own, true)]
        share = [f"{own[0]['metrics'][name]:.1f}" for name in ("tracked_percent", "linked_percent")]
        yield f"| {n} | " + " | ".join([*share, f"{100 * own[0]['inlier_ratio']:.0f}", *cells]) + " |"


def sure(document):
    rows = by_queries(document)
    yield from head(["queries", *SCHEMES])
    for n in numbers(document):
        cells = []
        for scheme in SCHEMES:
            row = rows[scheme, f"sequence@{n}"]
            right = row.get("sure_correct_percent")
            cells.append(f"{row['sure_percent']:.1f}" + (f", {right:.1f} right" if right is not None else ""))
        if n >= 3:
            yield f"| {n} | " + " | ".join(cells) + " |"


def section(scene, features, document, off):
    """The tables of one scene; `off` has the documents with perturbed poses by their option."""
    images, points = document["input"]["images"]["used"], document["input"]["n_points"]
    yield from [f"### {scene}, {features}: {images} images, {points:,} keypoints", "",
                "Percent of all keypoints within 5 / 10 / 25 px, with links by descriptors [by the model's tracks]:", "",
                *shares(document), "",
                "Percent within 10 px among the keypoints that the model tracks in three or more of the views: with links by descriptors, of "
                "that with these tracks. Tracked and linked keypoints are in percent of all; right links, in percent of those that the "
                "model knows:", "", *linked(document), "",
                "Keypoints that the attacker is sure of (90 % within 5 px), in percent, and how many percent of these are right:", "",
                *sure(document), ""]
    if off:
        yield from ["With an error of the poses, percent of all keypoints within 5 / 10 / 25 px:", "",
                    *head(["cm, degrees", "queries", *SCHEMES])]
        for poses, document in off.items():
            rows = by_queries(document)
            for n in [n for n in numbers(document) if n >= 5]:
                cells = [percents(rows[s, f"sequence@{n}"]) for s in SCHEMES]
                yield f"| {poses.split(':')[1].replace(',', ', ')} | {n} | " + " | ".join(cells) + " |"
        yield ""


def tables(program, shared):
    lines = []
    for scene, features, model, photos, options in SCENES:
        document = audit(program, shared, model, photos, *options)
        off = {}
        if model == "redkitchen-aliked":
            off = {poses: audit(program, shared, model, photos, *options, "--scale", "1", "--poses", poses) for poses in POSES}
        lines += section(scene, features, document, off)
    return lines


if __name__ == "__main__":
    print("\n".join(tables(sys.argv[1], pathlib.Path(sys.argv[2]).resolve())))

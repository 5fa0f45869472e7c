"""The tables of images in docs/benchmarks.md: keypoints of photos, hidden and recovered.

Used by make_benchmarks.py; standard library only.
"""
import csv, json, pathlib, subprocess, tempfile

SCHEMES = ["lines2d", "cp2d", "dcl2d"]
RATIOS = [1.0, 0.75, 0.5, 0.3, 0.2, 0.1]
SOLVERS = ["joint", "consensus", "ransac"]
SOURCES = ["learned", "overlap", "similarity"]
# Options of extraction by place. The best 2,048 keypoints of the photos of Castle all have a score above 0.2.
ALIKED = [("RedKitchen, 40 photos", "the best 2,048", ["--min-score", "0.02"]), ("RedKitchen, 40 photos", "score above 0.2", []),
          ("Castle, 11 photos", "the best 2,048 (all score above 0.2)", [])]
SHOWN = ["5", "10", "25"]


def audit(program, images, *options):
    with tempfile.TemporaryDirectory() as out:
        command = [program, "audit", "images", images, "--out", f"{out}/audit", "--quiet", *options]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return json.loads(pathlib.Path(out, "audit/audit.json").read_text())


def published(shared, feature="sift"):
    """The paper's shares: {(scheme, ratio or 'estimated', threshold): percent} on 7-Scenes."""
    table = {}
    for name, ratio_of in (("geometric_2d", lambda row: float(row["inlier_ratio"])),
                           ("end_to_end_2d", lambda row: row["neighborhood"])):
        with open(shared / f"paper/tables/{name}.csv") as lines:
            for row in csv.DictReader(lines):
                wanted = row["dataset"], row["feature"], row.get("metric", "recovered_percent")
                if wanted == ("7-scenes", feature, "recovered_percent"):
                    value = row.get("recovered_percent") or row.get("value")
                    table[row["scheme"], ratio_of(row), row["threshold_px"]] = value
    return table


def percents(of):
    return " / ".join(f"{of[t]:.1f}" for t in SHOWN)


def head(names):
    yield "| " + " | ".join(names) + " |"
    yield "|" + " --- |" * len(names)


def by_ratio(rows, solver, paper):
    of_solver = {(r["scheme"], r["inlier_ratio"]): r for r in rows if r["solver"] == solver and r.get("oracle_noise")}
    yield from head(["In", *SCHEMES])
    for ratio in RATIOS:
        cells = []
        for scheme in SCHEMES:
            known = [paper.get((scheme, ratio, t)) for t in SHOWN]
            beside = f" [{'/'.join(known)}]" if all(known) else ""
            cells.append(percents(of_solver[scheme, ratio]["recovered_percent"]) + beside)
        yield f"| {ratio} | " + " | ".join(cells) + " |"
    yield "| blind | " + " | ".join(percents(of_solver[s, 1.0]["blind_percent"]) for s in SCHEMES) + " |"


def line(rows, what, scheme, value):
    of_scheme = {r["inlier_ratio"]: r for r in rows if (r["solver"], r["scheme"]) == ("joint", scheme)}
    return f"{what}: " + ", ".join(value(of_scheme[ratio]) for ratio in RATIOS) + "."


def scene(name, document, paper, solvers):
    rows = document["results"]
    yield from [f"### {name}", ""]
    for solver in solvers:
        yield from [f"`{solver}`:", "", *by_ratio(rows, solver, paper), ""]
    ratios = " / ".join(map(str, RATIOS))
    yield line(rows, f"`cp2d` exactly (the value that another record publishes), percent, In {ratios}", "cp2d", lambda r: f"{r['exact_percent']:.1f}")
    for scheme in SCHEMES:
        yield line(rows, f"`{scheme}` over distinct positions, within 5 / 10 / 25 px", scheme,
                   lambda r: percents(r["distinct"]["recovered_percent"]))
    yield ""
    for solver in solvers:
        errors = [r["median_error"] for ratio in RATIOS for r in rows
                  if (r["solver"], r["scheme"], r["inlier_ratio"]) == (solver, "dcl2d", ratio)]
        told = " / ".join("lost" if e is None else f"{e:.0f}" for e in errors)
        yield f"`dcl2d`, median error of `{solver}`, px, In {ratios}: {told}; blind {rows[-1]['blind_median_error']:.0f}."
    run = document["run"]
    yield ""
    yield (f"Cost: {run['seconds']['total']:.1f} s for {rows[0]['n_points']:,} keypoints, {run['threads']} threads, peak "
           f"{run['peak_memory_bytes'] / 2**20:.0f} MiB.")
    yield ""


def without_oracle(name, document, paper, sources=SOURCES, trained_on="SIFT"):
    found = {(r["neighbors"], r["scheme"]): r for r in document["results"]}
    yield from [f"### {name}, neighborhoods from descriptors alone", ""]
    yield from head(["neighbors by", *SCHEMES])
    for source in sources:
        cells = [f"{percents(found[source, s]['recovered_percent'])} ({100 * found[source, s]['inlier_ratio']:.1f} %)"
                 for s in SCHEMES]
        yield f"| `{source}` | " + " | ".join(cells) + " |"
    trained = []
    for scheme in SCHEMES:
        known = [paper.get((scheme, "estimated", t)) for t in ("10", "25")]
        trained.append(f"- / {known[0]} / {known[1]}" if all(known) else "-")
    if paper:
        yield f"| paper on 7-Scenes, {trained_on}, by a network trained on 97,000 images of ScanNet | " + " | ".join(trained) + " |"
    yield ""


def tables(program, shared):
    """All lines of the section."""
    paper, data, nothing = published(shared), shared / "data", {}
    oracle = ["--solver", ",".join(SOLVERS)]
    own = [x for source in SOURCES for x in ("--neighbors", source)]
    yield from ["Percent within 5 / 10 / 25 px over all keypoints, K = 20, uniform oracle noise, seed 0; in brackets the paper's mean over",
                "7-Scenes. In parentheses the share of listed keypoints among the true 20 nearest.", ""]
    for name, images, known in (("RedKitchen, 40 photos of 640 x 480", "redkitchen/images", paper),
                                ("RedKitchen, the six images of features-sift.h5", "redkitchen/features-sift.h5", paper),
                                ("Castle, features-sift.h5", "castle/features-sift.h5", nothing)):
        solvers = SOLVERS if known and "40" in name else SOLVERS[:1]
        yield from scene(name, audit(program, data / images, *oracle), known, solvers)
        yield from without_oracle(name, audit(program, data / images, "--solver", "joint", *own), known)
    superpoint = published(shared, "superpoint")
    for place, kept, options in ALIKED:
        known = superpoint if place.startswith("RedKitchen") else nothing
        images = data / place.split(",")[0].lower() / "images"
        found = audit(program, images, "--solver", "joint", "--features", "aliked", *options,
                      "--neighbors", "learned", "--neighbors", "similarity")
        yield from without_oracle(f"{place}, ALIKED, {kept}", found, known, ["learned", "similarity"], "SuperPoint")

"""The tables of images in docs/benchmarks.md: keypoints of photos, hidden and recovered.

Used by make_benchmarks.py; standard library only.
"""
import csv, json, pathlib, subprocess, tempfile

SCHEMES = ["lines2d", "cp2d", "dcl2d"]
RATIOS = [1.0, 0.5, 0.3, 0.2, 0.1]
FEWER = [1.0, 0.5, 0.1]
SOLVERS = ["ranking", "joint", "ransac"]
SOURCES = ["learned", "overlap", "similarity"]
# Options of extraction by scene. The best 2,048 keypoints of the photos of Castle all have a score above 0.2.
ALIKED = [("RedKitchen", "ALIKED 2,048", ["--min-score", "0.02"]), ("RedKitchen", "ALIKED 0.2", []),
          ("Castle", "ALIKED 2,048", [])]
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


def by_ratio(rows, solver, paper, ratios, blind):
    of_solver = {(r["scheme"], r["inlier_ratio"]): r for r in rows if r["solver"] == solver and r.get("oracle_noise")}
    yield from head(["In", *SCHEMES])
    for ratio in ratios:
        cells = []
        for scheme in SCHEMES:
            known = [paper.get((scheme, ratio, t)) for t in SHOWN]
            beside = f" [{'/'.join(known)}]" if all(known) else ""
            cells.append(percents(of_solver[scheme, ratio]["recovered_percent"]) + beside)
        yield f"| {ratio} | " + " | ".join(cells) + " |"
    if blind:
        yield "| blind | " + " | ".join(percents(of_solver[s, 1.0]["blind_percent"]) for s in SCHEMES) + " |"


def scene(name, document, paper, solvers):
    rows = document["results"]
    yield from [f"### {name}", ""]
    for solver in solvers:
        first = solver == solvers[0]
        yield from [f"`{solver}`:", "", *by_ratio(rows, solver, paper if first else {}, RATIOS if first and paper else FEWER, first), ""]
    of = {(r["scheme"], r["inlier_ratio"]): r for r in rows if r["solver"] == "ranking"}
    ratios = " / ".join(map(str, FEWER))
    exact = " / ".join(f"{of['cp2d', ratio]['exact_percent']:.1f}" for ratio in FEWER)
    errors = [of["dcl2d", ratio]["median_error"] for ratio in FEWER]
    told = " / ".join("lost" if e is None else f"{e:.0f}" for e in errors)
    yield f"`ranking`, In {ratios}: `cp2d` exactly {exact} %; median error of `dcl2d` {told} px, blind {rows[-1]['blind_median_error']:.0f}."
    yield ""


def without_oracle(name, document, sources=SOURCES):
    found = {(r["neighbors"], r["scheme"]): r for r in document["results"]}
    for source in sources:
        right = 100 * found[source, SCHEMES[0]]["inlier_ratio"]
        cells = [percents(found[source, s]["recovered_percent"]) for s in SCHEMES]
        yield f"| {name} | `{source}` | {right:.1f} | " + " | ".join(cells) + " |"


def published_row(paper, trained_on):
    trained = []
    for scheme in SCHEMES:
        known = [paper.get((scheme, "estimated", t)) for t in SHOWN]
        trained.append(" / ".join(x or "-" for x in known) if any(known) else "-")
    return f"| paper, 7-Scenes, {trained_on} | a network | - | " + " | ".join(trained) + " |"


def tables(program, shared):
    """All lines of the section."""
    paper, data = published(shared), shared / "data"
    oracle = ["--solver", ",".join(SOLVERS)]
    own = [x for source in SOURCES for x in ("--neighbors", source)]
    yield from ["Percent of all keypoints within 5 / 10 / 25 px, seed 0; in brackets the paper's mean over 7-Scenes.", ""]
    rows = []
    for name, short, images, known in (("RedKitchen, 40 photos of 640 x 480", "RedKitchen, SIFT", "redkitchen/images", paper),
                                       ("Castle, features-sift.h5", "Castle, SIFT", "castle/features-sift.h5", {})):
        yield from scene(name, audit(program, data / images, *oracle), known, SOLVERS if known else SOLVERS[:1])
        rows += without_oracle(short, audit(program, data / images, "--solver", "ranking", *own))
        if known:
            rows.append(published_row(paper, "SIFT"))
    for place, kept, options in ALIKED:
        images = data / place.lower() / "images"
        found = audit(program, images, "--solver", "ranking", "--features", "aliked", *options,
                      "--neighbors", "learned", "--neighbors", "similarity")
        rows += without_oracle(f"{place}, {kept}", found, ["learned", "similarity"])
    rows.append(published_row(published(shared, "superpoint"), "SuperPoint"))
    yield from ["### Neighborhoods from descriptors alone", "",
                "*Right* is the share of listed keypoints among the true 20 nearest. ALIKED: the best 2,048 keypoints, or all with a score above 0.2.",
                "The paper trained its network on 97,000 images of ScanNet.", ""]
    yield from head(["photos", "neighbors by", "right, %", *SCHEMES])
    yield from [*rows, ""]

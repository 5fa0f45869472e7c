"""The tables of protected descriptors and of sphere clouds in docs/benchmarks.md.

Used by make_benchmarks.py; standard library only. Alone, it prints the tables:

    python3 docs/protect_tables.py target/release/unlift ../shared
"""
import json, os, pathlib, struct, subprocess, sys, tempfile

import again_tables

PROTECTIONS = ["subspace:2", "subspace:4", "ldp:256,2,8"]
MITIGATIONS = ["noise:0.1", "bits:1"]
SCHEMES = ["olc", "plane", "cp"]
QUERIES = ["lines2d", "cp2d"]


def run(command):
    with tempfile.TemporaryDirectory() as out:
        command = [str(part) for part in command] + ["--quiet", "--out", f"{out}/audit"]
        print(" ".join(command), file=sys.stderr)
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return json.loads(pathlib.Path(out, "audit/audit.json").read_text())


def protect(options):
    for one in PROTECTIONS:
        options += ["--protect-descriptors", one]
    return options


def map_audit(program, data, scene, sources, *options):
    """Leak of a map under every protection and mitigation."""
    options = list(options) + ([] if scene == "castle" else ["--scale", "1"])
    for one in MITIGATIONS:
        options += ["--mitigate", one]
    for source in sources:
        options += ["--neighbors", source]
    return run([program, "audit", "map", data / scene / "model", "--descriptors", data / scene / "descriptors.bin", "--solver", "joint",
                "--no-records-alone", *protect(options)])


def both(program, data, scene, photos, kind, sources):
    """The first scheme with localization of held-out images, the others without."""
    with tempfile.TemporaryDirectory() as folder:
        made = f"{folder}/features.h5"
        few = [] if kind == "sift" else ["--min-score", "0.02"]
        subprocess.run([program, "features", data / photos / "images", "--type", kind, "--as-stored", "--quiet", "--out", made, *few],
                       check=True, stdout=subprocess.DEVNULL)
        nth = "4" if scene == "castle" else "10"
        first = map_audit(program, data, scene, sources, "--schemes", SCHEMES[0], "--localize", made, "--hold-out", nth)
    others = map_audit(program, data, scene, sources, "--schemes", ",".join(SCHEMES[1:]))
    return {**first, "results": first["results"] + others["results"]}


def images_audit(program, data, photos, kind):
    more = ["--neighbors", "overlap"] if kind == "sift" else []
    return run([program, "audit", "images", data / photos / "images", "--features", kind, "--max-images", "10", "--schemes",
                ",".join(QUERIES), "--neighbors", "similarity", *more, "--solver", "joint", *protect([])])


def sphere_audit(program, data, scene, source):
    options = [] if scene == "castle" else ["--scale", "1"]
    return run([program, "audit", "map", data / scene / "model", *options, "--descriptors", data / scene / "descriptors.bin",
                "--schemes", "sphere,sphere-half,sphere-quarter", "--neighbors", source, "--solver", "consensus", "--no-records-alone"])


def strongest(document, scheme):
    """The row of a scheme that recovers most within the first threshold, and that share."""
    rows = [row for row in document["results"] if row["scheme"] == scheme]
    first = list(rows[0]["recovered_percent"])[-2 if rows[0]["unit"] in ("px", "pixel") else 0]
    share = lambda row: max(row["recovered_percent"][first], row["blind_percent"][first])
    return max(rows, key=share), max(map(share, rows))


def names(document, schemes):
    """Row names of every variant, with the text of its first column."""
    yield "none", {scheme: scheme for scheme in schemes}
    options = document["options"]
    for one in options.get("mitigate", []) + options.get("protect_descriptors", []):
        yield f"`{one}`", {scheme: f"{scheme}_{one}" for scheme in schemes}


def error_of(found):
    """The error of held-out images, and the percentage placed within the first limit if not all are."""
    if found["multiple"] is None:
        return "no pose"
    placed = list(found["recall_percent"].values())[0]
    return f"{found['multiple']:.1f}" + (f" ({placed:.0f} %)" if placed < 99.5 else "")


def leak(name, document, schemes):
    held = {row["scheme"]: row.get("held_out") for row in document.get("localization", [])}
    within = list(document["results"][0]["recovered_percent"])[-2 if document["results"][0]["unit"] in ("px", "pixel") else 0]
    heads = ["descriptors", "true in lists, %", *(f"`{scheme}`" for scheme in schemes)]
    if any(held.values()):
        heads += ["right matches", "error"]
    yield f"{name}, within {within}:"
    yield ""
    yield "| " + " | ".join(heads) + " |"
    yield "|" + " --- |" * len(heads)
    for text, variant in names(document, schemes):
        best = [strongest(document, variant[scheme]) for scheme in schemes]
        row, _ = best[0]
        cells = [text, f"{100 * row['inlier_ratio']:.1f} `{row['neighbors']}`", *(f"{share:.1f}" for _, share in best)]
        found = held.get(variant[schemes[0]])
        if found:
            cells += [f"{found['right_matches']:.0f} of {found['matches']:.0f}", error_of(found)]
        yield "| " + " | ".join(cells + ["-"] * (len(heads) - len(cells))) + " |"
    yield ""


def queries(documents):
    """Localization with protected queries and the map in the clear, all maps in one table."""
    held = {name: {row["scheme"]: row["held_out"] for row in document["localization"] if row.get("of_queries")}
            for name, document in documents.items()}
    yield "Protected queries and a plain map, error:"
    yield ""
    yield "| descriptors of the query | " + " | ".join(f"{name}, `{scheme}`" for name in held for scheme in QUERIES) + " |"
    yield "|" + " --- |" * (1 + len(held) * len(QUERIES))
    protections = next(iter(documents.values()))["options"]["protect_descriptors"]
    for text, variant in names({"options": {"protect_descriptors": protections}}, QUERIES):
        cells = []
        for of_map in held.values():
            for scheme in QUERIES:
                cells.append(error_of(of_map[variant[scheme]]))
        yield f"| {text} | " + " | ".join(cells) + " |"
    yield ""


def spheres(documents):
    yield "| map | scheme | real bearings, % | true in lists, % | decoys: precision / recall, % | area |"
    yield "|" + " --- |" * 6
    most = 0.0
    for name, document in documents.items():
        for row in document["results"]:
            metric = row["metrics"]
            most = max(most, list(row["recovered_percent"].values())[0])
            yield (f"| {name} | `{row['scheme']}` | {metric['real_bearings_percent']:.0f} | {100 * row['inlier_ratio']:.0f} | "
                   f"{metric['decoys_precision_percent']:.0f} / {metric['decoys_recall_percent']:.0f} | {metric['decoys_area']:.3f} |")
    yield ""
    yield f"Points within the first threshold: at most {most:.1f} %."
    yield ""


def two_spheres(program, data):
    """RedKitchen and its lower 80 % along x, which have centers 0.4 m apart."""
    scene = data / "redkitchen"
    dim, kind, rows = again_tables.described(scene / "descriptors.bin")
    points = again_tables.points(scene / "model")
    bound = sorted(place[0] for _, place in points)[len(points) * 4 // 5]
    kept = [(id_, place) for id_, place in points if place[0] < bound]
    with tempfile.TemporaryDirectory() as folder:
        part, descriptors = pathlib.Path(folder, "part.csv"), pathlib.Path(folder, "part.bin")
        part.write_text("x,y,z\n" + "".join(",".join(map(repr, place)) + "\n" for _, place in kept))
        descriptors.write_bytes(b"P3DESC01" + struct.pack("<QII", len(kept), dim, kind) + struct.pack(f"<{len(kept)}Q", *range(len(kept)))
                                + b"".join(rows[id_] for id_, _ in kept))
        return again_tables.audit(program, scene / "model", part, [scene / "descriptors.bin", descriptors], "--scale", "1",
                                  "--schemes", "sphere,sphere-half,sphere-quarter")


def views(data):
    """Views from the center of sphere clouds beside those of all true points."""
    root = pathlib.Path(__file__).resolve().parent.parent
    yield "| map | `sphere` | `sphere-half` | `sphere-quarter` | one color |"
    yield "|" + " --- |" * 5
    for name, scene in [("RedKitchen, SIFT", "redkitchen"), ("RedKitchen, ALIKED", "redkitchen-aliked"), ("Castle, SIFT", "castle")]:
        command = ["cargo", "run", "--release", "--quiet", "-p", "unlift-audit", "--example", "sphere_views", "--",
                   data / scene / "model", data / scene / "descriptors.bin"]
        lines = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, cwd=root).stdout.splitlines()
        rows = [line.split() for line in lines]
        yield f"| {name} | " + " | ".join(f"{row[1]} / {row[2]}" for row in rows) + f" | {rows[0][3]} / {rows[0][4]} |"
    yield ""


def tables(program, shared):
    data = pathlib.Path(shared).resolve() / "data"
    keep = os.environ.get("KEEP")

    def kept(name, make):
        file = pathlib.Path(keep, f"{name}.json") if keep else None
        if file and file.exists():
            return json.loads(file.read_text())
        document = make()
        if file:
            file.write_text(json.dumps(document))
        return document

    lines, of_queries = [""], {}
    for name, scene, photos, kind, sources in [("Castle, SIFT", "castle", "castle", "sift", ["similarity", "overlap"]),
                                               ("RedKitchen, ALIKED", "redkitchen-aliked", "redkitchen", "aliked", ["similarity"]),
                                               ("RedKitchen, SIFT", "redkitchen", "redkitchen", "sift", ["similarity", "overlap"])]:
        document = kept(f"protect-{scene}", lambda: both(program, data, scene, photos, kind, sources))
        lines += leak(name, document, SCHEMES)
        of_queries[name] = document
    lines += queries(of_queries)
    for name, photos, kind in [("RedKitchen, SIFT", "redkitchen", "sift"), ("RedKitchen, ALIKED", "redkitchen", "aliked"),
                               ("Castle, SIFT", "castle", "sift"), ("Castle, ALIKED", "castle", "aliked")]:
        document = kept(f"protect-images-{photos}-{kind}", lambda: images_audit(program, data, photos, kind))
        lines += leak(f"Keypoints of 10 photos, {name}", document, QUERIES)
    found = {name: kept(f"sphere-{scene}", lambda: sphere_audit(program, data, scene, source))
             for name, scene, source in [("RedKitchen, SIFT", "redkitchen", "overlap"),
                                         ("RedKitchen, ALIKED", "redkitchen-aliked", "similarity"), ("Castle, SIFT", "castle", "overlap")]}
    twice = kept("sphere-twice", lambda: two_spheres(program, data))
    return lines + ["Sphere clouds:", "", *spheres(found), "Two sphere clouds of RedKitchen, SIFT, of all points and of the lower 80 % along x:", "",
                    *again_tables.table(twice), "", "Views from the center, SSIM / LPIPS beside those of all true points:", "", *views(data)]


if __name__ == "__main__":
    print("\n".join(tables(pathlib.Path(sys.argv[1]).resolve(), sys.argv[2])))

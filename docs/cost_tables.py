"""The tables of costs in docs/benchmarks.md: what comes back, and how well a camera can still be placed.

Used by make_benchmarks.py; standard library only.
"""
import json, os, pathlib, subprocess, tempfile

SCHEMES = ["olc", "ppl", "ppl+", "ray", "ray-voxel", "plane", "cp"]
QUERIES = ["lines2d", "cp2d", "dcl2d"]
# Mitigations change `ppl+` as they change `ppl`.
MITIGATED = [scheme for scheme in SCHEMES if scheme != "ppl+"]
MITIGATIONS = ["thin:1/4", "thin:1/16", "thin:tracks:1/4", "noise:0.05", "noise:0.1", "bits:2", "bits:1", "pca:32", "drop:0.5",
               "thin:1/4,bits:1"]


def features(program, photos, kind, out):
    options = [] if kind == "sift" else ["--min-score", "0.02"]
    subprocess.run([program, "features", photos, "--type", kind, "--as-stored", "--quiet", "--out", out, *options], check=True)


def audit(program, shared, scene, features, sources, mitigate):
    with tempfile.TemporaryDirectory() as out:
        scale = [] if scene == "castle" else ["--scale", "1"]
        command = [program, "audit", "map", shared / "data" / scene / "model", *scale,
                   "--descriptors", shared / "data" / scene / "descriptors.bin", "--solver", "joint",
                   "--no-records-alone", "--localize", features, "--hold-out", "4", "--quiet", "--out", f"{out}/audit"]
        for one in mitigate:
            command += ["--mitigate", one]
        for source in sources:
            command += ["--neighbors", source]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return json.loads(pathlib.Path(out, "audit/audit.json").read_text())


def number(value, form="{:.2f}"):
    return "no pose" if value is None else form.format(value)


def bound(documents):
    yield "The bound: error of the camera center as a multiple of the unprotected one (median over images)."
    yield ""
    yield "| map | unprotected | " + " | ".join(SCHEMES + QUERIES) + " |"
    yield "|" + " --- |" * (2 + len(SCHEMES + QUERIES))
    for name, document in documents.items():
        rows = {row["scheme"]: row for row in document["localization"]}
        none = rows["none"]
        unit = "{:.2f} mm" if document["input"]["scale_m_per_unit"] else "{:.4f} x"
        center = unit.format(none["center_error"] * (1000 if "mm" in unit else 1))
        cells = [f"{center}, {none['rotation_error_degrees']:.4f}°"]
        for scheme in SCHEMES + QUERIES:
            row = rows[scheme]
            failed = row["failed_percent"]
            cells.append(number(row["multiple"]) + (f" ({failed:.0f} % fail)" if 0 < failed < 100 else ""))
        yield f"| {name} | " + " | ".join(cells) + " |"
    yield ""


def held_out(documents):
    schemes = ["none", *SCHEMES, *QUERIES]
    found = {name: {row["scheme"]: row["held_out"] for row in document["localization"]} for name, document in documents.items()}
    yield "Held-out images: median errors of the camera center and of the rotation, and the first as a multiple of the unprotected one."
    yield ""
    yield "| scheme | " + " | ".join(documents) + " |"
    yield "|" + " --- |" * (1 + len(documents))
    for scheme in schemes:
        cells = []
        for rows in found.values():
            row = rows[scheme]
            known = f"{number(row['center_error'], '{:.4f}')}, {number(row['rotation_error_degrees'], '{:.3f}°')}, {number(row['multiple'])}"
            cells.append("no pose" if row["multiple"] is None else known)
        yield f"| `{scheme}` | " + " | ".join(cells) + " |"
    yield ""
    for name, rows in found.items():
        first = rows["none"]
        recalls = {scheme: " / ".join(f"{x:.0f}" for x in rows[scheme]["recall_percent"].values()) for scheme in schemes}
        missed = [f"`{scheme}` ({text} %)" for scheme, text in recalls.items() if text != "100 / 100 / 100"]
        yield (f"- {name}: {first['n_images']} images; {first['right_matches']:.0f} of {first['matches']:.0f} matches are right (medians). Within "
               f"{' / '.join(first['recall_percent'])}: all images, except under {' and '.join(missed)}.")
    yield ""


def mitigations(documents):
    yield "Mitigations: recovered percent of the released points / of all points, and the error of the camera center of held-out images as a multiple"
    yield "of the unprotected one (`-`: no pose)."
    yield ""
    for name, document in documents.items():
        cost = {row["scheme"]: row["held_out"]["multiple"] for row in document["localization"]}
        within = list(document["results"][0]["recovered_percent"])[0]
        sources = sorted({f"`{row['neighbors']}`" for row in document["results"]})
        leak = {}
        for row in document["results"]:
            percent = max(row["recovered_percent"][within], row["blind_percent"][within])
            of_all = percent * row["n_points"] / (row["n_points"] + sum(row["dropped"].values()))
            leak[row["scheme"]] = max(leak.get(row["scheme"], (0, 0)), (percent, of_all))
        better = ", whichever recovers more" if len(sources) > 1 else ""
        yield f"{name}, lists by {' or '.join(sources)}{better}, within {within}:"
        yield ""
        yield "| mitigation | " + " | ".join(MITIGATED) + " |"
        yield "|" + " --- |" * (1 + len(MITIGATED))
        named = document["options"].get("mitigate", [])
        for text in [None, *named]:
            cells = []
            for scheme in MITIGATED:
                key = scheme if text is None else f"{scheme}_{text}"
                if key not in leak:
                    cells.append("-")
                    continue
                released, of_all = leak[key]
                said = f"{released:.1f}" if text is None or of_all > 0.97 * released else f"{released:.1f} / {of_all:.1f}"
                cells.append(f"{said}, {'-' if cost[key] is None else number(cost[key])}")
            yield f"| {'none' if text is None else f'`{text}`'} | " + " | ".join(cells) + " |"
        yield ""


def tables(program, shared):
    documents = {}
    with tempfile.TemporaryDirectory() as folder:
        made = {}
        # `learned` recovers little more than these sources (see "Neighborhoods without an oracle") and takes hours for all mitigations.
        for name, scene, photos, kind, sources in [("Castle", "castle", "castle", "sift", ["overlap", "similarity"]),
                                                   ("RedKitchen, ALIKED", "redkitchen-aliked", "redkitchen", "aliked", ["similarity"]),
                                                   ("RedKitchen", "redkitchen", "redkitchen", "sift", ["overlap", "similarity"])]:
            made = f"{folder}/{scene}.h5"
            features(program, shared / "data" / photos / "images", kind, made)
            documents[name] = audit(program, shared, scene, made, sources, MITIGATIONS)
            if keep := os.environ.get("KEEP"):
                pathlib.Path(keep, f"{scene}.json").write_text(json.dumps(documents[name]))
    return ["", *bound(documents), *held_out(documents), *mitigations(documents)]

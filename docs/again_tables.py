"""The tables of two releases of a map in docs/benchmarks.md.

Used by make_benchmarks.py; standard library only. Alone, it prints the tables: again_tables.py PROGRAM SHARED.
"""
import json, pathlib, random, struct, subprocess, sys, tempfile

# Scene and options; without a scale, lengths are multiples of the usual distance to the 50th neighbor.
SCENES = [("RedKitchen", "redkitchen", ["--scale", "1"]), ("Castle", "castle", [])]
MIXED = ["olc/ppl", "olc/plane", "olc/cp", "ray/olc", "ray/plane", "plane/cp", "cp/plane"]
CHANGED = ["olc", "ppl", "plane", "cp"]


def audit(program, a, b, descriptors, *options):
    with tempfile.TemporaryDirectory() as out:
        files = zip(["--descriptors", "--descriptors-of-b"], descriptors)
        command = [program, "audit", "again", a, b, "--quiet", "--no-records-alone", "--out", f"{out}/audit", *options]
        command += [word for pair in files for word in pair]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        return json.loads(pathlib.Path(out, "audit/audit.json").read_text())


def points(model):
    """Ids and positions of a COLMAP model, by id."""
    data, at, found = (model / "points3D.bin").read_bytes(), 8, []
    for _ in range(struct.unpack_from("<Q", data)[0]):
        id_, x, y, z, _, _, _, _, n = struct.unpack_from("<Q3d3BdQ", data, at)
        found.append((id_, (x, y, z)))
        at += 51 + 8 * n
    return sorted(found)


def described(path):
    """Dimension, type and rows by id of a file P3DESC01."""
    data = path.read_bytes()
    n, dim, kind = struct.unpack_from("<QII", data, 8)
    ids, start, size = struct.unpack_from(f"<{n}Q", data, 24), 24 + 8 * n, dim * {1: 1, 2: 2, 3: 4}[kind]
    return dim, kind, {id_: data[start + at * size:start + (at + 1) * size] for at, id_ in enumerate(ids)}


def changed(shared, scene, folder, noise):
    """Writes a later version of a map: a tenth of the points is gone, the tenth around a random point has moved by 0.5 m,
    and each coordinate has an error of `noise`."""
    draws = random.Random(1)
    dim, kind, rows = described(shared / "data" / scene / "descriptors.bin")
    kept = [point for point in points(shared / "data" / scene / "model") if draws.random() >= 0.1]
    middle = draws.choice(kept)[1]
    near = sorted(kept, key=lambda point: sum((a - b) ** 2 for a, b in zip(point[1], middle)))
    moved = {id_ for id_, _ in near[:len(kept) // 10]}
    place = lambda id_, p: [x + draws.gauss(0, noise) + (0.3 if id_ in moved and c < 2 else 0) + (0.25 if id_ in moved and c == 2 else 0)
                            for c, x in enumerate(p)]
    lines = [",".join(repr(x) for x in place(id_, p)) for id_, p in kept]
    (folder / "changed.csv").write_text("x,y,z\n" + "\n".join(lines) + "\n")
    with open(folder / "changed.bin", "wb") as file:
        file.write(b"P3DESC01" + struct.pack("<QII", len(kept), dim, kind))
        file.write(struct.pack(f"<{len(kept)}Q", *range(len(kept))) + b"".join(rows[id_] for id_, _ in kept))
    return folder / "changed.csv", folder / "changed.bin"


def table(document, links=True):
    """The rows of a document; `links` adds how many points are linked, and how many links are right."""
    thresholds = list(document["options"]["thresholds"])
    unit = " m" if document["results"][0]["unit"] == "meter" else ""
    within = " / ".join(thresholds) + unit
    columns = ["linked", "right"] if links else []
    yield "| " + " | ".join(["schemes", f"within {within}", "by geometry alone", *columns, "sure, right", "blind"]) + " |"
    yield "|" + " --- |" * (5 + len(columns))
    rows = {(row["scheme"], row["neighbors"]): row for row in document["results"]}
    shares = lambda row: " / ".join(f"{x:.1f}" for x in row["recovered_percent"].values()) if row else "-"
    for scheme in document["options"]["schemes"]:
        row = rows[scheme, "again"]
        sure = f"{row['sure_percent']:.1f}"
        if row.get("sure_correct_percent") is not None:
            sure += f", {row['sure_correct_percent']:.1f}"
        linked = [f"{row['metrics']['linked_percent']:.1f}", f"{100 * row['inlier_ratio']:.1f}"] if links else []
        cells = [scheme, shares(row), shares(rows.get((scheme, "again-geometry"))), *linked, sure, f"{row['blind_percent'][thresholds[0]]:.1f}"]
        yield "| " + " | ".join(cells) + " |"


def links_line(document):
    """States which links by descriptors exist and are right, over all rows of a document."""
    rows = [row for row in document["results"] if row["neighbors"] == "again"]
    linked, right = min(row["metrics"]["linked_percent"] for row in rows), min(row["inlier_ratio"] for row in rows)
    return f"Linked by descriptors: at least {linked:.1f} %, of which at least {100 * right:.1f} % are right."


def tables(program, shared):
    shared = pathlib.Path(shared)
    for name, scene, options in SCENES:
        model, descriptors = shared / "data" / scene / "model", shared / "data" / scene / "descriptors.bin"
        yield f"### {name}, released twice"
        yield ""
        document = audit(program, model, model, [descriptors], *options)
        yield from [*table(document, links=False), "", links_line(document), ""]
        if scene != "redkitchen":
            continue
        yield f"{name} under two different schemes:"
        yield ""
        document = audit(program, model, model, [descriptors], *options, "--schemes", ",".join(MIXED))
        yield from [*table(document, links=False), "", links_line(document), ""]
        for noise, text in [(0, "is unchanged"), (0.005, "has an error of 5 mm")]:
            with tempfile.TemporaryDirectory() as folder:
                later, of_later = changed(shared, scene, pathlib.Path(folder), noise)
                yield f"{name} and a later version: a tenth of the points is gone, a tenth has moved by half a meter, the rest {text}:"
                yield ""
                document = audit(program, model, later, [descriptors, of_later], *options, "--schemes", ",".join(CHANGED))
                yield from table(document)
                yield ""


if __name__ == "__main__":
    print("\n".join(tables(*sys.argv[1:3])))

"""How many images a second: `unlift audit images` beside `unlift.spark.audit_images` on a local cluster, one after the other.

    python3 docs/fleet.py SHARED --program target/release/unlift --images 100000

Keypoints of the photos of the scenes in SHARED, as they come, under as many names. Needs unlift (a release build), pyspark, pyarrow, numpy and
h5py, and Java; prints a row of a table in docs/benchmarks.md.
"""
import argparse, json, os, pathlib, sqlite3, subprocess, sys, tempfile, time

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

SCHEME, RATIO, K = "lines2d", 0.5, 20
SCENES = ("redkitchen", "castle")


def photos(shared, most):
    """Of each photo at most so many keypoints, as files of hloc have them, and its size."""
    for scene in SCENES:
        with h5py.File(shared / "data" / scene / "features-sift.h5") as file:
            for name in file:
                width, height = map(int, file[name]["image_size"][()])
                yield np.ascontiguousarray(file[name]["keypoints"][:most], dtype="<f4"), width, height


def database(path, images):
    """The images as COLMAP keeps them: the middle of the first pixel at (0.5, 0.5)."""
    with sqlite3.connect(path) as db:
        db.executescript(
            "CREATE TABLE cameras (camera_id INTEGER PRIMARY KEY, model INTEGER, width INTEGER, height INTEGER);"
            "CREATE TABLE images (image_id INTEGER PRIMARY KEY, name TEXT UNIQUE, camera_id INTEGER);"
            "CREATE TABLE keypoints (image_id INTEGER PRIMARY KEY, rows INTEGER, cols INTEGER, data BLOB);"
            "CREATE TABLE descriptors (image_id INTEGER PRIMARY KEY, rows INTEGER, cols INTEGER, data BLOB);")
        for at, (name, (keypoints, width, height)) in enumerate(images, 1):
            db.execute("INSERT INTO cameras VALUES (?, 0, ?, ?)", (at, width, height))
            db.execute("INSERT INTO images VALUES (?, ?, ?)", (at, name, at))
            db.execute("INSERT INTO keypoints VALUES (?, ?, 2, ?)", (at, len(keypoints), (keypoints + 0.5).astype("<f4").tobytes()))


def parquet(path, images):
    names, rows = zip(*images)
    table = pa.table({"name": list(names), "keypoints": [k.reshape(-1) for k, _, _ in rows],
                      "width": pa.array([w for _, w, _ in rows], pa.int32()), "height": pa.array([h for _, _, h in rows], pa.int32())})
    pq.write_table(table, path, row_group_size=1000)


def by_program(program, path, out):
    """Seconds, peak MiB."""
    command = [program, "audit", "images", path, "--schemes", SCHEME, "--neighbors", "oracle", "--inlier-ratios", RATIO, "--k", K, "--solver", "joint",
               "--quiet", "--out", out]
    started = time.monotonic()
    child = subprocess.Popen([str(x) for x in command], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    if status:
        raise SystemExit(f"unlift audit images: {os.waitstatus_to_exitcode(status)}")
    return time.monotonic() - started, usage.ru_maxrss / 1024


def by_cluster(path, out):
    """Seconds from a running session to rows on the disk. A master and two workers of one core."""
    import pyspark
    import unlift.spark

    os.environ["PYSPARK_PYTHON"] = sys.executable
    os.environ.setdefault("SPARK_LOCAL_IP", "127.0.0.1")
    builder = pyspark.sql.SparkSession.builder.master("local-cluster[2,1,2048]").config("spark.ui.enabled", "false")
    builder = builder.config("spark.ui.showConsoleProgress", "false")
    spark = builder.config("spark.executor.memory", "1024m").getOrCreate()
    spark.sparkContext.setLogLevel("ERROR")
    # Executors start, and load the package.
    unlift.spark.audit_images(spark.read.parquet(str(path)).limit(4), schemes=[SCHEME], inlier_ratios=[RATIO], k=K).count()
    started = time.monotonic()
    images = spark.read.parquet(str(path)).repartition(64)
    rows = unlift.spark.audit_images(images, schemes=[SCHEME], inlier_ratios=[RATIO], k=K, solvers=["joint"])
    rows.write.parquet(str(out))
    spent = time.monotonic() - started
    written = spark.read.parquet(str(out))
    counts = written.count(), written.where("error is not null").count()
    spark.stop()
    return spent, *counts


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("shared", type=pathlib.Path)
    parser.add_argument("--program", type=pathlib.Path, required=True)
    parser.add_argument("--images", type=int, default=100_000)
    parser.add_argument("--keypoints", type=int, default=100, help="of an image at most [default: 100]")
    args = parser.parse_args()
    found = list(photos(args.shared, args.keypoints))
    images = [(f"{at:06}.jpg", found[at % len(found)]) for at in range(args.images)]
    with tempfile.TemporaryDirectory(dir=os.environ.get("UNLIFT_SCALE")) as folder:
        at = pathlib.Path(folder)
        database(at / "database.db", images)
        parquet(at / "images.parquet", images)
        alone, peak = by_program(args.program.resolve(), at / "database.db", at / "audit")
        document = json.loads((at / "audit/audit.json").read_text())
        spread, n_rows, n_errors = by_cluster(at / "images.parquet", at / "rows")
    n = args.images
    print(f"{len(found)} photos, {sum(len(k) for _, (k, _, _) in images) / n:.0f} keypoints an image; {n_rows:,} rows, {n_errors} errors; "
          f"program: {document['results'][0]['recovered_percent']}")
    print("| images | program, images a second | cluster, images a second | cluster / program | peak of the program |")
    print("| --- | --- | --- | --- | --- |")
    print(f"| {n:,} | {n / alone:.0f} ({alone:.0f} s) | {n / spread:.0f} ({spread:.0f} s) | {alone / spread:.2f} | {peak:.0f} MiB |")


if __name__ == "__main__":
    main()

"""Joint recovery on a local cluster beside one machine: the same bytes, and in what time.

    python3 docs/rounds.py SHARED --points 100000 --scheme ppl

RedKitchen side by side with a jitter of 3 mm, oracle lists of 50 at In 0.3. Needs unlift (a release build), pyspark, pyarrow and numpy, and Java;
prints a row of a table in docs/benchmarks.md.
"""
import argparse, os, pathlib, resource, sys, tempfile, time

import numpy as np
import pyarrow.parquet as pq
import pyspark
import unlift
import unlift.spark


def tiled(points, n):
    """So many points: copies beside each other along the two longest sides."""
    low, high = np.percentile(points, [1, 99], axis=0)
    first, second = np.argsort(low - high)[:2]
    copies = -(-n // len(points))
    side = int(np.ceil(np.sqrt(copies)))
    all_of = np.tile(points, (copies, 1))
    copy = np.repeat(np.arange(copies), len(points))
    all_of[:, first] += (high - low)[first] * (copy % side)
    all_of[:, second] += (high - low)[second] * (copy // side)
    all_of[len(points):] += np.random.default_rng(0).normal(0, 0.003, (len(all_of) - len(points), 3))
    return all_of[:n]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("shared", type=pathlib.Path)
    parser.add_argument("--points", type=int, default=100_000)
    parser.add_argument("--scheme", default="ppl")
    parser.add_argument("--parts", type=int, default=8)
    args = parser.parse_args()
    kitchen = unlift.read(args.shared / "data" / "redkitchen" / "model", scale=1.0)
    hidden = unlift.obfuscate(unlift.Map(tiled(kitchen.positions, args.points), scale=1.0), args.scheme, seed=1)
    lists = unlift.neighbors.oracle(hidden, 0.3, k=50)

    os.environ["PYSPARK_PYTHON"] = sys.executable
    os.environ.setdefault("SPARK_LOCAL_IP", "127.0.0.1")
    builder = pyspark.sql.SparkSession.builder.master("local-cluster[2,1,2048]").config("spark.ui.enabled", "false")
    builder = builder.config("spark.ui.showConsoleProgress", "false").config("spark.driver.maxResultSize", "4g")
    spark = builder.config("spark.executor.memory", "2048m").config("spark.driver.memory", "4g").getOrCreate()
    spark.sparkContext.setLogLevel("ERROR")
    with tempfile.TemporaryDirectory(dir=os.environ.get("UNLIFT_SCALE")) as folder:
        at = pathlib.Path(folder)
        hidden.released.save(at / "released")
        pq.write_table(unlift.parts.table(lists), at / "lists.parquet", row_group_size=1 << 16)
        started = time.monotonic()
        whole = unlift.recover(hidden, lists, confidence=False)
        alone = time.monotonic() - started
        started = time.monotonic()
        model, outline = unlift.rounds.prepare(hidden, lists)
        prepared = time.monotonic() - started
        started = time.monotonic()
        frame = spark.read.parquet(str(at / "lists.parquet"))
        back = unlift.spark.recover_in_rounds(frame, str(at / "released"), model, outline, n_parts=args.parts)
        spread = time.monotonic() - started
        back.save(at / "parts")
        whole.save(at / "whole")
        same = (at / "parts").read_bytes() == (at / "whole").read_bytes()
    spark.stop()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print("| points | scheme | one machine | model | cluster, in parts | the same bytes |")
    print("| --- | --- | --- | --- | --- | --- |")
    print(f"| {args.points:,} | {args.scheme} | {alone:.1f} s | {prepared:.1f} s | {spread:.1f} s, {args.parts} | {'yes' if same else 'NO'} |")
    print(f"peak of this process {peak:.0f} MiB", file=sys.stderr)


if __name__ == "__main__":
    main()

"""Writes third_party/ beside this script with pyarrow, for tests on machines without it.

    python3 crates/unlift-io/tests/data/third_party.py

The map: 12 points on a grid, a line through each (records in reverse order, so that nothing hangs
on order); neighborhoods are all other records. The snippets of docs/formats.md write the plain kinds,
and are run where pyarrow is installed.
"""
import os
import pathlib

import numpy as np

points = np.array([[x, y, z] for x in range(3) for y in range(2) for z in range(2)], float)
towards = np.random.default_rng(0).normal(size=points.shape)
records = [[r for r in range(len(points)) if r != own] for own in range(len(points))]

folder = pathlib.Path(__file__).parent / "third_party"
folder.mkdir(exist_ok=True)
os.chdir(folder)
import json, pyarrow as pa, pyarrow.parquet as pq
# Types that our own writer does not use: 64-bit, large and fixed-size lists, a dictionary, columns we
# do not know, rows out of order, no metadata.
extra = pa.array(["a"] * len(points)).dictionary_encode()
descriptor = pa.FixedSizeListArray.from_arrays(pa.array(range(4 * len(points)), pa.int16()), 4)
rays = {"center": pa.array([0, 1] * 6, pa.int64()), "name": extra, "descriptor": descriptor}
rays |= {f"direction_{a}": pa.array(towards[:, i].astype(np.float32)) for i, a in enumerate("xyz")}
meta = {"kind": "released", "version": 1, "family": "rays", "dimension": 3, "unit": "kth_neighbor",
        "centers": [[0, 0, 0], [2, 1.5, 1]], "made_by": "someone"}
pq.write_table(pa.table(rays).replace_schema_metadata({"unlift": json.dumps(meta)}), "rays.parquet",
               row_group_size=5, compression="none", data_page_version="2.0")
shuffled = [7, 0, 3, 11, 1, 2, 10, 4, 9, 5, 8, 6]
pq.write_table(pa.table({
    "slot": pa.array(shuffled, pa.uint64()),
    "records": pa.array([records[s] for s in shuffled], pa.large_list(pa.int64())),
    "scores": pa.array([[float(r) for r in records[s]] for s in shuffled], pa.list_(pa.float64())),
}), "shuffled.parquet")
lists = pa.table({"point": [5, 0], "neighbors": [[4, 3], [2, 1]]})
pq.write_table(lists, "points.parquet")
pq.write_table(lists, "zstd.parquet", compression="zstd")
pq.write_table(lists, "gzip.parquet", compression="gzip")

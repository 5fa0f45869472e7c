"""Tests on a local Spark cluster of a master and two worker processes, one of which is killed."""

import os
import pathlib
import shutil
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import unlift

pytest.importorskip("pyarrow")
pyspark = pytest.importorskip("pyspark")
if shutil.which("java") is None:
    pytest.skip("no Java: Spark is not tested", allow_module_level=True)

import pyarrow as pa  # noqa: E402

import unlift.spark  # noqa: E402

OPTIONS = {"schemes": ["olc"], "inlier_ratios": [0.5], "solvers": ["joint"], "k": 20, "records_alone": False}
N_MAPS = 8


@pytest.fixture(scope="module")
def spark():
    # Workers run this Python.
    os.environ["PYSPARK_PYTHON"] = sys.executable
    os.environ.setdefault("SPARK_LOCAL_IP", "127.0.0.1")
    builder = pyspark.sql.SparkSession.builder.master("local-cluster[2,1,1024]").appName("unlift")
    builder = builder.config("spark.ui.enabled", "false").config("spark.sql.shuffle.partitions", "4")
    session = builder.config("spark.executor.memory", "512m").getOrCreate()
    yield session
    session.stop()


def tasks(folder: pathlib.Path, n_points: int) -> list[tuple[str, float]]:
    found = []
    for at in range(N_MAPS):
        path = folder / f"map{at}.npy"
        np.save(path, np.random.default_rng(at).uniform(0, 4, (n_points, 3)))
        found.append((str(path), 1.0))
    return found


def executors() -> list[int]:
    found = subprocess.run(["pgrep", "-f", "CoarseGrainedExecutorBackend"], capture_output=True, text=True).stdout
    return [int(line) for line in found.split()]


def alone(rows: list[tuple[str, float]]) -> list[dict]:
    table = pa.table({"path": [path for path, _ in rows], "scale": [scale for _, scale in rows]})
    batches = list(unlift.fleet.audit_maps(table.to_batches(), **OPTIONS))
    return [{**row, **of_maps(row)} for row in pa.Table.from_batches(batches).to_pylist()]


def of_maps(row: dict) -> dict:
    return {name: dict(row[name]) for name in row if name.endswith("_percent") and row[name] is not None}


def on(spark, rows: list[tuple[str, float]]) -> list[dict]:
    frame = spark.createDataFrame(rows, "path string, scale double").repartition(N_MAPS)
    found = [row.asDict() for row in unlift.spark.audit_maps(frame, **OPTIONS).collect()]
    return sorted(found, key=lambda row: row["item"])


def test_a_cluster_gives_the_rows_of_one_machine(spark, tmp_path: pathlib.Path):
    rows = [*tasks(tmp_path, 300), (str(tmp_path / "missing.ply"), 1.0)]
    assert on(spark, rows) == sorted(alone(rows), key=lambda row: row["item"])


def test_tiles_are_those_of_one_machine_though_an_executor_is_killed(spark, tmp_path: pathlib.Path):
    points, each = np.random.default_rng(1).uniform(0, (20, 10, 4), (N_MAPS * 6000, 3)), 6000
    np.save(tmp_path / "city.npy", points)
    tiles = [(str(tmp_path / "city.npy"), 1.0, each, tile) for tile in range(N_MAPS)]
    tasks = spark.createDataFrame(tiles, "path string, scale double, tile_points bigint, tile bigint")
    before, seen = executors(), []
    assert len(before) == 2

    def kill() -> None:
        tracker = spark.sparkContext.statusTracker()
        ends = time.monotonic() + 400
        while time.monotonic() < ends:
            stages = [tracker.getStageInfo(stage) for stage in tracker.getActiveStageIds()]
            # Some tasks are finished, others are running.
            if any(stage and stage.numCompletedTasks and stage.numActiveTasks for stage in stages):
                os.kill(before[0], signal.SIGKILL)
                seen.extend(stage.numCompletedTasks for stage in stages)
                return
            time.sleep(0.01)

    killer = threading.Thread(target=kill)
    killer.start()
    rows = unlift.spark.audit_maps(tasks.repartition(N_MAPS), **OPTIONS).collect()
    killer.join()
    assert seen and seen[0] < N_MAPS, "it was killed in the middle of the job"
    found = [(row["tile"], row["n_points"], dict(row["recovered_percent"])) for row in rows]
    whole = unlift.audit(unlift.Map(points, scale=1.0), tile_points=each, **OPTIONS).document
    expected = [(at, tile["n_points"], tile["recovered_percent"][0]) for at, tile in enumerate(whole["tiles"])]
    assert sorted(found, key=lambda row: row[0]) == expected
    assert before[0] not in executors()

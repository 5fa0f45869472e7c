"""The tables of large maps in docs/benchmarks.md: RedKitchen tiled with jitter, lists in memory and beside it.

Used by make_benchmarks.py; standard library only.
"""
import filecmp, os, pathlib, subprocess, tempfile, time

SCHEMES = ["ppl", "plane"]
LIMITED = ["--memory-limit", "2GB"]


def spent(program, *options):
    """Seconds, peak MiB and GB written of a run."""
    started = time.monotonic()
    child = subprocess.Popen([program, *map(str, options)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise subprocess.CalledProcessError(child.returncode, list(map(str, options)))
    return time.monotonic() - started, usage.ru_maxrss / 1024, usage.ru_oublock * 512 / 1e9


def told(cost, n):
    seconds, peak, written = cost
    return f"{seconds:.1f} s ({1e6 * seconds / n:.1f} µs a point), {peak:.0f} MiB, {written:.1f} GB"


def listed(program, at, scheme):
    """Releases the map in a folder and lists neighbors, under the limit: the cost of the lists, their file, and what recovers the map."""
    spent(program, "obfuscate", at / "map.npy", "--scale", 1, "--scheme", scheme, "--seed", 1, "--out", at / scheme)
    lists = at / f"{scheme}-lists"
    cost = spent(program, "neighbors", "oracle", at / scheme / "truth.parquet", "--k", 50, "--inlier-ratio", 0.3,
                 "--seed", 1, "--out", lists, *LIMITED)
    return cost, lists, ["recover", at / scheme / "released.parquet", "--neighbors", lists, "--seed", 1, "--out"]


def tables(program, tiled, sizes=(100_000, 1_000_000, 10_000_000), in_memory=10_000_000):
    yield "| points | scheme | lists, limited | recover, limited | recover, in memory | the same bytes |"
    yield "| --- | --- | --- | --- | --- | --- |"
    for n in sizes:
        with tempfile.TemporaryDirectory(dir=os.environ.get("UNLIFT_SCALE")) as folder:
            at = pathlib.Path(folder)
            tiled(at / "map.npy", n)
            for scheme in SCHEMES:
                oracle, lists, recover = listed(program, at, scheme)
                away = spent(program, *recover, at / "away", "--force", *LIMITED)
                here, same = "not run", ""
                if n <= in_memory:
                    here = told(spent(program, *recover, at / "here", "--force"), n)
                    same = "yes" if filecmp.cmp(at / "away", at / "here", shallow=False) else "NO"
                yield f"| {n:,} | {scheme} | {told(oracle, n)} | {told(away, n)} | {here} | {same} |"
                lists.unlink()
    yield ""


def killed(command, journal, seconds):
    """Kills a run after so many seconds, and not before something is kept: how many seconds it ran, and bytes that are kept."""
    started = time.monotonic()
    child = subprocess.Popen([*map(str, command)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    kept = lambda: [path for path in journal.glob("*.rounds") if not path.name.startswith(".")]
    while not kept() or time.monotonic() - started < seconds:
        if child.poll() is not None:
            raise SystemExit("it ended before it was killed")
        time.sleep(0.1)
    child.kill()
    child.wait()
    return time.monotonic() - started, sum(path.stat().st_size for path in kept())


def resumed(program, tiled, sizes=(100_000, 1_000_000), scheme="ppl"):
    yield "| points | scheme | without a journal | killed after | kept | then | the same bytes |"
    yield "| --- | --- | --- | --- | --- | --- | --- |"
    for n in sizes:
        with tempfile.TemporaryDirectory(dir=os.environ.get("UNLIFT_SCALE")) as folder:
            at = pathlib.Path(folder)
            tiled(at / "map.npy", n)
            *_, recover = listed(program, at, scheme)
            plain = spent(program, *recover, at / "plain", *LIMITED)
            again = [*recover, at / "again", *LIMITED, "--journal", at / "kept"]
            seconds, kept = killed([program, *again], at / "kept", 0.7 * plain[0])
            rest = spent(program, *again)
            same = filecmp.cmp(at / "plain", at / "again", shallow=False)
            yield (f"| {n:,} | {scheme} | {told(plain, n)} | {seconds:.0f} s | {kept / 1e6:.0f} MB | {told(rest, n)} | "
                   f"{'yes' if same else 'NO'} |")
    yield ""

"""Processes: forked children compute, and an interrupt ends the interpreter without a crash."""

import os
import signal
import subprocess
import sys
import time

import pytest

# A script that runs every computation.
USE = """
import os
import numpy as np, unlift

def use():
    points = np.random.default_rng(1).uniform(0, 4, (3000, 3))
    waves = np.sin(points @ np.random.default_rng(8).uniform(-2, 2, (3, 128)))
    path = f"{PATH}.{os.getpid()}.npy"
    np.save(path, points)
    unlift.read(path, scale=1.0)
    m = unlift.Map(points, (60 + 55 * waves).astype(np.uint8))
    hidden = unlift.obfuscate(m, "ppl", seed=1)
    lists = unlift.neighbors.oracle(hidden, 0.5, k=20)
    for find in [unlift.neighbors.overlap, unlift.neighbors.similarity, unlift.neighbors.geometric]:
        find(hidden)
    back = unlift.recover(hidden, lists, solver="consensus")
    found = unlift.evaluate(back, hidden)
    for part, more in [(hidden.released, []), (hidden.truth, []), (lists, [hidden]), (back, [])]:
        part.save(f"{path}.npz", force=True)
        type(part).read(f"{path}.npz", *more)

    @unlift.scheme
    def upright(points):
        return unlift.Lines(points, np.tile([0.0, 0.0, 1.0], (len(points), 1)))

    unlift.testing.check_scheme(upright)
    report = unlift.audit(m, ["olc", upright], inlier_ratios=[0.5], solvers=["consensus"], thresholds=[0.5])
    report.save(f"{path}.out")
    return found["recovered_percent"], report.rows["recovered_percent_within_0.5"], len(report.html()) > 0
"""


def python(tmp_path, code, *arguments, **options):
    script = tmp_path / "script.py"
    script.write_text(f"PATH = {str(tmp_path / 'points')!r}\n" + code)
    return subprocess.Popen(
        [sys.executable, str(script), *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options
    )


def ended(process, seconds):
    """Returns the output of a process; a process that hangs is killed and fails the test."""
    try:
        out, err = process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        pytest.fail("it hangs")
    return out, err


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_a_forked_child_computes_what_its_parent_does(tmp_path):
    code = USE + """
import multiprocessing
first = use()
with multiprocessing.get_context("fork").Pool(2) as pool:
    found = [pool.apply_async(use) for _ in range(2)]
    print([one.get(timeout=60) == first for one in found])
"""
    process = python(tmp_path, code)
    out, err = ended(process, 150)
    assert out == "[True, True]\n" and process.returncode == 0, err


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_a_forked_child_is_told_of_networks_that_its_parent_used(tmp_path):
    code = """
import multiprocessing
import numpy as np, unlift

def learned():
    points = np.random.default_rng(1).uniform(0, 4, (300, 3))
    sift = np.random.default_rng(2).integers(0, 90, (300, 128)).astype(np.uint8)
    return len(unlift.neighbors.learned(unlift.obfuscate(unlift.Map(points, sift, scale=1.0), "olc")))

fork = multiprocessing.get_context("fork")
with fork.Pool(1) as pool:
    print(pool.apply_async(learned).get(timeout=60))
print(learned())
with fork.Pool(1) as pool:
    try:
        pool.apply_async(learned).get(timeout=60)
    except unlift.UnliftError as error:
        print(error)
"""
    out, err = ended(python(tmp_path, code), 150)
    expected = 'learned: expected a process whose parent has not used it (get_context("spawn")), found a forked child'
    assert out == f"300\n300\n{expected}\n", err


SLOW = """
import sys, time
import numpy as np, unlift

def slow(points):
    print("called", flush=True)
    {body}

m = unlift.Map(np.random.default_rng(1).uniform(0, 4, (300, 3)), scale=1.0)
if sys.argv[1] == "audit":
    unlift.audit(m, [slow, "olc"])
elif sys.argv[1] == "obfuscate":
    unlift.obfuscate(m, slow)
else:
    unlift.testing.check_scheme(slow)
"""


@pytest.mark.parametrize("what, body", [("audit", "while True: pass"), ("obfuscate", "time.sleep(2)"), ("check_scheme", "while True: pass")])
def test_an_interrupt_in_a_function_ends_the_process_in_order(tmp_path, what, body):
    process = python(tmp_path, SLOW.format(body=body), what)
    assert process.stdout.readline() == "called\n"
    started = time.monotonic()
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    out, err = ended(process, 60)
    assert err.rstrip().endswith("KeyboardInterrupt") and "FATAL" not in err and "panicked" not in err, err
    # Python itself ends by the signal, too.
    assert process.returncode == -signal.SIGINT and time.monotonic() - started < 8
    assert out == "", "no function is called again"


def test_a_second_interrupt_waits_for_no_function(tmp_path):
    process = python(tmp_path, SLOW.format(body="time.sleep(30)"), "audit")
    assert process.stdout.readline() == "called\n"
    started = time.monotonic()
    for _ in range(2):
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
    _, err = ended(process, 60)
    assert "KeyboardInterrupt" in err and process.returncode == -signal.SIGINT and time.monotonic() - started < 5, err


IMAGES = """
import numpy as np, unlift

def image(at):
    keypoints = np.random.default_rng(at).uniform(0, [1599, 1199], (4000, 2))
    return {"keypoints": keypoints, "width": 1600, "height": 1200}
"""


def test_an_interrupt_ends_the_function_that_looks_up_images(tmp_path):
    code = IMAGES + """
class Slow:
    def keys(self):
        return ["a", "b"]

    def __getitem__(self, name):
        print("asked", flush=True)
        while True:
            pass

unlift.audit_images(Slow())
"""
    process = python(tmp_path, code)
    assert process.stdout.readline() == "asked\n"
    started = time.monotonic()
    time.sleep(0.2)
    process.send_signal(signal.SIGINT)
    _, err = ended(process, 60)
    assert err.rstrip().endswith("KeyboardInterrupt") and "panicked" not in err, err
    assert process.returncode == -signal.SIGINT and time.monotonic() - started < 8

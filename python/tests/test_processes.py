"""Forked processes and threads give the same bits, and Ctrl-C ends every call."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from conftest import plain

import tongue_fit as tf

ROWS = [("S2", "a"), ("S2", "e"), ("S3", "a")]


def one(row: tuple[str, str]) -> dict[str, Any]:
    return plain(tf.fit(tf.Dataset.reference(), *row, target="stretch", method="gauss-newton", verdict=False))


def some(subject: str) -> str:
    return tf.batch(tf.Dataset.reference(), subjects=subject, target="stretch", progress=False).to_json()


@pytest.mark.parametrize("start", ["fork", "spawn"])
def test_other_processes_fit_with_the_same_bits(start: str) -> None:
    """A forked child computes, although it does not have the threads of this process."""
    expected, whole = [one(row) for row in ROWS], some("S2")
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context(start)) as pool:
        assert list(pool.map(one, ROWS, timeout=120)) == expected
        assert pool.submit(some, "S2").result(timeout=120) == whole
    assert one(ROWS[0]) == expected[0]


def test_workers_of_joblib_fit_with_the_same_bits() -> None:
    """Loky, which scikit-learn uses, starts processes of its own and sends functions to them."""
    joblib = pytest.importorskip("joblib")
    work = joblib.Parallel(n_jobs=2, backend="loky", timeout=120)
    assert work(joblib.delayed(one)(row) for row in ROWS) == [one(row) for row in ROWS]


def test_a_fork_of_a_fork_fits_as_well() -> None:
    code = """
import os, sys, tongue_fit as tf
def fit(): return tf.fit(tf.Dataset.reference(), "S2", "a", target="stretch", method="gauss-newton", verdict=False)["misfit"]
first = fit()
for _ in range(2):
    child = os.fork()
    if child:
        sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
    assert fit() == first
"""
    for threads in ("1", "2"):
        done = subprocess.run([sys.executable, "-c", code], timeout=120, env={**os.environ, "RAYON_NUM_THREADS": threads}, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr


def test_any_number_of_threads_gives_the_same_bits() -> None:
    data = tf.Dataset.reference()
    coarse = tf.Body.tongue(8e-3)
    fits = [plain(tf.fit(data, "S2", "a", target="stretch", body=coarse, threads=threads)) for threads in (None, 1, 3)]
    assert fits[0] == fits[1] == fits[2]
    model = tf.Model().assemble(tf.Body.tongue(), ["GGa", "HGa"])
    seen = model.observations(data.stretches("S2", "a", muscles=["GGa", "HGa"]))
    found = [tf.InverseProblem(model, seen).fit(threads=threads).record() for threads in (None, 1, 2)]
    assert plain(found[0]) == plain(found[1]) == plain(found[2])
    for call in (lambda: tf.fit(data, "S2", "a", threads=0), lambda: tf.InverseProblem(model, seen).fit(threads=2000)):
        with pytest.raises(tf.Error, match="threads must be from 1 to 1024"):
            call()


def test_fits_in_threads_give_the_same_bits() -> None:
    expected = [one(row) for row in ROWS]
    with ThreadPoolExecutor(3) as pool:
        assert list(pool.map(one, ROWS)) == expected


def test_a_solver_in_two_threads_says_what_to_do() -> None:
    model = tf.Model().assemble(tf.Body.tongue(2e-3), ["GGa", "SGm"])
    solver, told = model.solver(), []
    both = threading.Barrier(2)

    def work() -> None:
        both.wait()
        for n in range(20):
            try:
                solver.equilibrium([float(n), 3.0])
            except tf.Error as error:
                told.append(str(error))

    threads = [threading.Thread(target=work) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert told and set(told) == {"this Solver is at work in another thread; give each thread its own: assembly.solver()"}
    assert solver.equilibrium([2.0, 3.0]).positions.tobytes() == model.solver().equilibrium([2.0, 3.0]).positions.tobytes()


#: Long computations, each with the code that prepares it.
LONG = {
    "equilibrium": ("s = fine.solver()", "s.equilibrium({'GGa': 60.0, 'SGm': 60.0})"),
    "equilibrium_from": ("s = fine.solver(); o = s.equilibrium({})", "s.equilibrium_from(o, {'GGa': 60.0, 'SGm': 60.0})"),
    "follow_from_rest": ("s = fine.solver()", "s.follow_from_rest({'GGa': 60.0, 'SGm': 60.0})"),
    "trajectory": ("", "fine.trajectory({'GGa': 20.0}, 10.0)"),
    "fit": ("", "tf.fit(data, 'S2', 'a', body=tf.Body.tongue(0.001))"),
    "problem": ("seen = fine.observations(data.stretches('S2', 'a'))", "tf.InverseProblem(fine, seen, starts=5000).fit()"),
    "batch": ("", "tf.batch(data, body=tf.Body.tongue(1e-3), progress=False)"),
    "mesh": ("", "tf.Body.continuum(0.0003)"),
}


@pytest.mark.parametrize("what", LONG)
def test_ctrl_c_ends_the_wait_within_a_fifth_of_a_second(what: str) -> None:
    """Runs in a process of its own, because test runners may ignore the signal. The thread that sends the signal records the time."""
    before, call = LONG[what]
    spacing = "0.0005" if "fine" in before + call and what != "problem" else "0.0055"
    code = f"""
import os, signal, threading, time, numpy, tongue_fit as tf
signal.signal(signal.SIGINT, signal.default_int_handler)
data = tf.Dataset.reference()
fine = tf.Model().assemble(tf.Body.tongue({spacing}), ["GGa", "SGm", "HGa"])
{before}
sent = []
def interrupt():
    sent.append(time.monotonic())
    os.kill(os.getpid(), signal.SIGINT)
threading.Timer(0.3, interrupt).start()
try:
    {call}
    print("ended by itself", flush=True)
except KeyboardInterrupt:
    print(time.monotonic() - sent[0], flush=True)
os._exit(0)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) < 0.2


def test_a_solver_goes_on_after_ctrl_c() -> None:
    model = tf.Model().assemble(tf.Body.tongue(1e-3), ["GGa", "SGm"])
    solver, fresh = model.solver(), model.solver()
    for one_of in (solver, fresh):
        one_of.shift_bone("hyoid", (1e-3, 0.0))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.05, lambda: signal.raise_signal(signal.SIGINT))
    try:
        with pytest.raises(KeyboardInterrupt):
            timer.start()
            while True:
                solver.follow_from_rest([60.0, 60.0])
    finally:
        timer.join()
        signal.signal(signal.SIGINT, before)
    time.sleep(0.01)
    np.testing.assert_array_equal(solver.equilibrium([2.0, 3.0]).positions, fresh.equilibrium([2.0, 3.0]).positions)


def test_what_is_solved_directly_is_soon_done() -> None:
    """A body that is solved on the calling thread, where Ctrl-C waits for the end, takes less than a fifth of a second."""
    body = tf.Body.tongue()
    solver = tf.Model(poisson_ratio=0.4999).assemble(body, list(body.muscles)).solver()
    for load in (1e3, 1e4, 1e5):
        clock = time.process_time()
        solver.equilibrium(dict.fromkeys(body.muscles, load))
        assert time.process_time() - clock < 0.2

"""A batch in shards on the engines that clusters have: what comes of it is, byte for byte, what one run gives, and a shard that was
killed or is missing is named."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
from slurm import Slurm

import tongue_fit as tf

ROOT = Path(__file__).resolve().parents[2]
CLUSTER = ROOT / "examples/cluster"
OPTIONS = ["--subjects", "S2,S3", "--draws", "150", "--subsets", "1"]
SHARDS = 3


@pytest.fixture(scope="module", autouse=True)
def _program_on_the_path(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """The program, and Snakemake of this Python, for all that is started from here."""
    folder = tmp_path_factory.mktemp("bin")
    (folder / "tongue-fit").symlink_to(os.environ.get("TONGUE_FIT", ROOT / "target/release/tongue-fit"))
    before = os.environ["PATH"]
    os.environ["PATH"] = f"{folder}:{Path(sys.executable).parent}:{before}"
    yield
    os.environ["PATH"] = before


@pytest.fixture(scope="module")
def one(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of one run."""
    folder = tmp_path_factory.mktemp("one")
    subprocess.run(["tongue-fit", "batch", *OPTIONS, "--out", "batch"], cwd=folder, capture_output=True)
    return folder / "batch"


def same_files(one: Path, other: Path) -> bool:
    files = {path.name for path in one.iterdir()}
    assert len(files) == 6 and files == {path.name for path in other.iterdir()}
    return all((one / name).read_bytes() == (other / name).read_bytes() for name in files)


def merge(folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["tongue-fit", "merge", "shards", "--out", "batch"], cwd=folder, capture_output=True, text=True)


def wait_for_a_fit(journal: Path) -> None:
    """Until a shard has kept a fit, so that it is at work."""
    end = time.monotonic() + 60
    while not journal.exists() or len(journal.read_bytes().splitlines()) < 2:
        assert time.monotonic() < end, f"{journal} was not begun"
        time.sleep(0.005)


@pytest.fixture(scope="module")
def slurm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Slurm]:
    with Slurm(tmp_path_factory.mktemp("slurm")) as cluster:
        yield cluster


def test_an_array_of_slurm(slurm: Slurm, one: Path, tmp_path: Path) -> None:
    env = {**slurm.env, "PATH": os.environ["PATH"], "SHARDS": str(SHARDS)}

    def sbatch(*words: str) -> str:
        command = ["sbatch", "--parsable", *words]
        return subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True, check=True).stdout.strip()

    script = [str(CLUSTER / "slurm.sbatch"), *OPTIONS]
    job = sbatch(f"--array=1-{SHARDS}", *script)
    wait_for_a_fit(tmp_path / "shards/batch-2-of-3.journal")
    subprocess.run(["scancel", "--signal=KILL", f"{job}_2"], env=env, check=True)
    slurm.wait_for_jobs()
    refused = merge(tmp_path)
    assert refused.returncode == 1 and "nothing is written: 2/3 has " in refused.stderr, refused.stderr
    assert not (tmp_path / "batch").exists()
    # Only that one again, and the merge when it is done.
    again = sbatch("--array=2", *script)
    sbatch(f"--dependency=afterok:{again}", "--output=merge.log", "--wrap", "tongue-fit merge shards --out batch")
    slurm.wait_for_jobs()
    assert "going on after " in (tmp_path / "shard-2.log").read_text()
    assert same_files(one, tmp_path / "batch")


def snakemake(folder: Path, *words: str, env: dict[str, str] | None = None) -> subprocess.CompletedProcess[str]:
    config = ["--config", f"options={' '.join(OPTIONS)}", f"shards={SHARDS}"]
    command = ["snakemake", "--snakefile", str(CLUSTER / "Snakefile"), *words, *config]
    return subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True)


def test_snakemake_on_this_machine(one: Path, tmp_path: Path) -> None:
    done = snakemake(tmp_path, "--cores", "2")
    assert done.returncode == 0, done.stderr
    assert same_files(one, tmp_path / "batch")
    (tmp_path / "shards/batch-2-of-3.journal").unlink()
    refused = snakemake(tmp_path, "--cores", "2", "--forcerun", "batch")
    assert refused.returncode == 1 and "nothing is written: 2/3 is missing" in refused.stderr, refused.stderr


def test_snakemake_on_slurm_by_the_same_rules(slurm: Slurm, one: Path, tmp_path: Path) -> None:
    env = {**slurm.env, "PATH": os.environ["PATH"]}
    # There is no accounting here to ask, and no reason to wait long between two questions.
    asks = ["--slurm-status-command", "squeue", "--slurm-init-seconds-before-status-checks", "2"]
    asks += ["--seconds-between-status-checks", "2", "--slurm-no-account"]
    done = snakemake(tmp_path, "--executor", "slurm", "--jobs", "4", *asks, env=env)
    assert done.returncode == 0, done.stderr
    assert same_files(one, tmp_path / "batch")


def test_dask_whose_worker_is_killed(tmp_path: Path) -> None:
    table, out = ROOT / "targets/takano2007_lengths.csv", tmp_path / "fits.json"
    sys.path.insert(0, str(CLUSTER))
    from dask_batch import shard

    example = [sys.executable, str(CLUSTER / "dask_batch.py"), str(table), str(out), str(SHARDS)]
    running = subprocess.Popen(example, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    workers: list[psutil.Process] = []
    while len(workers) < 2:
        assert running.poll() is None, running.stderr and running.stderr.read()
        time.sleep(0.02)
        below = psutil.Process(running.pid).children(recursive=True)
        workers = [p for p in below if "spawn_main" in " ".join(p.cmdline())]
    time.sleep(1.0)
    workers[0].send_signal(signal.SIGKILL)
    assert running.wait(timeout=120) == 0, running.stderr and running.stderr.read()
    text = table.read_text(encoding="utf-8")
    assert out.read_text(encoding="utf-8") == shard(text, "1/1").to_json()
    with pytest.raises(tf.Error, match="nothing is merged: 2/3 is missing"):
        tf.merge([shard(text, "1/3"), shard(text, "3/3")])

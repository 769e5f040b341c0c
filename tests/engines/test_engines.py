"""A batch in shards on the engines that clusters have: what comes of it is, byte for byte, what one run gives, and a shard that was
killed or is missing is named."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
from distributed import Client, LocalCluster
from slurm import Slurm

import tongue_fit as tf

ROOT = Path(__file__).resolve().parents[2]
CLUSTER = ROOT / "examples/cluster"
OPTIONS = ["--subjects", "S2,S3"]
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
    assert len(files) == 5 and files == {path.name for path in other.iterdir()}
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


def block_for_slurm() -> tuple[str, int]:
    """The lines that docs/cluster.md prints for Slurm, and the number of shards in them."""
    page = (ROOT / "docs/cluster.md").read_text(encoding="utf-8")
    block = page.split("## Slurm")[1].split("```sh\n")[1].split("```")[0]
    assert len(block.splitlines()) == 3, block
    return block, int(block.split("SHARDS=")[1].split()[0])


def test_the_lines_for_slurm_as_they_are_printed_with_a_task_that_is_killed(slurm: Slurm, tmp_path: Path) -> None:
    lines, shards = block_for_slurm()
    # Each shard has forty fits, so that the first can be killed between them.
    rows = [sys.executable, str(CLUSTER / "cohort.py"), "800"]
    (tmp_path / "my.csv").write_bytes(subprocess.run(rows, capture_output=True, check=True).stdout)
    shutil.copy(CLUSTER / "slurm.sbatch", tmp_path)
    env = {**slurm.env, "PATH": os.environ["PATH"]}

    def submit() -> str:
        script = lines + "\necho job $job"
        done = subprocess.run(["bash", "-euc", script], cwd=tmp_path, env=env, capture_output=True, text=True, check=True)
        return done.stdout.split("job ")[-1].strip()

    def log(name: str) -> str:
        return (tmp_path / name).read_text(encoding="utf-8")

    job = submit()
    wait_for_a_fit(tmp_path / f"shards/batch-1-of-{shards}.journal")
    subprocess.run(["scancel", "--signal=KILL", f"{job}_1"], env=env, check=True)
    wait_for_a_fit(tmp_path / f"shards/batch-2-of-{shards}.journal")
    subprocess.run(["scontrol", "requeue", f"{job}_2"], env=env, check=True)
    slurm.wait_for_jobs(180)
    # What Slurm took away is started again by Slurm, and goes on; what was killed is named.
    assert "resuming after " in log("shard-2.log"), log("shard-2.log")
    assert re.search(f"nothing is written: 1/{shards} has [0-9]+ of 40 fits", log("merge.log")), log("merge.log")
    assert not (tmp_path / "batch").exists()
    submit()
    slurm.wait_for_jobs(180)
    assert "resuming after " in log("shard-1.log") and "written batch" in log("merge.log")
    options = ["--lengths", "my.csv", "--target", "stretch", "--out", "one"]
    subprocess.run(["tongue-fit", "batch", *options], cwd=tmp_path, capture_output=True)
    assert same_files(tmp_path / "one", tmp_path / "batch")


def snakemake(
    folder: Path, *words: str, options: list[str] = OPTIONS, env: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    config = ["--config", f"options={' '.join(options)}", f"shards={SHARDS}"]
    command = ["snakemake", "--snakefile", str(CLUSTER / "Snakefile"), *words, *config]
    return subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True)


def test_snakemake_on_this_machine(one: Path, tmp_path: Path) -> None:
    done = snakemake(tmp_path, "--cores", "2")
    assert done.returncode == 0, done.stderr
    assert same_files(one, tmp_path / "batch")
    (tmp_path / "shards/batch-2-of-3.journal").unlink()
    refused = snakemake(tmp_path, "--cores", "2", "--forcerun", "batch")
    assert refused.returncode == 1 and "nothing is written: 2/3 is missing" in refused.stderr, refused.stderr


def test_snakemake_makes_shards_again_for_a_corrected_table_and_for_other_options(tmp_path: Path) -> None:
    rows = [sys.executable, str(CLUSTER / "cohort.py"), "5"]
    table = subprocess.run(rows, capture_output=True, check=True, text=True).stdout
    (tmp_path / "my.csv").write_text(table, encoding="utf-8")
    few = ["--lengths", "my.csv", "--target", "stretch"]

    def batch(options: list[str]) -> tuple[str, str]:
        done = snakemake(tmp_path, "--cores", "2", options=options)
        assert done.returncode == 0, done.stderr
        return done.stderr, (tmp_path / "batch/fits.csv").read_text(encoding="utf-8")

    _, first = batch(few)
    assert "Nothing to be done" in batch(few)[0]
    # The last length of the table.
    head, last = table.rstrip().rsplit(",", 1)
    (tmp_path / "my.csv").write_text(f"{head},{float(last) + 1}\n", encoding="utf-8")
    _, corrected = batch(few)
    assert corrected != first
    assert batch([*few, "--poisson-ratio", "0.4"])[1] != corrected


def test_snakemake_tries_a_shard_again_that_failed(tmp_path: Path) -> None:
    """A program that fails once for each shard stands before the program."""
    folder = tmp_path / "bin"
    folder.mkdir()
    program = shutil.which("tongue-fit")
    # The program's own exit status is kept.
    (folder / "tongue-fit").write_text(
        f'#!/bin/sh\nname=failed-$(echo "$*" | tr -c "a-z0-9\\n" -)\n[ "$1" = merge ] || [ -e "$name" ] || {{ : > "$name"; exit 1; }}\n'
        f'exec {program} "$@"\n'
    )
    (folder / "tongue-fit").chmod(0o755)
    env = {**os.environ, "PATH": f"{folder}:{os.environ['PATH']}"}
    done = snakemake(tmp_path, "--cores", "2", options=["--subjects", "S2"], env=env)
    assert done.returncode == 0, done.stderr
    assert len(list(tmp_path.glob("failed-*"))) == SHARDS and (tmp_path / "batch/batch.json").exists()


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

    options = {"target": "stretch", "subjects": ["S1", "S2", "S3"]}
    words = [f"{name}={value if isinstance(value, str) else json.dumps(value)}" for name, value in options.items()]
    example = [sys.executable, str(CLUSTER / "dask_batch.py"), str(table), str(out), str(SHARDS), *words]
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        workers = client.run(os.getpid)
        running = subprocess.Popen([*example, "--scheduler", cluster.scheduler_address], cwd=tmp_path, stderr=subprocess.PIPE, text=True)
        busy: list[str] = []
        while not busy:
            assert running.poll() is None, running.stderr and running.stderr.read()
            time.sleep(0.02)
            busy = [worker for worker, tasks in client.processing().items() if tasks]
        psutil.Process(workers[busy[0]]).send_signal(signal.SIGKILL)
        assert running.wait(timeout=120) == 0, running.stderr and running.stderr.read()
    text = table.read_text(encoding="utf-8")
    assert out.read_text(encoding="utf-8") == shard(text, "1/1", options).to_json()
    with pytest.raises(tf.Error, match="nothing is merged: 2/3 is missing"):
        tf.merge([shard(text, "1/3", options), shard(text, "3/3", options)])


def test_what_is_no_option_of_a_batch_is_refused_before_the_work(tmp_path: Path) -> None:
    example = [sys.executable, str(CLUSTER / "dask_batch.py"), "none.csv", str(tmp_path / "fits.json"), "2", "draw=5"]
    refused = subprocess.run(example, capture_output=True, text=True)
    assert refused.returncode == 2 and "'draw=5' is not an option of tongue_fit.batch" in refused.stderr, refused.stderr

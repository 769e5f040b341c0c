"""How a batch in shards scales on this machine: python scaling.py TABLE [OPTIONS OF BATCH]; prints a table for docs/cluster.md.

Every shard is a program of its own with one thread, all of them at once, as an engine runs them."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path


def cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def measure(shards: int, options: list[str]) -> tuple[float, float, float, int]:
    """Seconds of the shards, CPU seconds of the shards, seconds of the merge, bytes of the journals."""
    with tempfile.TemporaryDirectory() as name:
        out = Path(name) / "shards"
        shard = ["tongue-fit", "batch", *options, "--threads", "1", "--out", str(out), "-q", "--shard"]
        began, before = time.perf_counter(), cpu_s()
        running = [subprocess.Popen([*shard, f"{n}/{shards}"]) for n in range(1, shards + 1)]
        for one in running:
            assert one.wait() == 0
        wall, cpu = time.perf_counter() - began, cpu_s() - before
        began = time.perf_counter()
        merged = subprocess.run(["tongue-fit", "merge", str(out), "--out", str(Path(name) / "batch"), "-q"], stderr=subprocess.DEVNULL)
        assert merged.returncode in (0, 3)
        return wall, cpu, time.perf_counter() - began, sum(path.stat().st_size for path in out.iterdir())


def main(table: str, *options: str) -> None:
    words = ["--lengths", table, *options]
    print(f"{os.cpu_count()} cores; tongue-fit batch {' '.join(words)}\n")
    print("| shards at once | seconds | CPU seconds | of them in a shard | merge, seconds | journals, MB |")
    print("|---|---|---|---|---|---|")
    for shards in (1, 2, 4):
        wall, cpu, merge, size = measure(shards, words)
        print(f"| {shards} | {wall:.1f} | {cpu:.1f} | {cpu / shards:.1f} | {merge:.2f} | {size / 1e6:.1f} |", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])

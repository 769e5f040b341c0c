"""A batch in shards on Dask: python dask_batch.py my.csv results.json 16 [scheduler address]

Without an address it starts a worker for each core of this machine."""

from __future__ import annotations

import sys

import tongue_fit as tf
from distributed import Client, LocalCluster


def shard(table: str, cut: str) -> tf.Batch:
    """One shard, as a task: the table travels as text, and what comes back are its fits."""
    data = tf.Dataset.from_text(table, "lengths")
    return tf.batch(data, target="stretch", draws=200, subsets=0, shard=cut, threads=1, progress=False)


def main(path: str, out: str, shards: int, address: str | None = None) -> None:
    with open(path, encoding="utf-8") as file:
        table = file.read()
    with Client(address or LocalCluster(threads_per_worker=1, dashboard_address=None)) as client:
        cuts = [f"{n}/{shards}" for n in range(1, shards + 1)]
        tasks = client.map(shard, [table] * shards, cuts, pure=False)
        # A task that failed, or whose worker died too often, is missing here, and `merge` names its shard.
        done = [task.result() for task in tasks if task.status == "finished" or not task.exception()]
        with open(out, "w", encoding="utf-8") as file:
            file.write(tf.merge(done).to_json())


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), *sys.argv[4:])

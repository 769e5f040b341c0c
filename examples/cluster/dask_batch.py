"""A batch in shards on Dask: python dask_batch.py my.csv fits.json 16 target=stretch

What stands behind the number of shards are options of `tongue_fit.batch`. Without --scheduler a worker is started for each core of this
machine."""

from __future__ import annotations

import argparse
import inspect
import json
from typing import Any

import tongue_fit as tf
from distributed import Client, LocalCluster


def shard(table: str, cut: str, options: dict[str, Any]) -> tf.Batch:
    """One shard, as a task: the table travels as text, and what comes back are its fits."""
    data = tf.Dataset.from_text(table, "lengths")
    return tf.batch(data, **options, shard=cut, threads=1, progress=False)


def option(word: str) -> tuple[str, Any]:
    """`method="nelder-mead"` or `subjects=["S1", "S2"]`: JSON, or else text."""
    name, given, value = word.partition("=")
    names = [name for name in inspect.signature(tf.batch).parameters if name not in ("data", "shard", "threads", "progress")]
    if not given or name not in names:
        raise argparse.ArgumentTypeError(f"{word!r} is not an option of tongue_fit.batch; give NAME=VALUE with one of {', '.join(names)}")
    try:
        return name, json.loads(value)
    except json.JSONDecodeError:
        return name, value


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", help="table of lengths (CSV)")
    parser.add_argument("out", help="file for the fits (JSON)")
    parser.add_argument("shards", type=int, help="number of tasks")
    parser.add_argument("options", nargs="*", type=option, metavar="NAME=VALUE", help="options of tongue_fit.batch")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="a cluster's, such as tcp://scheduler:8786")
    given = parser.parse_args()
    with open(given.table, encoding="utf-8") as file:
        table = file.read()
    with Client(given.scheduler or LocalCluster(threads_per_worker=1, dashboard_address=None)) as client:
        cuts = [f"{n}/{given.shards}" for n in range(1, given.shards + 1)]
        tasks = client.map(shard, [table] * given.shards, cuts, options=dict(given.options), pure=False)
        # A task that failed, or whose worker died too often, is missing here, and `merge` names its shard.
        done = [task.result() for task in tasks if task.status == "finished" or not task.exception()]
        with open(given.out, "w", encoding="utf-8") as file:
            file.write(tf.merge(done).to_json())


if __name__ == "__main__":
    main()

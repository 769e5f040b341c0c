"""A cohort to measure with: python cohort.py ROWS > cohort.csv; subjects of Takano and Honda (2007), each taken many times over with
another size (10 %) and other lengths (2 %)."""

from __future__ import annotations

import csv
import random
import sys
from pathlib import Path

LENGTHS = Path(__file__).resolve().parents[2] / "targets/takano2007_lengths.csv"


def main(rows: int) -> None:
    random.seed(1)
    with LENGTHS.open(encoding="utf-8") as file:
        measured = list(csv.DictReader(line for line in file if not line.startswith("#")))
    muscles = [name for name in measured[0] if name.endswith("_mm")]
    out = csv.writer(sys.stdout)
    out.writerow(["subject", "vowel", *muscles])
    for number in range(rows):
        subject, vowel = divmod(number, 5)
        if vowel == 0:
            size = random.uniform(0.9, 1.1)
        row = [r for r in measured if r["subject"] == f"S{1 + subject % 3}"][vowel]
        lengths = [f"{float(row[m]) * size * random.uniform(0.98, 1.02):.1f}" for m in muscles]
        out.writerow([f"P{1 + subject}", row["vowel"], *lengths])


if __name__ == "__main__":
    main(int(sys.argv[1]))

"""Every row of a table of lengths fitted, and the tensions drawn: python fit_table.py [table.csv]"""

import sys

import matplotlib.pyplot as plt
import pandas as pd

import tongue_fit as tf

data = tf.dataset(pd.read_csv(sys.argv[1])) if len(sys.argv) > 1 else tf.Dataset.reference()
found = tf.batch(data, target="stretch").frame()
active, muscles, vowels = found[found.active], list(found.muscle.unique()), list(found.vowel.unique())
figure, axes = plt.subplots(1, active.subject.nunique(), sharey=True, figsize=(11, 3.2), squeeze=False)
for axis, (subject, rows) in zip(axes[0], active.groupby("subject"), strict=True):
    for n, vowel in enumerate(vowels):
        r = rows[rows.vowel == vowel]
        at = [muscles.index(muscle) + 0.15 * (n - 1.5) for muscle in r.muscle]
        axis.plot(at, r.tension_n_per_m, "o", ms=3, label=f"/{vowel}/")
    axis.set(title=subject, xticks=range(len(muscles)), xticklabels=muscles)
    axis.tick_params(axis="x", rotation=60)
axes[0][0].set_ylabel("tension, N per metre")
figure.legend(*axes[0][0].get_legend_handles_labels(), loc="outside right")
figure.set_layout_engine("constrained")
figure.savefig("tensions.png", dpi=120)

"""One equilibrium as arrays, drawn: the tissue coloured by how far it moved, and the muscles that pull."""

import matplotlib.pyplot as plt
import numpy as np

import tongue_fit as tf

model = tf.Model().assemble(tf.Body.tongue(), ["GGa", "SGm", "HGa"])
shape = model.solver().follow_from_rest({"GGa": 12.0, "SGm": 11.5, "HGa": 4.5})
assert shape.is_converged and shape.is_traced
x, y = 1e3 * shape.positions.T
moved = 1e3 * np.linalg.norm(shape.positions - model.body.nodes, axis=1)

figure, axis = plt.subplots(figsize=(5, 4))
tissue = axis.tripcolor(x, y, model.body.triangles, moved, shading="gouraud", cmap="cividis")
for name, line in zip(model.contracting, ["-", "--", ":"], strict=True):
    chain = model.body.muscles[name]
    axis.plot(x[chain], y[chain], line, color="white", lw=2, label=f"{name} {shape.tension(name):g} N/m")
axis.legend(loc="upper left", facecolor="0.4", labelcolor="white", fontsize="small")
tissue_nodes = np.unique(model.body.triangles)  # other nodes are on bone, or between it and the tissue
axis.set(xlim=(x[tissue_nodes].min() - 3, x[tissue_nodes].max() + 3), ylim=(y[tissue_nodes].min() - 3, y[tissue_nodes].max() + 3))
axis.set(aspect="equal", xlabel="back, mm", ylabel="up, mm")
figure.colorbar(tissue, label="moved, mm")
figure.tight_layout()
figure.savefig("shape.png", dpi=120)

#!/usr/bin/env python3
"""Makes the Gmsh files of this folder with the real Gmsh, and what Gmsh itself says of them (JSON), for tests/library/gmsh_files.rs.

    python3 -m venv /tmp/venv && /tmp/venv/bin/pip install gmsh==4.15.2
    /tmp/venv/bin/python tests/gmsh/make_meshes.py

The wheel of Gmsh needs, on Debian, libglu1-mesa libgl1 libxcursor1 libxft2 libxinerama1 libxrender1 libgomp1.
It is also an example of the way from an outline of one's own to a mesh: `tongue` does what targets/anatomy.toml says.
"""

import json
import math
import pathlib
import tomllib

import gmsh

HERE = pathlib.Path(__file__).parent
ANATOMY = HERE.parent.parent / "targets" / "anatomy.toml"
# name: (Mesh.MshFileVersion, Mesh.Binary)
FORMATS = {"41": (4.1, 0), "41_binary": (4.1, 1), "22": (2.2, 0), "22_binary": (2.2, 1)}


def start(millimetres=True):
    gmsh.clear()
    gmsh.option.setNumber("General.Verbosity", 2)
    # Models are drawn in millimetres; files are in metres unless said otherwise.
    gmsh.option.setNumber("Mesh.ScalingFactor", 1e-3 if millimetres else 1.0)
    gmsh.option.setNumber("Mesh.ElementOrder", 1)
    gmsh.option.setNumber("Mesh.SaveAll", 0)


def save(path, form="41"):
    version, binary = FORMATS[form]
    gmsh.option.setNumber("Mesh.MshFileVersion", version)
    gmsh.option.setNumber("Mesh.Binary", binary)
    gmsh.write(str(HERE / path))


def group(dimension, tags, name):
    gmsh.model.addPhysicalGroup(dimension, tags, name=name)


def size(h):
    gmsh.option.setNumber("Mesh.MeshSizeMin", h)
    gmsh.option.setNumber("Mesh.MeshSizeMax", h)
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)


def tongue(h):
    """The reference tongue: muscles and outline cut each other, so that every crossing becomes a node."""
    anatomy = tomllib.loads(ANATOMY.read_text())
    occ = gmsh.model.occ
    points = []

    def point(x, y):
        for tag, a, b in points:
            if math.hypot(a - x, b - y) < 0.05:
                return tag
        points.append((occ.addPoint(x, y, 0.0), x, y))
        return points[-1][0]

    outline = [point(*p) for p in anatomy["outline"]]
    curve = occ.addSpline(outline + outline[:1])
    surface = occ.addPlaneSurface([occ.addCurveLoop([curve])])
    occ.synchronize()

    def end(x, y):
        """An end of a muscle; one that is meant to be on the outline is put there, or a sliver would be left between."""
        near, _ = gmsh.model.getClosestPoint(1, curve, [x, y, 0.0])
        on_outline = math.hypot(near[0] - x, near[1] - y) < 0.5
        return point(near[0], near[1]) if on_outline else point(x, y)

    lines = {name: occ.addLine(*[end(*p) for p in ends]) for name, ends in anatomy["muscles"].items()}
    parts = [(2, surface)] + [(1, tag) for tag in lines.values()]
    _, pieces = occ.fragment(parts[:1], parts[1:])
    occ.synchronize()
    pieces = dict(zip(parts, pieces))

    def points_at(x, y):
        """Points are numbered anew when curves are cut, so they are found where they are."""
        near = gmsh.model.getEntitiesInBoundingBox(x - 0.05, y - 0.05, -0.05, x + 0.05, y + 0.05, 0.05, 0)
        joined = [tag for _, tag in near if gmsh.model.getAdjacencies(0, tag)[0].size]
        assert len(joined) == 1, (x, y, joined)
        return joined

    group(2, [tag for _, tag in pieces[(2, surface)]], "tissue")
    for name, line in lines.items():
        group(1, [tag for _, tag in pieces[(1, line)]], name)
    for name, held in anatomy["bones"].items():
        group(0, [tag for at in held for tag in points_at(*at)], f"bone:{name}")
    rim = gmsh.model.getBoundary(pieces[(2, surface)], oriented=False)
    group(1, [tag for _, tag in rim], "other:outline")
    size(h)
    gmsh.model.mesh.generate(2)


def said(scale=1e-3):
    """What Gmsh itself says of the mesh."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    at = {int(t): [scale * c for c in coordinates[3 * i : 3 * i + 3]] for i, t in enumerate(tags)}
    groups = []
    for dimension, tag in gmsh.model.getPhysicalGroups():
        elements = []
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, tag):
            for kind, _, nodes in zip(*gmsh.model.mesh.getElements(dimension, entity)):
                n = gmsh.model.mesh.getElementProperties(kind)[3]
                elements += [[int(v) for v in nodes[i : i + n]] for i in range(0, len(nodes), n)]
        name = gmsh.model.getPhysicalName(dimension, tag)
        groups.append({"dimension": dimension, "name": name, "elements": elements})
    return {"gmsh": gmsh.__version__, "nodes_m": at, "groups": groups}


def write_said(path):
    (HERE / path).write_text(json.dumps(said(), separators=(",", ":")) + "\n")


def square(muscle, side=40.0, h=20.0, name="GGa", tissue="tissue", bone="bone", z=0.0, embed=True, curve=None):
    """A square with a muscle along the lines between the points `muscle`; its left side is bone."""
    geo = gmsh.model.geo
    corners = [geo.addPoint(x * side, y * side, z) for x, y in [(0, 0), (1, 0), (1, 1), (0, 1)]]
    sides = [geo.addLine(corners[i], corners[(i + 1) % 4]) for i in range(4)]
    surface = geo.addPlaneSurface([geo.addCurveLoop(sides)])
    inner = [geo.addPoint(x * side, y * side, z) for x, y in muscle]
    curves = curve or [(i, i + 1) for i in range(len(inner) - 1)]
    lines = [geo.addLine(inner[a], inner[b]) for a, b in curves]
    geo.synchronize()
    if embed and lines:
        gmsh.model.mesh.embed(1, lines, 2, surface)
    group(2, [surface], tissue)
    if lines:
        group(1, lines, name)
    if bone:
        group(1, [sides[3]], bone)
    size(h)
    gmsh.model.mesh.generate(2)
    return surface


def cylinder(h):
    """A cylinder that stands on bone, with a muscle along its axis."""
    occ = gmsh.model.occ
    body = occ.addCylinder(0, 0, 0, 0, 0, 40, 10)
    axis = occ.addLine(occ.addPoint(0, 0, 0), occ.addPoint(0, 0, 40))
    _, (volumes, axes) = occ.fragment([(3, body)], [(1, axis)])
    occ.synchronize()
    group(3, [tag for _, tag in volumes], "tissue")
    group(1, [tag for _, tag in axes], "muscle:axial")
    base = gmsh.model.getEntitiesInBoundingBox(-11, -11, -0.1, 11, 11, 0.1, 2)
    group(2, [tag for _, tag in base], "bone:base")
    size(h)
    gmsh.model.mesh.generate(3)


def hexahedra(form):
    """A block of hexahedra in two volumes, left and right, with a muscle on each side and one in both."""
    geo = gmsh.model.geo
    sections = []
    for y in (-20.0, 0.0, 20.0):
        corners = [geo.addPoint(x, y, z) for x, z in [(0, 0), (60, 0), (60, 20), (0, 20)]]
        sections.append((corners, [geo.addLine(corners[i], corners[(i + 1) % 4]) for i in range(4)]))
    across = [[geo.addLine(a, b) for a, b in zip(sections[k][0], sections[k + 1][0])] for k in range(2)]
    faces = [geo.addPlaneSurface([geo.addCurveLoop(lines)]) for _, lines in sections]
    volumes, ends = [], []
    for k in range(2):
        (_, low), (_, high) = sections[k], sections[k + 1]
        around = [
            geo.addPlaneSurface([geo.addCurveLoop([low[i], across[k][(i + 1) % 4], -high[i], -across[k][i]])])
            for i in range(4)
        ]
        ends.append(around[3])
        volumes.append(geo.addVolume([geo.addSurfaceLoop([faces[k], faces[k + 1], *around])]))
    geo.synchronize()
    for _, lines in sections:
        for i, line in enumerate(lines):
            gmsh.model.mesh.setTransfiniteCurve(line, [7, 3, 7, 3][i])
    for lines in across:
        for line in lines:
            gmsh.model.mesh.setTransfiniteCurve(line, 3)
    for _, surface in gmsh.model.getEntities(2):
        gmsh.model.mesh.setTransfiniteSurface(surface)
        gmsh.model.mesh.setRecombine(2, surface)
    for volume in volumes:
        gmsh.model.mesh.setTransfiniteVolume(volume)
    group(3, volumes, "tissue")
    group(3, volumes[:1], "muscle:A_L 20 kPa")
    group(3, volumes[1:], "muscle:A_R 20 kPa")
    group(3, volumes, "muscle:M 4 N")
    group(1, [sections[1][1][2]], "fibre:M")
    group(2, ends, "bone:mandible")
    gmsh.model.mesh.generate(3)
    path = f"hexahedra_{form}.msh"
    save(path, form)
    for side, volume in zip("LR", volumes):
        tags = gmsh.model.mesh.getElements(3, volume)[1][0]
        view = gmsh.view.add(f"fibre:A_{side}")
        tilt = -0.2 if side == "L" else 0.2
        gmsh.view.addModelData(view, 0, gmsh.model.getCurrent(), "ElementData", tags, [[1.0, tilt, 0.0]] * len(tags))
        gmsh.option.setNumber("PostProcessing.SaveMesh", 0)
        gmsh.view.write(view, str(HERE / path), append=True)


def main():
    gmsh.initialize()
    start()
    tongue(7.0)
    for form in FORMATS:
        save(f"tongue_{form}.msh", form)
    write_said("tongue.json")

    start(millimetres=False)
    tongue(12.0)
    save("millimetres.msh")

    start()
    cylinder(8.0)
    for form in ["41", "22_binary"]:
        save(f"cylinder_{form}.msh", form)
    write_said("cylinder.json")

    for form in ["41", "41_binary"]:
        start()
        hexahedra(form)

    along = [(0.25, 0.5), (0.5, 0.5), (0.75, 0.5)]
    star = along + [(0.5, 0.75)]
    ring = [(0.25, 0.25), (0.75, 0.25), (0.5, 0.75)]
    start()
    square(along)
    save("broken/square.msh")
    start()
    square(star, curve=[(0, 1), (1, 2), (1, 3)])
    save("broken/branch.msh")
    start()
    square([(0.2, 0.5), (0.4, 0.5), (0.6, 0.5), (0.8, 0.5)], curve=[(0, 1), (2, 3)])
    save("broken/gap.msh")
    start()
    square(ring, curve=[(0, 1), (1, 2), (2, 0)])
    save("broken/loop.msh")
    start()
    square(along, embed=False)
    save("broken/not_embedded.msh")
    start()
    square([(1.5, 0.5), (2.0, 0.5)], embed=False)
    save("broken/apart.msh")
    start()
    square(along, tissue="flesh")
    save("broken/no_tissue.msh")
    start()
    square(along, bone=None)
    save("broken/no_bone.msh")
    start()
    square([(0.0, 0.9999), (1.0, 0.9999)], embed=False)
    save("broken/apart_by_a_hair.msh")
    start()
    square([(0.25, 0.999), (0.75, 0.999)])
    save("broken/thin.msh")
    start()
    square(along, z=5.0)
    save("broken/out_of_plane.msh")
    start()
    square(along, name="GGaa")
    save("broken/misspelt.msh")
    start()
    square(along)
    gmsh.model.mesh.setOrder(2)
    save("second_order.msh")
    start()
    surface = square([])
    gmsh.model.mesh.clear()
    gmsh.model.mesh.setRecombine(2, surface)
    gmsh.model.mesh.generate(2)
    save("broken/quadrangles.msh")
    start()
    square(along)
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.0)
    gmsh.option.setNumber("Mesh.Binary", 0)
    gmsh.write(str(HERE / "broken/version_40.msh"))
    start()
    square(along)
    gmsh.model.mesh.partition(2)
    save("broken/partitioned.msh")
    gmsh.finalize()


if __name__ == "__main__":
    (HERE / "broken").mkdir(exist_ok=True)
    main()

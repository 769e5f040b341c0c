#!/usr/bin/env python3
"""Reads what tongue-fit wrote with readers of others and prints what they saw as JSON, for tests/program/outputs_read_back.rs.

    read_back.py meshio FILE.vtu|FILE.msh     meshio's view of a mesh
    read_back.py gmsh FILE.msh                Gmsh's own
    read_back.py sto FILE.sto                 a storage file by OpenSim's rules
"""

import json
import sys


def by_meshio(path):
    import meshio

    mesh = meshio.read(path)
    kinds = [block.type for block in mesh.cells]
    data = {name: {} for name in mesh.cell_data}
    cells = {}
    for i, kind in enumerate(kinds):
        cells.setdefault(kind, []).extend(mesh.cells[i].data.tolist())
        for name, blocks in mesh.cell_data.items():
            data[name].setdefault(kind, []).extend(blocks[i].tolist())
    names = {name: [int(tag), int(dimension)] for name, (tag, dimension) in mesh.field_data.items()}
    points = {name: values.tolist() for name, values in mesh.point_data.items()}
    return {"points": mesh.points.tolist(), "cells": cells, "point_data": points, "cell_data": data, "names": names}


def by_gmsh(path):
    import gmsh

    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 2)
    gmsh.logger.start()
    gmsh.open(path)
    groups = {}
    for dimension, tag in gmsh.model.getPhysicalGroups():
        elements = 0
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, tag):
            elements += sum(len(tags) for tags in gmsh.model.mesh.getElements(dimension, entity)[1])
        groups[gmsh.model.getPhysicalName(dimension, tag)] = elements
    nodes = len(gmsh.model.mesh.getNodes()[0])
    complaints = [line for line in gmsh.logger.get() if line.startswith(("Error", "Warning"))]
    gmsh.finalize()
    return {"nodes": nodes, "groups": groups, "complaints": complaints}


def by_opensim_rules(path):
    header, labels, rows = {}, None, []
    lines = iter(open(path, encoding="utf-8").read().splitlines())
    header["name"] = next(lines)
    for line in lines:
        if line == "endheader":
            break
        key, value = line.split("=", 1)
        header[key] = value
    labels = next(lines).split("\t")
    rows = [[float(word) for word in line.split("\t")] for line in lines]
    assert int(header["nRows"]) == len(rows) and all(len(r) == int(header["nColumns"]) for r in rows)
    assert labels[0] == "time" and len(labels) == int(header["nColumns"])
    return {"header": header, "columns": dict(zip(labels, zip(*rows)))}


if __name__ == "__main__":
    readers = {"meshio": by_meshio, "gmsh": by_gmsh, "sto": by_opensim_rules}
    json.dump(readers[sys.argv[1]](sys.argv[2]), sys.stdout)

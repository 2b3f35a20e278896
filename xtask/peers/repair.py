"""Repair beside its peers, and on models damaged on purpose, as tables in Markdown.

    repair.py OCTOFOLD repair|damaged [DATA]

 repair   models of the data through `octofold repair`, CGAL's alpha wrap (alpha an 80th of the longest side,
          offset a 30th of alpha), the watertight manifold of point_cloud_utils and the rebuilding of
          meshlib, at about as many triangles, and through pymeshfix, which keeps the input's: what is
          wrong with each result, the largest distances both ways as shares of the diagonal, triangles,
          and seconds of the processor (octofold: one thread, the proof of the file included)
 damaged  COUNT damaged versions of the models at 64, 256 and 1024 cells: what `octofold repair` wrote,
          as binary STL, OBJ and GLB, read again by trimesh and looked at with libigl (exact) and numpy,
          and how far from the input it goes where no gap was closed; above FINE cells octofold's own
          proof of the file stands alone

COUNT (500), FIRST (0) and CELLS (64,256,1024) are taken from the environment.
"""

import json
import multiprocessing
import os
import resource
import subprocess
import tempfile
import time
from pathlib import Path

import igl
import numpy as np
import trimesh
from bench import DATA, OCTOFOLD, WHAT, octofold
from check import measures, read
from scipy.spatial.transform import Rotation
from tables import row, rule

MODELS = ("scans/stanford-bunny.obj", "broken/truck.ply", "broken/chair_model.obj",
          "broken/holey_bunny_2.obj", "broken/busted.STL", "craft/building-small-a.glb",
          "textured/FlightHelmet/FlightHelmet.gltf")
PATIENCE, FINE = 300, 64
COUNT, FIRST = int(os.environ.get("COUNT", 500)), int(os.environ.get("FIRST", 0))
CELLS = [int(cells) for cells in os.environ.get("CELLS", "64,256,1024").split(",")]
FAULTS = ("boundary_edges", "nonmanifold_edges", "misoriented_edges", "pinches", "self_intersections")


def repair(folder):
    row("model", "way", "triangles", "open edges", "edges of more than two", "misoriented", "pinches", "meeting",
        "to the input", "from the input", "CPU s")
    rule(11)
    for name in MODELS:
        points, triangles = read(DATA / name)
        bounds = points.min(axis=0), points.max(axis=0)
        side, diagonal = (bounds[1] - bounds[0]).max(), np.linalg.norm(bounds[1] - bounds[0])
        wrap = timed(alpha_wrap, folder, points, triangles, side / 80)
        count = len(wrap[1]) if wrap else 30_000
        wrapped = {"alpha wrap": wrap, "octofold": ours(folder, DATA / name, count)}
        for way, scaled in (("point_cloud_utils", manifold), ("meshlib", rebuilt)):
            wrapped[way] = matched(scaled, folder, points, triangles, side, count)
        wrapped["pymeshfix"] = timed(meshfix, folder, points, triangles, 0)
        for way, result in wrapped.items():
            if result is None or not len(result[1]):
                row(Path(name).stem, way, f"nothing within {PATIENCE} s", *[""] * 8)
                continue
            out, faces, seconds = result
            found = faults(out, faces)
            there, back = distances(out, faces, points, triangles)
            row(Path(name).stem, way, len(faces), *(found[f] for f in FAULTS), f"{there / diagonal:.2e}",
                f"{back / diagonal:.2e}", f"{seconds:.2f}")


def ours(folder, file, count):
    """At the resolution that gives about `count` triangles."""
    cells, out = 100, folder / "ours.stl"
    for _ in range(4):
        report = octofold("repair", file, out, "--resolution", cells, "--threads", 1)
        wrong = count / report["output"]["triangles"]
        if 0.95 < wrong < 1.05:
            break
        cells = max(8, round(cells * wrong**0.5))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([OCTOFOLD, "repair", file, out, "--resolution", str(cells), "--threads", "1"],
                   check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return *read(out), seconds


def matched(way, folder, points, triangles, side, count):
    """A peer at the cell size that gives about `count` triangles."""
    size = side / 80
    for _ in range(3):
        result = timed(way, folder, points, triangles, size)
        if not result or not len(result[1]) or 0.9 < count / len(result[1]) < 1.1:
            break
        size *= (len(result[1]) / count) ** 0.5
    return result


def timed(way, folder, points, triangles, size):
    """A peer in a process of its own, which may be given up or die."""
    path = folder / "peer.npz"
    path.unlink(missing_ok=True)

    def work():
        before = time.process_time()
        out, faces = way(points, triangles, size)
        np.savez(path, points=out, triangles=faces, seconds=time.process_time() - before)

    process = multiprocessing.get_context("fork").Process(target=work)
    process.start()
    process.join(PATIENCE)
    process.kill()
    process.join()
    if not path.exists():
        return None
    found = np.load(path)
    return found["points"], found["triangles"].astype(np.int64), float(found["seconds"])


def alpha_wrap(points, triangles, alpha):
    from CGAL.CGAL_Alpha_wrap_3 import alpha_wrap_3
    from CGAL.CGAL_Kernel import Point_3
    from CGAL.CGAL_Polyhedron_3 import Polyhedron_3

    wrapped = Polyhedron_3()
    corners = [Point_3(*point) for point in points.tolist()]
    alpha_wrap_3(corners, triangles.tolist(), float(alpha), float(alpha / 30), wrapped)
    soup = [[half.vertex().point() for half in (h, h.next(), h.next().next())]
            for h in (face.halfedge() for face in wrapped.facets())]
    soup = np.array([[(p.x(), p.y(), p.z()) for p in triangle] for triangle in soup]).reshape(-1, 3)
    out, index = np.unique(soup, axis=0, return_inverse=True)
    return out, index.reshape(-1, 3)


def manifold(points, triangles, size):
    import point_cloud_utils

    # Its resolution is the least number of leaves of its octree.
    side = np.ptp(points, axis=0).max()
    return point_cloud_utils.make_mesh_watertight(points, triangles, 2 * (side / size) ** 2)


def rebuilt(points, triangles, size):
    from meshlib import mrmeshnumpy, mrmeshpy

    settings = mrmeshpy.RebuildMeshSettings()
    settings.voxelSize = float(size)
    settings.decimate = False
    mesh = mrmeshpy.rebuildMesh(mrmeshnumpy.meshFromFacesVerts(triangles, points), settings)
    return mrmeshnumpy.getNumpyVerts(mesh), mrmeshnumpy.getNumpyFaces(mesh.topology)


def meshfix(points, triangles, _):
    import pymeshfix

    return pymeshfix.clean_from_arrays(points, triangles.astype(np.int32), remove_smallest_components=False)


def faults(points, triangles):
    found = measures(points, triangles)
    mesh = trimesh.Trimesh(points, triangles, process=False)
    closed = found["boundary_edges"] == found["nonmanifold_edges"] == 0
    # Fans beyond one at a point, where edges have two triangles each.
    found["pinches"] = fans(mesh) - found["points"] if closed else ""
    return found


def fans(mesh):
    """Rings of triangles round points."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    pairs, edges = mesh.face_adjacency, mesh.face_adjacency_edges
    corner = lambda face, point: 3 * face + (mesh.faces[face] == point[:, None]).argmax(axis=1)
    links = [np.stack([corner(pairs[:, 0], p), corner(pairs[:, 1], p)]) for p in edges.T]
    links, count = np.concatenate(links, axis=1), 3 * len(mesh.faces)
    return connected_components(coo_matrix((np.ones(links.shape[1]), links), shape=(count,) * 2), directed=False)[0]


def distances(points, triangles, others, faces, samples=100_000):
    """Largest distances from one mesh to the other and back, from vertices and samples."""
    one, two = (points, triangles), (others, faces)
    return to_mesh(*one, *two, samples), to_mesh(*two, *one, samples)


def to_mesh(points, triangles, others, faces, samples=20_000):
    at = trimesh.sample.sample_surface(trimesh.Trimesh(points, triangles, process=False), samples, seed=0)[0]
    at = np.concatenate([points[np.unique(triangles)], at])
    return np.sqrt(igl.point_mesh_squared_distance(at, others, faces)[0].max())


def damaged(folder):
    models = sorted(f for f in DATA.rglob("*") if f.suffix.lower()[1:] in ("obj", "ply", "stl", "glb", "gltf"))
    meshes = []
    for file in models:
        try:
            points, triangles = read(file)
        except Exception:
            continue
        if 0 < len(triangles) < 100_000 and np.isfinite(points).all():
            meshes.append((file.stem, points, triangles))
    row("damage", "cells", "versions", "refused", "failed", "faults", "furthest, in cells")
    rule(7)
    tables = {}
    for seed in range(FIRST, FIRST + COUNT):
        chance = np.random.default_rng(seed)
        damage = DAMAGES[seed % len(DAMAGES)]
        name, points, triangles = meshes[chance.integers(len(meshes))]
        write(folder / "in.stl", *damage(points, triangles, chance, meshes))
        given = read(folder / "in.stl")
        for cells in CELLS:
            table = tables.setdefault((damage.__name__, cells), [0, 0, 0, 0, 0.0])
            table[0] += 1
            try_one(folder, given, cells, table, f"{name}, seed {seed}")
    for (name, cells), table in sorted(tables.items()):
        row(name.replace("_", " "), cells, *table[:4], f"{table[4]:.3f}")
    return any(table[2] or table[3] for table in tables.values())


def try_one(folder, given, cells, table, what):
    for ending in ("stl", "obj", "glb") if cells <= FINE else ("stl",):
        out = folder / f"out.{ending}"
        out.unlink(missing_ok=True)
        words = [OCTOFOLD, "repair", folder / "in.stl", out, "--resolution", str(cells), "--json"]
        done = subprocess.run(words, capture_output=True, text=True)
        if done.returncode == 2 and not out.exists():
            table[1] += ending == "stl"
            print(f"refused, {what}, {cells} cells: {done.stderr.strip()}")
            continue
        if done.returncode != 0:
            table[2] += 1
            print(f"failed, {what}, {cells} cells, {ending}: {done.returncode} {done.stderr.strip()}")
            continue
        if cells > FINE:
            continue
        points, triangles = read(out)
        found = faults(points, triangles)
        if any(found[fault] for fault in FAULTS):
            table[3] += 1
            print(f"faults, {what}, {cells} cells, {ending}: { {f: found[f] for f in FAULTS} }")
        if ending == "stl":
            repaired = json.loads(done.stdout)["repair"]
            away = to_mesh(points, triangles, *given) / repaired["cell"]
            table[4] = max(table[4], 0 if repaired["gaps_closed"] else away)


def deleted(points, triangles, chance, _):
    return points, triangles[chance.random(len(triangles)) > chance.uniform(0.01, 0.3)]


def flipped(points, triangles, chance, _):
    turn = chance.random(len(triangles)) < chance.uniform(0.05, 0.5)
    return points, np.where(turn[:, None], triangles[:, ::-1], triangles)


def duplicated(points, triangles, chance, _):
    again = triangles[chance.random(len(triangles)) < chance.uniform(0.05, 0.5)]
    return points, chance.permutation(np.concatenate([triangles, again]))


def jittered(points, triangles, chance, _):
    size = np.ptp(points, axis=0).max() * 10 ** chance.uniform(-4, -1.5)
    return points + size * chance.standard_normal(points.shape), triangles


def unwelded(points, triangles, chance, _):
    size = np.ptp(points, axis=0).max() * 10 ** chance.uniform(-6, -2)
    corners = points[triangles].reshape(-1, 3)
    return corners + size * chance.standard_normal(corners.shape), np.arange(len(corners)).reshape(-1, 3)


def overlapping(points, triangles, chance, _):
    turn = Rotation.random(random_state=int(chance.integers(1 << 31))).as_matrix()
    middle = points.mean(axis=0)
    other = (points - middle) @ turn + middle + 0.1 * np.ptp(points, axis=0) * chance.standard_normal(3)
    return np.concatenate([points, other]), np.concatenate([triangles, triangles + len(points)])


def merged(points, triangles, chance, meshes):
    _, other, faces = meshes[chance.integers(len(meshes))]
    size = np.ptp(points, axis=0).max() / max(np.ptp(other, axis=0).max(), 1e-30)
    other = (other - other.mean(axis=0)) * size + points.mean(axis=0)
    return np.concatenate([points, other]), np.concatenate([triangles, faces + len(points)])


def slit(points, triangles, chance, _):
    """Everything on one side of a random plane moved away from it."""
    normal = chance.standard_normal(3)
    normal /= np.linalg.norm(normal)
    middles = points[triangles].mean(axis=1) - points.mean(axis=0)
    side = middles @ normal > 0
    by = normal * np.ptp(points, axis=0).max() * 10 ** chance.uniform(-4, -1)
    return np.concatenate([points, points + by]), np.where(side[:, None], triangles + len(points), triangles)


DAMAGES = (deleted, flipped, duplicated, jittered, unwelded, overlapping, merged, slit)


def write(path, points, triangles):
    trimesh.Trimesh(points, triangles, process=False).export(path)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        wrong = {"repair": repair, "damaged": damaged}[WHAT](Path(temporary))
    raise SystemExit(int(bool(wrong)))

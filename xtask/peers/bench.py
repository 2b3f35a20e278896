"""Measures octofold beside its peers, in the same run, and checks that both agree.

    bench.py OCTOFOLD cubes|cells|solid|models [DATA]

 cubes   marching cubes on a 512^3 gyroid (float32) beside vtkFlyingEdges3D, on one thread and on two
 cells   surface cells of the bunny at 128, 256 and 512
 solid   solid voxels of the armadillo beside VTK's stencil and OpenVDB's level set, 100 000 random
         voxels and 100 000 near the surface against exact winding numbers (libigl), and 4096^3
 models  counts and self-intersecting pairs of every model in DATA beside trimesh and libigl

Octofold's seconds are those of its own stages (`--json`), on one thread those of the processor too.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

OCTOFOLD, WHAT = sys.argv[1], sys.argv[2]
DATA = Path(sys.argv[3] if len(sys.argv) > 3 else os.environ.get("OCTOFOLD_DATA", "../shared/data"))
ROUNDS = 5


def octofold(*words):
    done = subprocess.run([OCTOFOLD, *map(str, words), "--json"], capture_output=True, text=True)
    if done.returncode not in (0, 1):
        raise SystemExit(f"octofold {' '.join(map(str, words))}: {done.stderr}")
    return json.loads(done.stdout)


def stages(report, names):
    return sum(s["seconds"] for s in report["stages"] if s["name"] in names)


def told(*words):
    """Seconds of each stage, without the measures that a report takes."""
    words = [OCTOFOLD, *map(str, words), "--verbose"]
    said = subprocess.run(words, capture_output=True, text=True, check=True).stderr
    lines = (line.split(" s ", 1) for line in said.splitlines() if " s  " in line)
    return {name.strip(): float(s) for s, name in lines}


def seconds(names, *words):
    return sum(s for name, s in told(*words).items() if name in names)


def cpu(work):
    """Least processor seconds and wall seconds of several calls, and the last result."""
    best = [1e9, 1e9]
    for _ in range(ROUNDS):
        wall, busy = time.perf_counter(), time.process_time()
        result = work()
        best = [min(best[0], time.process_time() - busy), min(best[1], time.perf_counter() - wall)]
    return *best, result


def cubes(folder):
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk

    n = 512
    t = np.arange(n, dtype=np.float32) * np.float32(8 * np.pi / n)
    s, c = np.sin(t), np.cos(t)
    field = (
        s[None, None, :] * c[None, :, None]
        + s[None, :, None] * c[:, None, None]
        + s[:, None, None] * c[None, None, :]
    ).astype(np.float32)
    file = folder / "gyroid.npy"
    np.save(file, field)
    image = vtk.vtkImageData()
    image.SetDimensions(n, n, n)
    image.GetPointData().SetScalars(numpy_to_vtk(field.ravel()))

    def flying_edges():
        f = vtk.vtkFlyingEdges3D()
        f.SetInputData(image)
        f.SetValue(0, 0.0)
        f.ComputeNormalsOff(), f.ComputeGradientsOff(), f.ComputeScalarsOff()
        f.Update()
        return f.GetOutput().GetNumberOfPolys()

    # Rounds alternate, so that both meet the same noise.
    ours = {1: [], 2: []}
    theirs = {1: [], 2: []}
    triangles = set()
    for _ in range(ROUNDS):
        for threads in (1, 2):
            vtk.vtkSMPTools.Initialize(threads)
            wall = time.perf_counter()
            triangles.add(flying_edges())
            theirs[threads].append(time.perf_counter() - wall)
            words = ["surface", file, folder / "gyroid.ply", "--iso", 0, "--open", "--threads", threads]
            ours[threads].append(seconds(["count", "march"], *words))
    with open(folder / "gyroid.ply", "rb") as ply:
        triangles.add(int(ply.read(4000).split(b"element face ")[1].split()[0]))
    print(f"triangles {triangles}, VTK {vtk.vtkVersion().GetVTKVersion()}")
    for threads in (1, 2):
        a, b = min(ours[threads]), min(theirs[threads])
        print(f"{threads} threads: ours {a:.3f} s, flying edges {b:.3f} s, {b / a:.2f} times faster")
    print(f"two threads against one: {min(ours[1]) / min(ours[2]):.2f} times faster")
    closed = octofold("surface", file, folder / "closed.ply", "--iso", 0)["output"]
    print({k: closed[k] for k in ("triangles", "closed", "manifold", "oriented", "boundary_edges")})


def cells(folder):
    for n, expected in ((128, 56077), (256, 224717), (512, 898102)):
        words = ["voxelize", DATA / "scans/stanford-bunny.obj", folder / "b.nrrd", "--resolution", n]
        count = octofold(*words, "--fill", "surface")["output"]["nonzero"]
        print(f"{n}: {count} cells, expected {expected}, {100 * (count / expected - 1):+.4f} %")


def solid(folder):
    import igl
    import trimesh
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray

    model = DATA / "scans/armadillo.obj"
    mesh = trimesh.load(model, process=False, force="mesh")
    points, faces = np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)
    n, file = 512, folder / "armadillo.npy"
    work = ["snap", "cross rows", "fill rows"]
    ours = 1e9
    for _ in range(ROUNDS):
        report = octofold("voxelize", model, file, "--resolution", n, "--threads", 1)
        ours = min(ours, stages(report, work))
    print(f"ours: {ours:.3f} s on one thread, {report['output']['nonzero']} voxels")

    low, cell = points.min(0), (points.max(0) - points.min(0)).max() / n
    voxels = np.load(file)
    data = vtk.vtkPolyData()
    vp = vtk.vtkPoints()
    vp.SetData(numpy_to_vtk(points, deep=True))
    polys = vtk.vtkCellArray()
    polys.SetData(3, numpy_to_vtkIdTypeArray(faces.ravel(), deep=True))
    data.SetPoints(vp), data.SetPolys(polys)

    def stencil():
        s = vtk.vtkPolyDataToImageStencil()
        s.SetInputData(data)
        s.SetOutputSpacing([cell] * 3)
        s.SetOutputOrigin(low + cell / 2)
        s.SetOutputWholeExtent(0, voxels.shape[2] - 1, 0, voxels.shape[1] - 1, 0, voxels.shape[0] - 1)
        s.Update()

    seconds = cpu(stencil)[0]
    print(f"vtkPolyDataToImageStencil: {seconds:.3f} CPU s, {seconds / ours:.1f} times ours")
    np.savez(folder / "mesh.npz", points=points, faces=faces, cell=cell)
    script = (
        "import sys, time, numpy as np, pyopenvdb as vdb\n"
        "m = np.load(sys.argv[1]); best = 1e9\n"
        "t = vdb.createLinearTransform(voxelSize=float(m['cell']))\n"
        "for _ in range(3):\n"
        "    c = time.process_time()\n"
        "    vdb.FloatGrid.createLevelSetFromPolygons(m['points'], triangles=m['faces'].astype('u4'), transform=t)\n"
        "    best = min(best, time.process_time() - c)\n"
        "print(best)\n"
    )
    done = subprocess.run(
        ["/usr/bin/python3", "-c", script, folder / "mesh.npz"], capture_output=True, text=True
    )
    if done.returncode == 0:
        seconds = float(done.stdout)
        print(f"OpenVDB level set: {seconds:.3f} CPU s, {seconds / ours:.1f} times ours")
    else:
        print("OpenVDB is not there (Debian: python3-openvdb)")

    random = np.random.default_rng(1)
    shape = np.array(voxels.shape[::-1])
    anywhere = random.integers(0, shape, (100_000, 3))
    on_surface = trimesh.sample.sample_surface(mesh, 100_000, seed=1)[0]
    near = np.clip(((on_surface - low) / cell + random.normal(0, 1, on_surface.shape)).astype(int), 0, shape - 1)
    for name, index in (("random", anywhere), ("near the surface", near)):
        inside = igl.winding_number(points, faces, low + (index + 0.5) * cell) > 0.5
        found = voxels[index[:, 2], index[:, 1], index[:, 0]] > 0
        print(f"{len(index)} voxels {name}: {int((inside != found).sum())} differ")
    # Reports take the measures of the input too, so the peak is that of the whole command.
    small = octofold("voxelize", model, folder / "s.binvox", "--resolution", 512)
    large = octofold("voxelize", model, folder / "l.binvox", "--resolution", 4096)
    for r, size in ((small, 512), (large, 4096)):
        print(f"{size}: {stages(r, work):.3f} s, peak {r['peak_memory'] / 2**20:.0f} MiB")
    print(f"64 times the surface takes {stages(large, work) / stages(small, work):.1f} times as long")


def models(_):
    from check import COUNTS, ENDINGS, measures, read

    differ = 0
    files = [f for f in sorted(DATA.rglob("*")) if f.suffix.lower() in ENDINGS | {".gltf", ".3mf"}]
    for file in files:
        done = subprocess.run([OCTOFOLD, "info", file, "--json"], capture_output=True, text=True)
        ours = json.loads(done.stdout) if done.returncode == 0 else None
        try:
            theirs = measures(*read(file))
        except Exception as error:
            print(f"{file}: peers: {type(error).__name__}; octofold: {done.stderr.strip() or 'read'}")
            continue
        if ours is None:
            print(f"{file}: refused: {done.stderr.strip()}")
            continue
        rows = {k: (ours[k], theirs[k]) for k in COUNTS if ours[k] != theirs[k]}
        differ += bool(rows)
        pairs = ours["self_intersections"]
        print(f"{file}: {ours['triangles']} triangles, {pairs} pairs: {rows or 'equal'}")
    print(f"{len(files)} files, {differ} differ")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        {"cubes": cubes, "cells": cells, "solid": solid, "models": models}[WHAT](Path(folder))

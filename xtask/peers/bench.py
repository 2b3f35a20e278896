"""Measures octofold beside its peers, in the same run, and checks that both agree.

    bench.py OCTOFOLD cubes|cells|solid|models|labels [DATA]

 cubes   marching cubes on a 512^3 gyroid (float32) beside vtkFlyingEdges3D, on one thread and on two
 cells   surface cells of the bunny at 128, 256 and 512
 solid   solid voxels of the armadillo beside VTK's stencil and OpenVDB's level set, 100 000 random
         voxels and 100 000 near the surface against exact winding numbers (libigl), and 4096^3
 models  counts and self-intersecting pairs of every model in DATA beside trimesh and libigl
 labels  walls of label volumes on one thread beside the binary union, vtkSurfaceNets3D and zmesh:
         times, triangles, edges of a label's surface that have not two triangles, and walls between
         labels that only one of the two labels has

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
            words = ["surface", file, folder / "gyroid.ply", "--method", "mc", "--iso", 0, "--open", "--threads", threads]
            ours[threads].append(seconds(["count", "march"], *words))
    with open(folder / "gyroid.ply", "rb") as ply:
        triangles.add(int(ply.read(4000).split(b"element face ")[1].split()[0]))
    print(f"triangles {triangles}, VTK {vtk.vtkVersion().GetVTKVersion()}")
    for threads in (1, 2):
        a, b = min(ours[threads]), min(theirs[threads])
        print(f"{threads} threads: ours {a:.3f} s, flying edges {b:.3f} s, {b / a:.2f} times faster")
    print(f"two threads against one: {min(ours[1]) / min(ours[2]):.2f} times faster")
    closed = octofold("surface", file, folder / "closed.ply", "--method", "mc", "--iso", 0)["output"]
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


def label_volumes():
    import nibabel
    import nrrd
    import pyvista
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy

    reader = vtk.vtkXMLImageDataReader()
    reader.SetFileName(str(Path(pyvista.__file__).parent / "examples/frog_tissues.vti"))
    reader.Update()
    image = reader.GetOutput()
    frog = vtk_to_numpy(image.GetPointData().GetScalars())
    yield "frog_tissues", frog.reshape(image.GetDimensions()[::-1])
    for name in ("aal.nii.gz", "brodmann.nii.gz", "D99_atlas_v2.0_right.nii.gz"):
        samples = np.asanyarray(nibabel.load(DATA / "volumes" / name).dataobj)
        yield name, np.squeeze(samples).T
    yield "Segmentation.seg.nrrd", nrrd.read(str(DATA / "volumes/Segmentation.seg.nrrd"))[0].T


def wall_defects(samples, shells):
    """Edges with not two triangles in one shell, and walls between labels with one side only.

    `shells` are positions in samples (x, y, z), triangles, and the label of each triangle."""
    points, triangles, labels = shells
    _, point = np.unique(np.round(points * 64).astype(np.int64), axis=0, return_inverse=True)
    triangles = point.ravel()[triangles].astype(np.int64)
    ends = np.sort(np.stack([triangles, np.roll(triangles, -1, 1)], 2), 2).reshape(-1, 2)
    edges = np.column_stack([np.repeat(labels, 3), ends])
    uses = np.unique(edges, axis=0, return_counts=True)[1]
    first = np.argmin(triangles, 1)
    turned = np.stack([triangles[np.arange(len(triangles)), (first + k) % 3] for k in range(3)], 1)
    twin = np.stack([turned[:, 0], turned[:, 2], turned[:, 1]], 1)
    size = int(point.max()) + 1
    name = lambda t: (t[:, 0] * size + t[:, 1]) * size + t[:, 2]
    alone = ~np.isin(name(turned), name(twin))
    low = np.floor(points[shells[1]].mean(1)).astype(int) + 1
    padded = np.pad(samples, 1)
    corners = [padded[low[:, 2] + k, low[:, 1] + j, low[:, 0] + i] for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    between_labels = np.min(corners, 0) > 0
    return int((uses != 2).sum()), int((alone & between_labels).sum())


def labels(folder):
    import trimesh
    import vtk
    import zmesh
    from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

    vtk.vtkSMPTools.Initialize(1)
    for name, samples in label_volumes():
        samples = np.ascontiguousarray(samples)
        if samples.dtype.kind != "u":
            samples = samples.astype(np.uint16)
        values = [int(v) for v in np.unique(samples) if v]
        parts, union = folder / "labels.npy", folder / "union.npy"
        np.save(parts, samples)
        np.save(union, (samples > 0).astype(np.uint8))
        image = vtk.vtkImageData()
        padded = np.pad(samples, 1)
        image.SetDimensions(*padded.shape[::-1])
        image.GetPointData().SetScalars(numpy_to_vtk(padded.ravel()))

        def surface_nets():
            nets = vtk.vtkSurfaceNets3D()
            nets.SetInputData(image)
            nets.SmoothingOff()
            nets.SetOutputMeshTypeToTriangles()
            for i, value in enumerate(values):
                nets.SetValue(i, value)
            nets.Update()
            return nets.GetOutput()

        def mesher():
            mesher = zmesh.Mesher((1, 1, 1))
            mesher.mesh(samples)
            return [(v, mesher.get(v, normals=False, reduction_factor=0, max_error=0)) for v in mesher.ids()]

        times = {"walls": [], "shells": [], "union": []}
        for _ in range(ROUNDS):
            words = ["surface", parts, folder / "labels.ply", "--labels", "--threads", 1]
            times["walls"].append(seconds(["count", "march"], *words))
            times["shells"].append(seconds(["shells"], *words))
            words = ["surface", union, folder / "union.ply", "--method", "mc", "--iso", 0.5, "--threads", 1]
            times["union"].append(seconds(["count", "march"], *words))
        best = {key: min(value) for key, value in times.items()}
        ours = trimesh.load(folder / "labels.ply", process=False)
        own = ours.metadata["_ply_raw"]["face"]["data"]["label"].ravel()
        shells = (np.asarray(ours.vertices), np.asarray(ours.faces), own)
        whole = trimesh.load(folder / "union.ply", process=False)
        print(f"{name}: {samples.shape}, {len(values)} labels")
        print(
            f"  ours: walls {best['walls']:.3f} s, shells {best['shells']:.3f} s more, "
            f"{len(own)} triangles in shells, defects {wall_defects(samples, shells)}"
        )
        print(
            f"  binary union: {best['union']:.3f} s, {len(whole.faces)} triangles; "
            f"walls take {best['walls'] / best['union']:.2f} times as long"
        )
        nets_seconds, _, nets = cpu(surface_nets)
        triangles = vtk_to_numpy(nets.GetPolys().GetConnectivityArray()).reshape(-1, 3)
        points = vtk_to_numpy(nets.GetPoints().GetData()).astype(float) - 1
        sides = vtk_to_numpy(nets.GetCellData().GetArray("BoundaryLabels")).astype(int)
        forth, back = (np.isin(side, values) for side in sides.T)
        both = np.concatenate([triangles[forth], triangles[back][:, ::-1]])
        of = np.concatenate([sides[forth, 0], sides[back, 1]])
        defects = wall_defects(samples, (points, both, of))
        print(f"  vtkSurfaceNets3D: {nets_seconds:.3f} CPU s, {len(both)} triangles in shells, defects {defects}")
        mesher_seconds, _, found = cpu(mesher)
        start, points, triangles, of = 0, [], [], []
        for value, mesh in found:
            points.append(mesh.vertices[:, ::-1])
            triangles.append(np.asarray(mesh.faces, np.int64) + start)
            of.append(np.full(len(mesh.faces), value))
            start += len(mesh.vertices)
        points = np.concatenate(points).astype(float)
        points += shells[0].min(0) - points.min(0)
        defects = wall_defects(samples, (points, np.concatenate(triangles), np.concatenate(of)))
        print(f"  zmesh: {mesher_seconds:.3f} CPU s, {sum(map(len, of))} triangles in shells, defects {defects}")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        {"cubes": cubes, "cells": cells, "solid": solid, "models": models, "labels": labels}[WHAT](Path(folder))

"""Certified TEL beside its peers, in the same run, as tables in Markdown.

    certified.py OCTOFOLD certified [DATA]          triangles and speed
    certified.py OCTOFOLD certified-peers [DATA]    peers: many minutes a shape

 triangles  `octofold surface` within a tolerance of one voxel as a share of marching cubes, and what
            libigl finds: open, non-manifold and misoriented edges, intersecting pairs, Euler number,
            and the distance to marching cubes both ways
 peers      OpenVDB's adaptive mesh, and marching cubes reduced by fast-simplification, meshoptimizer
            and MeshLib: each setting bisected for the fewest triangles that measure at most one voxel
 speed      a ball of u8 beside vtkFlyingEdges3D, on one thread and on two

A distance is the largest from all vertices and area-weighted samples of one mesh to the nearest
point of the other, by libigl. Octofold's seconds are those of its stages between reading and
writing; its certificate is one of them. A peer's seconds are one call at its best setting, without
the marching cubes that it starts from, and on as many threads as it takes.
"""

import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path

import igl
import numpy as np
import trimesh
from bench import DATA, OCTOFOLD, WHAT, told
from check import measures, read
from scipy.ndimage import distance_transform_edt
from tables import row, rule

SIZES = (128, 256, 512)
# The share of marching cubes' triangles, in percent, that is aimed at for each size.
TARGETS = {"CSG": (0.25, 0.10, 0.05), "round": (0.9, 0.5, 0.25), "organic": (2.0, 1.1, 0.6)}
SHAPES = {
    "part-a": "CSG",
    "part-e": "CSG",
    "tape-cutter": "CSG",
    "sphere": "round",
    "hair-dryer": "round",
    "blob": "organic",
    "kettle": "organic",
    "torus": "organic",
    "bunny": "organic",
}
TOLERANCE = 1.0
# What is told of coordinates of 32 bits may pass the tolerance by their rounding.
ROUNDING = 1e-4
SAMPLES = 200_000
# Bisecting the peers on more triangles of marching cubes takes many minutes a shape.
PEERS_UP_TO = 600_000
# Exact arithmetic on more triangles of a peer takes minutes.
PAIRS_UP_TO = 200_000
STRIDES, BISECTIONS = 8, 4
BALLS = (256, 512, 1024)
ROUNDS = 7


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        if WHAT == "certified-peers":
            peers(folder)
        else:
            triangles(folder)
            speed(folder)


def triangles(folder):
    print("### Triangles of certified TEL, tolerance one voxel, one thread\n")
    row("shape", "kind", "size", "MC", "ctel", "share %", "target %", "", "seconds", "MC seconds",
        "to MC", "from MC", "open", "non-manifold", "misoriented", "intersecting", "Euler (MC)")
    rule(17)
    for name, kind in SHAPES.items():
        for size, target in zip(SIZES, TARGETS[kind]):
            volume = mask(folder, name, size)
            reference, march = surface(folder, volume, "mc")
            mesh, seconds = surface(folder, volume, "ctel")
            found, base = measures(*mesh), counts(*reference)
            share = 100 * found["triangles"] / base["triangles"]
            there, back = Reference(*reference).distances(*mesh, SAMPLES)
            faults = [found[k] for k in ("boundary_edges", "nonmanifold_edges", "misoriented_edges", "self_intersections")]
            wrong = any(faults) or found["euler"] != base["euler"] or max(there, back) > TOLERANCE + ROUNDING
            verdict = "WRONG" if wrong else "met" if share <= target else "missed"
            row(name, kind, size, base["triangles"], found["triangles"], f"{share:.3f}", target, verdict,
                f"{seconds:.3f}", f"{march:.3f}", f"{there:.4f}", f"{back:.4f}", *faults,
                f"{found['euler']} ({base['euler']})")
    print()


def peers(folder):
    print("### The same measured distance by other ways\n")
    row("shape", "size", "way", "setting", "triangles", "share %", "distance", "seconds", "open",
        "non-manifold", "intersecting", "Euler (MC)")
    rule(12)
    for size in SIZES:
        for name in SHAPES:
            volume = mask(folder, name, size)
            mesh, _ = surface(folder, volume, "mc")
            if len(mesh[1]) > PEERS_UP_TO:
                continue
            reference, base = Reference(*mesh), counts(*mesh)
            ours, seconds = surface(folder, volume, "ctel")
            beside(name, size, "octofold ctel", "1 voxel", ours, seconds, reference, base)
            with OpenVdb(folder, volume, *mesh) as vdb:
                ways = {
                    "OpenVDB of MC": (partial(vdb.convert, "level"), lambda t: t**3),
                    "OpenVDB of voxels": (partial(vdb.convert, "grid"), lambda t: t**3),
                    "fast-simplification": (fast_simplification(*mesh), lambda t: 0.3 ** (1 - t) * 1e-4**t),
                    "meshoptimizer": (meshoptimizer(*mesh), lambda t: 0.05 * 320**t),
                    "MeshLib": (meshlib(*mesh), lambda t: 0.05 * 20_000**t),
                }
                for way, (reduce, setting) in ways.items():
                    best = fewest(reduce, setting, reference)
                    if best is None:
                        row(name, size, way, "none", *["-"] * 8)
                    else:
                        beside(name, size, way, f"{best[0]:.3g}", *best[1:], reference, base)
    print()


def beside(name, size, way, setting, mesh, seconds, reference, base):
    exact = len(mesh[1]) <= PAIRS_UP_TO
    found = (measures if exact else counts)(*mesh)
    distance = max(reference.distances(*mesh, SAMPLES))
    row(name, size, way, setting, found["triangles"],
        f"{100 * found['triangles'] / base['triangles']:.3f}", f"{distance:.4f}", f"{seconds:.3f}",
        found["boundary_edges"], found["nonmanifold_edges"],
        found["self_intersections"] if exact else "not counted", f"{found['euler']} ({base['euler']})")


def fewest(reduce, setting, reference):
    """The setting, mesh and seconds of the fewest triangles within the tolerance, or nothing.

    `setting` goes from fine at 0 to coarse at 1. Distances do not always grow with it, so it is
    first taken from coarse to fine until one holds, then bisected beside that; all that held are
    remembered, and the best are measured again with all samples.
    """
    held = []

    def holds(at):
        mesh, seconds = reduce(setting(at))
        if not len(mesh[1]) or max(reference.distances(*mesh, SAMPLES // 4)) > TOLERANCE:
            return False
        held.append((len(mesh[1]), setting(at), mesh, seconds))
        return True

    low = next((at for at in np.linspace(1, 0, STRIDES + 1) if holds(at)), None)
    if low is not None and low < 1:
        high = low + 1 / STRIDES
        for _ in range(BISECTIONS):
            at = (low + high) / 2
            low, high = (at, high) if holds(at) else (low, at)
    for _, *best in sorted(held, key=lambda one: one[0]):
        if max(reference.distances(*best[1], SAMPLES)) <= TOLERANCE + ROUNDING:
            return best
    return None


class Reference:
    """The mesh of marching cubes, to which distances are measured."""

    def __init__(self, points, faces):
        self.mesh = points, faces
        self.tree = igl.AABB()
        self.tree.init(points, faces)
        self.samples = dense(points, faces, SAMPLES)

    def distances(self, points, faces, samples):
        """The largest distance from the mesh to the reference, and from the reference to the mesh."""
        there = self.tree.squared_distance(*self.mesh, dense(points, faces, samples))[0]
        back = igl.point_mesh_squared_distance(self.samples, points, faces)[0]
        return np.sqrt(there.max()), np.sqrt(back.max())


def dense(points, faces, samples):
    mesh = trimesh.Trimesh(points, faces, process=False)
    on = trimesh.sample.sample_surface(mesh, samples, seed=0)[0]
    return np.concatenate([points[np.unique(faces)], on])


class OpenVdb:
    """Meshes of two signed distances by the system's Python: from the mesh of marching cubes, and a
    distance transform of the voxels. Which of them needs fewer triangles differs from shape to shape.
    """

    BAND = 3
    SCRIPT = (
        "import sys, time, numpy as np, pyopenvdb as vdb\n"
        "m = np.load(sys.argv[1])\n"
        "grid = vdb.FloatGrid(float(m['band']))\n"
        "grid.copyFromArray(m['field'], ijk=(int(-m['band']),) * 3)\n"
        "level = vdb.FloatGrid.createLevelSetFromPolygons(m['points'], triangles=m['faces'].astype('u4'))\n"
        "for line in sys.stdin:\n"
        "    which, adaptivity = line.split()\n"
        "    g = {'grid': grid, 'level': level}[which]\n"
        "    t = time.perf_counter()\n"
        "    p, t3, t4 = g.convertToPolygons(isovalue=0, adaptivity=float(adaptivity))\n"
        "    t = time.perf_counter() - t\n"
        "    np.savez(sys.argv[2], p=p, t3=t3, t4=t4)\n"
        "    print(t, flush=True)\n"
    )

    def __init__(self, folder, volume, points, faces):
        self.out = folder / "vdb-out.npz"
        inside = np.pad(np.load(volume).transpose(2, 1, 0) > 0, self.BAND)
        # A surface between two samples is half a sample from both.
        field = np.where(inside, 0.5 - distance_transform_edt(inside), distance_transform_edt(~inside) - 0.5)
        field = np.ascontiguousarray(field.clip(-self.BAND, self.BAND), np.float32)
        np.savez(folder / "vdb-in.npz", points=points, faces=faces, field=field, band=self.BAND)
        words = ["/usr/bin/python3", "-c", self.SCRIPT, folder / "vdb-in.npz", self.out]
        self.child = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.child.communicate()

    def convert(self, which, adaptivity):
        try:
            print(which, adaptivity, file=self.child.stdin, flush=True)
            seconds = float(self.child.stdout.readline())
        except (BrokenPipeError, ValueError):
            sys.exit("OpenVDB is not there (Debian: python3-openvdb)")
        made = np.load(self.out)
        quads = made["t4"]
        faces = np.concatenate([made["t3"], quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        return welded(made["p"], faces), seconds


def fast_simplification(points, faces):
    import fast_simplification as fs

    p, f = points.astype(np.float32), faces.astype(np.int32)

    def reduce(share):
        start = time.perf_counter()
        made = fs.simplify(p, f, target_count=max(4, int(share * len(f))))
        return welded(*made[:2]), time.perf_counter() - start

    return reduce


def meshoptimizer(points, faces):
    import meshoptimizer as mo

    p, f = points.astype(np.float32), faces.astype(np.uint32).ravel()

    def reduce(error):
        out = np.zeros(len(f), np.uint32)
        start = time.perf_counter()
        count = mo.simplify(
            out, f, p, target_index_count=3, target_error=error, options=mo.SIMPLIFY_ERROR_ABSOLUTE
        )
        seconds = time.perf_counter() - start
        return welded(p, out[:count].reshape(-1, 3)), seconds

    return reduce


def meshlib(points, faces):
    from meshlib import mrmeshnumpy, mrmeshpy

    p, f = points.astype(np.float32), faces.astype(np.int32)

    def reduce(error):
        mesh = mrmeshnumpy.meshFromFacesVerts(f, p)
        settings = mrmeshpy.DecimateSettings()
        # Its quadric error is far above the distance, and its default forbids long triangles.
        settings.maxError, settings.maxTriangleAspectRatio, settings.packMesh = error, 1000, True
        start = time.perf_counter()
        mrmeshpy.decimateMesh(mesh, settings)
        seconds = time.perf_counter() - start
        made = mrmeshnumpy.getNumpyVerts(mesh), mrmeshnumpy.getNumpyFaces(mesh.topology)
        return welded(*made), seconds

    return reduce


def speed(folder):
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk

    sizes = BALLS
    best = {}
    for size in sizes:
        volume = mask(folder, "sphere", size)
        samples = np.ascontiguousarray(np.load(volume)).view(np.uint8)
        image = vtk.vtkImageData()
        image.SetDimensions(samples.shape[::-1])
        image.GetPointData().SetScalars(numpy_to_vtk(samples.ravel()))

        def flying_edges():
            f = vtk.vtkFlyingEdges3D()
            f.SetInputData(image)
            f.SetValue(0, 0.5)
            f.ComputeNormalsOff(), f.ComputeGradientsOff(), f.ComputeScalarsOff()
            start = time.perf_counter()
            f.Update()
            return time.perf_counter() - start

        # Rounds alternate, so that all meet the same noise.
        for _ in range(ROUNDS):
            for threads in (1, 2):
                vtk.vtkSMPTools.Initialize(threads)
                least(best, (size, "flying edges", threads), flying_edges())
                for method in ("mc", "ctel"):
                    least(best, (size, method, threads), work(folder, volume, method, threads))
        volume.unlink()
    print(f"### Seconds for a ball of u8, VTK {vtk.vtkVersion().GetVTKVersion()}, best of {ROUNDS}\n")
    row("size", "way", "one thread", "times flying edges", "two threads", "two against one")
    rule(6)
    for size in sizes:
        for way in ("flying edges", "mc", "ctel"):
            one, two = best[size, way, 1], best[size, way, 2]
            row(size, way, f"{one:.4f}", f"{one / best[size, 'flying edges', 1]:.2f}", f"{two:.4f}", f"{one / two:.2f}")
    print("\nExponents of the size, one thread:\n")
    row("way", *(f"{a} to {b}" for a, b in zip(sizes, sizes[1:])))
    rule(1 + len(sizes[1:]))
    for way in ("flying edges", "mc", "ctel"):
        row(way, *(f"{np.log2(best[b, way, 1] / best[a, way, 1]):.2f}" for a, b in zip(sizes, sizes[1:])))
    print()
    print("The samples of octofold lie in a mapped file, those of VTK in memory.")


def least(best, key, seconds):
    best[key] = min(best.get(key, seconds), seconds)


def surface(folder, volume, method):
    """Welded points and triangles, and the seconds on one thread."""
    seconds = min(work(folder, volume, method, 1) for _ in range(3))
    return read(folder / "made.ply"), seconds


def work(folder, volume, method, threads):
    """Seconds between reading and writing."""
    said = told("surface", volume, folder / "made.ply", "--method", method, "--threads", threads)
    return sum(s for stage, s in said.items() if stage not in ("read", "write"))


def mask(folder, name, size):
    """A binary volume whose samples lie one apart, so that lengths are in voxels."""
    file = folder / f"{name}-{size}.npy"
    if file.exists():
        return file
    if name == "blob":
        np.save(file, blob(size))
        return file
    words = ["sample", name] if name != "bunny" else ["voxelize", DATA / "scans/stanford-bunny.obj"]
    words = [OCTOFOLD, *words, file, "--resolution", size, "--quiet"]
    subprocess.run(list(map(str, words)), check=True)
    return file


def blob(size):
    """Where 24 bells of Gauss at random places together rise above one half."""
    random = np.random.default_rng(3)
    at = (np.arange(size) + 0.5) / size
    bells = []
    for _ in range(24):
        centre, radius = 0.25 + 0.5 * random.random(3), 0.06 + 0.07 * random.random()
        bells.append([np.exp(-(((at - c) / radius) ** 2)) for c in centre])
    x, y, z = np.transpose(np.array(bells), (1, 2, 0))
    return np.stack([(y * row) @ x.T > 0.5 for row in z])


def welded(points, faces):
    """Points at one place made one, as `read` does."""
    points, index = np.unique(np.asarray(points, float), axis=0, return_inverse=True)
    return points, index.reshape(-1)[np.asarray(faces).astype(np.int64)]


def counts(points, faces):
    """Those of the measures that need no geometry."""
    a, b, c = faces.T
    proper = faces[(a != b) & (b != c) & (c != a)]
    sides = np.sort(np.concatenate([proper[:, [0, 1]], proper[:, [1, 2]], proper[:, [2, 0]]]), axis=1)
    _, uses = np.unique(sides[:, 0] * len(points) + sides[:, 1], return_counts=True)
    return {
        "triangles": len(faces),
        "boundary_edges": int((uses == 1).sum()),
        "nonmanifold_edges": int((uses > 2).sum()),
        "euler": len(np.unique(proper)) - len(uses) + len(proper),
    }


if __name__ == "__main__":
    main()

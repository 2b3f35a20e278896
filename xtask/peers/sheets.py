"""Single sheets of scenes whose truth is known, by the collapse and by the published rule, as tables in
Markdown.

    sheets.py OCTOFOLD sheets [DATA]

Each scene is turned and moved at random, without seams between its parts where they touch, and goes
through `octofold repair --sheet` at CELLS cells. Per scene, over all poses:

 area            least and greatest area, as a share of the truth's
 Betti           poses with the truth's numbers of parts, of rings and of closed spaces (mod 2)
 precision       share of the length of edges with more than two triangles that lies within two cells of
                 a line in which the truth has more than two sheets
 recall          share of those lines that lies within two cells of such an edge
 false           length of such edges elsewhere, in cells
 doubled         area of triangles that have another parallel one right before or behind them within the
                 thickness, as a share of all
 turned          edges between two triangles of a patch that run along it the same way, without one-sided
                 patches
 meeting         pairs of triangles that meet (libigl, exact)
"""

import subprocess
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
import trimesh
from bench import DATA, OCTOFOLD, octofold
from check import read
from igl.copyleft.cgal import remesh_self_intersections
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from tables import row, rule

CELLS, POSES = 64, 12
AXIS = ((0, 0, 0), (0, 0, 1))
DISC, BALL, RING = (1, 0, 0), (1, 0, 1), (1, 1, 0)


def main():
    with tempfile.TemporaryDirectory() as folder:
        for way in ("collapse", "dohi"):
            print(f"### `--sheet={way}`, {CELLS} cells, {POSES} poses\n")
            row("scene", "area", "Betti", "precision", "recall", "false", "doubled", "turned", "meeting")
            rule(9)
            for name, scene in SCENES.items():
                measure(Path(folder), way, name, scene)
            print()
        models(Path(folder))


def measure(folder, way, name, scene):
    points, triangles, lines, betti, truth = scene()
    found = []
    for pose in range(POSES):
        turn = Rotation.random(random_state=1000 + pose).as_matrix().T
        by = np.random.default_rng(pose).random(3)
        write(folder / "in.obj", points @ turn + by, triangles)
        report = octofold("repair", folder / "in.obj", folder / "out.obj", f"--sheet={way}",
                          "--resolution", CELLS)
        cell, thickness = report["repair"]["cell"], report["repair"]["sheets"]["thickness"]
        out = Complex(*read(folder / "out.obj"))
        there = [np.asarray(line) @ turn + by for line in lines]
        right, false, recall = out.junctions(there, 2 * cell)
        found.append((out.area / truth, out.betti() == betti, right, false, recall, false / cell,
                      out.doubled(0.9 * thickness), out.turned(), out.meeting()))
    areas, same, right, false, recall, cells, doubled, turned, meeting = zip(*found)
    length = sum(right) + sum(false)
    row(name, f"{min(areas):.3f} to {max(areas):.3f}", f"{sum(same)} of {POSES}",
        f"{sum(right) / length:.3f}" if length else "", f"{np.mean(recall):.3f}" if lines else "",
        f"{np.mean(cells):.1f}", f"{np.mean(doubled):.4f}", sum(turned), sum(meeting))


def models(folder):
    """Every mesh of the data that is open, through the collapse; what solid parts enclose goes."""
    print("### Models\n")
    row("model", "triangles", "area", "patches", "junctions", "doubled", "turned", "meeting")
    rule(8)
    for file in sorted(f for f in DATA.rglob("*") if f.suffix.lower()[1:] in trimesh.available_formats()):
        words = [OCTOFOLD, "info", file]
        if subprocess.run(words, capture_output=True).returncode:
            continue
        before = octofold("info", file)
        if not before.get("boundary_edges"):
            continue
        try:
            report = octofold("repair", file, folder / "out.obj", "--sheet", "--resolution", 128)
        except SystemExit as refused:
            print(refused)
            continue
        out, sheets = Complex(*read(folder / "out.obj")), report["repair"]["sheets"]
        row(file.stem, len(out.triangles), f"{out.area / before['area']:.3f}", sheets["patches"],
            len(sheets["junctions"]), f"{out.doubled(0.9 * sheets['thickness']):.4f}", out.turned(), out.meeting())
    print()


class Complex:
    """Triangles of whose edges each may have any number of them."""

    def __init__(self, points, triangles):
        self.points, self.triangles = points, triangles
        sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
        self.edges, edge, self.uses = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True,
                                                return_counts=True)
        order = np.argsort(edge.reshape(-1), kind="stable")
        self.first = np.concatenate([[0], np.cumsum(self.uses)])
        self.face = order % len(triangles)
        self.forward = sides[order, 0] < sides[order, 1]
        pairs = self.face[self.first[:-1][self.uses == 2, None] + [0, 1]]
        count = (len(triangles),) * 2
        links = coo_matrix((np.ones(len(pairs)), pairs.T), shape=count)
        self.patches, self.patch = connected_components(links, directed=False)
        corners = points[triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        self.areas = np.linalg.norm(normals, axis=1) / 2
        self.normals = normals / np.maximum(2 * self.areas, 1e-300)[:, None]
        self.area = self.areas.sum()

    def betti(self):
        """Numbers of parts, rings and closed spaces; closed sums of patches, mod 2, bound the last."""
        used = np.unique(self.triangles)
        links = coo_matrix((np.ones(len(self.edges)), self.edges.T), shape=(len(self.points),) * 2)
        parts = connected_components(links, directed=False)[0] - (len(self.points) - len(used))
        pivots, rank = {}, 0
        for edge in np.flatnonzero(self.uses != 2):
            sheets = Counter(self.patch[self.face[self.first[edge] : self.first[edge + 1]]])
            line = sum(1 << int(patch) for patch, times in sheets.items() if times % 2)
            while line and line.bit_length() in pivots:
                line ^= pivots[line.bit_length()]
            if line:
                pivots[line.bit_length()] = line
                rank += 1
        closed = self.patches - rank
        return parts, parts + closed - (len(used) - len(self.edges) + len(self.triangles)), closed

    def junctions(self, lines, reach):
        """Length of junctions at the lines and elsewhere, and the share of the lines that they cover."""
        ends = self.points[self.edges[self.uses > 2]]
        length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        if not lines:
            return 0, length.sum(), 1
        near = np.min([to_segment(ends.mean(axis=1), *line) for line in lines], axis=0) < reach
        shares = np.linspace(0, 1, 201)[:, None]
        wanted = np.concatenate([a + shares * (b - a) for a, b in lines])
        steps = np.linspace(0, 1, 5)[:, None, None]
        there = (ends[None, :, 0] * (1 - steps) + ends[None, :, 1] * steps).reshape(-1, 3)
        covered = (cKDTree(there).query(wanted)[0] < reach).mean() if len(there) else 0
        return length[near].sum(), length[~near].sum(), covered

    def doubled(self, thickness):
        """Share of the area with a parallel triangle before or behind it."""
        middles = self.points[self.triangles].mean(axis=1)
        pairs = cKDTree(middles).query_pairs(thickness, output_type="ndarray")
        apart = middles[pairs[:, 1]] - middles[pairs[:, 0]]
        a, b = self.normals[pairs[:, 0]], self.normals[pairs[:, 1]]
        before = abs(np.einsum("ij,ij->i", a, apart)) > 0.8 * np.linalg.norm(apart, axis=1)
        along = abs(np.einsum("ij,ij->i", a, b)) > 0.985
        return self.areas[np.unique(pairs[before & along])].sum() / self.area

    def turned(self):
        """Edges in a patch along which its two triangles run the same way, least of the one-sided."""
        first = self.first[:-1][self.uses == 2]
        wrong = self.forward[first] == self.forward[first + 1]
        counts = np.bincount(self.patch[self.face[first]], wrong, self.patches)
        sides = [self.is_two_sided(patch) for patch in np.flatnonzero(counts)]
        return int(counts[np.flatnonzero(counts)][sides].sum())

    def is_two_sided(self, patch):
        """Whether a patch can be turned one way: its cover of two sides falls into two parts."""
        first = self.first[:-1][self.uses == 2]
        first = first[self.patch[self.face[first]] == patch]
        a, b = self.face[first], self.face[first + 1]
        crossed = self.forward[first] == self.forward[first + 1]
        count, n = len(self.triangles), len(first)
        near = np.concatenate([a, a + count])
        far = np.concatenate([np.where(crossed, b + count, b), np.where(crossed, b, b + count)])
        links = coo_matrix((np.ones(2 * n), (near, far)), shape=(2 * count,) * 2)
        sides = connected_components(links, directed=False)[1]
        return n == 0 or sides[a[0]] != sides[a[0] + count]

    def meeting(self):
        return len(remesh_self_intersections(self.points, self.triangles)[2])


def to_segment(points, a, b):
    along = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    return np.linalg.norm(points - a - along[:, None] * (b - a), axis=1)


def grid(place, across, along):
    """The images of a grid on the unit square."""
    s, t = np.meshgrid(np.linspace(0, 1, across + 1), np.linspace(0, 1, along + 1))
    points = np.array([place(s, t) for s, t in zip(s.ravel(), t.ravel())], float)
    low = (np.arange(along)[:, None] * (across + 1) + np.arange(across)).ravel()
    quads = np.stack([low, low + 1, low + across + 2, low + across + 1], axis=1)
    return points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def rectangle(at, u, v):
    at, u, v = map(np.array, (at, u, v))
    return grid(lambda s, t: at + s * u + t * v, 4, 4)


def joined(*parts):
    """Parts as one mesh, with one point where several have the same position."""
    points, triangles, count = [], [], 0
    for own, faces in parts:
        points.append(own)
        triangles.append(faces + count)
        count += len(own)
    points, triangles = np.concatenate(points), np.concatenate(triangles)
    _, kept, index = np.unique(np.round(points * 1e9), axis=0, return_index=True, return_inverse=True)
    triangles = index.reshape(-1)[triangles]
    a, b, c = triangles.T
    return points[kept], triangles[(a != b) & (b != c) & (c != a)]


def leaf(angle):
    """A unit square that begins at the third axis."""
    angle = np.radians(angle)
    return rectangle([0, 0, 0], [np.cos(angle), np.sin(angle), 0], [0, 0, 1])


def scene(parts, lines, betti, truth=None):
    def made():
        points, triangles = joined(*parts())
        return points, triangles, lines, betti, truth or Complex(points, triangles).area
    return made


def leaves(*angles):
    return scene(lambda: map(leaf, angles), [AXIS] if len(angles) > 2 else [], DISC)


def plates(apart, betti=DISC):
    """Two walls; one sheet where they are nearer to each other than the thickness."""
    return scene(lambda: [rectangle([0, 0, z], [1, 0, 0], [0, 1, 0]) for z in (0, apart)], [], betti, 1)


def box(size):
    x, y, z = np.diag(size)
    walls = [((0, 0, 0), x, y), (z, x, y), ((0, 0, 0), y, z), (x, y, z), ((0, 0, 0), x, z), (y, x, z)]
    return [rectangle(*wall) for wall in walls]


def plate(thick):
    return scene(lambda: box((1, 1, thick)), [], DISC, 1)


def hemisphere():
    def at(s, t):
        s, t = 2 * np.pi * s, t * np.pi / 2
        return np.sin(t) * np.cos(s), np.sin(t) * np.sin(s), np.cos(t)
    return [grid(at, 96, 24)]


def moebius():
    def at(s, t):
        width, turn = 0.6 * (t - 0.5), 2 * np.pi * s
        if s == 1:
            turn, width = 0, -width
        ring = 1 + width * np.cos(turn / 2)
        return ring * np.cos(turn), ring * np.sin(turn), width * np.sin(turn / 2)
    return [grid(at, 144, 12)]


FIN = rectangle([1, 0.5, 0.2], [0.6, 0, 0], [0, 0, 0.6])
SCENES = {
    "plane": scene(lambda: [rectangle([0, 0, 0], [1, 0, 0], [0, 1, 0])], [], DISC),
    "fold 45": leaves(0, 135),
    "fold 90": leaves(0, 90),
    "fold 120": leaves(0, 60),
    "wedge 30": leaves(0, 30),
    "wedge 15": leaves(0, 15),
    "hemisphere": scene(hemisphere, [], DISC),
    "Moebius band": scene(moebius, [], RING),
    "T": leaves(0, 180, 90),
    "cross": leaves(0, 180, 90, 270),
    "crossing, unwelded": scene(lambda: [rectangle([-1, 0, 0], [2, 0, 0], [0, 0, 1]),
                                         rectangle([0.013, -1, 0], [0, 2, 0], [0, 0, 1])],
                                [((0.013, 0, 0), (0.013, 0, 1))], DISC),
    "book of 5": leaves(0, 45, 90, 135, 180),
    "box": scene(lambda: box((1, 1, 1)), [], BALL),
    "box with a fin": scene(lambda: [*box((1, 1, 1)), FIN], [((1, 0.5, 0.2), (1, 0.5, 0.8))], BALL),
    "walls 0.01 apart": plates(0.01),
    "walls 0.02 apart": plates(0.02),
    "plate, 0.01 thick": plate(0.01),
    "plate, 0.02 thick": plate(0.02),
}


def write(path, points, triangles):
    lines = ["v {!r} {!r} {!r}".format(*map(float, p)) for p in points]
    lines += ["f {} {} {}".format(*t) for t in triangles + 1]
    path.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()

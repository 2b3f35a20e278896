"""Looks at the meshes of the demo with other people's libraries, and asks whether they agree.

    python check.py OCTOFOLD DEMO_FOLDER

Every mesh is read by trimesh, welded by position and measured here; every measure must be what
`octofold info --json` says. Outputs must also be taken for solids by manifold3d.
"""

import json
import subprocess
import sys
from pathlib import Path

import igl.copyleft.cgal
import manifold3d
import numpy as np
import trimesh

# What the demo makes from voxels must be solid; what it starts from need not be.
SOLIDS = {"scan-closed.ply", "kettle.stl", "gyroid.glb"}
ENDINGS = {".ply", ".obj", ".stl", ".glb", ".off"}
COUNTS = (
    "points",
    "triangles",
    "boundary_edges",
    "nonmanifold_edges",
    "misoriented_edges",
    "euler",
    "self_intersections",
)


def read(path):
    """Welded points and triangles."""
    mesh = trimesh.load(path, process=False, force="mesh")
    points, index = np.unique(np.asarray(mesh.vertices, float), axis=0, return_inverse=True)
    return points, index.reshape(-1)[np.asarray(mesh.faces)].astype(np.int64)


def measures(points, triangles):
    """The measures of the demo's tables, each in the plainest way."""
    a, b, c = triangles.T
    proper = triangles[(a != b) & (b != c) & (c != a)]
    sides = np.concatenate([proper[:, [0, 1]], proper[:, [1, 2]], proper[:, [2, 0]]])
    edges, edge, uses = np.unique(
        np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    forward = np.where(sides[:, 0] < sides[:, 1], 1, -1)
    balance = np.bincount(edge.reshape(-1), forward, len(edges))
    used = np.unique(proper)
    p, q, r = (points[proper[:, i]] for i in range(3))
    # With detect_only libigl works with rounded planes and misses triangles that are folded flat.
    meetings = igl.copyleft.cgal.remesh_self_intersections(points, triangles)[2]
    return {
        "points": len(used),
        "triangles": len(triangles),
        "boundary_edges": int((uses == 1).sum()),
        "nonmanifold_edges": int((uses > 2).sum()),
        "misoriented_edges": int(((uses == 2) & (balance != 0)).sum()),
        "euler": len(used) - len(edges) + len(proper),
        "self_intersections": len(meetings),
        "area": float(np.linalg.norm(np.cross(q - p, r - p), axis=1).sum() / 2),
        "volume": float(np.einsum("ij,ij->i", p, np.cross(q, r)).sum() / 6),
    }


def disagreements(octofold, path):
    """What we say and what the peers say, where the two differ."""
    said = subprocess.run([octofold, "info", "--json", path], capture_output=True, check=True)
    ours = json.loads(said.stdout)
    points, triangles = read(path)
    theirs = measures(points, triangles)
    for key in COUNTS:
        if ours[key] != theirs[key]:
            yield f"{key}: {ours[key]}, but the peers count {theirs[key]}"
    for key in ("area", "volume"):
        # Without a volume of ours the surface has none to compare.
        if ours[key] is not None and abs(ours[key] - theirs[key]) > 1e-9 * theirs["area"]:
            yield f"{key}: {ours[key]}, but the peers measure {theirs[key]}"
    if path.name in SOLIDS:
        mesh = manifold3d.Mesh64(points, triangles.astype(np.uint64))
        status = manifold3d.Manifold(mesh).status()
        if status != manifold3d.Error.NoError:
            yield f"manifold3d does not take it for a solid: {status}"


def main():
    octofold, folder = sys.argv[1], Path(sys.argv[2])
    meshes = sorted(p for p in folder.iterdir() if p.suffix in ENDINGS)
    missing = SOLIDS - {p.name for p in meshes}
    facts = [f"{name}: missing" for name in sorted(missing)]
    for path in meshes:
        found = [f"{path.name}: {fact}" for fact in disagreements(octofold, path)]
        print(f"{path.name}: {'differs' if found else 'agrees'}")
        facts += found
    if facts:
        sys.exit("\n".join(facts))


if __name__ == "__main__":
    main()

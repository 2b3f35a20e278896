"""Measures .ofn files beside peers, on the shapes of the specification of the network model (D1).

    network.py OCTOFOLD network [DATA] [SIZES] [FOLDER]

Shapes are drawn at generic offsets and turns, 256^3 and 512^3 unless told (`SIZES`, with commas). The
eighteen that are formulas are those of the specification; the nut is PyVista's; bunny and armadillo
are scans of DATA and stand for the specification's two other scans. Where FOLDER holds NAME_SIZE.npy
that is taken instead. Every file is decoded and compared.

Bits for each surface voxel, whole files: fast, archive, bricks of 64^3; and of the peers: packed bits
with zstd-19, crackle with xz, compresso with xz, a pointerless octree with zstd-19, the directed graph of
equal subtrees (SVDAG) with the shortest pointers, and Draco's point cloud, which holds the surface voxels
only and not which side is in. Seconds are those of octofold's own stages on one
thread. `contains` is the whole command on a file in bricks, and the same without any file.
"""

import lzma
import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

OCTOFOLD = sys.argv[1]
DATA = Path(sys.argv[3]) if len(sys.argv) > 3 else Path("../shared/data")
SIZES = [int(n) for n in sys.argv[4].split(",")] if len(sys.argv) > 4 else [256, 512]
KEPT = Path(sys.argv[5]) if len(sys.argv) > 5 else None
OFFSET = np.array([0.37, -0.21, 0.13])


def turn(seed):
    w, x, y, z = (q := np.random.default_rng(seed).normal(size=4)) / np.linalg.norm(q)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])


TURN = turn(7)
O = (0, 0, 0)
TETRA = (turn(3) @ (np.array([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]]) / np.sqrt(3)).T).T
PRISM = [(np.cos(t), np.sin(t), 0) for t in np.array([90, 210, 330]) * np.pi / 180 + 0.11]


def box(p, c, h):
    return (abs(p[0] - c[0]) <= h[0]) & (abs(p[1] - c[1]) <= h[1]) & (abs(p[2] - c[2]) <= h[2])


def cylinder(p, c, r, h, axis):
    a, b = [i for i in range(3) if i != axis]
    return ((p[a] - c[a]) ** 2 + (p[b] - c[b]) ** 2 <= r * r) & (abs(p[axis] - c[axis]) <= h)


def ball(p, c, r):
    return (p[0] - c[0]) ** 2 + (p[1] - c[1]) ** 2 + (p[2] - c[2]) ** 2 <= r * r


def cone(p):
    t = (0.4 - p[2]) / 0.8
    return (p[0] ** 2 + p[1] ** 2 <= (0.38 * t) ** 2) & (t >= 0) & (t <= 1)


def halves(p, normals, limits):
    inside = True
    for n, d in zip(normals, limits):
        inside = inside & (n[0] * p[0] + n[1] * p[1] + n[2] * p[2] <= d)
    return inside


def turned(p, scale=1.0):
    return [scale * (TURN[i, 0] * p[0] + TURN[i, 1] * p[1] + TURN[i, 2] * p[2]) for i in range(3)]


def csg1(p):
    m = box(p, (0, 0, -0.05), (0.3, 0.28, 0.25)) | ball(p, (0.12, 0.08, 0.15), 0.22)
    return m & ~cylinder(p, (-0.1, -0.05, 0), 0.12, 1, 2) & ~cylinder(p, O, 0.08, 1, 0)


def csg2(p):
    m = ball(p, O, 0.4) & box(p, O, (0.31, 0.31, 0.31))
    return m & ~cylinder(p, O, 0.17, 1, 0) & ~cylinder(p, O, 0.17, 1, 1) & ~cylinder(p, O, 0.17, 1, 2)


def csg3(p):
    q = turned(p)
    return cylinder(q, O, 0.2, 0.42, 2) | cylinder(q, O, 0.15, 0.42, 0) | box(q, O, (0.22, 0.22, 0.22))


def camera(p):
    m = box(p, (0, -0.05, 0), (0.42, 0.12, 0.26)) | cylinder(p, (0.05, 0.16, -0.02), 0.18, 0.16, 1)
    m = m | box(p, (-0.05, -0.05, 0.31), (0.12, 0.09, 0.06)) | cylinder(p, (0.32, -0.05, 0.285), 0.045, 0.03, 2)
    m &= ~cylinder(p, (0.05, 0.29, -0.02), 0.15, 0.06, 1) & ~ball(p, (0.05, 0.28, -0.02), 0.13)
    return m & ~box(p, (-0.36, 0.06, 0.2), (0.04, 0.02, 0.03)) & ~box(p, (0, -0.17, 0), (0.3, 0.015, 0.17))


def pc(p):
    m = box(p, (0, -0.1, 0.16), (0.3, 0.22, 0.23)) & ~box(p, (0, 0.11, 0.17), (0.25, 0.03, 0.18))
    m |= cylinder(p, (0, -0.1, -0.1), 0.1, 0.04, 2) | box(p, (0, -0.1, -0.22), (0.38, 0.28, 0.085))
    m &= ~box(p, (0.2, 0.17, -0.2), (0.13, 0.03, 0.012))
    kx, ky = np.mod(p[0] + 0.34, 0.048), np.mod(p[1] - 0.245, 0.042)
    keys = (kx > 0.006) & (kx < 0.042) & (ky > 0.005) & (ky < 0.037) & (abs(p[0]) < 0.334)
    keys = keys & (p[1] > 0.25) & (p[1] < 0.41) & (p[2] > -0.265) & (p[2] < -0.245)
    return m | box(p, (0, 0.33, -0.28), (0.36, 0.1, 0.02)) | keys


def phone(p):
    normals = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, -1), (0, 0.26, 0.9656)]
    m = halves(p, normals, [0.32, 0.32, 0.36, 0.36, 0.3, -0.05])
    hand = cylinder(p, (0, -0.24, 0.16), 0.05, 0.36, 0)
    hand = hand | ball(p, (-0.34, -0.24, 0.1), 0.1) | ball(p, (0.34, -0.24, 0.1), 0.1)
    m = m | (hand & (p[2] > 0.02))
    m = m | cylinder(p, (-0.22, -0.24, 0), 0.05, 0.1, 2) | cylinder(p, (0.22, -0.24, 0), 0.05, 0.1, 2)
    for i in range(3):
        for j in range(4):
            m = m | cylinder(p, (-0.12 + 0.12 * i, -0.06 + 0.1 * j, -0.06 - 0.02 * j), 0.035, 0.05, 2)
    return m


def bracket(p):
    m = box(p, (0, 0, -0.32), (0.42, 0.3, 0.05)) | box(p, (-0.37, 0, 0), (0.05, 0.3, 0.37))
    fillet = (p[0] > -0.32) & (p[0] < -0.22) & (p[2] > -0.27) & (p[2] < -0.17) & (abs(p[1]) <= 0.3)
    fillet = fillet & ((p[0] + 0.22) ** 2 + (p[2] + 0.17) ** 2 >= 0.01)
    gusset = (p[0] + p[2] <= -0.2) & (p[0] >= -0.37) & (p[2] >= -0.32) & (abs(abs(p[1]) - 0.2) <= 0.02)
    m = m | fillet | gusset
    for x in (0.0, 0.28):
        for y in (-0.1, 0.1):
            m = m & ~cylinder(p, (x, y, -0.32), 0.05, 0.2, 2)
    for y in (-0.12, 0.12):
        m = m & ~cylinder(p, (-0.37, y, 0.22), 0.06, 0.2, 0)
    return m & ~cylinder(p, (-0.37, 0, 0), 0.07, 0.2, 0)


def gear(p):
    r, t = np.sqrt(p[0] ** 2 + p[1] ** 2), np.arctan2(p[1], p[0])
    rim = 0.36 + 0.04 * np.clip(1.8 * np.sin(24 * t), -1, 1)
    m = (r <= rim) & (abs(p[2]) <= 0.1) | ((r <= 0.14) & (abs(p[2]) <= 0.2))
    m = m & ~(r <= 0.07) & ~box(p, (0.07, 0, 0), (0.03, 0.02, 1))
    for k in range(6):
        a = k * np.pi / 3 + 0.2
        m &= ~cylinder(p, (0.24 * np.cos(a), 0.24 * np.sin(a), 0), 0.055, 1, 2)
    return m


def rock(p):
    rng = np.random.default_rng(5)
    waves = []
    for octave in range(7):
        for _ in range(10):
            v = rng.normal(size=3)
            waves.append((v / np.linalg.norm(v) * 6 * 1.9**octave, rng.uniform(0, 6.28), 0.012 * 0.55**octave))
    p = np.broadcast_arrays(*p)
    r = np.sqrt(p[0] ** 2 + p[1] ** 2 + p[2] ** 2)
    m, near = r < 0.22, (r >= 0.22) & (r < 0.46)
    x, y, z = (c[near] for c in p)
    relief = sum(a * np.sin(v[0] * x + v[1] * y + v[2] * z + phase) for v, phase, a in waves)
    m[near] = r[near] <= 0.34 + relief
    return m


FORMULAS = {
    "cube": lambda p: box(p, O, (0.35, 0.35, 0.35)),
    "cylinder": lambda p: cylinder(p, O, 0.3, 0.4, 2),
    "prism": lambda p: halves(p, PRISM, [0.2] * 3) & (abs(p[2]) <= 0.4),
    "csg1": csg1, "csg2": csg2, "camera": camera, "pc": pc, "phone": phone, "bracket": bracket, "gear": gear,
    "sphere": lambda p: ball(p, O, 0.4), "cone": cone,
    "torus": lambda p: (np.sqrt(p[0] ** 2 + p[1] ** 2) - 0.3) ** 2 + p[2] ** 2 <= 0.01,
    "tetra": lambda p: halves(p, TETRA, [0.17] * 4),
    "cube_rot": lambda p: box(turned(p), O, (0.27, 0.27, 0.27)),
    "csg3rot": csg3, "bracket_rot": lambda p: bracket(turned(p, 1.18)),
    "rock": rock,
}
FLAT = ["cube", "cylinder", "prism", "csg1", "csg2", "camera", "pc", "phone", "bracket", "gear", "nut"]
CURVED = ["sphere", "cone", "torus", "tetra", "cube_rot", "csg3rot", "bracket_rot"]
SCANS = ["rock", "bunny", "bunnyscan", "armadillo"]


def drawn(name, n):
    axis = [(np.arange(n) - (n - 1) / 2 + off) / n for off in OFFSET]
    voxels = np.zeros((n, n, n), bool)
    for z in range(0, n, 8):
        part = slice(z, min(n, z + 8))
        voxels[part] = FORMULAS[name]([axis[0][None, None, :], axis[1][None, :, None], axis[2][part, None, None]])
    return voxels


def shapes(n, folder):
    if KEPT:
        for name in FLAT + CURVED + SCANS:
            if (KEPT / f"{name}_{n}.npy").exists():
                yield name, KEPT / f"{name}_{n}.npy"
        return
    for name in FORMULAS:
        file = folder / "shape.npy"
        np.save(file, drawn(name, n))
        yield name, file
    from pyvista import examples

    for name, model in [("nut", examples.nutfile), ("bunny", "scans/stanford-bunny.obj"), ("armadillo", "scans/armadillo.obj")]:
        file = folder / "shape.npy"
        # As much room around as the formulas leave.
        octofold("voxelize", DATA / model, file, "--resolution", int(n * 0.88))
        yield name, file


def octofold(*words):
    said = subprocess.run([OCTOFOLD, *map(str, words), "--verbose", "--threads", "1"], capture_output=True, text=True)
    if said.returncode not in (0, 1):
        raise SystemExit(f"octofold {' '.join(map(str, words))}: {said.stderr}")
    lines = (line.split(" s ", 1) for line in said.stderr.splitlines() if " s  " in line)
    return {name.strip(): float(s) for s, name in lines}


def surface(voxels):
    padded = np.pad(voxels, 1)
    core = (slice(1, -1),) * 3
    hidden = voxels.copy()
    for axis in range(3):
        for step in (0, 2):
            part = list(core)
            part[axis] = slice(step, step + voxels.shape[axis])
            hidden &= padded[tuple(part)]
    return int(voxels.sum()) - int(hidden.sum())


def shell(voxels):
    """The surface voxels, as places."""
    hidden = voxels.copy()
    for axis in range(3):
        for step in (1, -1):
            beside = np.roll(voxels, step, axis)
            border = [slice(None)] * 3
            border[axis] = 0 if step == 1 else -1
            beside[tuple(border)] = False
            hidden &= beside
    return np.argwhere(voxels & ~hidden)


def levels(voxels):
    """What the nodes of the region octree are, the voxels first: 0 empty, 1 full, 2 mixed."""
    side = 1 << (max(voxels.shape) - 1).bit_length()
    states = [np.pad(voxels, [(0, side - n) for n in voxels.shape]).astype(np.uint8)]
    while len(states[-1]) > 1:
        parts = [states[-1][z::2, y::2, x::2] for z, y, x in np.ndindex(2, 2, 2)]
        upper = parts[0].copy()
        for part in parts[1:]:
            upper[part != upper] = 2
        states.append(upper)
    return states


def children(at):
    """Places of the children of nodes, eight for each."""
    return (2 * at[:, None, :] + np.array(list(np.ndindex(2, 2, 2)))[None]).reshape(-1, 3)


def octree(voxels):
    """Breadth first: two bits for each child of a mixed node, one where children are voxels."""
    states = levels(voxels)
    at, planes = np.zeros((1, 3), int), [[states[-1][0, 0, 0] >> 1, states[-1][0, 0, 0] & 1]]
    for level in range(len(states) - 2, -1, -1):
        if level == len(states) - 2 and states[-1][0, 0, 0] != 2:
            break
        at = children(at)
        own = states[level][tuple(at.T)]
        planes.append(own if level == 0 else np.stack([own >> 1, own & 1], 1).ravel())
        at = at[own == 2]
    return np.packbits(np.concatenate(planes)).tobytes()


def octree_back(data, side):
    bits = np.unpackbits(np.frombuffer(data, np.uint8))
    at, next = np.zeros((1, 3), int), 2
    if bits[0] == 0:
        return np.full((side,) * 3, bool(bits[1]))
    voxels = np.zeros((side,) * 3, bool)
    part = side // 2
    while True:
        at = children(at)
        if part == 1:
            voxels[tuple(at.T)] = bits[next:next + len(at)]
            return voxels
        own = bits[next:next + 2 * len(at)].reshape(-1, 2) @ np.array([2, 1])
        next += 2 * len(at)
        for z, y, x in at[own == 1] * part:
            voxels[z:z + part, y:y + part, x:x + part] = True
        at, part = at[own == 2], part // 2


def svdag(voxels):
    """Bytes of the graph: of each different node two bits for each child and a pointer for each mixed
    one, as short as the nodes of the level below allow; of those above voxels eight bits."""
    states = levels(voxels)
    if states[-1][0, 0, 0] != 2:
        return 1
    ats = [np.zeros((1, 3), int)]
    for level in range(len(states) - 2, 0, -1):
        at = children(ats[-1])
        ats.append(at[states[level][tuple(at.T)] == 2])
    bits, number, below = 0, None, 0
    for level, at in zip(range(1, len(states)), reversed(ats)):
        own = children(at)
        told = states[level - 1][tuple(own.T)].astype(np.int64)
        if level > 1:
            told[told == 2] += number
        different, number = np.unique(told.reshape(-1, 8), axis=0, return_inverse=True)
        number = number.ravel()
        if level == 1:
            bits += 8 * len(different)
        else:
            pointer = max(1, (below - 1).bit_length())
            bits += 16 * len(different) + pointer * int((different >= 2).sum())
        below = len(different)
    # How many nodes each level has.
    return (bits + 7) // 8 + 4 * len(states)


def peers(voxels):
    sizes = {}
    coded = octree(voxels)
    side = 1 << (max(voxels.shape) - 1).bit_length()
    back = octree_back(coded, side)[tuple(slice(n) for n in voxels.shape)]
    assert np.array_equal(back, voxels), "octree"
    sizes["svdag+"] = svdag(voxels)
    try:
        import zstandard

        sizes["bits+zstd"] = len(zstandard.ZstdCompressor(level=19).compress(np.packbits(voxels).tobytes()))
        sizes["octree+zstd"] = len(zstandard.ZstdCompressor(level=19).compress(coded))
        import crackle

        labels = np.asfortranarray(voxels.astype(np.uint8).transpose(2, 1, 0))
        sizes["crackle+xz"] = len(lzma.compress(crackle.compress(labels), preset=9))
        import compresso

        sizes["compresso+xz"] = len(lzma.compress(compresso.compress(labels), preset=9))
        import DracoPy

        points = shell(voxels)
        cloud = DracoPy.encode(
            points.astype(np.float32), quantization_bits=(side - 1).bit_length(), quantization_range=side - 1,
            quantization_origin=[0, 0, 0], compression_level=10 if side <= 256 else 7)
        known = np.rint(DracoPy.decode(cloud).points).astype(int)
        assert np.array_equal(np.unique(known, axis=0), np.unique(points, axis=0)), "Draco"
        sizes["draco+"] = len(cloud)
    except ImportError as error:
        print(f"  without {error.name}")
    return sizes


def mean(values):
    return math.exp(sum(math.log(v) for v in values) / len(values)) if values else float("nan")


def measure(n, folder):
    table, seconds = {}, {}
    for name, file in shapes(n, folder):
        voxels = np.load(file)
        count, sizes = surface(voxels), {}
        for kind, flags in [("fast", []), ("archive", ["--archive"]), ("bricks", ["--bricks"])]:
            coded, back = folder / f"{kind}.ofn", folder / "back.npy"
            wrote = octofold("net", "encode", file, coded, *flags)
            read = octofold("net", "decode", coded, back)
            assert np.array_equal(np.load(back), voxels), f"{name} {kind}"
            sizes[kind] = coded.stat().st_size
            seconds.setdefault(kind, []).append((wrote["encode"], read["decode"]))
        if n <= 512:
            sizes.update(peers(voxels))
        table[name] = {kind: 8 * size / count for kind, size in sizes.items()}
        row = "  ".join(f"{kind} {bits:.4f}" for kind, bits in table[name].items())
        times = "  ".join(f"{kind} {s[-1][0]:.3f}/{s[-1][1]:.3f} s" for kind, s in seconds.items())
        print(f"{n} {name:<12} {count:>8} voxels  {row}  {times}", flush=True)
    kinds = list(next(iter(table.values())))
    for title, names in [("flat", FLAT), ("curved", CURVED), ("scans", SCANS), ("all", list(table))]:
        rows = [table[name] for name in names if name in table]
        print(f"{n} {title:<7}", "  ".join(f"{kind} {mean([r[kind] for r in rows]):.4f}" for kind in kinds))
    for kind, pairs in seconds.items():
        wrote, read = (sorted(times) for times in zip(*pairs))
        print(f"{n} {kind}: encode {wrote[len(wrote) // 2]:.3f} s ({wrote[-1]:.3f} at most), "
              f"decode {read[len(read) // 2]:.3f} s ({read[-1]:.3f} at most)")
    best = [min(v for k, v in row.items() if "+" in k) for row in table.values() if len(row) > 3]
    if best:
        print(f"{n} best of the peers for each shape: {mean(best):.4f}")
        for kind in ("fast", "archive", "bricks"):
            lost = [name for name, row in table.items() if min(v for k, v in row.items() if "+" in k) < row[kind]]
            print(f"{n} a peer is smaller than {kind} on: {', '.join(lost) or 'none'}")
    cold(folder / "bricks.ofn", n)


def cold(file, n):
    def best(words):
        times = []
        for _ in range(20):
            begin = time.perf_counter()
            subprocess.run([OCTOFOLD, *words], capture_output=True)
            times.append(time.perf_counter() - begin)
        return 1000 * min(times)

    inside = best(["net", "contains", str(file), *[str(n // 2)] * 3])
    print(f"{n} contains: {inside:.2f} ms with the process, {best(['--version']):.2f} ms for a process that does nothing")


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        for size in SIZES:
            measure(size, Path(temporary))

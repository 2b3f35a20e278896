"""3D Tiles: what other people's programs say of them.

    tiles.py OCTOFOLD tiles [DATA]

The bunny, the flight helmet and a globe with the map of the world become tiles. Every content goes through
gltf-validator, 3d-tiles-tools walks the tilesets, and 3d-tiles-renderer shows them in a headless Chromium.
For each model the table has triangles, octants, tiles, bytes of contents, seconds of building and of writing
tiles on one thread, and what the validator found; for each picture the levels of tiles that were drawn, and for
the closed globe the pixels through which its inside is seen.

Node.js with npm must be there. Pictures need Chromium (`CHROMIUM` names it), and are left out without.
`PICTURES` names a folder that keeps them, and the globe at several distances as in Fig. 14 of the paper.
"""

import json
import math
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from bench import DATA, OCTOFOLD
from lod import told

HERE = Path(__file__).resolve().parent / "tiles"
CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("google-chrome")


def globe(folder):
    """A ball with texture coordinates, round which the map of the world goes."""
    rows, columns = 256, 512
    points, uvs, faces = [], [], []
    for i in range(rows + 1):
        latitude = math.pi * (0.5 - i / rows)
        for j in range(columns + 1):
            longitude = math.tau * ((j % columns) / columns - 0.5)
            across = math.cos(latitude) if 0 < i < rows else 0.0
            points.append(f"v {across * math.cos(longitude):.9f} {math.sin(latitude):.9f} "
                          f"{-across * math.sin(longitude):.9f}")
            uvs.append(f"vt {j / columns:.9f} {1 - i / rows:.9f}")
    for i in range(rows):
        for j in range(columns):
            a = i * (columns + 1) + j + 1
            corners = [a, a + columns + 1, a + columns + 2, a + 1]
            if i == 0:
                corners.pop(3)
            elif i == rows - 1:
                corners.pop(2)
            faces.append("f " + " ".join(f"{c}/{c}" for c in corners))
    lines = ["mtllib globe.mtl", "usemtl map", *points, *uvs, *faces]
    (folder / "globe.obj").write_text("\n".join(lines) + "\n")
    (folder / "globe.mtl").write_text("newmtl map\nKd 1 1 1\nmap_Kd map.jpg\n")
    shutil.copyfile(DATA / "textured/earth/earth-blue-marble.jpg", folder / "map.jpg")
    return folder / "globe.obj"


def node(folder, *words):
    run = subprocess.run(["node", *map(str, words)], cwd=folder, capture_output=True, text=True)
    if run.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, words))}: {run.stdout}{run.stderr}")
    return [json.loads(line) for line in run.stdout.splitlines()]


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        shutil.copytree(HERE, folder, dirs_exist_ok=True)
        subprocess.run(["npm", "install", "--ignore-scripts", "--silent", "--no-audit", "--no-fund"],
                       cwd=folder, check=True)
        pictures = Path(os.environ.get("PICTURES", folder / "pictures")).resolve()
        pictures.mkdir(exist_ok=True)
        models = [
            ("bunny", DATA / "scans/stanford-bunny.obj", "open", ["3:16", "3:2", "1.2:12"]),
            ("helmet", DATA / "textured/FlightHelmet/FlightHelmet.gltf", "open", ["3:8", "1.2:4"]),
            ("globe", globe(folder), "closed", [f"{d}:{t}:0.3,1,0.5" for d in (0.8, 1.2, 2.4, 4.8)
                                                for t in (2, 8)]),
        ]
        shown = []
        print("| model | triangles | octants | tiles | MB | build s | tiles s | errors | warnings |")
        print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
        for name, path, kind, views in models:
            lod, tiles = folder / f"{name}.oflod", folder / f"{name}-tiles"
            built = told("lod", "build", path, lod, "--level", 9)
            written = told("lod", "tiles", lod, tiles, "--up", "y")
            counts = node(folder, "check.mjs", tiles)[0]
            times = [sum(stage["seconds"] for stage in r["stages"]) for r in (built, written)]
            megabytes = written["tiles"]["bytes"] / 1e6
            print(f"| {name} | {built['input']['triangles']} | {built['octants']} "
                  f"| {sum(written['tiles']['tiles_by_level'])} | {megabytes:.1f} | {times[0]:.2f} "
                  f"| {times[1]:.2f} | {counts['errors']} | {counts['warnings']} |")
            if CHROMIUM:
                os.environ["CHROMIUM"] = CHROMIUM
                for view in node(folder, "view.mjs", tiles, pictures / name, kind, *views):
                    shown.append((name, view, view["magenta"] if kind == "closed" else ""))
        print("\n| model | radii : pixels | tiles by level | triangles | pixels drawn | inside seen |")
        print("| --- | --- | --- | --- | --- | --- |")
        for name, view, inside in shown:
            levels = ", ".join(f"{level}: {count}" for level, count in view["levels"].items())
            print(f"| {name} | {':'.join(view['view'].split(':')[:2])} | {levels} | {view['triangles']} "
                  f"| {view['drawn']} | {inside} |")
        if "PICTURES" in os.environ:
            far_and_near(folder / "globe.oflod", pictures)


def far_and_near(lod, pictures):
    """The globe as in Fig. 14: patches for three distances, in units of which the root has 256."""
    print("\n| distance | patches | octants by level |")
    print("| --- | --- | --- |")
    side = 2 / 0.96
    for distance in (1000, 2000, 4000):
        eye = distance * side / 256
        out = pictures / f"globe-{distance}.glb"
        run = told("lod", "extract", lod, out, "--eye", f"0,0,{eye}", "--criterion", "wakatsuki2003",
                   "--fov", 40, "--height", 1000, "--pixels", 2)
        facts = run["extract"]
        print(f"| {distance} | {facts['patches']} | {facts['octants_by_level']} |")


if __name__ == "__main__":
    main()

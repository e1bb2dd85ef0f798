#!/usr/bin/env python3
"""`caustica check` and `caustica render` over every file of a folder of assets, as a table in Markdown.

In: the program, the folder, and which pipeline. Out: the table on standard output; exit code 1 when a file ends the program in
another way than loading or being refused (exit codes 0 and 1).

    tests/bench/assets.py target/release/caustica ../shared/assets --pipeline raster
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import time

READ = {".gltf", ".glb", ".obj", ".hdr", ".exr"}
ENVIRONMENTS = {".hdr", ".exr"}
# Where no model is damaged: an environment is rendered around it.
FRAME = "gltf/Box/glTF-Binary/Box.glb"


def run(command, limit_s):
    start = time.monotonic()
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=limit_s)
        return done.returncode, done.stdout, done.stderr, (time.monotonic() - start) * 1e3
    except subprocess.TimeoutExpired:
        return None, "", f"no end after {limit_s} s", limit_s * 1e3


def short(text, folder):
    """An error without the path of the folder, on one line, not too long."""
    line = text.strip().splitlines()[-1] if text.strip() else ""
    line = line.replace(str(folder) + "/", "").removeprefix("error: ").replace("|", "\\|")
    line = "".join(c if c.isprintable() and c != "\ufffd" else "?" for c in line)
    return line if len(line) <= 110 else line[:107] + "..."


def checked(entry, folder):
    if "error" in entry:
        return "refused: " + short(entry["error"].split(": ", 1)[-1], folder)
    parts = [f"{entry['triangles']:,} triangles"] if entry["triangles"] else ["no triangles"]
    for key, word in (("import_warnings", "warnings"), ("findings", "findings")):
        if entry[key]:
            parts.append(f"{len(entry[key])} {word}")
    return "loads: " + ", ".join(parts)


def rendered(program, path, folder, pipeline, picture):
    what = [path] if path.suffix not in ENVIRONMENTS else [folder / FRAME, "--environment", path]
    command = [program, "render", *what, "-o", picture, "--size", "64x64", "--samples", "1", "--pipeline", pipeline]
    code, _, errors, ms = run([str(word) for word in command], 120)
    if code == 0:
        return code, "a picture", ms
    return code, f"exit code {code}" if code != 1 else "refused", ms


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("program", type=pathlib.Path)
    arguments.add_argument("folder", type=pathlib.Path)
    arguments.add_argument("--pipeline", default="hybrid")
    options = arguments.parse_args()
    folder = options.folder.resolve()
    files = sorted(path for path in folder.rglob("*") if path.suffix in READ)
    code, out, errors, _ = run([str(options.program), "check", "--json", *map(str, files)], 600)
    if code not in (0, 1) or not out:
        sys.exit(f"caustica check ends with {code}: {errors}")
    entries = json.loads(out)["files"]
    print(f"| file | `caustica check` | ms | `render --pipeline {options.pipeline}` | ms |")
    print("|---|---|---:|---|---:|")
    unruly = 0
    totals = {"loads": 0, "refused": 0, "a picture": 0}
    with tempfile.TemporaryDirectory() as scratch:
        for path, entry in zip(files, entries, strict=True):
            code, picture, ms = rendered(options.program, path, folder, options.pipeline, pathlib.Path(scratch) / "a.png")
            unruly += code not in (0, 1)
            result = checked(entry, folder)
            totals[result.split(":")[0]] += 1
            totals["a picture"] += picture == "a picture"
            row = [f"`{path.relative_to(folder)}`", result, f"{entry['milliseconds']:.1f}", picture, f"{ms:.0f}"]
            print("| " + " | ".join(row) + " |", flush=True)
    print(f"\n{len(files)} files: {totals['loads']} load, {totals['refused']} are refused in words; "
          f"{totals['a picture']} give a picture; {unruly} end in another way.")
    sys.exit(1 if unruly else 0)


if __name__ == "__main__":
    main()

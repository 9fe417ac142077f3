#!/usr/bin/env python3
"""Runs clang-tidy over the product's sources (not the tests'), as .clang-tidy says.

A file costs some seconds of CPU, so what was found clean is remembered: by the contents of the file, of the headers of ours that it includes, of
.clang-tidy and of its compile command. With --budget S no further file is begun after S seconds; those that changed last come first, and the files
that were not reached are counted in the closing line. They are then unchecked, not clean.
"""

import argparse
import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
# What has been gone through file by file: a finding there fails. The rest is checked with --all, until it has been gone through as well.
HELD = ["client"]
FOLDERS = [*HELD, "common", "controller", "launcher", "mes_gateway", "perception", "planner", "ros_gateway", "sim_bridge"]
TIDY = "clang-tidy-14"
# Flags that GCC knows and clang does not.
EXTRA = ["--extra-arg=-Wno-unknown-warning-option", "--quiet"]


def output_of(*command):
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


def own_headers(build):
    """Object file -> the sources of ours that it was built from, by the record that ninja keeps."""
    result, current = {}, None
    for line in output_of("ninja", "-C", str(build), "-t", "deps").splitlines():
        if line and not line[0].isspace():
            current = result.setdefault(line.split(":")[0], [])
        elif current is not None and line.strip():
            path = pathlib.Path(line.strip())
            path = path if path.is_absolute() else build / path
            if ROOT in path.parents and ROOT / "build" not in path.parents:
                current.append(path)
    return result


def last_changed_first(files):
    """By the last commit that touched each; what is not committed comes before all."""
    order = {}
    for line in output_of("git", "log", "--name-only", "--format=", "-n", "200").splitlines():
        order.setdefault(line, len(order))
    dirty = {line[3:] for line in output_of("git", "status", "--porcelain").splitlines()}
    return sorted(files, key=lambda file: (-1 if file in dirty else order.get(file, len(order)), file))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build/release", help="a built build folder; default: build/release")
    parser.add_argument("--budget", type=float, default=float("inf"), help="seconds after which no further file is begun")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--all", action="store_true", help=f"all of the product's folders, not only those that are held clean ({', '.join(HELD)})")
    parser.add_argument("files", nargs="*", help="only these, by their paths from the root; default: all")
    arguments = parser.parse_args()

    build = arguments.build.resolve()
    commands = {}
    for entry in json.loads((build / "compile_commands.json").read_text()):
        file = pathlib.Path(entry["file"])
        if ROOT in file.parents and file.relative_to(ROOT).parts[0] in (FOLDERS if arguments.all or arguments.files else HELD):
            commands[str(file.relative_to(ROOT))] = entry
    files = last_changed_first(arguments.files or commands)
    headers = own_headers(build)
    cache = pathlib.Path(os.environ.get("XDG_CACHE_HOME", pathlib.Path.home() / ".cache")) / "breakshot-tidy"
    cache.mkdir(parents=True, exist_ok=True)
    common = (ROOT / ".clang-tidy").read_text() + output_of(TIDY, "--version")

    def key_of(file):
        entry = commands[file]
        digest = hashlib.sha256(common.encode())
        # Without the folders, so that a clone elsewhere knows what was found clean here.
        digest.update(entry["command"].replace(str(build), "BUILD").replace(str(ROOT), "ROOT").encode())
        target = re.search(r" -o (\S+)", entry["command"])
        for path in sorted({ROOT / file, *headers.get(target[1] if target else "", [])}):
            digest.update(path.read_bytes())
        return digest.hexdigest()

    begin = time.monotonic()

    def check(file):
        """(was it checked, what was found)"""
        known = cache / key_of(file)
        if known.exists():
            return "known", ""
        if time.monotonic() - begin > arguments.budget:
            return "left", ""
        run = subprocess.run([TIDY, "-p", str(build), *EXTRA, file], cwd=ROOT, capture_output=True, text=True)
        if run.returncode == 0:
            known.touch()
        return ("clean" if run.returncode == 0 else "found"), run.stdout

    counts = dict.fromkeys(["known", "clean", "found", "left"], 0)
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        for file, (outcome, text) in zip(files, pool.map(check, files)):
            counts[outcome] += 1
            if outcome == "found":
                print(text, flush=True)
    print(
        f"clang-tidy: {counts['clean'] + counts['known']} files clean ({counts['known']} of them known from before), {counts['found']} with findings, "
        f"{counts['left']} not checked for want of time; {time.monotonic() - begin:.0f} s"
    )
    return 1 if counts["found"] else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
"""The long fuzz campaign: runs every target for a number of executions, and resumes after an interruption.

The programs are those of the preset `fuzz` (clang's libFuzzer, address and undefined-behaviour sanitizers):

    cmake --preset fuzz && cmake --build build/fuzz
    nice -n 19 tests/fuzz/campaign.py build/fuzz

Corpora grow in BUILD/campaign/TARGET. Inputs that end a target are saved beside them as TARGET-crash-*.
BUILD/campaign/state.json counts executions across interruptions. --minimise DIR writes small corpora of equal coverage,
to review before they go into tests/fuzz/corpus. Exit code 1 if a target failed.
"""

import argparse
import concurrent.futures
import json
import re
import subprocess
import sys
import threading
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
VECTORS = HERE.parent.parent / "format_spec" / "vectors"

# Target: longest input, and seed folders besides corpus/TARGET. Short inputs run faster.
TARGETS = {
    "mask_ranks": (1024, []),
    "raster": (4096, []),
    "ply_reader": (2048, [HERE / "corpus" / "ply", HERE.parent / "odd" / "files"]),
    "gltf": (4096, []),
    "camera": (4096, []),
    "table": (1024, []),
    "las": (1024, []),
    "spz": (512, []),
    "mesh": (1024, [HERE / "corpus" / "mesh"]),
    "e57": (3072, []),
    "ptx": (512, [HERE.parent / "odd" / "files"]),
    "chunk": (256, []),
    "point_stream": (256, []),
    "unfilter": (256, []),
    "c_api": (8192, [VECTORS / "valid", VECTORS / "invalid"]),
    "damage": (64, []),
    "validator": (8192, [VECTORS / "valid", VECTORS / "invalid"]),
    "reader": (8192, [VECTORS / "valid", VECTORS / "invalid"]),
    "draw": (512, []),
    "materials": (1024, []),
}
SLICE_SECONDS = 300                                     # an interruption loses at most this

class Campaign:
    def __init__(self, build, goal):
        self.programs, self.folder, self.goal = build / "bin", build / "campaign", goal
        self.folder.mkdir(parents=True, exist_ok=True)
        self.path = self.folder / "state.json"
        self.state = json.loads(self.path.read_text()) if self.path.exists() else {}
        self.lock = threading.Lock()
        self.stopped = False

    def note(self, target, **more):
        with self.lock:
            entry = self.state.setdefault(target, {"executions": 0, "seconds": 0, "edges": 0, "inputs": 0})
            entry["executions"] += more.pop("executions", 0)
            entry["seconds"] += more.pop("seconds", 0)
            entry.update(more)
            temporary = self.path.with_suffix(".new")
            temporary.write_text(json.dumps(self.state, indent=1))
            temporary.replace(self.path)

    def findings(self, target):
        return sorted(path.name for path in self.folder.glob(f"{target}-*") if path.is_file())

    def seeds(self, target):
        own = HERE / "corpus" / target
        return [str(folder) for folder in [own, *TARGETS[target][1]] if folder.is_dir()]

    def run_slice(self, target, runs):
        """Runs the target once; returns whether to continue."""
        corpus = self.folder / target
        corpus.mkdir(exist_ok=True)
        command = [str(self.programs / f"{target}_fuzz"), f"-runs={runs}", f"-max_total_time={SLICE_SECONDS}",
                   f"-max_len={TARGETS[target][0]}", "-timeout=300", "-rss_limit_mb=3000", "-entropic=0", "-reload=0",
                   f"-artifact_prefix={self.folder}/{target}-", str(corpus), *self.seeds(target)]
        start = time.monotonic()
        ended = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace",
                               check=False)
        done = re.findall(r"^#(\d+)", ended.stderr, re.MULTILINE)
        edges = re.findall(r" cov: (\d+)", ended.stderr)
        self.note(target, executions=int(done[-1]) if done else 0, seconds=time.monotonic() - start,
                  edges=int(edges[-1]) if edges else 0, inputs=sum(1 for _ in corpus.iterdir()))
        if ended.returncode != 0:
            (self.folder / f"{target}.log").write_text(ended.stderr)
            print(f"{target}: exit code {ended.returncode}, see {self.folder / target}.log", flush=True)
        return ended.returncode == 0

    def run(self, target):
        while not self.stopped:
            left = self.goal - self.state.get(target, {}).get("executions", 0)
            if left <= 0 or not self.run_slice(target, left):
                return

    def table(self):
        print(f"{'target':<12}{'executions':>12}{'per second':>12}{'edges':>8}{'inputs':>8}  findings")
        for target in TARGETS:
            entry = self.state.get(target)
            if entry is None:
                print(f"{target:<12}{0:>12}")
                continue
            rate = entry["executions"] / max(entry["seconds"], 1)
            print(f"{target:<12}{entry['executions']:>12}{rate:>12.0f}{entry['edges']:>8}{entry['inputs']:>8}  "
                  f"{' '.join(self.findings(target)) or 'none'}")

def minimise(campaign, targets, folder):
    for target in targets:
        to = folder / target
        to.mkdir(parents=True, exist_ok=True)
        subprocess.run([str(campaign.programs / f"{target}_fuzz"), "-merge=1", f"-max_len={TARGETS[target][0]}", str(to),
                        *campaign.seeds(target), str(campaign.folder / target)], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        print(f"{target}: {sum(1 for _ in to.iterdir())} inputs")

def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=Path, help="build folder of the preset fuzz")
    parser.add_argument("targets", nargs="*", help="names; all without")
    parser.add_argument("--goal", type=int, default=10_000_000, help="executions of each target")
    parser.add_argument("--jobs", type=int, default=2, help="targets at a time")
    parser.add_argument("--report", action="store_true", help="print the table and run nothing")
    parser.add_argument("--minimise", type=Path, metavar="DIR", help="write small corpora and run nothing")
    arguments = parser.parse_args()
    targets = arguments.targets or list(TARGETS)
    unknown = [target for target in targets if target not in TARGETS]
    if unknown:
        parser.error(f"no target {unknown[0]}; there are {', '.join(TARGETS)}")
    campaign = Campaign(arguments.build.resolve(), arguments.goal)
    if arguments.minimise:
        return minimise(campaign, targets, arguments.minimise)
    if not arguments.report:
        with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
            try:
                list(pool.map(campaign.run, targets))
            except KeyboardInterrupt:
                campaign.stopped = True                 # the targets end together with this program
    campaign.table()
    return 1 if any(campaign.findings(target) for target in targets) else 0

if __name__ == "__main__":
    sys.exit(main())

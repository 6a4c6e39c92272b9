#!/usr/bin/env python3
"""Programs of another machine read, build and draw what those of this machine do, to the byte and the pixel:
compare_machines.py PROGRAMS OTHER_PROGRAMS SOURCE_FOLDER WORK_FOLDER [--scans FOLDER] [--count N] -- EMULATOR...

  PROGRAMS        folder of this machine's programs; OTHER_PROGRAMS: of the other's, which EMULATOR... runs
  --scans FOLDER  real scans, else found as scan_folder.py says; without any, only files of the format are compared
  --count N       how many scans (default 30), as many of each kind as there are

Compares the verdicts on all test vectors, pictures of the golden files, models of scans, and pictures of these models.
"""
import argparse
import concurrent.futures
import filecmp
import os
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from scan_folder import find_inputs, find_scans  # noqa: E402

KINDS = ("ply", "obj", "stl", "off", "gltf", "glb", "e57", "ptx", "las", "laz", "spz", "pcd", "xyz", "pts", "csv")
SIZES = range(2_000, 600_000)  # an emulator is ten to twenty times as slow
SCENES = ([], ["--lights", "studio", "--shadows", "--ground", "wood"],
          ["--texture", "marble", "--panorama", "default", "--panorama-width", "256"])
PICTURES = ("fast", "fine")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("programs", "other_programs", "source", "work"):
        parser.add_argument(name, type=lambda path: pathlib.Path(path).resolve())
    parser.add_argument("--scans", default="")
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("emulator", nargs="+")
    return parser.parse_args()


class Machines:
    def __init__(self, given):
        self.folders, self.emulator, self.work = (given.programs, given.other_programs), given.emulator, given.work

    def run(self, machine, program, *words):
        prefix = self.emulator if machine else []
        return subprocess.run([*prefix, str(self.folders[machine] / program), *map(str, words)], capture_output=True,
                              text=True, errors="replace", timeout=3600)

    def verdicts(self, files):
        """Differences of what pbm-validate says of each file."""
        both = [self.run(machine, "pbm-validate", "--json", *files) for machine in (0, 1)]
        if both[0].stdout == both[1].stdout and both[0].returncode == both[1].returncode:
            return []
        lines = [run.stdout.splitlines() for run in both]
        return [f"verdicts: {a!r}, {b!r}" for a, b in zip(*lines) if a != b] or [f"verdicts: {both[1].stderr}"]

    def pictures(self, model, name):
        """Names of pictures of a model that differ."""
        wrong = []
        for quality in PICTURES:
            drawn = [self.work / f"{name}.{quality}.{machine}.bmp" for machine in (0, 1)]
            for machine, picture in enumerate(drawn):
                run = self.run(machine, "pbm-render", "-q", "--quality", quality, "--resolution", "320,240", "-o", picture, model)
                if run.returncode != 0:
                    return [f"{name}: pbm-render {machine}: {run.returncode}: {run.stderr}"]
            if not filecmp.cmp(*drawn, shallow=False):
                wrong.append(f"{name}: the {quality} picture differs")
        return wrong

    def scan(self, number, scan):
        """What differs of a scan; None: it is refused."""
        name = f"{number:02}-{scan.name}"
        models = [self.work / f"{name}.{machine}.pbvg" for machine in (0, 1)]
        runs = [self.run(machine, "pbm-build", "-q", *SCENES[number % len(SCENES)], "-o", model, "--", scan)
                for machine, model in enumerate(models)]
        if runs[0].returncode != runs[1].returncode or runs[0].stderr != runs[1].stderr:
            return [f"{name}: pbm-build: {runs[0].returncode} {runs[0].stderr}, {runs[1].returncode} {runs[1].stderr}"]
        if runs[0].returncode != 0:
            return None
        if not filecmp.cmp(*models, shallow=False):
            return [f"{name}: the models differ"]
        return self.pictures(models[0], name)


def choose(folders):
    """Scans of all kinds, one of each in turn, the largest first."""
    files = dict.fromkeys(file for folder in folders for file in sorted(folder.rglob("*")) if file.is_file() and
                          file.stat().st_size in SIZES)
    by_kind = [sorted((file for file in files if file.suffix.lower() == "." + kind), key=lambda file: -file.stat().st_size)
               for kind in KINDS]
    for rank in range(max(map(len, by_kind), default=0)):
        yield from (kind[rank] for kind in by_kind if rank < len(kind))


def main():
    given = arguments()
    given.work.mkdir(parents=True, exist_ok=True)
    machines = Machines(given)
    files = sorted((given.source / "format_spec").rglob("*.pbvg"))
    wrong = machines.verdicts(files)
    golden = sorted((given.source / "format_spec" / "golden").rglob("*.pbvg"))
    unpacked = given.work / "scans"
    folders = [find_scans(unpacked, given.source, given.scans),
               find_inputs(unpacked.with_name("scans_inputs"), given.source, given.scans)]
    folders = list(dict.fromkeys(folder for folder in folders if folder))
    compared = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for found in pool.map(lambda model: machines.pictures(model, model.parent.name + "-" + model.stem), golden):
            wrong += found
        print(f"{len(files)} files validated, {len(golden)} golden files drawn: {len(wrong)} differ", flush=True)
        waiting = enumerate(choose(folders))
        while compared < given.count:
            some = [scan for _, scan in zip(range(given.count - compared), waiting)]
            if not some:
                break
            for (number, scan), found in zip(some, pool.map(lambda one: machines.scan(*one), some)):
                state = "refused by both" if found is None else "; ".join(found) or "the same"
                print(f"{number:02} {scan.name} ({scan.stat().st_size} bytes): {state}", flush=True)
                compared += found is not None
                wrong += found or []
    print(f"{compared} scans built and drawn; differences in all: {len(wrong)}")
    print("\n".join(wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

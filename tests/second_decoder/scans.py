"""Scans with every feature of the format, as the builder makes them: scans.py PBM_SAMPLE PBM_BUILD PBM_VALIDATE FOLDER

The second decoder must accept each, packed and mapped, and agree with the library about changed copies of the small ones.
"""

import subprocess
import sys
from pathlib import Path

import compare

# Depth, options
MODELS = (
    (7, ()),
    (7, ("--colour", "565", "--lights", "two", "--shadows")),
    (6, ("--texture", "wood", "--ground", "marble", "--ground-resolution", "64", "--lights", "stage", "--shadows",
               "--shadow-bits", "4", "--name", "Ammonit \u2014 \U0001f41a", "--panorama", "default", "--panorama-width", "256")),
    (6, ("--ignore-point-colours", "--material", "mirror", "--environment", "0.5", "--ground", "plain", "--up", "z")),
    (5, ("--material", "gold", "--lights", "studio", "--shadows", "--shadow-bits", "8", "--ground", "wood",
               "--ground-resolution", "64", "--compression-level", "19")),
)

def run(*command):
    subprocess.run([str(part) for part in command], check=True, capture_output=True)

def build_all(sample, build, folder):
    """All models in both ways of storing."""
    models, scan = [], folder / "scan.ply"
    run(sample, "-q", "--vertices", 10000, "-o", scan)
    for number, (depth, options) in enumerate(MODELS):
        for store in ("packed", "mapped"):
            model = folder / f"{number}-{store}.pbvg"
            run(build, "-q", scan, "--depth", depth, "--store", store, "-o", model, *options)
            models.append(model)
    return models

def main(sample, build, validate, folder):
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    models = build_all(sample, build, folder)
    invalid = [f"{path}: {verdict}" for path in models if (verdict := compare.decoders_verdict(path.read_bytes()))]
    print("\n".join(invalid), end="\n" if invalid else "")
    wrong = compare.compare_files(validate, models)
    small = [path for path in models if path.stat().st_size < 60000]
    return 1 if compare.compare_mutants(validate, folder / "changed", 40, 1, small) or invalid or wrong else 0

if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]) if len(sys.argv) == 5 else __doc__)

"""Where the real scans are that tests may read."""

import fcntl
import os
import pathlib
import shutil
import subprocess


def find_scans(unpacked, source, given):
    """`given` (or the environment's PBM_SCANS_DIR) is a folder of scans. Without it, ../shared/data beside the checkout
    `source` is unpacked into `unpacked`, once for all tests, if it is there; else None."""
    given = os.environ.get("PBM_SCANS_DIR") or given
    if given:
        if not pathlib.Path(given).is_dir():
            raise SystemExit(f"PBM_SCANS_DIR is no folder: {given}")
        return pathlib.Path(given)
    archive = source.parent / "shared" / "data" / "unpack.sh"
    return unpack(archive, ["bash", archive, unpacked], unpacked)


def find_inputs(unpacked, source, given):
    """The same of scans in other formats: the folder `inputs` of the scans, or ../shared/data/inputs."""
    given = os.environ.get("PBM_SCANS_DIR") or given
    if given:
        folder = pathlib.Path(given) / "inputs"
        return folder if folder.is_dir() else None
    archive = source.parent / "shared" / "data" / "inputs" / "inputs.tar.zst"
    return unpack(archive, ["tar", "-C", unpacked, "--zstd", "-xf", archive], unpacked)


def unpack(archive, command, unpacked):
    if not archive.exists() or not shutil.which("zstd"):
        return None
    unpacked.mkdir(parents=True, exist_ok=True)
    with open(unpacked.with_suffix(".lock"), "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (unpacked / "complete").exists():
            subprocess.run(command, check=True)
            (unpacked / "complete").touch()
    return unpacked

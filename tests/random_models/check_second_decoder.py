"""Shows random valid files to the second decoder: check_second_decoder.py RANDOM_MODELS DECODER_FOLDER COUNT [FIRST]

Every file must decode. Exit code 0: all did, 1: some did not, 77: Python packages are missing.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

def main(program, decoder, count, first="0"):
    sys.path.insert(0, decoder)
    try:
        import bvg
    except ModuleNotFoundError as missing:
        print(f"skipped: the Python package {missing.name} is missing (python3-zstandard, python3-xxhash)")
        return 77
    refused = decoded = 0
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([program, count, first, "--save", folder], check=True)
        for path in sorted(Path(folder).glob("*.pbvg"), key=lambda path: int(path.stem)):
            try:
                bvg.read(path.read_bytes())
                decoded += 1
            except Exception as error:              # whatever it is, the file is valid
                print(f"file {path.stem}: {type(error).__name__}: {error}")
                refused += 1
    print(f"{decoded} decoded, {refused} refused")
    return 1 if refused or decoded != int(count) else 0

if __name__ == "__main__":
    if len(sys.argv) not in (4, 5):
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))

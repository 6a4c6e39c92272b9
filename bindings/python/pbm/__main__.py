"""python -m pbm PROGRAM ARGUMENTS: runs pbm-build, pbm-render, pbm-validate, pbm-info or pbm-export."""

from __future__ import annotations

import sys

from . import programs, version


def main() -> None:
    words = sys.argv[1:]
    usage = f"usage: python -m pbm {'|'.join(programs.NAMES)} ARGUMENTS"
    if words == ["--version"]:
        print(version())
    elif words in (["--help"], ["-h"]):
        print(usage)
    elif words and words[0] in programs.NAMES:
        programs.run(words[0], words[1:])
    else:
        print(usage, file=sys.stderr)
        sys.exit(1)


if __name__ == "__main__":
    main()

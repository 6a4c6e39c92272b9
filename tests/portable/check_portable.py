#!/usr/bin/env python3
"""A program that links pbm_render alone has no symbol of zstd's compressor, of files or of processes, and draws:
check_portable.py PROGRAM MODEL
"""
import re
import subprocess
import sys

FORBIDDEN = [re.compile(pattern) for pattern in (
    r"ZSTD_(compress|CCtx|create(CCtx|CStream|CDict)|free(CCtx|CStream|CDict)).*",
    r"(open|openat|creat|mmap|munmap|stat|fstat|rename|unlink|pipe2?|v?fork|exec[vl]\w*|posix_spawn\w*|waitpid|kill)(64)?",
    r".*\bpbm::(MappedFile|FileReplacement|FileDescriptor|ChildProcess|encode_model|write_model)\b.*",
)]
NEEDED = ("ZSTD_decompress", "pbm::StreamedModel::", "pbm::FastRenderer::", "pbm::FineRenderer::", "pbm::ReferenceRenderer::",
          "pbm::TableRenderer::")


def is_forbidden(symbol):
    return any(pattern.fullmatch(symbol) for pattern in FORBIDDEN)


def main():
    program, model = sys.argv[1:]
    lines = subprocess.run(["nm", "--demangle", program], check=True, capture_output=True, text=True).stdout.splitlines()
    symbols = [re.sub(r"^[0-9a-f]* *[A-Za-z] ", "", line).split("@")[0] for line in lines]
    wrong = [f"has {symbol}" for symbol in symbols if is_forbidden(symbol)]
    wrong += [f"lacks {name}" for name in NEEDED if not any(name in symbol for symbol in symbols)]
    wrong += [f"accepts {symbol}" for symbol in ("ZSTD_compressCCtx", "open64", "pbm::MappedFile::open(x)") if
              not is_forbidden(symbol)]
    with open(model, "rb") as file:
        drawn = subprocess.run([program], stdin=file, capture_output=True, text=True)
    if drawn.returncode != 0:
        wrong.append(f"ended with {drawn.returncode}: {drawn.stdout}{drawn.stderr}")
    print("\n".join(wrong + [f"{len(symbols)} symbols, {len(wrong)} wrong"]))
    return 1 if wrong else 0


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    sys.exit(main())

#!/usr/bin/env python3
"""How fast points of a model get into numpy arrays, and how long `import pbm` takes: numpy_points.py MODEL.pbvg

Medians of 15, M points of the finest level per second; import: milliseconds beyond that of numpy. PYTHONPATH and
PBM_LIBRARY name the package and the library, unless the wheel is installed.
"""

import statistics
import subprocess
import sys
import time

RUNS = 15


def median_time(work):
    work()
    times = []
    for _ in range(RUNS):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def import_time(modules):
    program = f"import time; start = time.perf_counter(); import {modules}; print(time.perf_counter() - start)"
    return statistics.median(float(subprocess.run([sys.executable, "-c", program], capture_output=True, text=True,
                                                  check=True).stdout) for _ in range(RUNS))


def main():
    alone = import_time("numpy")
    both = import_time("numpy, pbm; pbm.version()")  # loads the library, too
    print(f"import pbm: {1000 * (import_time('numpy, pbm') - alone):.1f} ms, with the library {1000 * (both - alone):.1f} ms")
    import numpy as np
    import pbm
    with pbm.open(sys.argv[1]) as model:
        print(f"{model.info.points / 1e6:.2f} M points, {model.info.file_bytes / 1e6:.1f} MB")
        print("| arrays | threads | new arrays | arrays of before |")
        print("|---|---|---|---|")
        for name, options in (("positions, float32", {"attributes": ["positions"], "dtype": np.float32}),
                              ("positions, float64", {"attributes": ["positions"]}),
                              ("all, positions float32", {"dtype": np.float32}), ("all, positions float64", {})):
            for threads in (1, 2):
                kept = model.points(threads=threads, **options)
                fresh = median_time(lambda: model.points(threads=threads, **options))
                again = median_time(lambda: model.points(threads=threads, out=kept, **options))
                rates = [model.info.points / 1e6 / seconds for seconds in (fresh, again)]
                print(f"| {name} | {threads} | {rates[0]:.0f} | {rates[1]:.0f} |")


if __name__ == "__main__":
    main()

#!/usr/bin/env bash
# Makes the npm package of the viewer: make_web_package.sh [BUILD_FOLDER [OUTPUT_FOLDER]], by default build/web and
# BUILD_FOLDER. The flat folder OUTPUT_FOLDER/package holds WebAssembly, modules, viewer and validator's page, and is
# what a static server needs; OUTPUT_FOLDER/pbm-viewer-VERSION.tgz is the same for npm. It needs no network.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
build=$(realpath -m "${1:-build/web}")
output=$(realpath -m "${2:-$build}")
web=bindings/web
package=$output/package

[ -e "$build/package/pbm.wasm" ] || {
    echo "make_web_package: $build/package/pbm.wasm is not built: cmake --preset web && cmake --build --preset web" >&2
    exit 1
}
mkdir -p "$package"
find "$package" -maxdepth 1 -type f ! -name 'pbm_*' ! -name '*.wasm' -delete # what an earlier version put there
[ "$build/package" -ef "$package" ] || cp "$build"/package/pbm* "$package"
rm -f "$package/pbm_wasm.js"
cp "$web"/module/*.d.ts "$web"/viewer/*.d.ts "$web"/validator/*.{html,css} "$web"/page/icon.svg "$web/package.json" \
    "$web/README.md" LICENSE "$package"
# One file each for page, worker and library: a module that imports modules costs a slow line one round trip more for
# each level of them.
bundle() {
    esbuild --log-level=warning --bundle --minify --format=esm --target=es2022 --legal-comments=none \
        --alias:pbm_wasm.js="$build/bin/pbm_wasm.js" --define:CODE_BYTES="$(stat -c %s "$package/pbm.wasm")" \
        --outdir="$package" --entry-names=[name] "$@"
}
bundle "$web"/viewer/{pbm-viewer,view_worker}.js "$web"/module/pbm.js "$web"/validator/{validator,validator_worker}.js
bundle --platform=node "$web"/module/pbm.node.js
# What these import at run time lies in the package: bundlers of pages leave it alone. esbuild drops such comments.
sed -i 's#\bimport(#import(/* webpackIgnore: true */ /* @vite-ignore */ #g' \
    "$package"/{pbm,pbm.node,view_worker,validator_worker,pbm_threads,pbm_threads.worker}.js

# The page that the validator's findings link to.
python3 - docs/reference/validator-codes.md "$package/validator-codes.html" <<'PYTHON'
import html, pathlib, re, sys

source, target = map(pathlib.Path, sys.argv[1:])
rows = [[html.escape(cell.strip()) for cell in line.strip("|").split("|")]
        for line in source.read_text().splitlines() if re.match(r"\| `", line)]
body = "".join(f"<tr id={row[0].strip('`')}>" + "".join(f"<td>{cell.strip('`')}" for cell in row) for row in rows)
heads = "".join(f"<th>{name}" for name in ("code", "severity", "exit", "rules", "meaning", "what to do"))
target.write_text(f"<!doctype html><html lang=en><meta charset=utf-8><title>Codes of the validator</title>"
                  f"<link rel=stylesheet href=validator.css><main><h1>Codes of the validator</h1>"
                  f"<table><tr>{heads}{body}</table></main>\n")
PYTHON
# What `pbm-render --page` copies, with the sizes of its report.
cp "$web"/page/page.{html,css} "$package"
(
    cd "$package"
    for file in pbm-viewer.js view_worker.js pbm.wasm icon.svg pbm_threads*; do
        use=
        [[ $file != pbm_threads* ]] || use=" isolated"
        echo "$file $(gzip -9c "$file" | wc -c)$use"
    done
) >"$package/page_files.txt"

cd "$package"
archive=$(npm pack --silent --pack-destination "$output")
echo "$output/$archive: $(stat -c %s "$output/$archive") bytes"

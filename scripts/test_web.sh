#!/usr/bin/env bash
# Sets up, builds and tests the web part: WebAssembly in node, beside the native programs, and pages in Chromium.
# scripts/test.sh does not need emscripten, which takes 800 MB.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

step() { printf '\n== %s (%d s so far)\n' "$1" "$SECONDS"; }

step packages
scripts/install_packages.sh web

step "native programs, to compare with"
cmake --preset release >/dev/null
cmake --build --preset release --target pbm-render pbm-validate pbm-build pbm-sample

step "WebAssembly"
cmake --preset web >/dev/null
cmake --build --preset web
scripts/make_web_package.sh

step "npm packages of the tests"
for folder in bindings/web bindings/web/tests/bundlers; do
    npm install --prefix $folder --no-package-lock --no-audit --no-fund
done

failed=()
for test in bindings/web/tests/{module,viewer,browser}.*.mjs; do
    step "$test"
    node --test --test-reporter=spec "$test" || failed+=("$test")
done

step size
for file in build/web/package/*.wasm; do
    printf '%-40s %8d bytes, %7d by gzip\n' "$file" "$(wc -c <"$file")" "$(gzip -9 -c "$file" | wc -c)"
done
if [ ${#failed[@]} -ne 0 ]; then
    printf 'FAILED: %s\n' "${failed[@]}"
    exit 1
fi
echo "all passed"

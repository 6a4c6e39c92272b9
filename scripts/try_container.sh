#!/usr/bin/env bash
# Builds packaging/container/Containerfile with buildah and prints by how much its image is larger than its base, a
# clean Debian 12 made by mmdebstrap: nothing comes from a registry of images. try_container.sh [FOLDER]
#   FOLDER  where images lie; default: a temporary folder, removed in the end
# Root only. Needs the set `packaging` of install_packages.sh and the network of apt. Ends with 77 where the set is
# missing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
for program in buildah mmdebstrap; do
    command -v $program >/dev/null || { echo "skipped: $program is not installed" && exit 77; }
done
[ "$(id -u)" -eq 0 ] || { echo "skipped: not root" && exit 77; }
work=${1:-$(mktemp -d)}
export BUILDAH_ISOLATION=chroot # no name spaces are needed
images() { buildah --root "$work/images" --runroot "$work/run" "$@"; }
clean() {
    images rm --all >/dev/null 2>&1 || true
    rm -rf "$work"
}
[ $# -eq 1 ] || trap clean EXIT

if ! images inspect --type image localhost/debian >/dev/null 2>&1; then
    container=$(images from scratch)
    mmdebstrap --quiet --variant=apt bookworm "$work/debian.tar"
    images add -q "$container" "$work/debian.tar" / >/dev/null
    images commit -q --rm "$container" localhost/debian >/dev/null
    rm "$work/debian.tar"
fi
images bud -q --build-arg BASE=localhost/debian -t localhost/pbm -f packaging/container/Containerfile . >/dev/null

container=$(images from localhost/pbm)
images run "$container" -- sh -ec 'cd /tmp
    pbm-sample -q --vertices 20000 -o sample.ply
    pbm-build -q sample.ply -o sample.pbvg
    pbm-validate sample.pbvg
    pbm-render -q sample.pbvg -o sample.png && test -s sample.png'
base=$(images from localhost/debian)
size() { du -sm "$(images mount "$1")" | cut -f1; }
growth=$(($(size "$container") - $(size "$base")))
echo "image: $growth MB above its base"
[ $growth -le 60 ] || { echo "FAILED: more than 60 MB" >&2 && exit 1; }

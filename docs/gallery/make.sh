#!/bin/sh
# Makes the pictures of gallery.md with the commands that stand there: make.sh BIN SCANS
# BIN: the folder of pbm-build and pbm-render; SCANS: the folder of the scans. Needs ImageMagick.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
scans=$(cd "$2" && pwd)
PATH=$(cd "$1" && pwd):$PATH
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
for scan in bunny.ply=bun_zipper.ply buddha.ply=happy_stand15_mesh_le.ply dragon.ply=dragon_vrip_res2.ply \
    armadillo.obj=armadillo43k.obj gargoyle.ply=gargo.ply guanyin.ply=Guanyin.ply \
    nefertiti.obj=nefertiti.obj studio.hdr=pano/studio_small_08_1k.hdr; do
    ln -s "$scans/${scan#*=}" "${scan%%=*}"
done
sed -n '/^```sh$/,/^```$/{/^```/d;p}' "$here/../gallery.md" | sh -eu
for first in *-1.png; do # NAME-0.png (if there), NAME-1.png, ... side by side
    name=${first%-1.png}
    convert "$name"-[0-9].png +append -quality 88 -sampling-factor 4:4:4 "$here/$name.jpg"
done

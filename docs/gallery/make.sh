#!/bin/sh
# Makes the pictures of gallery.md with the commands that stand there: make.sh BIN SCANS [NAME...]
# BIN: the folder of the programs; SCANS: the folder of the scans; NAME: a picture, by default all of them.
# Needs ImageMagick, and Xvfb for the picture of the window.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
export GALLERY="$here"
scans=$(cd "$2" && pwd)
PATH=$(cd "$1" && pwd):$PATH
shift 2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
for scan in bunny.ply=bun_zipper.ply buddha.ply=happy_stand15_mesh_le.ply dragon.ply=dragon_vrip_res2.ply \
    armadillo.obj=armadillo43k.obj gargoyle.ply=gargo.ply guanyin.ply=Guanyin.ply \
    nefertiti.obj=nefertiti.obj lion.ply=lion_takanawa_rgb_normals_le.ply churo.ply=churo_uav_thin.ply studio.hdr=pano/studio_small_08_1k.hdr \
    forest.laz=las/lidR-Megaplot.laz house.laz=las/lastools-house.laz city.glb=gltf/loadersgl-helsinki-points-meshopt.glb \
    room.ply=open3d_fragment_002.ply guitar.ply=splat/playcanvas-guitar.compressed.ply \
    cat.glb=textured/cat.glb plough=textured/plough pot=textured/pot; do
    ln -s "$scans/${scan#*=}" "${scan%%=*}"
done
# The block of commands under `](gallery/NAME.jpg)` goes into NAME.sh.
awk '/\]\(gallery\/.*\.jpg\)$/ { name = $0; sub(/.*\(gallery\//, "", name); sub(/\.jpg\)$/, "", name) }
    /^```$/ { inside = 0 } inside { print > name ".sh" } /^```sh$/ { inside = 1 }' "$here/../gallery.md"
[ $# -gt 0 ] || set -- $(basename -s .sh -- *.sh)
for name in "$@"; do
    sh -eu "$name.sh"
    # Cells stand side by side, the first of them numbered 0 or 1; eight cells are two rows of four.
    montage "$name"-[0-9].png -tile "$([ -e "$name-8.png" ] && echo 4x2 || echo x1)" -geometry +0+0 -quality 90 \
        "$here/$name.jpg"
done

#!/bin/sh
# Takes a picture of pbm-view on a display of its own, as soon as the view is as fine as it gets, or as pbm-view has
# printed $UNTIL; presses the keys $KEYS first: window.sh PICTURE WIDTHxHEIGHT OPTIONS...
# Needs Xvfb and ImageMagick, for keys xdotool, and pbm-view in PATH.
set -eu
picture=$1 size=$2
shift 2
log=$(mktemp)
pids=
trap 'kill $pids 2>/dev/null || true; rm -f "$log"' EXIT
export DISPLAY=:97 LIBGL_ALWAYS_SOFTWARE=1
Xvfb $DISPLAY -screen 0 "${size}x24" -nolisten tcp >/dev/null 2>&1 &
pids=$!
sleep 1
pbm-view -v --resolution "${size%x*},${size#*x}" "$@" >"$log" 2>&1 &
pids="$! $pids"
until grep -q "${UNTIL:-8 of 8 samples}" "$log"; do sleep 1; done
if [ -n "${KEYS:-}" ]; then
    sleep 1
    xdotool search --sync --class pbm-view windowfocus --sync
    for key in $KEYS; do xdotool key "$key"; done
    sleep 1
fi
import -window root "$picture"

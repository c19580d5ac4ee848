#!/bin/sh
# From a USD stage to rendered frames, on a machine that has cargo and python3 and nothing else:
# builds the programs and carries out pipelines/lantern_street.xml: exports the example stage, builds its light
# tree, renders its frames to out/ and makes a contact sheet. Each step skips what is up to date, so a second
# run redoes only what changed.
#
# RES, SPP and FRAMES override the size, the samples of a pixel and the frames. Arguments go to `candelabra run`.
set -eu
cd "$(dirname "$0")/.."
. scripts/environment.sh

cargo build --release --bins
environment scripts/requirements.txt
export CANDELABRA_BIN="$release"
"$release/candelabra" run pipelines/lantern_street.xml ${FRAMES:+--frames "$FRAMES"} "$@"

echo
echo "frames        out/lantern_street.####.exr (previews: .png beside them)"
echo "contact sheet out/contact_sheet.png"
echo "scene, tree   out/lantern_street.glb, out/lantern_street.ltree"

#!/bin/sh
# From a USD stage to rendered frames, on a machine that has cargo and python3 and nothing else:
# builds the programs, exports the example stage, builds its light tree, renders its frames to out/
# and makes a contact sheet. Each step skips what is up to date, so a second run redoes only what
# changed.
#
# RES, SPP and FRAMES override the size, the samples of a pixel and the frames.
set -eu
cd "$(dirname "$0")/.."
. scripts/environment.sh

shot=lantern_street
cargo build --release --bins
environment scripts/requirements.txt

echo "== exporting scenes/$shot/$shot.usda"
"$python" scripts/usd_to_gltf.py "scenes/$shot/$shot.usda" "out/$shot.glb" --strict
echo "== building the light tree"
"$release/candelabra" build "out/$shot.glb" -o "out/$shot.ltree"
echo "== rendering"
"$release/candelabra-render" "out/$shot.glb" --tree "out/$shot.ltree" \
    --frames "${FRAMES:-1001-1024}" --res "${RES:-480x270}" --spp "${SPP:-8}" \
    --output "out/$shot.####.exr" --png --exposure 0 --resume
"$python" scripts/contact_sheet.py "out/$shot".[0-9]*.png --output out/contact_sheet.png

echo
echo "frames        out/$shot.1001.exr ... (previews: .png beside them)"
echo "contact sheet out/contact_sheet.png"
echo "scene, tree   out/$shot.glb, out/$shot.ltree"

#!/bin/sh
# Measures the extremes and rewrites docs/extremes.md.
set -eu
cd "$(dirname "$0")/.."
CANDELABRA_EXTREMES=1 cargo test --quiet --test light_tree the_page_of_extremes

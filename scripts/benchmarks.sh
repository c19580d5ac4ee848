#!/bin/sh
# Measures what the documentation claims and writes its tables: `benchmarks.sh [--quick] [--only NAME]...`. Names,
# and what is measured, are in scripts/benchmarks.py. Wants the machine for itself.
set -eu
cd "$(dirname "$0")/.."
exec python3 scripts/benchmarks.py "$@"

#!/bin/sh
# Every check: format, lints, documentation, the Rust tests, the exporter's tests, the farms (Slurm if it
# is installed), the pages in a browser (if there is a Chromium).
#
# Tests that read the scenes of other people look for them in ../shared, or where CANDELABRA_SHARED
# points, and are skipped if they are not there.
set -eu
cd "$(dirname "$0")/.."
. scripts/environment.sh

# Under nohup, and in the background of a script, a program is deaf to SIGHUP or SIGINT, which some tests send.
hearing() {
    "$python" -c 'import os, signal, sys
for number in (signal.SIGHUP, signal.SIGINT):
    signal.signal(number, signal.SIG_DFL)
os.execvp(sys.argv[1], sys.argv[1:])' "$@"
}

echo "== format"
cargo fmt --check
echo "== lints"
cargo clippy --quiet --all-targets -- -D warnings
echo "== documentation"
RUSTDOCFLAGS="-D warnings" cargo doc --quiet --no-deps --document-private-items
# Before the Rust tests: one of them exports a stage.
environment scripts/requirements.txt scripts/requirements-test.txt
echo "== tests"
hearing cargo test --quiet
echo "== exporter"
"$python" -m pytest --quiet tests/exporter
echo "== farms"
# RQD's own dependences are for desktops.
"$python" -m pip install --quiet --disable-pip-version-check --no-deps opencue_rqd==1.37.0
hearing "$python" -m pytest --quiet -rs tests/farm
echo "== pages"
"$python" -m pytest --quiet -rs tests/pages
echo "all checks pass"

#!/bin/sh
# The tests that take minutes each, which scripts/test.sh leaves out.
set -eu
cd "$(dirname "$0")/.."
cargo test --no-fail-fast --test cli --test render -- --ignored

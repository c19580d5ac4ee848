#!/bin/sh
# Publishes files: `publish.sh FILE ...` copies each to out/published/, or where PUBLISHED points. A copy gets
# its name when it is whole, so whoever has the old file open or mapped keeps reading the old one.
set -eu
folder=${PUBLISHED:-out/published}
mkdir -p "$folder"
for file in "$@"; do
    part=$(mktemp "$folder/.publish-XXXXXX.part")
    trap 'rm -f "$part"' EXIT
    cp "$file" "$part"
    chmod "$(printf %o $((0666 & ~0$(umask))))" "$part"
    mv -f "$part" "$folder/$(basename "$file")"
    echo "$folder/$(basename "$file")"
done

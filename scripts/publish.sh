#!/bin/sh
# Publishes files: `publish.sh FILE ...` copies each to out/published/, or where PUBLISHED points. A copy gets
# its name when it is whole and on the disk, so whoever has the old file open or mapped keeps reading the old one.
set -eu
folder=${PUBLISHED:-out/published}
part=
trap 'rm -f "$part"' EXIT
trap 'exit 129' HUP
trap 'exit 130' INT
trap 'exit 143' TERM
mkdir -p "$folder"
for file in "$@"; do
    # Our programs remove files of such names in a folder that they write to, unless they are locked.
    part=$(mktemp "$folder/.candelabra-XXXXXX.part")
    exec 9>"$part"
    # Where there are no locks, nobody else takes the file for left over within a day.
    flock 9 2>/dev/null || :
    cp "$file" "$part"
    chmod "$(printf %o $((0666 & ~0$(umask))))" "$part"
    sync "$part"
    mv -f "$part" "$folder/$(basename "$file")"
    part=
    echo "$folder/$(basename "$file")"
done

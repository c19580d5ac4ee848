#!/bin/sh
# Compares a file with the version of it that was published last, if one was: `diff_published.sh FILE`. The page is
# written beside it. That they differ is no failure.
set -eu
file=$1
published=${PUBLISHED:-out/published}/$(basename "$file")
if [ ! -e "$published" ]; then
    echo "$published: nothing is published yet; scripts/publish.sh $file publishes"
    exit 0
fi
code=0
"${CANDELABRA_BIN:-target/release}/candelabra" diff "$published" "$file" --html "${file%.*}.diff.html" || code=$?
[ $code -le 1 ]

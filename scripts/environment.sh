# Sourced by the other scripts: a Python environment of the project's own, made once and renewed
# when its requirements change. Sets `python` and `release`.
release=${CARGO_TARGET_DIR:-target}/release
python=.venv/bin/python

# environment REQUIREMENTS...: installs the packages that these files pin.
environment() {
    stamp=$(cat "$@" | cksum)
    name=.venv/$(echo "$*" | tr -c 'a-z-\n' '-').stamp
    if ! "$python" -m pip --version >/dev/null 2>&1; then
        echo "== making a Python environment in .venv"
        rm -rf .venv
        python3 -m venv .venv || {
            rm -rf .venv
            echo "python3 cannot make a virtual environment; on Debian install python3-venv" >&2
            exit 1
        }
    fi
    if [ "$(cat "$name" 2>/dev/null)" != "$stamp" ]; then
        echo "== installing $*"
        for file in "$@"; do
            "$python" -m pip install --quiet --disable-pip-version-check --requirement "$file"
        done
        echo "$stamp" >"$name"
    fi
}

#!/usr/bin/env bash
# Baked light in three.js, as its own GLTFLoader and a browser show it. Installs Node and Chromium where they are missing
# (Debian's packages), and what package-lock.json names.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

missing=()
command -v node >/dev/null && command -v npm >/dev/null || missing+=(nodejs npm)
command -v chromium >/dev/null || [ -n "${CHROMIUM:-}" ] || missing+=(chromium)
if [ ${#missing[@]} -gt 0 ]; then
    echo "three: installing ${missing[*]}"
    sudo=""
    [ "$(id -u)" = 0 ] || sudo=sudo
    $sudo apt-get update -q
    DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -q --no-install-recommends "${missing[@]}"
fi

npm ci --no-audit --no-fund --loglevel=error
npm run --silent lint

# The command, where nobody has named one.
if [ -z "${TWINRAY:-}" ]; then
    root=$(cd ../.. && pwd)
    target=$(cd "$root" && cargo metadata --format-version 1 --no-deps | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')
    (cd "$root" && cargo build --quiet --release --package twinray-cli)
    export TWINRAY="$target/release/twinray"
fi
npm run --silent test

#!/usr/bin/env bash
# Baked light in Bevy: bakes scenes, takes their pictures with a Vulkan driver in software, and compares them with twinray's.
# Installs Mesa's driver where it is missing (Debian's packages), and by rustup the compiler that rust-toolchain.toml names.
# Where one of them cannot be had it says so, and what it skipped. TWINRAY names a twinray to take instead of building one.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
unset RUSTUP_TOOLCHAIN # of a cargo that may have called this
root=$(cd ../.. && pwd)

skip() {
    echo "bevy: SKIPPED: $1; not checked: $2"
    exit 0
}

software() {
    find /usr/share/vulkan/icd.d /etc/vulkan/icd.d -name 'lvp_icd*.json' 2>/dev/null | head -n 1
}

want=$(sed -n 's/^rust-version = "\([^"]*\)".*/\1/p' Cargo.toml)
have=$(rustc --version 2>/dev/null | cut -d ' ' -f 2 || true)
if [ -z "$have" ] || [ "$(printf '%s\n' "$want" "$have" | sort -V | head -n 1)" != "$want" ]; then
    skip "Bevy wants Rust $want, here is ${have:-none}" "everything"
fi
# Pictures need no window, and neither do the libraries of one.
cargo test --quiet --release --locked --no-default-features

if [ -z "$(software)" ] && command -v apt-get >/dev/null; then
    echo "bevy: installing mesa-vulkan-drivers"
    sudo=""
    [ "$(id -u)" = 0 ] || sudo=sudo
    $sudo apt-get update -q || true
    DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -q --no-install-recommends mesa-vulkan-drivers libvulkan1 || true
fi
driver=$(software)
[ -n "$driver" ] || skip "there is no Vulkan driver in software (lavapipe, of mesa-vulkan-drivers)" "pictures"
export VK_DRIVER_FILES=$driver VK_ICD_FILENAMES=$driver WGPU_BACKEND=vulkan

if [ -z "${TWINRAY:-}" ]; then
    target=$(cd "$root" && cargo metadata --format-version 1 --no-deps | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')
    (cd "$root" && cargo build --quiet --release --package twinray-cli)
    export TWINRAY=$target/release/twinray
fi
# One after the other: the driver takes all cores.
cargo test --quiet --release --locked --no-default-features --test picture -- --ignored --nocapture --test-threads 1

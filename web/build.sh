#!/usr/bin/env bash
# Builds the page, one file that needs nothing else: target/page/index.html. PROFILE names another profile than release.
set -euo pipefail
cd "$(dirname "$0")"
profile=${PROFILE:-release}
target=wasm32-unknown-unknown

[ -d "$(rustc --print sysroot)/lib/rustlib/$target" ] || {
    echo "the page needs the standard library of $target: rustup target add $target" >&2
    exit 1
}
cargo build --locked --profile "$profile" --target "$target" -p stretch-page
cargo run --locked --quiet -p stretch-pack -- "target/$target/$profile/stretch_page.wasm" site target/page

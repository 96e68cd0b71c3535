#!/usr/bin/env bash
# Builds the page as one self-contained file: target/page/index.html. PROFILE is another build profile than wasm.
set -euo pipefail
cd "$(dirname "$0")/.."
profile=${PROFILE:-wasm}
target=wasm32-unknown-unknown
built=${CARGO_TARGET_DIR:-target}

[ -d "$(rustc --print sysroot)/lib/rustlib/$target" ] || {
    echo "the page needs the standard library of $target: rustup target add $target" >&2
    exit 1
}
cargo build --locked --profile "$profile" --target "$target" -p stretch-page
cargo run --locked --quiet -p stretch-pack -- "$built/$target/$profile/stretch_page.wasm" web/site "$built/page"

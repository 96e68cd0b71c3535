#!/usr/bin/env bash
# What a release consists of, made on one Linux machine without root. Everything lands in target/dist.
#
#     release/build.sh                     all of it, one after the other
#     release/build.sh tools               cargo-zigbuild, zig and maturin into a virtual environment of its own, and the targets
#     release/build.sh page                the page that `stretch page` writes, which the programs carry
#     release/build.sh manual              man pages and what shells complete, which the archives hold
#     release/build.sh program TARGET...   an archive with one static program, the manual, the licences and the README
#     release/build.sh wheel TARGET...     a wheel for every Python from 3.10 on
#     release/build.sh sdist               the source distribution of the Python package
#     release/build.sh sums                SHA256SUMS of all that lies there
#
# zig links for other machines without their tools. STRETCH_VERSION names another version than the manifest's; JOBS, how many compilers at once.
set -euo pipefail
cd "$(dirname "$0")/.."

PROGRAMS="x86_64-unknown-linux-musl aarch64-unknown-linux-musl x86_64-pc-windows-gnu"
WHEELS="x86_64-unknown-linux-gnu aarch64-unknown-linux-gnu x86_64-unknown-linux-musl aarch64-unknown-linux-musl"
version=${STRETCH_VERSION:-$(awk -F '"' '/^version = / { print $2; exit }' Cargo.toml)}
dist=$PWD/target/dist
tools=$PWD/target/release-tools
export PATH=$tools/bin:$PATH
[ -z "${JOBS:-}" ] || export CARGO_BUILD_JOBS=$JOBS
# names in a stripped program help nobody, and are half of its size
export CARGO_PROFILE_RELEASE_STRIP=symbols

# Where something was built is nobody's business, and the same sources give the same bytes elsewhere: panics name a file as
# stretch/src/main.rs or as its crate.
remapped() {
    local cargo=${CARGO_HOME:-$HOME/.cargo} folder flags
    flags="--remap-path-prefix=$cargo=cargo"
    for folder in "$cargo"/registry/src/*; do
        [ ! -d "$folder" ] || flags+=" --remap-path-prefix=$folder=crates"
    done
    # the last one that fits is taken
    echo "$flags --remap-path-prefix=$(rustc --print sysroot)=rust --remap-path-prefix=$PWD=stretch"
}

tools() {
    [ -x "$tools/bin/maturin" ] || {
        python3 -m venv "$tools"
        "$tools/bin/pip" install --quiet --disable-pip-version-check 'cargo-zigbuild>=0.20' ziglang 'maturin>=1.9,<2'
    }
    # shellcheck disable=SC2046,SC2086
    rustup target add wasm32-unknown-unknown $(printf '%s\n' $PROGRAMS $WHEELS | sort -u)
    # before paths are remapped, so that every folder of sources exists
    cargo fetch --locked
}

page() { web/build.sh; }

manual() {
    rm -rf target/manual
    cargo run --quiet --release --locked -p stretch-cli --example manual -- target/manual
}

program() {
    local target name folder ending
    for target in "$@"; do
        name=stretch-$version-$target
        folder=target/dist-folders/$name
        STRETCH_PAGE=$PWD/target/page RUSTFLAGS=$(remapped) \
            cargo zigbuild --release --locked -p stretch-cli --features page --target "$target"
        ending=
        [[ $target != *-windows-* ]] || ending=.exe
        rm -rf "$folder" && mkdir -p "$folder" "$dist"
        cp "target/$target/release/stretch$ending" release/README.md CHANGELOG.md LICENSE-MIT LICENSE-APACHE "$folder"
        cp -r target/manual/man1 target/manual/completions "$folder"
        tar -C target/dist-folders --owner=0 --group=0 --numeric-owner --sort=name -czf "$dist/$name.tar.gz" "$name"
    done
}

wheel() {
    local target
    for target in "$@"; do
        (cd python && RUSTFLAGS=$(cd .. && remapped) \
            maturin build --release --zig --target "$target" --out "$dist")
    done
}

sdist() { (cd python && maturin sdist --out "$dist"); }

sums() { (cd "$dist" && rm -f SHA256SUMS && sha256sum -- * >../SHA256SUMS && mv ../SHA256SUMS . && cat SHA256SUMS); }

what=${1:-all}
[ $# = 0 ] || shift
case $what in
    all)
        # shellcheck disable=SC2086
        tools && page && manual && program $PROGRAMS && wheel $WHEELS && sdist && sums
        ;;
    tools | page | manual | program | wheel | sdist | sums) "$what" "$@" ;;
    *)
        echo "usage: release/build.sh [tools|page|manual|program TARGET...|wheel TARGET...|sdist|sums]" >&2
        exit 2
        ;;
esac

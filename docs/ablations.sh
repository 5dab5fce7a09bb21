#!/usr/bin/env bash
# The tables of docs/ablations.md: trains one scene with one option changed at a time.
# usage: docs/ablations.sh OUT [STEPS]      (OUT: folder for data and runs; a run of 600 steps takes about half a minute)
set -euo pipefail
cd "$(dirname "$0")/.."
OUT=$1 STEPS=${2:-600}
cargo build --release --quiet
BIN=target/release/refraxel
mkdir -p "$OUT"
scene() { [ -d "$OUT/$1" ] || $BIN synth "$1" --out "$OUT/$1" --size 100 --views 60 --spp 9 --detail-spp 0 --quiet; }
scene glass_ball
scene luneburg

value() { sed -n "s/^$2\"$3\": \([-0-9.]*\),\{0,1\}$/\1/p" "$1" | head -1; }
# row SCENE NAME OPTIONS…: one line of a table
row() {
    local data=$1 name=$2 run
    shift 2
    run="$OUT/runs/$data/$(tr -c 'a-zA-Z0-9.\n' '_' <<<"$name")"
    $BIN train "$OUT/$data" --out "$run" --set steps="$STEPS" --quiet --json "$@" >/dev/null
    local m="$run/eval/test/metrics.json"
    printf '| %s | %.2f | %.2f | %.3f | %.3f | `%s` |\n' "$name" "$(value "$m" '  ' psnr_inside)" \
        "$(value "$m" '  ' psnr_outside)" "$(value "$m" '    ' mean_inside)" "$(value "$m" '    ' mae_inside)" "${*:-}"
}
table() { printf '\n**%s**\n\n| | inside [dB] | outside [dB] | n inside | error of n | options |\n|---|---|---|---|---|---|\n' "$1"; }
set_() { for s in "$@"; do printf -- '--set\n%s\n' "$s"; done; }
with() { # SCENE NAME key=value…
    local data=$1 name=$2 options
    shift 2
    mapfile -t options < <(set_ "$@")
    row "$data" "$name" ${options[@]+"${options[@]}"}
}
SMOOTH=index_surface=smooth

table "Initialisation (glass ball)"
row glass_ball "straight rays" --refraction off
with glass_ball "hull, searched index, sharp (default)"
with glass_ball "hull, index 1.3 not searched" index_scan=off index_guess=1.3
with glass_ball "ball in the box, searched" index_shape=ball
with glass_ball "box, searched" index_shape=block
with glass_ball "hull, index grid coarse to fine" index_stages=2
with glass_ball "n = 1 everywhere" index_shape=uniform index_gate=off
row glass_ball "the truth" --index-from "$OUT/glass_ball/scene.json"
with glass_ball "bending late: straight for 40 % of the run" straight_share=0.4

table "Surface and what learns (glass ball)"
with glass_ball "sharp, shape and index fixed" rate_surface=0 rate_index=0
with glass_ball "sharp, only the index learns" rate_surface=0
with glass_ball "sharp, all paths count" surface_events=99
with glass_ball "sharp, no smoothing" surface_smooth=0
with glass_ball "smooth" $SMOOTH
with glass_ball "smooth, fixed" $SMOOTH rate_index=0

table "Smooth transition: interpolation, integrator, step, blur, gate (glass ball)"
with glass_ball "trilinear of differences" $SMOOTH index_interpolation=differences
with glass_ball "trilinear" $SMOOTH index_interpolation=trilinear
with glass_ball "explicit Euler" $SMOOTH index_stepping=euler
with glass_ball "step 1 voxel" $SMOOTH index_step=1
with glass_ball "step 1/4 voxel" $SMOOTH index_step=0.25
with glass_ball "no blur of the gradient" $SMOOTH index_blur=0
with glass_ball "blur 3 voxels" $SMOOTH index_blur=3
with glass_ball "no gate" $SMOOTH index_gate=off
with glass_ball "index free at the surface only" $SMOOTH index_interior=off

table "Regularisers of n (smooth glass ball)"
for penalty in l1 l2 huber; do
    for weight in 0.1 1 10; do
        with glass_ball "variation $penalty, weight $weight" $SMOOTH index_variation_penalty=$penalty index_variation=$weight
    done
done
with glass_ball "deviation from 1, l1, weight 0.1" $SMOOTH index_deviation=0.1
with glass_ball "deviation from 1, l1, weight 1" $SMOOTH index_deviation=1

table "A graded lens (Luneburg)"
row luneburg "straight rays" --refraction off
with luneburg "chosen by the program"
with luneburg "graded" index_surface=graded
with luneburg "graded, fixed" index_surface=graded rate_index=0
with luneburg "sharp" index_surface=sharp
with luneburg "smooth" $SMOOTH

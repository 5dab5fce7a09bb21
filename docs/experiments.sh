#!/usr/bin/env bash
# The tables of protocol A in docs/experiments.md: trains one scene with one option changed at a time.
# usage: docs/experiments.sh OUT [STEPS]      (OUT: folder for data and runs; a run of 600 steps takes about a quarter of a minute)
set -euo pipefail
cd "$(dirname "$0")/.."
OUT=$1 STEPS=${2:-600}
cargo build --release --quiet
BIN=target/release/refraxel
mkdir -p "$OUT"
scene() { [ -d "$OUT/$1" ] || $BIN synth "$1" --out "$OUT/$1" --size 100 --views 60 --spp 9 --detail-spp 0 --quiet >&2; }
scene glass_ball
scene luneburg
scene water_tank

value() { sed -n "s/^$2\"$3\": \([-0-9.]*\),\{0,1\}$/\1/p" "$1" | head -1; }
# row SCENE NAME OPTIONS…: one line of a table
row() {
    local data=$1 name=$2 run
    shift 2
    run="$OUT/runs/$data/$(tr -c 'a-zA-Z0-9.\n' '_' <<<"$name")"
    local m="$run/eval/test/metrics.json" # rows that are there already are not run again
    [ -f "$m" ] || $BIN train "$OUT/$data" --out "$run" --set run.steps="$STEPS" --set run.batch=2048 --set grid.max_resolution=72 \
        --quiet --json "$@" >/dev/null
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
SMOOTH=search.profile=smooth
truth() { row "$1" "${2:-the truth, held}" --index-from "$OUT/$1/scene.json"; }
from_truth() { row "$1" "$2" --index-from "$OUT/$1/scene.json" --set surface.rate=0.08 --set index.rate=0.001; }

table "Initialisation (glass ball)"
row glass_ball "straight rays" --refraction off
with glass_ball "hull, searched index, sharp (default)"
with glass_ball "hull, index 1.3 not searched" search.enabled=off search.guess=1.3
with glass_ball "ball in the box, searched" shape.start=ball
with glass_ball "box, searched" shape.start=block
with glass_ball "n = 1 everywhere" shape.start=uniform shape.gate=off
truth glass_ball
from_truth glass_ball "the truth as a start"
with glass_ball "bending early: after 50 steps" refraction.straight_steps=50

table "Surface and what learns (glass ball)"
with glass_ball "sharp, shape and index fixed" surface.rate=0 index.rate=0
with glass_ball "sharp, only the index learns" surface.rate=0
with glass_ball "sharp, all paths count" surface.events=99
with glass_ball "sharp, no smoothing" surface.smooth=0
with glass_ball "smooth" $SMOOTH
with glass_ball "smooth, fixed" $SMOOTH index.rate=0

table "Smooth transition: interpolation, integrator, step, blur, gate (glass ball)"
with glass_ball "trilinear of differences" $SMOOTH index.interpolation=differences
with glass_ball "trilinear" $SMOOTH index.interpolation=trilinear
with glass_ball "explicit Euler" $SMOOTH index.integrator=euler
with glass_ball "step 1 voxel" $SMOOTH index.step=1
with glass_ball "step 1/4 voxel" $SMOOTH index.step=0.25
with glass_ball "no blur of the gradient" $SMOOTH index.blur=0
with glass_ball "blur 3 voxels" $SMOOTH index.blur=3
with glass_ball "no gate" $SMOOTH shape.gate=off
with glass_ball "index free at the surface only" $SMOOTH shape.interior=off

table "Regularisers of n (smooth glass ball)"
for penalty in l1 l2 huber; do
    for weight in 1 10; do
        with glass_ball "variation $penalty, weight $weight" $SMOOTH index.variation_penalty=$penalty index.variation=$weight
    done
done
with glass_ball "deviation from 1, l1, weight 0.1" $SMOOTH index.deviation=0.1
with glass_ball "deviation from 1, l1, weight 1" $SMOOTH index.deviation=1

table "What depends on the view (glass ball)"
with glass_ball "learns from the start" field.view_warm_up=0
with glass_ball "its rate rises over 30 % of the run" field.view_warm_up=0.3
with glass_ball "its rate rises over the whole run (default)"
with glass_ball "never: degree 0" field.sh_degree=0

for name in glass_ball water_tank; do
    table "Rays inside masks ($name)"
    with $name "no more than pixels" refraction.mask_ray_fraction=0
    with $name "40 % at first, falling to none" refraction.mask_ray_decay=0
    with $name "40 % at first, falling to 20 % (default)"
    with $name "40 % at all times" refraction.mask_ray_decay=1
done

table "Reflection (glass ball)"
with glass_ball "none" reflection.enabled=off
with glass_ball "learned cache, degree 1" reflection.degree=1
with glass_ball "learned cache, degree 2" reflection.degree=2
with glass_ball "learned cache, degree 3 (default)"
with glass_ball "learned cache, 4 probes along the region" reflection.probes=4
with glass_ball "learned cache, 16 probes" reflection.probes=16
with glass_ball "baked cache" reflection.cache=baked
with glass_ball "second rays instead of a cache" reflection.cache=exact
with glass_ball "plain product of gradient and Fresnel" reflection.weight=gradient
with glass_ball "smooth transitions, none" $SMOOTH reflection.enabled=off
with glass_ball "smooth transitions, learned cache" $SMOOTH
with glass_ball "smooth transitions, plain product" $SMOOTH reflection.weight=gradient

scene prism
for name in water_tank prism; do
    table "Flat faces ($name)"
    row $name "straight rays" --refraction off
    with $name "planes learn (default)"
    with $name "the hull as it is, its nodes learn" shape.faces=off
    truth $name
    from_truth $name "the truth as a start, its nodes learn"
done

table "A graded lens (Luneburg)"
row luneburg "straight rays" --refraction off
with luneburg "chosen by the program"
with luneburg "graded" search.profile=graded
with luneburg "graded, fixed" search.profile=graded index.rate=0
with luneburg "sharp" search.profile=sharp
with luneburg "smooth" $SMOOTH

table "Seeds (glass ball)"
for seed in 1 2; do row glass_ball "seed $seed" --seed $seed; done

scene glass_blob
for name in glass_ball glass_blob; do
    table "Free surfaces ($name)"
    with $name "default"
    with $name "learn where they were found" surface.coarsening=1
    with $name "smoothing 0.03" surface.smooth=0.03
    with $name "smoothing 0.3" surface.smooth=0.3
    with $name "gradient blurred by 3 voxels" surface.blur=3
    with $name "twice the rate" surface.rate=0.16
    with $name "usual total variation of density" field.tv_density_refractive=1
done

for name in hidden_ball glass_blob hollow_ball; do
    scene $name
    table "$name"
    row $name "straight rays" --refraction off
    row $name "bent rays"
    truth $name "bent rays, the truth held"
done

scene glazed_vase
printf '\n**Coats of opaque things (glazed_vase)**\n\n| | PSNR [dB] | options |\n|---|---|---|\n'
for degree in 0 1 2; do
    for clearcoat in off on; do
        row glazed_vase "degree $degree, coat $clearcoat" --clearcoat $clearcoat --set field.sh_degree=$degree >/dev/null
        m="$OUT/runs/glazed_vase/degree_${degree}__coat_$clearcoat/eval/test/metrics.json"
        printf '| degree %s, coat %s | %.2f | `--clearcoat %s --set field.sh_degree=%s` |\n' $degree $clearcoat "$(value "$m" '  ' psnr)" $clearcoat $degree
    done
done

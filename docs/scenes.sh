#!/usr/bin/env bash
# Trains every refractive scene of `refraxel synth --list` three times with the same budget (straight rays, bent rays, the true
# index held) and writes a page with one row per scene.
#
# usage: docs/scenes.sh OUT [MINUTES | steps=N] [size=N] [views=N] [spp=N] [seed=N] [scenes=NAME,NAME…]
#   OUT      folder for data (OUT/SCENE), runs (OUT/runs/SCENE/straight, bent, truth) and the page (OUT/scenes.md)
#   MINUTES  wall-clock time of each run [2]; steps=N gives each run N steps instead, which any machine can repeat
#   size, views   edge of the pictures [200 pixels] and number of training views [100]
#   spp      samples per pixel of the pictures [4]: more takes many minutes per scene where bodies lie in bodies
#   seed     of the training runs [0]; the data always have seed 0
#   scenes   only these
# A second call with the same arguments keeps runs that have scores and starts all others anew. REFRAXEL names a program to
# use instead of building one.
set -euo pipefail

fail() { printf 'scenes.sh: %s\n' "$1" >&2; exit 2; }
number() { # NAME VALUE
    case $2 in '' | *[!0-9]*) fail "$1 is '$2', expected a whole number" ;; esac
}

[ $# -ge 1 ] || fail "usage: docs/scenes.sh OUT [MINUTES | steps=N] [size=N] [views=N] [spp=N] [seed=N] [scenes=NAME,NAME…]"
OUT=$1 SIZE=200 VIEWS=100 SPP=4 SEED=0 ONLY=
BUDGET=(--minutes 2)
shift
for word in "$@"; do
    value=${word#*=}
    case $word in
        steps=*) number steps "$value" && BUDGET=(--set "run.steps=$value") ;;
        size=*) number size "$value" && SIZE=$value ;;
        views=*) number views "$value" && VIEWS=$value ;;
        spp=*) number spp "$value" && SPP=$value ;;
        seed=*) number seed "$value" && SEED=$value ;;
        scenes=*) ONLY=${value//,/ } ;;
        [0-9]*) BUDGET=(--minutes "$word") ;;
        *) fail "unknown argument '$word'; expected MINUTES, steps=N, size=N, views=N, spp=N, seed=N or scenes=NAME,NAME…" ;;
    esac
done

mkdir -p "$OUT"
OUT=$(cd "$OUT" && pwd)
if [ -n "${REFRAXEL:-}" ]; then
    BIN=$(cd "$(dirname "$REFRAXEL")" && pwd)/$(basename "$REFRAXEL")
    cd "$(dirname "$0")/.."
else
    cd "$(dirname "$0")/.."
    cargo build --release --quiet
    BIN=${CARGO_TARGET_DIR:-target}/release/refraxel
fi
ERRORS=$OUT/errors.log
: >"$ERRORS"

# The scenes, without those in which nothing refracts: they have no masks and no index.
refractive() { "$BIN" synth --list | awk 'NR > 1 && !/nothing refracts|room \(/ { print $1 }'; }
ALL=$(refractive)
SCENES=${ONLY:-$ALL}
for name in $SCENES; do
    grep -qx -- "$name" <<<"$ALL" || fail "there is no refractive scene '$name'; choose among: $(echo $ALL)"
done

# Runs of different budgets do not belong in one table.
BUDGET_TEXT="${BUDGET[*]} --seed $SEED, pictures of $SIZE pixels, $VIEWS training views, $SPP samples per pixel"
if [ -f "$OUT/budget.txt" ] && [ "$(cat "$OUT/budget.txt")" != "$BUDGET_TEXT" ]; then
    fail "$OUT holds runs with '$(cat "$OUT/budget.txt")', expected '$BUDGET_TEXT'; choose another folder"
fi
printf '%s\n' "$BUDGET_TEXT" >"$OUT/budget.txt"

SYNTH=(--size "$SIZE" --views "$VIEWS" --spp "$SPP" --detail-spp 0 --quiet)
# guarded NAME COMMAND…: a failure is noted and leaves dashes in the table. Ctrl-C or a signal ends the command and the script.
CHILD=
trap '[ -z "$CHILD" ] || { kill "$CHILD" 2>/dev/null; wait "$CHILD"; }; exit 130' INT TERM HUP
guarded() {
    local name=$1 code=0
    shift
    "$BIN" "$@" >/dev/null 2>"$OUT/last.log" &
    CHILD=$!
    wait "$CHILD" || code=$?
    CHILD=
    [ $code -ne 130 ] || exit 130
    [ $code -eq 0 ] || { printf '%s: exit code %s\n' "$name" $code; cat "$OUT/last.log"; } | tee -a "$ERRORS" >&2
    rm -f "$OUT/last.log"
}
# variant SCENE NAME OPTIONS…: one run, unless it has its scores
variant() {
    local scene=$1 name=$2 run=$OUT/runs/$1/$2
    shift 2
    [ ! -f "$run/eval/test/metrics.json" ] || return 0
    printf '%s, %s\n' "$scene" "$name" >&2
    rm -rf "$run"
    guarded "$scene, $name" train "$OUT/$scene" --out "$run" "${BUDGET[@]}" --seed "$SEED" --quiet --json "$@"
}

# value FILE INDENT KEY: a number of metrics.json, "-" where it is absent
value() {
    local found=
    [ ! -f "$1" ] || found=$(sed -n "s/^$2\"$3\": \([-+0-9.eE]*\),\{0,1\}$/\1/p" "$1" | head -n 1)
    printf '%s' "${found:--}"
}
# verdict FILE: the hypotheses of the object "verdict", one per region; deeper ones belong to candidates
verdict() {
    [ -f "$1" ] || { printf -- '-'; return; }
    awk '
        /^  "verdict": *\{/ { inside = 1 }
        /^  \}/ { inside = 0 }
        inside && match($0, /"hypothesis": *"[^"]*"/) {
            indent = match($0, /[^ ]/)
            text = $0
            sub(/^.*"hypothesis": *"/, "", text)
            sub(/".*$/, "", text)
            if (!least || indent < least) { least = indent; all = "" }
            if (indent == least) all = all (all == "" ? "" : ", ") text
        }
        END { printf "%s", all == "" ? "-" : all }' "$1"
}
# scores SCENE: a line of tab-separated figures
scores() {
    local file name
    printf '%s' "$1"
    for name in straight bent truth; do
        file=$OUT/runs/$1/$name/eval/test/metrics.json
        printf '\t%s\t%s' "$(value "$file" '  ' psnr_inside)" "$(value "$file" '  ' psnr_outside)"
    done
    file=$OUT/runs/$1/bent/eval/test/metrics.json
    printf '\t%s\t%s\n' "$(value "$file" '    ' mae_inside)" "$(verdict "$file")"
}

# Rows and the summary, from lines of `scores`.
table() {
    awk -F '\t' '
        function known(a, b) { return a != "-" && b != "-" }
        function show(format, v) { return v == "-" ? "-" : sprintf(format, v) }
        function pair(a, b) { return show("%.2f", a) " / " show("%.2f", b) }
        {
            gain = known($2, $4) ? $4 - $2 : "-"
            change = known($3, $5) ? $5 - $3 : "-"
            room = known($2, $6) ? $6 - $2 : "-"
            share = gain != "-" && room != "-" && room >= 0.5 ? 100 * gain / room : "-"
            printf "| %s | %s | %s | %s | %s | %s | %s | %s | %s |\n", $1, pair($2, $3), pair($4, $5), pair($6, $7),
                show("%+.2f", gain), show("%+.2f", change), show("%.3f", $8), show("%.0f %%", share), $9
            if (gain == "-" || change == "-") { missing++; next }
            scenes++
            total += gain
            if (gain < -0.1 || change < -0.3) { worse++; list = list (list == "" ? "" : ", ") $1 }
            inside += gain < -0.1
            outside += change < -0.3
            much += gain >= 3
        }
        END {
            printf "\n- Scenes with both scores: %d", scenes
            if (missing) printf "; without: %d", missing
            printf ".\n- Worse than straight rays by more than 0.1 dB inside: %d; by more than 0.3 dB outside: %d", inside, outside
            printf "; by either: %d%s.\n", worse, list == "" ? "" : " (" list ")"
            printf "- Better by at least 3 dB inside: %d.\n", much
            if (scenes) printf "- Mean gain inside: %+.2f dB.\n", total / scenes
        }'
}

processor() {
    local name=
    [ ! -r /proc/cpuinfo ] || name=$(sed -n 's/^model name[^:]*: *//p' /proc/cpuinfo | head -n 1)
    [ -n "$name" ] || name=$(sysctl -n machdep.cpu.brand_string 2>/dev/null || uname -m)
    printf '%s, %s logical cores' "$name" "$(getconf _NPROCESSORS_ONLN 2>/dev/null || echo '?')"
}
revision() { git describe --always --dirty 2>/dev/null || echo unknown; }

page() {
    cat <<PAGE
# Scenes

Every refractive scene of \`refraxel synth --list\`, trained three times with the same budget: with straight rays, with bent rays
and with the true index held. PSNR on held-out views, inside / outside of the masks of refractive bodies [dB]. *Gain* and
*change* compare bent with straight rays. *Error of n* is the mean absolute error of the index inside the true body. *Share* is
(bent − straight) / (truth − straight) inside; it is left out where the truth gains less than 0.5 dB. *Verdict* is what the
program took each region for. A dash stands for what is not known.

\`\`\`sh
refraxel synth SCENE --out OUT/SCENE ${SYNTH[*]}
refraxel train OUT/SCENE --out OUT/runs/SCENE/straight ${BUDGET[*]} --seed $SEED --refraction off
refraxel train OUT/SCENE --out OUT/runs/SCENE/bent ${BUDGET[*]} --seed $SEED
refraxel train OUT/SCENE --out OUT/runs/SCENE/truth ${BUDGET[*]} --seed $SEED --index-from OUT/SCENE/scene.json
\`\`\`

Budget: \`${BUDGET[*]}\` per run, seed $SEED. Program: $("$BIN" --version), revision $(revision). Processor: $(processor).

| scene | straight | bent | truth held | gain inside | change outside | error of n | share | verdict |
|---|---|---|---|---|---|---|---|---|
PAGE
    for name in $SCENES; do scores "$name"; done | table
    [ ! -s "$ERRORS" ] || printf -- '- Some commands failed; OUT/errors.log has their messages.\n'
}

for name in $SCENES; do
    guarded "$name, data" synth "$name" --out "$OUT/$name" "${SYNTH[@]}"
    variant "$name" straight --refraction off
    variant "$name" bent
    variant "$name" truth --index-from "$OUT/$name/scene.json"
    page >"$OUT/scenes.md.new"
    mv "$OUT/scenes.md.new" "$OUT/scenes.md"
done
sed -n '/^| scene/,$p' "$OUT/scenes.md"
[ ! -s "$ERRORS" ] || exit 1

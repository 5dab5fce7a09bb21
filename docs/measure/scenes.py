"""Every refractive scene of `synth --list`, trained three times with the same budget: straight rays, bent rays, true index held."""

import argparse
import sys
from pathlib import Path

from .pages import folder
from .program import call, stamp, train

RUNS = {"straight": ["--refraction", "off"], "bent": [], "truth": None}


def arguments(parser: argparse.ArgumentParser) -> None:
    budget = parser.add_mutually_exclusive_group()
    budget.add_argument("--minutes", type=float, default=2, help="wall-clock time of each run [2]")
    budget.add_argument("--steps", type=int, help="steps of each run instead, which any machine can repeat")
    parser.add_argument("--size", type=int, default=200, help="edge of the pictures [pixel]")
    parser.add_argument("--views", type=int, default=60, help="training views")
    parser.add_argument("--seed", default="0", help="seed of the trainings; the data always have seed 0")
    parser.add_argument("--scenes", help="measure only these, with commas; the others stay as stored")


def refractive() -> list[str]:
    """The scenes that have masks and an index."""
    lines = call("synth", "--list").splitlines()[1:]
    return [line.split()[0] for line in lines if line.strip() and "nothing refracts" not in line and "room (" not in line]


def measure(given: argparse.Namespace, before: dict) -> tuple[dict, dict[Path, str]]:
    budget = ["--set", f"run.steps={given.steps}"] if given.steps else ["--minutes", f"{given.minutes:g}"]
    table = "steps" if given.steps else "minutes"
    out = folder(f"{given.out}/{'-'.join(budget).strip('-').replace('=', '-')}-{given.size}-{given.views}-{given.seed}")
    every = refractive()
    chosen = given.scenes.split(",") if given.scenes else every
    if unknown := set(chosen) - set(every):
        sys.exit(f"figures.py: there is no refractive scene '{unknown.pop()}'; choose among {', '.join(every)}")
    size = ["--size", str(given.size), "--views", str(given.views), "--spp", "4", "--detail-spp", "0"]
    same = {"budget": " ".join([*budget, "--seed", given.seed]), "size": size}
    stored = before.get(table, {})
    # Rows of another budget or of other pictures do not belong in one table.
    kept = {row["scene"]: row for row in stored.get("rows", [])} if {key: stored.get(key) for key in same} == same else {}
    for name in chosen:
        data = out / "data" / name
        call("synth", name, "--out", str(data), *size, "--quiet")
        scores = {}
        for run, words in RUNS.items():
            options = ["--index-from", str(data / "scene.json")] if words is None else words
            scores[run] = train(data, out / "runs" / name / run, *budget, "--seed", given.seed, *options)
        kept[name] = row(name, scores) | {"revision": stamp()["revision"]}
    return {**before, table: {**stamp(), **same, "rows": [kept[name] for name in every if name in kept]}}, {}


def row(name: str, scores: dict[str, dict]) -> dict:
    """The figures of a scene, from unrounded scores."""
    pairs = {run: [s["psnr_inside"], s["psnr_outside"]] for run, s in scores.items()}
    (si, so), (bi, bo), (ti, _) = (pairs[run] for run in RUNS)
    regions = (scores["bent"].get("verdict") or {}).get("regions", [])
    return {
        "scene": name,
        **{run: [round(v, 2) for v in pair] for run, pair in pairs.items()},
        "gain": round(bi - si, 2),
        "change": round(bo - so, 2),
        "share": round(100 * (bi - si) / (ti - si)) if ti - si >= 0.5 else None,
        "index_error": round(scores["bent"]["ior"]["mae_inside"], 3),
        "verdict": ", ".join(region["hypothesis"] for region in regions) or "straight",
    }


def table(figures: dict) -> str:
    def show(value: float | None, form: str) -> str:
        return "–" if value is None else format(value, form)

    def pair(values: list[float | None]) -> str:
        return show(values[0], ".2f") + (f" / {values[1]:.2f}" if values[1] is not None else "")

    lines = [
        "| scene | straight | bent | truth held | gain inside | change outside | error of n | share | verdict |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for r in figures["rows"]:
        share = "–" if r["share"] is None else f"{r['share']} %"
        cells = [r["scene"] + r.get("note", ""), *(pair(r[run]) for run in RUNS), show(r["gain"], "+.2f"), show(r["change"], "+.2f")]
        lines.append(f"| {' | '.join([*cells, show(r['index_error'], '.3f'), share, r['verdict']])} |")
    rows = figures["rows"]
    gains = [r["gain"] for r in rows]
    both = [r for r in rows if r["change"] is not None]
    worse = [r["scene"] for r in rows if r["gain"] < -0.1 or (r["change"] or 0) < -0.3]
    lines += [
        "",
        f"Of {len(rows)} scenes {sum(g >= 3 for g in gains)} gain at least 3 dB inside, {sum(gains) / len(gains):.1f} dB in the mean. Worse than",
        f"straight rays by more than 0.1 dB inside or 0.3 dB outside (known of {len(both)}): {', '.join(worse) or 'none'}.",
    ]
    return "\n".join(lines)


def blocks(figures: dict) -> dict[str, str]:
    found = {}
    for name, of in figures.items():
        revisions = ", ".join(dict.fromkeys(row.get("revision", of["revision"]) for row in of["rows"]))
        where = f"Budget: `{of['budget']}` per run. Revision {revisions}. {of['machine']}{of.get('beside', '')}."
        found[f"scenes-{name}"] = f"{where}\n\n{table(of)}"
    return found

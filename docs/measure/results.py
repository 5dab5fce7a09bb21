"""The figures of the front page: path-traced scenes and photographs of the folder DATA, with straight and with bent rays."""

import argparse
from pathlib import Path

from .pages import folder
from .program import last_record, stamp, train

# Name, title, whether its rays bend, minutes of the straight run, minutes of the bent ones.
SCENES = [
    ("glass_ball", "glass ball", 4, [5]),
    ("water_tank", "tank of water with things in it", 3, [5, 8]),
    ("grin_luneburg", "Luneburg lens", 3, [5, 8]),
    ("opaque", "opaque things, path-traced", 4, []),
    ("fox", "photographs of a stuffed fox, 270×480, 43 views, unbounded", 10, []),
]


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("data", metavar="DATA", type=Path, help="folder of the scenes " + ", ".join(s[0] for s in SCENES))
    parser.add_argument("--seed", default="0")
    parser.add_argument("--scenes", default=",".join(s[0] for s in SCENES), help="measure only these; the others stay as stored")


def measure(given: argparse.Namespace, before: dict) -> tuple[dict, dict[Path, str]]:
    out, names = folder(given.out), given.scenes.split(",")
    rows = [row for row in before.get("rows", []) if row["scene"] not in names]
    for name, title, straight, bent in SCENES:
        for minutes, words in [(straight, ["--refraction", "off"]), *((m, []) for m in bent)] if name in names else []:
            run = out / name / f"{'straight' if words else 'bent'}-{minutes}"
            scores = train(given.data / name, run, "--seed", given.seed, "--minutes", str(minutes), *words)
            row = {key: scores[key] for key in ("psnr", "ssim", "psnr_inside", "psnr_outside") if scores.get(key) is not None}
            index = scores.get("ior") or {}
            row |= {key: index[key] for key in ("mean_inside", "mae_inside", "true_mean_inside") if index.get(key) is not None}
            row["graded"] = any(r["hypothesis"] == "graded" for r in (scores.get("verdict") or {}).get("regions", []))
            row |= {"scene": name, "title": title, "rays": run.name.partition("-")[0], "minutes": minutes, "seed": given.seed}
            rows.append(row | {"grid": last_record(run)["resolution"], "revision": stamp()["revision"]})
    order = [s[0] for s in SCENES]
    return {**stamp(), "rows": sorted(rows, key=lambda row: order.index(row["scene"]))}, {}


def score(row: dict) -> str:
    if "psnr_inside" in row:
        return f"{row['psnr_inside']:.2f} / {row['psnr_outside']:.2f}"
    return f"{row['psnr']:.2f}, SSIM {row['ssim']:.4f}"


def index(row: dict) -> str:
    """The index that was found, beside the true one; of a graded index its mean error."""
    if row["graded"] and "mae_inside" in row:
        return f"mean error {row['mae_inside']:.3f}"
    return f"{row['mean_inside']:.3f} ({row['true_mean_inside']:.3f})" if "mean_inside" in row else "–"


def blocks(figures: dict) -> dict[str, str]:
    rows = figures["rows"]
    short = ["| scene | straight rays | bent rays | index found (true) |", "|---|---|---|---|"]
    long = ["| scene | rays | minutes | PSNR [dB] | index found (true) | grid, longest edge | revision |"]
    long.append("|---" * 7 + "|")
    for name in dict.fromkeys(row["scene"] for row in rows):
        of = [row for row in rows if row["scene"] == name]
        straight = next(row for row in of if row["rays"] == "straight")
        bent = max((row for row in of if row["rays"] == "bent"), key=lambda row: row["minutes"], default=None)
        cells = [straight["title"], f"{score(straight)} ({straight['minutes']} min)"]
        cells += [f"**{score(bent)}** ({bent['minutes']} min)", index(bent)] if bent else ["–", "–"]
        short.append(f"| {' | '.join(cells)} |")
    for row in rows:
        cells = [row["title"], row["rays"], str(row["minutes"]), score(row), index(row), str(row.get("grid", "–")), row["revision"]]
        long.append(f"| {' | '.join(cells)} |")
    return {
        "results": "PSNR on held-out views [dB]; two figures are inside / outside the masks of the refractive body. Training times are in\n"
        "brackets, on two CPU cores.\n\n" + "\n".join(short),
        "results-all": "`refraxel train DATA --out RUN --minutes M`, with `--refraction off` for straight rays. PSNR inside / outside the masks\n"
        "of the refractive body where there is one.\n\n" + "\n".join(long),
    }

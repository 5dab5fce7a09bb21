"""PSNR and SSIM of one scene against the time of training, beside published figures: a table and a plot.

Arguments after `--` go to `refraxel train`, for example:
  docs/figures.py curves OUT DATA --name fern --refraction off --publish -- --holdout 8"""

import argparse
from pathlib import Path
from statistics import mean

from .pages import folder
from .program import last_record, stamp, train

# Figures of others for whole scenes: PSNR [dB], SSIM, and where they were published. Protocols differ: other SSIM windows, other machines.
NERF_FACTORY = "nerf-factory"
PUBLISHED: dict[str, list[tuple[str, float, float | None, str]]] = {
    "fern": [
        ("Plenoxels", 25.46, 0.832, "its paper (Titan RTX)"),
        ("Plenoxels", 24.91, 0.8076, NERF_FACTORY),
        ("NeRF", 25.19, 0.8045, NERF_FACTORY),
    ],
    "chair": [
        ("Plenoxels", 33.98, None, "its paper (Titan RTX)"),
        ("Plenoxels", 34.11, 0.9769, NERF_FACTORY),
        ("NeRF", 34.93, 0.9794, NERF_FACTORY),
    ],
    "lego": [("Plenoxels", 34.34, 0.9753, NERF_FACTORY), ("NeRF", 34.38, 0.9731, NERF_FACTORY)],
}
COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7"]
GREY = "#686c76"
STYLES = ["--", ":", "-."]


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("data", metavar="DATA", type=Path, help="the dataset")
    parser.add_argument("--name", required=True, help="name of the scene; 'fern', 'chair' and 'lego' have published figures")
    parser.add_argument("--minutes", default="1,2,5,10,20,40", help="times of training, with commas")
    parser.add_argument("--refraction", default="auto", choices=["off", "on", "auto"])
    parser.add_argument("--seeds", default="0", help="seeds, with commas; the table has their mean, and their range where there are several")


def measure(given: argparse.Namespace, before: dict) -> tuple[dict, dict[Path, str]]:
    out = folder(given.out)
    words = ["--refraction", given.refraction, *given.words]
    points = []
    for minutes in map(float, given.minutes.split(",")):
        runs = []
        for seed in given.seeds.split(","):
            run = out / given.name / f"{given.refraction}-{minutes:g}-{seed}"
            scores = train(given.data, run, "--minutes", f"{minutes:g}", "--seed", seed, *words)
            last = last_record(run)
            known = {key: scores[key] for key in ("psnr", "ssim", "psnr_inside", "psnr_outside") if scores.get(key) is not None}
            runs.append({"seed": int(seed), "steps": last["step"], "seconds": round(last["seconds"], 1), **known})
        points.append({"minutes": minutes, **stamp(), "runs": runs})
    command = f"--minutes M --seed {given.seeds} {' '.join(words)}"
    # One entry for each way of training a scene. The other entries stay as they are, and so do other times of the same one.
    title = given.name if given.refraction == "off" else f"{given.name}, refraction {given.refraction}"
    scenes = before.get("scenes", {})
    measured = {p["minutes"] for p in points}
    if title in scenes and scenes[title]["command"] == command:
        points += [p for p in scenes[title]["points"] if p["minutes"] not in measured]
    scene = {"command": command, "points": sorted(points, key=lambda p: p["minutes"])}
    figures = {"scenes": {**scenes, title: scene}}
    plot = out / "quality.svg"
    draw(figures, plot)
    return figures, {plot: "pictures/quality.svg"}


def published(title: str) -> list[tuple[str, float, float | None, str]]:
    return PUBLISHED.get(title.partition(",")[0], [])


def draw(figures: dict, path: Path) -> None:
    """PSNR and SSIM over minutes, the time on a logarithmic axis; published figures as horizontal lines."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "quality", "font.size": 9, "axes.spines.top": False})
    matplotlib.rcParams.update({"axes.spines.right": False, "axes.grid": True, "grid.color": "#e4e6eb", "axes.edgecolor": GREY})
    from matplotlib import pyplot
    from matplotlib.ticker import NullFormatter

    figure, sides = pyplot.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    times = sorted({p["minutes"] for scene in figures["scenes"].values() for p in scene["points"]})
    for side, key, title in zip(sides, ("psnr", "ssim"), ("PSNR on held-out views [dB]", "SSIM on held-out views"), strict=True):
        drawn: list[tuple] = []
        for colour, (name, scene) in zip(COLOURS * 9, figures["scenes"].items(), strict=False):
            shown = [(p["minutes"], [run[key] for run in p["runs"]]) for p in scene["points"]]
            side.plot([m for m, _ in shown], [mean(v) for _, v in shown], "o-", color=colour, label=f"refraxel, {name}", markersize=4)
            side.vlines([m for m, _ in shown], [min(v) for _, v in shown], [max(v) for _, v in shown], color=colour, linewidth=1)
            others = [(method, psnr if key == "psnr" else ssim, source) for method, psnr, ssim, source in published(name)]
            for style, (method, value, source) in zip(STYLES * 9, [o for o in others if o[1] is not None and o not in drawn], strict=False):
                drawn.append((method, value, source))
                side.axhline(value, color=colour, linestyle=style, linewidth=0.9, label=f"{method}, {source}")
        side.set_title(title, loc="left", fontsize=9, fontweight="bold")
        side.set_xscale("log")
        side.set_xlabel("wall-clock time of training [min]")
        side.set_xticks(times, [f"{t:g}" for t in times])
        side.xaxis.set_minor_formatter(NullFormatter())
        side.legend(frameon=False, fontsize=7, loc="lower right")
    figure.savefig(path, metadata={"Date": None, "Creator": None})
    pyplot.close(figure)


def blocks(figures: dict) -> dict[str, str]:
    def of(runs: list[dict], key: str, digits: int) -> str:
        values = [run[key] for run in runs if key in run]
        if not values:
            return "–"
        span = f" ({min(values):.{digits}f} to {max(values):.{digits}f})" if len(values) > 1 else ""
        return f"{mean(values):.{digits}f}{span}"

    parts = []
    for name, scene in figures["scenes"].items():
        bent = any("psnr_inside" in run for point in scene["points"] for run in point["runs"])
        inside = ["inside [dB]", "outside [dB]"] if bent else []
        head = ["minutes", "seconds", "steps", "PSNR [dB]", "SSIM", *inside, "revision, machine"]
        lines = [f"**{name}:** `refraxel train DATA --out RUN {scene['command']}`", ""]
        lines += [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
        for point in scene["points"]:
            runs = point["runs"]
            cells = [f"{point['minutes']:g}", of(runs, "seconds", 0), of(runs, "steps", 0), of(runs, "psnr", 2), of(runs, "ssim", 4)]
            cells += [of(runs, "psnr_inside", 2), of(runs, "psnr_outside", 2)] if bent else []
            cells.append(f"{point['revision']}, {point['machine']}")
            lines.append(f"| {' | '.join(cells)} |")
        parts.append("\n".join(lines))
    others = ["| scene | method | PSNR [dB] | SSIM | source |", "|---|---|---|---|---|"]
    for scene, rows in PUBLISHED.items():
        for method, psnr, ssim, source in rows:
            others.append(f"| {scene} | {method} | {psnr:.2f} | {'–' if ssim is None else f'{ssim:.4g}'} | {source} |")
    plot = ["![PSNR and SSIM against the minutes of training](pictures/quality.svg)"] if figures["scenes"] else []
    return {"curves": "\n\n".join([*plot, *parts]) or "No run is stored yet.", "published": "\n".join(others)}

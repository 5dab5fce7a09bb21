"""Whether the program lets rays bend, with and without masks, against straight rays: a table and a gallery."""

import argparse
import json
import shutil
from pathlib import Path

from .pages import folder
from .program import call, stamp, train

CASES = ["glass_ball", "glass_blob", "faceted", "prism", "two_indices", "drinking_glass", "wavy_pool"]
CASES += ["kitchen_vessel", "kitchen_bear", "study_crystal", "terrace_ball", "study_mirrors"]
ROOMS = ("kitchen_", "study_", "terrace_")
ROOM = ", photographic"
RUNS = {"straight": ["--refraction", "off"], "auto": []}


def arguments(parser: argparse.ArgumentParser) -> None:
    budget = parser.add_mutually_exclusive_group()
    budget.add_argument("--minutes", type=float, default=5, help="wall-clock time of each run [5]")
    budget.add_argument("--steps", type=int, help="steps of each run instead, which any machine can repeat")
    parser.add_argument("--seed", default="0")
    parser.add_argument("--cases", default=",".join(CASES), help="scenes of `synth --list`, or folders of data with masks or without")
    parser.add_argument(
        "--masks", default="clean,rough,none", help="clean: exact; rough: as a segmenter draws them (rooms); none: training views have none"
    )


def withhold(data: Path) -> None:
    """Takes the masks of training views away; those of other views remain, which scores need."""
    for file in data.glob("transforms*.json"):
        found = json.loads(file.read_text())
        for frame in found["frames"]:
            name = frame["file_path"].removeprefix("./")
            mask = frame.get("mask_path")
            if mask and not name.startswith(("test", "val")):
                del frame["mask_path"]
                (data / mask).unlink(missing_ok=True)
        file.write_text(json.dumps(found))
    for mask in data.glob("train/*_mask.png"):
        mask.unlink()


def dataset(case: str, masks: str, data: Path) -> None:
    """Makes or copies the data of a case."""
    if data.exists():
        return
    making = data.with_name("making")
    shutil.rmtree(making, ignore_errors=True)
    if "/" in case:
        shutil.copytree(case, making)
    elif case.startswith(ROOMS):
        exact = ["--without", "masks"] if masks == "clean" else []
        call("synth", case, "--out", str(making), "--photographic", *exact)
    else:
        call("synth", case, "--out", str(making), "--views", "60", "--spp", "4", "--detail-spp", "0")
    if masks == "none":
        withhold(making)
    making.rename(data)


def row(case: str, masks: str, straight: dict, auto: dict) -> dict:
    verdict = auto.get("verdict") or {}
    said, evidence = [], []
    for region in verdict.get("regions", []):
        numbers = {f["name"]: f["value"] for f in region.get("found", [])}
        index = next((f" {numbers[n]:.3f}" for n in ("filling", "index") if n in numbers), "")
        said.append(region["hypothesis"] + (index if region["hypothesis"] != "straight" else ""))
        parts = []
        if of := region.get("evidence"):
            parts.append(f"{of['predicted']['mean']:.2f} / {of['straight_through']['mean']:.2f}")
        if region.get("contestants"):
            parts.append(f"race {region['gain_inside']:+.2f}")
        evidence.append("; ".join(parts) or "–")
    keys = ("psnr_inside", "psnr_outside")
    return {
        "scene": Path(case).name + (ROOM if Path(case).name.startswith(ROOMS) else ""),
        "masks": masks,
        "straight": [straight.get(key) for key in keys],
        "auto": [auto.get(key) for key in keys],
        "change": [auto[key] - straight[key] if auto.get(key) is not None else None for key in keys],
        "verdict": ", ".join(said) or "nothing found",
        "evidence": ", ".join(evidence) or "–",
        "seconds": verdict.get("seconds"),
    }


def picture(at: Path, target: Path) -> None:
    """Photograph, straight, bent and error of the middle test view."""
    import numpy as np
    from PIL import Image

    straight, auto = (at / run / "eval/test" for run in ("straight", "auto"))
    views = sorted(p.name for p in auto.glob("*.png"))
    view = views[len(views) // 2]
    test = at / "data/test"
    photograph = next(p for p in sorted(test.glob(Path(view).stem + ".*")) if "mask" not in p.name)
    load = lambda p: np.asarray(Image.open(p).convert("RGB"), dtype=float)
    bent = load(auto / view)
    true = np.asarray(Image.open(photograph).convert("RGB").resize(bent.shape[1::-1]), dtype=float)
    error = np.clip(4 * np.abs(bent - true), 0, 255)
    strip = np.concatenate([true, load(straight / view), bent, error], axis=1).astype("uint8")
    width = min(strip.shape[1], 1280)
    Image.fromarray(strip).resize((width, strip.shape[0] * width // strip.shape[1])).save(target, quality=88)


def measure(given: argparse.Namespace, before: dict) -> tuple[dict, dict[Path, str]]:
    budget = ["--set", f"run.steps={given.steps}"] if given.steps else ["--minutes", f"{given.minutes:g}"]
    budget += ["--seed", given.seed]
    out, rows = folder(given.out), []
    for case in given.cases.split(","):
        for masks in given.masks.split(","):
            if masks == "rough" and not case.startswith(ROOMS) and "/" not in case:
                continue
            at = folder(out / f"{Path(case).name}-{masks}")
            dataset(case, masks, at / "data")
            scores = [train(at / "data", at / run, *budget, *words) for run, words in RUNS.items()]
            picture(at, out / f"{at.name}.jpg")
            rows.append({**row(case, masks, *scores), **stamp(), "budget": " ".join(budget)})
    # Each row says how it was measured, so that cases that were not measured now stay as they are.
    measured = {name(r) for r in rows}
    rows += [r for r in before.get("rows", []) if name(r) not in measured]
    return {"rows": sorted(rows, key=lambda r: (ROOM in r["scene"], *name(r)))}, {}


def name(of: dict) -> tuple[str, str]:
    return of["scene"], of["masks"]


def how(of: dict) -> str:
    return f"Budget `{of['budget']}` per run, revision {of['revision']}, {of['machine']}{of.get('beside', '')}."


def blocks(figures: dict) -> dict[str, str]:
    def show(value: float | None, form: str) -> str:
        return "–" if value is None else format(value, form)

    head = ["scene", "masks", "straight", "auto", "inside", "outside", "verdict, index", "evidence", "seconds", "measured"]
    hows = list(dict.fromkeys(map(how, figures["rows"])))
    lines = [f"{number}. {text}" for number, text in enumerate(hows, 1)]
    lines += ["", f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for r in figures["rows"]:
        pairs = [" / ".join(show(v, ".2f") for v in r[key]) for key in ("straight", "auto")]
        changes = [show(v, "+.2f") for v in r["change"]]
        cells = [r["scene"], r["masks"], *pairs, *changes, r["verdict"], r["evidence"], show(r["seconds"], ".0f"), str(hows.index(how(r)) + 1)]
        lines.append(f"| {' | '.join(cells)} |")
    return {"verdicts": "\n".join(lines)}

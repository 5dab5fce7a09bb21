#!/usr/bin/env python3
"""A table and a gallery: what the program takes glass for, with and without masks, against straight rays.

usage: docs/verdicts.py OUT [minutes=5 | steps=N] [seed=0] [cases=NAME,NAME…] [masks=clean,rough,none]
  OUT      folder for data, runs and the page: OUT/CASE-MASKS/{data,straight,auto}, OUT/verdicts.md, OUT/CASE-MASKS.jpg
  minutes  wall-clock time of each run; steps=N gives each run N steps instead, which any machine can repeat
  cases    scenes of `refraxel synth --list`, those in a room as photographs, or folders of data that have masks or none
  masks    clean: exact; rough: as a segmenter draws them (scenes in a room only); none: training views have none
A second call keeps runs that have their scores. REFRAXEL names a program to use instead of building one. Pictures need Pillow and numpy.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
CASES = ["glass_ball", "glass_blob", "faceted", "prism", "two_indices", "drinking_glass", "wavy_pool"]
CASES += ["kitchen_vessel", "kitchen_bear", "study_crystal", "terrace_ball", "study_mirrors"]
ROOMS = ("kitchen_", "study_", "terrace_")


def program() -> str:
    if "REFRAXEL" in os.environ:
        return str(Path(os.environ["REFRAXEL"]).resolve())
    subprocess.run(["cargo", "build", "--release", "--quiet"], cwd=HERE.parent, check=True)
    return str(Path(os.environ.get("CARGO_TARGET_DIR", HERE.parent / "target")).resolve() / "release" / "refraxel")


def call(refraxel: str, *words: str) -> None:
    done = subprocess.run([refraxel, *words, "--quiet"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if done.returncode:
        sys.exit(f"verdicts.py: exit code {done.returncode} of {' '.join(words)}\n{done.stderr}")


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


def dataset(refraxel: str, case: str, masks: str, data: Path) -> None:
    """Makes or copies the data of a case."""
    if data.exists():
        return
    making = data.with_name("making")
    shutil.rmtree(making, ignore_errors=True)
    if "/" in case:
        shutil.copytree(case, making)
    elif case.startswith(ROOMS):
        exact = ["--without", "masks"] if masks == "clean" else []
        call(refraxel, "synth", case, "--out", str(making), "--photographic", *exact)
    else:
        call(refraxel, "synth", case, "--out", str(making), "--views", "60", "--spp", "4", "--detail-spp", "0")
    if masks == "none":
        withhold(making)
    making.rename(data)


def row(case: str, masks: str, at: Path) -> str:
    straight, auto = (json.loads((at / run / "eval/test/metrics.json").read_text()) for run in ("straight", "auto"))
    dash = "–"
    score = lambda m, key: f"{m[key]:.2f}" if m.get(key) is not None else dash
    pair = lambda m: f"{score(m, 'psnr_inside')} / {score(m, 'psnr_outside')}"
    change = lambda key: f"{auto[key] - straight[key]:+.2f}" if auto.get(key) is not None else dash
    verdict = auto.get("verdict") or {}
    said, evidence = [], []
    for region in verdict.get("regions", []):
        numbers = {f["name"]: f["value"] for f in region.get("found", [])}
        index = next((f" {numbers[n]:.3f}" for n in ("filling", "index") if n in numbers), "")
        said.append(region["hypothesis"] + (index if region["hypothesis"] != "straight" else ""))
        of = region.get("evidence")
        compared = lambda k: f"{of[k]['mean']:.2f}"
        evidence.append(f"{compared('predicted')} / {compared('straight_through')}" if of else f"race {region['gain_inside']:+.2f}")
    seconds = f"{verdict['seconds']:.0f}" if "seconds" in verdict else dash
    name = Path(case).name
    cells = [name, masks, pair(straight), pair(auto), change("psnr_inside"), change("psnr_outside")]
    return "| " + " | ".join([*cells, ", ".join(said) or "nothing found", ", ".join(evidence) or dash, seconds]) + " |"


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


def main() -> None:
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    given = dict(word.split("=", 1) for word in sys.argv[2:])
    unknown = given.keys() - {"minutes", "steps", "seed", "cases", "masks"}
    if unknown:
        sys.exit(f"verdicts.py: unknown argument '{unknown.pop()}'\n{__doc__}")
    out, refraxel, seed = Path(sys.argv[1]).resolve(), program(), given.get("seed", "0")
    budget = ["--set", f"run.steps={given['steps']}"] if "steps" in given else ["--minutes", given.get("minutes", "5")]
    head = ["scene", "masks", "straight", "auto", "inside", "outside", "verdict, index", "evidence", "seconds"]
    rows = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for case in given.get("cases", ",".join(CASES)).split(","):
        for masks in given.get("masks", "clean,rough,none").split(","):
            if masks == "rough" and not case.startswith(ROOMS) and "/" not in case:
                continue
            at = out / f"{Path(case).name}-{masks}"
            at.mkdir(parents=True, exist_ok=True)
            dataset(refraxel, case, masks, at / "data")
            for run, options in (("straight", ["--refraction", "off"]), ("auto", [])):
                if not (at / run / "eval/test/metrics.json").exists():
                    print(at.name, run, file=sys.stderr)
                    shutil.rmtree(at / run, ignore_errors=True)
                    call(refraxel, "train", str(at / "data"), "--out", str(at / run), *budget, "--seed", seed, *options)
            picture(at, out / f"{at.name}.jpg")
            rows.append(row(case, masks, at))
            (out / "verdicts.md").write_text("\n".join(rows) + "\n")
    print("\n".join(rows))


if __name__ == "__main__":
    main()

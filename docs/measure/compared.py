"""This program and others that run on a CPU, on the same photographs, with the same CPU time.

Needs Python 3.10 or later with venv, PyPI, Rust, and for Mitsuba LLVM 16 or later (Debian: apt-get install libllvm19); DRJIT_LIBLLVM_PATH
names its library. The environment of the others is OUT/env."""

import argparse
import json
import os
import subprocess
import sys
import venv
from pathlib import Path

from .pages import folder, put
from .program import program, stamp

HERE = Path(__file__).resolve().parent
PACKAGES = ["torch==2.15.0", "mitsuba==3.9.1", "numpy", "scipy", "scikit-image", "pillow"]
# Steps of this program that take about 60 CPU seconds on a quiet machine, straight and bent.
STEPS = {"opaque": (1450, 290), "glass_ball": (930, 250), "water_tank": (900, 180), "grin_luneburg": (930, 250)}
BODIES = {"sphere", "box"}  # shapes that Mitsuba has; a graded index it has not
OURS = ["straight/result.json", "bent/result.json"]
NAMES = {
    "straight": "refraxel, straight rays",
    "bent": "refraxel, bent rays",
    "hash_grid": "NeRF with a hash grid, PyTorch",
    "field": "radiance field in Mitsuba 3, straight rays",
    "bent_field": "radiance field in Mitsuba 3, given the true shape",
}


def run(command: list[str], **options) -> tuple[float, str]:
    """CPU seconds and standard output of a command that must succeed."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, **options) as process:
        output = process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"figures.py: exit code {process.returncode} of {' '.join(command)}")
    return usage.ru_utime + usage.ru_stime, output


def environment(out: Path) -> Path:
    """Python with the packages of the others."""
    python = out / "env" / "bin" / "python"
    if not python.exists():
        venv.create(out / "env", with_pip=True)
    subprocess.run([python, "-m", "pip", "install", "--quiet", *PACKAGES], check=True)
    return python


def refraxel(scene: Path, out: Path, seconds: float, bent: bool) -> dict:
    """A run of as many steps as fit the time. It also renders all test views, which is measured apart and taken off."""
    steps = round(STEPS[scene.name][bent] * seconds / 60)
    options = [] if bent else ["--refraction", "off"]
    train = [program(), "train", str(scene), "--out", str(out / "run"), "--set", f"run.steps={steps}", "--threads", "1"]
    total, _ = run([*train, "--seed", "0", "--overwrite", "--quiet", "--json", *options])
    rendering, output = run([program(), "eval", str(out / "run"), "--threads", "1", "--json", "--quiet"])
    scores = json.loads(output)
    for score in scores["per_image"]:
        (out / score["name"]).unlink(missing_ok=True)
        (out / score["name"]).symlink_to(out / "run" / "eval" / "test" / score["name"])
    result = {"steps": steps, "train_cpu_s": total - rendering, "render_cpu_s": rendering, "rendered": len(scores["per_image"])}
    return result | ({"index_error": scores["ior"]["mae_inside"]} if bent and "ior" in scores else {})


def peer(python: Path, name: str, scene: Path, out: Path, seconds: float, every: int) -> dict:
    script = {"field": "bent_field"}.get(name, name)
    libraries = sorted(Path("/usr/lib").glob("*/libLLVM.so.[1-9]*"))
    llvm = {"DRJIT_LIBLLVM_PATH": str(libraries[-1])} if libraries else {}
    command = [str(python), str(HERE / "peers" / f"{script}.py"), str(scene), str(out), str(seconds), str(every)]
    _, output = run(command + (["straight"] if name == "field" else []), env={**llvm, **os.environ})
    result = json.loads(output)
    bodies = json.loads((scene / "scene.json").read_text())["refractive"]
    if "index" in result and bodies:
        result["index_error"] = abs(result["index"] - bodies[0]["ior"])
    return result


def possible(name: str, scene: Path) -> bool:
    """Whether a program can be asked for a scene: without refractive bodies nothing bends, and Mitsuba has no graded index."""
    shapes = {body["shape"] for body in json.loads((scene / "scene.json").read_text())["refractive"]}
    return {"bent": bool(shapes), "bent_field": bool(shapes) and shapes <= BODIES, "field": not shapes}.get(name, True)


def compare(python: Path, name: str, scene: Path, out: Path, seconds: float, every: int) -> dict:
    """Trains, renders and scores one program on one scene, unless that is done."""
    done = out / "result.json"
    if not done.exists():
        out.mkdir(parents=True, exist_ok=True)
        print(f"{scene.name}: {NAMES[name]}", file=sys.stderr, flush=True)
        if name in ("straight", "bent"):
            result = refraxel(scene, out, seconds, bent=name == "bent")
        else:
            ours = [json.loads(path.read_text())["train_cpu_s"] for path in map(out.parent.joinpath, OURS) if path.exists()]
            result = peer(python, name, scene, out, max(ours, default=seconds), every)
        _, output = run([str(python), str(HERE / "peers" / "scores.py"), str(scene), str(out), str(every)])
        scores = json.loads(output)
        result["render_cpu_s"] /= result.pop("rendered", scores["pictures"])
        put(done, json.dumps({"seconds": seconds, "every": every, **result, **scores}, indent=1))
    result = json.loads(done.read_text())
    if (result["seconds"], result["every"]) != (seconds, every):
        sys.exit(f"figures.py: {done} is of seconds={result['seconds']} every={result['every']}; choose another folder")
    return result


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("data", metavar="DATA", type=Path, help="folder of scenes in NeRF-synthetic layout, each with scene.json")
    parser.add_argument(
        "--seconds",
        type=float,
        default=60,
        help="about the CPU time of our trainings, which sets their steps; the others get as much as the longer of them took",
    )
    parser.add_argument("--every", type=int, default=8, help="of the test views each EVERY-th is rendered and scored")
    parser.add_argument("--scenes", default=",".join(STEPS))
    parser.add_argument("--programs", default=",".join(NAMES))


def measure(given: argparse.Namespace, before: dict) -> tuple[dict, dict[Path, str]]:
    del before
    out, rows = folder(given.out), []
    python = environment(out)
    for scene in given.scenes.split(","):
        for name in given.programs.split(","):
            if possible(name, given.data / scene):
                result = compare(python, name, given.data / scene, out / scene / name, given.seconds, given.every)
                rows.append({"scene": scene, "program": name, **result})
    return {**stamp(), "rows": rows}, {}


def blocks(figures: dict) -> dict[str, str]:
    lines = [
        "| scene | program | inside [dB] | outside [dB] | all [dB] | SSIM | error of n | steps | training [CPU s] | a view [CPU s] |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    digits = {"psnr_inside": 2, "psnr_outside": 2, "psnr": 2, "ssim": 4, "index_error": 3, "steps": 0, "train_cpu_s": 0, "render_cpu_s": 2}
    for r in figures["rows"]:
        cells = [f"{r[key]:.{count}f}" if key in r else "–" for key, count in digits.items()]
        lines.append(f"| {' | '.join([r['scene'], NAMES[r['program']], *cells])} |")
    return {"compared": "\n".join(lines)}

"""How time and memory of training grow with voxels, rays, pixels, views and threads.

Needs Linux: processor time and memory come from /proc."""

import argparse
import json
import math
import os
import shutil
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

from .pages import folder, put
from .program import program, stamp

MIB, GIB = 2**20, 2**30
TICK = os.sysconf("SC_CLK_TCK")

# A run is planned for STEPS steps and stopped after LAST of them. Its finest grid begins after 278 steps. After every fiftieth step it
# validates and copies its state; the steps between these records are plain ones.
STEPS, LAST = 1000, 400
PLAIN = [(325, 350), (375, 400)]
SCHEDULE = {"run.steps": STEPS, "run.stop_after": LAST}
BENDING = {"refraction.straight_steps": 60}
RESOLUTION, BATCH, SIZE, VIEWS = 128, 8192, 200, 100
SPP = {"opaque": 4, "glass_ball": 4}
AXES = {
    "voxels": [64, 128, 192, 256, 384, 512],
    "rays": [1024, 2048, 4096, 8192, 16384, 32768],
    "pixels": [200, 500, 1000, 2000, 4000],
    "views": [20, 100, 300, 1000],
    "threads": [1, 2],
}
BENT = {"voxels": [64, 128, 256], "rays": AXES["rays"]}
# Few large photographs, and a coarse grid, so that the memory is that of pixels.
PIXEL_VIEWS, PIXEL_RESOLUTION = 4, 64
LARGEST_SYNTH = 2000
MOST_VIEWS = max(AXES["views"])


def points(axis: str, bent: bool) -> list[int]:
    return BENT.get(axis, []) if bent else AXES[axis]


# Scenes


def synth(binary: str, scene: str, out: Path, size: int, views: int, spp: int) -> Path:
    """A scene with one view to score and none to validate: a run spends its time on training."""
    done = out / "synth.json"
    if not done.exists():
        print(f"scene {out.name}", file=sys.stderr, flush=True)
        command = [binary, "synth", scene, "--out", str(out), "--size", str(size), "--views", str(views), "--spp", str(spp)]
        command += ["--detail-spp", "0", "--index-resolution", "0", "--quiet", "--json"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        for part in ("test", "val"):
            keep_frames(out / f"transforms_{part}.json", 1)
        done.write_text(json.dumps({"command": command[1:]}))
    return out


def keep_frames(path: Path, count: int) -> None:
    """Keeps so many frames, evenly spread."""
    document = json.loads(path.read_text())
    frames = document["frames"]
    document["frames"] = [frames[k * len(frames) // count] for k in range(count)]
    path.write_text(json.dumps(document, indent=1))


def fewer_views(of: Path, out: Path, count: int) -> Path:
    """The same scene with fewer of its training views."""
    if not (out / "synth.json").exists():
        shutil.copytree(of, out, copy_function=os.link)
        for part in out.glob("transforms_train.json"):
            text = part.read_text()
            part.unlink()  # the link, not the file of the larger scene
            part.write_text(text)
            keep_frames(part, count)
    return out


def enlarged(of: Path, out: Path) -> Path:
    """The same scene with pictures of twice the edge, each pixel four times: `synth` would take minutes for each."""
    if not (out / "synth.json").exists():
        from matplotlib import image

        print(f"scene {out.name}", file=sys.stderr, flush=True)
        for part in ("train", "val", "test"):
            text = (of / f"transforms_{part}.json").read_text()
            (out / part).mkdir(parents=True, exist_ok=True)
            for frame in json.loads(text)["frames"]:
                pixels = image.imread(of / (frame["file_path"] + ".png"))
                path = out / (frame["file_path"] + ".png")
                image.imsave(path, pixels.repeat(2, axis=0).repeat(2, axis=1), pil_kwargs={"compress_level": 1})
            (out / f"transforms_{part}.json").write_text(text)
        shutil.copy(of / "synth.json", out)
    return out


def scene(binary: str, data: Path, axis: str, point: int, bent: bool) -> Path:
    if axis == "pixels":
        if point > LARGEST_SYNTH:
            return enlarged(scene(binary, data, axis, point // 2, bent), data / f"opaque_{point}px")
        return synth(binary, "opaque", data / f"opaque_{point}px", point, PIXEL_VIEWS, 1)
    if axis == "views":
        all_views = synth(binary, "opaque", data / f"opaque_{MOST_VIEWS}", SIZE, MOST_VIEWS, 1)
        return all_views if point == MOST_VIEWS else fewer_views(all_views, data / f"opaque_{point}", point)
    name = "glass_ball" if bent else "opaque"
    return synth(binary, name, data / name, SIZE, VIEWS, SPP[name])


# Measuring


def options(axis: str, point: int, bent: bool, data: Path) -> list[str]:
    """What `train` and `inspect` are told."""
    settings = dict(SCHEDULE)
    settings["grid.resolution"] = {"voxels": point, "pixels": PIXEL_RESOLUTION}.get(axis, RESOLUTION)
    settings["run.batch"] = point if axis == "rays" else BATCH
    if bent:
        settings |= BENDING
    words = [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]
    return (["--index-from", str(data / "scene.json")] if bent else ["--refraction", "off"]) + words


class Watched:
    """A process, and over its time the processor time that it has used and its largest resident memory."""

    def __init__(self, command: list[str]):
        self.times, self.peak, self.begun, self.lines = [], 0, None, []
        start = time.monotonic()
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        readers = [threading.Thread(target=self.read_errors), threading.Thread(target=self.read_output)]
        for reader in readers:
            reader.start()
        while self.process.poll() is None:
            self.look()
            time.sleep(0.01)
        for reader in readers:
            reader.join()
        self.code, self.wall = self.process.returncode, time.monotonic() - start

    def read_errors(self):
        for line in self.process.stderr:
            self.lines.append(line)
            if line.startswith("training started"):
                self.begun = time.monotonic()

    def read_output(self):
        self.output = self.process.stdout.read()

    def look(self):
        folder = Path("/proc") / str(self.process.pid)
        try:
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
            status = (folder / "status").read_text()
        except (FileNotFoundError, ProcessLookupError):
            return
        self.times.append((time.monotonic(), (int(fields[11]) + int(fields[12])) / TICK))
        for line in status.splitlines():
            if line.startswith("VmHWM:"):
                self.peak = max(self.peak, 1024 * int(line.split()[1]))

    def cpu_at(self, moment: float) -> float:
        """Processor time used until then, between two looks in proportion."""
        before = max((t for t in self.times if t[0] <= moment), default=self.times[0])
        after = min((t for t in self.times if t[0] > moment), default=self.times[-1])
        share = (moment - before[0]) / (after[0] - before[0]) if after[0] > before[0] else 0
        return before[1] + share * (after[1] - before[1])


def measure_one(binary: str, axis: str, point: int, bent: bool, data: Path, run: Path) -> dict:
    """One run that is stopped on its finest grid, and its scoring."""
    threads = point if axis == "threads" else 2
    command = [binary, "train", str(data), "--out", str(run), "--seed", "0", "--threads", str(threads), "--overwrite"]
    trained = Watched(command + options(axis, point, bent, data))
    if trained.code not in (0, 130) or trained.begun is None:
        sys.exit(f"figures.py: exit code {trained.code} of {' '.join(command)}\n{''.join(trained.lines)}")
    records = [json.loads(line) for line in (run / "log.jsonl").read_text().splitlines()]
    at = {r["step"]: r for r in records}
    last, plain = records[-1], [at[step] for steps in PLAIN for step in steps]
    if any(r["resolution"] != last["resolution"] for r in plain):
        sys.exit(f"figures.py: some of the steps {PLAIN} of {run} are not on the finest grid")
    count = sum(end - start for start, end in PLAIN)
    cpu = sum(trained.cpu_at(trained.begun + at[end]["seconds"]) - trained.cpu_at(trained.begun + at[start]["seconds"]) for start, end in PLAIN)
    checkpoint = (run / "checkpoint.safetensors").stat().st_size
    scored = Watched([binary, "eval", str(run), "--threads", str(threads), "--json", "--quiet"])
    if scored.code:
        sys.exit(f"figures.py: exit code {scored.code} of eval {run}\n{''.join(scored.lines)}")
    return {
        "cpu_s_per_step": cpu / count,
        "wall_s_per_step": sum(at[end]["seconds"] - at[start]["seconds"] for start, end in PLAIN) / count,
        "samples_per_ray": sum(at[end]["samples_per_ray"] for _, end in PLAIN) / len(PLAIN),
        "batch": point if axis == "rays" else BATCH,
        "voxels": last["voxels"],
        "resolution": last["resolution"],
        "filled": last["voxels"] / math.prod(json.loads(scored.output)["run"]["resolution"]),
        "peak": max(trained.peak, scored.peak),
        "checkpoint": checkpoint,
    }


def forecast(binary: str, axis: str, point: int, bent: bool, data: Path) -> dict:
    command = [binary, "inspect", str(data), "--json", *options(axis, point, bent, data)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)["forecast"]


def measured(binary: str, out: Path, given: argparse.Namespace, rows: dict) -> dict:
    """All rows, measured where they are missing."""
    path, again = out / "rows.json", given.again.split(",")
    rows = json.loads(path.read_text()) if path.exists() else rows
    rows = {name: row for name, row in rows.items() if name.partition("/")[0] not in again}
    for axis in given.axes.split(","):
        for bent in (False, True) if axis in BENT else (False,):
            for point in points(axis, bent):
                name = f"{axis}/{'bent' if bent else 'straight'}/{point}"
                if same := next((n for n in rows if n != name and run_of(n) == run_of(name)), None):
                    rows.setdefault(name, dict(rows[same]))
                if name in rows and not given.forecast:
                    continue
                data = scene(binary, out / "data", axis, point, bent)
                if name not in rows:
                    print(name, file=sys.stderr, flush=True)
                    rows[name] = measure_one(binary, axis, point, bent, data, out / "run") | stamp()
                rows[name]["forecast"] = {"peak": forecast(binary, axis, point, bent, data)["peak"]}
                put(path, json.dumps(rows, indent=1))
    shutil.rmtree(out / "run", ignore_errors=True)
    return rows


def run_of(name: str) -> tuple:
    """What tells the run of a row from others."""
    axis, kind, point = name.split("/")
    scene_of_its_own = (axis, point) if axis in ("pixels", "views") else ("", "")
    threads = int(point) if axis == "threads" else 2
    return *scene_of_its_own, threads, *options(axis, int(point), kind == "bent", Path(kind))


# Plots

BLUE, ORANGE, GREY = "#0072b2", "#d55e00", "#686c76"
LABELS = {
    "voxels": "nodes along the longest edge",
    "rays": "rays of a step",
    "pixels": "edge of the photographs [pixel]",
    "views": "photographs",
    "threads": "threads",
}


def series(rows: dict, axis: str, bent: bool) -> list[tuple[int, dict]]:
    kind = "bent" if bent else "straight"
    return [(point, rows[f"{axis}/{kind}/{point}"]) for point in points(axis, bent)]


def plot(rows: dict, axis: str, out: Path) -> None:
    """Time of a step and memory over one axis, both axes logarithmic: a straight line of slope 1 is proportional."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "growth", "font.size": 9, "axes.spines.top": False})
    matplotlib.rcParams.update({"axes.spines.right": False, "axes.grid": True, "grid.color": "#e4e6eb", "axes.edgecolor": GREY})
    from matplotlib import pyplot
    from matplotlib.ticker import NullFormatter, StrMethodFormatter

    figure, (left, right) = pyplot.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
    for bent in (False, True) if axis in BENT else (False,):
        shown = series(rows, axis, bent)
        x, name, colour = [p for p, _ in shown], "bent rays" if bent else "straight rays", ORANGE if bent else BLUE
        left.plot(x, [1e3 * r["cpu_s_per_step"] for _, r in shown], "o-", color=colour, label=name, markersize=4)
        right.plot(x, [r["peak"] / MIB for _, r in shown], "o-", color=colour, label=f"{name}, measured", markersize=4)
        forecasts = [r["forecast"]["peak"] / MIB for _, r in shown]
        right.plot(x, forecasts, "x:", color=colour, label=f"{name}, forecast", markersize=5)
    left.set_title("Processor time of a step [ms]", loc="left", fontsize=9, fontweight="bold")
    right.set_title("Peak of resident memory [MiB]", loc="left", fontsize=9, fontweight="bold")
    for side in (left, right):
        side.set_xscale("log")
        side.set_yscale("log")
        side.set_xlabel(LABELS[axis])
        side.set_xticks(AXES[axis], [f"{n}" for n in AXES[axis]])
        side.xaxis.set_minor_formatter(NullFormatter())
        side.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        side.legend(frameon=False, fontsize=8)
    figure.savefig(out, metadata={"Date": None, "Creator": None})
    pyplot.close(figure)


# Page


def table(rows: dict, axis: str, head: str) -> str:
    lines = [
        f"| {head} | voxels stored | samples per ray | a step [CPU ms] | a sample [CPU ns] | rays per CPU second | peak [MiB] | forecast [MiB] | forecast/peak | checkpoint [MiB] |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for bent in (False, True) if axis in BENT else (False,):
        for point, r in series(rows, axis, bent):
            step = r["cpu_s_per_step"]
            name = f"{point:,}" + (", bent" if bent else "")
            cells = [
                name,
                f"{r['voxels']:,}",
                f"{r['samples_per_ray']:.1f}",
                f"{1e3 * step:.0f}",
                f"{1e9 * step / (r['batch'] * r['samples_per_ray']):.0f}",
                f"{r['batch'] / step:,.0f}",
                f"{r['peak'] / MIB:,.0f}",
                f"{r['forecast']['peak'] / MIB:,.0f}",
                f"{r['forecast']['peak'] / r['peak']:.2f}",
                f"{r['checkpoint'] / MIB:,.0f}",
            ]
            lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def growth(rows: dict, axis: str, bent: bool, value, last: int = 2) -> float:
    """The exponent p of value ~ point^p between the first and the last of the `last` largest points."""
    (x0, r0), *_, (x1, r1) = series(rows, axis, bent)[-last:]
    return math.log(value(r1) / value(r0)) / math.log(x1 / x0)


def fitted(rows: dict) -> tuple[float, float]:
    """ns per sample and ns per stored voxel of a straight step, by least squares of relative errors over voxels and rays."""
    straight = [r for axis in ("voxels", "rays") for _, r in series(rows, axis, False)]
    terms = [(r["batch"] * r["samples_per_ray"] / r["cpu_s_per_step"], r["voxels"] / r["cpu_s_per_step"]) for r in straight]
    ss, sv, vv = (sum(a * b for a, b in pairs) for pairs in (
        [(s, s) for s, _ in terms], [(s, v) for s, v in terms], [(v, v) for _, v in terms]))
    s1, v1 = sum(s for s, _ in terms), sum(v for _, v in terms)
    det = ss * vv - sv * sv
    return 1e9 * (s1 * vv - v1 * sv) / det, 1e9 * (v1 * ss - s1 * sv) / det


# Bytes of colour that a sample reads, docs/speed.md: 16 lines of 64 bytes. A voxel that moves is read and written.
SAMPLE_BYTES = 16 * 64
VOXEL_BYTES = 2 * 140
MODEL_THREADS = [1, 2, 8, 64]
# Theoretical bandwidth of twelve channels of DDR5-4800 [GB/s].
SERVER = 12 * 4.8 * 8
TV_PERIOD = 16
# The default of `run.memory` [GiB].
RUN_MEMORY = 8


def at(rows: dict, axis: str, point: int, bent: bool = False) -> dict:
    return rows[f"{axis}/{'bent' if bent else 'straight'}/{point}"]


def errors(rows: dict) -> tuple[str, str]:
    """The range of forecast / peak, and the points where it is off by more than 15 %."""
    ratios = {name: r["forecast"]["peak"] / r["peak"] for name, r in rows.items()}
    far = [f"{name.split('/')[0]} {name.split('/')[2]} ({ratio:.2f})" for name, ratio in ratios.items() if abs(ratio - 1) > 0.15]
    return f"{min(ratios.values()):.2f} to {max(ratios.values()):.2f}", ", ".join(far)


def traffic(rows: dict) -> str:
    """A model, not a measurement: bytes from memory, if no sample finds its voxels in a cache and threads never wait."""
    r = at(rows, "threads", 1)
    samples = r["batch"] * r["samples_per_ray"]
    per_sample = SAMPLE_BYTES + VOXEL_BYTES * r["voxels"] / TV_PERIOD / samples
    rate = samples / r["cpu_s_per_step"]
    lines = ["| threads | million samples per second | GB/s |", "|---|---|---|"]
    lines += [f"| {n} | {n * rate / 1e6:.1f} | {n * rate * per_sample / 1e9:.1f} |" for n in MODEL_THREADS]
    n = MODEL_THREADS[-1]
    share = n * rate * per_sample / 1e9 / SERVER
    verdict = f"{n} threads would need {share:.0%} of it" + (
        "" if share <= 1 else f", and memory would bound them at {n / share:.0f}"
    )
    model = (
        f"**A model, not measured:** the memory traffic of {n} threads. A sample reads {SAMPLE_BYTES:,} bytes of colour "
        f"([speed.md](speed.md)). In a step total variation also moves one in {TV_PERIOD} stored voxels, which is read and written, "
        f"{VOXEL_BYTES} bytes: {r['voxels'] / TV_PERIOD / samples:.1f} voxels for each sample here. That makes {per_sample:,.0f} bytes per sample "
        f"if nothing is found in a cache. One thread makes {rate / 1e6:.1f} million samples per second, and others are taken to be as fast:"
    )
    verdict = (
        f"Twelve channels of DDR5-4800 have {SERVER:.0f} GB/s in theory: {verdict}. The model leaves out the records of "
        "the backward pass, parts of a step that one thread does alone, and caches: the truth may lie on either side."
    )
    return "\n\n".join([textwrap.fill(model, 140), "\n".join(lines), textwrap.fill(verdict, 140)]) + "\n"


def commands(rows: dict) -> str:
    word = lambda settings: " ".join(f"--set {k}={v}" for k, v in settings.items())
    return f"""```sh
refraxel synth opaque --out opaque --size {SIZE} --views {VIEWS} --spp {SPP["opaque"]} --detail-spp 0 --index-resolution 0
refraxel synth glass_ball --out glass_ball --size {SIZE} --views {VIEWS} --spp {SPP["glass_ball"]} --detail-spp 0 --index-resolution 0
refraxel train opaque --out run --seed 0 --threads 2 --refraction off \\
  {word(SCHEDULE)} --set grid.resolution=NODES --set run.batch=RAYS
refraxel train glass_ball --out run --seed 0 --threads 2 --index-from glass_ball/scene.json \\
  {word(SCHEDULE)} --set grid.resolution=NODES --set run.batch=RAYS \\
  {word(BENDING)}
refraxel eval run --threads 2
refraxel inspect opaque --json …                         # the options of the run
docs/figures.py growth OUT --publish                     # all of this page
```"""


def page(rows: dict) -> str:
    large, small = at(rows, "voxels", AXES["voxels"][-1]), at(rows, "voxels", AXES["voxels"][0])
    sample, voxel = fitted(rows)
    seconds = lambda r: r["cpu_s_per_step"]
    most, least = at(rows, "rays", AXES["rays"][-1]), at(rows, "rays", AXES["rays"][0])
    many, few = at(rows, "views", AXES["views"][-1]), at(rows, "views", AXES["views"][0])
    big, little = at(rows, "pixels", AXES["pixels"][-1]), at(rows, "pixels", AXES["pixels"][0])
    one, two = at(rows, "threads", 1), at(rows, "threads", 2)
    between, far = errors(rows)
    limit = large["voxels"] * 140 / GIB
    within = f", and the largest grid, of {limit:.1f} GiB with its moments, is within `run.memory` ({RUN_MEMORY} GiB):\nno resolution was lowered" if limit <= RUN_MEMORY else ""
    asked = AXES["voxels"][-1]
    per_further = (large["peak"] - small["peak"]) / (large["voxels"] - small["voxels"])
    per_voxel = lambda r: r["checkpoint"] / r["voxels"]
    ray_slope = (most["peak"] - least["peak"]) / (most["batch"] - least["batch"])
    fit = (
        f"stores {large['filled']:.0%} of its voxels and needs {large['peak'] / GIB:.1f} GiB"
        if large["resolution"] == asked
        else f"is lowered to {large['resolution']} nodes to fit `run.memory`"
    )
    return f"""# How time and memory grow

How a training step and the memory of a run grow with voxels, rays, pixels, views and threads, and their bounds. All figures were
measured on one machine ({large["machine"]}), *shared with other work*, so wall-clock times mean nothing; revision {large.get("revision", "not recorded")}. Times are processor time of the process
(user and system), memory is the largest resident size of training and scoring. There is one run of each, with a field of degree 2.

A run is planned for {STEPS} steps in the three stages of the defaults and stopped after {LAST}. Time is measured over the steps
{" and ".join(f"{a + 1} to {b}" for a, b in PLAIN)}: on the finest grid, without validation. Straight rays learn the scene `opaque`, bent rays the scene
`glass_ball` with its true index, so that no search runs. If an axis does not say otherwise, the grid has {RESOLUTION} nodes along its longest edge,
a step {BATCH:,} rays, and there are {VIEWS} photographs of {SIZE} × {SIZE} pixels. The scenes keep one view to score and one to validate. Both
axes of the plots are logarithmic.

{commands(rows)}

*Forecast* is `forecast.peak` of `refraxel inspect` with the same options. Over all rows it is {between} of the measured
peak. {"It is off by more than 15 % at: " + far + "." if far else "It is nowhere off by more than 15 %."} Its constants
were fitted to these same rows, so other scenes will differ more. Checkpoints are those of interrupted runs, which keep colour in single
precision. Runs of more than a minute were saved once, and a save may lie within the steps that were measured.

## Voxels

![Time and memory over the resolution of the grid](pictures/growth_voxels.svg)

{table(rows, "voxels", "nodes")}

A grid of {asked} nodes {fit}. The voxels stored grow with the power {growth(rows, "voxels", False, lambda r: r["voxels"], 3):.2f} of the resolution over the last
three points (bent rays: {growth(rows, "voxels", True, lambda r: r["voxels"], 3):.2f}), not 3: voxels that survive pruning lie around surfaces. Memory is
{per_further:.0f} bytes for each further voxel: twice its parameters and moments, because training keeps a copy to return to, and the
gradients of total variation. So memory bounds the resolution{within}. A checkpoint takes {per_voxel(large):.0f} bytes per voxel.

A step takes {seconds(large) / seconds(small):.0f} times as long on the largest grid as on the smallest, where the voxels stored are {large["voxels"] / small["voxels"]:.0f} times as many:
a ray crosses more voxels, and total variation visits one in {TV_PERIOD} of all that are stored. By least squares over all straight rows of
this axis and the next, a step costs {sample:.0f} ns per sample and {voxel:.1f} ns per stored voxel; on the largest grid the latter are
{voxel * 1e-9 * large["voxels"] / seconds(large):.0%} of it.

## Rays

![Time and memory over the rays of a step](pictures/growth_rays.svg)

{table(rows, "rays", "rays")}

From {AXES["rays"][0]:,} to {AXES["rays"][-1]:,} rays a step takes {seconds(most) / seconds(least):.1f} times as long, for {AXES["rays"][-1] // AXES["rays"][0]} times as many rays (bent:
{seconds(at(rows, "rays", AXES["rays"][-1], True)) / seconds(at(rows, "rays", AXES["rays"][0], True)):.1f} times). Small batches are bound by the work of a step on
voxels, which does not depend on its rays; over the last two points the time grows with the power {growth(rows, "rays", False, seconds):.2f} (bent: {growth(rows, "rays", True, seconds):.2f}). A further ray takes
{ray_slope / 1024:.1f} KiB of memory.

## Pixels

![Time and memory over the edge of the photographs](pictures/growth_pixels.svg)

{table(rows, "pixels", "edge")}

{PIXEL_VIEWS} photographs, rendered by `synth` with one sample per pixel (above {LARGEST_SYNTH} pixels enlarged from half the edge), read as they are (no
`--downscale`), and a grid of {PIXEL_RESOLUTION} nodes. A step of the largest photographs takes
{seconds(big) / seconds(little):.2f} times the processor time of one of the smallest, for {(AXES["pixels"][-1] // AXES["pixels"][0]) ** 2} times as many pixels.
Memory grows by {(big["peak"] - little["peak"]) / (AXES["pixels"][-1] ** 2 - AXES["pixels"][0] ** 2):.0f} bytes for each pixel by which all photographs are larger: {PIXEL_VIEWS} photographs to
learn from and one that validates take 3 bytes each, and the forecast attributes the rest to the scoring of a view. Few views leave haze between
the surfaces, so that {big["filled"]:.0%} of the voxels are stored.

## Views

![Time and memory over the number of photographs](pictures/growth_views.svg)

{table(rows, "views", "photographs")}

A step takes the same time: {1e3 * seconds(few):.0f} ms with {AXES["views"][0]} photographs, {1e3 * seconds(many):.0f} ms with {AXES["views"][-1]:,}. Without the voxels,
which are taken off by the bytes per voxel above, memory grows by
{(many["peak"] - few["peak"] - per_further * (many["voxels"] - few["voxels"])) / (AXES["views"][-1] - AXES["views"][0]) / SIZE**2:.1f} bytes per pixel of a photograph; decoded, it has 3.

## Threads

![Time and memory over the number of threads](pictures/growth_threads.svg)

{table(rows, "threads", "threads")}

Two threads use {seconds(two) / seconds(one):.2f} times the processor time of one for the same step. The machine has no more cores.

{traffic(rows)}"""


def arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--axes", default=",".join(AXES), help="measure these axes where they are missing")
    parser.add_argument("--again", default="", help="measure these axes anew, with commas")
    parser.add_argument("--forecast", action="store_true", help="ask the program for all forecasts anew")


def measure(given: argparse.Namespace, before: dict) -> tuple[dict, dict[Path, str]]:
    out = folder(given.out)
    rows = measured(program(), out, given, before.get("rows", {}))
    missing = [axis for axis in AXES if any(f"{axis}/straight/{point}" not in rows for point in AXES[axis])]
    if missing:
        sys.exit(f"figures.py: {out}/rows.json has no figures yet of {', '.join(missing)}")
    pictures = {folder(out / "pictures") / f"growth_{axis}.svg": f"pictures/growth_{axis}.svg" for axis in AXES}
    for axis, path in zip(AXES, pictures, strict=True):
        plot(rows, axis, path)
    return {"rows": rows}, pictures


def blocks(figures: dict) -> dict[str, str]:
    return {"growth": page(figures["rows"]).partition("\n\n")[2].rstrip("\n")}

// The ray that was clicked: seen from the side, and in numbers.

import { el } from "./dom";
import { BENT, STRAIGHT } from "./overlay";
import type { BentRay, SceneFacts } from "./protocol";
import { add, cross, dot, length, scale, sub, unit, type Vec3 } from "./vectors";

const SIZE: [number, number] = [560, 280];

const fixed = (x: number, digits: number) => x.toFixed(digits);

/** The colour that a ray shows. */
function swatch({ colour: [r, g, b] }: BentRay): HTMLElement {
  const made = el("i", { class: "swatch", title: `red ${r}, green ${g}, blue ${b}` });
  made.style.background = `rgb(${r} ${g} ${b})`;
  return made;
}

/** The ray in a line. */
export function summary(ray: BentRay): HTMLElement {
  const surfaces = ray.bounces.length === 1 ? "1 surface" : `${ray.bounces.length} surfaces`;
  const sees = ray.seen ? `sees ${fixed(ray.seen[0], 2)} along` : "sees the background";
  const text = `Ray: ${surfaces}, turned by ${fixed(ray.turned, 1)}°, densest index ${fixed(ray.densest, 3)}, ${sees}`;
  return el("span", {}, text, " ", swatch(ray));
}

export function describe(ray: BentRay, scene: SceneFacts): HTMLElement {
  const facts: [string, string][] = [
    ["turned by", `${fixed(ray.turned, 2)}°`],
    ["densest index", fixed(ray.densest, 3)],
    ["light is late by", fixed(ray.late, 3)],
    ["sees", ray.seen ? `${fixed(ray.seen[0], 3)} along` : "the background"],
    ["opacity on the way", fixed(ray.opacity, 2)],
  ];
  const list = el("dl", { class: "facts" });
  facts.forEach(([name, value]) => list.append(el("dt", {}, name), el("dd", {}, value)));
  list.querySelectorAll("dd")[3]!.append(" ", swatch(ray));
  const parts: HTMLElement[] = [side(ray, scene), list];
  if (ray.bounces.length > 0) parts.push(table(ray));
  else
    parts.push(
      el(
        "p",
        { class: "hint" },
        ray.turned > 0.01
          ? "It meets no sharp surface: the index changes smoothly."
          : "It meets nothing refractive, and is straight.",
      ),
    );
  if (!ray.is_whole) parts.push(el("p", { class: "hint" }, "Its path was given up before it left the glass."));
  return el("div", {}, ...parts);
}

function table(ray: BentRay): HTMLElement {
  const head = el("tr", {}, ...["", "index", "angle", "mirrored"].map((t) => el("th", {}, t)));
  const rows = ray.bounces.map((b, k) => {
    const angle = b.total ? `${fixed(b.angle[0], 1)}° total` : `${fixed(b.angle[0], 1)}° → ${fixed(b.angle[1], 1)}°`;
    const cells = [
      String(k + 1),
      `${fixed(b.index[0], 3)} → ${fixed(b.index[1], 3)}`,
      angle,
      `${fixed(100 * b.reflectance, 1)} %`,
    ];
    return el("tr", {}, ...cells.map((t) => el("td", {}, t)));
  });
  return el("table", {}, head, ...rows);
}

/** The ray in the plane in which it bends most: the camera is on the left. */
function side(ray: BentRay, scene: SceneFacts): HTMLCanvasElement {
  const canvas = el("canvas", {
    width: String(SIZE[0]),
    height: String(SIZE[1]),
    role: "img",
    "aria-label": "The ray from the side",
  });
  const ctx = canvas.getContext("2d")!;
  const start = ray.points[0]!;
  const ahead = unit(sub(ray.straight[1], ray.straight[0]));
  const across = (x: Vec3) => sub(sub(x, start), scale(ahead, dot(sub(x, start), ahead)));
  const off = ray.points.map(across).reduce((a, b) => (length(b) > length(a) ? b : a));
  const any = unit(cross(ahead, Math.abs(ahead[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]));
  const upward = length(off) > 1e-6 ? unit(off) : any;
  const inPlane = (x: Vec3): [number, number] => [dot(sub(x, start), ahead), dot(sub(x, start), upward)];
  // Shown: the regions on the way with a margin, else the whole.
  const middles = scene.regions.map((r) => scale(add(r.min, r.max), 0.5));
  const extents = scene.regions.map((r) => 0.5 * length(sub(r.max, r.min)));
  const marks = ray.bounces.map((b) => inPlane(b.place));
  const near = middles.flatMap((m, k) => [inPlane(m)[0] - extents[k]!, inPlane(m)[0] + extents[k]!]);
  const end = inPlane(ray.straight[1])[0];
  const low = near.length ? Math.min(...near, ...marks.map((m) => m[0])) : 0;
  const high = near.length ? Math.max(...near, ...marks.map((m) => m[0])) : end;
  const unitPixels = (SIZE[0] - 20) / Math.max(high - low, 1e-9);
  const at = ([x, y]: [number, number]): [number, number] => [
    10 + (x - low) * unitPixels,
    0.5 * SIZE[1] - y * unitPixels + 0.2 * SIZE[1],
  ];
  const line = (points: Vec3[], colour: string, width: number, dash: number[]) => {
    ctx.beginPath();
    points.forEach((p, k) => (k ? ctx.lineTo(...at(inPlane(p))) : ctx.moveTo(...at(inPlane(p)))));
    ctx.strokeStyle = colour;
    ctx.lineWidth = width;
    ctx.setLineDash(dash);
    ctx.stroke();
  };
  line(ray.straight, STRAIGHT, 2, [8, 6]);
  line(ray.points, BENT, 4, []);
  const ink = getComputedStyle(document.body).color;
  ctx.font = "600 22px system-ui, sans-serif";
  marks.forEach((mark, k) => {
    const [x, y] = at(mark);
    ctx.beginPath();
    ctx.arc(x, y, 7, 0, 2 * Math.PI);
    ctx.fillStyle = BENT;
    ctx.fill();
    ctx.fillStyle = ink;
    ctx.fillText(String(k + 1), x + 8, y - 10);
  });
  return canvas;
}

// Lines over the picture: rays, boxes, cameras, the plane of a slice, a distance.

import { projectLine, project } from "./camera";
import { distanceOf } from "./measure";
import type { Piece } from "./drawings";
import type { BentRay, PageCamera, SceneFacts } from "./protocol";
import { add, dot, length, scale, sub, type Vec3 } from "./vectors";

export const BENT = "#e8590c";
export const STRAIGHT = "#8b93a1";
const BOX = "#2f9e73";
const CAMERA = "#3b82c4";
const PLANE = "#b0478f";
const MEASURE = "#6741d9";
/** Colours of lines on the far side of something, and on its near side. */
const SURFACE = ["rgb(13 116 110 / 28%)", "rgb(13 116 110 / 90%)"] as const;
const HULL = ["rgb(224 49 49 / 25%)", "rgb(224 49 49 / 80%)"] as const;
const BRICKS = "rgb(59 130 196 / 55%)";

export interface Overlay {
  ray: BentRay | null;
  boxes: boolean;
  cameras: boolean;
  plane: Vec3[] | null;
  surfaces: Piece[];
  hull: Piece[];
  /** Lines around what the grid stores. */
  bricks: [Vec3, Vec3][];
  path: Vec3[];
  /** Keyframes of the path. */
  keys: PageCamera[];
  /** Ends of a distance. */
  ends: Vec3[];
  /** The box outside of which nothing opaque is shown. */
  crop: [Vec3, Vec3] | null;
}

/** Draws everything as a camera sees it. `unit` is the pixels of the canvas per CSS pixel. */
export function draw(
  ctx: CanvasRenderingContext2D,
  camera: PageCamera,
  scene: SceneFacts,
  what: Overlay,
  unit: number,
): void {
  const pen = new Pen(ctx, camera, unit);
  if (what.boxes) {
    pen.box(scene.min, scene.max, STRAIGHT, 1);
    for (const region of scene.regions) pen.box(region.min, region.max, BOX, 1.5);
  }
  if (what.crop) pen.box(...what.crop, PLANE, 1);
  const size = 0.05 * Math.hypot(...sub(scene.max, scene.min));
  if (what.cameras) {
    scene.views.forEach((view) => pen.frustum(view.camera, size, view.split === "train" ? CAMERA : BENT));
  }
  pen.lines(what.bricks, BRICKS);
  pen.surface(what.hull, HULL);
  pen.surface(what.surfaces, SURFACE);
  if (what.plane) pen.loop(what.plane, PLANE, 1.5);
  if (what.path.length > 1) pen.line(what.path, CAMERA, 2);
  what.keys.forEach((key, k) => {
    // That of where the camera is would be a line around the picture.
    if (length(sub(key.eye, camera.eye)) < size) return;
    pen.frustum(key, size, PLANE);
    pen.dot(key.eye, PLANE, 4, String(k + 1));
  });
  if (what.ray) pen.ray(what.ray);
  pen.distance(what.ends);
}

class Pen {
  constructor(
    private readonly ctx: CanvasRenderingContext2D,
    private readonly camera: PageCamera,
    private readonly unit: number,
  ) {}

  line(points: Vec3[], colour: string, width: number, dashed = false): void {
    const { ctx } = this;
    ctx.beginPath();
    for (let k = 0; k + 1 < points.length; k++) {
      const line = projectLine(this.camera, points[k]!, points[k + 1]!);
      if (!line) continue;
      ctx.moveTo(...line[0]);
      ctx.lineTo(...line[1]);
    }
    ctx.setLineDash(dashed ? [6 * this.unit, 5 * this.unit] : []);
    ctx.lineCap = "round";
    for (const [style, extra] of [
      ["rgb(255 255 255 / 65%)", 2],
      [colour, 0],
    ] as const) {
      ctx.strokeStyle = style;
      ctx.lineWidth = (width + extra) * this.unit;
      ctx.stroke();
    }
    ctx.setLineDash([]);
  }

  loop(corners: Vec3[], colour: string, width: number): void {
    this.line([...corners, corners[0]!], colour, width);
  }

  box(min: Vec3, max: Vec3, colour: string, width: number): void {
    const corner = (k: number): Vec3 => [k & 1 ? max[0] : min[0], k & 2 ? max[1] : min[1], k & 4 ? max[2] : min[2]];
    for (let k = 0; k < 8; k++)
      for (const axis of [1, 2, 4]) if (!(k & axis)) this.line([corner(k), corner(k | axis)], colour, width);
  }

  frustum({ eye, axes, angle, size }: PageCamera, length: number, colour: string): void {
    const half = Math.tan(0.5 * angle) * length;
    const tall = (half * size[1]) / size[0];
    const corner = (x: number, y: number): Vec3 =>
      add(add(add(eye, scale(axes[2], length)), scale(axes[0], x * half)), scale(axes[1], y * tall));
    const corners = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
    this.loop(corners, colour, 1);
    corners.forEach((c) => this.line([eye, c], colour, 1));
  }

  ray(ray: BentRay): void {
    this.line(ray.straight, STRAIGHT, 1.5, true);
    this.line(ray.points, BENT, 2.5);
    ray.bounces.forEach((bounce, k) => this.dot(bounce.place, BENT, 4, String(k + 1)));
    if (ray.seen) this.dot(ray.seen[1], `rgb(${ray.colour.join(" ")})`, 6);
  }

  /** The line between two places with its length. */
  distance(ends: Vec3[]): void {
    if (ends.length > 1) this.line(ends, MEASURE, 2);
    ends.forEach((end, k) => this.dot(end, MEASURE, 4, (k === 1 && distanceOf(ends)) || undefined));
  }

  /** Lines on a surface: those on its far side are faint. */
  surface(pieces: Piece[], [far, near]: readonly [string, string]): void {
    const isNear = ({ ends, normal }: Piece) => dot(normal, sub(this.camera.eye, ends[0])) > 0;
    const ends = (some: Piece[]) => some.map((piece) => piece.ends);
    this.lines(ends(pieces.filter((piece) => !isNear(piece))), far);
    this.lines(ends(pieces.filter(isNear)), near);
  }

  /** Many thin lines. */
  lines(lines: [Vec3, Vec3][], colour: string): void {
    const { ctx } = this;
    ctx.beginPath();
    for (const ends of lines) {
      const line = projectLine(this.camera, ...ends);
      if (!line) continue;
      ctx.moveTo(...line[0]);
      ctx.lineTo(...line[1]);
    }
    ctx.strokeStyle = colour;
    ctx.lineWidth = this.unit;
    ctx.stroke();
  }

  dot(place: Vec3, colour: string, radius: number, label?: string): void {
    const { at, depth } = project(this.camera, place);
    if (depth <= 0) return;
    const { ctx, unit } = this;
    ctx.beginPath();
    ctx.arc(...at, radius * unit, 0, 2 * Math.PI);
    ctx.fillStyle = colour;
    ctx.strokeStyle = "white";
    ctx.lineWidth = 1.5 * unit;
    ctx.fill();
    ctx.stroke();
    if (!label) return;
    ctx.font = `600 ${12 * unit}px system-ui, sans-serif`;
    ctx.lineWidth = 3 * unit;
    ctx.strokeText(label, at[0] + 7 * unit, at[1] - 6 * unit);
    ctx.fillText(label, at[0] + 7 * unit, at[1] - 6 * unit);
  }
}

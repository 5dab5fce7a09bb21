// The camera of the page: where it is, what it turns around, and how points of the world come into its picture.

import type { PageCamera } from "./protocol";
import { add, cross, dot, length, mix, scale, sub, turn, unit, type Vec3 } from "./vectors";

/** The camera may look up or down as far as this from the horizon [rad]. */
const STEEPEST = 1.54;
/** Fields of view that the program takes [rad]. */
const ANGLES: [number, number] = [0.01, 2.8];
/** Bounds on the distance to the pivot, and on that from the middle of the scene [diagonal of the scene]. */
const [NEAREST, FARTHEST] = [1e-3, 10];
/** A start that is farther away than that may be left by so much [distance from the middle of the scene]. */
const BEYOND_START = 3;

/** A place to come back to. */
export interface Place {
  eye: Vec3;
  axes: [Vec3, Vec3, Vec3];
  distance: number;
  /** Field of view across the shorter edge [rad]. */
  view: number;
}

export class Camera {
  eye: Vec3 = [0, 0, -1];
  axes: [Vec3, Vec3, Vec3] = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ];
  /** Distance to the point that the camera turns around [scene unit]. */
  distance = 1;
  up: Vec3 = [0, 0, 1];
  /** The horizon stays level; else the camera turns freely about its own axes. */
  isLevel = true;
  /** Focal length [pixel of the reference picture]. */
  private focal = 1;
  /** Size of the picture that every other picture shows all of [pixel]. */
  private reference: [number, number] = [1, 1];
  private middle: Vec3 = [0, 0, 0];
  private bounds: [number, number] = [1e-6, 1e6];

  /** Goes where another camera is. */
  take(camera: PageCamera, pivot: Vec3): void {
    this.eye = [...camera.eye];
    this.axes = camera.axes.map((a) => [...a]) as [Vec3, Vec3, Vec3];
    this.reference = [...camera.size];
    this.focal = (0.5 * camera.size[0]) / Math.tan(0.5 * camera.angle);
    const ahead = dot(sub(pivot, this.eye), this.axes[2]);
    this.setDistance(ahead > 0 ? ahead : length(sub(pivot, this.eye)));
  }

  /** Stays so near to a scene that it can be seen, and so far from the pivot that it can move. */
  stayNear(min: Vec3, max: Vec3, start: Vec3): void {
    const diagonal = length(sub(max, min));
    this.middle = mix(min, max, 0.5);
    const begin = length(sub(start, this.middle));
    this.bounds = [NEAREST * diagonal, Math.max(FARTHEST * diagonal, BEYOND_START * begin)];
  }

  get place(): Place {
    return structuredClone({ eye: this.eye, axes: this.axes, distance: this.distance, view: this.view });
  }

  goTo({ eye, axes, distance, view }: Place): void {
    [this.eye, this.axes] = structuredClone([eye, axes]);
    this.setDistance(distance);
    this.view = view;
  }

  get pivot(): Vec3 {
    return add(this.eye, scale(this.axes[2], this.distance));
  }

  /** Field of view across the shorter edge of the reference picture [rad]. */
  get view(): number {
    return 2 * Math.atan((0.5 * Math.min(...this.reference)) / this.focal);
  }

  set view(angle: number) {
    this.focal = (0.5 * Math.min(...this.reference)) / Math.tan(0.5 * clamp(angle, ANGLES));
  }

  /** Turns around another point, which comes to the middle. */
  lookAt(pivot: Vec3): void {
    this.axes = this.facing(unit(sub(pivot, this.eye)));
    this.setDistance(length(sub(pivot, this.eye)));
  }

  /** Looks in the same direction at a box, which fills the picture. */
  frame(min: Vec3, max: Vec3): void {
    const middle = mix(min, max, 0.5);
    const [right, down, forward] = this.axes;
    // From where a corner is at the edge of the picture.
    const needed = (k: number) => {
      const corner = sub([k & 1 ? max[0] : min[0], k & 2 ? max[1] : min[1], k & 4 ? max[2] : min[2]], middle);
      const aside = Math.max(Math.abs(dot(corner, right)), Math.abs(dot(corner, down)));
      return aside / Math.tan(0.5 * this.view) - dot(corner, forward);
    };
    this.setDistance(Math.max(...Array.from({ length: 8 }, (_, k) => needed(k))));
    this.eye = sub(middle, scale(forward, this.distance));
  }

  /** Turns around the pivot until it looks in a direction. */
  lookAlong(direction: Vec3): void {
    const pivot = this.pivot;
    this.axes = this.facing(unit(direction));
    this.eye = sub(pivot, scale(this.axes[2], this.distance));
  }

  /** Puts the horizon level. */
  level(): void {
    const pivot = this.pivot;
    const height = Math.asin(clamp(dot(this.axes[2], this.up), [-1, 1]));
    const right = this.facing(this.axes[2])[0];
    this.axes = this.facing(unit(turn(this.axes[2], right, clamp(height, [-STEEPEST, STEEPEST]) - height)));
    this.eye = sub(pivot, scale(this.axes[2], this.distance));
  }

  private facing(forward: Vec3): [Vec3, Vec3, Vec3] {
    const sideways = cross(forward, this.up);
    const right = unit(length(sideways) > 1e-6 ? sideways : this.acrossOwn(forward));
    return [right, unit(cross(forward, right)), forward];
  }

  /** Across a direction along the vertical, which leaves that open: as near to the own right as can be. */
  private acrossOwn(forward: Vec3): Vec3 {
    const part = (axis: Vec3) => sub(axis, scale(forward, dot(axis, forward)));
    const [right, down] = [part(this.axes[0]), part(this.axes[1])];
    return length(right) > 0.5 ? right : down;
  }

  /** Around the pivot [rad]. */
  orbit(yaw: number, pitch: number): void {
    const pivot = this.pivot;
    this.axes = this.isLevel ? this.levelled(yaw, pitch) : this.tumbled(yaw, pitch);
    this.eye = sub(pivot, scale(this.axes[2], this.distance));
  }

  private levelled(yaw: number, pitch: number): [Vec3, Vec3, Vec3] {
    const forward = turn(this.axes[2], this.up, yaw);
    const height = Math.asin(clamp(dot(forward, this.up), [-1, 1]));
    const wanted = clamp(height + pitch, [-STEEPEST, STEEPEST]);
    const right = this.facing(forward)[0];
    return this.facing(unit(turn(forward, right, wanted - height)));
  }

  private tumbled(yaw: number, pitch: number): [Vec3, Vec3, Vec3] {
    const [right, down, forward] = this.axes;
    const turned = (a: Vec3) => turn(turn(a, down, -yaw), right, pitch);
    const ahead = unit(turned(forward));
    const across = turned(right);
    const x = unit(sub(across, scale(ahead, dot(across, ahead))));
    return [x, cross(ahead, x), ahead];
  }

  /** Looks elsewhere from the same place [rad]. */
  look(yaw: number, pitch: number): void {
    const eye = this.eye;
    this.orbit(yaw, pitch);
    this.eye = eye;
  }

  /** To the right and downwards, in shorter edges of what is seen at the pivot. */
  pan(right: number, down: number): void {
    const width = (this.distance * Math.min(...this.reference)) / this.focal;
    this.goBy(add(scale(this.axes[0], right * width), scale(this.axes[1], down * width)));
  }

  /** Nearer to the pivot by a factor. */
  dolly(factor: number): void {
    const [nearest, farthest] = this.bounds;
    const distance = clamp(this.distance * factor, [nearest, Math.max(farthest, this.distance)]);
    if (this.goBy(scale(this.axes[2], this.distance - distance))) this.distance = distance;
  }

  /** Moves along its own axes, with the pivot [distance to the pivot]. */
  fly(right: number, down: number, forward: number): void {
    const [x, y, z] = this.axes;
    const step = add(add(scale(x, right), scale(y, down)), scale(z, forward));
    this.goBy(scale(step, this.distance));
  }

  /** A step that does not lead away from a scene that is as far as can be. */
  private goBy(step: Vec3): boolean {
    const eye = add(this.eye, step);
    const far = length(sub(eye, this.middle));
    if (!(far <= Math.max(this.bounds[1], length(sub(this.eye, this.middle))))) return false;
    this.eye = eye;
    return true;
  }

  private setDistance(distance: number): void {
    this.distance = Math.max(this.bounds[0], distance);
  }

  /** The camera for a picture of this size, which shows all of the reference picture. */
  for(size: [number, number]): PageCamera {
    const fit = Math.min(size[0] / this.reference[0], size[1] / this.reference[1]);
    const angle = clamp(2 * Math.atan((0.5 * size[0]) / (this.focal * fit)), ANGLES);
    return { eye: this.eye, axes: this.axes, angle, size };
  }
}

/** Whether what was kept elsewhere is a camera. */
export function isCamera(found: PageCamera | null): boolean {
  const isNumber = (x: unknown) => typeof x === "number" && Number.isFinite(x);
  const isVector = (x: unknown, n: number) => Array.isArray(x) && x.length === n && x.every(isNumber);
  if (found === null || !isVector(found.eye, 3) || !isVector(found.size, 2) || !isNumber(found.angle)) return false;
  return Array.isArray(found.axes) && found.axes.length === 3 && found.axes.every((axis) => isVector(axis, 3));
}

function clamp(x: number, [low, high]: [number, number]): number {
  return Math.max(low, Math.min(high, x));
}

/** Pixel of a point of the world, and its depth along the optical axis. */
export function project(camera: PageCamera, x: Vec3): { at: [number, number]; depth: number } {
  const from = sub(x, camera.eye);
  const focal = (0.5 * camera.size[0]) / Math.tan(0.5 * camera.angle);
  const depth = dot(from, camera.axes[2]);
  const place = (axis: Vec3, middle: number) => middle + (focal * dot(from, axis)) / depth;
  return { at: [place(camera.axes[0], 0.5 * camera.size[0]), place(camera.axes[1], 0.5 * camera.size[1])], depth };
}

/** The part of a line in front of the camera in its picture; null behind it. */
export function projectLine(camera: PageCamera, a: Vec3, b: Vec3): [[number, number], [number, number]] | null {
  const near = 1e-3 * Math.max(length(sub(a, camera.eye)), length(sub(b, camera.eye)), 1e-9);
  const depth = (x: Vec3) => dot(sub(x, camera.eye), camera.axes[2]);
  const [da, db] = [depth(a), depth(b)];
  if (da < near && db < near) return null;
  const cut = (t: number): Vec3 => add(a, scale(sub(b, a), t));
  const from = da < near ? cut((near - da) / (db - da)) : a;
  const to = db < near ? cut((near - da) / (db - da)) : b;
  return [project(camera, from).at, project(camera, to).at];
}

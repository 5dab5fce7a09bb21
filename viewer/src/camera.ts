// The camera of the page: where it is, what it turns around, and how points of the world come into its picture.

import type { PageCamera } from "./protocol";
import { add, cross, dot, length, scale, sub, turn, unit, type Vec3 } from "./vectors";

/** The camera may look up or down as far as this from the horizon [rad]. */
const STEEPEST = 1.54;

export class Camera {
  eye: Vec3 = [0, 0, -1];
  axes: [Vec3, Vec3, Vec3] = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ];
  /** Distance to the point that the camera turns around [scene unit]. */
  distance = 1;
  /** Focal length, in the shorter edge of the reference picture. */
  private focal = 1;
  private reference: [number, number] = [1, 1];
  up: Vec3 = [0, 0, 1];

  /** Goes where another camera is. */
  take(camera: PageCamera, pivot: Vec3): void {
    this.eye = [...camera.eye];
    this.axes = camera.axes.map((a) => [...a]) as [Vec3, Vec3, Vec3];
    this.reference = [...camera.size];
    this.focal = (0.5 * camera.size[0]) / Math.tan(0.5 * camera.angle);
    const ahead = dot(sub(pivot, this.eye), this.axes[2]);
    this.distance = ahead > 0 ? ahead : Math.max(length(sub(pivot, this.eye)), 1e-6);
  }

  get pivot(): Vec3 {
    return add(this.eye, scale(this.axes[2], this.distance));
  }

  /** Turns around another point, which comes to the middle. */
  lookAt(pivot: Vec3): void {
    this.axes = this.facing(unit(sub(pivot, this.eye)));
    this.distance = Math.max(length(sub(pivot, this.eye)), 1e-6);
  }

  private facing(forward: Vec3): [Vec3, Vec3, Vec3] {
    const sideways = cross(forward, this.up);
    const right = length(sideways) > 1e-6 ? unit(sideways) : this.axes[0];
    return [right, cross(forward, right), forward];
  }

  /** Around the pivot [rad]. */
  orbit(yaw: number, pitch: number): void {
    const pivot = this.pivot;
    let forward = turn(this.axes[2], this.up, yaw);
    const height = Math.asin(Math.max(-1, Math.min(1, dot(forward, this.up))));
    const wanted = Math.max(-STEEPEST, Math.min(STEEPEST, height + pitch));
    const right = this.facing(forward)[0];
    forward = unit(turn(forward, right, wanted - height));
    this.axes = this.facing(forward);
    this.eye = sub(pivot, scale(forward, this.distance));
  }

  /** Looks elsewhere from the same place [rad]. */
  look(yaw: number, pitch: number): void {
    const eye = this.eye;
    this.orbit(yaw, pitch);
    this.eye = eye;
  }

  /** To the right and downwards, in widths of what is seen at the pivot. */
  pan(right: number, down: number): void {
    const width = (this.distance * this.reference[0]) / this.focal;
    this.eye = add(this.eye, add(scale(this.axes[0], right * width), scale(this.axes[1], down * width)));
  }

  /** Nearer to the pivot by a factor. */
  dolly(factor: number): void {
    const pivot = this.pivot;
    this.distance = Math.max(1e-6, this.distance * factor);
    this.eye = sub(pivot, scale(this.axes[2], this.distance));
  }

  /** Moves along its own axes, with the pivot [distance to the pivot]. */
  fly(right: number, down: number, forward: number): void {
    const [x, y, z] = this.axes;
    const step = add(add(scale(x, right), scale(y, down)), scale(z, forward));
    this.eye = add(this.eye, scale(step, this.distance));
  }

  /** The camera for a picture of this size, which shows all of the reference picture. */
  for(size: [number, number]): PageCamera {
    const fit = Math.min(size[0] / this.reference[0], size[1] / this.reference[1]);
    const angle = 2 * Math.atan((0.5 * size[0]) / (this.focal * fit));
    return { eye: this.eye, axes: this.axes, angle, size };
  }
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

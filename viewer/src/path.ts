// A camera path through keyframes, and the file that `refraxel render --camera-path` reads.

import type { PageCamera } from "./protocol";
import { add, columns, quaternion, scale, slerp, type Vec3 } from "./vectors";

/** Place on a Catmull–Rom curve between `b` and `c`. */
function between(a: Vec3, b: Vec3, c: Vec3, d: Vec3, t: number): Vec3 {
  const t2 = t * t;
  const t3 = t2 * t;
  const weights = [-t3 + 2 * t2 - t, 3 * t3 - 5 * t2 + 2, -3 * t3 + 4 * t2 + t, t3 - t2];
  return [a, b, c, d].reduce<Vec3>((sum, x, k) => add(sum, scale(x, 0.5 * weights[k]!)), [0, 0, 0]);
}

/** The camera at `t` in [0, 1] of the way through all keyframes. */
export function at(keys: PageCamera[], t: number): PageCamera {
  const place = Math.max(0, Math.min(1, t)) * (keys.length - 1);
  const k = Math.min(Math.floor(place), keys.length - 2);
  if (keys.length < 2) return keys[0]!;
  const f = place - k;
  const key = (i: number) => keys[Math.max(0, Math.min(keys.length - 1, i))]!;
  const [before, from, to, after] = [key(k - 1), key(k), key(k + 1), key(k + 2)];
  const axes = columns(slerp(quaternion(from.axes), quaternion(to.axes), f));
  const eye = between(before.eye, from.eye, to.eye, after.eye, f);
  return { eye, axes, angle: from.angle + f * (to.angle - from.angle), size: from.size };
}

/** The path in the form of nerfstudio: camera axes to the right, upwards and backwards; vertical fields of view in degrees. */
export function file(keys: PageCamera[], seconds: number, fps: number): string {
  const count = Math.max(2, Math.round(seconds * fps));
  const [width, height] = keys[0]!.size;
  const frame = (camera: PageCamera) => {
    const [right, down, forward] = camera.axes;
    const row = (k: number) => [right[k], -down[k]!, -forward[k]!, camera.eye[k]];
    const fov = (360 / Math.PI) * Math.atan((Math.tan(0.5 * camera.angle) * height) / width);
    return { camera_to_world: [...row(0), ...row(1), ...row(2), 0, 0, 0, 1], fov, aspect: width / height };
  };
  const camera_path = Array.from({ length: count }, (_, i) => frame(at(keys, i / (count - 1))));
  const document = {
    camera_type: "perspective",
    render_width: width,
    render_height: height,
    fps,
    seconds,
    camera_path,
  };
  return JSON.stringify(document);
}

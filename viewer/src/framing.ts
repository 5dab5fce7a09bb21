// Where the camera goes in one move: to the start, to what fills the picture, to one side.

import type { Camera } from "./camera";
import type { BentRay, SceneFacts } from "./protocol";
import { cross, dot, mix, scale, sub, unit, type Vec3 } from "./vectors";

export const middleOf = ({ min, max }: SceneFacts): Vec3 => mix(min, max, 0.5);

export function home(camera: Camera, scene: SceneFacts): void {
  camera.take(scene.start, middleOf(scene));
}

/** What a ray meets first fills the picture; without a ray all that refracts, or the scene. */
export function frame(camera: Camera, scene: SceneFacts, ray: BentRay | null): void {
  const { regions } = scene;
  const met = ray?.bounces[0]?.region;
  const framed = met === undefined ? regions : [regions[met]!];
  const boxes = framed.length > 0 ? framed : [scene];
  const end = (side: "min" | "max") => [0, 1, 2].map((k) => Math[side](...boxes.map((b) => b[side][k]!))) as Vec3;
  camera.frame(end("min"), end("max"));
}

/** Looks from the front, from the right or from above, as the start and the scene have them. */
export function lookAlong(camera: Camera, { up, start }: SceneFacts, side: "front" | "right" | "above"): void {
  const ahead = unit(sub(start.axes[2], scale(up, dot(start.axes[2], up))));
  camera.lookAlong({ front: ahead, right: cross(up, ahead), above: scale(up, -1) }[side]);
}

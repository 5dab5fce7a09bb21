// Mouse, touch and keyboard move the camera.

import type { Camera } from "./camera";
import { isTaken } from "./keys";

/** Turn for a drag across the whole stage [rad]. */
const TURN = Math.PI;
/** Change of the distance per notch of the wheel. */
const NOTCH = 0.0012;
/** Flight [distances to the pivot per second]. */
const SPEED = 0.7;
/** Factor on the flight while Shift is down. */
const FASTER = 4;
/** Turn of the arrow keys [rad / s]. */
const TURN_SPEED = 1.2;
/** A press that moves less than this is a click [CSS pixel]. */
const CLICK = 4;
/** Buttons of a mouse that are down, in `PointerEvent.buttons`. */
const [RIGHT, MIDDLE] = [2, 4];

export interface Moves {
  moved(): void;
  /** Follows the ray of a place of the picture. */
  click(u: number, v: number): void;
  /** Puts the middle of the turns at a place of the picture. */
  center(u: number, v: number): void;
}

/** Keys that move the camera while they are down: right, down, forward, yaw, pitch. */
const FLIGHT: Record<string, [number, number, number, number, number]> = {
  KeyW: [0, 0, 1, 0, 0],
  KeyS: [0, 0, -1, 0, 0],
  KeyA: [-1, 0, 0, 0, 0],
  KeyD: [1, 0, 0, 0, 0],
  KeyE: [0, -1, 0, 0, 0],
  KeyQ: [0, 1, 0, 0, 0],
  ArrowLeft: [0, 0, 0, -1, 0],
  ArrowRight: [0, 0, 0, 1, 0],
  ArrowUp: [0, 0, 0, 0, -1],
  ArrowDown: [0, 0, 0, 0, 1],
};

export function listen(stage: HTMLElement, camera: Camera, moves: Moves): void {
  pointers(stage, camera, moves);
  stage.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 30 : 1;
      camera.dolly(Math.exp(NOTCH * lines * event.deltaY));
      moves.moved();
    },
    { passive: false },
  );
  keys(camera, moves);
}

function pointers(stage: HTMLElement, camera: Camera, moves: Moves): void {
  const down = new Map<number, { x: number; y: number }>();
  let travelled = 0;
  stage.addEventListener("contextmenu", (event) => event.preventDefault());
  stage.addEventListener("pointerdown", (event) => {
    stage.setPointerCapture(event.pointerId);
    stage.focus({ preventScroll: true });
    if (down.size === 0) travelled = 0;
    down.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  stage.addEventListener("pointermove", (event) => {
    const before = down.get(event.pointerId);
    if (!before) return;
    const [dx, dy] = [event.clientX - before.x, event.clientY - before.y];
    const size = Math.min(stage.clientWidth, stage.clientHeight);
    travelled += Math.hypot(dx, dy);
    if (travelled < CLICK) return;
    const others = [...down].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
    const other = others[0];
    if (other) {
      const spread = (x: number, y: number) => Math.max(10, Math.hypot(x - other.x, y - other.y));
      camera.dolly(spread(before.x, before.y) / spread(event.clientX, event.clientY));
      camera.pan(-dx / (2 * size), -dy / (2 * size));
    } else if (event.buttons & RIGHT || event.shiftKey) camera.pan(-dx / size, -dy / size);
    else if (event.buttons & MIDDLE && event.ctrlKey) camera.dolly(Math.exp((2 * dy) / size));
    else if (event.ctrlKey || event.metaKey) camera.look((-TURN * dx) / size / 3, (-TURN * dy) / size / 3);
    else camera.orbit((-TURN * dx) / size, (TURN * dy) / size);
    down.set(event.pointerId, { x: event.clientX, y: event.clientY });
    moves.moved();
  });
  const place = (event: MouseEvent): [number, number] => {
    const box = stage.querySelector("#lines")!.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
  };
  const up = (event: PointerEvent) => {
    if (!down.delete(event.pointerId) || down.size > 0) return;
    if (event.type === "pointerup" && travelled < CLICK && event.button === 0) moves.click(...place(event));
  };
  stage.addEventListener("pointerup", up);
  stage.addEventListener("pointercancel", up);
  stage.addEventListener("dblclick", (event) => moves.center(...place(event)));
}

function keys(camera: Camera, moves: Moves): void {
  const held = new Set<string>();
  let [last, speed] = [0, SPEED];
  const step = (now: number) => {
    if (held.size === 0) return;
    const dt = Math.min(0.1, (now - last) / 1000);
    last = now;
    for (const code of held) {
      const [right, down, forward, yaw, pitch] = FLIGHT[code]!;
      camera.fly(speed * dt * right, speed * dt * down, speed * dt * forward);
      if (yaw || pitch) camera.orbit(-TURN_SPEED * dt * yaw, -TURN_SPEED * dt * pitch);
    }
    moves.moved();
    requestAnimationFrame(step);
  };
  addEventListener("keydown", (event) => {
    speed = event.shiftKey ? SPEED * FASTER : SPEED;
    if (!(event.code in FLIGHT) || isTaken(event)) return;
    event.preventDefault();
    if (held.size === 0) {
      last = performance.now();
      requestAnimationFrame(step);
    }
    held.add(event.code);
  });
  addEventListener("keyup", (event) => {
    held.delete(event.code);
    if (!event.shiftKey) speed = SPEED;
  });
  addEventListener("blur", () => held.clear());
}

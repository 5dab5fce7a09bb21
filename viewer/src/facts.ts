// The picture and the scene in numbers.

import { alone, button, Choice, el, section } from "./dom";
import type { Header, SceneFacts } from "./protocol";
import type { State } from "./state";

export interface Measured {
  header: Header & { picture: "frame" };
  bytes: number;
  latency: number | null;
  rate: number;
}

/** Longest edges to choose from [pixel]; null: as the screen. */
const SIZES = [null, 640, 1280, 2048];
const AS_SCREEN = "Every pixel of the screen; fewer while it moves, and where the program is slow";

export class PicturePanel {
  readonly element: HTMLElement;
  private readonly stats = el("dl", { class: "facts" });
  private readonly scene = el("dl", { class: "facts" });
  /** Bytes received, and when. */
  private received: { time: number; bytes: number }[] = [];

  constructor(state: State, actions: { changed(moving: boolean): void; screenshot(): void }) {
    const options = SIZES.map((n) =>
      n ? ([String(n), String(n), `${n} pixels`] as const) : (["null", "as the screen", AS_SCREEN] as const),
    );
    const sizes = new Choice<string>("Longest edge", options, (n) => {
      state.pixels = n === "null" ? null : Number(n);
      sizes.set(n);
      actions.changed(false);
    });
    sizes.set(String(state.pixels));
    const save = alone(button("Screenshot", "Save picture and lines as PNG (X)", () => actions.screenshot()));
    const parts = [el("p", { class: "label" }, "longest edge [pixel]"), sizes.element, this.stats];
    parts.push(el("div", { class: "row" }, save), el("p", { class: "label" }, "scene"), this.scene);
    this.element = section("Picture", ...parts);
  }

  take(scene: SceneFacts): void {
    const regions = scene.regions.map((r) => `n = ${r.index.toFixed(3)}${r.sharp ? "" : ", graded"}`);
    list(this.scene, [
      ["steps learned", String(scene.step)],
      ["grid", scene.resolution.join(" × ")],
      ["voxels", scene.voxels.toLocaleString("en")],
      ["photographs", String(scene.views.length)],
      ["refractive regions", regions.join("; ") || "none"],
    ]);
  }

  show({ header, bytes, latency, rate }: Measured): void {
    const rays = header.rays === 0 ? "coarse" : header.rays === 1 ? "1 ray per pixel" : `${header.rays} rays per pixel`;
    const facts: [string, string][] = [
      ["picture", `${header.size.join(" × ")}, ${rays}`],
      ["computed in", `${header.ms.toFixed(0)} ms`],
      ["bytes", `${(bytes / 1000).toFixed(1)} kB`],
      ["frames", `${rate} / s`],
      ["link", `${this.linkRate(bytes).toFixed(0)} kB / s`],
    ];
    if (latency !== null) facts.push(["latency", `${latency.toFixed(0)} ms`]);
    list(this.stats, facts);
  }

  /** Kilobytes per second of late. */
  private linkRate(bytes: number): number {
    const now = performance.now();
    this.received.push({ time: now, bytes });
    this.received = this.received.filter((r) => r.time > now - 1000);
    return this.received.reduce((sum, r) => sum + r.bytes, 0) / 1000;
  }
}

function list(element: HTMLElement, facts: [string, string][]): void {
  element.replaceChildren(...facts.flatMap(([name, value]) => [el("dt", {}, name), el("dd", {}, value)]));
}

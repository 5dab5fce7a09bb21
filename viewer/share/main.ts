// A page to share: the scene of a run, rendered in the browser.

import "./page.css";
import { Camera } from "../src/camera";
import { button, checkbox, el, Slider } from "../src/dom";
import { listen } from "../src/input";
import { Renderer } from "./renderer";
import { read, type Document } from "./scene";

/** A picture of a moving camera should take so long [ms]; a camera that rests for so long is shown in full [ms]. */
const [MOVING, REST] = [50, 150];
/** No picture is larger than this [pixel]. */
const MOST = 1600;
/** On narrower windows the controls begin closed [CSS pixel]. */
const NARROW = 640;
const MATERIALS: [string, number][] = [
  ["air", 1],
  ["water", 1.33],
  ["glass", 1.5],
  ["diamond", 2.42],
];

class Page {
  private readonly stage = document.querySelector<HTMLElement>("#stage")!;
  private readonly camera = new Camera();
  private readonly index: number[];
  private straight = false;
  private wanted = 0;
  private busy = false;
  private moving = false;
  private rest = 0;

  constructor(
    private readonly doc: Document,
    private readonly renderer: Renderer,
  ) {
    this.index = doc.regions.map((r) => r.index);
    this.camera.up = doc.up;
    this.home();
    listen(this.stage, this.camera, { moved: () => this.changed(true), click: () => {}, center: () => {} });
    new ResizeObserver(() => this.changed(false)).observe(this.stage);
    addEventListener("keydown", (event) => event.code === "KeyR" && this.home());
    this.controls();
  }

  private home(): void {
    this.camera.take(this.doc.start, this.doc.middle);
    this.changed(false);
  }

  private controls(): void {
    document.querySelector<HTMLDetailsElement>("#panel")!.open = innerWidth >= NARROW;
    const panel = document.querySelector("#controls")!;
    const sliders = this.doc.regions.flatMap((region, k) => {
      if (!region.slides) return [];
      const name = this.doc.regions.length > 1 ? `index of region ${k + 1}` : "index of refraction";
      const slider = new Slider(name, [1, 2.5, 0.005], (x) => x.toFixed(3), (x) => {
        this.index[k] = x;
        this.changed(true);
      });
      slider.set(region.index);
      return [{ slider, k }];
    });
    const set = (n: number | null) => {
      for (const { slider, k } of sliders) {
        this.index[k] = n ?? this.doc.regions[k]!.index;
        slider.set(this.index[k]!);
      }
      this.changed(false);
    };
    if (sliders.length > 0) {
      const names = [...MATERIALS, ["as learned", null] as const];
      panel.append(...sliders.map((s) => s.slider.element), el("div", { class: "row" }, ...names.map(([name, n]) => button(name, n === null ? "As the run has found it" : `n = ${n}`, () => set(n)))));
      panel.append(
        checkbox("straight rays", "As if nothing bent them", (on) => {
          this.straight = on;
          this.changed(false);
        })[0],
      );
    }
    panel.append(el("p", {}, "Drag to turn, wheel to come nearer, right drag or two fingers to move, W A S D Q E to fly, R to go back."));
  }

  /** Something about the picture is another; `moving` if it goes on changing. */
  private changed(moving: boolean): void {
    clearTimeout(this.rest);
    this.wanted++;
    this.moving = moving;
    if (moving) this.rest = setTimeout(() => this.changed(false), REST);
    if (!this.busy) requestAnimationFrame(() => void this.paint());
    this.busy = true;
  }

  private async paint(): Promise<void> {
    const wanted = this.wanted;
    const { moving } = this;
    const ratio = Math.min(devicePixelRatio, 2);
    const box = [this.stage.clientWidth * ratio, this.stage.clientHeight * ratio];
    const whole = Math.min(1, MOST / Math.max(...box));
    const pixels = box[0]! * box[1]! * whole * whole;
    const share = moving ? Math.min(1, Math.sqrt((this.renderer.speed * MOVING) / pixels)) : 1;
    const edge = (n: number) => Math.max(16, Math.round(n * whole * share));
    this.renderer.resize(Math.max(16, Math.round(box[0]!)), Math.max(16, Math.round(box[1]!)));
    const camera = this.camera.for([edge(box[0]!), edge(box[1]!)]);
    const edits = { index: this.index, straight: this.straight };
    // A moving camera sees each of its pictures; the full picture of a resting one is given up when it moves again.
    const start = performance.now();
    const isDone = await this.renderer.render(camera, edits, () => !moving && this.wanted !== wanted);
    if (isDone) {
      document.querySelector<HTMLElement>("#still")!.hidden = true;
      Object.assign(document.body.dataset, { picture: String(wanted), full: String(!moving), ms: (performance.now() - start).toFixed(0) });
    }
    this.busy = this.wanted !== wanted;
    if (this.busy) requestAnimationFrame(() => void this.paint());
  }
}

async function begin(): Promise<void> {
  const note = document.querySelector<HTMLElement>("#note")!;
  try {
    const canvas = document.querySelector<HTMLCanvasElement>("#lines")!;
    const scene = await read();
    new Page(scene.document, await Renderer.make(canvas, scene));
    note.hidden = true;
  } catch (error) {
    const why = error instanceof Error ? error.message : String(error);
    note.textContent = `This is a picture: ${why}. A recent Chrome, Edge, Safari or Firefox with WebGPU shows the scene itself, to turn and to change.`;
    document.body.dataset.failed = why;
  }
}

void begin();

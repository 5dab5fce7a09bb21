// A page to share: the scene of a run, rendered in the browser.

import "./page.css";
import { Camera } from "../src/camera";
import { button, checkbox, el, Slider } from "../src/dom";
import { listen } from "../src/input";
import { isTaken, letterOf } from "../src/keys";
import { mix } from "../src/vectors";
import { Renderer } from "./renderer";
import { read, type Document } from "./scene";

/** A picture of a moving camera should take so long [ms]; a camera that rests for so long is shown in full [ms]. */
const [MOVING, REST] = [50, 150];
/** No picture is larger than this [pixel]. */
const MOST = 1600;
/** On narrow windows, where the controls are below the picture, they begin closed. */
const NARROW = "(max-width: 700px)";
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
  private renderer: Renderer | null = null;
  private straight = false;
  private wanted = 0;
  private busy = false;
  private moving = false;
  private rest = 0;

  constructor(
    private readonly doc: Document,
    private readonly make: () => Promise<Renderer>,
  ) {
    this.index = doc.regions.map((r) => r.index);
    this.camera.up = doc.up;
    this.camera.stayNear(doc.min, doc.max, doc.start.eye);
    this.home();
    listen(this.stage, this.camera, { moved: () => this.changed(true), click: () => {}, center: () => {} });
    new ResizeObserver(() => this.changed(false)).observe(this.stage);
    addEventListener("keydown", (event) => !isTaken(event) && letterOf(event) === "R" && this.home());
  }

  /** Begins to render, or says why it cannot. */
  async begin(): Promise<void> {
    tell("The scene is made ready.");
    const renderer = await this.make();
    this.renderer = renderer;
    if (document.querySelector<HTMLElement>("#panel")!.hidden) this.controls();
    tell(null);
    void renderer.lost.then((why) => this.lose(why));
    this.changed(false);
  }

  /** The device has gone: a driver was updated, or the machine slept. The same scene may go on with another one. */
  private lose(why: string): void {
    this.renderer = null;
    document.querySelector<HTMLElement>("#still")!.hidden = false;
    const again = () => this.begin().catch((error) => this.lose(reason(error)));
    tell(
      `The graphics device has gone: ${why.replace(/\.$/, "")}. This is a picture until another one is there.`,
      button("Start again", "Asks for a graphics device", again),
    );
  }

  private home(): void {
    this.camera.take(this.doc.start, mix(this.doc.min, this.doc.max, 0.5));
    this.changed(false);
  }

  private controls(): void {
    const details = document.querySelector<HTMLDetailsElement>("#panel")!;
    details.hidden = false;
    details.open = !matchMedia(NARROW).matches;
    const panel = document.querySelector("#controls")!;
    const sliders = this.doc.regions.flatMap((region, k) => {
      if (!region.slides) return [];
      const name = this.doc.regions.length > 1 ? `index of region ${k + 1}` : "index of refraction";
      const slider = new Slider(
        name,
        [1, 2.5, 0.005],
        (x) => x.toFixed(3),
        (x) => {
          this.index[k] = x;
          this.changed(true);
        },
      );
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
      panel.append(
        ...sliders.map((s) => s.slider.element),
        el(
          "div",
          { class: "row" },
          ...names.map(([name, n]) => button(name, n === null ? "As the run has found it" : `n = ${n}`, () => set(n))),
        ),
      );
      panel.append(
        checkbox("straight rays", "As if nothing bent them", (on) => {
          this.straight = on;
          this.changed(false);
        })[0],
      );
    }
    panel.append(
      el(
        "p",
        {},
        "Drag to turn, wheel to come nearer, right drag or two fingers to move, W A S D Q E to fly, R to go back.",
      ),
    );
  }

  /** Something about the picture is another; `moving` if it goes on changing. */
  private changed(moving: boolean): void {
    clearTimeout(this.rest);
    this.wanted++;
    this.moving = moving;
    if (moving) this.rest = setTimeout(() => this.changed(false), REST);
    if (this.busy || !this.renderer) return;
    this.busy = true;
    requestAnimationFrame(() => void this.paint(this.renderer));
  }

  private async paint(renderer: Renderer | null): Promise<void> {
    this.busy = renderer !== null;
    if (!renderer) return;
    const wanted = this.wanted;
    const { moving } = this;
    const ratio = Math.min(devicePixelRatio, 2);
    const box = [this.stage.clientWidth * ratio, this.stage.clientHeight * ratio];
    const whole = Math.min(1, MOST / Math.max(...box));
    const pixels = box[0]! * box[1]! * whole * whole;
    const share = moving ? Math.min(1, Math.sqrt((renderer.speed * MOVING) / pixels)) : 1;
    const edge = (n: number) => Math.max(16, Math.round(n * whole * share));
    renderer.resize(Math.max(16, Math.round(box[0]!)), Math.max(16, Math.round(box[1]!)));
    const camera = this.camera.for([edge(box[0]!), edge(box[1]!)]);
    const edits = { index: this.index, straight: this.straight };
    // A moving camera sees each of its pictures; the full picture of a resting one is given up when it moves again.
    const start = performance.now();
    const isDone = await renderer.render(camera, edits, () => !moving && this.wanted !== wanted);
    if (isDone) {
      document.querySelector<HTMLElement>("#still")!.hidden = true;
      Object.assign(document.body.dataset, {
        picture: String(wanted),
        full: String(!moving),
        ms: (performance.now() - start).toFixed(0),
      });
    }
    this.busy = this.wanted !== wanted;
    if (this.busy) requestAnimationFrame(() => void this.paint(this.renderer));
  }
}

/** Says something about the page, with something to press; null takes it away. */
function tell(text: string | null, way?: HTMLButtonElement): void {
  const note = document.querySelector<HTMLElement>("#note")!;
  note.hidden = text === null;
  note.replaceChildren(text ?? "", ...(way ? [" ", way] : []));
}

const reason = (error: unknown) => (error instanceof Error ? error.message : String(error));

async function begin(): Promise<void> {
  try {
    const canvas = document.querySelector<HTMLCanvasElement>("#lines")!;
    const scene = await read();
    await new Page(scene.document, () => Renderer.make(canvas, scene)).begin();
  } catch (error) {
    const why = reason(error);
    tell(
      `This is a picture: ${why}. A recent Chrome, Edge, Safari or Firefox with WebGPU shows the scene itself, to turn and to change.`,
    );
    document.body.dataset.failed = why;
  }
}

void begin();

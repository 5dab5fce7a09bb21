// A training that is under way: its curve, its events, and how to make it wait or end.

import { button, el, section } from "./dom";
import type { Training } from "./protocol";

const SIZE: [number, number] = [560, 220];
const MOST_EVENTS = 200;

export class TrainingPanel {
  readonly element: HTMLElement;
  private readonly state = el("p", { class: "hint" });
  /** What is done beside steps, or instead. */
  private readonly task = el("p", { class: "hint" });
  private readonly shown = el("p", { class: "hint" });
  private readonly canvas = el("canvas", {
    width: String(SIZE[0]),
    height: String(SIZE[1]),
    role: "img",
    "aria-label": "PSNR of training rays over steps",
  });
  private readonly events = el("ol", { class: "events" });
  private readonly pause: HTMLButtonElement;
  private readonly wishes: HTMLElement;
  private records: { step: number; psnr: number; val: number | null }[] = [];
  private paused = false;

  constructor(ask: (wish: { ask: "pause"; paused: boolean } | { ask: "stop" }) => void) {
    this.pause = button("Pause", "Training waits; the viewer has the whole machine", () =>
      ask({ ask: "pause", paused: !this.paused }),
    );
    const stop = button("Save and stop", "Ends the training; --resume goes on later", () => {
      if (confirm("Save the run and end its training?")) ask({ ask: "stop" });
    });
    this.wishes = el("div", { class: "row" }, this.pause, stop);
    this.element = section("Training", this.state, this.task, this.shown, this.canvas, this.wishes, this.events);
    this.element.hidden = true;
  }

  /** Forgets what was told: it is told again after a new connection. */
  clear(): void {
    this.records = [];
    this.events.replaceChildren();
    this.wishes.hidden = false;
  }

  /** Nothing is left to wish: the training has ended, which is said here, or nobody answers any more. */
  end(why: string): void {
    this.wishes.hidden = true;
    this.task.textContent = why;
  }

  /** The picture is of this step. */
  shows(step: number): void {
    this.shown.textContent = `The picture is of step ${step}.`;
  }

  tell(told: Training): void {
    this.element.hidden = false;
    if (told.kind === "record") this.record(told);
    if (told.kind === "event") {
      this.events.prepend(el("li", {}, told.text));
      while (this.events.childElementCount > MOST_EVENTS) this.events.lastChild!.remove();
    }
    if (told.kind === "state") {
      this.paused = told.paused;
      this.pause.textContent = this.paused ? "Go on" : "Pause";
      this.task.textContent = told.text;
    }
  }

  private record({
    step,
    steps,
    progress,
    phase,
    train_psnr: psnr,
    val_psnr: val,
  }: Training & { kind: "record" }): void {
    const at = steps ? `step ${step} of ${steps}` : `step ${step}`;
    const score = psnr === null ? "" : `, ${psnr.toFixed(2)} dB`;
    this.state.textContent = `${phase}, ${at}, ${Math.round(100 * progress)} % done${score}`;
    if (psnr === null) return;
    this.records.push({ step, psnr, val });
    this.draw();
  }

  private draw(): void {
    const ctx = this.canvas.getContext("2d")!;
    const [width, height] = SIZE;
    ctx.clearRect(0, 0, width, height);
    const { records } = this;
    if (records.length < 2) return;
    const values = records.flatMap((r) => (r.val === null ? [r.psnr] : [r.psnr, r.val]));
    const [low, high] = [Math.floor(Math.min(...values)), Math.ceil(Math.max(...values))];
    const last = records[records.length - 1]!.step;
    const x = (step: number) => 52 + ((width - 62) * step) / last;
    const y = (psnr: number) => height - 12 - ((height - 24) * (psnr - low)) / Math.max(high - low, 1);
    ctx.font = "20px system-ui, sans-serif";
    ctx.fillStyle = "#8b93a1";
    ctx.fillText(`${high} dB`, 0, 20);
    ctx.fillText(`${low}`, 0, height - 6);
    ctx.strokeStyle = "#3b82c4";
    ctx.lineWidth = 3;
    ctx.beginPath();
    records.forEach((r, k) => (k ? ctx.lineTo(x(r.step), y(r.psnr)) : ctx.moveTo(x(r.step), y(r.psnr))));
    ctx.stroke();
    ctx.fillStyle = "#e8590c";
    for (const r of records) if (r.val !== null) ctx.fillRect(x(r.step) - 4, y(r.val) - 4, 8, 8);
  }
}

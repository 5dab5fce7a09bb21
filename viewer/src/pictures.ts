// Pictures of the scene: asked for when something about them is another, and shown when they come.

import type { Camera } from "./camera";
import { cropBox } from "./crop";
import type { Measured } from "./facts";
import type { Ask, Header, PageCamera, SceneFacts } from "./protocol";
import { Sharpness } from "./sharpness";
import type { Stage } from "./stage";
import type { State } from "./state";

/** A camera that rests for so long is shown in full [ms]. */
const REST = 160;
/** A picture is painted again if it becomes larger by this factor. */
const SHARPER = 1.25;

export interface PictureEvents {
  ask(ask: Ask): void;
  /** A picture was asked for, in another medium than the last. */
  otherMedium(): void;
  /** A picture is shown. */
  shown(measured: Measured): void;
}

export class Pictures {
  scene: SceneFacts | null = null;
  /** The camera of the picture that is shown. */
  shown: PageCamera | null = null;
  /** Values of its first and of its last colour, where it shows numbers. */
  range: [number, number] | undefined;
  private readonly sharpness = new Sharpness();
  private nextId = 1;
  private shownId = 0;
  /** Cameras of looks whose pictures are on their way, and when they were asked for. */
  private readonly looks = new Map<number, { camera: PageCamera; time: number; moving: boolean }>();
  /** The media of the last look. */
  private medium = "";
  private pending = false;
  private rest = 0;
  /** When pictures came, over a second. */
  private readonly times: number[] = [];

  constructor(
    private readonly stage: Stage,
    private readonly camera: Camera,
    private readonly state: State,
    private readonly events: PictureEvents,
  ) {}

  /** The connection is new: what was asked for does not come any more. */
  forget(): void {
    this.looks.clear();
  }

  /** Something about the picture is another; `moving` if it goes on changing. */
  changed(moving: boolean): void {
    clearTimeout(this.rest);
    if (moving) {
      if (!this.pending) requestAnimationFrame(() => this.ask(true));
      this.pending = true;
    }
    this.rest = setTimeout(() => this.ask(false), moving ? REST : 0);
  }

  private ask(moving: boolean): void {
    this.pending = false;
    if (!this.scene) return;
    const { photo, layer, straight, index, absorption } = this.state;
    const view = photo === null ? null : this.scene.views[photo]!;
    const aspect = view ? view.camera.size[0] / view.camera.size[1] : null;
    const camera = this.camera.for(this.stage.fit(this.sharpness.bounds(this.state.pixels, moving), aspect));
    this.stage.layOut(aspect);
    const id = this.nextId++;
    this.looks.set(id, { camera, time: performance.now(), moving });
    const edits = { index: [...index], absorption: [...absorption], crop: cropBox(this.state, this.scene) };
    this.events.ask({ ask: "look", id, camera, photo, shown: layer, straight, moving, edits });
    const medium = JSON.stringify([straight, edits]);
    if (medium === this.medium) return;
    this.medium = medium;
    this.events.otherMedium();
  }

  /** Takes a picture that has come. */
  take(header: Header & { picture: "frame" }, bitmap: ImageBitmap, bytes: number): void {
    this.events.ask({ ask: "got", frame: header.frame });
    const look = this.looks.get(header.id);
    if (!look || header.id < this.shownId) return bitmap.close();
    const isNew = header.id > this.shownId;
    this.shownId = header.id;
    for (const id of this.looks.keys()) if (id < header.id) this.looks.delete(id);
    this.shown = look.camera;
    this.range = header.range ?? undefined;
    this.sharpness.learn(header, look.moving);
    this.stage.showRendering(bitmap);
    const now = performance.now();
    this.times.push(now);
    while (this.times[0]! < now - 1000) this.times.shift();
    this.events.shown({ header, bytes, latency: isNew ? now - look.time : null, rate: this.times.length });
    document.body.dataset.frame = String(header.frame);
    document.body.dataset.rays = String(header.rays);
    document.body.dataset.last = String(header.last && !look.moving && !this.sharpen(look.camera.size));
  }

  /** Asks for a picture that is larger than this one, if the program has turned out to be faster than was thought. */
  private sharpen(size: [number, number]): boolean {
    const { photo, pixels } = this.state;
    const aspect = photo === null ? null : size[0] / size[1];
    const isSharper = this.stage.fit(this.sharpness.bounds(pixels, false), aspect)[0] > SHARPER * size[0];
    if (isSharper) this.changed(false);
    return isSharper;
  }
}

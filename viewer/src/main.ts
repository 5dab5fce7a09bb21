// The page: what is looked at, and what is asked of the program when that changes.

import { Camera } from "./camera";
import { cropBox } from "./crop";
import { fill } from "./help";
import { listen } from "./input";
import { legendOf, type Compare } from "./legend";
import { Link } from "./link";
import { Messages } from "./messages";
import { Panel } from "./panel";
import { at, file } from "./path";
import { Player } from "./player";
import { download } from "./dom";
import {
  LAYERS,
  type Ask,
  type BentRay,
  type FilmFormat,
  type Header,
  type PageCamera,
  type Scene,
  type Tell,
} from "./protocol";
import * as settings from "./settings";
import { Sharpness } from "./sharpness";
import { listenToKeys } from "./shortcuts";
import { Stage } from "./stage";
import { initial, type State } from "./state";
import { Surfaces } from "./surfaces";
import { cross, dot, mix, scale, sub, unit, type Vec3 } from "./vectors";
import { Views } from "./views";

/** A camera that rests for so long is shown in full [ms]. */
const REST = 160;
/** Why a ray is asked for: to show it, to turn around what it sees, as the medium of the one that is shown has changed, or to measure. */
const RAY = { click: 1, center: 2, follow: 3, measure: 4 };
/** A picture is painted again if it becomes larger by this factor. */
const SHARPER = 1.25;
/** Bounds on the frames of films [pixel]. */
const FILM = { edge: 1280, pixels: Infinity };
const COMPARES: Compare[] = ["off", "side", "wipe", "difference", "error"];
const NO_PATH = "A camera path needs two keyframes: press K at two places.";

class Page {
  private readonly stage = new Stage(() => this.redraw());
  private readonly messages = new Messages();
  private readonly sharpness = new Sharpness();
  private readonly camera = new Camera();
  private readonly views: Views;
  private readonly panel: Panel;
  private readonly link: Link<Ask, Tell>;
  private readonly help = document.querySelector<HTMLDialogElement>("#help")!;
  private scene: Scene | null = null;
  private readonly state: State = initial(settings.load());
  private nextId = 1;
  /** Cameras of looks whose pictures are on their way, and when they were asked for. */
  private readonly looks = new Map<number, { camera: PageCamera; time: number; moving: boolean }>();
  private shown: PageCamera | null = null;
  /** Values of the first and of the last colour of the picture, where it shows numbers. */
  private range: [number, number] | undefined;
  /** The photograph that was looked at last. */
  private lastPhoto = 0;
  private shownId = 0;
  private plane: Vec3[] | null = null;
  private readonly surfaces = new Surfaces((ask) => this.link.send(ask));
  private readonly player = new Player((camera, isLast) => this.pass(camera, isLast));
  /** The program answers. */
  private isLive = false;
  /** The program does not know what is looked at: the connection is new. */
  private asksAgain = true;
  /** The media of the last look. */
  private medium = "";
  private pending = false;
  private rest = 0;
  private readonly times: number[] = [];

  constructor() {
    fill(this.help);
    this.views = new Views(this.camera, this.state, {
      moved: () => this.moved(),
      home: () => this.home(),
      frame: () => this.frame(),
    });
    this.panel = new Panel(document.querySelector("#panel")!, this.views, this.state, {
      changed: (moving) => this.changed(moving),
      overlay: () => {
        this.askSurfaces();
        this.redraw();
      },
      photo: (view) => this.goTo(view),
      step: (by) => this.step(by),
      forgetRay: () => this.forgetRay(),
      compare: (how) => this.setCompare(how),
      slice: () => this.askSlice(),
      play: () => this.play(),
      save: () => this.savePath(),
      film: (format) => this.film(format),
      stopFilm: () => this.link.send({ ask: "stop_film" }),
      addKey: () => this.addKey(),
      screenshot: () => void this.screenshot(),
      help: () => this.help.showModal(),
      ask: (wish) => this.link.send(wish),
    });
    this.link = new Link({
      open: () => this.connected(),
      closed: (why) => this.disconnected(why),
      tell: (tell) => this.listen(tell),
      picture: (header, jpeg) => void this.receive(header, jpeg),
    });
    listen(this.stage.element, this.camera, {
      moved: () => this.moved(),
      click: (u, v) => {
        const id = this.state.measures ? RAY.measure : RAY.click;
        this.link.send({ ask: "ray", id, u: this.stage.inView(u), v });
      },
      center: (u, v) => this.link.send({ ask: "ray", id: RAY.center, u: this.stage.inView(u), v }),
    });
    addEventListener("resize", () => this.changed(false));
    new ResizeObserver(() => this.changed(false)).observe(this.stage.element);
    listenToKeys({
      letters: this.letters(),
      digit: (digit, isShifted) => {
        if (isShifted) this.views.go(digit - 1);
        else this.panel.chooseLayer(LAYERS[digit - 1] ?? this.state.layer);
      },
      help: () => this.help.showModal(),
      play: () => this.play(),
      isLive: () => this.isLive,
    });
    this.hidePanel(this.state.alone);
    addEventListener("pagehide", () => settings.save(this.state));
  }

  /** A hand has moved the camera. */
  private moved(): void {
    if (!this.isLive) return;
    this.player.stop();
    this.leavePhoto();
    this.changed(true);
  }

  private hidePanel(isHidden: boolean): void {
    this.state.alone = isHidden;
    document.body.classList.toggle("alone", isHidden);
    if (!isHidden) return this.messages.clear();
    this.stage.element.focus({ preventScroll: true });
    const show = { name: "Show it", title: "Brings the panel back", go: () => this.hidePanel(false) };
    this.messages.say("The panel is hidden; H brings it back.", show);
  }

  private connected(): void {
    this.notice(null);
    this.isLive = true;
    this.panel.setLive(true);
    this.panel.training.clear();
    this.looks.clear();
    this.asksAgain = true;
  }

  /** The last picture stays; what needs the program is off. */
  private disconnected(why: string): void {
    this.notice(why);
    this.isLive = false;
    this.player.stop();
    this.panel.setLive(false);
    this.panel.training.end("");
  }

  private notice(text: string | null): void {
    const notice = document.querySelector<HTMLElement>("#notice")!;
    notice.hidden = text === null;
    notice.textContent = text ?? "";
  }

  private listen(tell: Tell): void {
    if (tell.tell === "scene") this.takeScene(tell);
    else if (tell.tell === "training") this.panel.training.tell(tell);
    else if (tell.tell === "surface") this.takeSurface(tell.region, tell.pieces);
    else if (tell.tell === "film") this.panel.path.tell(tell);
    else if (tell.tell === "refused") this.messages.say(tell.why);
    else if (tell.tell === "ended") this.panel.training.end(tell.why);
    else this.takeRay(tell.id, tell.ray);
  }

  private takeRay(id: number, ray: BentRay): void {
    if (id === RAY.measure) {
      if (ray.seen) this.panel.measure.take(ray.seen[1]);
      else this.messages.say("Nothing solid is seen there, so that there is no place to measure from.");
    } else if (id === RAY.center) {
      if (!ray.seen) return;
      this.leavePhoto();
      this.camera.lookAt(ray.seen[1]);
      this.changed(true);
    } else {
      this.state.ray = ray;
      this.panel.showRay(this.scene!);
      if (id === RAY.click) this.panel.goToRay();
      this.redraw();
    }
  }

  private takeScene(scene: Scene): void {
    const isFirst = this.scene === null;
    const isOther = scene.regions.length !== this.scene?.regions.length;
    this.scene = scene;
    this.camera.up = scene.up;
    this.camera.stayNear(scene.min, scene.max, scene.start.eye);
    if (isFirst) this.camera.take(scene.start, this.middle());
    if (this.state.index.length > scene.regions.length) [this.state.index, this.state.absorption] = [[], []];
    this.panel.takeScene(scene, isFirst || isOther || this.asksAgain);
    document.title = `${scene.name} – refraxel`;
    if (isFirst || isOther || this.asksAgain) this.changed(false);
    this.asksAgain = false;
    this.surfaces.forget();
    this.askSurfaces();
  }

  private askSurfaces(): void {
    if (this.state.surfaces && this.scene) this.surfaces.ask(this.scene.regions);
  }

  private takeSurface(region: number, pieces: number[][]): void {
    this.surfaces.take(region, this.scene!.regions[region]!, pieces);
    this.askSurfaces();
    this.redraw();
  }

  private middle(): Vec3 {
    const { min, max } = this.scene!;
    return mix(min, max, 0.5);
  }

  private home(): void {
    this.camera.take(this.scene!.start, this.middle());
    this.moved();
    this.panel.update();
  }

  /** What the shown ray meets first fills the picture; without a ray all that refracts, or the scene. */
  private frame(): void {
    const { regions } = this.scene!;
    const met = this.state.ray?.bounces[0]?.region;
    const framed = met === undefined ? regions : [regions[met]!];
    const boxes = framed.length > 0 ? framed : [this.scene!];
    const end = (side: "min" | "max") => [0, 1, 2].map((k) => Math[side](...boxes.map((b) => b[side][k]!))) as Vec3;
    this.camera.frame(end("min"), end("max"));
    this.moved();
  }

  private frameScene(): void {
    this.camera.frame(this.scene!.min, this.scene!.max);
    this.moved();
  }

  /** Looks from the front, from the right or from above, as the start and the scene have them. */
  private lookAlong(side: "front" | "right" | "above"): void {
    const { up, start } = this.scene!;
    const ahead = unit(sub(start.axes[2], scale(up, dot(start.axes[2], up))));
    this.camera.lookAlong({ front: ahead, right: cross(up, ahead), above: scale(up, -1) }[side]);
    this.moved();
  }

  private goTo(view: number | null): void {
    if (view === null || !this.scene) return this.leavePhoto();
    const count = this.scene.views.length;
    if (count === 0) return;
    const k = ((view % count) + count) % count;
    this.state.photo = this.lastPhoto = k;
    this.camera.take(this.scene.views[k]!.camera, this.middle());
    this.stage.showPhotograph(null);
    this.link.send({ ask: "photo", view: k });
    this.panel.update();
    this.changed(false);
  }

  /** The next photograph; after a look elsewhere, the one that was left. */
  private step(by: number): void {
    this.goTo(this.state.photo === null ? this.lastPhoto : this.state.photo + by);
  }

  private forgetRay(): void {
    this.state.ray = null;
    this.messages.clear();
    this.panel.update();
    this.redraw();
  }

  /** The camera is no longer that of a photograph, with which the picture can be compared no more. */
  private leavePhoto(): void {
    const { photo, compare } = this.state;
    if (photo === null) return;
    this.state.photo = null;
    this.stage.showPhotograph(null);
    this.setCompare("off");
    if (compare === "off") return;
    const back = () => {
      this.goTo(photo);
      this.setCompare(compare);
    };
    const text = `The camera has left ${this.scene!.views[photo]!.name}, so that the comparison has ended.`;
    this.messages.say(text, { name: "Back to it", title: "The photograph and its comparison, as they were", go: back });
  }

  private setCompare(how: Compare): void {
    if (how !== "off" && this.state.photo === null) {
      this.goTo(this.lastPhoto);
      if (this.state.photo === null) return;
    }
    this.state.compare = how;
    this.stage.setCompare(how);
    this.panel.update();
    this.changed(false);
  }

  /** Something about the picture is another; `moving` if it goes on changing. */
  private changed(moving: boolean): void {
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
    this.link.send({ ask: "look", id, camera, photo, shown: layer, straight, moving, edits });
    this.followMedium(JSON.stringify([straight, edits]));
  }

  /** The ray and the slice that are shown bend as the medium does. */
  private followMedium(medium: string): void {
    if (medium === this.medium) return;
    this.medium = medium;
    const { ray, slice } = this.state;
    if (ray) {
      const direction = unit(sub(ray.straight[1], ray.straight[0]));
      this.link.send({ ask: "follow", id: RAY.follow, origin: ray.straight[0], direction });
    }
    if (slice) this.askSlice();
  }

  private askSlice(): void {
    const { slice } = this.state;
    if (slice) this.link.send({ ask: "slice", ...slice });
    else {
      this.plane = null;
      this.redraw();
    }
  }

  private async receive(header: Header, jpeg: Blob): Promise<void> {
    const bitmap = await createImageBitmap(jpeg);
    if (header.picture === "frame") return this.receiveFrame(header, bitmap, jpeg.size);
    if (header.picture === "photo") {
      if (header.view !== this.state.photo) return;
      this.stage.showPhotograph(bitmap);
      this.redraw();
      return;
    }
    this.plane = header.corners;
    this.panel.slice.show(bitmap, header.range);
    this.redraw();
  }

  private receiveFrame(header: Header & { picture: "frame" }, bitmap: ImageBitmap, bytes: number): void {
    this.link.send({ ask: "got", frame: header.frame });
    const look = this.looks.get(header.id);
    if (!look || header.id < this.shownId) return bitmap.close();
    const isNew = header.id > this.shownId;
    this.shownId = header.id;
    for (const id of this.looks.keys()) if (id < header.id) this.looks.delete(id);
    this.shown = look.camera;
    this.range = header.range;
    this.sharpness.learn(header, look.moving);
    this.stage.showRendering(bitmap);
    this.redraw();
    const now = performance.now();
    this.times.push(now);
    while (this.times[0]! < now - 1000) this.times.shift();
    this.panel.statistics({
      header,
      bytes,
      latency: isNew ? now - look.time : null,
      rate: this.times.length,
    });
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

  private redraw(): void {
    if (!this.scene || !this.shown) return;
    const { ray, boxes, cameras, ends } = this.state;
    const surfaces = this.state.surfaces ? this.surfaces.pieces : [];
    const keys = this.player.isPlaying ? [] : this.state.keys;
    const path = keys.length < 2 ? [] : Array.from({ length: 60 }, (_, i) => at(keys, i / 59).eye);
    const crop = cropBox(this.state, this.scene);
    const what = { ray, boxes, cameras, surfaces, plane: this.plane, path, keys, ends, crop };
    const legend = legendOf(this.state.layer, this.state.compare, this.range);
    const photo = this.state.photo === null ? null : this.scene.views[this.state.photo]!.name;
    this.stage.overlay(this.shown, this.scene, what, legend, photo);
  }

  private addKey(): void {
    this.state.keys.push(structuredClone(this.camera.for(this.stage.fit(FILM, null))));
    this.panel.update();
    this.redraw();
  }

  private play(): void {
    const { keys, seconds } = this.state;
    if (keys.length < 2) return this.messages.say(NO_PATH);
    this.leavePhoto();
    this.player.play(keys, seconds);
  }

  /** The camera is here on its path. */
  private pass(camera: PageCamera, isLast: boolean): void {
    this.camera.take(camera, this.middle());
    if (isLast) this.panel.update();
    this.changed(!isLast);
  }

  private savePath(): void {
    const { keys, seconds, fps } = this.state;
    if (keys.length < 2) return this.messages.say(NO_PATH);
    download("camera_path.json", new Blob([file(keys, seconds, fps)], { type: "application/json" }));
  }

  /** Asks for a film of what is shown, along the path. */
  private film(format: FilmFormat): boolean {
    const { keys, seconds, fps, layer, straight, index } = this.state;
    if (keys.length < 2) {
      this.messages.say(NO_PATH);
      return false;
    }
    const set = index.filter((n) => n !== null);
    const isOne = set.length === index.length && set.every((n) => n === set[0]);
    if (set.length > 0 && !isOne) this.messages.say("A film has one index for all regions; it shows those as learned.");
    const path = file(keys, seconds, fps);
    this.link.send({ ask: "film", path, format, shown: layer, straight, index: (isOne && set[0]) || null });
    return true;
  }

  private async screenshot(): Promise<void> {
    const png = await this.stage.screenshot();
    if (png) download(`${this.scene?.name ?? "refraxel"}.png`, png);
  }

  private letters(): Record<string, () => void> {
    const { state } = this;
    return {
      B: () => {
        state.straight = !state.straight;
        this.panel.update();
        this.changed(false);
      },
      N: () => this.step(1),
      P: () => this.step(-1),
      C: () => this.setCompare(COMPARES[(COMPARES.indexOf(state.compare) + 1) % COMPARES.length]!),
      G: () => {
        state.surfaces = !state.surfaces;
        this.panel.update();
        this.askSurfaces();
        this.redraw();
      },
      K: () => this.addKey(),
      T: () => this.panel.measure.toggle(),
      R: () => this.home(),
      F: () => this.frame(),
      Home: () => this.frameScene(),
      L: () => {
        this.views.toggleLevel();
        this.panel.update();
      },
      M: () => this.views.add(),
      Numpad1: () => this.lookAlong("front"),
      Numpad3: () => this.lookAlong("right"),
      Numpad7: () => this.lookAlong("above"),
      X: () => void this.screenshot(),
      H: () => this.hidePanel(!state.alone),
      Escape: () => {
        this.forgetRay();
        this.panel.measure.clear();
      },
    };
  }
}

new Page();

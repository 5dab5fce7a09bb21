// The page: what its parts tell each other, and what the program and the keys tell them.

import { Camera } from "./camera";
import { cropBox } from "./crop";
import { download } from "./dom";
import { Drawings } from "./drawings";
import { frame, home, lookAlong, middleOf } from "./framing";
import { fill } from "./help";
import { listen } from "./input";
import { LAYERS } from "./layers";
import { legendOf } from "./legend";
import { Link } from "./link";
import { Messages } from "./messages";
import { Panel } from "./panel";
import { at, file } from "./path";
import { Photographs } from "./photographs";
import { Pictures } from "./pictures";
import { Player } from "./player";
import type { Ask, BentRay, FilmFormat, Header, PageCamera, SceneFacts, Tell } from "./protocol";
import * as settings from "./settings";
import { listenToKeys } from "./shortcuts";
import { Stage } from "./stage";
import { initial, type State } from "./state";
import { sub, unit, type Vec3 } from "./vectors";
import { Views } from "./views";

/** Why a ray is asked for: to show it, to turn around what it sees, as the medium of the one that is shown has changed, or to measure. */
const RAY = { click: 1, center: 2, follow: 3, measure: 4 };
/** Bounds on the frames of films [pixel]. */
const FILM = { edge: 1280, pixels: Infinity };
const NO_PATH = "A camera path needs two keyframes: press K at two places.";

class Page {
  private readonly stage = new Stage(() => this.redraw());
  private readonly messages = new Messages();
  private readonly camera = new Camera();
  private readonly state: State = initial(settings.load());
  private readonly pictures: Pictures;
  private readonly photographs: Photographs;
  private readonly views: Views;
  private readonly panel: Panel;
  private readonly link: Link<Ask, Tell>;
  private readonly help = document.querySelector<HTMLDialogElement>("#help")!;
  private readonly drawings = new Drawings((ask) => this.link.send(ask));
  private readonly player = new Player((camera, isLast) => this.pass(camera, isLast));
  private scene: SceneFacts | null = null;
  private plane: Vec3[] | null = null;
  /** The program answers. */
  private isLive = false;
  /** The program does not know what is looked at: the connection is new. */
  private asksAgain = true;

  constructor() {
    const ask = (question: Ask) => this.link.send(question);
    fill(this.help);
    this.pictures = new Pictures(this.stage, this.camera, this.state, {
      ask,
      otherMedium: () => this.followMedium(),
      shown: (measured) => {
        this.redraw();
        this.panel.statistics(measured);
      },
    });
    this.photographs = new Photographs(this.stage, this.camera, this.state, this.messages, {
      ask,
      changed: () => this.changed(),
    });
    this.views = new Views(this.camera, this.state, {
      moved: () => this.moved(),
      home: () => this.home(),
      frame: () => this.move(() => frame(this.camera, this.scene!, this.state.ray)),
    });
    this.panel = this.makePanel(ask);
    this.link = new Link({
      open: () => this.connected(),
      closed: (why) => this.disconnected(why),
      tell: (tell) => this.listen(tell),
      picture: (header, jpeg) => void this.receive(header, jpeg),
    });
    listen(this.stage.element, this.camera, {
      moved: () => this.moved(),
      click: (u, v) =>
        ask({ ask: "ray", id: this.state.measures ? RAY.measure : RAY.click, u: this.stage.inView(u), v }),
      center: (u, v) => ask({ ask: "ray", id: RAY.center, u: this.stage.inView(u), v }),
    });
    addEventListener("resize", () => this.pictures.changed(false));
    new ResizeObserver(() => this.pictures.changed(false)).observe(this.stage.element);
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

  private makePanel(ask: (question: Ask) => void): Panel {
    return new Panel(document.querySelector("#panel")!, this.views, this.state, {
      changed: (moving) => this.pictures.changed(moving),
      overlay: () => this.showLines(),
      photo: (view) => this.photographs.goTo(view),
      step: (by) => this.photographs.step(by),
      forgetRay: () => this.forgetRay(),
      compare: (how) => this.photographs.compare(how),
      slice: () => this.askSlice(),
      play: () => this.play(),
      save: () => this.savePath(),
      film: (format) => this.film(format),
      stopFilm: () => ask({ ask: "stop_film" }),
      addKey: () => this.addKey(),
      screenshot: () => void this.screenshot(),
      help: () => this.help.showModal(),
      ask,
    });
  }

  /** The picture is another, and so are the controls. */
  private changed(): void {
    this.panel.update();
    this.pictures.changed(false);
  }

  /** A hand has moved the camera. */
  private moved(): void {
    if (!this.isLive) return;
    this.player.stop();
    this.photographs.leave();
    this.pictures.changed(true);
  }

  /** Moves the camera in one go. */
  private move(go: () => void): void {
    go();
    this.moved();
  }

  private home(): void {
    this.move(() => home(this.camera, this.scene!));
    this.panel.update();
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
    this.pictures.forget();
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
    else if (tell.tell === "surface" || tell.tell === "hull" || tell.tell === "bricks") this.takeDrawing(tell);
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
      this.photographs.leave();
      this.camera.lookAt(ray.seen[1]);
      this.pictures.changed(true);
    } else {
      this.state.ray = ray;
      this.panel.showRay(this.scene!);
      if (id === RAY.click) this.panel.goToRay();
      this.redraw();
    }
  }

  private takeScene(scene: SceneFacts): void {
    const isFirst = this.scene === null;
    const isOther = isFirst || this.asksAgain || scene.regions.length !== this.scene?.regions.length;
    this.scene = this.pictures.scene = this.photographs.scene = scene;
    this.camera.up = scene.up;
    this.camera.stayNear(scene.min, scene.max, scene.start.eye);
    if (isFirst) home(this.camera, scene);
    if (this.state.index.length > scene.regions.length) [this.state.index, this.state.absorption] = [[], []];
    this.panel.takeScene(scene, isOther);
    document.title = `${scene.name} – refraxel`;
    if (isOther) this.pictures.changed(false);
    this.asksAgain = false;
    this.drawings.forget();
    this.drawings.ask(this.state, scene);
  }

  private takeDrawing(tell: Tell & { tell: "surface" | "hull" | "bricks" }): void {
    if (tell.tell === "hull") this.drawings.takeHull(tell);
    else if (tell.tell === "bricks") this.drawings.takeBricks(tell);
    else this.drawings.takeSurface(tell.region, this.scene!.regions[tell.region]!, tell.pieces);
    this.showLines();
  }

  /** Lines over the picture are others. */
  private showLines(): void {
    if (this.scene) this.drawings.ask(this.state, this.scene);
    this.redraw();
  }

  private forgetRay(): void {
    this.state.ray = null;
    this.messages.clear();
    this.panel.update();
    this.redraw();
  }

  /** The ray and the slice that are shown bend as the medium does. */
  private followMedium(): void {
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
    if (header.picture === "frame") return this.pictures.take(header, bitmap, jpeg.size);
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

  private redraw(): void {
    const { scene, state, drawings } = this;
    if (!scene || !this.pictures.shown) return;
    const { ray, boxes, cameras, ends } = state;
    const surfaces = state.surfaces ? drawings.surfaces : [];
    const hull = (state.hull && drawings.hull) || [];
    const bricks = (state.bricks && drawings.bricks?.lines) || [];
    const keys = this.player.isPlaying ? [] : state.keys;
    const path = keys.length < 2 ? [] : Array.from({ length: 60 }, (_, i) => at(keys, i / 59).eye);
    const crop = cropBox(state, scene);
    const what = { ray, boxes, cameras, surfaces, hull, bricks, plane: this.plane, path, keys, ends, crop };
    const legend = legendOf(state.layer, state.compare, this.pictures.range);
    const photo = state.photo === null ? null : scene.views[state.photo]!.name;
    this.stage.overlay(this.pictures.shown, scene, what, legend, photo);
  }

  private addKey(): void {
    this.state.keys.push(structuredClone(this.camera.for(this.stage.fit(FILM, null))));
    this.panel.update();
    this.redraw();
  }

  private play(): void {
    const { keys, seconds } = this.state;
    if (keys.length < 2) return this.messages.say(NO_PATH);
    this.photographs.leave();
    this.player.play(keys, seconds);
  }

  /** The camera is here on its path. */
  private pass(camera: PageCamera, isLast: boolean): void {
    this.camera.take(camera, middleOf(this.scene!));
    if (isLast) this.panel.update();
    this.pictures.changed(!isLast);
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
    const { state, camera } = this;
    const look = (side: "front" | "right" | "above") => () => this.move(() => lookAlong(camera, this.scene!, side));
    return {
      B: () => {
        state.straight = !state.straight;
        this.changed();
      },
      N: () => this.photographs.step(1),
      P: () => this.photographs.step(-1),
      C: () => this.photographs.compareNext(),
      G: () => {
        state.surfaces = !state.surfaces;
        this.panel.update();
        this.showLines();
      },
      K: () => this.addKey(),
      T: () => this.panel.measure.toggle(),
      R: () => this.home(),
      F: () => this.move(() => frame(camera, this.scene!, state.ray)),
      Home: () => this.move(() => camera.frame(this.scene!.min, this.scene!.max)),
      L: () => {
        this.views.toggleLevel();
        this.panel.update();
      },
      M: () => this.views.add(),
      Numpad1: look("front"),
      Numpad3: look("right"),
      Numpad7: look("above"),
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

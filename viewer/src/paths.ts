// Several camera paths, each with a name; they are kept in the tab, as bookmarks are.

import { isCamera } from "./camera";
import { alone, button, el, section, Slider } from "./dom";
import { FilmPanel } from "./film";
import type { FilmFormat, FilmState, PageCamera } from "./protocol";
import type { State } from "./state";

/** Where the paths of this tab are kept. */
const KEPT = "refraxel paths";
/** Keyframes and paths that are kept. */
const [MOST_KEYS, MOST_PATHS] = [1000, 50];

export interface NamedPath {
  name: string;
  keys: PageCamera[];
}

export interface PathActions {
  play(): void;
  save(): void;
  addKey(): void;
  /** Lines over the picture are others. */
  overlay(): void;
  /** Asks for a film; false where there is no path. */
  film(format: FilmFormat): boolean;
  stopFilm(): void;
}

export class PathPanel {
  readonly element: HTMLElement;
  private readonly film: FilmPanel;
  private readonly says = el("p", { class: "hint" });
  private readonly list = el("select", { "aria-label": "Path" });
  private readonly name = el("input", { type: "text", "aria-label": "Name of the path", maxlength: "40" });
  private paths: NamedPath[] = kept();
  private chosen = 0;

  constructor(
    private readonly state: State,
    private readonly actions: PathActions,
  ) {
    state.keys = this.path.keys;
    this.list.addEventListener("change", () => this.choose(Number(this.list.value)));
    this.name.addEventListener("change", () => {
      this.path.name = this.name.value.trim() || this.path.name;
      this.update();
    });
    for (const control of [this.list, this.name]) alone(control);
    const [seconds, fps] = this.sliders();
    const keys = el(
      "div",
      { class: "row" },
      button("Add keyframe", "The camera as it is now (K)", () => actions.addKey()),
      button("Play", "Go along the path (Space)", () => actions.play()),
      alone(button("Save", "camera_path.json, for refraxel render --camera-path", () => actions.save())),
      alone(button("Clear", "Forget the keyframes", () => this.clear())),
    );
    const nameOf = () => this.path.name.replace(/[^\p{L}\p{N}]+/gu, "_");
    this.film = new FilmPanel(actions.film, actions.stopFilm, nameOf);
    const parts = [this.chooser(), keys, this.says, seconds.element, fps.element, this.film.element];
    this.element = section("Camera path", ...parts);
  }

  private chooser(): HTMLElement {
    const add = alone(button("New", "Another path", () => this.add()));
    const drop = alone(button("×", "Forgets this path", () => this.drop()));
    const choice = el("div", { class: "row" }, this.list, add, drop);
    return el("div", { class: "paths" }, choice, el("label", { class: "named" }, "name", this.name));
  }

  private sliders(): [Slider, Slider] {
    const { state } = this;
    const length = (x: number) => `${x} s`;
    const seconds = new Slider("seconds", [1, 60, 1], length, (x) => (state.seconds = x));
    const fps = new Slider("frames per second", [10, 60, 1], String, (x) => (state.fps = x));
    seconds.set(state.seconds);
    fps.set(state.fps);
    return [seconds, fps];
  }

  private get path(): NamedPath {
    return this.paths[this.chosen]!;
  }

  private choose(k: number): void {
    this.chosen = k;
    this.state.keys = this.path.keys;
    this.update();
    this.actions.overlay();
  }

  private add(): void {
    if (this.paths.length === MOST_PATHS) return;
    const taken = this.paths.map((path) => path.name);
    let k = this.paths.length + 1;
    while (taken.includes(`path ${k}`)) k++;
    this.paths.push({ name: `path ${k}`, keys: [] });
    this.choose(this.paths.length - 1);
  }

  private drop(): void {
    this.paths.splice(this.chosen, 1);
    if (this.paths.length === 0) this.paths = [{ name: "path 1", keys: [] }];
    this.choose(Math.min(this.chosen, this.paths.length - 1));
  }

  private clear(): void {
    this.state.keys.length = 0;
    this.update();
    this.actions.overlay();
  }

  tell(film: FilmState): void {
    this.film.take(film);
  }

  /** Nobody answers any more. */
  lose(): void {
    this.film.lose();
  }

  update(): void {
    const count = this.state.keys.length;
    this.says.textContent =
      count === 0 ? "Press K at each place that the camera shall pass." : `${count} keyframe${count > 1 ? "s" : ""}`;
    this.list.replaceChildren(...this.paths.map(({ name }, k) => el("option", { value: String(k) }, name)));
    this.list.value = String(this.chosen);
    this.name.value = this.path.name;
    try {
      sessionStorage.setItem(KEPT, JSON.stringify(this.paths));
    } catch {
      // The browser keeps nothing: they are there until the page is loaded again.
    }
  }
}

/** The paths of this tab before it was loaded again; at least one. */
function kept(): NamedPath[] {
  try {
    const found = JSON.parse(sessionStorage.getItem(KEPT) ?? "[]") as unknown;
    if (isPaths(found) && found.length > 0) return found;
  } catch {
    // Somebody else wrote it, or nothing is kept.
  }
  return [{ name: "path 1", keys: [] }];
}

export function isPaths(found: unknown): found is NamedPath[] {
  const isPath = ({ name, keys }: NamedPath) =>
    typeof name === "string" && Array.isArray(keys) && keys.length <= MOST_KEYS && keys.every(isCamera);
  return Array.isArray(found) && found.length <= MOST_PATHS && found.every((path) => path !== null && isPath(path));
}

// Where the camera is: its field of view, its horizon, what fills the picture, and places to come back to.

import type { Camera, Place } from "./camera";
import { button, checkbox, el, section, Slider } from "./dom";

/** Fields of view to choose from, and a step [degree]. */
const ANGLES: [number, number, number] = [5, 120, 1];
/** The places of this tab are kept while it is open. */
const KEPT = "refraxel places";
const DEGREE = Math.PI / 180;

export interface Moves {
  /** The camera was moved. */
  moved(): void;
  home(): void;
  frame(): void;
}

export class Views {
  readonly element: HTMLElement;
  private readonly angle: Slider;
  private readonly levelBox: HTMLInputElement;
  private readonly row = el("div", { class: "row", role: "group", "aria-label": "Bookmarks" });
  private places: Place[] = kept();

  constructor(
    private readonly camera: Camera,
    private readonly settings: { level: boolean },
    private readonly moves: Moves,
  ) {
    this.angle = new Slider(
      "field of view",
      ANGLES,
      (x) => `${x}°`,
      (x) => {
        camera.view = x * DEGREE;
        moves.moved();
      },
    );
    const [level, box] = checkbox("level horizon", "Turns keep the horizon level; else they are free (L)", (on) =>
      this.setLevel(on),
    );
    this.levelBox = box;
    camera.isLevel = settings.level;
    const buttons = el(
      "div",
      { class: "row" },
      button(
        "Frame",
        "What the shown ray meets first fills the picture, or all that refracts (F); all of the scene (Home)",
        () => moves.frame(),
      ),
      button("Start view", "Back to the start (R)", () => moves.home()),
      button("Bookmark", "Remembers this view while the page is open (M)", () => this.add()),
    );
    this.element = section("Camera", buttons, this.row, this.angle.element, level);
    this.showPlaces();
  }

  /** Shows what the camera does now. */
  update(): void {
    this.angle.set(Math.round(this.camera.view / DEGREE));
    this.levelBox.checked = this.settings.level;
  }

  toggleLevel(): void {
    this.setLevel(!this.settings.level);
  }

  private setLevel(on: boolean): void {
    this.settings.level = this.camera.isLevel = on;
    if (on) this.camera.level();
    this.moves.moved();
  }

  /** Remembers where the camera is. */
  add(): void {
    this.places.push(this.camera.place);
    this.showPlaces();
  }

  /** Goes to a place that was remembered; false where there is none of this number, from 0. */
  go(k: number): boolean {
    const place = this.places[k];
    if (!place) return false;
    this.camera.goTo(place);
    this.moves.moved();
    return true;
  }

  private showPlaces(): void {
    const one = (_: Place, k: number) => {
      const go = button(`view ${k + 1}`, `Goes to this view${k < 9 ? ` (Shift ${k + 1})` : ""}`, () => this.go(k));
      const drop = button("×", `Forgets view ${k + 1}`, () => {
        this.places.splice(k, 1);
        this.showPlaces();
      });
      return el("span", { class: "pair" }, go, drop);
    };
    this.row.replaceChildren(...this.places.map(one));
    this.row.hidden = this.places.length === 0;
    try {
      sessionStorage.setItem(KEPT, JSON.stringify(this.places));
    } catch {
      // The browser keeps nothing: they are there until the page is loaded again.
    }
  }
}

/** The places of this tab before it was loaded again. */
function kept(): Place[] {
  const isNumber = (x: unknown) => typeof x === "number" && Number.isFinite(x);
  const isVector = (x: unknown) => Array.isArray(x) && x.length === 3 && x.every(isNumber);
  const isPlace = ({ eye, axes, distance, view }: Place) =>
    isVector(eye) &&
    Array.isArray(axes) &&
    axes.length === 3 &&
    axes.every(isVector) &&
    isNumber(distance) &&
    isNumber(view);
  try {
    const places = JSON.parse(sessionStorage.getItem(KEPT) ?? "[]") as Place[];
    return places.every(isPlace) ? places : [];
  } catch {
    return [];
  }
}

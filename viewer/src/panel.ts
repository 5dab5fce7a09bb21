// The controls beside the picture.

import { CropPanel } from "./crop";
import { alone, button, checkbox, Choice, el, section } from "./dom";
import { PicturePanel, type Measured } from "./facts";
import { LAYER_TITLES, LAYERS } from "./layers";
import { FULL_ERROR, type Compare } from "./legend";
import { MeasurePanel } from "./measure";
import { MediaPanel } from "./media";
import { hide } from "./messages";
import { PathPanel, type PathActions } from "./paths";
import type { Ask, SceneFacts, Shown } from "./protocol";
import { describe, summary } from "./rayview";
import { SlicePanel } from "./slice";
import type { State } from "./state";
import { TrainingPanel } from "./training";
import type { Views } from "./views";

export interface Actions extends PathActions {
  changed(moving: boolean): void;
  photo(view: number | null): void;
  step(by: number): void;
  forgetRay(): void;
  compare(how: Compare): void;
  slice(): void;
  screenshot(): void;
  help(): void;
  ask(wish: Ask): void;
}

type Overlay = "surfaces" | "hull" | "bricks" | "cameras" | "boxes";
const OVERLAYS: [Overlay, string, string][] = [
  ["surfaces", "surfaces", "Lines on the surface of each refractive region; those on the far side are faint (G)"],
  ["hull", "hull", "The hull of what was found to be refractive, or given by masks: rays that miss it stay straight"],
  ["bricks", "grid", "The outline of the blocks of voxels that the grid stores; the rest is empty"],
  ["cameras", "cameras", "Where the photographs were taken; held-out ones are orange"],
  ["boxes", "boxes", "The box of the scene, and those of refractive regions in green"],
];

export class Panel {
  readonly training: TrainingPanel;
  readonly measure: MeasurePanel;
  readonly path: PathPanel;
  readonly slice: SlicePanel;
  private readonly layers: Choice<Shown>;
  private readonly compare: Choice<Compare>;
  private readonly straight: HTMLInputElement;
  private readonly name = el("h1", {}, "refraxel");
  private readonly verdict = section("Verdict");
  private readonly media: MediaPanel;
  private readonly ray = section("Ray");
  private readonly rayBody = el("div");
  /** The same in short, over the picture. */
  private readonly rayCard = document.querySelector<HTMLElement>("#ray")!;
  private readonly photos = el("select", { "aria-label": "Photograph" });
  private readonly photoSection: HTMLElement;
  private readonly picture: PicturePanel;
  private readonly overlays = new Map<Overlay, { label: HTMLElement; box: HTMLInputElement }>();

  constructor(
    private readonly root: HTMLElement,
    private readonly views: Views,
    private readonly state: State,
    private readonly actions: Actions,
  ) {
    const layers = LAYERS.map((l, k) => [l, l, `${LAYER_TITLES[l]} (${k + 1})`] as const);
    this.layers = new Choice("Layer", layers, (l) => this.chooseLayer(l));
    const [straight, box] = checkbox("straight rays", "As if nothing bent them (B)", (on) => {
      state.straight = on;
      actions.changed(false);
    });
    this.straight = box;
    const kinds = [
      ["off", "off", "No photograph"],
      ["side", "side", "Photograph beside the rendering"],
      ["wipe", "wipe", "Photograph on the left of a boundary to drag"],
      ["difference", "difference", "Four times the difference: black where both agree"],
      [
        "error",
        "error",
        `Mean error of the three colours: black for none, pale yellow from ${FULL_ERROR} of 255 steps on`,
      ],
    ] as const;
    this.compare = new Choice("Comparison", kinds, (how) => actions.compare(how));
    this.training = new TrainingPanel((wish) => actions.ask(wish));
    this.photoSection = this.buildPhotos();
    this.media = new MediaPanel(state, (moving) => actions.changed(moving));
    this.slice = new SlicePanel(state, () => actions.slice());
    this.path = new PathPanel(state, actions);
    this.measure = new MeasurePanel(state, () => actions.overlay());
    this.picture = new PicturePanel(state, actions);
    this.ray.append(this.rayBody);
    const header = el("header", {}, this.name, alone(button("?", "Keys and gestures (?)", () => actions.help())));
    root.append(
      header,
      this.training.element,
      this.verdict,
      section("Layer", this.layers.element, straight),
      this.media.element,
      this.ray,
      this.views.element,
      this.photoSection,
      this.slice.element,
      this.measure.element,
      new CropPanel(state, (moving) => actions.changed(moving)).element,
      this.buildOverlays(),
      this.path.element,
      this.picture.element,
    );
    this.update();
  }

  private buildPhotos(): HTMLElement {
    this.photos.addEventListener("change", () =>
      this.actions.photo(this.photos.value === "" ? null : Number(this.photos.value)),
    );
    const { step } = this.actions;
    const row = el(
      "div",
      { class: "row" },
      button("‹", "Previous photograph (P)", () => step(-1)),
      this.photos,
      button("›", "Next photograph (N)", () => step(1)),
    );
    return section("Photographs", row, el("p", { class: "label" }, "compare"), this.compare.element);
  }

  private buildOverlays(): HTMLElement {
    const all = OVERLAYS.map(([name, text, title]) => {
      const [label, box] = checkbox(text, title, (on) => {
        this.state[name] = on;
        this.actions.overlay();
      });
      this.overlays.set(name, { label, box });
      return label;
    });
    // What these show is here already.
    for (const name of ["cameras", "boxes"] as const) alone(this.overlays.get(name)!.box);
    return section("Overlays", ...all);
  }

  chooseLayer(layer: Shown): void {
    if (!this.layers.has(layer)) return;
    this.state.layer = layer;
    this.update();
    this.actions.changed(false);
  }

  /** Takes over what a scene has; `isOther` if its media or photographs may be others than before. */
  takeScene(scene: SceneFacts, isOther: boolean): void {
    this.name.textContent = scene.name;
    this.name.title = `${scene.step} steps, grid of ${scene.resolution.join(" × ")} nodes, ${scene.voxels} voxels`;
    const bends = scene.regions.length > 0;
    this.picture.take(scene);
    this.showVerdict(scene);
    this.overlays.get("surfaces")!.label.hidden = !bends;
    this.overlays.get("hull")!.label.hidden = !scene.has_hull;
    const hidden = { index: !bends, normal: !bends, reflection: !scene.reflects, transmission: !scene.reflects };
    this.straight.parentElement!.hidden = !bends;
    this.layers.limit((layer) => !(hidden as Partial<Record<Shown, boolean>>)[layer]);
    if (!isOther) return this.media.follow(scene);
    this.ray.hidden = false;
    this.slice.take(scene);
    this.media.take(scene);
    const options = scene.views.map((v, k) => el("option", { value: String(k) }, `${v.name} (${v.split})`));
    this.photos.replaceChildren(el("option", { value: "" }, "free camera"), ...options);
    this.photoSection.hidden = scene.views.length === 0;
    this.update();
  }

  /** What was decided, and the picture that convinced; a run that raced instead has no such picture. */
  private showVerdict({ verdict, step }: SceneFacts): void {
    this.verdict.hidden = !verdict;
    if (!verdict) return;
    const picture = el("img", {
      class: "evidence",
      src: `evidence.png?${step}`,
      alt: "Photograph, straight through, and prediction",
    });
    const link = el("a", { href: picture.src, target: "_blank", title: "The whole picture" }, picture);
    link.hidden = true;
    picture.addEventListener("load", () => (link.hidden = false));
    const lines = verdict.split("\n").map((line) => el("p", { class: "hint" }, line));
    this.verdict.replaceChildren(this.verdict.firstElementChild!, ...lines, link);
  }

  /** Shows the ray in numbers: in short over the picture, and all of them here. */
  showRay(scene: SceneFacts): void {
    const { ray } = this.state;
    if (!ray) return this.update();
    this.rayBody.replaceChildren(
      describe(ray, scene),
      el("p", { class: "hint" }, "Turn the scene to see it in space. Orange: as rendered. Grey: if it were straight."),
    );
    const close = button("×", "Forget the ray", () => this.actions.forgetRay());
    this.rayCard.replaceChildren(summary(ray), close);
    this.rayCard.hidden = false;
  }

  /** Brings all numbers of the ray into sight. */
  goToRay(): void {
    this.ray.scrollIntoView({ block: "nearest" });
  }

  statistics(measured: Measured): void {
    this.picture.show(measured);
    this.training.shows(measured.header.step);
  }

  /** Without the program, everything is off that needs its answer. */
  setLive(isLive: boolean): void {
    for (const control of this.root.querySelectorAll<HTMLButtonElement>("button, select, input"))
      control.disabled = !isLive && !control.dataset.alone;
    if (!isLive) this.path.lose();
  }

  update(): void {
    const { state } = this;
    this.layers.set(state.layer);
    this.compare.set(state.compare);
    this.straight.checked = state.straight;
    this.views.update();
    this.overlays.forEach(({ box }, name) => (box.checked = state[name]));
    this.photos.value = state.photo === null ? "" : String(state.photo);
    this.path.update();
    this.measure.update();
    if (state.ray) return;
    hide(this.rayCard);
    this.rayBody.replaceChildren(el("p", { class: "hint" }, "Click the picture to follow the ray of that pixel."));
  }
}

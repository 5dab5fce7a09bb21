// The controls beside the picture.

import { alone, button, checkbox, Choice, el, section, Slider } from "./dom";
import { LAYERS, type Ask, type BentRay, type Header, type Layer, type PageCamera, type Scene } from "./protocol";
import { FULL_ERROR, indexLegend, words, type Compare } from "./legend";
import { hide } from "./messages";
import { describe, summary } from "./rayview";
import type { Settings } from "./settings";
import type { Views } from "./views";
import { TrainingPanel } from "./training";

export interface State extends Settings {
  layer: Layer;
  straight: boolean;
  /** Index per region; null as learned. */
  index: (number | null)[];
  /** Factor on the absorption per region; null as learned. */
  absorption: (number | null)[];
  photo: number | null;
  compare: Compare;
  slice: { region: number; axis: number; at: number } | null;
  keys: PageCamera[];
  ray: BentRay | null;
}

export interface Actions {
  changed(moving: boolean): void;
  overlay(): void;
  photo(view: number | null): void;
  step(by: number): void;
  forgetRay(): void;
  compare(how: Compare): void;
  slice(): void;
  play(): void;
  save(): void;
  addKey(): void;
  screenshot(): void;
  help(): void;
  ask(wish: Ask): void;
}

export interface Measured {
  header: Header & { picture: "frame" };
  bytes: number;
  latency: number | null;
  rate: number;
}

/** Longest edges to choose from [pixel]; null: as the screen. */
const SIZES = [null, 640, 1280, 2048];
/** Indices of the slider, and those of known materials. */
const INDICES: [number, number, number] = [1, 2.5, 0.005];
const MATERIALS: [string, number][] = [
  ["air", 1],
  ["water", 1.33],
  ["glass", 1.5],
  ["diamond", 2.42],
];
const LAYER_TITLES: Record<Layer, string> = {
  colour: "What the camera sees",
  depth: "Distance along the ray to what is seen: near is yellow",
  opacity: "How much of the background is hidden",
  index: "The index of refraction on the way that differs most from 1",
  normal: "Normals of the first refractive surface",
  reflection: "The light that surfaces mirror, alone",
  transmission: "Everything but the light that surfaces mirror",
};

export class Panel {
  readonly training: TrainingPanel;
  private readonly layers: Choice<Layer>;
  private readonly compare: Choice<Compare>;
  private readonly straight: HTMLInputElement;
  private readonly name = el("h1", {}, "refraxel");
  private readonly verdict = section("Verdict");
  private readonly media = section("Index of refraction");
  private readonly ray = section("Ray");
  private readonly rayBody = el("div");
  /** The same in short, over the picture. */
  private readonly rayCard = document.querySelector<HTMLElement>("#ray")!;
  private readonly photos = el("select", { "aria-label": "Photograph" });
  private readonly photoSection: HTMLElement;
  private readonly sliceSection: HTMLElement;
  private readonly sliceCanvas = el("canvas", {
    width: "16",
    height: "16",
    hidden: true,
    role: "img",
    "aria-label": "Index in the plane",
  });
  private readonly sliceScale = el("p", { class: "scale", hidden: true });
  private readonly keys = el("p", { class: "hint" });
  private readonly stats = el("dl", { class: "facts" });
  private readonly scene = el("dl", { class: "facts" });
  private readonly overlays: (() => void)[] = [];
  private surfaces: HTMLElement | null = null;
  private sliders: { index: Slider; absorption: Slider }[] = [];
  /** Which region is cut, where there are several. */
  private readonly cutRegion = el("div");
  /** The region that is cut, and the one whose glass the buttons set; null for all. */
  private chosen: { cut: number; glass: number | null } = { cut: 0, glass: null };
  /** Bytes received, and when. */
  private received: { time: number; bytes: number }[] = [];

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
    this.sliceSection = this.buildSlice();
    this.ray.append(this.rayBody);
    const header = el("header", {}, this.name, alone(button("?", "Keys and gestures (?)", () => actions.help())));
    root.append(
      header,
      this.training.element,
      this.verdict,
      section("Layer", this.layers.element, straight),
      this.media,
      this.ray,
      this.views.element,
      this.photoSection,
      this.sliceSection,
      this.buildOverlays(),
      this.buildPath(),
      this.buildPicture(),
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

  private buildSlice(): HTMLElement {
    const axes = new Choice<string>(
      "Axis across",
      [
        ["0", "x", "Across the x axis"],
        ["1", "y", "Across the y axis"],
        ["2", "z", "Across the z axis"],
        ["none", "off", "No slice"],
      ],
      (axis) => {
        const { slice } = this.state;
        this.state.slice =
          axis === "none" ? null : { region: this.chosen.cut, at: slice?.at ?? 0.5, axis: Number(axis) };
        axes.set(axis);
        this.sliceCanvas.hidden = this.sliceScale.hidden = axis === "none";
        this.actions.slice();
      },
    );
    axes.set("none");
    const place = new Slider(
      "place",
      [0, 1, 0.01],
      (x) => x.toFixed(2),
      (x) => {
        if (this.state.slice) this.state.slice.at = x;
        this.actions.slice();
      },
    );
    place.set(0.5);
    return section(
      "Slice of the index",
      this.cutRegion,
      axes.element,
      place.element,
      this.sliceCanvas,
      this.sliceScale,
    );
  }

  /** Buttons that choose a region, where there are several. */
  private regionChoice(
    label: string,
    scene: Scene,
    others: [string, string, string][],
    choose: (k: number) => void,
  ): HTMLElement[] {
    const count = scene.regions.length;
    if (count < 2) return [];
    const each = scene.regions.map((_, k): [string, string, string] => [String(k), String(k + 1), `Region ${k + 1}`]);
    const choice = new Choice<string>(label, [...others, ...each], (value) => {
      choice.set(value);
      choose(Number(value));
    });
    choice.set([...others, ...each][0]![0]);
    return [el("p", { class: "label" }, label.toLowerCase()), choice.element];
  }

  private takeRegions(scene: Scene): void {
    this.chosen = { cut: 0, glass: null };
    const cut = this.regionChoice("Region to cut", scene, [], (k) => {
      this.chosen.cut = k;
      if (this.state.slice) this.state.slice.region = k;
      this.actions.slice();
    });
    this.cutRegion.replaceChildren(...cut);
    if (this.state.slice) this.state.slice.region = 0;
  }

  private buildOverlays(): HTMLElement {
    const of = (name: "boxes" | "cameras" | "surfaces", text: string, title: string) => {
      const [label, box] = checkbox(text, title, (on) => {
        this.state[name] = on;
        this.actions.overlay();
      });
      if (name !== "surfaces") alone(box);
      this.overlays.push(() => (box.checked = this.state[name]));
      return label;
    };
    const surfaces = of(
      "surfaces",
      "surfaces",
      "Lines on the surface of each refractive region; those on the far side are faint (G)",
    );
    this.surfaces = surfaces;
    return section(
      "Overlays",
      surfaces,
      of("cameras", "cameras", "Where the photographs were taken; held-out ones are orange"),
      of("boxes", "boxes", "The box of the scene, and those of refractive regions in green"),
    );
  }

  private buildPath(): HTMLElement {
    const seconds = new Slider(
      "seconds",
      [1, 60, 1],
      (x) => `${x} s`,
      (x) => (this.state.seconds = x),
    );
    const fps = new Slider("frames per second", [10, 60, 1], String, (x) => (this.state.fps = x));
    seconds.set(this.state.seconds);
    fps.set(this.state.fps);
    const { actions } = this;
    const clear = alone(
      button("Clear", "Forget the keyframes", () => {
        this.state.keys.length = 0;
        this.update();
        actions.overlay();
      }),
    );
    const row = el(
      "div",
      { class: "row" },
      button("Add keyframe", "The camera as it is now (K)", () => actions.addKey()),
      button("Play", "Go along the path (Space)", () => actions.play()),
      alone(button("Save", "camera_path.json, for refraxel render --camera-path", () => actions.save())),
      clear,
    );
    return section("Camera path", row, this.keys, seconds.element, fps.element);
  }

  private buildPicture(): HTMLElement {
    const options = SIZES.map((n) =>
      n
        ? ([String(n), String(n), `${n} pixels`] as const)
        : ([
            "null",
            "as the screen",
            "Every pixel of the screen; fewer while it moves, and where the program is slow",
          ] as const),
    );
    const sizes = new Choice<string>("Longest edge", options, (n) => {
      this.state.pixels = n === "null" ? null : Number(n);
      sizes.set(n);
      this.actions.changed(false);
    });
    sizes.set(String(this.state.pixels));
    const row = el(
      "div",
      { class: "row" },
      alone(button("Screenshot", "Save picture and lines as PNG (X)", () => this.actions.screenshot())),
    );
    return section(
      "Picture",
      el("p", { class: "label" }, "longest edge [pixel]"),
      sizes.element,
      this.stats,
      row,
      el("p", { class: "label" }, "scene"),
      this.scene,
    );
  }

  chooseLayer(layer: Layer): void {
    if (!this.layers.has(layer)) return;
    this.state.layer = layer;
    this.update();
    this.actions.changed(false);
  }

  /** Takes over what a scene has; `isOther` if its media or photographs may be others than before. */
  takeScene(scene: Scene, isOther: boolean): void {
    this.name.textContent = scene.name;
    this.name.title = `${scene.step} steps, grid of ${scene.resolution.join(" × ")} nodes, ${scene.voxels} voxels`;
    const bends = scene.regions.length > 0;
    const facts: [string, string][] = [
      ["steps learned", String(scene.step)],
      ["grid", scene.resolution.join(" × ")],
      ["voxels", scene.voxels.toLocaleString("en")],
      ["photographs", String(scene.views.length)],
      [
        "refractive regions",
        scene.regions.map((r) => `n = ${r.index.toFixed(3)}${r.sharp ? "" : ", graded"}`).join("; ") || "none",
      ],
    ];
    this.scene.replaceChildren(...facts.flatMap(([name, value]) => [el("dt", {}, name), el("dd", {}, value)]));
    this.showVerdict(scene);
    this.surfaces!.hidden = !bends;
    const hidden = { index: !bends, normal: !bends, reflection: !scene.reflects, transmission: !scene.reflects };
    this.straight.parentElement!.hidden = !bends;
    this.layers.limit((layer) => !(hidden as Partial<Record<Layer, boolean>>)[layer]);
    if (!isOther) {
      // Sliders stay as they are, since a hand may be on them.
      this.sliders.forEach((s, k) => this.state.index[k] === null && s.index.set(scene.regions[k]!.index));
      return;
    }
    this.takeRegions(scene);
    this.takeMedia(scene);
    const options = scene.views.map((v, k) => el("option", { value: String(k) }, `${v.name} (${v.split})`));
    this.photos.replaceChildren(el("option", { value: "" }, "free camera"), ...options);
    this.photoSection.hidden = scene.views.length === 0;
    this.sliceSection.hidden = scene.regions.length === 0;
    this.update();
  }

  /** What was decided, and the picture that convinced; a run that raced instead has no such picture. */
  private showVerdict({ verdict, step }: Scene): void {
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

  private takeMedia(scene: Scene): void {
    const { state, actions } = this;
    this.media.hidden = scene.regions.length === 0;
    this.ray.hidden = false;
    this.sliders = scene.regions.map((region, k) => {
      const label = scene.regions.length > 1 ? `region ${k + 1}` : "n";
      const index = new Slider(
        label,
        INDICES,
        (x) => x.toFixed(3),
        (x) => {
          state.index[k] = x;
          actions.changed(true);
        },
      );
      const clear = region.absorption.every((a) => a === 0);
      // Of clear glass there is nothing to multiply: it becomes grey.
      const title = scene.regions.length > 1 ? `absorption ${k + 1}` : "absorption";
      const shown = (x: number) => (clear ? `${Math.round(100 * (1 - Math.exp(-x)))} % grey` : `× ${x.toFixed(2)}`);
      const absorption = new Slider(title, [0, 5, 0.05], shown, (x) => {
        state.absorption[k] = x;
        actions.changed(true);
      });
      index.set(state.index[k] ?? region.index);
      absorption.set(state.absorption[k] ?? (clear ? 0 : 1));
      return { index, absorption };
    });
    state.index = scene.regions.map((_, k) => state.index[k] ?? null);
    state.absorption = scene.regions.map((_, k) => state.absorption[k] ?? null);
    const set = (n: number | null) => {
      this.sliders.forEach((s, k) => {
        if (this.chosen.glass !== null && this.chosen.glass !== k) return;
        state.index[k] = n;
        s.index.set(n ?? scene.regions[k]!.index);
        if (n !== null) return;
        state.absorption[k] = null;
        s.absorption.set(scene.regions[k]!.absorption.every((a) => a === 0) ? 0 : 1);
      });
      actions.changed(false);
    };
    const all: [string, string, string][] = [["NaN", "all", "Every region"]];
    const target = this.regionChoice(
      "Glass of region",
      scene,
      all,
      (k) => (this.chosen.glass = Number.isNaN(k) ? null : k),
    );
    const materials = MATERIALS.map(([name, n]) => button(name, `n = ${n}`, () => set(n)));
    const learned = button("learned", "As the run has found it", () => set(null));
    const parts = this.sliders.flatMap((s) => [s.index.element, s.absorption.element]);
    const row = el("div", { class: "row" }, ...materials, learned);
    this.media.replaceChildren(this.media.firstElementChild!, ...parts, ...target, row);
  }

  /** Shows the ray in numbers: in short over the picture, and all of them here. */
  showRay(scene: Scene): void {
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

  showSlice(bitmap: ImageBitmap, range: [number, number]): void {
    [this.sliceCanvas.width, this.sliceCanvas.height] = [bitmap.width, bitmap.height];
    this.sliceCanvas.getContext("2d")!.drawImage(bitmap, 0, 0);
    const legend = indexLegend(range);
    this.sliceCanvas.setAttribute("aria-label", `Index in the plane: ${words(legend)}`);
    const bar = el("i");
    bar.style.background = `linear-gradient(to right, ${legend.scale!.colours.join()})`;
    const [low, high] = legend.scale!.ends;
    this.sliceScale.replaceChildren(el("span", {}, legend.name), el("span", {}, low), bar, el("span", {}, high));
  }

  statistics({ header, bytes, latency, rate }: Measured): void {
    const rays = header.rays === 0 ? "coarse" : header.rays === 1 ? "1 ray per pixel" : `${header.rays} rays per pixel`;
    const facts: [string, string][] = [
      ["picture", `${header.size.join(" × ")}, ${rays}`],
      ["computed in", `${header.ms.toFixed(0)} ms`],
      ["bytes", `${(bytes / 1000).toFixed(1)} kB`],
      ["frames", `${rate} / s`],
      ["link", `${this.linkRate(bytes).toFixed(0)} kB / s`],
    ];
    if (latency !== null) facts.push(["latency", `${latency.toFixed(0)} ms`]);
    this.stats.replaceChildren(...facts.flatMap(([name, value]) => [el("dt", {}, name), el("dd", {}, value)]));
    this.training.shows(header.step);
  }

  /** Kilobytes per second of late. */
  private linkRate(bytes: number): number {
    const now = performance.now();
    this.received.push({ time: now, bytes });
    this.received = this.received.filter((r) => r.time > now - 1000);
    return this.received.reduce((sum, r) => sum + r.bytes, 0) / 1000;
  }

  /** Without the program, everything is off that needs its answer. */
  setLive(isLive: boolean): void {
    for (const control of this.root.querySelectorAll<HTMLButtonElement>("button, select, input"))
      control.disabled = !isLive && !control.dataset.alone;
  }

  update(): void {
    const { state } = this;
    this.layers.set(state.layer);
    this.compare.set(state.compare);
    this.straight.checked = state.straight;
    this.views.update();
    this.overlays.forEach((update) => update());
    this.photos.value = state.photo === null ? "" : String(state.photo);
    this.keys.textContent =
      state.keys.length === 0
        ? "Press K at each place that the camera shall pass."
        : `${state.keys.length} keyframe${state.keys.length > 1 ? "s" : ""}`;
    if (state.ray) return;
    hide(this.rayCard);
    this.rayBody.replaceChildren(el("p", { class: "hint" }, "Click the picture to follow the ray of that pixel."));
  }
}

// Chooses a folder of photographs or a video of this machine. A browser does not tell where a folder lies, so the program lists them.

import { button, el } from "../src/dom";
import type { Folder, Place } from "./protocol";

export interface Choices {
  /** What is in a folder is to be told. */
  list(path: string): void;
  /** A folder or a video is chosen. */
  choose(path: string): void;
  /** The folder of a run is chosen. */
  open(path: string): void;
  close(): void;
}

export class Chooser {
  readonly element = el("section", { "aria-label": "Choose photographs" });
  private readonly path: HTMLInputElement;
  private readonly known = el("datalist", { id: "folders" });
  private readonly places = el("div", { class: "row", role: "group", "aria-label": "Places" });
  private readonly content = el("div", { class: "listing" });
  private readonly chosen = el("div", { class: "chosen" });

  constructor(private readonly choices: Choices) {
    this.path = el("input", {
      type: "text",
      list: "folders",
      spellcheck: "false",
      autocomplete: "off",
      "aria-label": "Folder or video",
    });
    const go = el("form", { class: "path" }, this.path, el("button", { title: "Shows what is in this folder" }, "Go"));
    go.addEventListener("submit", (event) => {
      event.preventDefault();
      this.list(this.path.value.trim());
    });
    // A name that is completed by the list is gone to at once.
    this.path.addEventListener("input", (event) => {
      const isCompleted = !(event instanceof InputEvent) || event.inputType === "insertReplacementText";
      if (isCompleted) this.list(this.path.value);
    });
    const close = button("Cancel", "Back to the start", () => choices.close());
    const head = el("div", { class: "head" }, el("h2", {}, "Choose a folder of photographs, or a video"), close);
    this.element.append(head, this.places, go, this.known, this.content, this.chosen);
  }

  /** Asks for another folder. Until it is shown, the last one cannot be chosen. */
  list(path: string): void {
    this.chosen.replaceChildren();
    this.choices.list(path);
  }

  showPlaces(places: Place[]): void {
    const go = ({ name, path }: Place) => button(name, path, () => this.list(path));
    this.places.replaceChildren(...places.map(go));
  }

  show(folder: Folder): void {
    this.path.value = folder.path;
    this.known.replaceChildren(...folder.folders.map(({ path }) => el("option", { value: path })));
    const { parent } = folder;
    const up = parent === null ? [] : [this.entry("↑", "the folder above", () => this.list(parent))];
    const folders = folder.folders.map(({ name, path }) => this.entry("📁", name, () => this.list(path)));
    const videos = folder.videos.map(({ name, path }) => this.entry("🎞", name, () => this.choices.choose(path)));
    const more = folder.left_out > 0 ? [el("p", { class: "hint" }, `${folder.left_out} more are not listed.`)] : [];
    this.content.replaceChildren(...up, ...folders, ...videos, ...more);
    this.content.scrollTop = 0;
    this.chosen.replaceChildren(...this.choice(folder));
  }

  private entry(sign: string, name: string, go: () => void): HTMLElement {
    const made = el("button", { type: "button", class: "entry" }, el("span", { "aria-hidden": "true" }, sign), name);
    made.addEventListener("click", () => go());
    return made;
  }

  private choice({ path, photographs, unread, videos, is_run }: Folder): HTMLElement[] {
    if (is_run) {
      const open = button("Look at this run", "Opens it in the viewer", () => this.choices.open(path));
      open.className = "main";
      return [el("p", {}, "This is the folder of a run."), open];
    }
    const says =
      photographs > 0
        ? `${count(photographs, "photograph")} here.`
        : unread > 0
          ? `${count(unread, "photograph")} here, in a format that is not read.`
          : videos.length > 0
            ? "Choose a video above."
            : "No photographs directly here; a dataset may keep them in folders below.";
    const use = button("Use this folder", "Says what is in it, and what looks wrong", () => this.choices.choose(path));
    if (photographs > 0) use.className = "main";
    return [el("p", {}, says), use];
  }
}

/** "1 photograph", "2 photographs". */
function count(n: number, noun: string): string {
  return `${n} ${noun}${n === 1 ? "" : "s"}`;
}

// A film along the camera path, which the program renders while the page stays as it is.

import { alone, button, Choice, el } from "./dom";
import type { FilmFormat, FilmState } from "./protocol";

const FORMATS: readonly (readonly [FilmFormat, string, string])[] = [
  ["mp4", "MP4", "For most players; ffmpeg has to be installed"],
  ["webm", "WebM", "For browsers; ffmpeg has to be installed"],
  ["gif", "GIF", "Needs no other program; large, and of 256 colours"],
];

export class FilmPanel {
  readonly element: HTMLElement;
  private readonly bar = el("progress", { max: "100", "aria-label": "Film", hidden: true });
  private readonly says = el("p", { class: "hint", role: "status", hidden: true });
  private readonly render: HTMLButtonElement;
  private readonly stop: HTMLButtonElement;
  /** Films that were ready, each under another address than the one before. */
  private ready = 0;
  private format: FilmFormat = "mp4";

  /** `begin` asks for a film, if there is a path; `nameOf` is what its file is called. */
  constructor(
    begin: (format: FilmFormat) => boolean,
    stop: () => void,
    private readonly nameOf: () => string,
  ) {
    const formats = new Choice<FilmFormat>("Film as", FORMATS, (format) => {
      this.format = format;
      formats.set(format);
    });
    formats.set(this.format);
    this.render = button("Render film", "The layer and the glass as they are shown, along this path", () => {
      if (begin(this.format)) this.take({ film: "renders", pace: null });
    });
    this.stop = alone(button("Stop film", "Nothing of it is kept", () => stop()));
    const row = el("div", { class: "row" }, formats.element, this.render, this.stop);
    this.element = el("div", { class: "film" }, row, this.bar, this.says);
    this.stop.hidden = true;
  }

  /** There is no answer any more. */
  lose(): void {
    if (!this.stop.hidden) this.take({ film: "stopped" });
  }

  take(state: FilmState): void {
    const isRendered = state.film === "renders";
    this.stop.hidden = this.bar.hidden = !isRendered;
    this.render.hidden = isRendered;
    this.says.hidden = false;
    if (state.film === "renders") {
      const { pace } = state;
      if (pace) this.bar.value = pace.percent;
      else this.bar.removeAttribute("value");
      this.says.textContent = pace ? `${pace.percent} %${pace.left ? `, ${pace.left} left` : ""}` : "The film begins.";
    } else if (state.film === "stopped") this.says.textContent = "The film was stopped.";
    else if (state.film === "failed") this.says.replaceChildren(el("span", { class: "why" }, state.why));
    else {
      const extension = state.file.split(".").pop()!;
      const href = `${state.file}?${++this.ready}`;
      const link = el("a", { href, download: `${this.nameOf()}.${extension}` }, "Save the film");
      this.says.replaceChildren("The film is ready. ", link);
    }
  }
}

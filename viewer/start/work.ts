// A verb that is at work, or was last: how far it is, what it has found, why it has failed, and what can be done next.

import { button, Choice, el } from "../src/dom";
import type { Refraction, Task, Work } from "./protocol";

export interface Steps {
  begin(task: Task): void;
  stop(): void;
  /** Back to the start. */
  forget(): void;
  open(run: string): void;
}

/** Minutes of a training to choose from. */
const MINUTES = [2, 5, 10, 30, 60];
const REFRACTION: readonly (readonly [Refraction, string, string])[] = [
  ["auto", "find out", "Rays bend where masks or the search say so, and held-out photographs agree"],
  ["on", "yes, bend rays", "There is glass or water, whatever the search says"],
  ["off", "no, straight rays", "Nothing refracts, or it does not matter"],
];
/** Columns of a label in what the program prints. */
const LABEL = 11;
const TITLES: Record<Task["verb"], Record<Work["stage"], string>> = {
  inspect: {
    works: "Looking at the photographs",
    stops: "Stopping",
    done: "What is in the photographs",
    stopped: "Stopped",
    failed: "The photographs cannot be used as they are",
  },
  import: {
    works: "Computing where the photographs were taken",
    stops: "Stopping; what is done is kept",
    done: "The photographs have poses",
    stopped: "Stopped",
    failed: "The poses cannot be computed",
  },
  train: {
    works: "Training",
    stops: "Saving, then stopping",
    done: "The training has finished",
    stopped: "The training was stopped and is saved",
    failed: "The training has failed",
  },
};

/** What the person has chosen for the next training; it stays while the page is told of something new. */
export const choices: { minutes: number; refraction: Refraction } = { minutes: 10, refraction: "auto" };

/** Shows one verb; while it is at work, what it says is brought up to date in place, so that no button goes away under a hand. */
export class WorkView {
  readonly element: HTMLElement;
  private readonly progress: Progress | null = null;

  constructor(
    private readonly work: Work,
    folder: string,
    steps: Steps,
  ) {
    const { task, stage } = work;
    const isAtWork = stage === "works" || stage === "stops";
    const title = work.needs_poses ? "The photographs have no poses yet" : TITLES[task.verb][stage];
    const parts: HTMLElement[] = [el("p", { class: "hint path-shown" }, task.path)];
    if (isAtWork) {
      this.progress = new Progress(work, steps);
      parts.push(this.progress.element);
    } else if (work.needs_poses) parts.push(...poses(work, folder, steps));
    else if (stage !== "done") parts.push(el("pre", { class: "why", role: "alert" }, work.why ?? ""));
    if (work.found) parts.push(rows(work.found));
    if (stage === "done" && task.verb === "inspect") {
      parts.push(train(task.path, folder, steps), ...pictures(work.number));
    }
    if (stage === "done" && task.verb === "import") {
      parts.push(main("Look at the result", "Inspects it", () => steps.begin({ verb: "inspect", path: work.out! })));
    }
    if (!isAtWork && work.run) parts.push(main("Look at the scene", "Opens the viewer", () => steps.open(work.run!)));
    if (!isAtWork) parts.push(button("Back to the start", "Recent runs, and other photographs", () => steps.forget()));
    parts.push(el("p", { class: "hint" }, "The same in a terminal: ", el("code", {}, work.command)));
    this.element = el("section", { "aria-label": title }, el("h2", {}, title), ...parts);
  }

  /** Whether this shows a later state of the same work, too. */
  update(work: Work): boolean {
    if (work.number !== this.work.number || work.stage !== this.work.stage) return false;
    this.progress?.update(work);
    return true;
  }
}

/** How far a verb is. */
class Progress {
  readonly element = el("div", { class: "progress" });
  private readonly bar = el("progress", { max: "100", "aria-label": "Progress" });
  private readonly says = el("p", { class: "pace" });
  private readonly lines = el("pre", { class: "lines" });
  private readonly live = el("a", { target: "_blank", title: "The scene while it learns" }, "Watch it learn");

  constructor(work: Work, steps: Steps) {
    const saves = work.task.verb === "train" ? "Saves what was learned, and ends" : "Ends it";
    const stop = button("Stop", saves, () => steps.stop());
    stop.disabled = work.stage === "stops";
    this.element.append(this.bar, this.says, this.lines, el("div", { class: "row" }, stop, this.live));
    this.update(work);
  }

  update({ pace, lines, live }: Work): void {
    if (pace) this.bar.value = pace.percent;
    else this.bar.removeAttribute("value");
    const left = pace?.left ? `, ${pace.left} left` : "";
    this.says.textContent = pace ? `${pace.task} ${pace.percent} %${left}` : "It begins.";
    this.lines.textContent = lines.join("\n");
    this.lines.hidden = lines.length === 0;
    this.live.hidden = live === null;
    if (live !== null) this.live.href = live;
  }
}

function main(text: string, title: string, go: () => void): HTMLButtonElement {
  const made = button(text, title, go);
  made.className = "main";
  return made;
}

function poses({ task, why }: Work, folder: string, steps: Steps): HTMLElement[] {
  const text =
    "First it has to be found out where each photograph was taken. COLMAP does that, which has to be installed, and for a video " +
    `ffmpeg; for 50 photographs it takes some minutes. The result goes into ${folder}.`;
  const details = el("details", {}, el("summary", {}, "What was found"), el("pre", {}, why ?? ""));
  const begin = main("Compute the poses", "Runs refraxel import", () =>
    steps.begin({ verb: "import", path: task.path }),
  );
  return [el("p", {}, text), begin, details];
}

/** What the program prints of a dataset: a label and a text in each line. */
function rows(found: string): HTMLElement {
  const list = el("dl", { class: "found" });
  let isPictures = false;
  for (const line of found.split("\n").slice(1)) {
    const [label, text] = [line.slice(0, LABEL).trim(), line.slice(LABEL)];
    if (label) isPictures = label === "pictures";
    if (isPictures) continue; // they are shown
    const last = list.lastElementChild;
    if (!label && last) last.append(el("br"), text);
    else list.append(el("dt", { class: label }, label), el("dd", { class: label }, text));
  }
  return list;
}

function pictures(number: number): HTMLElement[] {
  const one = (name: string, alt: string) => {
    const src = `inspect_${name}.png?${number}`;
    const link = el("a", { href: src, target: "_blank", title: "The whole picture" }, el("img", { src, alt }));
    return el("figure", {}, link, el("figcaption", { class: "hint" }, alt));
  };
  return [
    one("photographs", "Photographs with their masks; a coloured frame tells the part, and warnings"),
    one("cameras", "The cameras from above and from the side"),
  ];
}

function train(path: string, folder: string, steps: Steps): HTMLElement {
  const minutes = el("input", { type: "number", min: "0.1", max: "10000", step: "any", "aria-label": "Minutes" });
  minutes.value = String(choices.minutes);
  const lengths = MINUTES.map((m) => [String(m), `${m} min`, `${m} minutes`] as const);
  const length = new Choice<string>("Time", lengths, (m) => take(Number(m)));
  const take = (m: number) => {
    choices.minutes = m;
    minutes.value = String(m);
    length.set(String(m));
  };
  minutes.addEventListener("input", () => {
    choices.minutes = minutes.valueAsNumber;
    length.set(String(choices.minutes));
  });
  length.set(String(choices.minutes));
  const refraction = new Choice<Refraction>("Glass or water", REFRACTION, (how) => {
    choices.refraction = how;
    refraction.set(how);
  });
  refraction.set(choices.refraction);
  const form = el(
    "form",
    { class: "train", "aria-label": "Train" },
    el("h3", {}, "Train"),
    el("p", { class: "label" }, "How long? More time gives a sharper scene."),
    el("div", { class: "row" }, length.element, el("label", { class: "minutes" }, minutes, "minutes")),
    el("p", { class: "label" }, "Is there glass or water whose rays bend?"),
    refraction.element,
    el("button", { class: "main" }, "Train"),
    el("p", { class: "hint" }, `The scene goes into ${folder}.`),
  );
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    steps.begin({ verb: "train", path, ...choices });
  });
  return form;
}

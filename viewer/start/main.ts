// The start page: recent runs, photographs of this machine, what is said of them, training, and the scene.

import { button, el } from "../src/dom";
import { Link } from "../src/link";
import { Chooser } from "./chooser";
import type { Ask, Recent, Tell, Work } from "./protocol";
import { WorkView } from "./work";

type Home = Omit<Tell & { tell: "home" }, "tell">;

class Page {
  private readonly root = document.querySelector<HTMLElement>("#page")!;
  private readonly message = document.querySelector<HTMLElement>("#message")!;
  private readonly chooser: Chooser;
  private readonly link: Link<Ask, Tell>;
  private home: Home = { folder: "", runs: [], places: [] };
  private work: Work | null = null;
  private view: WorkView | null = null;
  private isChoosing = false;
  /** The training that this page has seen at work, whose scene it shows when it is done. */
  private watched = 0;

  constructor() {
    this.chooser = new Chooser({
      list: (path) => this.ask({ ask: "folder", path }),
      choose: (path) => this.ask({ ask: "begin", verb: "inspect", path }),
      open: (path) => this.open(path),
      close: () => this.choose(false),
    });
    this.link = new Link({
      open: () => this.notice(null),
      closed: (why) => this.notice(why),
      tell: (tell) => this.listen(tell),
    });
    addEventListener("focus", () => this.work === null && !this.isChoosing && this.ask({ ask: "runs" }));
  }

  private ask(ask: Ask): void {
    this.complain(null);
    this.link.send(ask);
  }

  private listen(tell: Tell): void {
    if (tell.tell === "home") this.takeHome(tell);
    else if (tell.tell === "folder") this.chooser.show(tell);
    else if (tell.tell === "work") this.takeWork(tell.work);
    else if (tell.tell === "opened") location.assign(tell.url);
    else if (tell.tell === "refused") this.complain(tell.why);
  }

  private takeHome(home: Home): void {
    this.home = home;
    this.chooser.showPlaces(home.places);
    if (!this.isChoosing && this.work === null) this.render();
  }

  private takeWork(work: Work | null): void {
    const isNew = work?.number !== this.work?.number;
    this.work = work;
    if (work && isNew) this.isChoosing = false;
    if (!work || !this.view?.update(work)) {
      this.view = work && this.viewOf(work);
      if (!this.isChoosing) this.render();
    }
    if (work?.task.verb !== "train") return;
    if (work.stage === "works") this.watched = work.number;
    // Who has stopped a training, or looks at something else, is not led away.
    if (work.stage === "done" && work.run && this.watched === work.number && !document.hidden) this.open(work.run);
  }

  private open(path: string): void {
    this.ask({ ask: "open", path });
    this.notice("The scene is being opened …");
  }

  private choose(isChoosing: boolean): void {
    this.isChoosing = isChoosing;
    if (isChoosing) this.chooser.list(this.home.folder);
    this.render();
  }

  private render(): void {
    if (this.isChoosing) this.root.replaceChildren(this.chooser.element);
    else if (this.view) this.root.replaceChildren(this.view.element);
    else this.root.replaceChildren(this.beginning(), this.recent());
  }

  private viewOf(work: Work): WorkView {
    return new WorkView(work, this.home.folder, {
      begin: (task) => this.ask({ ask: "begin", ...task }),
      stop: () => this.ask({ ask: "stop" }),
      forget: () => this.ask({ ask: "forget" }),
      open: (run) => this.open(run),
    });
  }

  private beginning(): HTMLElement {
    const begin = button("Choose photographs or a video", "Of this machine", () => this.choose(true));
    begin.className = "main";
    const text =
      "30 to 80 photographs from all around, sharp, with textured things beside the glass. They stay where they are; " +
      `what is made of them goes into ${this.home.folder}.`;
    return el("section", { "aria-label": "New scene" }, el("h2", {}, "New scene"), el("p", {}, text), begin);
  }

  private recent(): HTMLElement {
    const { runs, folder } = this.home;
    const other = button("Another folder", "A run that is elsewhere", () => this.choose(true));
    const list = el("div", { class: "listing" }, ...runs.map((run) => this.run(run)));
    const nothing = el("p", { class: "hint" }, `There is none in ${folder} yet.`);
    const parts = [el("h2", {}, "Recent runs"), runs.length > 0 ? list : nothing, other];
    return el("section", { "aria-label": "Recent runs" }, ...parts);
  }

  private run({ name, path, saved }: Recent): HTMLElement {
    const time = el("time", { class: "hint" }, ago(saved));
    const made = el("button", { type: "button", class: "entry", title: path }, el("b", {}, name), time);
    made.addEventListener("click", () => this.open(path));
    return made;
  }

  private notice(text: string | null): void {
    const notice = document.querySelector<HTMLElement>("#notice")!;
    notice.hidden = text === null;
    notice.textContent = text ?? "";
  }

  /** Says in full what cannot be done. */
  private complain(why: string | null): void {
    this.message.hidden = why === null;
    if (why === null) return;
    this.notice(null);
    this.message.replaceChildren(
      el("pre", { class: "why" }, why),
      button("Close", "Takes this away", () => this.complain(null)),
    );
    this.message.scrollIntoView({ block: "nearest" });
  }
}

/** How long ago [s since 1970]. */
function ago(time: number): string {
  const format = new Intl.RelativeTimeFormat("en", { numeric: "auto" });
  const seconds = Math.max(0, Date.now() / 1000 - time);
  if (seconds < 60) return "just now";
  if (seconds < 3600) return format.format(-Math.round(seconds / 60), "minute");
  if (seconds < 86_400) return format.format(-Math.round(seconds / 3600), "hour");
  return format.format(-Math.round(seconds / 86_400), "day");
}

new Page();

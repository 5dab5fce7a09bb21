// The photograph whose camera is looked through, and what the picture is compared with.

import type { Camera } from "./camera";
import type { Compare } from "./legend";
import type { Messages } from "./messages";
import type { Ask, SceneFacts } from "./protocol";
import type { Stage } from "./stage";
import type { State } from "./state";
import { mix } from "./vectors";

const COMPARES: Compare[] = ["off", "side", "wipe", "difference", "error"];

export interface PhotographEvents {
  ask(ask: Ask): void;
  /** The picture is another, and so are the controls. */
  changed(): void;
}

export class Photographs {
  scene: SceneFacts | null = null;
  /** The one that was looked at last. */
  private last = 0;

  constructor(
    private readonly stage: Stage,
    private readonly camera: Camera,
    private readonly state: State,
    private readonly messages: Messages,
    private readonly events: PhotographEvents,
  ) {}

  goTo(view: number | null): void {
    if (view === null || !this.scene) return this.leave();
    const { views, min, max } = this.scene;
    if (views.length === 0) return;
    const k = ((view % views.length) + views.length) % views.length;
    this.state.photo = this.last = k;
    this.camera.take(views[k]!.camera, mix(min, max, 0.5));
    this.stage.showPhotograph(null);
    this.events.ask({ ask: "photo", view: k });
    this.events.changed();
  }

  /** The next photograph; after a look elsewhere, the one that was left. */
  step(by: number): void {
    this.goTo(this.state.photo === null ? this.last : this.state.photo + by);
  }

  /** The camera is no longer that of a photograph, with which the picture can be compared no more. */
  leave(): void {
    const { photo, compare } = this.state;
    if (photo === null) return;
    this.state.photo = null;
    this.stage.showPhotograph(null);
    this.compare("off");
    if (compare === "off") return;
    const back = () => {
      this.goTo(photo);
      this.compare(compare);
    };
    const text = `The camera has left ${this.scene!.views[photo]!.name}, so that the comparison has ended.`;
    this.messages.say(text, { name: "Back to it", title: "The photograph and its comparison, as they were", go: back });
  }

  compare(how: Compare): void {
    if (how !== "off" && this.state.photo === null) {
      this.goTo(this.last);
      if (this.state.photo === null) return;
    }
    this.state.compare = how;
    this.stage.setCompare(how);
    this.events.changed();
  }

  compareNext(): void {
    this.compare(COMPARES[(COMPARES.indexOf(this.state.compare) + 1) % COMPARES.length]!);
  }
}

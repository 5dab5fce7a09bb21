// The connection to the program. It comes back by itself when the program does, unless that has said that it ends.

import type { Header } from "./protocol";

export interface Listener<Tell> {
  open(): void;
  /** There is no connection, and why. */
  closed(why: string): void;
  tell(tell: Tell): void;
  picture?(header: Header, jpeg: Blob): void;
}

/** Time between two attempts to connect [ms]. */
const AGAIN = 1000;
const SILENT =
  "No answer from the program: it has ended without a word, or the way to it is interrupted. Its terminal says more. " +
  "Trying again.";
const OTHER =
  "Another viewer answers at this address now. Open the address that it has printed in its terminal; this page " +
  "stays as it is.";
const BROKEN = "The program answers, but the connection does not stay open. Trying again.";

export class Link<Ask, Tell extends { tell: string }> {
  private socket: WebSocket | null = null;
  /** Why the program ends, once it has said so. */
  private ended: string | null = null;

  constructor(private readonly listener: Listener<Tell>) {
    this.connect();
  }

  send(ask: Ask): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(ask));
  }

  private connect(): void {
    const address = new URL("socket", location.href);
    address.protocol = "ws:";
    const socket = new WebSocket(address);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => this.listener.open();
    socket.onclose = () => void this.lost();
    socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
      if (typeof data === "string") this.take(JSON.parse(data) as Tell);
      else this.receive(data);
    };
    this.socket = socket;
  }

  /** Says why there is no connection, and tries again where that can help. */
  private async lost(): Promise<void> {
    const [why, isOver] = this.ended === null ? await this.ask() : [this.ended, true];
    this.listener.closed(why);
    if (!isOver) setTimeout(() => this.connect(), AGAIN);
  }

  /** Why a connection is refused, which a browser does not say of a WebSocket, and whether it stays so. */
  private async ask(): Promise<[string, boolean]> {
    try {
      const answer = await fetch("socket");
      if (answer.status === 404) return [OTHER, true];
      return [answer.status === 426 ? BROKEN : await answer.text(), false];
    } catch {
      return [SILENT, false];
    }
  }

  private take(tell: Tell): void {
    if (tell.tell === "ended" && "why" in tell) this.ended = String(tell.why);
    this.listener.tell(tell);
  }

  private receive(bytes: ArrayBuffer): void {
    const length = new DataView(bytes).getUint32(0, true);
    const text = new TextDecoder().decode(new Uint8Array(bytes, 4, length));
    const jpeg = new Blob([new Uint8Array(bytes, 4 + length)], { type: "image/jpeg" });
    this.listener.picture?.(JSON.parse(text) as Header, jpeg);
  }
}

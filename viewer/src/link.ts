// The connection to the program. It comes back by itself when the program does.

import type { Ask, Header, Tell } from "./protocol";

export interface Listener {
  open(): void;
  closed(): void;
  tell(tell: Tell): void;
  picture(header: Header, jpeg: Blob): void;
}

/** Time between two attempts to connect [ms]. */
const AGAIN = 1000;

export class Link {
  private socket: WebSocket | null = null;

  constructor(private readonly listener: Listener) {
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
    socket.onclose = () => {
      this.listener.closed();
      setTimeout(() => this.connect(), AGAIN);
    };
    socket.onmessage = ({ data }: MessageEvent<string | ArrayBuffer>) => {
      if (typeof data === "string") this.listener.tell(JSON.parse(data) as Tell);
      else this.receive(data);
    };
    this.socket = socket;
  }

  private receive(bytes: ArrayBuffer): void {
    const length = new DataView(bytes).getUint32(0, true);
    const text = new TextDecoder().decode(new Uint8Array(bytes, 4, length));
    const jpeg = new Blob([new Uint8Array(bytes, 4 + length)], { type: "image/jpeg" });
    this.listener.picture(JSON.parse(text) as Header, jpeg);
  }
}

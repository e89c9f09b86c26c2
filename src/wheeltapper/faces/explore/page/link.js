// The connection to the server: messages as JSON go there, frames with arrays come back; it is made again when it is lost.

const KINDS = { "<f8": Float64Array, "<f4": Float32Array, "|u1": Uint8Array };
const FIRST_PAUSE = 300, LONGEST_PAUSE = 4000;

export function decoded(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const begin = 4 + length;
  head.arrays = head.arrays.map(([kind, offset, size]) => new KINDS[kind](buffer, begin + offset, size));
  return head;
}

export class Link {
  // `hello` returns the first message; `on` has a function for each kind of frame, and `lost` and `found`.
  constructor(hello, on) {
    this.hello = hello;
    this.on = on;
    this.pause = FIRST_PAUSE;
    this.seq = 0;
    this.connect();
  }

  connect() {
    const address = new URL("link", document.baseURI);
    address.protocol = "ws:";
    this.socket = new WebSocket(address);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => {
      this.pause = FIRST_PAUSE;
      this.socket.send(JSON.stringify(this.hello()));
      this.on.found();
    };
    this.socket.onmessage = (event) => {
      const frame = decoded(event.data);
      this.on[frame.kind]?.(frame);
    };
    this.socket.onclose = () => {
      this.on.lost();
      setTimeout(() => this.connect(), this.pause);
      this.pause = Math.min(2 * this.pause, LONGEST_PAUSE);
    };
  }

  get open() { return this.socket.readyState === WebSocket.OPEN; }

  // Send a message; false where there is nobody to take it.
  send(message) {
    if (!this.open) return false;
    this.seq += 1;
    this.socket.send(JSON.stringify({ ...message, seq: this.seq }));
    return true;
  }
}

// What the page asks goes to Python as JSON, frames with arrays come back; a carrier brings both where they belong.

const KINDS = { "<f8": Float64Array, "<f4": Float32Array, "|u1": Uint8Array };

export function decoded(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const begin = 4 + length;
  head.arrays = head.arrays.map(([kind, offset, size]) => new KINDS[kind](buffer, begin + offset, size));
  return head;
}

export class Link {
  // `carrier` is what socket.js or comm.js has left.
  constructor(carrier) {
    this.carrier = carrier;
    this.seq = 0;
  }

  // From now on, `on` is told: it has a function for each kind of frame, and `found`, `lost`, `late` and `wrong` for what
  // happens to the connection.
  listen(on) {
    this.carrier.listen({
      ...on,
      frame(buffer) {
        const frame = decoded(buffer);
        on[frame.kind]?.(frame);
      },
    });
  }

  get open() { return this.carrier.open; }

  // Send a message; false where there is nobody to take it.
  send(message) {
    if (!this.open) return false;
    this.seq += 1;
    this.carrier.send({ ...message, seq: this.seq });
    return true;
  }
}

// Carries the page's messages over the channel of a notebook's widget. It runs in the frame that widget.js makes, which
// has left a pipe there: `send` takes a message and buffers to Python, and what comes back is given to `received`.

const PATIENCE = 1500;  // until the page says that nobody has heard it, ms

class Comm {
  constructor(pipe) {
    this.pipe = pipe;
    this.kept = { get: (where, name) => pipe.kept.get(name) ?? null, set: (where, name, value) => { pipe.kept.set(name, value); } };
    this.early = [];
    this.listener = { frame: (buffer) => this.early.push(buffer), late() {}, found() {} };
    this.asked = new Map();
    this.number = 0;
    pipe.received = (message, buffers) => this.received(message, buffers);
    this.send({ do: "hello", session: this.kept.get("tab", "session") ?? "" });
  }

  get theme() { return this.pipe.theme(); }

  get open() { return true; }

  received(message, [first]) {
    clearTimeout(this.waiting);
    if (this.isLate) {
      this.isLate = false;
      this.listener.late("");
    }
    // A copy: numbers of 8 bytes have to begin at multiples of 8, which a buffer on its way need not.
    const buffer = first && first.buffer.slice(first.byteOffset, first.byteOffset + first.byteLength);
    if (message.number !== undefined) {
      this.asked.get(message.number)?.([message, buffer]);
      this.asked.delete(message.number);
    } else if (buffer) this.listener.frame(buffer);
  }

  listen(listener) {
    this.listener = listener;
    listener.found();
    for (const buffer of this.early.splice(0)) listener.frame(buffer);
  }

  // What is sent waits where a cell keeps the kernel busy; it is heard afterwards.
  send(message, buffers = []) {
    this.pipe.send(message, buffers);
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => {
      this.isLate = true;
      this.listener.late("The kernel is busy, perhaps with a cell, or it has ended; what is changed here waits for it.");
    }, PATIENCE);
  }

  ask(message, buffers) {
    const number = this.number += 1;
    return new Promise((answered) => {
      this.asked.set(number, answered);
      this.send({ ...message, number }, buffers);
    });
  }

  offer(anchor, session, name) {
    anchor.href = "#";
    anchor.addEventListener("click", async (event) => {
      event.preventDefault();
      const [told, buffer] = await this.ask({ do: "export", name });
      if (told.wrong) { this.listener.wrong(told.wrong); return; }
      const address = URL.createObjectURL(new Blob([buffer], { type: told.type }));
      const once = document.createElement("a");
      Object.assign(once, { href: address, download: name });
      once.click();
      setTimeout(() => URL.revokeObjectURL(address), 60_000);
    });
  }

  async drop(session, file) {
    const [told] = await this.ask({ do: "drop", name: file.name }, [await file.arrayBuffer()]);
    return told;
  }
}

globalThis.carrier = new Comm(globalThis.pipe);

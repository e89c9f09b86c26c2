// Carries the page's messages over a websocket to the explorer's server; it is made again when it is lost. This runs
// before all other scripts, so that the server computes while they are loaded: what comes meanwhile is kept for them.

const FIRST_PAUSE = 300, LONGEST_PAUSE = 4000;

// What the page keeps: for this tab, or for the whole browser.
const kept = {
  store: (where) => (where === "tab" ? sessionStorage : localStorage),
  get(where, name) { try { return JSON.parse(this.store(where).getItem(name)); } catch { return null; } },
  set(where, name, value) { try { this.store(where).setItem(name, JSON.stringify(value)); } catch { /* full, or forbidden */ } },
};

class Socket {
  constructor() {
    this.kept = kept;
    this.pause = FIRST_PAUSE;
    this.early = [];
    this.listener = { found() {}, lost() {} };
    this.listener.frame = (buffer) => {
      this.early.push(buffer);
      performance.mark("early frame");
    };
    this.everFound = false;
    this.connect();
  }

  connect() {
    const address = new URL("link", document.baseURI);
    address.protocol = "ws:";
    this.socket = new WebSocket(address);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => {
      this.pause = FIRST_PAUSE;
      this.everFound = true;
      this.send({ session: kept.get("tab", "session") ?? "", scene: kept.get("tab", "scene"), last: kept.get("browser", "scene") });
      this.listener.found();
    };
    this.socket.onmessage = (event) => this.listener.frame(event.data);
    this.socket.onclose = () => {
      this.early.length = 0;
      this.listener.lost(this.silence);
      setTimeout(() => this.connect(), this.pause);
      this.pause = Math.min(2 * this.pause, LONGEST_PAUSE);
    };
  }

  listen(listener) {
    this.listener = listener;
    if (this.open) listener.found();
    else if (this.socket.readyState === WebSocket.CLOSED) listener.lost(this.silence);
    for (const buffer of this.early.splice(0)) listener.frame(buffer);
  }

  get open() { return this.socket.readyState === WebSocket.OPEN; }

  get silence() {
    return this.everFound
      ? "The connection to the explorer is lost; this page tries again. If it was ended, start it again: its new page brings this scene back."
      : "The explorer does not answer. Start it again with: wheeltapper explore";
  }

  send(message) { this.socket.send(JSON.stringify(message)); }

  // Let a link of the page bring one of the files that can be taken.
  offer(anchor, session, name) { anchor.href = `export/${session}/${name}`; }

  // Send a dropped file; return what is told of it.
  async drop(session, file) {
    const address = `drop?${new URLSearchParams({ session, name: file.name })}`;
    return (await fetch(address, { method: "POST", body: file })).json();
  }
}

globalThis.carrier = new Socket();

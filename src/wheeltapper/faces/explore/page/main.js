// The page: what Python sends goes to its parts, what is changed in them goes to Python, the newest first.

import { $, drawn, h, options } from "./dom.js";
import { listen } from "./drop.js";
import { Form } from "./form.js";
import { Link } from "./link.js";
import { FeatureMap } from "./map.js";
import { Motion } from "./motion.js";
import { Pins } from "./pins.js";
import { History, Phase, Spectrum } from "./plots.js";
import { Strips } from "./strips.js";

const { carrier } = globalThis, { kept } = carrier;  // socket.js or comm.js has left it there
const link = new Link(carrier);
let fitting = false;  // while the page itself sets the window of time
const state = { run: null, table: null, waiting: false, pending: new Map(), frame: null };

// -- the theme ----------------------------------------------------------------------------------------------------------

const wishes = matchMedia("(prefers-color-scheme: dark)");
function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  $("#theme").textContent = theme === "dark" ? "light" : "dark";
  $("#theme").setAttribute("aria-pressed", theme === "dark");
}
setTheme(kept.get("browser", "theme") ?? carrier.theme ?? (wishes.matches ? "dark" : "light"));

// -- parts --------------------------------------------------------------------------------------------------------------

const force = new History("force", { pins: true, marks: true });
const below = new History("below");
const phase = new Phase(), spectrum = new Spectrum();
const map = new FeatureMap((message) => link.send(message), (values) => edit({ do: "set several", values }, true));
const panels = [force, below, phase, spectrum];
const strips = new Strips(force);
const pins = new Pins(kept.get("tab", "pins"), (table) => edit({ do: "bring", scene: table }, true), () => {
  kept.set("tab", "pins", pins.kept);
  if (state.run) draw(state.run);
});
const motion = new Motion({
  canvas: $("#stage"), words: $("#motion-words"), scrub: $("#scrub"), clock: $("#clock"), play: $("#play"),
  slow: $("#slow"), exaggeration: $("#exaggeration"),
}, (time, index) => {
  force.point(time);
  below.point(time);
  if (!state.run || !motion.playing || index % 4 === 0) phase.point(index);
});

function retheme(theme) {
  setTheme(theme);
  for (const panel of [...panels, map]) panel.dress();
  if (state.run) draw(state.run);
}

function words(text, plain = false) {
  $("#words").textContent = text;
  $("#words").classList.toggle("plain", plain);
}

// What was told of a work that is done is told no longer.
const quiet = () => { if ($("#words").classList.contains("plain")) words(""); };

// -- edits --------------------------------------------------------------------------------------------------------------

// At most one edit is under way; of those that come meanwhile, the newest of each field follows.
function edit(message, settled = true) {
  state.pending.delete(`${message.do} ${message.path}`);
  state.pending.set(`${message.do} ${message.path}`, { ...message, settled });
  flush();
}

function flush() {
  if (state.waiting || !link.open) return;
  for (const [key, message] of state.pending) {
    state.pending.delete(key);
    state.waiting = link.send(message);
    if (state.waiting) { state.sent = performance.now(); return; }
  }
}

function answered() {
  state.waiting = false;
  flush();
}

const form = new Form($("#form"), $("#meaning"), edit);
const look = (what) => link.send({ do: "look", ...what });

// -- panels out of sight are made after the first picture, and drawn when they come into it, or when all is quiet: a page
// may be printed at any time -------------------------------------------------------------------------------------------

const inSight = new Set(), later = new Map(), made = new Map();
const QUIET = 600;  // ms
let tellLooked, rest = 0;
const looked = new Promise((done) => { tellLooked = done; });
const sight = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    const panel = panels.find((one) => one.root === target);
    if (!isIntersecting) { inSight.delete(panel); continue; }
    inSight.add(panel);
    make(panel);
  }
  tellLooked();
}, { rootMargin: "40px" });
for (const panel of panels) sight.observe(panel.root);

// Make a panel's figure, and draw what has been waiting for it if it is in sight.
async function make(panel) {
  if (!made.has(panel)) made.set(panel, panel.attach());
  await made.get(panel);
  if (inSight.has(panel)) later.get(panel)?.();
}

function paint(panel, show) {
  const work = () => {
    later.delete(panel);
    fitting = true;
    show();
    fitting = false;
  };
  if (panel.view && inSight.has(panel)) { work(); return; }
  later.set(panel, work);
  clearTimeout(rest);
  rest = setTimeout(() => { for (const [one, waiting] of [...later]) if (one.view) waiting(); }, QUIET);
}

// -- drawing a run ------------------------------------------------------------------------------------------------------

function draw(run) {
  const { arrays } = run;
  paint(force, () => {
    force.show(run.force, run.time, arrays, run.events, pins.list);
    strips.show(run.events, arrays);
  });
  paint(below, () => below.show(run.below, run.time, arrays, run.events, []));
  paint(phase, () => phase.show(run.phase, arrays));
  paint(spectrum, () => spectrum.show(run.spectrum, arrays, run.channels));
  options(below.select, run.channels.map(([key, name]) => [key, name]), run.below.key);
  motion.show(run, arrays);
  pins.show(run);
  $("#summary").textContent = run.summary;
  document.title = `wheeltapper: ${run.summary}`;
  const notes = $("#notes");
  if (notes.dataset.held !== run.notes.join("\n")) {
    notes.dataset.held = run.notes.join("\n");
    notes.replaceChildren(...run.notes.map((note) => h("li", { textContent: note })));
  }
}

// -- the time window: zooming asks for finer samples ----------------------------------------------------------------------

let asked = 0;
function zoomed(range) {
  if (fitting || !state.run) return;
  clearTimeout(asked);
  asked = setTimeout(() => {
    const first = Math.max(0, range.start), last = Math.min(state.run.end, range.end);
    state.zoom = first > 1e-6 * state.run.end || last < state.run.end * (1 - 1e-6);
    look(state.zoom && last > first ? { first, last } : { first: null, last: null });
  }, 120);
}
for (const { x_range } of [force.figure, below.figure].map((figure) => figure)) {
  for (const name of ["start", "end"]) x_range.properties[name].change.connect(() => zoomed(x_range));
}

// -- the connection -----------------------------------------------------------------------------------------------------

const told = {
  found() { words(""); state.waiting = false; },
  lost(line) {
    state.waiting = false;
    words(line);
  },
  late: (line) => words(line, true),
  wrong: (line) => words(line),
  hello(frame) {
    kept.set("tab", "session", frame.session);
    if (frame.line) words(frame.line);
    map.offer(frame.features);
    $("#exports").replaceChildren(...frame.exports.map(([name, text]) => {
      const anchor = h("a", { className: "button", download: name, textContent: text });
      carrier.offer(anchor, frame.session, name);
      return anchor;
    }));
    flush();
  },
  scene(frame) {
    state.table = frame.table;
    kept.set("tab", "scene", frame.table);
    kept.set("browser", "scene", frame.table);
    form.show(frame.form);
    $("#toml").textContent = frame.toml;
    $("#python").textContent = frame.python;
    $("#back").disabled = !frame.back;
    $("#forth").disabled = !frame.forth;
    map.scene(frame);
    if (state.run) pins.show(state.run);
    if (frame.seq !== undefined) answered();
  },
  async run(frame) {
    const begin = performance.now(), isFirst = state.run === null;
    state.run = frame;
    if (frame.seq !== state.refused) {  // else the line says why the run is still the one before
      form.clear();
      words("");
    }
    draw(frame);
    await drawn();
    if (performance.getEntriesByName("slider").length) {
      performance.measure("slider to picture", "slider");
      performance.measure("slider to frame", { start: "slider", end: begin });
      performance.measure("drawing", { start: begin, end: performance.now() });
      performance.clearMarks("slider");
    }
    if (isFirst) {
      performance.mark("first picture");
      panels.forEach(make);
    }
    document.documentElement.dataset.drawn = frame.seq;
    answered();
  },
  surface(frame) { motion.setSurface(frame, frame.arrays); },
  refused(frame) {
    state.refused = frame.seq;
    const left = form.refuse(frame.lines);
    if (left.length) words(left.join(" — "));
    if (frame.run === false || frame.final) answered();
  },
  words(frame) { if (frame.line) words(frame.line, true); else quiet(); },
  map(frame) { quiet(); map.begin(frame); },
  "map tile": (frame) => map.tile(frame),
  "map arrows"(frame) { quiet(); map.arrows(frame); },
  "map refused"(frame) { quiet(); map.refused(frame); },
};

// -- buttons and keys -----------------------------------------------------------------------------------------------------

for (const panel of [below, phase, spectrum]) {
  panel.select.addEventListener("change", () => look({ [panel.root.id]: panel.select.value }));
}
$("#back").addEventListener("click", () => link.send({ do: "back" }));
$("#forth").addEventListener("click", () => link.send({ do: "forth" }));
$("#theme").addEventListener("click", () => {
  const theme = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
  kept.set("browser", "theme", theme);
  retheme(theme);
});
carrier.themed = (theme) => { if (kept.get("browser", "theme") === null) retheme(theme ?? (wishes.matches ? "dark" : "light")); };
wishes.addEventListener("change", () => carrier.themed(carrier.theme));
$("#pin").addEventListener("click", () => words(pins.add(state.run)));
listen((file) => carrier.drop(kept.get("tab", "session"), file), () => link.send({ do: "show" }));
$("#help").addEventListener("click", () => $("#keys").showModal());
for (const button of document.querySelectorAll("[data-copy]")) {
  button.addEventListener("click", async () => {
    const text = $(`#${button.dataset.copy}`).textContent;
    try { await navigator.clipboard.writeText(text); } catch {
      getSelection().selectAllChildren($(`#${button.dataset.copy}`));
      document.execCommand("copy");
    }
    button.textContent = "copied";
    setTimeout(() => { button.textContent = "copy"; }, 1200);
  });
}
document.addEventListener("keydown", (event) => {
  const typing = event.target.closest("input:not([type=range]):not([type=checkbox]), select, textarea");
  if (event.ctrlKey && event.key.toLowerCase() === "z" && !typing) {
    event.preventDefault();
    $(event.shiftKey ? "#forth" : "#back").click();
    return;
  }
  if (typing || event.ctrlKey || event.metaKey || event.altKey || $("#keys").open) return;
  const act = {
    " ": () => !event.target.closest("button, summary, input") && motion.toggle(), ",": () => motion.step(-0.002), ".": () => motion.step(0.002),
    p: () => $("#pin").click(), l: () => $("#theme").click(), "?": () => $("#help").click(),
    m: () => { $("#map-part").open = !$("#map-part").open; },
  }[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (act && act() !== false) event.preventDefault();
});

// What has come meanwhile is drawn as soon as there is something to draw it on.
await looked;
await Promise.all([...inSight].map(make));
performance.mark("panels");
link.listen(told);

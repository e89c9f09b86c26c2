// Pinned runs: up to four, drawn over the present one and compared with it in a table.

import { $, digits, h } from "./dom.js";
import { MOST_PINS } from "./plots.js";

export class Pins {
  // `bring(table)` makes a pinned scene the present one; `changed` is called when pins come or go.
  constructor(held, bring, changed) {
    Object.assign(this, { list: held ?? [], bring, changed });
    for (const pin of this.list) { pin.time = Float64Array.from(pin.time); pin.force = Float64Array.from(pin.force); }
    this.root = $("#pins");
  }

  // Of several contacts the force of the first one is kept.
  add(run) {
    if (!run?.table) return "This scene holds a Python function: it cannot be pinned.";
    if (this.list.length >= MOST_PINS) return `There are ${MOST_PINS} pins; remove one first.`;
    const [line] = run.force.lines;
    this.list.push({
      table: run.table, numbers: run.numbers, time: run.arrays[run.time],
      force: run.arrays[line.values].map((value) => value / run.force.factor),
    });
    this.changed();
    return "";
  }

  remove(number) {
    this.list.splice(number, 1);
    this.changed();
  }

  // As the browser keeps them over a reload.
  get kept() {
    return this.list.map((pin) => ({ ...pin, time: Array.from(pin.time, (value) => Number(value.toPrecision(8))), force: Array.from(pin.force, (value) => Number(value.toPrecision(6))) }));
  }

  show(run) {
    this.root.hidden = !this.list.length;
    if (!this.list.length || !run) return;
    const names = Object.keys(run.numbers);
    const head = h("tr", {}, h("th", { textContent: "" }), ...names.map((name) => h("th", { textContent: name })), h("th", { textContent: "differs in (pinned; now)" }), h("th"));
    const row = (name, numbers, differs, buttons) => h("tr", {}, h("td", { textContent: name }),
      ...names.map((one) => h("td", { textContent: digits(numbers[one], 5) })), h("td", { className: "changed", textContent: differs }), h("td", {}, ...buttons));
    $("table", this.root).replaceChildren(head, row("now", run.numbers, "", []), ...this.list.map((pin, i) => row(`pin ${i + 1}`, pin.numbers, differences(pin.table, run.table), [
      h("button", { className: "small", textContent: "load", "aria-label": `load pin ${i + 1}`, onclick: () => this.bring(pin.table) }), " ",
      h("button", { className: "small", textContent: "remove", "aria-label": `remove pin ${i + 1}`, onclick: () => this.remove(i) }),
    ])));
  }
}

// The fields in which two scenes differ, with both values.
function differences(a, b) {
  const left = flat(a), right = flat(b), found = [];
  for (const path of new Set([...left.keys(), ...right.keys()])) {
    if (left.get(path) !== right.get(path)) found.push(`${path}: ${show(left.get(path))}; ${show(right.get(path))}`);
  }
  return found.length > 6 ? `${found.slice(0, 6).join(", ")} and ${found.length - 6} more` : found.join(", ") || "nothing";
}

const show = (value) => (value === undefined ? "none" : typeof value === "number" ? digits(value, 5) : String(value));

function flat(value, path = "", into = new Map()) {
  if (value !== null && typeof value === "object") {
    for (const [name, held] of Object.entries(value)) flat(held, path ? `${path}.${name}` : name, into);
  } else if (value !== null) into.set(path, value);
  return into;
}

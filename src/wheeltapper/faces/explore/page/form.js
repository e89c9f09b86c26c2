// The form: one row for each field of the scene, as the server describes it.

import { $, digits, h, unitText } from "./dom.js";

const STEPS = 1000;
const OPEN = new Set(["", "vehicle", "track", "contact", "irregularity", "irregularity.0"]);

export class Form {
  // `edit(message, settled)` sends a change; `start` is called where a slider begins to move.
  constructor(root, meaning, edit) {
    Object.assign(this, { root, meaning, edit });
    this.rows = new Map();
    this.opened = new Map();
    this.structure = "";
    root.addEventListener("submit", (event) => event.preventDefault());
    root.addEventListener("focusin", (event) => this.explain(event.target.closest("[data-path]")));
  }

  show(form) {
    const structure = signature(form);
    if (structure === this.structure) this.refresh(form);
    else this.rebuild(form, structure);
  }

  rebuild(form, structure) {
    const focused = document.activeElement?.closest?.("[data-path]")?.dataset.path;
    const scroll = this.root.parentElement.scrollTop;
    this.structure = structure;
    this.rows.clear();
    const plain = form.fields.filter((entry) => !["noun", "list"].includes(entry.kind));
    const parts = form.fields.filter((entry) => ["noun", "list"].includes(entry.kind));
    this.root.replaceChildren(
      h("fieldset", {}, h("legend", { textContent: "run" }), ...plain.map((entry) => this.row(entry))),
      ...parts.map((entry) => this.part(entry)));
    this.root.parentElement.scrollTop = scroll;
    if (focused) $(`[data-path="${CSS.escape(focused)}"] input, [data-path="${CSS.escape(focused)}"] select`, this.root)?.focus();
  }

  refresh(form) {
    for (const entry of leaves(form)) this.rows.get(entry.path)?.update(entry);
  }

  // -- parts: a noun or a list of nouns -------------------------------------------------------------------------------

  part(entry) {
    const open = this.opened.get(entry.path) ?? OPEN.has(entry.path);
    const details = h("details", { open, className: "part" });
    details.dataset.path = entry.path;
    details.addEventListener("toggle", () => {
      this.opened.set(entry.path, details.open);
      if (details.open && body.childElementCount === 0) body.append(...this.inside(entry));
    });
    const body = h("div", { className: "inside" });
    details.append(this.heading(entry), body);
    details.dataset.meaning = entry.description ?? "";
    if (open) body.append(...this.inside(entry));
    return details;
  }

  heading(entry) {
    const heading = h("summary", {}, h("span", { textContent: entry.name }));
    if (entry.kind === "noun" && (entry.types.length > 1 || entry.optional)) {
      const select = h("select", {
        "aria-label": `kind of ${entry.name}`,
        onchange: () => this.edit({ do: "set", path: entry.path, value: select.value ? { type: select.value } : null }, true),
        onclick: (event) => event.stopPropagation(),
      });
      const types = entry.types.includes(entry.type) || entry.type === null ? entry.types : [...entry.types, entry.type];
      if (entry.optional) select.append(h("option", { value: "", text: "none" }));
      select.append(...types.map((type) => h("option", { value: type, text: type })));
      select.value = entry.type ?? "";
      heading.append(select);
    } else if (entry.kind === "noun" && entry.type && entry.type !== entry.name) heading.append(h("em", { textContent: entry.type }));
    if (/\.\d+$/.test(entry.path) && entry.kind === "noun") {
      heading.append(h("button", {
        type: "button", className: "small", textContent: "remove", "aria-label": `remove ${entry.name}`,
        onclick: (event) => { event.preventDefault(); this.edit({ do: "remove", path: entry.path }, true); },
      }));
    }
    return heading;
  }

  inside(entry) {
    const wrong = h("p", { className: "wrong", role: "alert" });
    this.rows.set(entry.path, { update() {}, wrong, node: wrong });
    if (entry.kind === "noun") {
      const unset = entry.fields.filter(isUnset), set = entry.fields.filter((held) => !isUnset(held));
      return [wrong, ...set.map((held) => this.entry(held)), ...(unset.length ? [this.unset(entry, unset)] : [])];
    }
    const items = entry.items.map((item) => this.part(item));
    if (!entry.types.length) return [wrong, ...items];
    const select = h("select", { "aria-label": `add to ${entry.name}` }, ...entry.types.map((type) => h("option", { value: type, text: type })));
    const add = h("button", {
      type: "button", className: "small", textContent: "add",
      onclick: () => this.edit({ do: "add", path: entry.path, type: select.value }, true),
    });
    return [wrong, ...items, h("p", { className: "adding" }, select, add)];
  }

  // Fields that are not set, which would be in the way of those that are.
  unset(entry, fields) {
    const path = `${entry.path}/unset`;
    const details = h("details", { className: "more", open: this.opened.get(path) ?? false },
      h("summary", { textContent: `${fields.length} not set: ${fields.map((held) => held.name).join(", ")}` }),
      ...fields.map((held) => this.row(held)));
    details.addEventListener("toggle", () => this.opened.set(path, details.open));
    return details;
  }

  entry(entry) {
    return ["noun", "list"].includes(entry.kind) ? this.part(entry) : this.row(entry);
  }

  // -- rows: one field ------------------------------------------------------------------------------------------------

  row(entry) {
    if (entry.kind === "numbers") {
      return h("fieldset", { className: "numbers" }, h("legend", { textContent: entry.name }),
        ...entry.items.map((item) => this.row({ ...item, kind: "quantity", description: entry.description })));
    }
    const id = `field-${entry.path}`;
    const wrong = h("p", { className: "wrong", role: "alert", id: `${id}-wrong` });
    const node = h("div", { className: "row" }, h("label", { htmlFor: id, textContent: entry.name, title: entry.description ?? "" }));
    node.dataset.path = entry.path;
    node.dataset.meaning = entry.description ?? "";
    const made = this[entry.kind](entry, id, node);
    node.append(wrong);
    made.wrong = wrong;
    made.node = node;
    this.rows.set(entry.path, made);
    made.update(entry);
    return node;
  }

  quantity(entry, id, node) {
    const text = h("input", { id, type: "text", inputMode: "decimal", className: "number", placeholder: "not set", "aria-describedby": `${id}-wrong` });
    const unit = h("span", { className: "unit", textContent: unitText(entry.unit) });
    const slider = h("input", { type: "range", min: 0, max: STEPS, step: 1, "aria-label": `${entry.name}, slider` });
    node.append(text, unit, slider);
    let range = entry;
    const send = (value, settled) => this.edit({ do: "set", path: entry.path, value }, settled);
    const place = (value) => {
      const share = range.log ? Math.log(value / range.low) / Math.log(range.high / range.low) : (value - range.low) / (range.high - range.low);
      return Math.round(STEPS * Math.min(1, Math.max(0, share)));
    };
    const value = () => {
      const share = slider.valueAsNumber / STEPS;
      const exact = range.log ? range.low * (range.high / range.low) ** share : range.low + share * (range.high - range.low);
      return Number(exact.toPrecision(4));
    };
    const label = (held) => {
      text.value = held === null ? "" : digits(held / range.factor, 6);
      slider.setAttribute("aria-valuetext", `${text.value} ${range.unit}`);
    };
    slider.addEventListener("input", () => { performance.mark("slider"); label(value()); send(value(), false); });
    slider.addEventListener("change", () => send(value(), true));
    let typing = false;
    const take = () => {
      if (typing) send(typed(text.value, range.unit, entry.optional), true);
      typing = false;
    };
    text.addEventListener("input", () => { typing = true; });
    text.addEventListener("change", take);
    text.addEventListener("keydown", (event) => {
      if (event.key === "Enter") take();
      if (event.key === "Escape") { typing = false; label(range.value); }
    });
    return {
      update(fresh) {
        slider.hidden = fresh.value === null;
        const outside = fresh.value !== null && (range.low === undefined || fresh.value < range.low || fresh.value > range.high);
        const at = slider.valueAsNumber / STEPS;
        const edge = !fresh.between && document.activeElement !== slider && (at < 0.02 || at > 0.98) && fresh.low !== 0;
        const keeps = fresh.low !== undefined && range.low !== undefined && range.unit === fresh.unit && !outside && !edge;
        range = keeps ? { ...fresh, low: range.low, high: range.high, log: range.log } : fresh;
        unit.textContent = unitText(range.unit);
        if (!typing && !node.classList.contains("refused")) label(fresh.value);
        if (fresh.value !== null && document.activeElement !== slider) slider.value = place(fresh.value);
      },
    };
  }

  count(entry, id, node) {
    const input = h("input", {
      id, type: "number", step: 1, className: "number",
      onchange: () => this.edit({ do: "set", path: entry.path, value: input.value === "" ? null : Number(input.value) }, true),
    });
    if (entry.low !== null) input.min = entry.low;
    node.append(input);
    return { update: (fresh) => { input.value = fresh.value ?? ""; } };
  }

  switch(entry, id, node) {
    const input = h("input", { id, type: "checkbox", onchange: () => this.edit({ do: "set", path: entry.path, value: input.checked }, true) });
    node.append(input);
    return { update: (fresh) => { input.checked = fresh.value; } };
  }

  choice(entry, id, node) {
    const select = h("select", { id, onchange: () => this.edit({ do: "set", path: entry.path, value: select.value || null }, true) });
    if (entry.optional) select.append(h("option", { value: "", text: "none" }));
    select.append(...entry.options.map((word) => h("option", { value: word, text: word })));
    node.append(select);
    return { update: (fresh) => { select.value = fresh.value ?? ""; } };
  }

  text(entry, id, node) {
    const input = h("input", { id, type: "text", onchange: () => this.edit({ do: "set", path: entry.path, value: input.value === "" && entry.optional ? null : input.value }, true) });
    node.append(input);
    return { update: (fresh) => { input.value = fresh.value ?? ""; } };
  }

  fixed(entry, id, node) {
    const output = h("output", { id, className: "fixed" });
    node.append(output);
    return { update: (fresh) => { output.textContent = fresh.value === "()" || fresh.value === "None" ? "none" : fresh.value; } };
  }

  // -- errors and meanings --------------------------------------------------------------------------------------------

  // Show each line beside the field that it names; return those that name none.
  refuse(lines) {
    this.clear();
    return lines.filter(([path, line]) => {
      let at = path;
      while (at && !this.rows.has(at)) at = at.includes(".") ? at.slice(0, at.lastIndexOf(".")) : "";
      const row = this.rows.get(at);
      if (!row) return true;
      row.wrong.textContent = line;
      row.node.classList.add("refused");
      return !row.node.checkVisibility();
    }).map(([, line]) => line);
  }

  clear() {
    for (const row of this.rows.values()) {
      if (row.wrong.textContent) row.wrong.textContent = "";
      row.node.classList.remove("refused");
    }
  }

  explain(row) {
    this.meaning.textContent = row?.dataset.meaning ? `${row.dataset.path}: ${row.dataset.meaning}` : "";
  }
}

const isUnset = (entry) => entry.optional && entry.value === null && !["noun", "list", "numbers"].includes(entry.kind);

// What is typed: a number is in the unit beside it, a text with a unit is read by the server.
function typed(text, unit, optional) {
  const plain = text.trim();
  if (plain === "" && optional) return null;
  return unit && /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(plain) ? `${plain} ${unit}` : /^[+-]?[\d.]+(e[+-]?\d+)?$/i.test(plain) ? Number(plain) : plain;
}

export function* leaves(entry) {
  yield entry;
  for (const held of entry.fields ?? []) yield* leaves(held);
  for (const held of entry.items ?? []) yield* leaves(held);
}

function signature(form) {
  return JSON.stringify([...leaves(form)].map((entry) => [entry.path, entry.kind, entry.type, entry.optional, entry.value === null]));
}

// Curves, drawn by BokehJS on canvases: panels with their titles and keys in HTML above them, where no data is.

import { $, digits, h, options, unitText } from "./dom.js";

const LIGHT = ["#0072b2", "#d55e00", "#009e73", "#aa4499", "#56b4e9", "#8c6d1f", "#000000", "#882255"];
const DARK = ["#56b4e9", "#e69f00", "#2fc79a", "#e59ac2", "#f0e442", "#ff7f4d", "#ffffff", "#9aa8ff"];
const DASHES = [[], [7, 4], [2, 3], [9, 3, 2, 3], [12, 4], [4, 2], [1, 2], [6, 2, 2, 2]];
export const MOST_LINES = 8, MOST_PINS = 4;
const TOOLS = "xpan,xwheel_zoom,xbox_zoom,reset";

const looks = {};  // by theme: to ask the style sheet takes as long as to draw a panel
export const look = () => looks[document.documentElement.dataset.theme] ??= asked();

function asked() {
  const dark = document.documentElement.dataset.theme === "dark";
  const css = getComputedStyle(document.documentElement);
  const held = (name) => css.getPropertyValue(name).trim();
  return { colours: dark ? DARK : LIGHT, ink: held("--ink"), soft: held("--soft"), paper: held("--panel"), rule: held("--rule"), shade: held("--shade"), pins: held("--pin") };
}

// Whenever it paints, Bokeh asks the page's style sheets for every property of every mark, which takes a third of a new
// picture's time. Here models hold them all. A version that keeps this elsewhere asks as before.
try { Bokeh.require("core/visuals/visual").VisualProperties.prototype._get_css_value = () => ""; } catch { /* as before */ }

const empty = () => ({ x: new Float64Array(0), y: new Float64Array(0) });
const source = (data = empty()) => new Bokeh.ColumnDataSource({ data });

export class Panel {
  constructor(id, given = {}) {
    this.root = document.getElementById(id);
    this.title = $("h2", this.root);
    this.key = $(".key", this.root);
    this.select = $("select", this.root);
    this.plot = $(".plot", this.root);
    const { log, tools = TOOLS, height = 210 } = given;
    const range = () => new Bokeh.Range1d({ start: 0.1, end: 1 });
    this.figure = Bokeh.Plotting.figure({
      name: id, height, sizing_mode: "stretch_width", tools, toolbar_location: "right", min_border: 2, lod_threshold: null,
      x_axis_label: " ", y_axis_label: " ",
      // The page's ground shows through: what Bokeh paints itself ends within pixels, which keep some of another theme.
      background_fill_color: null, border_fill_color: null,
      x_range: range(), y_range: range(), ...(log ? { x_axis_type: "log", y_axis_type: "log" } : {}),
    });
    this.figure.toolbar.logo = null;
    this.figure.toolbar.autohide = true;
    this.lines = [];
  }

  async attach() {
    this.view = await Bokeh.Plotting.show(this.figure, this.plot);
    this.dress();
  }

  line(width = 1.4) {
    const held = source();
    const glyph = this.figure.line({ field: "x" }, { field: "y" }, { source: held, line_width: width });
    return { source: held, glyph: glyph.glyph };
  }

  label(x, y) {
    const [bottom] = this.figure.xaxis, [left] = this.figure.yaxis;
    if (bottom.axis_label !== x) bottom.axis_label = x;
    if (left.axis_label !== y) left.axis_label = y;
  }

  // Show all of some data: [lowest, highest] of each axis; what the reset tool brings back.
  fit(x, y) {
    for (const [range, [start, end]] of [[this.figure.x_range, x], [this.figure.y_range, y]]) {
      if (range.start !== start || range.end !== end || range.reset_end !== end) range.setv({ start, end, reset_start: start, reset_end: end });
    }
  }

  name(text) { if (this.title.textContent !== text) this.title.textContent = text; }

  // Colours of the page's theme.
  dress() {
    const { ink, soft, rule } = look(), { figure } = this;
    figure.outline_line_color = rule;
    for (const axis of [...figure.xaxis, ...figure.yaxis]) {
      axis.setv({
        axis_line_color: soft, major_tick_line_color: soft, minor_tick_line_color: null, major_label_text_color: ink,
        axis_label_text_color: ink, axis_label_text_font_style: "normal", axis_label_text_font_size: "12px", major_label_text_font_size: "11px", axis_label_standoff: 3,
      });
    }
    for (const grid of [...figure.xgrid, ...figure.ygrid]) grid.setv({ grid_line_color: rule, grid_line_alpha: 0.7 });
  }

  // Where a time stands in the panel, in pixels from its left edge; null outside.
  pixel(x) {
    const { x_range } = this.figure, box = this.view?.frame?.bbox;
    if (!box) return null;
    const share = (x - x_range.start) / (x_range.end - x_range.start);
    return share < 0 || share > 1 ? null : { left: box.left + share * box.width, top: box.top, height: box.height };
  }
}

// A swatch of the key: a line, a shaded strip or a mark.
export function swatch(label, colour, kind = "line", dash = []) {
  const drawing = {
    line: `<line x1="1" y1="7" x2="25" y2="7" stroke="${colour}" stroke-width="2.5" stroke-dasharray="${dash.join(" ")}"/>`,
    strip: `<rect x="4" y="1" width="18" height="12" fill="${colour}"/>`,
    mark: `<path d="M13 2 L19 12 L7 12 Z" fill="${colour}"/>`,
    dot: `<circle cx="13" cy="7" r="4" fill="${colour}"/>`,
    arrow: `<path d="M3 7 H21 M16 3 L22 7 L16 11" fill="none" stroke="${colour}" stroke-width="2"/>`,
  }[kind];
  const item = h("li");
  item.innerHTML = `<svg width="26" height="14" aria-hidden="true">${drawing}</svg>`;
  item.append(label);
  return item;
}

// Smallest and largest of several lists of numbers, and of one more.
export function extremes(lists, more = NaN) {
  let low = Number.isNaN(more) ? Infinity : more, high = Number.isNaN(more) ? -Infinity : more;
  for (const list of lists) {
    for (const value of list) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return low <= high ? [low, high] : [0, 1];
}

export function roomy([low, high]) {
  const room = 0.06 * (high - low) || 0.05 * Math.abs(high) || 1;
  return [low - room, high + room];
}

function setKey(list, items) {
  const text = JSON.stringify(items);
  if (list.dataset.held === text) return;
  list.dataset.held = text;
  list.replaceChildren(...items.map((item) => swatch(...item)));
}

export class History extends Panel {
  constructor(id, given = {}) {
    super(id);
    const { figure } = this;
    this.shades = source({ x0: [], x1: [] });
    this.shade = figure.vstrip({ field: "x0" }, { field: "x1" }, { source: this.shades, line_color: null });
    this.pinned = given.pins ? Array.from({ length: MOST_PINS }, () => this.line(1.3)) : [];
    this.drawn = Array.from({ length: MOST_LINES + 1 }, () => this.line(1.5));
    this.level = given.pins ? this.line(1) : null;
    if (given.marks) {
      this.hits = source();
      this.mark = figure.scatter({ field: "x" }, { field: "y" }, { source: this.hits, marker: "triangle", size: 8, line_color: null });
    }
    this.cursor = this.plot.appendChild(h("div", { className: "cursor", hidden: true }));
  }

  // With one contact its losses are shaded and its impacts marked here; several have strips of their own (strips.js).
  show(panel, time, arrays, marks, pins) {
    const { colours, shade, soft, ink } = look();
    const times = arrays[time];
    const several = panel.lines.length > 1;
    const key = [];
    this.drawn.forEach((line, i) => {
      const given = panel.lines[i];
      if (!given) { if (line.source.data.x.length) line.source.data = empty(); return; }
      line.source.data = { x: times, y: arrays[given.values] };
      const dash = DASHES[i % DASHES.length];
      line.glyph.setv({ line_color: colours[i % colours.length], line_dash: dash });
      if (several || this.hits) key.push([given.label, colours[i % colours.length], "line", dash]);
    });
    const wheel = marks.length === 1 ? marks[0] : null;
    this.shade.glyph.setv({ fill_color: shade, fill_alpha: 1 });
    this.shades.data = wheel ? { x0: arrays[wheel.from], x1: arrays[wheel.to] } : { x0: [], x1: [] };
    const first = several ? ` (${panel.lines[0].label})` : "";
    if (this.level) {
      const [level] = panel.static, ends = [times[0], times[times.length - 1]];
      this.level.source.data = { x: ends, y: [level, level] };
      this.level.glyph.setv({ line_color: soft, line_dash: [3, 3] });
      const alike = panel.static.every((one) => Math.abs(one - level) < 0.005 * level);
      key.push([`static${alike ? "" : first}`, soft, "line", [3, 3]]);
      this.pinned.forEach((line, i) => {
        const pin = pins[i];
        if (!pin) { if (line.source.data.x.length) line.source.data = empty(); return; }
        line.source.data = { x: pin.time, y: pin.force.map((value) => value * panel.factor) };
        line.glyph.setv({ line_color: colours[(i + 1) % colours.length], line_dash: DASHES[i + 1] });
        key.push([`pin ${i + 1}${first}`, colours[(i + 1) % colours.length], "line", DASHES[i + 1]]);
      });
    }
    if (wheel && arrays[wheel.from].length) key.push(["no contact", shade, "strip"]);
    if (this.hits) {
      const hits = wheel ? arrays[wheel.impacts].filter((x) => x >= times[0] && x <= times[times.length - 1]) : [];
      this.hits.data = { x: hits, y: new Float64Array(hits.length) };
      this.mark.glyph.setv({ fill_color: colours[1] });
      if (hits.length) key.push(["impact", colours[1], "mark"]);
    }
    if (this.hits && marks.length > 1) key.push(["no contact (strips below)", soft, "strip"], ["impact", ink, "mark"]);
    const shown = [...panel.lines.map((line) => arrays[line.values]), ...this.pinned.map((line) => line.source.data.y)];
    const window = [times[0], times[times.length - 1]];
    this.fit(window, roomy(extremes(shown, this.hits ? 0 : undefined)));
    this.name(panel.title);
    this.label("time [s]", `${panel.axis ?? "force"} [${unitText(panel.unit)}]`);
    setKey(this.key, key);
  }

  // The time that the motion shows.
  point(time) {
    const at = this.pixel(time);
    this.cursor.hidden = at === null;
    if (at) Object.assign(this.cursor.style, { left: `${at.left}px`, top: `${at.top}px`, height: `${at.height}px` });
  }
}

export class Phase extends Panel {
  constructor() {
    super("phase", { tools: "pan,wheel_zoom,box_zoom,reset", height: 250 });
    this.whole = this.line(1);
    this.last = this.line(1.6);
    this.now = source();
    this.dot = this.figure.scatter({ field: "x" }, { field: "y" }, { source: this.now, size: 8, line_color: null });
  }

  show(panel, arrays) {
    const { colours, soft } = look();
    this.name(panel.title);
    options(this.select, panel.choices, panel.key);
    if (panel.x === undefined) return;
    const x = arrays[panel.x], y = arrays[panel.y], from = Math.floor(0.7 * x.length);
    this.whole.source.data = { x, y };
    this.last.source.data = { x: x.subarray(from), y: y.subarray(from) };
    this.whole.glyph.setv({ line_color: colours[0], line_alpha: 0.55 });
    this.last.glyph.setv({ line_color: colours[1] });
    this.dot.glyph.setv({ fill_color: look().ink });
    this.fit(roomy(extremes([x])), roomy(extremes([y])));
    this.label(panel.x_label.replace("^2", "²"), panel.y_label.replace("^2", "²"));
    this.arrays = { x, y };
    setKey(this.key, [["whole run", colours[0], "line"], ["its last third", colours[1], "line"]]);
  }

  point(index) {
    if (this.arrays && index < this.arrays.x.length) this.now.data = { x: [this.arrays.x[index]], y: [this.arrays.y[index]] };
  }
}

export class Spectrum extends Panel {
  constructor() {
    super("spectrum", { log: true, tools: "pan,wheel_zoom,box_zoom,reset", height: 250 });
    this.curve = this.line(1.3);
  }

  show(panel, arrays, channels) {
    const { colours } = look();
    const x = arrays[panel.x], y = arrays[panel.y].map((value) => value > 0 ? value : NaN);
    this.curve.source.data = { x, y };
    const [, top] = extremes([y]);
    if (top > 0) this.fit([x[0], x[x.length - 1]], [1e-5 * top, 2 * top]);
    this.curve.glyph.setv({ line_color: colours[0] });
    this.name(panel.title);
    options(this.select, channels.map(([key, name]) => [key, name]), panel.key);
    this.label("frequency [Hz]", `amplitude [${unitText(panel.unit)}]`);
  }
}

export { digits, setKey, source };

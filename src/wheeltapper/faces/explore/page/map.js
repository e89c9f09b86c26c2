// The map of a feature over two fields: an image filled tile by tile, arrows of the gradient, a click that loads a cell.

import { $, digits, options, unitText } from "./dom.js";
import { leaves } from "./form.js";
import { Panel, extremes, look, setKey, source } from "./plots.js";

const WAIT = 250;
const SHOWN = { N: [1e-3, "kN"], s: [1e3, "ms"], m: [1e3, "mm"] };

export class FeatureMap extends Panel {
  constructor(ask, load) {
    super("map", { tools: "", height: 430 });
    Object.assign(this, { ask, load, number: 0, fields: new Map(), features: [], cell: null });
    this.part = $("#map-part");
    this.words = $("#map-words");
    const { figure } = this;
    this.colours = new Bokeh.LinearColorMapper({ palette: Bokeh.Palettes.viridis(256), low: 0, high: 1, nan_color: "rgba(0,0,0,0)" });
    this.images = source({ image: [], x: [], y: [], dw: [], dh: [] });
    figure.image(this.colours, { field: "image" }, { field: "x" }, { field: "y" }, { field: "dw" }, { field: "dh" }, { source: this.images });
    this.shafts = source({ x0: [], y0: [], x1: [], y1: [] });
    this.heads = source({ x: [], y: [], angle: [] });
    this.shaft = figure.segment({ field: "x0" }, { field: "y0" }, { field: "x1" }, { field: "y1" }, { source: this.shafts, line_width: 1.3 });
    this.head = figure.scatter({ field: "x" }, { field: "y" }, { source: this.heads, marker: "triangle", size: 6, angle: { field: "angle" }, line_color: null });
    this.here = source();
    this.marks = figure.scatter({ field: "x" }, { field: "y" }, { source: this.here, marker: "circle_cross", size: 13, line_width: 2, fill_color: null });
    this.chosen = source();
    this.box = figure.scatter({ field: "x" }, { field: "y" }, { source: this.chosen, marker: "square", size: 10, line_width: 2, fill_color: null });
    this.bar = new Bokeh.ColorBar({ color_mapper: this.colours, width: 14, padding: 4, background_fill_color: null });
    figure.add_layout(this.bar, "right");
    this.wire();
  }

  wire() {
    this.part.addEventListener("toggle", async () => {
      if (!this.part.open) return;
      await (this.attached ??= this.attach());  // the figure is drawn when it is first looked at
      this.part.scrollIntoView({ block: "nearest" });
      this.refill(0);
    });
    $("#map-fill").addEventListener("click", () => this.refill(0, true));
    for (const id of ["map-feature", "map-size"]) $(`#${id}`).addEventListener("change", () => this.refill(0, true));
    for (const along of ["x", "y"]) {
      $(`#map-${along}`).addEventListener("change", () => { this.bounds(along); this.refill(0, true); });
      for (const end of ["low", "high"]) {
        $(`#map-${along}-${end}`).addEventListener("change", () => this.refill(0, true));
      }
    }
    const plot = $(".plot", this.root);
    plot.addEventListener("click", (event) => { this.choose(this.cellAt(event)); this.take(); });
    plot.addEventListener("mousemove", (event) => this.tell(this.cellAt(event)));
    this.root.addEventListener("keydown", (event) => {
      const by = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
      if (!this.map || !(by || event.key === "Enter")) return;
      event.preventDefault();
      if (event.key === "Enter") { this.take(); return; }
      const [i, j] = this.cell ?? [this.map.size >> 1, this.map.size >> 1], most = this.map.size - 1;
      this.choose([Math.min(most, Math.max(0, i + by[0])), Math.min(most, Math.max(0, j + by[1]))]);
    });
  }

  dress() {
    super.dress();
    const { ink } = look();
    this.bar.setv({ major_label_text_color: ink, title_text_color: ink, title_text_font_style: "normal" });
    this.shaft.glyph.setv({ line_color: "#ffffff" });
    this.head.glyph.setv({ fill_color: "#ffffff" });
    this.marks.glyph.setv({ line_color: "#d55e00" });
    this.box.glyph.setv({ line_color: "#ffffff" });
    for (const grid of [...this.figure.xgrid, ...this.figure.ygrid]) grid.visible = false;
  }

  // -- what is asked ---------------------------------------------------------------------------------------------------

  offer(features) {
    this.features = features;
    options($("#map-feature"), features.map(([name]) => [name, name.replaceAll("_", " ")]), "largest_force");
  }

  // The fields of the scene that a map can vary.
  scene({ form, table }) {
    this.table = table;
    const held = [...leaves(form)].filter((entry) => entry.kind === "quantity" && entry.value !== null && entry.low !== undefined);
    this.fields = new Map(held.map((entry) => [entry.path, entry]));
    const pairs = held.map((entry) => [entry.path, entry.words]);
    for (const [along, usual] of [["x", "speed"], ["y", this.fields.has("irregularity.0.height") ? "irregularity.0.height" : "vehicle.damping"]]) {
      const select = $(`#map-${along}`), before = select.value;
      const chosen = this.fields.has(before) ? before : this.fields.has(usual) ? usual : held.find((entry) => entry.path !== $("#map-x").value)?.path;
      options(select, pairs, chosen);
      select.value = chosen;
      if (before !== chosen) this.bounds(along);
    }
    this.mark();
    if (this.part.open && this.map && this.rest() !== this.map.rest) this.refill(WAIT);
  }

  // Half to twice the present value, unless zero says nothing.
  bounds(along) {
    const entry = this.fields.get($(`#map-${along}`).value);
    if (!entry) return;
    const [low, high] = entry.value > 0 ? [0.5 * entry.value, 2 * entry.value] : entry.value < 0 ? [2 * entry.value, 0.5 * entry.value] : [entry.low, entry.high];
    for (const [end, value] of [["low", low], ["high", high]]) $(`#map-${along}-${end}`).value = `${digits(value / entry.factor, 5)} ${unitText(entry.unit)}`;
  }

  axis(along) {
    const path = $(`#map-${along}`).value, entry = this.fields.get(path);
    const read = (end) => {
      const text = $(`#map-${along}-${end}`).value.trim().replace(unitText(entry.unit), "").trim();
      return Number(text) * entry.factor;
    };
    return { path, low: read("low"), high: read("high") };
  }

  // The scene but for the two fields: where it changes, the map is another one.
  rest() {
    const paths = [$("#map-x").value, $("#map-y").value], held = structuredClone(this.table);
    for (const path of paths) {
      const parts = path.split("."), last = parts.pop();
      const holder = parts.reduce((value, part) => value?.[part], held);
      if (holder) holder[last] = null;
    }
    return JSON.stringify(held);
  }

  refill(after, anew = false) {
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => {
      if (!this.table || !this.fields.size || (!anew && this.rests === this.rest())) return;
      this.number += 1;
      this.asked = performance.now();
      const message = { feature: $("#map-feature").value, x: this.axis("x"), y: this.axis("y"), size: Number($("#map-size").value) };
      this.rests = this.rest();
      this.words.textContent = this.ask({ do: "map", number: this.number, ...message }) ? "filling …" : "no connection";
    }, after);
  }

  // -- what comes ------------------------------------------------------------------------------------------------------

  begin(frame) {
    if (frame.number !== this.number) return;
    const { size, x, y } = frame;
    [this.scale, frame.unit] = SHOWN[frame.unit] ?? [1, frame.unit];
    this.map = { ...frame, rest: this.rests, values: new Float64Array(size * size).fill(NaN), done: 0 };
    this.cell = null;
    this.chosen.data = { x: [], y: [] };
    this.shafts.data = { x0: [], y0: [], x1: [], y1: [] };
    this.heads.data = { x: [], y: [], angle: [] };
    const scaled = (along, [path, low, high]) => {
      const entry = this.fields.get(path);
      this[`${along}Scale`] = { factor: entry.factor, unit: unitText(entry.unit), name: entry.words };
      return [low / entry.factor, high / entry.factor];
    };
    this.xs = scaled("x", x);
    this.ys = scaled("y", y);
    this.fit(this.xs, this.ys);
    const text = ({ name, unit }) => (unit ? `${name} [${unit}]` : name);
    this.label(text(this.xScale), text(this.yScale));
    this.name(`${frame.feature.replaceAll("_", " ")}${frame.unit ? ` [${unitText(frame.unit)}]` : ""}: ${frame.definition}`);
    this.bar.title = frame.unit ? unitText(frame.unit) : " ";
    setKey(this.key, [["this scene", "#d55e00", "dot"]]);
    this.mark();
  }

  tile(frame) {
    const { map } = this;
    if (frame.number !== this.number || !map) return;
    const held = frame.arrays[frame.values], [from, to] = frame.rows, [first, last] = frame.columns;
    for (let row = from, k = 0; row < to; row += 1) for (let column = first; column < last; column += 1, k += 1) map.values[row * map.size + column] = this.scale * held[k];
    map.done = frame.done;
    this.paint();
    const share = frame.done / map.size ** 2;
    const wrong = frame.wrong.length ? `; some cells: ${frame.wrong.join(", ")}${frame.refusal ? ` (${frame.refusal})` : ""}` : "";
    this.words.textContent = share < 1 ? `${Math.round(100 * share)} %${wrong}` : `${map.size} × ${map.size} cells in ${digits((performance.now() - this.asked) / 1000, 3)} s${wrong}`;
    if (share === 1) {
      performance.measure("map", { start: this.asked, end: performance.now() });
      document.documentElement.dataset.mapped = frame.number;
    }
  }

  paint() {
    const { map } = this, { size } = map;
    const [low, high] = extremes([map.values]);
    if (this.colours.low !== low || this.colours.high !== high) this.colours.setv({ low, high: high > low ? high : low + 1 });
    const { ndarray } = Bokeh.require("core/util/ndarray");
    const image = ndarray(map.values, { dtype: "float64", shape: [size, size] });
    this.images.data = { image: [image], x: [this.xs[0]], y: [this.ys[0]], dw: [this.xs[1] - this.xs[0]], dh: [this.ys[1] - this.ys[0]] };
  }

  arrows(frame) {
    if (frame.number !== this.number || !this.map) return;
    if (frame.x === undefined) { this.words.textContent += frame.line ? `; ${frame.line}` : ""; return; }
    const [x, y, byX, byY] = ["x", "y", "by_x", "by_y"].map((name) => frame.arrays[frame[name]]);
    const sizes = Float64Array.from(x, (_, i) => Math.hypot(byX[i], byY[i]));
    const usual = [...sizes].sort((a, b) => a - b)[Math.floor(0.8 * sizes.length)] || 1;
    const width = this.xs[1] - this.xs[0], height = this.ys[1] - this.ys[0];
    const box = this.view?.frame?.bbox ?? { width: 1, height: 1 };
    const data = { x0: [], y0: [], x1: [], y1: [] }, heads = { x: [], y: [], angle: [] };
    for (let i = 0; i < x.length; i += 1) {
      if (!sizes[i]) continue;
      const long = 0.05 * Math.min(1, 0.25 + 0.75 * sizes[i] / usual), px = x[i] / this.xScale.factor, py = y[i] / this.yScale.factor;
      const dx = long * width * byX[i] / sizes[i], dy = long * height * byY[i] / sizes[i];
      data.x0.push(px - dx / 2); data.y0.push(py - dy / 2); data.x1.push(px + dx / 2); data.y1.push(py + dy / 2);
      heads.x.push(px + dx / 2); heads.y.push(py + dy / 2);
      heads.angle.push(Math.atan2(dy / height * box.height, dx / width * box.width) - Math.PI / 2);
    }
    this.shafts.data = data;
    this.heads.data = heads;
    setKey(this.key, [["this scene", "#d55e00", "dot"], [`steepest rise${frame.left ? ` (${frame.left} arrows left out: not reliable)` : ""}`, look().soft, "arrow"]]);
  }

  refused(frame) {
    if (frame.number === this.number) this.words.textContent = frame.line;
  }

  // -- cells -----------------------------------------------------------------------------------------------------------

  mark() {
    if (!this.map) return;
    const at = (along, [path]) => { const entry = this.fields.get(path); return entry ? entry.value / this[`${along}Scale`].factor : NaN; };
    this.here.data = { x: [at("x", this.map.x)], y: [at("y", this.map.y)] };
  }

  middle([i, j]) {
    const { size } = this.map;
    return [this.xs[0] + (this.xs[1] - this.xs[0]) * (i + 0.5) / size, this.ys[0] + (this.ys[1] - this.ys[0]) * (j + 0.5) / size];
  }

  cellAt(event) {
    const box = this.view?.frame?.bbox, { map } = this;
    if (!box || !map) return null;
    const edge = $(".plot", this.root).getBoundingClientRect();
    const i = Math.floor(map.size * (event.clientX - edge.left - box.left) / box.width);
    const j = Math.floor(map.size * (1 - (event.clientY - edge.top - box.top) / box.height));
    return i >= 0 && j >= 0 && i < map.size && j < map.size ? [i, j] : null;
  }

  choose(cell) {
    if (!cell) return;
    this.cell = cell;
    const [x, y] = this.middle(cell);
    this.chosen.data = { x: [x], y: [y] };
    this.tell(cell);
  }

  tell(cell) {
    if (!cell) return;
    const [x, y] = this.middle(cell), value = this.map.values[cell[1] * this.map.size + cell[0]];
    this.words.textContent = `${this.xScale.name} ${digits(x)} ${this.xScale.unit}, ${this.yScale.name} ${digits(y)} ${this.yScale.unit}: ${digits(value)} ${unitText(this.map.unit)}`;
  }

  take() {
    if (!this.cell) return;
    const [x, y] = this.middle(this.cell);
    this.load({ [this.map.x[0]]: x * this.xScale.factor, [this.map.y[0]]: y * this.yScale.factor });
  }
}

// Where there are several contacts: a strip for each below the forces, with its losses as bars and its impacts as marks.

import { h } from "./dom.js";
import { look } from "./plots.js";

const LANE = 15, BAR = 8, THINNEST = 2;

export class Strips {
  // `panel` is the one below which the strips stand, in the same window of time.
  constructor(panel) {
    this.panel = panel;
    this.contacts = [];
    this.canvas = panel.root.appendChild(h("canvas", { className: "strips", hidden: true, role: "img" }));
    const again = () => {
      cancelAnimationFrame(this.frame);
      this.frame = requestAnimationFrame(() => this.draw());
    };
    for (const end of ["start", "end"]) panel.figure.x_range.properties[end].change.connect(again);
    new ResizeObserver(again).observe(panel.root);
  }

  show(marks, arrays) {
    this.contacts = marks.length < 2 ? [] : marks.map((one) => ({
      name: one.name, from: arrays[one.from], to: arrays[one.to], impacts: arrays[one.impacts],
    }));
    this.canvas.hidden = !this.contacts.length;
    if (this.canvas.hidden) return;
    const told = this.contacts.map(({ name, from, impacts }) => `${name}: ${from.length} losses, ${impacts.length} impacts`);
    this.canvas.setAttribute("aria-label", `losses of contact and impacts of each contact over time; ${told.join("; ")}`);
    this.draw();
    // The panel takes its place in the next frame, where its labels have become wider or narrower.
    requestAnimationFrame(() => requestAnimationFrame(() => { if (this.place !== this.placed) this.draw(); }));
  }

  get place() {
    const box = this.panel.view?.frame?.bbox;
    return box ? `${box.left} ${box.width}` : "";
  }

  draw() {
    if (this.canvas.hidden) return;
    this.placed = this.place;
    const { panel, canvas, contacts } = this, ink = look(), ratio = devicePixelRatio || 1;
    const width = canvas.parentElement.clientWidth, height = LANE * contacts.length + 2;
    canvas.style.height = `${height}px`;
    const edge = canvas.getBoundingClientRect().left - panel.plot.getBoundingClientRect().left;
    canvas.width = Math.round(canvas.clientWidth * ratio);
    canvas.height = Math.round(height * ratio);
    const box = panel.view?.frame?.bbox;
    if (!box || !width) return;
    const { start, end } = panel.figure.x_range, left = box.left - edge, pen = canvas.getContext("2d");
    const px = (time) => left + box.width * Math.min(1, Math.max(0, (time - start) / (end - start)));
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, canvas.clientWidth, height);
    pen.font = "11px system-ui, sans-serif";
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    contacts.forEach(({ name, from, to, impacts }, i) => {
      const middle = LANE * (i + 0.5);
      pen.fillStyle = ink.ink;
      pen.fillText(name, left - 5, middle, left - 5);
      pen.fillStyle = ink.rule;
      pen.fillRect(left, middle, box.width, 1);
      pen.fillStyle = ink.colours[i % ink.colours.length];
      from.forEach((lost, k) => {
        if (to[k] < start || lost > end) return;
        pen.fillRect(px(lost), middle - BAR / 2, Math.max(THINNEST, px(to[k]) - px(lost)), BAR);
      });
      pen.fillStyle = ink.ink;
      for (const hit of impacts) {
        if (hit < start || hit > end) continue;
        pen.beginPath();
        pen.moveTo(px(hit), middle);
        pen.lineTo(px(hit) - 3, middle + 6);
        pen.lineTo(px(hit) + 3, middle + 6);
        pen.fill();
      }
    });
  }
}

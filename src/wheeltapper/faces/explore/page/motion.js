// The motion: wheels, rail, sleepers or deck on a canvas, with the force beside; time is slowed, heights are exaggerated.

import { digits } from "./dom.js";
import { extremes, look } from "./plots.js";

const STEPS = 10000, GAUGE = 132, LONGEST_WHEEL = 92, HEIGHT_SHARE = 9;
const SLOWED = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
const HEIGHTS = [1, 10, 20, 50, 100, 200, 500, 1000, 2000];

export class Motion {
  constructor(parts, moved) {
    Object.assign(this, parts);  // canvas, words, scrub, clock, play, slow, exaggeration
    this.moved = moved;
    this.share = 0;
    this.playing = false;
    this.surface = null;
    this.play.addEventListener("click", () => this.toggle());
    this.scrub.addEventListener("input", () => { this.share = this.scrub.valueAsNumber / STEPS; this.draw(); });
    for (const [select, values, text] of [[this.slow, SLOWED, (v) => (v === 1 ? "not" : `${v} times`)], [this.exaggeration, HEIGHTS, (v) => `× ${v}`]]) {
      select.replaceChildren(new Option("auto", "auto"), ...values.map((value) => new Option(text(value), value)));
      select.addEventListener("change", () => this.draw());
    }
    new ResizeObserver(() => this.resize()).observe(this.canvas);
    this.resize();
  }

  resize() {
    const ratio = devicePixelRatio || 1, { clientWidth: width, clientHeight: height } = this.canvas;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    Object.assign(this, { width, height, ratio });
    this.draw();
  }

  show(run, arrays) {
    const { motion } = run;
    const array = (number) => (number === null || number === undefined ? null : arrays[number]);
    this.run = {
      end: run.end, speed: run.speed, track: motion.track, side: motion.side, time: arrays[motion.time], deck: array(motion.deck),
      wheels: motion.wheels.map((wheel) => ({ ...wheel, y: arrays[wheel.y], force: arrays[wheel.force], rail: array(wheel.rail) })),
      bodies: motion.bodies.map((body) => ({ ...body, y: arrays[body.y], pitch: array(body.pitch) })),
    };
    const [deepest, highest] = extremes(this.run.wheels.map((wheel) => wheel.y), 0);  // zero: where a rail without a load is
    this.run.reach = Math.max(highest - deepest, 1e-9);
    const parts = [`${this.run.wheels.length === 1 ? "a wheel" : `${this.run.wheels.length} wheels`}${this.run.side && ` on the ${this.run.side}`}`, ...this.run.bodies.map((body) => body.name), `track: ${motion.track.kind}`];
    this.canvas.setAttribute("aria-label", `in motion: ${parts.join(", ")}`);
    this.draw();
  }

  setSurface(frame, arrays) {
    this.surface = { x: arrays[frame.x], rail: arrays[frame.rail], turn: arrays[frame.turn], wheels: frame.wheels.map((tread) => arrays[tread]) };
    this.surface.depth = Math.max(...this.surface.wheels.map(span));
    this.draw();
  }

  // -- time -----------------------------------------------------------------------------------------------------------

  toggle(on = !this.playing) {
    this.playing = on;
    this.play.textContent = on ? "pause" : "play";
    this.play.setAttribute("aria-pressed", on);
    if (on) {
      if (this.share >= 1) this.share = 0;
      this.before = null;
      requestAnimationFrame((now) => this.tick(now));
    }
  }

  tick(now) {
    if (!this.playing || !this.run) return;
    if (this.before !== null) this.share += (now - this.before) / 1000 / this.slowed / this.run.end;
    this.before = now;
    if (this.share >= 1) { this.share = 1; this.toggle(false); }
    this.draw();
    if (this.playing) requestAnimationFrame((next) => this.tick(next));
  }

  step(by) {
    this.share = Math.min(1, Math.max(0, this.share + by));
    this.draw();
  }

  get slowed() {
    if (this.slow.value !== "auto") return Number(this.slow.value);
    return SLOWED.find((value) => value * this.run.end >= 6) ?? SLOWED.at(-1);
  }

  get factor() {
    if (this.exaggeration.value !== "auto") return Number(this.exaggeration.value);
    const wished = this.height / HEIGHT_SHARE / (this.run.reach * this.scale);
    return HEIGHTS.findLast((value) => value <= wished) ?? 1;
  }

  // -- drawing --------------------------------------------------------------------------------------------------------

  get scale() {
    const { wheels, bodies } = this.run, radius = Math.max(...wheels.map((wheel) => wheel.radius));
    const places = wheels.map((wheel) => wheel.x);
    const along = Math.max(...places) - Math.min(...places) + 2.6 * radius + (bodies.length ? 5 : 1.6);
    return Math.min(LONGEST_WHEEL / radius, (this.width - GAUGE) / along);
  }

  draw() {
    if (!this.run || !this.width) return;
    const { run, canvas } = this, pen = canvas.getContext("2d"), ink = look();
    const time = this.share * run.end, at = place(run.time, time), x = run.speed * time;
    const value = (values) => (values ? mixed(values, at) : 0);
    pen.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    pen.clearRect(0, 0, this.width, this.height);
    const scale = this.scale, factor = this.factor, up = scale * factor;
    const places = run.wheels.map((wheel) => wheel.x);
    const middle = (Math.max(...places) + Math.min(...places)) / 2;
    const left = (this.width - GAUGE) / 2, ground = this.height - 62;
    const px = (along) => left + (along - x - middle) * scale;
    pen.save();
    pen.beginPath();
    pen.rect(0, 0, this.width - GAUGE, this.height);
    pen.clip();
    this.drawTrack(pen, ink, { px, up, ground, scale, x, middle, deck: value(run.deck), value });
    for (const body of run.bodies) this.drawBody(pen, ink, body, { px, up, ground, scale, x, lift: value(body.y), pitch: value(body.pitch), factor });
    for (const [number, wheel] of run.wheels.entries()) this.drawWheel(pen, ink, wheel, { tread: this.surface?.wheels[number], px, up, ground, scale, factor, x, y: value(wheel.y), force: value(wheel.force) });
    pen.restore();
    this.drawGauge(pen, ink, value);
    this.scrub.value = Math.round(STEPS * this.share);
    this.clock.textContent = `${digits(1000 * time, 5)} ms`;
    this.words.textContent = `heights × ${factor}, time slowed ${this.slowed === 1 ? "not at all" : `${this.slowed} times`}; x = ${digits(x, 4)} m${run.side && `; wheels on the ${run.side}`}`;
    this.moved(time, at.index);
  }

  // Height of the rail's surface at a place, m.
  rail(along) {
    return this.surface ? mixed(this.surface.rail, place(this.surface.x, along)) : 0;
  }

  drawTrack(pen, ink, { px, up, ground, scale, x, middle, deck, value }) {
    const { track, wheels } = this.run, first = x + middle - (px(x + middle)) / scale, width = this.width - GAUGE;
    const last = first + width / scale, low = ground + 12;
    const sunk = (along) => {
      if (track.kind === "deck") return deckCarries(track, along) ? deck : 0;
      let found = 0;
      for (const wheel of wheels) if (wheel.rail) found += value(wheel.rail) * bending(along - x - wheel.x);
      return found;
    };
    pen.lineWidth = 1;
    pen.fillStyle = ink.rule;
    pen.strokeStyle = ink.soft;
    if (track.kind === "sleepers") {
      const begin = Math.ceil((first - track.first) / track.spacing);
      for (let seat = begin; track.first + seat * track.spacing < last; seat += 1) {
        const along = track.first + seat * track.spacing, sleeper = 0.4 * sunk(along) * up;
        pen.fillStyle = ink.soft;
        pen.fillRect(px(along) - 0.12 * scale, low + 7 - sleeper, 0.24 * scale, Math.max(5, 0.13 * scale));
        spring(pen, px(along), low + 8 + Math.max(5, 0.13 * scale) - sleeper, this.height - 6);
      }
    } else if (track.kind === "deck") {
      const begin = Math.max(px(track.start ?? -Infinity), -10);
      const end = Math.min(track.length === null || track.length === undefined ? Infinity : px(track.start + track.length), width + 10);
      pen.fillStyle = ink.soft;
      if (end > begin) {
        pen.fillRect(begin, low + 2 - deck * up, end - begin, 14);
        for (let k = 1; k < 8; k += 2) spring(pen, begin + (end - begin) * k / 8, low + 16 - deck * up, this.height - 6);
      }
    } else {
      pen.fillStyle = ink.rule;
      pen.fillRect(0, low, width, track.kind === "slab" ? 22 : 14);
    }
    pen.beginPath();
    pen.moveTo(0, this.height - 5);
    pen.lineTo(width, this.height - 5);
    pen.stroke();
    // the rail: its surface with the irregularity, over where the track gives way
    pen.beginPath();
    for (let step = 0; step <= width; step += 1) pen.lineTo(step, ground - up * (this.rail(first + step / scale) + sunk(first + step / scale)));
    for (let step = width; step > -8; step -= 8) pen.lineTo(Math.max(0, step), low - up * sunk(first + Math.max(0, step) / scale));
    pen.closePath();
    pen.fillStyle = ink.colours[0];
    pen.globalAlpha = 0.35;
    pen.fill();
    pen.globalAlpha = 1;
    pen.strokeStyle = ink.colours[0];
    pen.lineWidth = 1.6;
    pen.stroke();
    pen.fillStyle = ink.ink;
    pen.font = "11px system-ui, sans-serif";
    const gap = niceStep(90 / scale);
    for (let k = Math.ceil(first / gap); k * gap < last; k += 1) {
      pen.fillRect(px(k * gap), this.height - 5, 1, 4);
      pen.fillText(`${digits(k * gap, 4)} m`, px(k * gap) + 3, this.height - 8);
    }
  }

  drawWheel(pen, ink, wheel, { tread, px, up, ground, scale, factor, x, y, force }) {
    const radius = wheel.radius * scale, centre = ground - radius - up * y, middle = px(x + wheel.x);
    const rolled = (x + wheel.x) / wheel.radius, { surface } = this;
    // a fault of the tread is exaggerated like the heights, but leaves most of the wheel
    const deep = up * Math.min(1, 0.3 * radius / Math.max(1e-9, up * (surface?.depth ?? 0)));
    pen.beginPath();
    for (let step = 0; step <= 240; step += 1) {
      const turn = 2 * Math.PI * step / 240;
      // a place at the rolled distance s touches below when the wheel has rolled s
      const held = tread ? mixed(tread, place(surface.turn, wrapped(rolled + turn))) : 0;
      const reach = radius + held * deep;
      pen.lineTo(middle + reach * Math.sin(turn), centre + reach * Math.cos(turn));
    }
    pen.closePath();
    pen.fillStyle = ink.paper;
    pen.fill();
    pen.strokeStyle = ink.ink;
    pen.lineWidth = Math.max(2, 0.09 * radius);
    pen.stroke();
    pen.lineWidth = 1.2;
    pen.strokeStyle = ink.soft;
    for (let spoke = 0; spoke < 5; spoke += 1) {
      const turn = 2 * Math.PI * spoke / 5 - rolled;
      pen.beginPath();
      pen.moveTo(middle, centre);
      pen.lineTo(middle - 0.86 * radius * Math.sin(turn), centre + 0.86 * radius * Math.cos(turn));
      pen.stroke();
    }
    pen.beginPath();
    pen.arc(middle, centre, Math.max(2.5, 0.08 * radius), 0, 2 * Math.PI);
    pen.fillStyle = ink.ink;
    pen.fill();
    if (force <= 0) {
      pen.fillStyle = ink.colours[1];
      pen.font = "bold 12px system-ui, sans-serif";
      pen.fillText("no contact", middle + 0.75 * radius, ground - 6);
      return;
    }
    const length = Math.min(56, 16 * force / wheel.static);
    arrow(pen, middle, ground + 4 + length, middle, ground + 4, ink.colours[1], 2.5);
  }

  drawBody(pen, ink, body, { px, up, ground, scale, x, lift, pitch, factor }) {
    pen.save();
    pen.translate(px(x + body.x), ground - body.z * scale - up * lift);
    pen.rotate(Math.max(-0.3, Math.min(0.3, -pitch * factor)));
    pen.strokeStyle = ink.soft;
    pen.lineWidth = 1.5;
    pen.strokeRect(-body.length * scale / 2, -body.height * scale / 2, body.length * scale, body.height * scale);
    pen.fillStyle = ink.ink;
    pen.font = "11px system-ui, sans-serif";
    pen.textAlign = "center";
    pen.fillText(body.name, 0, 4);  // in the middle, where no wheel is before it
    pen.restore();
  }

  drawGauge(pen, ink, value) {
    const { wheels } = this.run, left = this.width - GAUGE + 34, top = 24, bottom = this.height - 22, width = GAUGE - 42;
    const highest = niceStep(Math.max(2, ...wheels.map((wheel) => wheel.top ??= Math.max(...wheel.force) / wheel.static)));
    const py = (ratio) => bottom - (bottom - top) * Math.min(1, ratio / highest);
    pen.font = "11px system-ui, sans-serif";
    pen.fillStyle = ink.ink;
    pen.fillText("force / static", left - 24, 12);
    const bar = Math.min(26, width / wheels.length - 3);
    wheels.forEach((wheel, i) => {
      const ratio = value(wheel.force) / wheel.static;
      pen.fillStyle = ink.colours[i % ink.colours.length];
      pen.fillRect(left + 4 + i * (bar + 3), py(ratio), bar, bottom - py(ratio));
    });
    pen.strokeStyle = ink.soft;
    pen.fillStyle = ink.ink;
    pen.lineWidth = 1;
    for (let k = 0; k <= 4; k += 1) {
      const ratio = highest * k / 4;
      pen.beginPath();
      pen.moveTo(left - 3, py(ratio));
      pen.lineTo(left + width, py(ratio));
      pen.globalAlpha = 0.4;
      pen.stroke();
      pen.globalAlpha = 1;
      pen.fillText(digits(ratio, 2), left - 26, py(ratio) + 4);
    }
    pen.setLineDash([4, 3]);
    pen.beginPath();
    pen.moveTo(left, py(1));
    pen.lineTo(left + width, py(1));
    pen.stroke();
    pen.setLineDash([]);
    if (wheels.length === 1) {  // on paper of their own, since lines are behind them
      const [wheel] = wheels, ratio = value(wheel.force) / wheel.static, y = Math.min(bottom - 16, py(ratio) + 4);
      pen.fillStyle = ink.paper;
      pen.fillRect(left + bar + 8, y - 11, width - bar - 8, 27);
      pen.fillStyle = ink.ink;
      pen.fillText(`${digits(ratio, 3)}`, left + bar + 10, y);
      pen.fillText(`${digits(value(wheel.force) / 1000, 3)} kN`, left + bar + 10, y + 13);
    }
  }
}

// -- numbers ----------------------------------------------------------------------------------------------------------

function place(times, wanted) {
  let low = 0, high = times.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= wanted) low = middle; else high = middle;
  }
  const width = times[high] - times[low];
  return { index: low, share: width > 0 ? Math.min(1, Math.max(0, (wanted - times[low]) / width)) : 0 };
}

const mixed = (values, { index, share }) => {
  const a = values[index], b = values[Math.min(index + 1, values.length - 1)];
  const found = a + share * (b - a);
  return Number.isFinite(found) ? found : 0;
};
const wrapped = (turn) => ((turn % (2 * Math.PI)) + 2 * Math.PI) % (2 * Math.PI);
const deckCarries = (track, along) => track.start === null || track.start === undefined
  || (along >= track.start && (track.length === null || track.length === undefined || along <= track.start + track.length));
// How a rail on an elastic bed bends beside a load: only the deflection under each wheel is computed.
const bending = (distance) => {
  const turn = 1.1 * Math.abs(distance);
  return Math.exp(-turn) * (Math.cos(turn) + Math.sin(turn));
};

function span(values) {
  let low = Infinity, high = -Infinity;
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return high - low;
}

function niceStep(value) {
  const size = 10 ** Math.floor(Math.log10(value));
  return size * ([1, 2, 4, 5, 8, 10].find((step) => step * size >= value) ?? 10);
}

function spring(pen, x, top, bottom) {
  pen.beginPath();
  pen.moveTo(x, top);
  for (let k = 1; k < 6; k += 1) pen.lineTo(x + (k % 2 ? 5 : -5), top + (bottom - top) * k / 6);
  pen.lineTo(x, bottom);
  pen.stroke();
}

function arrow(pen, x0, y0, x1, y1, colour, width) {
  const turn = Math.atan2(y1 - y0, x1 - x0), head = 8;
  pen.strokeStyle = colour;
  pen.fillStyle = colour;
  pen.lineWidth = width;
  pen.beginPath();
  pen.moveTo(x0, y0);
  pen.lineTo(x1 - head * Math.cos(turn) * 0.6, y1 - head * Math.sin(turn) * 0.6);
  pen.stroke();
  pen.beginPath();
  pen.moveTo(x1, y1);
  pen.lineTo(x1 - head * Math.cos(turn - 0.5), y1 - head * Math.sin(turn - 0.5));
  pen.lineTo(x1 - head * Math.cos(turn + 0.5), y1 - head * Math.sin(turn + 0.5));
  pen.fill();
}

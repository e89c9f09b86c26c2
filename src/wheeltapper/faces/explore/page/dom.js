// Small helpers for elements and numbers.

export function h(tag, given = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(given)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name in made && !name.startsWith("aria")) made[name] = value;
    else made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

export const $ = (selector, inside = document) => inside.querySelector(selector);

export function digits(value, count = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "—";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) return value.toExponential(count - 1).replace(/\.?0+e/, "e").replace("e+", "e");
  return String(Number(value.toPrecision(count)));
}

// A unit as it is printed: m/s^2 becomes m/s².
const RAISED = { "-": "⁻", ".": "·", 0: "⁰", 1: "¹", 2: "²", 3: "³", 5: "⁵" };
export const unitText = (unit) =>
  unit.replace(/\^(-?[\d.]+)/g, (_, power) => [...power].map((sign) => RAISED[sign] ?? sign).join(""));

export function options(select, pairs, chosen) {
  const same = select.options.length === pairs.length && pairs.every(([value, text], i) =>
    select.options[i].value === value && select.options[i].text === text);
  if (!same) select.replaceChildren(...pairs.map(([value, text]) => h("option", { value, text })));
  if (chosen !== undefined && document.activeElement !== select) select.value = chosen;
}

// When what was changed has been drawn: after the next frame of the browser.
export const drawn = () => new Promise((done) => requestAnimationFrame(() => {
  const channel = new MessageChannel();
  channel.port1.onmessage = done;
  channel.port2.postMessage(null);
}));

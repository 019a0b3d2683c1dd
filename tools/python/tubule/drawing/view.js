// What both pages of `tubule view` need: numbers, axes with ticks and a grid, colour bars, controls, pictures to save.
// All data are in the element #data, written by view.py.
"use strict";

const data = JSON.parse(document.getElementById("data").textContent);
const at = id => document.getElementById(id);
const steps = 65535;

function element(tag, properties = {}, parent = null) {
  const out = Object.assign(document.createElement(tag), properties);
  if (parent) parent.appendChild(out);
  return out;
}

function bytes(text) {
  const raw = atob(text), out = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; ++i) out[i] = raw.charCodeAt(i);
  return out.buffer;
}

function unpacked(text, low, high) {
  return Float32Array.from(new Uint16Array(bytes(text)), x => low + (high - low) * x / steps);
}

function short(x, digits = 6) {
  if (x === null || x === undefined) return "-";
  const far = x !== 0 && (Math.abs(x) < 1e-3 || Math.abs(x) >= 1e7);
  const text = far ? x.toExponential(2) : String(Number(x.toPrecision(digits)));
  return text.replace(/-/g, "\u2212").replace(/\.?0*e\+?/, "e");
}

// A number with the unit that the page has for it, if any.
function measured(x, unit, digits = 6) { return unit && x !== null ? `${short(x, digits)} ${unit}` : short(x, digits); }
function labelled(words, unit) { return unit ? `${words} [${unit}]` : words; }

function ends(values) {
  let low = Infinity, high = -Infinity;
  for (const x of values) if (x !== null) low = Math.min(low, x), high = Math.max(high, x);
  return low < high ? [low, high] : low === Infinity ? [0, 1] : [low - 0.5, high + 0.5];
}

// The number of the value nearest to x.
function nearest_of(values, x) {
  return values.reduce((best, value, i) => Math.abs(value - x) < Math.abs(values[best] - x) ? i : best, 0);
}

// A canvas as sharp as the screen, its context in CSS pixels.
function context(canvas) {
  const {clientWidth: width, clientHeight: height} = canvas, ratio = window.devicePixelRatio || 1;
  canvas.width = Math.max(1, Math.round(width * ratio)), canvas.height = Math.max(1, Math.round(height * ratio));
  const c = canvas.getContext("2d");
  c.scale(ratio, ratio);
  Object.assign(c, {font: "12px sans-serif", fillStyle: "#222", strokeStyle: "#222"});
  return {c, width, height};
}

function line(c, x0, y0, x1, y1) { c.beginPath(), c.moveTo(x0, y0), c.lineTo(x1, y1), c.stroke(); }
function dot(c, x, y, size) { c.beginPath(), c.arc(x, y, size, 0, 7), c.fill(); }

// Where an event is on a canvas.
function place(e, canvas) {
  const box = canvas.getBoundingClientRect();
  return [e.clientX - box.left, e.clientY - box.top];
}

// Multiples of 1, 2 or 5 times a power of ten between the ends, about `count` and at least two.
function ticks(low, high, count) {
  const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw)), out = [];
  const step = power * [1, 2, 5, 10].find(x => x * power >= 0.999 * raw);
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; ++i)
    out.push(Number((i * step).toPrecision(12)));
  return out.length < 3 && count < 9 ? ticks(low, high, count + 1) : out;
}

function powers(low, high, count) {
  const decades = Math.log10(high / low), every = Math.ceil(decades / count), out = [];
  for (let n = Math.floor(Math.log10(low)); n <= Math.log10(high); ++n)
    for (const x of decades < 3 ? [1, 2, 5] : [1])
      if (n % every === 0 && x * 10 ** n >= low * 0.9999 && x * 10 ** n <= high * 1.0001) out.push(x * 10 ** n);
  return out.length > 1 ? out : ticks(low, high, count);
}

// One direction of a chart: from values to parts of its length.
class Axis {
  constructor([low, high], label, logarithmic = false, texts = null) {
    Object.assign(this, {low, high, label, logarithmic, texts});
  }

  way(x) { return this.logarithmic ? Math.log(Math.max(x, this.low)) : x; }
  part(x) { return (this.way(x) - this.way(this.low)) / (this.way(this.high) - this.way(this.low)); }

  at(part) {
    const x = this.way(this.low) + part * (this.way(this.high) - this.way(this.low));
    return this.logarithmic ? Math.exp(x) : x;
  }

  // [value, text], about `count`
  ticks(count) {
    const every = this.texts && Math.ceil(this.texts.length / count);
    if (this.texts) return this.texts.map((text, i) => [i, text]).filter((_, i) => i % every === 0);
    return (this.logarithmic ? powers : ticks)(this.low, this.high, count).map(x => [x, short(x)]);
  }
}

// Draws the ticks, grid and labels of two axes; what lies between them is drawn before the grid. Where points are then.
function draw_axes(c, width, height, x, y, between = null) {
  const rows = y.ticks(Math.max(2, Math.floor(height / 45)));
  const left = Math.ceil(Math.max(...rows.map(([, text]) => c.measureText(text).width))) + 30, right = width - 14;
  const top = 12, bottom = height - 40;
  const px = v => left + x.part(v) * (right - left), py = v => bottom - y.part(v) * (bottom - top);
  const columns = x.ticks(Math.max(2, Math.floor((right - left) / 75)));
  c.save(), c.beginPath(), c.rect(left, top, right - left, bottom - top), c.clip();
  if (between) between(px, py);
  c.restore();
  c.strokeStyle = between ? "#0002" : "#ddd", c.lineWidth = 1, c.beginPath();
  for (const [v] of columns) c.moveTo(px(v), top), c.lineTo(px(v), bottom);
  for (const [v] of rows) c.moveTo(left, py(v)), c.lineTo(right, py(v));
  c.stroke();
  c.strokeStyle = "#444", c.strokeRect(left, top, right - left, bottom - top), c.beginPath();
  for (const [v] of columns) c.moveTo(px(v), bottom), c.lineTo(px(v), bottom + 4);
  for (const [v] of rows) c.moveTo(left - 4, py(v)), c.lineTo(left, py(v));
  c.stroke();
  c.fillStyle = "#222", c.textAlign = "center";
  const inner = (x0, text) => Math.min(x0, width - c.measureText(text).width / 2 - 1);
  for (const [v, text] of columns) c.fillText(text, inner(px(v), text), bottom + 17);
  c.fillText(x.label, (left + right) / 2, height - 6);
  c.textAlign = "right";
  for (const [v, text] of rows) c.fillText(text, left - 7, py(v) + 4);
  c.save(), c.translate(11, (top + bottom) / 2), c.rotate(-Math.PI / 2);
  c.textAlign = "center", c.fillText(y.label, 0, 0), c.restore();
  const back = (x0, y0) => [x.at((x0 - left) / (right - left)), y.at((bottom - y0) / (bottom - top))];
  const inside = (x0, y0) => x0 >= left && x0 <= right && y0 >= top && y0 <= bottom;
  return {px, py, back, inside, left, right, top, bottom};
}

// The 256 colours of a table, as a function of their number.
function colours_of(text) {
  const table = new Uint8Array(bytes(text));
  return i => `rgb(${table[3 * i]}, ${table[3 * i + 1]}, ${table[3 * i + 2]})`;
}

// A colour bar, its ticks below it and its words above; arrows where values lie beyond it.
function draw_bar(c, x, y, width, {words, colours, shown, low, high}) {
  const colour = colours_of(colours), axis = new Axis(shown, "");
  const strip = element("canvas", {width: 256, height: 1}), s = strip.getContext("2d");
  for (let i = 0; i < 256; ++i) s.fillStyle = colour(i), s.fillRect(i, 0, 1, 1);
  c.drawImage(strip, x, y, width, 10);
  c.strokeStyle = "#444", c.lineWidth = 1, c.strokeRect(x, y, width, 10);
  for (const [beyond, i, edge, tip] of [[low < shown[0], 0, x, -8], [high > shown[1], 255, x + width, 8]]) {
    if (!beyond) continue;
    c.fillStyle = colour(i), c.beginPath(), c.moveTo(edge, y), c.lineTo(edge + tip, y + 5), c.lineTo(edge, y + 10);
    c.closePath(), c.fill(), c.stroke();
  }
  c.fillStyle = "#222", c.textAlign = "center";
  for (const [v, text] of axis.ticks(Math.max(2, Math.floor(width / 55)))) {
    const there = x + axis.part(v) * width;
    c.fillRect(there - 0.5, y + 10, 1, 4), c.fillText(text, there, y + 25);
  }
  c.textAlign = "left", c.fillText(words, x, y - 6, width + 50);
}

function choice(home, words, options, listener) {
  const label = element("label", {textContent: words + " "}, home), select = element("select", {}, label);
  for (const [value, text] of options) element("option", {value, textContent: text}, select);
  select.addEventListener("change", listener);
  return select;
}

function tick(home, words, listener) {
  const label = element("label", {}, home), box = element("input", {type: "checkbox"}, label);
  label.append(" " + words);
  box.addEventListener("change", listener);
  return box;
}

function button(home, textContent, id, listener) {
  element("button", {textContent, id}, home).addEventListener("click", listener);
}

// Saves canvases, one below the other, as a PNG picture; those of one row lie on each other.
function save(rows, name) {
  const ratio = window.devicePixelRatio || 1, head = 26 * ratio;
  const width = Math.max(...rows.flat().map(canvas => canvas.width));
  const height = head + rows.reduce((sum, [canvas]) => sum + canvas.height, 0);
  const out = element("canvas", {width, height}), c = out.getContext("2d");
  c.fillStyle = "#fff", c.fillRect(0, 0, out.width, out.height);
  Object.assign(c, {fillStyle: "#222", font: `${14 * ratio}px sans-serif`});
  c.fillText(data.title, 10 * ratio, 18 * ratio, width - 20 * ratio);
  let top = head;
  for (const row of rows) {
    for (const canvas of row) c.drawImage(canvas, 0, top);
    top += row[0].height;
  }
  out.toBlob(blob => {
    const base = data.file.replace(/\.[^.]*$/, "");
    const link = element("a", {href: URL.createObjectURL(blob), download: `${base}_${name}.png`});
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  });
}

at("title").textContent = data.title;
at("file").textContent = data.title === data.file ? "" : data.file;

// The page of a scan: the map of two axes, or curves over one, with all that `tubule plot` draws on it.

// What is shown: of the slice chosen, the number of an initial shape for each point, and its values.
class Slice {
  constructor(picks) {
    Object.assign(this, data.slices[picks.join(",")], {picks});
    this.hatches = Object.entries(this.hatches).map(([words, list]) => [words, new Set(list)]);
    this.family = data.choices.findIndex(one => one.starts);
    this.count = data.axes.reduce((product, axis) => product * axis.texts.length, 1);
  }

  // The numbers of the points with the initial shape `start`.
  of(start) { return data.slices[this.picks.map((pick, i) => i === this.family ? start + 1 : pick).join(",")]; }
  home(k) { return this.starts ? this.of(this.starts[k]) : this; }
  value(name, k) { return this.home(k).points[name][k]; }
  values(name) { return Array.from({length: this.count}, (_, k) => this.value(name, k)); }

  // [initial shape, the numbers of its points]
  families() {
    if (!this.starts) return [["", this.points]];
    return data.choices[this.family].texts.slice(1).map((text, i) => [text, this.of(i).points]);
  }

  // The words of the legend where the cell of a point is hatched.
  hatched(k) { return (this.hatches.find(([, set]) => set.has(k)) || [])[0]; }

  // [key=value] that make the point, those of its initial shape too.
  sets(k) {
    const m = data.axes.length > 1 ? data.axes[1].texts.length : 1, indices = [Math.floor(k / m), k % m];
    const pairs = data.axes.map((axis, i) => [axis.key, axis.texts[indices[i]]]);
    const pick = i => i === this.family && this.starts ? this.starts[k] + 1 : this.picks[i];
    data.choices.forEach((one, i) => pairs.push([one.key, one.texts[pick(i)]]));
    return pairs.flatMap(([key, text]) => key.split(", ").map((name, j) => `${name}=${text.split(", ")[j]}`));
  }
}

function worded(name, value) {
  return value !== null && data.names[name] ? data.names[name][value] : measured(value, data.units[name]);
}

function hatch(c, x, y, width, height, crossed) {
  c.save(), c.beginPath(), c.rect(x, y, width, height), c.clip(), c.strokeStyle = "#888", c.lineWidth = 0.8;
  const first = s => Math.floor(s / 7) * 7;  // so that lines of neighbouring cells continue each other
  for (let s = first(x + y); s < x + y + width + height; s += 7) line(c, s - y, y, s - y - height, y + height);
  for (let s = first(x - y - height); crossed && s < x - y + width; s += 7)
    line(c, s + y, y, s + y + height, y + height);
  c.restore();
}

// Squares, lines and dots with their words, below each other.
function draw_key(canvas, items) {
  canvas.style.height = `${20 * items.length + 8}px`;
  const {c} = context(canvas);
  items.forEach(({colour, dashes, width, round, crossed, text, bar}, i) => {
    const y = 6 + 20 * i;
    c.fillStyle = colour || "#fff", c.strokeStyle = "#888", c.lineWidth = 1;
    if (bar) return draw_bar(c, 12, y + 14, Math.min(320, canvas.clientWidth - 40), bar);
    if (text === undefined) return;
    if (round) dot(c, 10, y + 7, 2.5);
    else if (dashes) {
      c.strokeStyle = colour, c.lineWidth = width;
      c.setLineDash(dashes), line(c, 0, y + 7, 22, y + 7), c.setLineDash([]);
    } else {
      c.fillRect(2, y, 16, 14);
      if (crossed !== undefined) hatch(c, 2, y, 16, 14, crossed);
      c.strokeRect(2, y, 16, 14);
    }
    c.fillStyle = "#222", c.fillText(text, 28, y + 11);
  });
}

class Chart {
  constructor(canvas, show) {
    Object.assign(this, {canvas, kept: null, counts: data.axes.map(axis => axis.texts.length)});
    canvas.addEventListener("pointermove", e => show(this.point(...place(e, canvas)), false));
    canvas.addEventListener("click", e => show(this.point(...place(e, canvas)), true));
  }

  // The number of the point there, or null.
  point(x, y) {
    if (!this.axes || !this.axes.inside(x, y)) return null;
    const cell = (axis, v) => axis.borders.findIndex(border => v < border) - 1, [u, v] = this.axes.back(x, y);
    if (this.counts.length > 1) {
      const [i, j] = [cell(data.axes[0], u), cell(data.axes[1], v)];
      return i >= 0 && j >= 0 ? i * this.counts[1] + j : null;
    }
    return nearest_of(data.axes[0].values, u);
  }

  axis(i) {
    const {borders, label, logarithmic, numeric, texts} = data.axes[i];
    return new Axis([borders[0], borders[borders.length - 1]], label, logarithmic, numeric ? null : texts);
  }

  colour(slice, name, k) {
    const value = slice.value(name, k);
    if (value === null) return "#fff";
    if (name === "outcome") return value > 0 && !slice.hatched(k) ? data.outcome_colours[value] : "#fff";
    const [low, high] = this.ends, i = Math.round(255 * (value - low) / (high - low));
    return (this.table || (this.table = colours_of(data.colours)))(i);
  }

  draw(slice, name) {
    const {c, width, height} = context(this.canvas);
    c.fillStyle = "#fff", c.fillRect(0, 0, width, height);
    const draw = this.counts.length > 1 ? this.draw_map : this.draw_curves;
    draw.call(this, c, width, height, slice, name);
  }

  draw_map(c, width, height, slice, name) {
    const [n, m] = this.counts, [a, b] = data.axes.map(axis => axis.borders);
    this.ends = ends(slice.values(name));
    this.axes = draw_axes(c, width, height, this.axis(0), this.axis(1), (px, py) => {
      const box = k => {
        const i = Math.floor(k / m), j = k % m, left = px(a[i]), top = py(b[j + 1]);
        return [left, top, px(a[i + 1]) - left, py(b[j]) - top];
      };
      for (let k = 0; k < n * m; ++k) {
        const [x, y, w, h] = box(k), pattern = slice.hatched(k);
        c.fillStyle = this.colour(slice, name, k), c.fillRect(x, y, w + 0.5, h + 0.5);
        if (pattern) hatch(c, x, y, w, h, pattern === "not reached");
      }
      for (const {colour, width, dashes, ways} of slice.lines) {
        c.strokeStyle = colour, c.lineWidth = 1.3 * width, c.setLineDash(dashes.map(x => 1.3 * x)), c.beginPath();
        for (const way of ways) way.forEach(([x, y], i) => i ? c.lineTo(px(x), py(y)) : c.moveTo(px(x), py(y)));
        c.stroke(), c.setLineDash([]);
      }
      c.fillStyle = "#000";
      for (const {places} of slice.dots) for (const [x, y] of places) dot(c, px(x), py(y), 1.8);
      if (this.kept !== null) c.strokeStyle = "#000", c.lineWidth = 2.5, c.strokeRect(...box(this.kept));
    });
  }

  // A dot for each point, coloured by its outcome.
  draw_curves(c, width, height, slice, name) {
    const quantity = name === "outcome" ? "energy" : name, families = slice.families(), axis = data.axes[0];
    const known = families.flatMap(([, points]) => points[quantity].filter((_, k) => points.outcome[k] > 0));
    const [low, high] = ends(known), rim = 0.05 * (high - low);
    const y = new Axis([low - rim, high + rim], data.quantities[quantity]);
    this.axes = draw_axes(c, width, height, this.axis(0), y);
    const {px, py, top, bottom} = this.axes, upright = x => line(c, px(x), top, px(x), bottom);
    c.strokeStyle = "#000", c.lineWidth = 1;
    for (const [value, lowest] of slice.equal) c.setLineDash(lowest ? [] : [2, 3]), upright(value);
    c.setLineDash([]), c.strokeStyle = "#555";
    for (const [, points] of families)
      axis.values.forEach((x, k) => {
        if (!(points.outcome[k] > 0) || points[quantity][k] === null) return;
        c.fillStyle = data.outcome_colours[points.outcome[k]], dot(c, px(x), py(points[quantity][k]), 5), c.stroke();
      });
    if (this.kept !== null) c.setLineDash([3, 3]), upright(axis.values[this.kept]), c.setLineDash([]);
  }

  key(slice, name) {
    const is_map = this.counts.length > 1, counts = new Map();
    const all = is_map ? slice.values("outcome").filter((_, k) => !slice.hatched(k))
      : slice.families().flatMap(([, points]) => points.outcome);
    for (const k of all.filter(k => k > 0)) counts.set(k, (counts.get(k) || 0) + 1);
    const items = [], bar = {words: data.quantities[name], colours: data.colours, shown: this.ends};
    if (is_map && name !== "outcome") items.push({bar}, {}, {});
    else for (const [k, count] of [...counts].sort((a, b) => a[0] - b[0]))
      items.push({colour: data.outcome_colours[k], text: `${data.names.outcome[k]} (${count})`});
    for (const {label: text, width, ...look} of slice.lines) if (text) items.push({...look, width: 1.3 * width, text});
    if (!is_map && slice.equal.length) items.push({colour: "#000", dashes: [], width: 1, text: "equal energies"});
    for (const {label} of slice.dots) items.push({colour: "#000", round: true, text: label});
    for (const [words, set] of is_map ? slice.hatches : [])
      items.push({crossed: words === "not reached", text: `${words} (${set.size})`});
    return items;
  }
}

// As an argument in a shell.
function quoted(text) {
  return /^[\w.=,+:\/-]+$/.test(text) ? text : `'${text.replace(/'/g, "'\\''")}'`;
}

// All values of a point, those of other initial shapes, and the command that runs it.
function words_of(slice, k) {
  const names = Object.keys(data.quantities), message = slice.home(k).messages[k];
  const values = names.map(name => `${name}: ${worded(name, slice.value(name, k))}`), hatched = slice.hatched(k);
  const family = ([text, {outcome, free_energy}]) =>
    `from ${text}: ${worded("outcome", outcome[k])}, energy ${worded("free_energy", free_energy[k])}`;
  const others = slice.starts ? slice.families().map(family) : [];
  const about = [...(hatched ? [hatched] : []), ...(message ? [`message: ${message}`] : []), ...values];
  const command = [...data.command, ...slice.sets(k).map(set => `--set ${quoted(set)}`)].join(" ");
  return [about, others, [command]].filter(list => list.length).map(list => list.join("\n")).join("\n\n");
}

function show_scan() {
  const side = at("side"), row = element("div", {className: "row"}, side), update = () => draw();
  at("note").textContent = "Point at the map to read a point; click to keep it, and again to let it go.";
  const which = choice(element("div", {}, side), "colour", Object.entries(data.quantities), update);
  const texts = one => one.texts.map((text, i) => [i, text || "that of least energy"]);
  const choices = data.choices.map(one => choice(element("div", {}, side), one.label, texts(one), update));
  const key = element("canvas", {id: "key"}, side), words = element("pre", {id: "now"}, side);
  const slice = () => new Slice(choices.map(select => Number(select.value)));
  let shown = slice(), last = 0;
  const chart = new Chart(element("canvas", {id: "map"}, at("shape")), (k, keep) => {
    if (keep) chart.kept = k === chart.kept ? null : k, chart.draw(shown, which.value);
    if (k !== null && (keep || chart.kept === null)) last = k, words.textContent = words_of(shown, k);
  });
  button(row, "save picture", "save", () => save([[chart.canvas], [key]], which.value));
  function draw() {
    shown = slice();
    chart.draw(shown, which.value);
    draw_key(key, chart.key(shown, which.value));
    words.textContent = words_of(shown, last);
    document.body.dataset.drawn = `map of ${[...chart.counts, 1].slice(0, 2).join(" x ")}, ${which.value}`;
  }
  window.addEventListener("resize", draw);
  draw();
}

show_scan();

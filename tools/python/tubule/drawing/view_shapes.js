// The page of a run or of equilibria: the body, a slider over its frames, a chart of the series.

class SeriesChart {
  constructor(canvas, choose) {
    this.canvas = canvas, this.near = null;
    const move = e => {
      const [x, y] = place(e, canvas);
      if (!this.axes || !this.axes.inside(x, y)) return;
      if (e.buttons || e.type === "click") choose(this.frames[this.nearest(this.frames, x, y)]);
      this.near = this.points[this.nearest(this.points, x, y)], this.draw(this.now);
    };
    for (const event of ["pointermove", "click"]) canvas.addEventListener(event, move);
    canvas.addEventListener("pointerleave", () => { this.near = null, this.draw(this.now); });
  }

  // A branch may turn back.
  nearest(points, x, y) {
    const {px, py} = this.axes, far = data.along === "time" ? 0 : 1;
    return nearest_of(points.map(p => Math.hypot(px(p.x) - x, far * (py(p.y) - y))), 0);
  }

  set(name, logarithmic, upright) {
    const {time = [], branch = []} = data.series, x = data.series[data.along] || [], y = data.series[name] || [];
    const later = logarithmic ? x.filter(v => v > 0) : [], log_x = later.length > 1;
    const first = log_x ? ends(later)[0] : -Infinity;
    const rows = x.map((v, i) => ({x: Math.max(v, first), y: y[i], branch: branch[i], time: time[i]}));
    this.points = rows.filter(row => row.y !== null && row.y !== undefined);
    const [low, high] = ends(this.points.map(p => p.y)), log_y = upright && low > 0;
    const rim = log_y ? 0 : 0.04 * (high - low);
    this.x = new Axis(ends(this.points.map(p => p.x)), labelled(data.along_words, data.units[data.along]), log_x);
    this.words = name.replace(/_/g, " ");
    this.y = new Axis([low - rim, high + rim], labelled(this.words, data.units[name]), log_y);
    const times = this.points.map(p => p.time), row = frame => this.points[nearest_of(times, frame.time)];
    this.frames = times.length ? data.frames.map((frame, number) => ({...row(frame), number})) : [];
    this.name = name;
  }

  // Frames are dots, that of the page is large.
  draw(now) {
    const {c, width, height} = context(this.canvas);
    this.now = now;
    if (!this.points.length) return;
    const {px, py, top, bottom, left} = this.axes = draw_axes(c, width, height, this.x, this.y);
    c.strokeStyle = c.fillStyle = "#1f5fa8", c.lineWidth = 1.5, c.beginPath();
    const joined = i => i && this.points[i].branch === this.points[i - 1].branch;
    this.points.forEach(({x, y}, i) => joined(i) ? c.lineTo(px(x), py(y)) : c.moveTo(px(x), py(y)));
    c.stroke();
    if (this.frames.length < 200) for (const {x, y} of this.frames) dot(c, px(x), py(y), 2.5);
    const here = this.frames[now];
    c.strokeStyle = c.fillStyle = "#c0392b", c.lineWidth = 1, line(c, px(here.x), top, px(here.x), bottom);
    dot(c, px(here.x), py(here.y), 4.5);
    if (!this.near) return;
    const {x, y} = this.near;
    c.fillStyle = c.strokeStyle = "#222", c.setLineDash([3, 3]);
    line(c, px(x), top, px(x), bottom), dot(c, px(x), py(y), 3);
    const words = `${along_value(x)}, ${this.words} ${measured(y, data.units[this.name], 8)}`;
    c.fillStyle = "#fffd", c.fillRect(left + 4, top + 4, c.measureText(words).width + 8, 18);
    c.fillStyle = "#222", c.textAlign = "left", c.fillText(words, left + 8, top + 17);
    this.canvas.dataset.near = words;
  }
}

// Time or the parameter of a branch.
function along_value(x) { return `${data.along_words} ${measured(x, data.units[data.along])}`; }

// The colour bar and a scale bar of a round length, below the body.
function draw_over(canvas, field, per_unit, words) {
  const {c, width, height} = context(canvas), narrow = width < 560, most = (narrow ? 0.2 : 0.15) * width / per_unit;
  const power = 10 ** Math.floor(Math.log10(most)), length = power * [5, 2, 1].find(x => x * power <= most);
  draw_bar(c, 28, height - 34, Math.min(360, (narrow ? 0.58 : 0.5) * width), field);
  const right = width - 16, left = right - length * per_unit, y = height - 29;
  c.strokeStyle = c.fillStyle = "#222", c.lineWidth = 2, line(c, left, y, right, y);
  c.textAlign = "center", c.fillText(measured(length, data.length_unit), (left + right) / 2, y - 7);
  c.textAlign = "left", c.fillText(words, 12, 20);
  canvas.dataset.bar = `${length} ${right - left}`;
}

function describe_run(home) {
  const list = data.warnings.length ? element("ul", {className: "warning", id: "warnings"}, home) : null;
  for (const textContent of data.warnings) element("li", {textContent}, list);
  for (const [key, value] of Object.entries(data.about))
    element("div", {textContent: `${key.replace(/_/g, " ")}: ${value}`}, home);
  const details = element("details", {}, home);
  element("summary", {textContent: "case"}, details);
  element("pre", {textContent: data.case.join("\n")}, details);
}

// Where the pointer is on the surface, and the value there.
function show_tip(tip, found, where, {symbol, unit}) {
  tip.hidden = !found;
  if (!found) return;
  const [x, y, z] = found.point, profile = data.low.length === 2;
  const words = profile ? [["r", Math.hypot(x, y)], ["z", z]] : [["x", x], ["y", y], ["z", z]];
  const named = (name, value, unit) => `${name} = ${measured(value, unit, 4)}`;
  const position = words.map(([name, value]) => named(name, value, data.length_unit)).join(", ");
  tip.textContent = `${named(symbol, found.value, unit)}\n${position}`;
  tip.style.left = `${Math.max(0, Math.min(where[0] + 14, tip.parentNode.clientWidth - tip.offsetWidth))}px`;
  tip.style.top = `${Math.max(0, where[1] - 44)}px`;
}

// What can be chosen beside the body; `update` is called when something was.
function controls(side, update) {
  const row = element("div", {className: "row", hidden: data.frames.length < 2}, side);
  const buttons = element("div", {className: "row"}, side);
  const play = element("button", {textContent: "play", id: "play"}, row);
  const slider = element("input", {type: "range", id: "time", min: 0, max: data.frames.length - 1, step: 1}, row);
  const colour = choice(element("div", {}, side), "colour", data.fields.map(f => [f.name, f.words]), update);
  const options = element("div", {}, side);
  const copies = tick(options, "three periods", update), flow = tick(options, "velocity", update);
  copies.parentNode.hidden = !data.frames.some(f => f.period > 0), flow.parentNode.hidden = !data.frames.some(f => f.u);
  const names = Object.keys(data.series).filter(name => name !== data.along);
  const meaning = name => data.meanings[name] ? `${name}: ${data.meanings[name]}` : name;
  const which = choice(element("div", {}, side), "series", names.map(name => [name, meaning(name)]), update);
  if (names.includes("energy")) which.value = "energy";
  const scales = element("div", {}, side), logarithmic = tick(scales, `logarithmic ${data.along_words}`, update);
  const upright = tick(scales, "logarithmic series", update);
  let timer = null;
  play.addEventListener("click", () => {
    play.textContent = timer ? "play" : "stop";
    timer = timer ? clearInterval(timer) : setInterval(() => {
      slider.value = (Number(slider.value) + 1) % data.frames.length, update();
    }, 120);
  });
  slider.addEventListener("input", update);
  return {buttons, slider, colour, copies, flow, which, logarithmic, upright};
}

function show_shapes() {
  const home = at("shape"), side = at("side"), body_canvas = element("canvas", {id: "body"}, home);
  const over = element("canvas", {id: "over"}, home);
  const tip = element("div", {id: "tip", hidden: true}, home), chosen = controls(side, () => draw());
  const field = () => data.fields.find(f => f.name === chosen.colour.value), number = () => Number(chosen.slider.value);
  const body = new Body(body_canvas, 62, (found, where) => show_tip(tip, found, where, field()), () => turned());
  const missing = "The surface cannot be drawn: this browser has no WebGL 2, or it is switched off.";
  if (!body.gl) element("div", {className: "missing", textContent: missing}, home);
  at("note").textContent = `Positions are rounded to ${measured(data.rounding, data.length_unit, 2)}. Drag to turn, with Shift or two ` +
    "fingers to move; scroll or pinch to zoom; click the chart to go there.";
  const wanted = Number(location.hash.slice(1)) || 1;  // page.html#3 begins with frame 3
  chosen.slider.value = Math.min(wanted, data.frames.length) - 1;
  const value = frame => data.along === "parameter" && frame.parameter !== null ? frame.parameter : frame.time;
  const choose = frame => { chosen.slider.value = frame.number, draw(); };
  const chart = new SeriesChart(element("canvas", {id: "plot"}, side), choose);
  button(chosen.buttons, "reset view", "reset", () => { body.reset(), turned(); });
  button(chosen.buttons, "save picture", "save", () => save([[body_canvas, over]], `frame_${number() + 1}`));
  button(chosen.buttons, "save chart", "save_chart", () => {
    chart.near = null, chart.draw(chart.now), save([[chart.canvas]], chart.name);
  });
  body_canvas.addEventListener("dblclick", () => { body.reset(), turned(); });
  describe_run(side);
  window.addEventListener("resize", () => draw());
  const which_frame = () => `frame ${number() + 1} of ${data.frames.length}`;
  function turned() {
    body.draw();
    const now = along_value(value(data.frames[number()]));
    draw_over(over, field(), body.per_unit, `${now}, ${which_frame()}`);
  }
  function draw() {
    const frame = data.frames[number()], copies = chosen.copies.checked ? 3 : 1;
    const triangles = body.show(frame, field(), copies, chosen.flow.checked);
    turned();
    chart.set(chosen.which.value, chosen.logarithmic.checked, chosen.upright.checked);
    chart.draw(number());
    document.body.dataset.drawn = `${which_frame()}, ${triangles} triangles, ${field().name}`;
  }
  draw();
}

show_shapes();

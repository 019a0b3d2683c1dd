// The page of `tubule view`: a surface that turns under the mouse, a slider over its frames tied to a plot of the
// series; or the map of a scan. All data are in the element #data, written by view.py.
"use strict";

const data = JSON.parse(document.getElementById("data").textContent);
const at = id => document.getElementById(id);
const steps = 65535;
const around = 96;  // points around the axis of a surface of revolution

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

function short(x) {
  if (x === null || x === undefined) return "-";
  return x !== 0 && Math.abs(x) < 1e-3 ? x.toExponential(2) : String(Number(x.toPrecision(6)));
}

// A canvas as sharp as the screen, its context in CSS pixels.
function context(canvas) {
  const box = canvas.getBoundingClientRect(), ratio = window.devicePixelRatio || 1;
  canvas.width = Math.max(1, box.width * ratio), canvas.height = Math.max(1, box.height * ratio);
  const c = canvas.getContext("2d");
  c.scale(ratio, ratio);
  c.font = "12px sans-serif";
  return {c, width: box.width, height: box.height};
}

// Points [n, 3] and triangles of a frame, which repeats its period `copies` times.
function surface(frame) {
  const columns = frame.points.map((text, i) => unpacked(text, data.low[i], data.high[i]));
  return frame.mesh === null ? revolved(columns) : meshed(columns, frame.mesh);
}

function meshed(columns, mesh) {
  const n = columns[0].length, points = new Float32Array(3 * n);
  for (let i = 0; i < n; ++i) for (let d = 0; d < 3; ++d) points[3 * i + d] = columns[d][i];
  return {points, triangles: new Uint32Array(bytes(data.meshes[mesh])), of: i => i, count: n};
}

// The point i around + j has the values of point i of the profile.
function revolved([r, z]) {
  const n = r.length, points = new Float32Array(3 * n * around), triangles = new Uint32Array(6 * (n - 1) * around);
  for (let i = 0; i < n; ++i)
    for (let j = 0; j < around; ++j) {
      const angle = 2 * Math.PI * j / around;
      points.set([r[i] * Math.cos(angle), r[i] * Math.sin(angle), z[i]], 3 * (i * around + j));
    }
  for (let i = 0, t = 0; i + 1 < n; ++i)
    for (let j = 0; j < around; ++j, t += 6) {
      const a = i * around + j, b = i * around + (j + 1) % around;
      triangles.set([a, b, a + around, b, b + around, a + around], t);
    }
  return {points, triangles, of: k => Math.floor(k / around), count: n * around};
}

function coloured(frame, field, shape) {
  const values = unpacked(frame.fields[field.name], field.low, field.high), table = new Uint8Array(bytes(field.colours));
  const [low, high] = field.shown, out = new Float32Array(3 * shape.count);
  for (let k = 0; k < shape.count; ++k) {
    const part = (values[shape.of(k)] - low) / (high - low), i = Math.round(255 * Math.min(1, Math.max(0, part)));
    for (let d = 0; d < 3; ++d) out[3 * k + d] = table[3 * i + d] / 255;
  }
  return out;
}

// Lines from nodes along the velocity, the longest a fifth of the size.
function arrows(frame, shape, size) {
  const u = frame.u.map(text => unpacked(text, -data.fastest, data.fastest));
  const every = Math.max(1, Math.round(shape.count / 600)), scale = 0.2 * size / data.fastest, ends = [];
  for (let i = 0; i < shape.count; i += every) {
    const x = [0, 1, 2].map(d => shape.points[3 * i + d]);
    ends.push(...x, ...x.map((value, d) => value + scale * u[d][i]));
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(ends), 3));
  return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({color: 0x222222}));
}

class Scene {
  constructor(home) {
    this.home = home;
    this.renderer = new THREE.WebGLRenderer({antialias: true, preserveDrawingBuffer: true});
    this.renderer.setClearColor(0xffffff);
    home.appendChild(this.renderer.domElement);
    this.scene = new THREE.Scene();
    this.camera = new THREE.OrthographicCamera(-1, 1, 1, -1, -100, 100);
    this.camera.add(new THREE.DirectionalLight(0xffffff, 0.55));
    this.camera.children[0].position.set(-0.42, 0.5, 0.757);
    this.scene.add(this.camera, new THREE.AmbientLight(0xffffff, 0.6));
    this.turned = new THREE.Group();
    this.turned.rotation.set(-Math.PI / 2 + 0.38, 0, 0.6, "XYZ");
    this.scene.add(this.turned);
    this.zoom = 1;
    this.listen();
  }

  listen() {
    let last = null;
    const turn = (dx, dy) => {
      const by = new THREE.Quaternion().setFromEuler(new THREE.Euler(0.01 * dy, 0.01 * dx, 0));
      this.turned.quaternion.premultiply(by);
      this.draw();
    };
    this.home.addEventListener("pointerdown", e => { last = [e.clientX, e.clientY]; });
    window.addEventListener("pointerup", () => { last = null; });
    window.addEventListener("pointermove", e => {
      if (!last) return;
      turn(e.clientX - last[0], e.clientY - last[1]);
      last = [e.clientX, e.clientY];
    });
    this.home.addEventListener("wheel", e => {
      e.preventDefault();
      this.zoom = Math.min(20, Math.max(0.2, this.zoom * Math.exp(-0.001 * e.deltaY)));
      this.draw();
    }, {passive: false});
    window.addEventListener("resize", () => this.draw());
  }

  show(frame, field, copies, with_arrows) {
    for (const old of [...this.turned.children]) {
      this.turned.remove(old);
      old.geometry.dispose(), old.material.dispose();
    }
    const shape = surface(frame), geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(shape.points, 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(coloured(frame, field, shape), 3));
    geometry.setIndex(new THREE.BufferAttribute(shape.triangles, 1));
    geometry.computeVertexNormals();
    const many = frame.period > 0 ? copies : 1, middle = extent();
    for (let i = 0; i < many; ++i) {
      const material = new THREE.MeshPhongMaterial(
        {vertexColors: THREE.VertexColors, side: THREE.DoubleSide, shininess: 8, specular: 0x111111});
      const parts = [new THREE.Mesh(geometry, material)];
      if (with_arrows && frame.u) parts.push(arrows(frame, shape, middle.size));
      for (const part of parts) {
        part.position.set(...middle.centre.map(x => -x));
        part.position.z += (i - (many - 1) / 2) * frame.period;
        this.turned.add(part);
      }
    }
    this.size = middle.size + (many - 1) * frame.period;
    this.draw();
    return shape.triangles.length / 3 * many;
  }

  draw() {
    const {clientWidth: width, clientHeight: height} = this.home;
    this.renderer.setPixelRatio(window.devicePixelRatio || 1);
    this.renderer.setSize(width, height);
    const half = 0.6 * this.size / this.zoom / Math.min(1, width / height);
    Object.assign(this.camera, {left: -half * width / height, right: half * width / height, top: half, bottom: -half,
                                near: -100 * half, far: 100 * half});
    this.camera.updateProjectionMatrix();
    this.renderer.render(this.scene, this.camera);
  }
}

// Covers all frames, so that the size on the screen does not change with time.
function extent() {
  const profile = data.low.length === 2, reach = profile ? data.high[0] : 0;
  const low = profile ? [-reach, -reach, data.low[1]] : data.low, high = profile ? [reach, reach, data.high[1]] : data.high;
  return {centre: low.map((x, d) => (x + high[d]) / 2), size: Math.hypot(...low.map((x, d) => high[d] - x))};
}

class Plot {
  constructor(canvas, choose) {
    this.canvas = canvas;
    canvas.addEventListener("click", e => {
      const box = canvas.getBoundingClientRect();
      choose(this.along(e.clientX - box.left));
    });
  }

  set(name, logarithmic) {
    const x = data.series[data.along] || [], y = data.series[name] || [];
    const branch = data.series.branch || [];
    this.points = x.map((value, i) => [value, y[i], branch[i]]).filter(([a, b]) => a !== null && b !== null);
    const later = this.points.map(p => p[0]).filter(a => a > 0);
    this.logarithmic = logarithmic && later.length > 1;
    if (this.logarithmic) this.first = Math.min(...later);
  }

  scaled(x) { return this.logarithmic ? Math.log10(Math.max(x, this.first)) : x; }

  along(px) {
    const part = (px - this.left) / (this.right - this.left), value = this.low[0] + part * (this.high[0] - this.low[0]);
    return this.logarithmic ? 10 ** value : value;
  }

  draw(now) {
    const {c, width, height} = context(this.canvas);
    const xs = this.points.map(p => this.scaled(p[0])), ys = this.points.map(p => p[1]);
    if (!xs.length) return;
    const ends = v => { let a = Math.min(...v), b = Math.max(...v); return a < b ? [a, b] : [a - 0.5, b + 0.5]; };
    const [[x0, x1], [y0, y1]] = [ends(xs), ends(ys)];
    this.low = [x0, y0], this.high = [x1, y1];
    this.left = 70, this.right = width - 10;
    const top = 10, bottom = height - 30;
    const px = x => this.left + (x - x0) / (x1 - x0) * (this.right - this.left), py = y => bottom - (y - y0) / (y1 - y0) * (bottom - top);
    c.strokeStyle = "#888", c.strokeRect(this.left, top, this.right - this.left, bottom - top);
    c.fillStyle = "#222", c.textAlign = "right";
    for (const y of [y0, (y0 + y1) / 2, y1]) c.fillText(short(y), this.left - 4, py(y) + 4);
    c.textAlign = "center";
    for (const x of [x0, (x0 + x1) / 2, x1]) c.fillText(short(this.logarithmic ? 10 ** x : x), Math.min(px(x), width - 28), height - 14);
    c.fillText(data.along_words + (this.logarithmic ? " (logarithmic)" : ""), (this.left + this.right) / 2, height - 3);
    c.strokeStyle = "#1f5fa8", c.lineWidth = 1.5, c.beginPath();
    const joined = i => i && this.points[i][2] === this.points[i - 1][2];
    xs.forEach((x, i) => joined(i) ? c.lineTo(px(x), py(ys[i])) : c.moveTo(px(x), py(ys[i])));
    c.stroke();
    c.strokeStyle = "#c0392b", c.lineWidth = 1, c.beginPath();
    c.moveTo(px(this.scaled(now)), top), c.lineTo(px(this.scaled(now)), bottom), c.stroke();
  }
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

function describe_run(home) {
  for (const [key, value] of Object.entries(data.about))
    element("div", {textContent: `${key.replace(/_/g, " ")}: ${value}`, className: key === "warnings" ? "warning" : ""}, home);
  const details = element("details", {}, home);
  element("summary", {textContent: "case"}, details);
  element("pre", {textContent: data.case.join("\n")}, details);
}

function legend(home, field) {
  home.textContent = "";
  element("div", {textContent: field.words}, home);
  const canvas = element("canvas", {width: 256, height: 12}, home), c = canvas.getContext("2d");
  const table = new Uint8Array(bytes(field.colours));
  for (let i = 0; i < 256; ++i) {
    c.fillStyle = `rgb(${table[3 * i]}, ${table[3 * i + 1]}, ${table[3 * i + 2]})`;
    c.fillRect(i, 0, 1, 12);
  }
  element("div", {textContent: `${short(field.shown[0])} ... ${short(field.shown[1])}, at all times`}, home);
}

function show_shapes() {
  const side = at("side"), scale = element("div", {id: "scale"}, at("shape")), scene = new Scene(at("shape"));
  at("note").textContent = `Positions are rounded to ${short(data.rounding)}. Drag to turn, scroll to zoom, click the plot to go there.`;
  const controls = element("div", {}, side), words = element("div", {id: "now"}, side);
  const slider = element("input", {type: "range", id: "time", min: 0, max: data.frames.length - 1, step: 1}, controls);
  const wanted = Number(location.hash.slice(1)) || data.frames.length;  // page.html#3 begins with frame 3
  slider.value = Math.min(wanted, data.frames.length) - 1;
  const play = element("button", {textContent: "play"}, controls);
  const update = () => draw();
  const colour = choice(element("div", {}, side), "colour", data.fields.map(f => [f.name, f.words]), update);
  const options = element("div", {}, side), copies = tick(options, "three periods", update), flow = tick(options, "velocity", update);
  copies.parentNode.hidden = !data.frames.some(f => f.period > 0), flow.parentNode.hidden = !data.frames.some(f => f.u);
  const names = Object.keys(data.series).filter(name => name !== data.along);
  const which = choice(side, "series", names.map(name => [name, data.meanings[name] ? `${name}: ${data.meanings[name]}` : name]), update);
  which.style.maxWidth = "80%";
  if (names.includes("energy")) which.value = "energy";
  const logarithmic = tick(element("div", {}, side), `logarithmic ${data.along_words}`, update);
  const value = frame => data.along === "parameter" && frame.parameter !== null ? frame.parameter : frame.time;
  const nearest = x => data.frames.reduce((best, f, i) => Math.abs(value(f) - x) < Math.abs(value(data.frames[best]) - x) ? i : best, 0);
  const plot = new Plot(element("canvas", {id: "plot"}, side), x => { slider.value = nearest(x); draw(); });
  describe_run(side);
  let timer = null;
  play.addEventListener("click", () => {
    play.textContent = timer ? "play" : "stop";
    timer = timer ? clearInterval(timer) : setInterval(() => { slider.value = (Number(slider.value) + 1) % data.frames.length; draw(); }, 120);
  });
  slider.addEventListener("input", update);
  window.addEventListener("resize", update);
  function draw() {
    const i = Number(slider.value), frame = data.frames[i], field = data.fields.find(f => f.name === colour.value);
    const triangles = scene.show(frame, field, copies.checked ? 3 : 1, flow.checked);
    legend(scale, field);
    words.textContent = `${data.along_words} ${short(value(frame))}, frame ${i + 1} of ${data.frames.length}`;
    plot.set(which.value, logarithmic.checked);
    plot.draw(value(frame));
    document.body.dataset.drawn = `frame ${i + 1} of ${data.frames.length}, ${triangles} triangles, ${field.name}`;
  }
  draw();
}

class Chart {
  constructor(home, show) {
    this.canvas = element("canvas", {id: "map"}, home);
    this.counts = data.axes.map(axis => axis.texts.length);
    if (this.counts.length === 1) this.counts.push(1);
    this.canvas.addEventListener("pointermove", e => show(this.point(e)));
    this.canvas.addEventListener("click", e => show(this.point(e), true));
  }

  point(e) {
    const box = this.canvas.getBoundingClientRect(), [n, m] = this.counts;
    const i = Math.floor((e.clientX - box.left - this.left) / this.wide * n), j = m - 1 - Math.floor((e.clientY - box.top - 10) / this.tall * m);
    return i >= 0 && i < n && j >= 0 && j < m ? i * m + j : null;
  }

  colour(name, k) {
    const value = data.points[name][k];
    if (value === null) return "#fff";
    if (name === "outcome") return data.outcome_colours[value];
    const [low, high] = this.ends(name), i = Math.round(255 * (high > low ? (value - low) / (high - low) : 0.5));
    const table = this.table || (this.table = new Uint8Array(bytes(data.colours)));
    return `rgb(${table[3 * i]}, ${table[3 * i + 1]}, ${table[3 * i + 2]})`;
  }

  ends(name) {
    const known = data.points[name].filter(x => x !== null);
    return [Math.min(...known), Math.max(...known)];
  }

  draw(name) {
    const {c, width, height} = context(this.canvas), [n, m] = this.counts;
    this.left = 80, this.wide = width - 100, this.tall = height - 60;
    for (let k = 0; k < n * m; ++k) {
      const i = Math.floor(k / m), j = k % m, x = this.left + i * this.wide / n, y = 10 + (m - 1 - j) * this.tall / m;
      c.fillStyle = this.colour(name, k);
      c.fillRect(x, y, this.wide / n + 0.5, this.tall / m + 0.5);
    }
    c.fillStyle = "#222", c.textAlign = "center";
    const [first, second] = data.axes, last = list => list[list.length - 1];
    c.fillText(first.texts[0], this.left, height - 32), c.fillText(last(first.texts), this.left + this.wide, height - 32);
    c.fillText(first.label, this.left + this.wide / 2, height - 14);
    if (!second) return;
    c.textAlign = "right";
    c.fillText(second.texts[0], this.left - 6, 10 + this.tall), c.fillText(last(second.texts), this.left - 6, 20);
    c.save(), c.translate(14, 10 + this.tall / 2), c.rotate(-Math.PI / 2), c.textAlign = "center";
    c.fillText(second.label, 0, 0), c.restore();
  }
}

function show_scan() {
  const side = at("side");
  at("note").textContent = "Point at the map to read a point, click to keep it.";
  const names = Object.keys(data.points), which = choice(side, "colour", names.map(x => [x, x]), () => draw());
  which.value = "outcome";
  const key = element("div", {}, side), words = element("pre", {id: "now"}, side);
  let kept = false;
  const chart = new Chart(at("shape"), (k, keep) => {
    if (k === null || (kept && !keep)) return;
    kept = kept || Boolean(keep);
    words.textContent = words_of(k);
  });
  function words_of(k) {
    const m = chart.counts[1], indices = [Math.floor(k / m), k % m], sets = [];
    data.axes.forEach((axis, i) => axis.key.split(", ").forEach((name, j) =>
      sets.push(`${name}=${axis.texts[indices[i]].split(", ")[j]}`)));
    const values = names.map(name => `${name}: ${data.names[name] ? data.names[name][data.points[name][k]] : short(data.points[name][k])}`);
    return `${values.join("\n")}\n\n${[...data.command, ...sets.map(s => "--set " + s)].join(" ")}`;
  }
  function draw() {
    chart.draw(which.value);
    key.textContent = "";
    if (which.value !== "outcome") key.textContent = chart.ends(which.value).map(short).join(" ... ");
    else for (const k of [...new Set(data.points.outcome)].filter(x => x !== null)) {
      const line = element("div", {textContent: " " + data.names.outcome[k]}, key), box = element("span");
      Object.assign(box.style, {display: "inline-block", width: "1em", height: "1em", background: data.outcome_colours[k], border: "1px solid #888"});
      line.prepend(box);
    }
    document.body.dataset.drawn = `map of ${chart.counts[0]} x ${chart.counts[1]}, ${which.value}`;
  }
  window.addEventListener("resize", draw);
  words.textContent = words_of(0);
  draw();
}

at("title").textContent = data.title;
at("file").textContent = data.file;
data.kind === "scan" ? show_scan() : show_shapes();

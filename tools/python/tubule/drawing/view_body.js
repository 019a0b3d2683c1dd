// A surface that turns under the mouse or a finger, drawn by WebGL 2 with the colours of `tubule plot`.

const around = 96;  // points around the axis of a surface of revolution

const vertex_program = `#version 300 es
in vec3 position, normal;
in float value;
uniform mat3 turn;
uniform vec3 offset, scale, shift;
out vec3 across;
out float part;
void main() {
  across = turn * normal;
  part = value;
  gl_Position = vec4(turn * (position + offset) * scale + shift, 1.0);
}`;
const pixel_program = `#version 300 es
precision highp float;
in vec3 across;
in float part;
uniform sampler2D colours;
uniform float rim;
uniform bool line;
out vec4 colour;
void main() {
  vec3 n = normalize(across) * (gl_FrontFacing ? 1.0 : -1.0), rgb = texture(colours, vec2(part, 0.5)).rgb;
  rgb = gl_FrontFacing ? rgb : 0.26 * rgb + 0.24;  // paler inside, and darker
  rgb *= 1.0 - rim * pow(1.0 - clamp(n.z, 0.0, 1.0), 4.0);
  colour = vec4(line ? vec3(0.13) : rgb, 1);
}`;

// Points [n, 3] and triangles of a frame, seen from outside counter-clockwise; `of` the number of a point's value.
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

// Sums of the normals of the triangles at each point.
function normals({points, triangles}) {
  const out = new Float32Array(points.length);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [0, 1, 2].map(k => 3 * triangles[t + k]);
    const [ux, uy, uz, vx, vy, vz] = [b, c].flatMap(e => [0, 1, 2].map(d => points[e + d] - points[a + d]));
    const n = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    for (const e of [a, b, c]) for (let d = 0; d < 3; ++d) out[e + d] += n[d];
  }
  return out;
}

// Ends of lines from nodes along the velocity, the longest a fifth of the size.
function arrows(frame, shape, size) {
  const u = frame.u.map(text => unpacked(text, -data.fastest, data.fastest));
  const every = Math.max(1, Math.round(shape.count / 600)), scale = 0.2 * size / data.fastest, ways = [];
  for (let i = 0; i < shape.count; i += every) {
    const x = [0, 1, 2].map(d => shape.points[3 * i + d]);
    ways.push(...x, ...x.map((value, d) => value + scale * u[d][i]));
  }
  return new Float32Array(ways);
}

// Covers all frames, so that the size on the screen does not change with time.
function extent() {
  const {low, high} = data, profile = low.length === 2, middle = low.map((x, d) => (x + high[d]) / 2);
  const sides = profile ? [2 * high[0], high[1] - low[1]] : low.map((x, d) => high[d] - x);
  return {centre: profile ? [0, 0, middle[1]] : middle, size: Math.hypot(...sides)};
}

// a b of matrices with three rows.
const product = (a, b) => a.map(row => [0, 1, 2].map(k => row.reduce((sum, x, i) => sum + x * b[i][k], 0)));

class Body {
  constructor(canvas, foot, hover, changed) {
    Object.assign(this, {canvas, foot, hover, changed, extent: extent()});
    this.gl = canvas.getContext("webgl2", {antialias: true, preserveDrawingBuffer: true});
    if (!this.gl) return;
    this.program = this.compiled();
    this.buffers = {};
    for (const name of ["position", "normal", "value", "lines", "triangles"])
      this.buffers[name] = this.gl.createBuffer();
    this.gl.bindTexture(this.gl.TEXTURE_2D, this.gl.createTexture());
    this.reset();
    this.listen();
  }

  compiled() {
    const {gl} = this, program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex_program], [gl.FRAGMENT_SHADER, pixel_program]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text), gl.compileShader(shader), gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    gl.useProgram(program), gl.enable(gl.DEPTH_TEST), gl.clearColor(1, 1, 1, 1);
    return program;
  }

  // As in print.
  reset() { Object.assign(this, {turn: data.view, zoom: 1, pan: [0, 0]}); }

  turned(dx, dy) {
    const [ca, sa, cb, sb] = [0.01 * dx, 0.01 * dy].flatMap(angle => [Math.cos(angle), Math.sin(angle)]);
    const y = [[ca, 0, sa], [0, 1, 0], [-sa, 0, ca]], x = [[1, 0, 0], [0, cb, -sb], [0, sb, cb]];
    this.turn = product(x, product(y, this.turn));
  }

  zoomed(factor) { this.zoom = Math.min(50, Math.max(0.2, this.zoom * factor)); }

  panned(dx, dy) { this.pan = [this.pan[0] + dx / this.per_unit, this.pan[1] - dy / this.per_unit]; }

  // One finger or button turns, two fingers or Shift move, two fingers or the wheel zoom.
  listen() {
    const {canvas} = this, fingers = new Map();
    const apart = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
    canvas.addEventListener("pointerdown", e => {
      canvas.setPointerCapture(e.pointerId), fingers.set(e.pointerId, place(e, canvas)), this.hover(null);
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, e => fingers.delete(e.pointerId));
    canvas.addEventListener("pointerleave", () => this.hover(null));
    canvas.addEventListener("pointermove", e => {
      const now = place(e, canvas), before = fingers.get(e.pointerId);
      if (!before) return this.hover(this.picked(...now), now);
      const [dx, dy] = [now[0] - before[0], now[1] - before[1]], distance = fingers.size === 2 ? apart() : 0;
      fingers.set(e.pointerId, now);
      if (distance) this.zoomed(apart() / distance), this.panned(dx / 2, dy / 2);
      else if (e.shiftKey) this.panned(dx, dy);
      else if (fingers.size === 1) this.turned(dx, dy);
      this.changed();
    });
    canvas.addEventListener("wheel", e => {
      e.preventDefault(), this.zoomed(Math.exp(-0.001 * e.deltaY)), this.changed();
    }, {passive: false});
  }

  filled(name, values, target = this.gl.ARRAY_BUFFER) {
    this.gl.bindBuffer(target, this.buffers[name]), this.gl.bufferData(target, values, this.gl.DYNAMIC_DRAW);
  }

  // Takes a frame, which repeats its period `copies` times; the number of triangles.
  show(frame, field, copies, with_arrows) {
    const {gl} = this, shape = surface(frame), [low, high] = field.shown, many = frame.period > 0 ? copies : 1;
    const values = unpacked(frame.fields[field.name], field.low, field.high);
    const lines = with_arrows && frame.u ? arrows(frame, shape, this.extent.size) : new Float32Array();
    const [x, y, z] = this.extent.centre, size = this.extent.size + (many - 1) * frame.period;
    const offsets = Array.from({length: many}, (_, i) => [-x, -y, (i - (many - 1) / 2) * frame.period - z]);
    Object.assign(this, {shape, values, lines: lines.length / 3, size, offsets});
    if (gl) {
      this.filled("position", shape.points), this.filled("normal", normals(shape)), this.filled("lines", lines);
      const part = k => (values[shape.of(k)] - low) / (high - low);
      this.filled("value", Float32Array.from({length: shape.count}, (_, k) => part(k)));
      this.filled("triangles", shape.triangles, gl.ELEMENT_ARRAY_BUFFER);
      gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
      const table = new Uint8Array(bytes(field.colours));
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, 256, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, table);
      const exact = {MIN_FILTER: gl.NEAREST, MAG_FILTER: gl.NEAREST, WRAP_S: gl.CLAMP_TO_EDGE,
                     WRAP_T: gl.CLAMP_TO_EDGE};
      for (const name in exact) gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_${name}`], exact[name]);
    }
    return shape.triangles.length / 3 * many;
  }

  attribute(name, size, buffer = name) {
    const {gl} = this, where = gl.getAttribLocation(this.program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[buffer]), gl.enableVertexAttribArray(where);
    gl.vertexAttribPointer(where, size, gl.FLOAT, false, 0, 0);
  }

  // Above `foot` pixels for the colour bar.
  draw() {
    const {gl, canvas, pan} = this, width = canvas.clientWidth, height = Math.max(1, canvas.clientHeight - this.foot);
    const ratio = window.devicePixelRatio || 1;
    this.per_unit = this.zoom * Math.min(width, height) / (1.02 * this.size);
    if (!gl) return;
    canvas.width = Math.round(width * ratio), canvas.height = Math.round(canvas.clientHeight * ratio);
    gl.viewport(0, Math.round(this.foot * ratio), canvas.width, Math.round(height * ratio));
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const at = name => gl.getUniformLocation(this.program, name);
    const [sx, sy] = [2 * this.per_unit / width, 2 * this.per_unit / height];
    gl.uniformMatrix3fv(at("turn"), true, this.turn.flat()), gl.uniform1f(at("rim"), data.rim);
    gl.uniform3f(at("scale"), sx, sy, -0.5 / this.size), gl.uniform3f(at("shift"), sx * pan[0], sy * pan[1], 0);
    for (const offset of this.offsets) {
      gl.uniform3fv(at("offset"), offset), gl.uniform1i(at("line"), 0);
      this.attribute("position", 3), this.attribute("normal", 3), this.attribute("value", 1);
      gl.drawElements(gl.TRIANGLES, this.shape.triangles.length, gl.UNSIGNED_INT, 0);
      if (!this.lines) continue;
      gl.uniform1i(at("line"), 1), this.attribute("position", 3, "lines");
      for (const name of ["normal", "value"]) gl.disableVertexAttribArray(gl.getAttribLocation(this.program, name));
      gl.drawArrays(gl.LINES, 0, this.lines);
    }
  }

  // The value and the place of the surface at a pixel, or null.
  picked(x, y) {
    const {points, triangles, of} = this.shape, [right, up, eye] = this.turn, {per_unit, pan, canvas} = this;
    const px = (x - canvas.clientWidth / 2) / per_unit - pan[0];
    const py = ((canvas.clientHeight - this.foot) / 2 - y) / per_unit - pan[1];
    const along = ([a, b, c], k, array = points) => a * array[k] + b * array[k + 1] + c * array[k + 2];
    let best = null;
    for (const offset of this.offsets) {
      const [x0, y0, far] = [px - along(right, 0, offset), py - along(up, 0, offset), along(eye, 0, offset)];
      for (let t = 0; t < triangles.length; t += 3) {
        const k = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
        const u = k.map(e => along(right, e) - x0), v = k.map(e => along(up, e) - y0);
        const w = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        const sum = w[0] + w[1] + w[2];
        if (sum === 0 || w.some(part => part / sum < 0)) continue;
        const mean = f => w.reduce((total, part, i) => total + part / sum * f(k[i]), 0);
        const depth = mean(e => along(eye, e)) + far;
        if (best && depth <= best.depth) continue;
        best = {depth, value: mean(e => this.values[of(e / 3)]), point: [0, 1, 2].map(d => mean(e => points[e + d]))};
      }
    }
    return best;
  }
}

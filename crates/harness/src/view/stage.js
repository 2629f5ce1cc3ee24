"use strict";
// The body on a canvas: a soup of triangles, seen without perspective, and its axes.

const VERTEX = `#version 300 es
in vec3 place; in float value;
uniform mat3 turn; uniform vec3 centre; uniform vec2 extent; uniform float depth;
out vec3 seen; out float level;
void main() {
  seen = turn * (place - centre);
  level = value;
  gl_Position = vec4(seen.xy / extent, -seen.z / depth, 1.0);
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 seen; in float level;
uniform sampler2D colours; uniform vec2 range; uniform vec3 plain; uniform bool flat_, lit;
out vec4 colour;
void main() {
  vec3 own = flat_ ? plain : texture(colours, vec2(clamp((level - range.x) / (range.y - range.x), 0.002, 0.998), 0.5)).rgb;
  if (lit) {
    vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
    own *= 0.5 + 0.5 * abs(dot(normal, normalize(vec3(-0.35, 0.5, 0.8))));
  }
  colour = vec4(own, 1.0);
}`;

// margins of a plane body's axes, px
const LEFT = 56, BELOW = 40, ABOVE = 10, RIGHT = 14;

const svg = (tag, attributes, text) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const name in attributes) element.setAttribute(name, attributes[name]);
  if (text !== undefined) element.textContent = text;
  return element;
};

const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

// round numbers within an interval, about `many` of them
function ticks(low, high, many) {
  const rough = (high - low) / Math.max(many, 1), power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * power).find((k) => k >= rough * 0.999) ?? 10 * power;
  const list = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step && list.length < 100; k++) {
    list.push(k * step);
  }
  return list;
}

const SUPER = "⁰¹²³⁴⁵⁶⁷⁸⁹";
const raised = (n) => (n < 0 ? "⁻" : "") + [...String(Math.abs(n))].map((digit) => SUPER[digit]).join("");

// six digits at most; powers of ten where zeros would hide them
function number(x, digits = 4) {
  if (x === null || x === undefined || Number.isNaN(x)) return "–";
  const size = Math.abs(x);
  if (x === 0 || size >= 1e-3 && size < 1e5) return String(+x.toPrecision(digits)).replace("-", "−");
  const [mantissa, power] = x.toExponential(digits - 1).split("e");
  const short = String(+mantissa).replace("-", "−");
  return short === "1" ? `10${raised(+power)}` : `${short}·10${raised(+power)}`;
}

class Stage {
  constructor(element, canvas, axes) {
    Object.assign(this, { element, canvas, axes, meshes: [], plane: true, box: [[0, 1], [0, 1], [0, 1]], unit: "" });
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("this browser cannot draw bodies (it has no WebGL 2)");
    this.gl = gl;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    gl.useProgram(program);
    gl.enable(gl.DEPTH_TEST);
    const names = ["turn", "centre", "extent", "depth", "range", "plain", "flat_", "lit"];
    this.at = Object.fromEntries(names.map((name) => [name, gl.getUniformLocation(program, name)]));
    this.inputs = ["place", "value"].map((name) => gl.getAttribLocation(program, name));
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    for (const name of ["MIN_FILTER", "MAG_FILTER"]) gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_${name}`], gl.LINEAR);
    for (const name of ["WRAP_S", "WRAP_T"]) gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_${name}`], gl.CLAMP_TO_EDGE);
    this.listen();
    new ResizeObserver(() => this.render()).observe(element);
  }

  // soups of triangles: coloured ones, then grey ones
  show(soups, { range, colours, plain }) {
    const { gl } = this;
    const middle = this.middle = this.box.map(([low, high]) => 0.5 * (low + high));
    for (const mesh of this.meshes) gl.deleteBuffer(mesh.buffer);
    this.meshes = soups.map((soup, k) => {
      const data = new Float32Array(4 * soup.i.length * 3);
      let at = 0;
      for (let triangle = 0; triangle < soup.i.length; triangle++) {
        for (const v of [soup.i[triangle], soup.j[triangle], soup.k[triangle]]) {
          data[at++] = soup.x[v] - middle[0];
          data[at++] = soup.y[v] - middle[1];
          data[at++] = soup.z[v] - middle[2];
          data[at++] = k === 0 ? soup.intensity[v] : 0;
        }
      }
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      return { data, buffer, count: 3 * soup.i.length, plain: k === 1 || !range };
    });
    Object.assign(this, { range: range ?? [0, 1], plain });
    const stops = (colours ?? ["#888888", "#888888"]).map(rgb), pixels = new Uint8Array(4 * 256);
    for (let k = 0; k < 256; k++) {
      const place = k / 255 * (stops.length - 1), first = Math.min(Math.floor(place), stops.length - 2);
      for (let c = 0; c < 3; c++) {
        pixels[4 * k + c] = 255 * (stops[first][c] + (place - first) * (stops[first + 1][c] - stops[first][c]));
      }
      pixels[4 * k + 3] = 255;
    }
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    this.render();
  }

  // the whole body from in front of its plane, or from the side
  reset() {
    [this.azimuth, this.elevation] = this.plane ? [-Math.PI / 2, Math.PI / 2] : [-0.99, 0.43];
    this.centre = [0, 0, 0];
    this.zoom = 1;
    this.render();
  }

  turn() {
    const [ca, sa, ce, se] = [Math.cos(this.azimuth), Math.sin(this.azimuth), Math.cos(this.elevation), Math.sin(this.elevation)];
    return [[-sa, ca, 0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]];
  }

  // the part of the canvas for the body, px
  area() {
    const { clientWidth: width, clientHeight: height } = this.element;
    return this.plane
      ? { left: LEFT, top: ABOVE, width: Math.max(width - LEFT - RIGHT, 1), height: Math.max(height - ABOVE - BELOW, 1) }
      : { left: 0, top: 0, width: Math.max(width, 1), height: Math.max(height, 1) };
  }

  // pixels of a unit of length
  scale(area = this.area()) {
    const rows = this.turn(), half = this.box.map(([low, high]) => 0.5 * (high - low));
    const reach = [0, 1].map((k) => rows[k].reduce((sum, x, d) => sum + Math.abs(x) * half[d], 0) || 1e-12);
    return this.zoom * 0.48 * Math.min(area.width / reach[0], area.height / reach[1]);
  }

  render() {
    const { gl, canvas, element } = this;
    if (!this.centre || !element.clientWidth) return;
    const ratio = window.devicePixelRatio || 1, area = this.area(), scale = this.scale(area), rows = this.turn();
    const [width, height] = [element.clientWidth, element.clientHeight].map((x) => Math.round(x * ratio));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const below = element.clientHeight - area.top - area.height;
    gl.viewport(...[area.left, below, area.width, area.height].map((x) => x * ratio));
    const size = Math.hypot(...this.box.map(([low, high]) => high - low)) || 1;
    gl.uniformMatrix3fv(this.at.turn, true, rows.flat());
    gl.uniform3fv(this.at.centre, this.centre);
    gl.uniform2f(this.at.extent, 0.5 * area.width / scale, 0.5 * area.height / scale);
    gl.uniform1f(this.at.depth, 2 * size + Math.hypot(...this.centre));
    const [low, high] = this.range;
    gl.uniform2f(this.at.range, low, high > low ? high : low + (Math.abs(low) || 1) * 1e-6);
    gl.uniform1i(this.at.lit, this.plane ? 0 : 1);
    this.meshes.forEach((mesh, k) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, mesh.buffer);
      this.inputs.forEach((input, i) => {
        gl.enableVertexAttribArray(input);
        gl.vertexAttribPointer(input, i ? 1 : 3, gl.FLOAT, false, 16, 12 * i);
      });
      gl.uniform1i(this.at.flat_, mesh.plain ? 1 : 0);
      gl.uniform3fv(this.at.plain, rgb(this.plain?.[k] ?? "#9fb4c7"));
      gl.drawArrays(gl.TRIANGLES, 0, mesh.count);
    });
    this.draw_axes(area, scale, rows);
  }

  draw_axes(area, scale, rows) {
    const { axes, element, unit } = this, all = [];
    axes.setAttribute("viewBox", `0 0 ${element.clientWidth} ${element.clientHeight}`);
    if (this.plane) {
      const bottom = area.top + area.height, ends = [area.width, area.height];
      all.push(svg("rect", { x: area.left, y: area.top, width: area.width, height: area.height, fill: "none", class: "axis" }));
      for (const d of [0, 1]) {
        const middle = this.middle[d] + this.centre[d], half = 0.5 * ends[d] / scale;
        for (const tick of ticks(middle - half, middle + half, ends[d] / 90)) {
          const along = (tick - middle + half) * scale;
          if (d === 0) {
            const x = area.left + along;
            all.push(svg("line", { x1: x, x2: x, y1: bottom, y2: bottom + 5, class: "axis" }));
            // the unit stands at the end of the axis
            if (along > 16 && along < area.width - 72) {
              all.push(svg("text", { x, y: bottom + 20, "text-anchor": "middle" }, number(tick)));
            }
          } else if (along < area.height - 4) {
            const y = bottom - along;
            all.push(svg("line", { x1: area.left - 5, x2: area.left, y1: y, y2: y, class: "axis" }));
            if (along > 4) all.push(svg("text", { x: area.left - 8, y: y + 4, "text-anchor": "end" }, number(tick)));
          }
        }
      }
      all.push(svg("text", { x: area.left + area.width, y: bottom + 20, "text-anchor": "end", class: "quiet" }, `x [${unit}]`));
      all.push(svg("text", { x: area.left - 8, y: bottom + 20, "text-anchor": "end", class: "quiet" }, `y [${unit}]`));
    } else {
      const [x, y] = [46, element.clientHeight - 46];
      ["x", "y", "z"].forEach((name, d) => {
        const [right, up] = [rows[0][d], rows[1][d]];
        all.push(svg("line", { x1: x, y1: y, x2: x + 26 * right, y2: y - 26 * up, stroke: "currentColor", "stroke-width": 1.5 }));
        if (Math.hypot(right, up) > 0.35) {
          all.push(svg("text", { x: x + 37 * right, y: y - 37 * up + 4, "text-anchor": "middle" }, name));
        }
      });
      const sizes = this.box.map(([low, high]) => number(high - low, 3)).join(" × ");
      const place = { x: element.clientWidth - 8, y: element.clientHeight - 10, "text-anchor": "end", class: "quiet" };
      all.push(svg("text", place, `${sizes} ${unit}`));
    }
    axes.replaceChildren(...all);
  }

  // moves what is seen by pixels
  pan(dx, dy) {
    const rows = this.turn(), scale = this.scale();
    this.centre = this.centre.map((c, d) => c - (dx * rows[0][d] - dy * rows[1][d]) / scale);
    this.render();
  }

  orbit(dx, dy) {
    if (this.plane) return this.pan(dx, dy);
    this.azimuth -= 0.008 * dx;
    this.elevation = Math.max(-1.57, Math.min(1.57, this.elevation + 0.008 * dy));
    this.render();
  }

  // nearer by a factor, the place under the pointer stays
  zoom_at(factor, x, y) {
    const area = this.area(), before = this.scale(area);
    this.zoom = Math.max(0.2, Math.min(500, this.zoom * factor));
    const change = this.scale(area) / before;
    this.pan(...[x - area.left - 0.5 * area.width, y - area.top - 0.5 * area.height].map((from) => from * (1 - change)));
  }

  listen() {
    const { element } = this, held = new Map();
    const place = (event) => {
      const box = element.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    const pair = () => {
      const [a, b] = [...held.values()];
      return { apart: Math.hypot(a[0] - b[0], a[1] - b[1]) || 1, middle: [0, 1].map((k) => 0.5 * (a[k] + b[k])) };
    };
    element.addEventListener("pointerdown", (event) => {
      element.setPointerCapture(event.pointerId);
      held.set(event.pointerId, place(event));
    });
    element.addEventListener("pointermove", (event) => {
      const now = place(event), before = held.get(event.pointerId);
      if (!before) { this.onpoint?.(...now); return; }
      const was = held.size === 2 ? pair() : null;
      held.set(event.pointerId, now);
      const move = [0, 1].map((k) => now[k] - before[k]);
      if (was) {
        const is = pair();
        this.zoom_at(is.apart / was.apart, ...is.middle);
        this.pan(...[0, 1].map((k) => is.middle[k] - was.middle[k]));
      } else if (event.shiftKey || event.buttons & 6) this.pan(...move);
      else this.orbit(...move);
    });
    for (const name of ["pointerup", "pointercancel"]) element.addEventListener(name, (event) => held.delete(event.pointerId));
    element.addEventListener("contextmenu", (event) => event.preventDefault());
    element.addEventListener("dblclick", () => this.reset());
    element.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom_at(Math.exp(-0.0015 * event.deltaY), ...place(event));
    }, { passive: false });
    const keys = { ArrowLeft: [-30, 0], ArrowRight: [30, 0], ArrowUp: [0, -30], ArrowDown: [0, 30] };
    element.addEventListener("keydown", (event) => {
      const middle = [0.5 * element.clientWidth, 0.5 * element.clientHeight];
      if (keys[event.key]) this.orbit(...keys[event.key]);
      else if ("+=".includes(event.key)) this.zoom_at(1.25, ...middle);
      else if (event.key === "-") this.zoom_at(0.8, ...middle);
      else if (event.key === "0") this.reset();
      else return;
      event.preventDefault();
    });
  }

  // place and value of the body under a pixel, null beside it
  pick(px, py) {
    const area = this.area(), scale = this.scale(area), rows = this.turn();
    const shift = [0, 1].map((k) => dot(rows[k], this.centre));
    const x = (px - area.left - 0.5 * area.width) / scale + shift[0];
    const y = (area.top + 0.5 * area.height - py) / scale + shift[1];
    let best = null, nearest = -Infinity;
    const [[a0, a1, a2], [b0, b1, b2], [c0, c1, c2]] = rows;
    for (const { data, count, plain } of this.meshes) {
      for (let at = 0; at < 4 * count; at += 12) {
        const p = [], q = [];
        for (let k = at; k < at + 12; k += 4) {
          p.push(a0 * data[k] + a1 * data[k + 1] + a2 * data[k + 2] - x);
          q.push(b0 * data[k] + b1 * data[k + 1] + b2 * data[k + 2] - y);
        }
        const parts = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
        const whole = parts[0] + parts[1] + parts[2];
        if (!whole || parts.some((part) => part * whole < 0)) continue;
        const mix = (d) => parts.reduce((sum, part, k) => sum + part / whole * data[at + 4 * k + d], 0);
        const own = [mix(0), mix(1), mix(2)], near = c0 * own[0] + c1 * own[1] + c2 * own[2];
        if (near > nearest) {
          nearest = near;
          best = { place: own.map((v, d) => v + this.middle[d]), value: plain ? NaN : mix(3) };
        }
      }
    }
    return best;
  }
}

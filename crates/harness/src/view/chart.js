"use strict";
// Curves in a chart.

const ROOM = { top: 30, right: 16, bottom: 46 };
const DASHES = ["", "7 4", "2 3", "9 3 2 3"];
const colour_of = (index) => `var(--c${index % 6})`;

class Chart {
  constructor(element) {
    Object.assign(this, { element, lines: [], marks: [], names: ["", ""], log: [false, false], window: null, over: null });
    this.listen();
    new ResizeObserver(() => this.render()).observe(element);
  }

  // lines: name, x, y; marks: points of the step that is shown
  show(lines, names, log) {
    const changed = JSON.stringify([names, log]) !== JSON.stringify([this.names, this.log]);
    Object.assign(this, { lines, names, log, over: null, window: changed ? null : this.window });
    this.render();
  }

  mark(marks) {
    this.marks = marks;
    this.render();
  }

  whole() {
    this.window = null;
    this.render();
  }

  // numbers as they are drawn: NaN has no place
  level(x, axis) {
    if (x === null || x === undefined) return NaN;
    return this.log[axis] ? (x > 0 ? Math.log10(x) : NaN) : x;
  }

  ends(axis) {
    if (this.window) return this.window[axis];
    let [low, high] = [Infinity, -Infinity];
    for (const line of this.lines) {
      for (const x of axis ? line.y : line.x) {
        const level = this.level(x, axis);
        if (level < low) low = level;
        if (level > high) high = level;
      }
    }
    if (!(low <= high)) return [0, 1];
    const pad = high > low ? 0.04 * (high - low) : 0.5 * Math.abs(high) || 1;
    return [low - pad, high + pad];
  }

  tick_list(axis, many) {
    const [low, high] = this.ends(axis);
    if (!this.log[axis]) return ticks(low, high, many).map((x) => [x, number(x)]);
    if (high - low > 1.5) {
      return ticks(low, high, many).filter((x) => Math.abs(x - Math.round(x)) < 1e-9).map((x) => [x, number(10 ** Math.round(x))]);
    }
    const list = [];
    for (let power = Math.floor(low); power <= high; power++) {
      for (const k of [1, 2, 5]) {
        const x = power + Math.log10(k);
        if (x >= low && x <= high) list.push([x, number(k * 10 ** power)]);
      }
    }
    return list;
  }

  render() {
    const { element, names } = this, width = element.clientWidth, height = element.clientHeight;
    if (!width || !height) return;
    const [across, up] = [this.ends(0), this.ends(1)];
    const rows = this.tick_list(1, Math.max(2, height / 70));
    const left = 16 + 7.6 * Math.max(2, ...rows.map(([, text]) => text.length));
    const plot = this.plot = { left, top: ROOM.top, width: width - left - ROOM.right, height: height - ROOM.top - ROOM.bottom };
    const place = this.place = {
      x: (level) => plot.left + (level - across[0]) / (across[1] - across[0]) * plot.width,
      y: (level) => plot.top + plot.height - (level - up[0]) / (up[1] - up[0]) * plot.height,
    };
    const picture = svg("svg", { viewBox: `0 0 ${width} ${height}` }), bottom = plot.top + plot.height;
    for (const [level, text] of rows) {
      const y = place.y(level);
      picture.append(svg("line", { x1: left, x2: left + plot.width, y1: y, y2: y, class: "grid" }));
      picture.append(svg("text", { x: left - 8, y: y + 4, "text-anchor": "end" }, text));
    }
    let free = -Infinity;
    for (const [level, text] of this.tick_list(0, Math.max(2, plot.width / 90))) {
      const x = place.x(level), half = 3.9 * text.length;
      picture.append(svg("line", { x1: x, x2: x, y1: plot.top, y2: bottom, class: "grid" }));
      if (x - half < free + 6 || x + half > width) continue;
      picture.append(svg("text", { x, y: bottom + 18, "text-anchor": "middle" }, text));
      free = x + half;
    }
    picture.append(svg("rect", { x: left, y: plot.top, width: plot.width, height: plot.height, fill: "none", class: "axis" }));
    const fitted = (text, room) => text.length * 7.4 > room ? `${text.slice(0, Math.max(3, room / 7.4 - 1))}…` : text;
    picture.append(svg("text", { x: 4, y: 16, class: "quiet" }, fitted(names[1], width - 8)));
    const below = { x: left + plot.width, y: height - 8, "text-anchor": "end", class: "quiet" };
    picture.append(svg("text", below, fitted(names[0], plot.width)));
    const clip = svg("clipPath", { id: "plot" });
    clip.append(svg("rect", { x: left, y: plot.top, width: plot.width, height: plot.height }));
    const inside = svg("g", { "clip-path": "url(#plot)" });
    this.lines.forEach((line, index) => this.draw(inside, line, index));
    for (const [x, y] of this.marks) {
      const [cx, cy] = [place.x(this.level(x, 0)), place.y(this.level(y, 1))];
      if (Number.isFinite(cx + cy)) inside.append(svg("circle", { cx, cy, r: 6, class: "now" }));
    }
    picture.append(clip, inside);
    if (this.box) {
      const [a, b] = this.box, [x, y] = [0, 1].map((k) => Math.min(a[k], b[k]));
      const size = { width: Math.abs(a[0] - b[0]), height: Math.abs(a[1] - b[1]) };
      picture.append(svg("rect", { x, y, ...size, fill: "var(--accent)", "fill-opacity": 0.15, stroke: "var(--accent)" }));
    }
    element.replaceChildren(picture);
    if (this.over) this.tip(picture);
  }

  draw(group, line, index) {
    let path = "", pen = false;
    const points = [];
    for (let k = 0; k < line.x.length; k++) {
      const [x, y] = [this.place.x(this.level(line.x[k], 0)), this.place.y(this.level(line.y[k], 1))];
      if (!Number.isFinite(x + y)) { pen = false; continue; }
      path += `${pen ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`;
      points.push([x, y]);
      pen = true;
    }
    const dashes = DASHES[Math.floor(index / 6) % DASHES.length];
    group.append(svg("path", { d: path, class: "curve", style: `stroke: ${colour_of(index)}`, "stroke-dasharray": dashes }));
    if (points.length < 40) {
      for (const [cx, cy] of points) group.append(svg("circle", { cx, cy, r: 3, style: `fill: ${colour_of(index)}` }));
    }
  }

  // curve and row of the point next to a pixel
  nearest(px, py) {
    let best = null, least = 40;
    this.lines.forEach((line, index) => line.x.forEach((x, row) => {
      const far = Math.hypot(this.place.x(this.level(x, 0)) - px, this.place.y(this.level(line.y[row], 1)) - py);
      if (far < least) [best, least] = [[index, row], far];
    }));
    return best;
  }

  tip(picture) {
    const [index, row] = this.over, line = this.lines[index];
    const [x, y] = [this.place.x(this.level(line.x[row], 0)), this.place.y(this.level(line.y[row], 1))];
    const texts = [line.name, `${number(line.x[row])}, ${number(line.y[row])}`];
    const wide = Math.min(7.6 * Math.max(...texts.map((text) => text.length)) + 16, this.element.clientWidth - 8);
    const left = Math.max(4, Math.min(x + 10, this.element.clientWidth - wide - 4)), top = y > 60 ? y - 54 : y + 12;
    picture.append(svg("circle", { cx: x, cy: y, r: 5, style: `fill: ${colour_of(index)}` }));
    picture.append(svg("rect", { x: left, y: top, width: wide, height: 44, rx: 6, fill: "var(--card)", stroke: "var(--line)" }));
    texts.forEach((text, k) => picture.append(svg("text", { x: left + 8, y: top + 18 + 18 * k }, text)));
  }

  listen() {
    const { element } = this;
    const place = (event) => {
      const box = element.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    element.addEventListener("pointerdown", (event) => {
      this.from = place(event);
      if (event.pointerType === "mouse") element.setPointerCapture(event.pointerId);
    });
    element.addEventListener("pointermove", (event) => {
      const now = place(event);
      if (this.from && event.pointerType === "mouse") {
        const far = Math.hypot(now[0] - this.from[0], now[1] - this.from[1]) > 6;
        this.box = far ? [this.from, now] : null;
      } else this.over = this.plot ? this.nearest(...now) : null;
      this.render();
    });
    element.addEventListener("pointerup", (event) => {
      if (this.box) this.window = [0, 1].map((axis) => this.span(axis));
      else if (this.from && this.plot) {
        this.over = this.nearest(...place(event));
        if (this.over) this.onchoose?.(...this.over);
      }
      Object.assign(this, { from: null, box: null });
      this.render();
    });
    for (const name of ["pointerleave", "pointercancel"]) {
      element.addEventListener(name, () => { Object.assign(this, { from: null, box: null, over: null }); this.render(); });
    }
    element.addEventListener("dblclick", () => this.whole());
    element.addEventListener("keydown", (event) => {
      const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
      if (!this.lines.length || !by && event.key !== "Enter") return;
      const [index, row] = this.over ?? [0, -1], last = this.lines[index].x.length - 1;
      if (by) this.over = [index, Math.max(0, Math.min(last, row + by))];
      else if (this.over) this.onchoose?.(...this.over);
      this.render();
      event.preventDefault();
    });
  }

  // levels of an axis within the box that is drawn
  span(axis) {
    const { plot } = this, [low, high] = this.ends(axis);
    const part = (pixel) => axis
      ? 1 - (pixel - plot.top) / plot.height
      : (pixel - plot.left) / plot.width;
    const [a, b] = this.box.map((corner) => low + part(corner[axis]) * (high - low)).sort((p, q) => p - q);
    return b > a ? [a, b] : [low, high];
  }
}

"use strict";
// Numbers of a body, its surface and its section at a step.

const NOTHING = 65535;
// faces, and tetrahedra of cells that have a volume, by VTK's types of cells
const FACES = {
  5: [[0, 1, 2]], 9: [[0, 1, 2, 3]],
  10: [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
  12: [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]],
  13: [[0, 2, 1], [3, 4, 5], [0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]],
  14: [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
};
const PARTS = {
  10: [[0, 1, 2, 3]],
  12: [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]],
  13: [[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]],
  14: [[0, 1, 2, 4], [0, 2, 3, 4]],
};

async function unzip(id) {
  const text = atob(document.getElementById(id).textContent.trim());
  const bytes = Uint8Array.from(text, (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// rows of 16-bit numbers: each the difference from the row before, the first from its left neighbour, in zigzag order
function unpack(bytes, { at, rows, count }) {
  const result = [];
  for (let row = 0; row < rows; row++) {
    const low = at + 2 * count * row, high = low + count, values = new Uint16Array(count), before = result[row - 1];
    for (let k = 0; k < count; k++) {
      const change = bytes[low + k] | bytes[high + k] << 8;
      values[k] = (change >> 1 ^ -(change & 1)) + (before ? before[k] : k ? values[k - 1] : 0);
    }
    result.push(values);
  }
  return result;
}

class Solid {
  constructor(told, bytes) {
    Object.assign(this, { told, bytes, fields: new Map() });
    const number = (slot, levels) =>
      Float64Array.from(unpack(bytes, slot)[0], (level) => levels.low + levels.step * level);
    const sides = told.levels.map((levels) => 16383 * levels.step);
    const longest = Math.max(...sides);
    [this.unit, this.length] = longest >= 10 ? ["m", 1] : longest >= 1e-3 ? ["mm", 1e3] : longest >= 1e-6 ? ["µm", 1e6] : ["nm", 1e9];
    this.points = told.points.map((slot, d) => number(slot, told.levels[d]).map((x) => x * this.length));
    this.moves = told.moves && told.moves.slots.map((slot) => unpack(bytes, slot));
    this.births = told.births && unpack(bytes, told.births)[0];
    const kinds = [], starts = [], corners = [];
    for (const { kind, low, high } of told.cells) {
      const [lows, highs] = [unpack(bytes, low), unpack(bytes, high)];
      for (let cell = 0; cell < low.count; cell++) {
        kinds.push(kind);
        starts.push(corners.length);
        for (let k = 0; k < lows.length; k++) corners.push(lows[k][cell] | highs[k][cell] << 16);
      }
    }
    Object.assign(this, { kinds, starts, corners: Uint32Array.from(corners) });
    this.pair();
    this.box = this.bounds();
  }

  // faces, and the cell beyond each
  pair() {
    const faces = [], first = new Map(), next = [];
    const beyond = [];
    for (let cell = 0; cell < this.kinds.length; cell++) {
      for (const face of FACES[this.kinds[cell]]) {
        const points = face.map((k) => this.corners[this.starts[cell] + k]), key = Math.min(...points);
        const mine = faces.length;
        faces.push({ cell, points });
        beyond.push(-1);
        next.push(-1);
        if (face.length < 3 || this.kinds[cell] <= 9) continue;
        let other = first.has(key) ? first.get(key) : -1, previous = -1;
        const same = (there) => there.length === points.length && points.every((point) => there.includes(point));
        while (other >= 0 && !same(faces[other].points)) [previous, other] = [other, next[other]];
        if (other < 0) {
          next[mine] = first.has(key) ? first.get(key) : -1;
          first.set(key, mine);
          continue;
        }
        [beyond[mine], beyond[other]] = [faces[other].cell, cell];
        if (previous < 0) first.set(key, next[other]); else next[previous] = next[other];
      }
    }
    Object.assign(this, { faces, beyond });
  }

  // positions at a step, displacements multiplied by a scale
  places(step, scale) {
    if (!this.moves || scale === 0) return this.points;
    const { low, step: size } = this.told.moves.levels, by = scale * this.length;
    return this.points.map((axis, d) => {
      const levels = this.moves[d][step], places = new Float64Array(axis.length);
      for (let k = 0; k < axis.length; k++) places[k] = axis[k] + by * (low + size * levels[k]);
      return places;
    });
  }

  // around all steps
  bounds(scale = 1) {
    const box = [0, 1, 2].map(() => [Infinity, -Infinity]);
    const steps = this.moves && scale ? this.told.frames.length : 1;
    for (let step = 0; step < steps; step++) {
      this.places(step, scale).forEach((axis, d) => {
        for (const x of axis) { if (x < box[d][0]) box[d][0] = x; if (x > box[d][1]) box[d][1] = x; }
      });
    }
    return box;
  }

  // values of a field at a step, NaN where there is none
  values(index, step) {
    if (!this.fields.has(index)) this.fields.set(index, unpack(this.bytes, this.told.fields[index].slot));
    const { low, step: size } = this.told.fields[index].levels;
    return Float64Array.from(this.fields.get(index)[step], (level) => level === NOTHING ? NaN : low + size * level);
  }

  // polygons of the surface, and of the section where a plane takes off what is beyond: coloured ones, and ones without value
  surface({ step, field, scale, cut }) {
    const places = this.places(step, scale), values = field >= 0 ? this.values(field, step) : null;
    const ofCells = values && this.told.fields[field].cells;
    const side = cut && Float64Array.from(places[cut.axis], (x) => cut.sign * (x - cut.at));
    const soups = [soup(), soup()], least = [Infinity, -Infinity];
    const vertex = (point, cell) =>
      [places[0][point], places[1][point], places[2][point], values ? values[ofCells ? cell : point] : NaN, side ? side[point] : -1];
    const add = (polygon) => {
      const known = polygon.every((v) => v[3] === v[3]);
      if (known) for (const v of polygon) { if (v[3] < least[0]) least[0] = v[3]; if (v[3] > least[1]) least[1] = v[3]; }
      fan(soups[known ? 0 : 1], polygon);
    };
    const there = (cell) => cell >= 0 && (!this.births || this.births[cell] <= step);
    const beyondCut = (cell) => {
      if (!side) return 0;
      let [inside, outside] = [false, false];
      const end = this.starts[cell + 1] ?? this.corners.length;
      for (let k = this.starts[cell]; k < end; k++) side[this.corners[k]] <= 0 ? inside = true : outside = true;
      return inside ? +outside : 2;
    };
    const state = this.kinds.map((_, cell) => there(cell) ? beyondCut(cell) : 2);
    this.faces.forEach(({ cell, points }, face) => {
      if (state[cell] === 2 || there(this.beyond[face])) return;
      const polygon = points.map((point) => vertex(point, cell));
      add(state[cell] ? clipped(polygon) : polygon);
    });
    this.kinds.forEach((kind, cell) => {
      if (state[cell] !== 1 || !PARTS[kind]) return;
      for (const part of PARTS[kind]) add(section(part.map((k) => vertex(this.corners[this.starts[cell] + k], cell))));
    });
    return { soups, range: least };
  }
}

const soup = () => ({ x: [], y: [], z: [], intensity: [], i: [], j: [], k: [] });

function fan(into, polygon) {
  if (polygon.length < 3) return;
  const first = into.x.length;
  for (const [x, y, z, value] of polygon) { into.x.push(x); into.y.push(y); into.z.push(z); into.intensity.push(value); }
  for (let k = 2; k < polygon.length; k++) { into.i.push(first); into.j.push(first + k - 1); into.k.push(first + k); }
}

const between = (a, b) => a.map((x, k) => x + a[4] / (a[4] - b[4]) * (b[k] - x));

// the part of a convex polygon on this side of the plane
function clipped(polygon) {
  const kept = [];
  polygon.forEach((a, k) => {
    const b = polygon[(k + 1) % polygon.length];
    if (a[4] <= 0) kept.push(a);
    if (a[4] <= 0 !== b[4] <= 0) kept.push(between(a, b));
  });
  return kept;
}

// where the plane cuts a tetrahedron
function section(corners) {
  const inside = corners.filter((v) => v[4] <= 0), outside = corners.filter((v) => v[4] > 0);
  if (inside.length === 2 && outside.length === 2) {
    const [[a, b], [c, d]] = [inside, outside];
    return [between(a, c), between(a, d), between(b, d), between(b, c)];
  }
  return inside.flatMap((a) => outside.map((b) => between(a, b)));
}

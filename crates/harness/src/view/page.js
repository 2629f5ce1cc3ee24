"use strict";
// Controls and pictures of the page.

const run = JSON.parse(document.getElementById("run").textContent);
const at = (id) => document.getElementById(id);
const say = (tag, text, kind) => Object.assign(document.createElement(tag), { textContent: text, className: kind ?? "" });
const short = (x) => x === null || x === undefined ? "–" : String(+x.toPrecision(4));
const unit = (name, unit) => unit ? `${name} [${unit}]` : name;
const SCALES = [0, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
const LOOK = { displaylogo: false, responsive: true, scrollZoom: true, modeBarButtonsToRemove: ["resetCameraLastSave3d"] };
const FONT = { family: "system-ui, sans-serif", size: 13 };

let solid = null, step = 0, playing = null, busy = false, again = false, group = [];

function options(select, names, chosen = 0) {
  select.replaceChildren(...names.map((name, k) => Object.assign(say("option", name), { value: k, selected: k === chosen })));
  select.parentElement.hidden = names.length === 0;
}

// head and numbers

function header() {
  const about = at("about"), { report } = run;
  if (report) {
    about.append(`${report.program} ${report.version}, ${report.date} `);
    const failed = run.expect.filter((e) => !e.pass).length;
    const verdict = report.passed ? "passed" : `failed: ${failed} of ${run.expect.length} expectations, ${report.non_finite.length} values that are not finite`;
    about.append(say("strong", verdict, report.passed ? "good" : "bad"));
  }
  if (run.unfinished || !report) about.append(say("strong", " the run has not ended: this is what it has written so far", "bad"));
  const empty = run.bodies.length === 0 && run.tables.length === 0;
  if (empty) at("notes").append("It has written no fields and no tables. ");
  else if (run.bodies.length === 0) at("notes").append("It has written no fields (in a scene, [output] fields and every). ");
  if (run.left_out.length) at("notes").append(`Left out of this page: ${run.left_out.join(", ")}.`);
}

function numbers() {
  const rows = (head, list) => {
    const table = document.createElement("table");
    for (const [tag, cells] of [["th", head], ...list.map((cells) => ["td", cells])]) {
      const row = table.insertRow();
      for (const cell of cells) row.append(say(tag, cell, cell === "FAIL" ? "bad" : ""));
    }
    return table;
  };
  const block = (title, table, open) => {
    const details = Object.assign(document.createElement("details"), { open });
    details.append(say("summary", title), table);
    at("numbers").append(details);
  };
  if (run.expect.length) {
    block(`Expectations (${run.expect.length})`, rows(["", "quantity", "value"],
      run.expect.map((e) => [e.pass ? "ok" : "FAIL", e.quantity, short(e.value)])), !run.report.passed);
  }
  if (run.scalars.length) {
    block(`Values (${run.scalars.length})`, rows(["name", "value", "unit"],
      run.scalars.map((s) => [s.name, s.value === null ? "not finite" : short(s.value), s.unit])), run.bodies.length === 0 && run.tables.length === 0);
  }
}

// the solid

function stageLayout() {
  const { plane } = solid.told, scale = +at("scale").value;
  const box = scale <= 1 ? solid.box : solid.bounds(scale), names = ["x", "y", "z"];
  const pad = 0.02 * Math.max(...box.map(([low, high]) => high - low)) || 1;
  const sizes = box.map(([low, high]) => high - low + 2 * pad), longest = Math.max(...sizes);
  // beside the colour bar; lengths are in parts of the height
  const { clientWidth: width, clientHeight: height } = at("stage"), share = Math.max(0.6, 1 - 95 / width);
  const room = share * width / height;
  const fill = plane ? 1.8 * longest * Math.min(1 / sizes[1], room / sizes[0]) : 1.9 * Math.min(1, room);
  const scene = {
    uirevision: `${solid.told.name}`, dragmode: "orbit", aspectmode: "manual", domain: { x: [0, share] },
    aspectratio: Object.fromEntries(names.map((name, d) => [name, fill * sizes[d] / longest])),
    camera: plane
      ? { eye: { x: 0, y: 0, z: 1.2 }, up: { x: 0, y: 1, z: 0 }, projection: { type: "orthographic" } }
      : { eye: { x: 0.65, y: -1, z: 0.55 }, up: { x: 0, y: 0, z: 1 }, projection: { type: "orthographic" } },
  };
  names.forEach((name, d) => {
    scene[`${name}axis`] = {
      title: { text: unit(name, solid.unit) }, range: [box[d][0] - pad, box[d][1] + pad], visible: !(plane && d === 2),
      showbackground: false, gridcolor: "#e3e6ea", zeroline: false, nticks: sizes[d] < 0.3 * longest ? 4 : 7,
    };
  });
  return { scene, margin: { l: 0, r: 0, t: 0, b: 0 }, font: FONT, showlegend: false };
}

// Inferno of matplotlib without its black end, on which no light shows a shape
const INFERNO = ["#2a0b54", "#4a0c6b", "#781c6d", "#a52c60", "#cf4446", "#ed6925", "#fb9b06", "#f7d13d", "#fcffa4"];

function colours(name) {
  if (/temperature/.test(name)) return INFERNO.map((colour, k) => [k / (INFERNO.length - 1), colour]);
  return /damage|flags/.test(name) ? "Cividis" : "Viridis";
}

function cutting() {
  const axis = at("axis").selectedIndex - 1;
  at("cut").disabled = axis < 0;
  if (axis < 0) return null;
  const [low, high] = solid.box[axis], slack = 1e-6 * (high - low);
  // what is in front goes: towards +x, −y, +z
  const sign = (axis === 1 ? -1 : 1) * (at("other-side").checked ? -1 : 1);
  return { axis, at: low - slack + (high - low + 2 * slack) * at("cut").value / 1000, sign };
}

function traces() {
  const field = at("fields").options.length ? +at("fields").value : -1, told = solid.told.fields[field];
  const { soups: [coloured, grey], range } = solid.surface({ step, field, scale: +at("scale").value, cut: cutting() });
  const own = at("own-range").checked && range[0] <= range[1];
  const [low, high] = !told ? [0, 1] : own ? range : [told.levels.low, told.levels.low + 4095 * told.levels.step];
  const light = solid.told.plane ? { ambient: 1, diffuse: 0, specular: 0, fresnel: 0 } : { ambient: 0.55, diffuse: 0.6, specular: 0.1, fresnel: 0, roughness: 0.8, facenormalsepsilon: 0, vertexnormalsepsilon: 0 };
  // the light stands in the space of the viewer: above, on the left
  const common = { type: "mesh3d", flatshading: true, lighting: light, lightposition: { x: -1e5, y: 1e5, z: -1e5 } };
  const { x, y, z, i, j, k, intensity } = told ? coloured : grey;
  document.body.dataset.triangles = coloured.i.length + grey.i.length;
  document.body.dataset.low = low;
  document.body.dataset.high = high;
  const place = "x %{x:.4g}, y %{y:.4g}, z %{z:.4g} " + solid.unit;
  const body = {
    ...common, x, y, z, i, j, k, hovertemplate: place + "<extra></extra>",
    ...(told ? {
      intensity, cmin: low, cmax: high > low ? high : low + (Math.abs(low) || 1) * 1e-6, colorscale: colours(told.name), showscale: true,
      colorbar: { title: { text: unit(told.name, told.unit), side: "right" }, thickness: 14, len: 0.8, x: 1, xanchor: "right" },
      hovertemplate: `${told.name} %{intensity:.4g} ${told.unit}<br>${place}<extra></extra>`,
    } : { color: "#9fb4c7" }),
  };
  // parts without a value
  const rest = { ...common, color: "#b8bcc2", hovertemplate: `no value<br>${place}<extra></extra>`, ...(told ? grey : soup()) };
  delete rest.intensity;
  return [body, rest];
}

async function draw() {
  if (busy) { again = true; return; }
  busy = true;
  do {
    again = false;
    const frame = solid.told.frames[step];
    at("moment").textContent = moment(frame);
    at("step").value = step;
    await Plotly.react("stage", traces(), stageLayout(), LOOK);
    mark();
    document.body.dataset.step = step;
  } while (again);
  busy = false;
}

function moment({ time, displacement, load }) {
  const many = solid.told.frames.length;
  if (!solid.told.particles) return `t = ${short(time)} s (${step + 1} of ${many})`;
  const held = displacement === null ? "" : `, displacement ${short(1e3 * displacement)} mm`;
  const pulled = load === null ? "" : `, load ${short(load)} N`;
  // between two steps: 1/2, 2/3, 3/4, …
  const part = time % 1, within = part ? `, equilibrium ${Math.round(part / (1 - part))}` : "";
  return `load step ${Math.ceil(time)}${within}${held}${pulled} (${step + 1} of ${many})`;
}

async function choose(index) {
  const told = run.bodies[index];
  solid = new Solid(told, await unzip(`body-${index}`));
  step = told.frames.length - 1;
  at("step").max = step;
  at("play").disabled = step === 0;
  options(at("fields"), told.fields.map((field) => unit(field.name, field.unit)));
  at("scale").replaceChildren(...(solid.moves ? SCALES : []).map((x) => Object.assign(say("option", x), { value: x, selected: x === 1 })));
  at("scale").parentElement.hidden = !solid.moves;
  if (!solid.moves) at("scale").append(Object.assign(say("option", "1"), { value: 1 }));
  at("bodies").title = told.notes.join("; ");
  at("stage-notes")?.remove();
  if (told.notes.length) at("body").append(Object.assign(say("p", `Shown: ${told.notes.join("; ")}.`), { id: "stage-notes" }));
  await draw();
}

function go(to) {
  step = Math.max(0, Math.min(to, solid.told.frames.length - 1));
  return draw();
}

function play() {
  const on = playing === null;
  at("play").textContent = on ? "⏸" : "▶";
  clearTimeout(playing);
  playing = null;
  if (!on) return;
  if (step === solid.told.frames.length - 1) step = -1;
  const next = async () => {
    await go(step + 1);
    if (playing === null) return;
    if (step === solid.told.frames.length - 1) play(); else playing = setTimeout(next, 120);
  };
  playing = setTimeout(next, 0);
}

// two fingers: nearer or farther, by turns of the wheel that each scale by a tenth
function pinch(stage) {
  const turn = Math.log(1.1);
  let apart = 0, left = 0;
  const distance = ({ touches: [a, b] }) => Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
  const start = (event) => { [apart, left] = [event.touches.length === 2 ? distance(event) : 0, 0]; };
  const move = (event) => {
    const canvas = stage._fullLayout?.scene?._scene?.glplot?.canvas;
    if (event.touches.length !== 2 || !apart || !canvas) return;
    event.preventDefault();
    event.stopPropagation();
    const now = distance(event);
    left += Math.log(Math.max(now, 1) / Math.max(apart, 1));
    apart = now;
    for (; Math.abs(left) >= turn; left -= Math.sign(left) * turn) {
      canvas.dispatchEvent(new WheelEvent("wheel", { deltaY: -100 * Math.sign(left), bubbles: true, cancelable: true }));
    }
  };
  stage.addEventListener("touchstart", start, { capture: true, passive: false });
  stage.addEventListener("touchmove", move, { capture: true, passive: false });
}

// the curves

// tables with the same columns are curves of one chart
function groups() {
  const found = new Map();
  for (const table of run.tables) {
    const kind = table.name.replace(/^.*\//, "").split(/[_[]/)[0];
    const key = kind + JSON.stringify(table.columns.map(({ name, unit }) => [name, unit]));
    if (!found.has(key)) found.set(key, { name: kind, tables: [] });
    found.get(key).tables.push(table);
  }
  const first = (name) => ["history", "probe", "point", "profile"].findIndex((kind) => kind === name) >>> 0;
  const list = [...found.values()].sort((a, b) => first(a.name) - first(b.name));
  list.forEach((entry) => { entry.label = entry.tables.length === 1 ? entry.tables[0].name : `${entry.name} (${entry.tables.length})`; });
  return list;
}

const charts = groups();

function columns() {
  group = charts[+at("tables").value].tables;
  const names = group[0].columns.map(({ name, unit: of }) => unit(name, of));
  options(at("x"), names, 0);
  options(at("y"), names, 1);
  return chart();
}

// the times of a table's rows where it belongs to the body: load steps of its history, or seconds
function timesOf(table) {
  const folder = (name) => name.replace(/[^/]*$/, ""), own = solid?.told.name;
  if (!solid || folder(table.name) !== folder(own)) return null;
  if (!solid.told.particles) return table.columns.find((column) => column.name === "time")?.data ?? null;
  const isHistory = table.name === `${folder(own)}history_${own.slice(folder(own).length)}`;
  return isHistory ? table.columns[0].data.map((_, row) => row * table.every + 1) : null;
}

const nearest = (times, wanted) => {
  const far = (k) => times[k] === null ? Infinity : Math.abs(times[k] - wanted);
  return times.reduce((best, _, k) => far(k) < far(best) ? k : best, 0);
};

// the row of a table at a step of the body, where they belong together
function rowOf(table, frame) {
  const times = frame && timesOf(table);
  if (!times) return -1;
  if (solid.told.particles) return nearest(times, Math.ceil(frame.time));
  // a probe that is not there yet has no row
  const [first, end] = [times[0], times[times.length - 1]], slack = 0.02 * (end - first);
  return frame.time < first - slack || frame.time > end + slack ? -1 : nearest(times, frame.time);
}

function marks() {
  const [x, y] = [+at("x").value, +at("y").value], frame = solid?.told.frames[step];
  const found = group.map((table) => [table, rowOf(table, frame)]).filter(([, row]) => row >= 0);
  return { x: found.map(([table, row]) => table.columns[x].data[row]), y: found.map(([table, row]) => table.columns[y].data[row]) };
}

function mark() {
  if (!charts.length || !at("chart").data) return;
  const { x, y } = marks();
  document.body.dataset.mark = JSON.stringify([x, y]);
  Plotly.restyle("chart", { x: [x], y: [y] }, [group.length]);
}

async function chart() {
  const [x, y] = [+at("x").value, +at("y").value], [across, up] = [x, y].map((k) => group[0].columns[k]);
  const label = (table) => table.name.replace(/^history_|^probe_|^profile_/, "");
  const lines = group.map((table) => ({
    type: "scatter", mode: table.columns[x].data.length < 40 ? "lines+markers" : "lines", name: label(table),
    x: table.columns[x].data, y: table.columns[y].data, marker: { size: 5 },
  }));
  const now = { type: "scatter", mode: "markers", ...marks(), name: "this step", marker: { size: 12, color: "#d1242f", line: { color: "#fff", width: 2 } }, hoverinfo: "skip" };
  const axis = ({ name, unit: of }) => ({ title: { text: unit(name, of) }, gridcolor: "#e3e6ea", zerolinecolor: "#c9ced4", exponentformat: "power" });
  const layout = {
    xaxis: axis(across), yaxis: axis(up), margin: { l: 64, r: 10, t: 10, b: 46 }, font: FONT, hovermode: "closest",
    showlegend: group.length > 1, legend: { orientation: "h", y: 1.02, yanchor: "bottom" }, dragmode: "pan",
  };
  await Plotly.react("chart", [...lines, now], layout, LOOK);
  document.body.dataset.mark = JSON.stringify([now.x, now.y]);
}

// a point of a curve chooses the nearest step
function clicked({ points: [point] }) {
  const times = group[point.curveNumber] && timesOf(group[point.curveNumber]);
  if (times) go(nearest(solid.told.frames.map((frame) => frame.time), times[point.pointNumber]));
}

async function start() {
  header();
  numbers();
  if (!run.bodies.length && !charts.length) { document.body.dataset.ready = "nothing"; return; }
  const script = document.createElement("script");
  script.textContent = new TextDecoder().decode(await unzip("plotly"));
  document.head.append(script);
  // both before either is drawn: they share the width
  at("curves").hidden = !charts.length;
  at("body").hidden = !run.bodies.length;
  if (charts.length) {
    options(at("tables"), charts.map((entry) => entry.label));
    await columns();
    at("tables").onchange = columns;
    at("x").onchange = at("y").onchange = chart;
    at("chart").on("plotly_click", clicked);
  }
  if (run.bodies.length) {
    options(at("bodies"), run.bodies.map((body) => body.name));
    await choose(0);
    at("bodies").onchange = () => choose(+at("bodies").value);
    for (const id of ["fields", "own-range", "axis", "other-side", "scale"]) at(id).onchange = draw;
    at("cut").oninput = draw;
    at("step").oninput = () => go(+at("step").value);
    at("play").onclick = play;
    at("reset").onclick = () => Plotly.relayout("stage", { "scene.camera": stageLayout().scene.camera, "scene.aspectratio": stageLayout().scene.aspectratio });
    pinch(at("stage"));
  }
  document.body.dataset.ready = "yes";
}

start().catch((error) => {
  at("notes").append(say("strong", typeof DecompressionStream === "undefined"
    ? "This browser is too old for this page: it needs Chrome 80, Firefox 113, Safari 16.4 or newer." : `This page failed: ${error.message}`, "bad"));
  throw error;
});

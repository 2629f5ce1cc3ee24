"use strict";
// Values, controls and what they change.

const run = JSON.parse(document.getElementById("run").textContent);
const at = (id) => document.getElementById(id);
const make = (tag, text, kind) => Object.assign(document.createElement(tag), { textContent: text ?? "", className: kind ?? "" });
const unit = (name, of) => of ? `${name} [${of}]` : name;
const SCALES = [0, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
// curves at first, and rows of a list at most
const FIRST = 6, LISTED = 200;
const INFERNO = ["#2a0b54", "#4a0c6b", "#781c6d", "#a52c60", "#cf4446", "#ed6925", "#fb9b06", "#f7d13d", "#fcffa4"];
const VIRIDIS = ["#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"];
const CIVIDIS = ["#00224e", "#123570", "#3b496c", "#575d6d", "#707173", "#8a8678", "#a59c74", "#c3b369", "#e1cc55", "#fee838"];

let solid = null, stage = null, step = 0, playing = null, group = [], chosen = [];
const chart = new Chart(at("chart"));

function options(select, names, chosen = 0) {
  select.replaceChildren(...names.map((name, k) => Object.assign(make("option", name), { value: k, selected: k === chosen })));
  select.closest("label").hidden = names.length < 2;
}

// light and dark

function paint(theme) {
  document.documentElement.dataset.theme = theme;
  at("theme").textContent = theme === "dark" ? "Light" : "Dark";
  if (solid) draw();
}

function themes() {
  const system = matchMedia("(prefers-color-scheme: dark)");
  paint(system.matches ? "dark" : "light");
  system.onchange = () => paint(system.matches ? "dark" : "light");
  at("theme").onclick = () => paint(document.documentElement.dataset.theme === "dark" ? "light" : "dark");
}

// head and values

function header() {
  const { verdict, report } = run;
  at("verdict").textContent = verdict.text;
  at("verdict").className = verdict.state;
  const about = report ? [`${report.program} ${report.version}`, report.date, run.name] : [run.name];
  at("about").textContent = about.join(" · ");
  if (run.left_out.length) {
    const details = make("details");
    details.append(make("summary", "What this page leaves out"), make("p", run.left_out.join("; ")));
    at("notes").append(details);
  }
  if (!run.bodies.length) {
    const missing = run.tables.length ? "no fields (in a scene, `[output] fields` asks for them)" : "no fields and no tables";
    at("notes").append(make("p", `The run has written ${missing}.`));
  }
}

const shown = ({ value }) => value === null ? "not finite" : number(value, 5);

// main values: a table over variants, and tiles
function main_values() {
  const main = run.scalars.filter((scalar) => scalar.main !== null).sort((a, b) => a.main - b.main);
  at("main").hidden = !main.length;
  const distinct = (key) => [...new Set(main.filter((s) => s.variant).map((s) => s[key]))];
  const variants = run.variants.filter((name) => distinct("variant").includes(name)), quantities = distinct("quantity").slice(0, 6);
  if (variants.length) {
    const table = make("table"), head = table.createTHead().insertRow(), of = (quantity) => main.find((s) => s.quantity === quantity).unit;
    head.append(make("th", "variant"), ...quantities.map((name) => make("th", unit(name, of(name)), "number")));
    const body = table.createTBody();
    for (const variant of variants.slice(0, 12)) {
      const row = body.insertRow();
      row.append(make("td", variant));
      for (const quantity of quantities) {
        const scalar = main.find((s) => s.variant === variant && s.quantity === quantity);
        row.append(make("td", scalar ? shown(scalar) : "–", scalar?.pass === false ? "number bad" : "number"));
      }
    }
    const card = make("div", "", "card scroll");
    card.tabIndex = 0;
    card.append(table);
    at("main").append(card);
  }
  for (const scalar of main.filter((s) => !s.variant).slice(0, 8)) {
    const tile = make("div", "", "tile");
    tile.append(make("b", `${shown(scalar)} ${scalar.unit}`.trim(), scalar.pass === false ? "bad" : ""), make("span", scalar.name));
    at("main").append(tile);
  }
}

// a table with a search field above it
function searched(id, search, rows, head, more) {
  const table = at(id), line = table.createTHead().insertRow(), body = table.createTBody();
  head.forEach(([name, kind]) => line.append(make("th", name, kind)));
  const fill = () => {
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    const fits = ({ text, failed }) => words.every((word) => text.includes(word)) && (!more?.checked || failed);
    body.replaceChildren(...rows.filter(fits).map(({ cells, failed }) => {
      const row = make("tr");
      cells.forEach((cell, k) => row.append(make("td", cell, `${head[k][1] ?? ""} ${failed && k === 0 ? "bad" : ""}`.trim())));
      return row;
    }));
  };
  search.oninput = fill;
  if (more) more.onchange = fill;
  fill();
}

function tables() {
  const row = (cells, failed) => ({ cells, failed, text: cells.join(" ").toLowerCase() });
  const failed = run.expect.filter((e) => !e.pass).length;
  at("judged").hidden = !run.expect.length;
  at("judged-title").textContent = `Expectations (${run.expect.length})`;
  at("only-failed").closest("label").hidden = !failed;
  searched("expect", at("find-expect"), run.expect.map((e) =>
    row([e.pass ? (e.missed ? "known miss" : "met") : "not met", e.quantity, e.value, e.bound, e.kind.replace("-", " "), e.source], !e.pass)),
  [["", ""], ["quantity"], ["value", "number"], ["expected", "number"], ["evidence"], ["source", "source"]], at("only-failed"));
  at("values").hidden = !run.scalars.length;
  at("values-title").textContent = `All values (${run.scalars.length})`;
  searched("scalars", at("find-value"), run.scalars.map((s) => row([s.name, shown(s), s.unit], s.value === null)),
    [["name"], ["value", "number"], ["unit"]]);
}

// the body

function cutting() {
  const axis = at("axis").selectedIndex - 1;
  at("cut").disabled = axis < 0;
  if (axis < 0) return null;
  const [low, high] = solid.box[axis], slack = 1e-6 * (high - low);
  // what is in front goes: towards +x, −y, +z
  const sign = (axis === 1 ? -1 : 1) * (at("other-side").checked ? -1 : 1);
  return { axis, at: low - slack + (high - low + 2 * slack) * at("cut").value / 1000, sign };
}

const colours = (name) => /temperature/.test(name) ? INFERNO : /damage|flags/.test(name) ? CIVIDIS : VIRIDIS;

function bar(told, [low, high]) {
  at("bar").hidden = !told;
  if (!told) return;
  at("bar-name").textContent = unit(told.name, told.unit);
  at("colours").style.background = `linear-gradient(to right, ${colours(told.name).join(", ")})`;
  at("ticks").replaceChildren(...[0, 0.25, 0.5, 0.75, 1].map((part) => make("span", number(low + part * (high - low), 3))));
}

function draw() {
  const field = at("fields").options.length ? +at("fields").value : -1, told = solid.told.fields[field];
  const scale = +at("scale").value;
  const { soups, range } = solid.surface({ step, field, scale, cut: cutting() });
  const own = at("own-range").checked && range[0] <= range[1];
  const ends = !told ? [0, 1] : own ? range : [told.levels.low, told.levels.low + 4095 * told.levels.step];
  const box = scale <= 1 ? solid.box : solid.bounds(scale), style = getComputedStyle(document.documentElement);
  const plain = ["--body", "--void"].map((name) => style.getPropertyValue(name).trim());
  Object.assign(stage, { plane: solid.told.plane, box, unit: solid.unit });
  // without a field all is in the second soup
  stage.show(soups, { range: told && ends, colours: told && colours(told.name), plain: told ? plain : [plain[0], plain[0]] });
  bar(told, ends);
  at("moment").textContent = moment(solid.told.frames[step]);
  at("step").value = step;
  marks();
  Object.assign(document.body.dataset, { step, triangles: soups[0].i.length + soups[1].i.length, grey: soups[1].i.length, low: ends[0], high: ends[1] });
}

function moment({ time, displacement, load }) {
  const many = solid.told.frames.length, of = `${step + 1} of ${many}`;
  if (!solid.told.particles) return `t = ${number(time)} s (${of})`;
  const held = displacement === null ? "" : `, displacement ${number(1e3 * displacement)} mm`;
  const pulled = load === null ? "" : `, load ${number(load)} N`;
  // between two steps: 1/2, 2/3, 3/4, …
  const part = time % 1, within = part ? `, equilibrium ${Math.round(part / (1 - part))}` : "";
  return `load step ${Math.ceil(time)}${within}${held}${pulled} (${of})`;
}

async function choose(index) {
  const told = run.bodies[index];
  solid = new Solid(told, await unzip(`body-${index}`));
  step = told.frames.length - 1;
  at("step").max = step;
  at("steps").hidden = step === 0;
  options(at("fields"), told.fields.map((field) => unit(field.name, field.unit)));
  at("fields").closest("label").hidden = !told.fields.length;
  options(at("scale"), (solid.moves ? SCALES : [1]).map(String), solid.moves ? 1 : 0);
  [...at("scale").options].forEach((option) => { option.value = option.text; });
  at("stage-notes").hidden = !told.notes.length;
  at("stage-notes").lastElementChild.textContent = `${told.notes.join("; ")}.`;
  draw();
  stage.reset();
}

function go(to) {
  step = Math.max(0, Math.min(to, solid.told.frames.length - 1));
  draw();
}

function play() {
  const on = playing === null;
  at("play").textContent = on ? "⏸" : "▶";
  at("play").ariaLabel = on ? "Pause" : "Play all steps";
  clearTimeout(playing);
  playing = null;
  if (!on) return;
  if (step === solid.told.frames.length - 1) step = -1;
  const next = () => {
    go(step + 1);
    if (playing === null) return;
    if (step === solid.told.frames.length - 1) play(); else playing = setTimeout(next, 120);
  };
  playing = setTimeout(next, 0);
}

let pointed = null;
function point(x, y) {
  cancelAnimationFrame(pointed);
  pointed = requestAnimationFrame(() => {
    const found = stage.pick(x, y), told = solid.told.fields[+at("fields").value];
    const place = found?.place.slice(0, solid.told.plane ? 2 : 3).map((v, d) => `${"xyz"[d]} ${number(v)}`).join(", ");
    const value = told && found && !Number.isNaN(found.value) ? `${told.name} ${number(found.value)} ${told.unit} at ` : "";
    at("probe").textContent = found ? `${value}${place} ${solid.unit}` : "Point at the body to read values.";
  });
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
  // posterior draws are many and tell least
  const first = ({ name, tables }) => tables.some((table) => table.main !== null)
    ? -1 : tables.every((table) => table.name.endsWith("_posterior"))
      ? Infinity : ["history", "load", "probe", "point", "profile"].indexOf(name) >>> 0;
  const list = [...found.values()].sort((a, b) => first(a) - first(b));
  // variants in the order of the scene
  const place = ({ name }) => run.variants.findIndex((variant) => name.endsWith(`[${variant}]`));
  list.forEach((entry) => entry.tables.sort((a, b) => place(a) - place(b)));
  list.forEach((entry) => { entry.label = entry.tables.length === 1 ? entry.tables[0].name : `${entry.name} (${entry.tables.length})`; });
  return list;
}

const charts = groups();

function columns() {
  group = charts[+at("tables").value].tables;
  const names = group[0].columns.map(({ name, unit: of }) => unit(name, of));
  options(at("x"), names, 0);
  options(at("y"), names, 1);
  // those of the scene, otherwise some of all
  const main = group.filter((table) => table.main !== null).sort((a, b) => a.main - b.main || group.indexOf(a) - group.indexOf(b));
  const spread = Array.from({ length: Math.min(FIRST, group.length) }, (_, k) =>
    group[Math.round(k * (group.length - 1) / Math.max(1, Math.min(FIRST, group.length) - 1))]);
  chosen = (main.length ? main : spread).slice(0, FIRST);
  at("choose").hidden = group.length < 2;
  list_curves();
  curves();
}

function list_curves() {
  const words = at("find-curve").value.toLowerCase().split(/\s+/).filter(Boolean);
  const found = group.filter(({ name }) => words.every((word) => name.toLowerCase().includes(word)));
  at("curve-list").replaceChildren(...found.slice(0, LISTED).map((table) => {
    const box = Object.assign(make("input"), { type: "checkbox", checked: chosen.includes(table) });
    box.onchange = () => {
      chosen = box.checked ? [...chosen, table] : chosen.filter((other) => other !== table);
      curves();
    };
    const label = make("label");
    label.append(box, table.name);
    const item = make("li");
    item.append(label);
    return item;
  }));
  at("curve-count").textContent = `${found.length} of ${group.length}`;
}

// names without what all of them have
function short_names(tables) {
  const plain = tables.map(({ name }) => name.replace(/^history_|^probe_|^profile_|^point_/, ""));
  return new Set(plain).size === plain.length ? plain : tables.map(({ name }) => name);
}

function curves() {
  const [x, y] = [+at("x").value, +at("y").value], names = short_names(chosen);
  const lines = chosen.map((table, k) => ({ name: names[k], x: table.columns[x].data, y: table.columns[y].data }));
  const head = [x, y].map((k) => unit(group[0].columns[k].name, group[0].columns[k].unit));
  chart.show(lines, head, [at("log-x").checked, at("log-y").checked]);
  at("legend").replaceChildren(...lines.map(({ name }, k) => {
    const item = make("li"), key = make("i");
    key.style.borderColor = colour_of(k);
    key.style.borderTopStyle = k < 6 ? "solid" : "dashed";
    item.append(key, name);
    return item;
  }));
  document.body.dataset.curves = lines.length;
  marks();
}

// the times of a table's rows where it belongs to the body: load steps of its history, or seconds
function times_of(table) {
  const folder = (name) => name.replace(/[^/]*$/, ""), own = solid?.told.name;
  if (!solid || folder(table.name) !== folder(own)) return null;
  if (!solid.told.particles) {
    const [first] = table.columns;
    return table.times ?? (first.name === "time" ? first.data : null);
  }
  const is_history = table.name === `${folder(own)}history_${own.slice(folder(own).length)}`;
  return is_history ? table.columns[0].data.map((_, row) => row * table.every + 1) : null;
}

const nearest = (times, wanted) => {
  const far = (k) => times[k] === null ? Infinity : Math.abs(times[k] - wanted);
  return times.reduce((best, _, k) => far(k) < far(best) ? k : best, 0);
};

// the row of a table at a step of the body, where they belong together
function row_of(table, frame) {
  const times = frame && times_of(table);
  if (!times) return -1;
  if (solid.told.particles) return nearest(times, Math.ceil(frame.time));
  // a probe that is not there yet has no row
  const [first, end] = [times[0], times[times.length - 1]], slack = 0.02 * (end - first);
  return frame.time < first - slack || frame.time > end + slack ? -1 : nearest(times, frame.time);
}

function marks() {
  const [x, y] = [+at("x").value, +at("y").value], frame = solid?.told.frames[step];
  const found = chosen.map((table) => [table, row_of(table, frame)]).filter(([, row]) => row >= 0);
  const points = found.map(([table, row]) => [table.columns[x].data[row], table.columns[y].data[row]]);
  chart.mark(points);
  document.body.dataset.mark = JSON.stringify(points);
}

// a point of a curve chooses the nearest step
function clicked(index, row) {
  const times = chosen[index] && times_of(chosen[index]);
  if (times) go(nearest(solid.told.frames.map((frame) => frame.time), times[row]));
}

async function start() {
  themes();
  header();
  main_values();
  tables();
  // both before either is drawn: they share the width
  at("curves").hidden = !charts.length;
  at("body").hidden = !run.bodies.length;
  document.querySelector("main").classList.toggle("single", !charts.length || !run.bodies.length);
  if (charts.length) {
    options(at("tables"), charts.map((entry) => entry.label));
    columns();
    at("tables").onchange = columns;
    for (const id of ["x", "y", "log-x", "log-y"]) at(id).onchange = curves;
    at("find-curve").oninput = list_curves;
    at("whole").onclick = () => chart.whole();
    chart.onchoose = clicked;
  }
  if (run.bodies.length) {
    stage = new Stage(at("stage"), at("canvas"), at("axes"));
    stage.onpoint = point;
    options(at("bodies"), run.bodies.map((body) => body.name));
    await choose(0);
    at("bodies").onchange = () => choose(+at("bodies").value);
    for (const id of ["fields", "own-range", "axis", "other-side", "scale"]) at(id).onchange = draw;
    at("cut").oninput = draw;
    at("step").oninput = () => go(+at("step").value);
    at("play").onclick = play;
    at("reset").onclick = () => stage.reset();
  }
  document.body.dataset.ready = run.bodies.length || charts.length ? "yes" : "nothing";
}

start().catch((error) => {
  const old = typeof DecompressionStream === "undefined"
    ? "This browser is too old for this page: it needs Chrome 80, Firefox 113, Safari 16.4 or newer." : `This page failed: ${error.message}`;
  at("notes").append(make("strong", old, "bad"));
  throw error;
});

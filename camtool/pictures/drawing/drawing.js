"use strict";
const sheet = SHEET_OF_PAGE;
const NEAR_PX = 10;      // a point is snapped to from so far
const ANGLE = Math.PI / 12;
const ANGLE_NEAR = Math.PI / 60;
const PEN_PX = 3;        // a pen sets a point after so long a way
const byId = (id) => document.getElementById(id);
const svg = byId("sheet"), figure = byId("figure");

let state = { strokes: [], current: [] };
let past = [], future = [];
let cursor = [0, 0], drawing = null, saved = true;

const rounded = (value) => Math.round(value * 1e4) / 1e4 + 0;
const same = (one, other) => one[0] === other[0] && one[1] === other[1];
const grid = () => Math.max(Number(byId("grid").value) || sheet.grid, 1e-3);

function change(act) {
  past.push(JSON.stringify(state));
  future = [];
  act();
  saved = false;
  show();
}

function travel(from, to) {
  if (!from.length) { return; }
  to.push(JSON.stringify(state));
  state = JSON.parse(from.pop());
  saved = false;
  show();
}

function pxPerMm() { return svg.getScreenCTM().a; }

function placeOf(event) {
  const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(byId("flip").getScreenCTM().inverse());
  return [at.x, at.y];
}

function snapped(at) {
  if (byId("to-points").checked) {
    const known = [...state.strokes.flatMap((stroke) => stroke.points), ...state.current];
    let best = NEAR_PX / pxPerMm(), found = null;
    for (const point of known) {
      const distance = Math.hypot(point[0] - at[0], point[1] - at[1]);
      if (distance <= best) { best = distance; found = point; }
    }
    if (found) { return [...found]; }
  }
  const step = grid(), last = state.current.at(-1);
  if (byId("to-angles").checked && last) {
    const dx = at[0] - last[0], dy = at[1] - last[1];
    const angle = Math.round(Math.atan2(dy, dx) / ANGLE) * ANGLE;
    let length = dx * Math.cos(angle) + dy * Math.sin(angle);
    const beside = Math.abs(dy * Math.cos(angle) - dx * Math.sin(angle));
    if (length > 0 && beside <= length * Math.tan(ANGLE_NEAR)) {
      if (byId("to-grid").checked) { length = Math.round(length / step) * step; }
      return [rounded(last[0] + length * Math.cos(angle)), rounded(last[1] + length * Math.sin(angle))];
    }
  }
  const unit = byId("to-grid").checked ? step : 1e-3;
  return at.map((value) => rounded(Math.round(value / unit) * unit));
}

function set(point) {
  const points = state.current;
  if (points.length && same(points.at(-1), point)) { return; }
  if (points.length > 2 && same(points[0], point)) { finish(true); return; }
  change(() => points.push(point));
}

function finish(closed) {
  const points = state.current;
  if (!points.length) { return; }
  change(() => {
    if (points.length > 1) { state.strokes.push({ points, closed: closed && points.length > 2 }); }
    state.current = [];
  });
}

function data(points, closed) {
  return points.map((point, k) => `${k ? "L" : "M"}${point[0]} ${point[1]}`).join("") + (closed ? "Z" : "");
}

function path(parent, d, kind) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", "path");
  made.setAttribute("d", d);
  if (kind) { made.setAttribute("class", kind); }
  parent.append(made);
}

function show() {
  figure.replaceChildren();
  for (const stroke of state.strokes) { path(figure, data(stroke.points, stroke.closed)); }
  const points = drawing || state.current, arm = NEAR_PX / pxPerMm();
  if (points.length) { path(figure, data(points, false)); }
  if (!drawing && points.length) { path(figure, data([points.at(-1), cursor], false), "next"); }
  path(figure, state.current.map((point) => `M${point[0]} ${point[1]}h0`).join(""), "point");
  const [x, y] = cursor;
  path(figure, `M${x - arm} ${y}H${x + arm}M${x} ${y - arm}V${y + arm}`, "cursor");
  const last = state.current.at(-1);
  const length = last ? `; ${Math.hypot(x - last[0], y - last[1]).toFixed(3)} mm from the last point` : "";
  const count = state.strokes.length, open = state.current.length;
  byId("told").textContent = `X${x.toFixed(3)} Y${y.toFixed(3)} mm${length}\n`
    + `${count} ${count === 1 ? "line" : "lines"}${open ? `, and one of ${open} ${open === 1 ? "point" : "points"}` : ""}`;
  byId("end").disabled = !open;
  byId("close").disabled = open < 3;
  byId("undo").disabled = !past.length;
  byId("redo").disabled = !future.length;
  byId("save").disabled = !count && open < 2;
  byId("file").textContent = byId("name").value;
}

function drawGrid() {
  const { width, height } = sheet, step = grid(), margin = Math.max(width, height) * 0.03;
  svg.setAttribute("viewBox", `${-margin} ${-height - margin} ${width + 2 * margin} ${height + 2 * margin}`);
  byId("flip").setAttribute("transform", "scale(1 -1)");
  byId("lines").replaceChildren();
  let d = "";
  if (width / step < 500 && height / step < 500) {
    for (let x = step; x < width; x += step) { d += `M${x} 0V${height}`; }
    for (let y = step; y < height; y += step) { d += `M0 ${y}H${width}`; }
  }
  path(byId("lines"), d);
  path(byId("lines"), `M0 0H${width}V${height}H0Z`, "edge");
}

svg.addEventListener("contextmenu", (event) => event.preventDefault());
svg.addEventListener("pointerdown", (event) => {
  svg.focus();
  event.preventDefault();
  if (event.button === 2) { finish(false); return; }
  if (event.button !== 0) { return; }
  if (event.pointerType === "pen") {
    finish(false);
    drawing = [placeOf(event).map((value) => rounded(value))];
    svg.setPointerCapture(event.pointerId);
  } else { set(cursor = snapped(placeOf(event))); }
  show();
});
svg.addEventListener("pointermove", (event) => {
  const at = placeOf(event);
  if (drawing) {
    const last = drawing.at(-1);
    cursor = at.map((value) => rounded(value));
    if (Math.hypot(at[0] - last[0], at[1] - last[1]) >= PEN_PX / pxPerMm()) { drawing.push(cursor); }
  } else { cursor = snapped(at); }
  show();
});
for (const kind of ["pointerup", "pointercancel"]) {
  svg.addEventListener(kind, () => {
    const points = drawing;
    drawing = null;
    if (points && points.length > 1) { change(() => state.strokes.push({ points, closed: false })); }
  });
}

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
document.addEventListener("keydown", (event) => {
  const key = event.key.toLowerCase();
  if (event.ctrlKey || event.metaKey) {
    const orders = { z: () => (event.shiftKey ? travel(future, past) : travel(past, future)), y: () => travel(future, past), s: save };
    if (orders[key] && (key === "s" || event.target.tagName !== "INPUT")) {
      event.preventDefault();
      orders[key]();
    }
    return;
  }
  if (event.target !== svg || event.altKey) { return; }
  if (ARROWS[event.key]) {
    const step = grid() * (event.shiftKey ? 0.1 : 1);
    cursor = cursor.map((value, k) => rounded(value + step * ARROWS[event.key][k]));
    show();
  } else if (event.key === "Enter" || event.key === " ") { set([...cursor]); }
  else if (key === "e" || event.key === "Escape") { finish(false); }
  else if (key === "c") { finish(true); }
  else if (event.key === "Backspace") { travel(past, future); }
  else { return; }
  event.preventDefault();
});

byId("end").addEventListener("click", () => finish(false));
byId("close").addEventListener("click", () => finish(true));
byId("undo").addEventListener("click", () => travel(past, future));
byId("redo").addEventListener("click", () => travel(future, past));
byId("grid").addEventListener("input", () => { drawGrid(); show(); });
byId("name").addEventListener("input", show);
byId("typed").addEventListener("submit", (event) => {
  event.preventDefault();
  cursor = [rounded(Number(byId("x").value)), rounded(Number(byId("y").value))];
  set([...cursor]);
});
byId("saving").addEventListener("submit", (event) => { event.preventDefault(); save(); });

function save() {
  finish(false);
  if (!state.strokes.length) { return; }
  const text = JSON.stringify({ units: "mm", strokes: state.strokes }, null, 1) + "\n";
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "application/json" }));
  link.download = byId("name").value.trim() || "figure.json";
  link.click();
  URL.revokeObjectURL(link.href);
  saved = true;
  byId("told").textContent = `saved as ${link.download}`;
}

window.addEventListener("beforeunload", (event) => { if (!saved) { event.preventDefault(); } });
byId("grid").value = sheet.grid;
drawGrid();
show();

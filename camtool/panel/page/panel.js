"use strict";
// The panel's page: it shows the state that the server sends, and sends what the user wants.

const find = (id) => document.getElementById(id);
const key = new URLSearchParams(location.search).get("key") || "";
const KEEP_MS = 20; // a held key is confirmed so often
const STEPS = [1, 10, 14, 28, 50, 100, 1000];
const LENGTHS = [0.01, 0.1, 1, 10];
const HALTED = ["paused", "waiting"];
const WORKS = ["sending", "pausing", "paused", "waiting", "opening", "stopping"];
const KEYS = { ArrowLeft: { x: -1 }, ArrowRight: { x: 1 }, ArrowUp: { y: 1 }, ArrowDown: { y: -1 }, PageUp: { z: 1 }, PageDown: { z: -1 } };

let socket = null;
let first = null; // machine and program: what does not change
let state = { state: "closed" };
let commands = false;
let held = null; // the direction of the key or button that is held
let keeping = 0;

function send(message) {
  if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

function connect() {
  socket = new WebSocket(`ws://${location.host}/socket?key=${encodeURIComponent(key)}`);
  socket.addEventListener("message", (event) => {
    const data = JSON.parse(event.data);
    if (data.machine) begin(data);
    else show(data);
  });
  socket.addEventListener("close", () => {
    letGo();
    commands = false;
    state = { state: "closed", why: "the panel's server does not answer; the machine goes on with what it was sent" };
    draw();
    setTimeout(connect, 1000);
  });
}

// What the server says.

function begin(data) {
  first = data;
  const { machine, program } = data;
  find("machine").textContent = `${machine.name} at ${data.port}`;
  find("machine").title = machine.title;
  document.title = `${machine.name}: camtool panel`;
  const can = (action) => data.can.includes(action);
  find("home").hidden = !can("home");
  find("unlock").hidden = !can("unlock");
  find("zero-all").hidden = !can("zero");
  find("jog").hidden = !can("jog");
  find("typed").hidden = !can("line");
  find("feed").value = find("feed").value || machine.feed_mm_min;
  places(machine, can("zero"));
  stepSizes(machine, can("hold"));
  overrides(data.overrides);
  if (program) showProgram(program);
}

function places(machine, canZero) {
  const body = find("places").tBodies[0];
  body.replaceChildren(...["x", "y", "z"].map((axis) => {
    const row = document.createElement("tr");
    const head = document.createElement("th");
    head.scope = "row";
    head.textContent = axis.toUpperCase();
    const value = document.createElement("td");
    value.id = `at-${axis}`;
    value.textContent = "–";
    const last = document.createElement("td");
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = `${axis.toUpperCase()} zero`;
    button.className = "needs-ready";
    button.hidden = !canZero;
    button.addEventListener("click", () => send({ do: "zero", axes: axis }));
    last.append(button);
    row.append(head, value, last);
    return row;
  }));
}

function stepSizes(machine, canHold) {
  const step = machine.axes.x.step_mm, select = find("step-size");
  const option = (value, text) => new Option(text, value);
  select.replaceChildren(
    ...(canHold ? [option("held", "while held")] : []),
    ...LENGTHS.map((mm) => option(mm, `${mm} mm`)),
    ...STEPS.map((count) => option(count * step, `${count} steps (${Number((count * step).toPrecision(4))} mm)`)),
  );
  find("pad-help").textContent = canHold
    ? "Hold a button or an arrow key; it stops when you let go, leave the page or lose the line."
    : "This controller moves by steps: each press is one.";
}

function overrides(names) {
  const box = find("overrides");
  box.hidden = !names.length;
  box.replaceChildren(box.firstElementChild, ...names.map((name) => {
    const label = document.createElement("label");
    const text = document.createElement("span");
    text.textContent = name;
    const range = document.createElement("input");
    range.type = "range";
    [range.min, range.max, range.step] = name === "rapid" ? [25, 100, 25] : [10, 200, 1];
    range.value = 100;
    range.id = `override-${name}`;
    range.addEventListener("change", () => send({ do: "override", name, percent: Number(range.value) }));
    const out = document.createElement("output");
    out.id = `override-${name}-shown`;
    out.textContent = "100 %";
    label.append(text, range, out);
    return label;
  }));
}

function showProgram(program) {
  find("program-name").textContent = program.name;
  find("progress-box").hidden = find("facts-box").hidden = false;
  find("errors").hidden = !program.failed;
  find("first").max = program.blocks;
  const left = find("resume-left");
  left.hidden = program.left_at === null;
  if (!left.hidden) left.textContent = `Go on behind block ${program.left_at}, where it was left`;
  find("facts").replaceChildren(...program.lines.flatMap(([name, text]) => {
    const dt = document.createElement("dt"), dd = document.createElement("dd");
    dt.textContent = name;
    dd.textContent = text;
    return [dt, dd];
  }));
  const count = program.findings.length;
  find("findings-box").hidden = !count;
  find("findings-box").open = program.failed;
  find("findings-count").textContent = `${count} finding${count === 1 ? "" : "s"}`;
  find("findings").replaceChildren(...program.findings.map((each) => {
    const item = document.createElement("li");
    item.className = each.severity;
    item.textContent = each.text;
    return item;
  }));
  const view = find("view");
  if (view.hidden) {
    view.hidden = false;
    view.src = `view?key=${encodeURIComponent(key)}`;
  }
}

function show(data) {
  state = data.state;
  commands = data.role === "command";
  find("role").textContent = commands ? (data.pages > 1 ? `${data.pages} pages; this one commands` : "") : "this page watches";
  find("take").hidden = commands;
  for (const each of data.messages) {
    const item = document.createElement("li");
    item.textContent = each.text;
    if (each.bad) item.className = "bad";
    find("messages").prepend(item);
  }
  draw();
}

function draw() {
  const ready = state.state === "ready" && commands;
  const runs = Boolean(state.runs), says = state.says ? ` (${state.says})` : "";
  find("state-word").textContent = { closed: "not connected", sending: runs ? "runs" : "moves" }[state.state] || state.state;
  find("state-word").textContent += says;
  find("why").textContent = state.why || "";
  find("state").toggleAttribute("data-bad", ["closed", "failed"].includes(state.state));
  find("connect").hidden = state.state !== "closed" || !first;
  for (const axis of ["x", "y", "z"]) {
    const cell = find(`at-${axis}`);
    if (cell) cell.textContent = state.place_mm ? state.place_mm["xyz".indexOf(axis)].toFixed(3) : "–";
  }
  for (const each of document.querySelectorAll("#pad button, .needs-ready, #home, #unlock, #zero-all, #typed button")) {
    each.disabled = !ready && !(each.closest("#pad") && held);
  }
  const program = first && first.program;
  const starts = ready && program && (!program.failed || find("despite").checked);
  for (const id of ["start", "single", "resume-left"]) find(id).disabled = !starts;
  find("pause").disabled = !(runs && commands && state.state === "sending");
  const halted = commands && HALTED.includes(state.state);
  find("go-on").disabled = !halted;
  find("step").disabled = !halted || !runs;
  for (const [name, percent] of Object.entries(state.overrides || {})) {
    const range = find(`override-${name}`);
    if (range && document.activeElement !== range) range.value = percent;
    if (range) find(`override-${name}-shown`).textContent = `${percent} %`;
  }
  if (program && runs) {
    const share = program.seconds ? 1 - state.left_s / program.seconds : 0;
    find("progress").value = share;
    find("progress-text").textContent = `block ${state.block} of ${program.blocks}, ${Math.floor(100 * share)} %, ${clock(state.left_s)} left`;
  }
  follow(runs);
}

function clock(seconds) {
  const whole = Math.round(seconds), two = (value) => String(value).padStart(2, "0");
  return whole < 3600 ? `${Math.floor(whole / 60)}:${two(whole % 60)}` : `${Math.floor(whole / 3600)}:${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)}`;
}

/** Show in the picture how far the program has come, and where the tool is. */
function follow(runs) {
  const view = find("view");
  if (view.hidden || !view.contentWindow) return;
  view.contentWindow.postMessage({ camtool: { block: runs ? state.block - 1 : null, place: state.place_mm || null } }, location.origin);
}

// By hand.

function hold(direction, button) {
  if (held || state.state !== "ready" || !commands) return;
  const size = find("step-size").value, feed = Number(find("feed").value);
  if (size !== "held") {
    const by = Object.fromEntries(Object.entries(direction).map(([axis, sense]) => [axis, sense * Number(size)]));
    send({ do: "jog", feed, ...by });
    return;
  }
  held = { direction, button };
  if (button) button.classList.add("held");
  send({ do: "jog", held: true, feed, ...direction });
  keeping = setInterval(() => send({ do: "keep" }), KEEP_MS);
}

function letGo() {
  if (!held) return;
  clearInterval(keeping);
  if (held.button) held.button.classList.remove("held");
  held = null;
  send({ do: "release" });
}

for (const button of document.querySelectorAll("#pad button")) {
  const direction = {};
  for (const axis of ["x", "y", "z"]) if (button.dataset[axis]) direction[axis] = Number(button.dataset[axis]);
  button.addEventListener("pointerdown", (event) => {
    if (event.button) return;
    event.preventDefault();
    button.focus();
    button.setPointerCapture(event.pointerId);
    hold(direction, button);
  });
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) button.addEventListener(name, letGo);
  button.addEventListener("contextmenu", (event) => event.preventDefault());
  button.addEventListener("keydown", (event) => {
    if (event.repeat || !["Enter", " "].includes(event.key)) return;
    event.preventDefault();
    event.stopPropagation();
    hold(direction, button);
  });
  button.addEventListener("keyup", letGo);
}
window.addEventListener("blur", letGo);
window.addEventListener("pagehide", letGo);
document.addEventListener("visibilitychange", () => { if (document.hidden) letGo(); });
document.addEventListener("keydown", (event) => {
  if (event.key === "Escape") {
    letGo();
    send({ do: "stop" });
    return;
  }
  const typing = event.target.closest("input, select, textarea, summary");
  if (typing || event.ctrlKey || event.altKey || event.metaKey) return;
  if (event.key === " " && !event.target.closest("button")) {
    event.preventDefault();
    send({ do: "pause" });
  } else if (KEYS[event.key]) {
    event.preventDefault();
    if (!event.repeat) hold(KEYS[event.key], null);
  }
});
document.addEventListener("keyup", (event) => { if (KEYS[event.key]) letGo(); });

// A gamepad: its stick or its cross moves as the arrow keys do.
const STICK = 0.5;
let pad = null;
function look() {
  const game = [...navigator.getGamepads()].find((each) => each && each.connected);
  const direction = {};
  if (game) {
    const [x, y, , z] = [0, 1, 2, 3].map((axis) => game.axes[axis] || 0);
    if (Math.abs(x) > STICK) direction.x = Math.sign(x);
    if (Math.abs(y) > STICK) direction.y = -Math.sign(y);
    if (!direction.x && !direction.y && Math.abs(z) > STICK) direction.z = -Math.sign(z);
  }
  const name = JSON.stringify(direction);
  if (name !== pad) {
    if (pad && pad !== "{}") letGo();
    if (name !== "{}" && document.hasFocus()) hold(direction, null);
    pad = name;
  }
  requestAnimationFrame(look);
}
window.addEventListener("gamepadconnected", () => requestAnimationFrame(look), { once: true });

// Buttons.

const start = (more) => send({ do: "start", despite_errors: find("despite").checked, first: Number(find("first").value) || 1, ...more });
find("stop").addEventListener("click", () => { letGo(); send({ do: "stop" }); });
find("start").addEventListener("click", () => start({}));
find("single").addEventListener("click", () => start({ single: true }));
find("resume-left").addEventListener("click", () => start({ resumes: true, first: 1 }));
find("pause").addEventListener("click", () => send({ do: "pause" }));
find("go-on").addEventListener("click", () => send({ do: "resume" }));
find("step").addEventListener("click", () => send({ do: "resume", single: true }));
find("zero-all").addEventListener("click", () => send({ do: "zero", axes: "xyz" }));
find("connect").addEventListener("click", () => send({ do: "connect" }));
find("take").addEventListener("click", () => send({ do: "take" }));
find("despite").addEventListener("change", draw);
for (const button of document.querySelectorAll("[data-order]")) {
  button.addEventListener("click", () => send({ do: "order", action: button.dataset.order }));
}
find("typed").addEventListener("submit", (event) => {
  event.preventDefault();
  const text = find("line").value;
  if (text.trim()) send({ do: "line", text });
  find("line").value = "";
});

connect();
draw();

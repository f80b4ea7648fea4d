"use strict";
// The panel's page: it shows the state that the server sends, and sends what the user wants.

const find = (id) => document.getElementById(id);
const key = new URLSearchParams(location.search).get("key") || "";
const KEEP_MS = 20; // a held key is confirmed so often
const STEPS = [1, 10, 14, 28, 50, 100, 1000];
const LENGTHS = [0.01, 0.1, 1, 10];
const SPEEDS = { slow: 0.05, medium: 0.3, fast: 1 }; // shares of the highest rate of X
const AXES = ["x", "y", "z"];
const TOOL_AT = { "": "is where the controller says", journal: "has stayed where it was left", zero: "stands at part zero", known: "was moved, and the controller knows" };
const ORDERS = { home: "home", zero: "zero", jog: "jog", hold: "jog as long as a key is held", unlock: "unlock", line: "take a typed line" };
const HALTED = ["paused", "waiting"];
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
  find("go").hidden = !can("jog");
  find("go-machine").hidden = !can("home");
  find("touch").hidden = !data.probes;
  const cannot = Object.keys(ORDERS).filter((action) => !can(action) && !(action === "unlock" && !can("home")));
  const missing = cannot.map((action) => ORDERS[action]).concat(data.overrides.length ? [] : ["override feed or spindle"]);
  find("cannot").textContent = missing.length ? `Over its line this controller cannot: ${missing.join(", ")}.` : "";
  find("places-caption").textContent = data.reported ? "position, mm, as the controller reports it" : "position, mm, counted from steps and orders since the panel began or zeroed it";
  places(can("zero") && data.zeroes_each);
  speeds(machine);
  stepSizes(machine, can("hold"));
  overrides(data.overrides);
  choices("tool-at", data.tool_at.map((name) => [name, TOOL_AT[name]]));
  choices("load-name", data.programs.map((name) => [name, name]), data.program && data.program.name);
  find("load-box").hidden = !data.programs.length;
  if (program) showProgram(program);
}

/** Replace the options of a select, and keep what was chosen; at first it is `first`. */
function choices(id, pairs, first) {
  const select = find(id), chosen = select.value || first;
  select.replaceChildren(...pairs.map(([value, text]) => new Option(text, value)));
  if (pairs.some(([value]) => value === chosen)) select.value = chosen;
}

function speeds(machine) {
  const top = machine.axes.x.max_rate_mm_min || machine.feed_mm_min;
  const rounded = (feed) => Number(feed.toPrecision(2));
  choices("speed", Object.entries(SPEEDS).map(([name, share]) => [rounded(top * share), `${name}, ${rounded(top * share)} mm/min`]));
  if (!find("feed").value) {
    find("speed").selectedIndex = 1;
    find("feed").value = find("speed").value;
  }
}

function places(canZero) {
  const body = find("places").tBodies[0];
  if (body.rows.length) return;
  body.replaceChildren(...AXES.map((axis) => {
    const row = document.createElement("tr");
    const head = document.createElement("th");
    head.scope = "row";
    head.textContent = axis.toUpperCase();
    const values = ["at", "machine", "programmed"].map((name) => {
      const value = document.createElement("td");
      value.id = `${name}-${axis}`;
      value.textContent = "–";
      return value;
    });
    const last = document.createElement("td");
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = "zero";
    button.ariaLabel = `${axis.toUpperCase()} zero here`;
    button.className = "needs-ready";
    button.hidden = !canZero;
    button.addEventListener("click", () => send({ do: "zero", axes: axis }));
    last.append(button);
    row.append(head, ...values, last);
    return row;
  }));
}

function stepSizes(machine, canHold) {
  const step = machine.axes.x.step_mm;
  choices("step-size", [
    ...(canHold ? [["held", "while held"]] : []),
    ...LENGTHS.map((mm) => [String(mm), `${mm} mm`]),
    ...STEPS.map((count) => [`${count} steps`, `${count} steps (${Number((count * step).toPrecision(4))} mm)`]),
  ]);
  find("pad-help").textContent = canHold
    ? "Hold a button or an arrow key; it stops when you let go, leave the page or lose the line."
    : "This controller moves by steps: each press is one.";
}

/** The length, mm, of a step of an axis: the preset is so long, or so many steps of that axis. */
function lengthOf(axis) {
  const size = find("step-size").value;
  return size.endsWith("steps") ? parseInt(size, 10) * first.machine.axes[axis].step_mm : Number(size);
}

function overrides(names) {
  const box = find("overrides");
  if (box.querySelector("input")) return;
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
  find("resume-box").hidden = program.left_at === null;
  find("resume-left").textContent = `Go on behind block ${program.left_at}, where it was left`;
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
  if (view.dataset.shows === program.sha256) return;
  view.dataset.shows = program.sha256;
  view.hidden = false;
  view.src = `view?key=${encodeURIComponent(key)}&program=${program.sha256}`;
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
  AXES.forEach((axis, k) => {
    for (const [name, place] of [["at", state.place_mm], ["machine", state.machine_mm], ["programmed", state.programmed_mm]]) {
      const cell = find(`${name}-${axis}`);
      if (cell) cell.textContent = place ? place[k].toFixed(3) : "–";
    }
  });
  monitor();
  halt(ready);
  for (const each of document.querySelectorAll("#pad button, .needs-ready, #home, #unlock, #zero-all, #typed button, #go button, #load, #touch button")) {
    each.disabled = !ready && !(each.closest("#pad") && held);
  }
  const program = first && first.program;
  const starts = ready && program && (!program.failed || find("despite").checked);
  for (const id of ["start", "single", "resume-left"]) find(id).disabled = !starts;
  if (!state.is_homed) find("go-machine").disabled = true;
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
    find("progress-text").textContent = `block ${state.block} of ${program.blocks}, ${Math.floor(100 * share)} %, ${clock(state.left_s)} left by what is acknowledged`;
  }
  follow(runs);
}

/** What the machine does now, as far as it is known. */
function monitor() {
  const number = (value, digits, unit) => (value === null || value === undefined ? "–" : `${value.toFixed(digits)} ${unit}`);
  find("now-feed").textContent = number(state.feed_mm_min, 1, "mm/min");
  find("now-steps").textContent = number(state.step_hz, 1, "Hz");
  find("now-rpm").textContent = number(state.rpm, 0, "rev/min");
  const under = (state.sent || 0) - (state.acknowledged || 0);
  find("now-buffer").textContent = state.runs ? `${under} block${under === 1 ? "" : "s"}, ${state.buffered} bytes sent and not acknowledged` : "–";
  const ends = state.travel_mm, span = (k) => (ends[0][k] === null ? "" : `${AXES[k].toUpperCase()} ${ends[0][k].toFixed(1)} to ${ends[1][k].toFixed(1)}`);
  find("now-travel").textContent = ends ? [0, 1, 2].map(span).filter(Boolean).join(", ") || "not known" : "not watched: it was not homed from here";
}

/** A program that waits for the user, and one that was left to touch off a tool. */
function halt(ready) {
  const left = ready && state.change_first > 0, waits = state.state === "waiting";
  find("halt").hidden = !left && !waits;
  const text = left ? `The program waits at its stop. Change the tool, touch off (jog, then zero), then go on with block ${state.change_first}.` : state.why;
  if (find("halt-text").textContent !== text) find("halt-text").textContent = text;
  find("halt-on").textContent = left ? `Go on with block ${state.change_first}` : "Go on";
  find("halt-on").disabled = !commands;
  find("leave").hidden = left || !state.stops;
  find("leave").disabled = !commands;
}

function clock(seconds) {
  const whole = Math.round(seconds), two = (value) => String(value).padStart(2, "0");
  return whole < 3600 ? `${Math.floor(whole / 60)}:${two(whole % 60)}` : `${Math.floor(whole / 3600)}:${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)}`;
}

/** Show in the picture how far the program has come, and where the tool is. */
function follow(runs) {
  const view = find("view");
  if (view.hidden || !view.contentWindow) return;
  const ends = state.travel_mm, known = ends && ends[0][0] !== null && ends[0][1] !== null;
  const travel = known ? [ends[0][0], ends[0][1], ends[1][0], ends[1][1]] : null;
  view.contentWindow.postMessage({ camtool: { block: runs ? state.block - 1 : null, place: state.place_mm || null, travel } }, location.origin);
}

// By hand.

function hold(direction, button) {
  if (held || state.state !== "ready" || !commands) return;
  const feed = Number(find("feed").value);
  if (find("step-size").value !== "held") {
    const by = Object.fromEntries(Object.entries(direction).map(([axis, sense]) => [axis, sense * lengthOf(axis)]));
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
  for (const axis of AXES) if (button.dataset[axis]) direction[axis] = Number(button.dataset[axis]);
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
find("resume-left").addEventListener("click", () => start({ resumes: true, first: 1, tool_at: find("tool-at").value }));
find("halt-on").addEventListener("click", () => {
  if (state.state === "waiting") send({ do: "resume" });
  else start({ first: state.change_first, more: true });
});
find("leave").addEventListener("click", () => send({ do: "leave" }));
find("load").addEventListener("click", () => send({ do: "load", name: find("load-name").value }));
find("speed").addEventListener("change", () => { find("feed").value = find("speed").value; });
const go = (places) => send({ do: "go", feed: Number(find("feed").value), ...places });
find("go").addEventListener("submit", (event) => {
  event.preventDefault();
  const places = {};
  for (const axis of AXES) if (find(`go-${axis}`).value !== "") places[axis] = Number(find(`go-${axis}`).value);
  if (Object.keys(places).length) go(places);
});
find("touch").addEventListener("submit", (event) => {
  event.preventDefault();
  const number = (name) => Number(find(`touch-${name}`).value), what = find("touch-what").value;
  const towards = ["edge", "corner", "skew"].includes(what) ? find("touch-towards").value : "";
  send({ do: "touch", what, towards, ...Object.fromEntries(["thickness", "diameter", "along", "reach", "feed"].map((name) => [name, number(name)])) });
});
find("go-part").addEventListener("click", () => go({ x: 0, y: 0 }));
find("go-part-z").addEventListener("click", () => go({ z: 0 }));
find("go-machine").addEventListener("click", () => go({ machine: true }));
window.addEventListener("message", (event) => {
  if (event.source === find("view").contentWindow && event.origin === location.origin && event.data.camtool === "stop") send({ do: "stop" });
});
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

// Play, pause, the slider and the clock.

const SLIDER_STEPS = 10000;
const WHOLE_SECONDS = 20;
const WAITED_MS = 250;
/** While it plays, words are written no more often than this: they cost more than the picture. */
const WORDS_MS = 120;

class Player {
  constructor(run, moved) {
    this.run = run;
    this.moved = moved;
    this.playing = false;
    this.slider = find("slider");
    this.slider.max = String(SLIDER_STEPS);
    this.slider.addEventListener("input", () => {
      const share = Number(this.slider.value) / SLIDER_STEPS;
      if (share >= 1) this.run.toEnd();
      else this.run.toTime(share * this.run.total);
      this.show();
    });
    find("play").addEventListener("click", () => this.toggle());
    this.show();
  }

  /** Seconds of the machine per second of the viewer. */
  get speed() {
    const chosen = find("speed").value;
    return chosen === "whole" ? this.run.total / WHOLE_SECONDS : Number(chosen);
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  play() {
    if (this.run.isAtEnd) this.run.toStart();
    this.playing = true;
    this.then = performance.now();
    this.label();
    requestAnimationFrame((now) => this.step(now));
  }

  pause() {
    this.playing = false;
    this.label();
    this.show();
  }

  label() {
    find("play").textContent = this.playing ? "Pause" : "Play";
    find("play").setAttribute("aria-pressed", String(this.playing));
  }

  step(now) {
    if (!this.playing) return;
    // A page that was in the background continues where it was.
    const passed = Math.min(WAITED_MS, Math.max(0, now - this.then)) / 1000;
    this.then = now;
    const time = this.run.time + passed * this.speed;
    if (time >= this.run.total) {
      this.run.toEnd();
      this.pause();
    } else this.run.toTime(time);
    this.show();
    if (this.playing) requestAnimationFrame((next) => this.step(next));
  }

  toRow(row) {
    this.pause();
    this.run.toRow(row);
    this.show();
  }

  toStart() {
    this.pause();
    this.run.toStart();
    this.show();
  }

  faster(step) {
    const speed = find("speed"), next = speed.selectedIndex + step;
    speed.selectedIndex = Math.min(speed.options.length - 1, Math.max(0, next));
  }

  show() {
    const now = performance.now(), isSoon = this.playing && now - this.told < WORDS_MS;
    if (!isSoon) this.tell();
    this.moved(!isSoon);
  }

  tell() {
    this.told = performance.now();
    const { run } = this, share = run.total ? run.time / run.total : 1;
    this.slider.value = String(Math.round(share * SLIDER_STEPS));
    this.slider.setAttribute("aria-valuetext", `${clock(run.time)}, move ${run.row + 1}`);
    find("clock").textContent = `${clock(run.time)} of ${clock(run.total)}`;
  }
}

// The mouse, fingers and keys on the picture.

const REACH_PX = 8;
const CLICK_PX = 4;
const WHEEL_RATE = 0.0015;
const KEY_ZOOM = 1.4;
const KEY_PAN_PX = 60;

/** Drag to move, wheel or two fingers to zoom, hover for facts, click to go to a move. */
class Pointer {
  constructor(stage, hovered, clicked) {
    this.stage = stage;
    this.hovered = hovered;
    this.fingers = new Map();
    const { place } = stage, at = (event) => {
      const box = place.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    place.addEventListener("wheel", (event) => {
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 30 : 1;
      stage.shown.zoom(Math.exp(-event.deltaY * lines * WHEEL_RATE), ...at(event));
    }, { passive: false });
    place.addEventListener("pointerdown", (event) => {
      place.setPointerCapture(event.pointerId);
      this.fingers.set(event.pointerId, at(event));
      this.travel = 0;
    });
    place.addEventListener("pointermove", (event) => {
      if (this.fingers.has(event.pointerId)) this.drag(event, at(event));
      else this.hover(...at(event));
    });
    const lift = (event) => {
      const tapped = this.fingers.delete(event.pointerId) && this.travel < CLICK_PX;
      if (tapped && event.type === "pointerup") clicked();
    };
    place.addEventListener("pointerup", lift);
    place.addEventListener("pointercancel", lift);
    place.addEventListener("pointerleave", () => hovered(-1, -1, 0, 0));
    place.addEventListener("dblclick", () => stage.shown.fit());
    place.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  /** One finger or the left button drags, which turns the view in depth; two fingers, another
   * button or Shift move it, and the distance of two fingers zooms. */
  drag(event, [x, y]) {
    const { shown } = this.stage, id = event.pointerId, [oldX, oldY] = this.fingers.get(id);
    this.travel += Math.hypot(x - oldX, y - oldY);
    this.fingers.set(id, [x, y]);
    const other = [...this.fingers].find(([finger]) => finger !== id);
    if (other) {
      const [u, v] = other[1], before = Math.hypot(oldX - u, oldY - v);
      shown.pan((x - oldX) / 2, (y - oldY) / 2);
      if (before > 0) shown.zoom(Math.hypot(x - u, y - v) / before, (x + u) / 2, (y + v) / 2);
    } else if (event.buttons > 1 || event.shiftKey) shown.pan(x - oldX, y - oldY);
    else shown.drag(x - oldX, y - oldY);
  }

  hover(px, py) {
    if (this.stage.shown !== this.stage) {
      const found = this.stage.depth.under(px, py);
      this.hovered(found ? found.row : -1, -1, px, py, found);
      return;
    }
    const { view, layers, grids, run } = this.stage, reach = REACH_PX / view.scale;
    const x = view.mmX(px), y = view.mmY(py);
    // Moves that are done come before those that are not.
    const rank = (row) => (run.row < row ? -row : row);
    const move = grids.moves().nearest(x, y, reach, (row) => layers.shows(row), rank);
    const { drawn_layer: of } = layers.columns, shown = (row) => layers.on.get(`drawing ${of[row]}`);
    const drawn = grids.drawing().nearest(x, y, reach, shown, (row) => row);
    this.hovered(move, drawn, px, py);
  }
}

/** Do what a key means; false for a key without a meaning. */
function pressed(event, { stage, player, panel }) {
  const { view, shown } = stage, middle = [view.width / 2, view.height / 2];
  const pan = (dx, dy) => shown.pan(dx * KEY_PAN_PX, dy * KEY_PAN_PX);
  const zoom = (factor) => shown.zoom(factor, ...middle);
  const step = (rows) => player && player.toRow(player.run.row + rows);
  const arrows = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  if (event.shiftKey && arrows[event.key]) { pan(...arrows[event.key]); return true; }
  if (shown !== stage) {
    if (arrows[event.key]) {
      const [across, down] = arrows[event.key];
      shown.turn(shown.azimuth - across * KEY_TURN, shown.elevation + down * KEY_TURN);
      shown.changed();
      return true;
    }
    if (event.key === "l" || SIDES[event.key]) {
      if (event.key === "l") find("path-shown").click();
      else shown.from(event.key);
      return true;
    }
  }
  const actions = {
    " ": () => player && player.toggle(),
    ArrowLeft: () => step(-1),
    ArrowRight: () => step(1),
    ",": () => step(-1),
    ".": () => step(1),
    PageUp: () => step(-100),
    PageDown: () => step(100),
    Home: () => player && player.toStart(),
    End: () => player && player.toRow(player.run.count - 1),
    ArrowUp: () => player && player.faster(1),
    ArrowDown: () => player && player.faster(-1),
    "+": () => zoom(KEY_ZOOM),
    "=": () => zoom(KEY_ZOOM),
    "-": () => zoom(1 / KEY_ZOOM),
    0: () => shown.fit(),
    f: () => shown.fit(),
    g: () => find("in-depth").hidden || find("in-depth").click(),
    e: () => panel.nextColour(),
    m: () => panel.nextTimes(1),
    M: () => panel.nextTimes(-1),
    "?": () => showHelp(find("help").hidden),
    Escape: () => showHelp(false),
  };
  if (actions[event.key]) actions[event.key]();
  else return panel.toggle(event.key);
  return true;
}

// Start: read the data of the page and connect all parts.

function begin() {
  const head = JSON.parse(find("head").textContent);
  const columns = readColumns(head.columns, find("columns").textContent);
  find("columns").textContent = "";
  if (head.blocks !== null) head.blocks = head.blocks.split("\n");
  const tracks = {
    moves: movesTrack(columns), drawing: drawingTrack(columns), wanted: wantedTrack(columns),
  };
  const layers = new Layers(head, columns), run = new Run(columns.move_seconds);
  const stage = new Stage(find("stage"), tracks, layers, run);
  stage.grids = lazyGrids(tracks);
  if (head.stock) stage.depth = new Depth(stage, head, columns, run);

  const panel = new LayerPanel(layers, () => stage.changed());
  const listing = new Listing(head, columns, (row) => player.toRow(row));
  let player = null;
  const moved = (isTold) => {
    stage.soon("moved");
    if (!isTold) return;
    showMove(head, columns, run, stage.depth);
    const block = columns.move_block[run.row];
    listing.show(block, block);
  };
  if (tracks.moves.count) player = new Player(run, moved);
  else document.body.classList.add("still");
  const look = (at) => {
    stage.shown.look(at);
    stage.place.scrollIntoView({ block: "nearest" });
  };
  showTables(head, (row) => {
    player.toRow(row);
    look(tracks.moves.at(row, 1));
  }, look);

  const hovered = (move, drawn, px, py, at) => {
    stage.hover = { moves: move, drawing: drawn, at };
    showTip({ head, columns, run, listing }, stage.hover, px, py);
    stage.soon("hover");
  };
  const clicked = () => {
    if (player && stage.hover.moves >= 0) player.toRow(stage.hover.moves);
  };
  new Pointer(stage, hovered, clicked);
  listen({ stage, player, panel });
  if (find("sent")) follow(JSON.parse(find("sent").textContent), stage, player);
  if (window.parent !== window) listenToFrame(columns, stage, player);
  document.body.dataset.ready = "yes";
}

/** Within the panel: its page says how far the program has come, by block, and where the tool and
 * the travel are; it is told that Escape was pressed here. */
function listenToFrame(columns, stage, player) {
  let shown = null;
  window.addEventListener("keydown", (event) => {
    if (event.key === "Escape") window.parent.postMessage({ camtool: "stop" }, location.origin);
  });
  window.addEventListener("message", (event) => {
    const said = event.origin === location.origin && event.data ? event.data.camtool : null;
    if (!said || !player || JSON.stringify(said) === shown) return;
    shown = JSON.stringify(said);
    stage.run.place = said.place;
    stage.run.travel = said.travel;
    if (said.block !== null) {
      const rows = columns.move_block;
      let low = 0, high = rows.length;
      while (low < high) {
        const middle = (low + high) >> 1;
        if (rows[middle] <= said.block) low = middle + 1;
        else high = middle;
      }
      if (low) stage.run.toRow(low - 1);
      else stage.run.toNothing();
      player.show();
    }
    stage.changed();
  });
}

const UNTOUCHED_MS = 1500;

/** Show how far a program is that is being sent, and load the page again for the next state, with
 * the view as it is; not while somebody touches it. */
function follow(sent, stage, player) {
  document.title = sent.title;
  const { run, view, depth } = stage, kept = history.state || {};
  if (sent.row < 0) run.toNothing();
  else run.toRow(sent.row);
  run.place = sent.place;
  if (player) player.show();
  find("controls").hidden = Boolean(sent.again_ms);
  if (kept.view) Object.assign(view, kept.view);
  if (kept.depth && depth) {
    find("in-depth").click();
    depth.turn(kept.depth.azimuth, kept.depth.elevation);
    Object.assign(depth, kept.depth);
  }
  stage.changed();
  if (!sent.again_ms) return;
  let touched = -Infinity;
  for (const name of ["pointerdown", "pointermove", "wheel", "keydown", "input"]) {
    window.addEventListener(name, (event) => {
      if (name !== "pointermove" || event.buttons) touched = performance.now();
    }, { passive: true });
  }
  setInterval(() => {
    if (performance.now() - touched < UNTOUCHED_MS) return;
    const { x, y, scale, isFitted } = view, flat = isFitted ? null : { x, y, scale, isFitted };
    const deep = depth && depth.isOn ? { azimuth: depth.azimuth, elevation: depth.elevation, centre: depth.centre, scale: depth.scale } : null;
    history.replaceState({ view: flat, depth: deep }, "");
    location.reload();
  }, sent.again_ms);
}

/** Grids are made when they are first needed: so the page opens sooner. */
function lazyGrids(tracks) {
  const made = {};
  const grid = (name) => () => (made[name] = made[name] || new Grid(tracks[name]));
  return { moves: grid("moves"), drawing: grid("drawing") };
}

function listen(parts) {
  const { stage, panel } = parts;
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const { tagName, type } = event.target;
    const typing = tagName === "SELECT" || (tagName === "BUTTON" && event.key === " ");
    if (typing || (type === "checkbox" && event.key === " ")) return;
    if (pressed(event, parts)) event.preventDefault();
  });
  new ResizeObserver(() => stage.resize()).observe(stage.place);
  const anew = () => { panel.scale(); stage.changed(); };
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", anew);
  const print = (printing) => () => {
    stage.layers.printing = printing;
    document.documentElement.classList.toggle("paper", printing);
    panel.scale();
    stage.paintNow();
  };
  window.addEventListener("beforeprint", print(true));
  window.addEventListener("afterprint", print(false));
  find("fit").addEventListener("click", () => stage.shown.fit());
  listenDepth(stage);
  find("help-button").addEventListener("click", () => showHelp(find("help").hidden));
}

/** The switch between plan and depth, and the section. */
function listenDepth(stage) {
  const button = find("in-depth"), { depth } = stage;
  button.hidden = !depth;
  if (!depth) return;
  button.addEventListener("click", () => {
    if (!depth.start()) {
      find("no-depth").hidden = false;
      button.disabled = true;
      return;
    }
    depth.isOn = !depth.isOn;
    button.setAttribute("aria-pressed", String(depth.isOn));
    stage.place.classList.toggle("deep", depth.isOn);
    find("section").hidden = !depth.isOn;
    find("no-tool").hidden = !depth.isOn || depth.turns.length > 0;
    find("tip").hidden = true;
    stage.wantsAll = true;
    stage.soon("all");
  });
  find("side").addEventListener("change", () => depth.from(find("side").value));
  find("section").addEventListener("input", () => {
    depth.hasPath = find("path-shown").checked;
    depth.section = { axis: find("section-axis").value, share: Number(find("section-at").value) / 1000 };
    find("section-at").disabled = !depth.section.axis;
    depth.changed();
  });
}

function showHelp(isShown) {
  find("help").hidden = !isShown;
  find("help-button").setAttribute("aria-expanded", String(isShown));
}

/** The current move, and where the tip of the tool is now, beside the picture. */
function showMove(head, columns, run, depth) {
  const facts = moveFacts(head, columns, run, run.row);
  if (depth) {
    const [x, y, z] = (run.place || [...depth.slides.place(run.row, run.share)]).map((value) => value.toFixed(3));
    facts.unshift(["tool at", `X ${x}  Y ${y}  Z ${z} mm`]);
  }
  find("now").replaceChildren(factTable(facts));
}

/** The facts of what lies under the cursor, beside the cursor. */
function showTip({ head, columns, run, listing }, hover, px, py) {
  const tip = find("tip"), block = hover.moves >= 0 ? columns.move_block[hover.moves] : -1;
  tip.hidden = hover.moves < 0 && hover.drawing < 0 && !hover.at;
  const now = columns.move_block.length ? columns.move_block[run.row] : 0;
  listing.show(block >= 0 ? block : now, block >= 0 ? block : now);
  if (tip.hidden) return;
  const moved = hover.moves >= 0 ? moveFacts(head, columns, run, hover.moves) : [];
  const drawn = hover.drawing >= 0 ? drawnFacts(head, columns, hover.drawing) : [];
  const place = hover.at ? [["place", `X ${hover.at.x.toFixed(2)}  Y ${hover.at.y.toFixed(2)}  Z ${hover.at.z.toFixed(3)} mm`]] : [];
  tip.replaceChildren(factTable([...place, ...moved, ...drawn]));
  const stage = find("stage"), right = px > stage.clientWidth / 2, low = py > stage.clientHeight / 2;
  tip.style.left = `${px + (right ? -14 - tip.offsetWidth : 14)}px`;
  tip.style.top = `${py + (low ? -14 - tip.offsetHeight : 14)}px`;
}

begin();

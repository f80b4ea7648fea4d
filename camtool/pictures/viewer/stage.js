// The program along its time: which move runs when, and how far it has come.

class Run {
  /** `seconds` (N,) of each move. */
  constructor(seconds) {
    this.count = seconds.length;
    this.ends = new Float64Array(this.count);
    let sum = 0;
    for (let row = 0; row < this.count; row++) this.ends[row] = sum += seconds[row];
    this.total = sum;
    this.toEnd();
  }

  begins(row) { return row > 0 ? this.ends[row - 1] : 0; }

  toTime(time) {
    this.place = null;
    this.time = Math.min(this.total, Math.max(0, time));
    let low = 0, high = this.count - 1;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.ends[middle] > this.time) high = middle;
      else low = middle + 1;
    }
    const begin = this.begins(low), lasts = this.ends[low] - begin;
    this.row = low;
    this.share = lasts > 0 ? Math.min(1, (this.time - begin) / lasts) : 1;
  }

  /** To the end of a move. */
  toRow(row) {
    this.place = null;
    this.row = Math.min(this.count - 1, Math.max(0, row));
    this.share = 1;
    this.time = this.ends[this.row];
  }

  toStart() {
    this.toTime(0);
    this.share = this.time === this.ends[this.row] ? 1 : 0;
  }

  /** Before the first move. */
  toNothing() { this.time = this.row = this.share = 0; }

  toEnd() { this.toRow(this.count - 1); }

  get isAtEnd() { return this.row === this.count - 1 && this.share === 1; }
}

/** Seconds as h:mm:ss.s */
function clock(seconds) {
  const tenths = Math.round(seconds * 10), whole = Math.floor(tenths / 10);
  const two = (number) => String(number).padStart(2, "0");
  const hours = Math.floor(whole / 3600), minutes = Math.floor(whole / 60) % 60;
  return `${hours}:${two(minutes)}:${two(whole % 60)}.${tenths % 10}`;
}

// The layers: which are on, how moves are coloured, and the styles in which all are drawn.

const SORTS = ["rapid", "feed", "plunge"];
/** Style of entries, counted from the end of the map, and the greatest engagement, degrees. */
const ENTRY = 3;
const HALF_CIRCLE = 180;
const COLOURS = [
  "paper", "ink", "quiet", "grid", "drawing", "feed", "rapid", "plunge", "pale", "tool", "pick",
  "swept", "travel", "wanted", "stock", "cut", "section", "entry",
];

/** The page's colours of now: light or dark as the system prefers, light on paper. */
function palette() {
  const style = getComputedStyle(document.documentElement);
  return Object.fromEntries(COLOURS.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

class Layers {
  constructor(head, columns) {
    this.head = head;
    this.columns = columns;
    this.on = new Map();
    this.list = [];
    this.times = 1;
    this.points = columns.trace_point;
    this.listAll();
    this.by = "kind";
    this.sortOf = columns.move_sort;
    this.binOf = this.bins();
  }

  /** The layers that the page has, from the ground up. With a predicted path, starts, order and
   * directions are off at first. */
  listAll() {
    const { head, columns } = this, plain = !columns.trace_row.length;
    head.layers.forEach((layer, index) => {
      const name = layer.name ? `drawing: ${layer.name}` : "drawing";
      this.add(`drawing ${index}`, name, index < 9 ? String(index + 1) : "");
    });
    const moves = columns.move_kind.length > 0, travel = head.travel_mm;
    const width = head.tool_mm === null ? "" : Number(head.tool_mm.toPrecision(4));
    if (moves && width) this.add("swept", `tool's width, ${width} mm`, "s");
    if (columns.move_wide.length && head.swept) this.add("swept", head.swept, "s");
    if (travel) this.add("travel", `travel, ${travel[0]} × ${travel[1]} mm`, "t");
    if (moves) {
      this.add("rapid", "rapids", "r");
      this.add("feed", "feeds", "c");
      this.add("plunge", "slopes and plunges", "p");
    }
    if (columns.wanted_to.length) this.add("wanted", "wanted path", "w");
    if (!plain) this.add("trace", "predicted path, by error", "d");
    if (columns.start_at.length) {
      this.add("start", "starts", "b", plain);
      this.add("order", "order of contours", "o", plain);
      this.add("arrow", "directions", "a", plain);
    }
    for (const { name, key, on, parts } of head.rows) this.add(`row ${name}`, name, key, on, parts);
    if (head.worst.length) this.add("worst", "worst places", "x");
    if (head.ambiguous.length) this.add("ambiguous", "open ends, crossings", "u");
    this.add("zero", "part zero", "z");
  }

  add(key, name, letter, isOn = true, parts = []) {
    this.list.push({ key, name, letter, parts });
    this.on.set(key, isOn);
  }

  /** Draw deviations `times` as large from now on. */
  exaggerate(times) {
    this.times = times;
    const { trace_point: points, trace_off: off } = this.columns, more = (times - 1) * this.head.off_mm;
    this.points = times === 1 ? points : points.map((at, k) => at + more * off[k]);
  }

  /** [left, low, right, high] mm of the predicted path while it cuts; null without one. */
  traced() {
    const { points } = this, bins = this.columns.trace_bin, none = this.head.map.light.length;
    const box = [Infinity, Infinity, -Infinity, -Infinity];
    for (let at = 0; at < bins.length; at++) {
      if (bins[at] === none) continue;
      const x = points[2 * at], y = points[2 * at + 1];
      box[0] = Math.min(box[0], x);
      box[1] = Math.min(box[1], y);
      box[2] = Math.max(box[2], x);
      box[3] = Math.max(box[3], y);
    }
    return box[0] <= box[2] ? box : null;
  }

  bin(um) {
    const count = this.head.map.light.length;
    if (!(um >= 0)) return count;
    return Math.min(count - 1, Math.floor((um / this.head.top_um) * count));
  }

  /** The step of the map of each move, by error, height and engagement; one beyond the last where
   * unknown, and where nothing is cut, ENTRY beyond it in entries. */
  bins() {
    const { move_error: errors, move_kind: kinds, move_end: ends, move_engaged: angles } = this.columns;
    const count = this.head.map.light.length, rows = kinds.length;
    const error = new Uint8Array(rows), height = new Uint8Array(rows);
    let low = Infinity, high = -Infinity;
    for (let row = 0; row < rows; row++) {
      low = Math.min(low, ends[3 * row + 2]);
      high = Math.max(high, ends[3 * row + 2]);
    }
    this.heights = rows ? [low, high] : [0, 0];
    for (let row = 0; row < rows; row++) {
      error[row] = this.bin(errors[row]);
      const share = high > low ? (high - ends[3 * row + 2]) / (high - low) : 0;
      height[row] = Math.min(count - 1, Math.floor(share * count));
    }
    const engagement = Uint8Array.from(angles, (angle) => {
      if (angle < 0) return count + ENTRY;
      return angle >= 0 ? Math.min(count - 1, Math.floor((angle / HALF_CIRCLE) * count)) : count;
    });
    return { error, height, engagement };
  }

  /** Whether moves have the colours of their kinds. */
  get isPlain() { return this.by === "kind" || this.by === "beside"; }

  get isDark() { return matchMedia("(prefers-color-scheme: dark)").matches && !this.printing; }

  /** A colour that is given for light and for dark ground; undefined for none. */
  tone(colours) { return colours ? colours[this.isDark ? "dark" : "light"] : undefined; }

  mapColours() { return this.isDark ? this.head.map.dark : this.head.map.light; }

  /** The style of each move: by its sort while moves are coloured by kind, else by the map. */
  moveStyles(colours) {
    const drawn = (sort, style) => (this.on.get(sort) ? style : null);
    const rapid = drawn("rapid", { colour: colours.rapid, width: 1, dash: [5, 4] });
    const plunge = drawn("plunge", { colour: colours.plunge, width: 1.5 });
    if (this.isPlain) {
      const feed = drawn("feed", { colour: colours.feed, width: 1.5 });
      return { of: this.sortOf, styles: [rapid, feed, plunge] };
    }
    const map = this.mapColours().map((colour) => drawn("feed", { colour, width: 2 }));
    const unknown = drawn("feed", { colour: colours.pale, width: 1 });
    const entry = drawn("feed", { colour: colours.entry, width: 2 });
    return { of: this.styleByMap(map.length), styles: [...map, unknown, rapid, plunge, entry] };
  }

  styleByMap(count) {
    if (this.styled && this.styled.by === this.by) return this.styled.of;
    const bins = this.binOf[this.by], of = new Uint8Array(bins.length);
    this.styled = { by: this.by, of };
    for (let row = 0; row < of.length; row++) {
      const sort = this.sortOf[row];
      of[row] = sort === 0 ? count + 1 : sort === 2 && this.by === "error" ? count + 2 : bins[row];
    }
    return of;
  }

  paleStyles(colours) {
    const pale = (sort, dash) => (
      this.on.get(sort) ? { colour: colours.pale, width: 1, dash } : null
    );
    return { of: this.sortOf, styles: [pale("rapid", [5, 4]), pale("feed"), pale("plunge")] };
  }

  traceStyles() {
    if (!this.on.get("trace")) return [];
    return [...this.mapColours().map((colour) => ({ colour, width: 2 })), null];
  }

  /** How wide the tool cuts where it is, mm; null where that is not known. */
  widthAt({ row, share }) {
    const wide = this.columns.move_wide;
    if (!wide.length) return this.head.tool_mm;
    return 2 * (wide[2 * row] + share * (wide[2 * row + 1] - wide[2 * row]));
  }

  /** Cuts at the true width of the tool. */
  sweptStyles(colours, scale) {
    if (!this.on.get("swept") || this.head.tool_mm === null) return [null, null, null];
    const wide = { colour: colours.swept, width: this.head.tool_mm * scale };
    return [null, wide, wide];
  }

  drawingStyles(colours, everyLayer = false) {
    const alone = !this.columns.move_kind.length;
    return this.head.layers.map((layer, index) => {
      if (!everyLayer && !this.on.get(`drawing ${index}`)) return null;
      return alone
        ? { colour: this.colourOfLayer(layer, colours), width: 1.5 }
        : { colour: colours.drawing, width: 4 };
    });
  }

  colourOfLayer(layer, colours) {
    return this.head.layers.length > 1 ? layer[this.isDark ? "dark" : "light"] : colours.feed;
  }

  /** Whether the layer of a move is on. */
  shows(row) { return this.on.get(SORTS[this.sortOf[row]]); }
}

// The canvases on top of each other: the plan, what is done, and what moves.

/** Painting that takes longer than this waits until the view rests for `REST_MS`. */
const SLOW_MS = 40;
const REST_MS = 120;

/** From the ground up: travel and what the tool covers, the plan, what is done, marks, the tool. */
const CANVASES = ["ground", "plan", "done", "marks", "over"];

class Stage {
  constructor(place, tracks, layers, run) {
    this.place = place;
    this.moves = tracks.moves;
    this.drawing = tracks.drawing;
    this.wanted = tracks.wanted;
    this.layers = layers;
    this.run = run;
    this.view = new View();
    this.contexts = Object.fromEntries(CANVASES.map((name) => (
      [name, document.getElementById(name).getContext("2d")]
    )));
    this.done = { row: 0, trace: 0 };
    this.slowest = 0;
    this.hover = { moves: -1, drawing: -1 };
    this.view.isFitted = true;
    this.resize();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.place;
    const ratio = window.devicePixelRatio || 1, { view } = this;
    if (this.painted && view.width === width && view.height === height) return;
    view.resize(width, height);
    for (const ctx of Object.values(this.contexts)) {
      ctx.canvas.width = Math.round(width * ratio);
      ctx.canvas.height = Math.round(height * ratio);
      ctx.setTransform(ratio, 0, 0, ratio, 0, 0);
    }
    // A resized canvas is empty: paint without waiting.
    if (view.isFitted) this.fit();
    this.paintNow();
  }

  fit() {
    const boxes = [this.drawing.extent(), this.moves.extent(), this.layers.traced()].filter(Boolean);
    if (!boxes.length) boxes.push([0, 0, 1, 1]);
    const whole = [0, 1, 2, 3].map((k) => (k < 2 ? Math.min : Math.max)(...boxes.map((box) => box[k])));
    this.view.fit(whole);
    this.changed();
  }

  /** After a change of the view or of a style: paint everything, at once where that is quick. */
  changed() {
    this.rest();
    if (this.painted && this.slowest > SLOW_MS) {
      this.slide();
      document.body.dataset.waiting = "yes";
      this.resting = setTimeout(() => this.soon("all"), REST_MS);
    } else this.soon("all");
  }

  rest() {
    clearTimeout(this.resting);
    this.resting = 0;
  }

  drag(dx, dy) { this.pan(dx, dy); }

  pan(dx, dy) {
    this.view.pan(dx, dy);
    this.changed();
  }

  zoom(factor, px, py) {
    this.view.zoom(factor, px, py);
    this.changed();
  }

  /** Put a place (x, y) mm in the middle, with a ring about it. */
  look([x, y]) {
    Object.assign(this.view, { x, y, isFitted: false });
    this.mark = [x, y];
    this.changed();
  }

  /** The plan or the view in depth, whichever is shown. */
  get shown() { return this.depth && this.depth.isOn ? this.depth : this; }

  /** Move and scale the old picture to its place in the new view. */
  slide() {
    const { painted: old, view } = this, factor = view.scale / old.scale;
    const x = view.px(old.mmX(0)), y = view.py(old.mmY(0));
    for (const ctx of Object.values(this.contexts)) {
      ctx.canvas.style.transform = `translate(${x}px, ${y}px) scale(${factor})`;
    }
  }

  /** Paint in the next frame: "all", or only what has moved. */
  soon(what) {
    if (what === "all") {
      this.wantsAll = true;
      this.rest();
    }
    document.body.dataset.waiting = "yes";
    if (this.frame) return;
    this.frame = requestAnimationFrame(() => {
      this.frame = 0;
      this.paint();
    });
  }

  paint() {
    const begin = performance.now(), colours = palette();
    if (this.depth && this.depth.isOn) {
      this.paintDepth(colours);
      return;
    }
    if (this.wantsAll) {
      this.wantsAll = false;
      this.paintPlan(colours);
      this.clearDone(colours);
      for (const ctx of Object.values(this.contexts)) ctx.canvas.style.transform = "";
      this.painted = this.view.copy();
      this.paintDone(colours);
      this.clear("marks");
      paintMarks(this.contexts.marks, this.view, this.moves, this.layers, colours);
      this.slowest = performance.now() - begin;
    } else this.paintDone(colours);
    this.paintOver(colours);
    if (this.layers.printing) this.join();
    if (!this.frame && !this.resting) delete document.body.dataset.waiting;
    document.body.dataset.painted = String(Number(document.body.dataset.painted || 0) + 1);
  }

  /** Paint the view in depth, and again while there is more to cut. */
  paintDepth(colours) {
    if (this.wantsAll) this.depth.restyle();
    this.wantsAll = false;
    if (!this.depth.paint(colours)) this.soon("moved");
    if (!this.frame && !this.depth.resting) delete document.body.dataset.waiting;
    document.body.dataset.painted = String(Number(document.body.dataset.painted || 0) + 1);
  }

  clear(name) {
    this.contexts[name].clearRect(0, 0, this.view.width, this.view.height);
  }

  /** Clear what is done, to begin again at the start. */
  clearDone(colours) {
    this.done = { row: 0, trace: 0 };
    this.clear("done");
    this.clear("ground");
    const { on, head } = this.layers;
    if (on.get("travel")) paintTravel(this.contexts.ground, this.view, [0, 0, ...head.travel_mm], colours);
  }

  paintPlan(colours) {
    const ctx = this.contexts.plan, { view, drawing, moves, layers } = this;
    this.clear("plan");
    paintGrid(ctx, view, colours);
    const rows = { from: 0, to: drawing.count }, of = layers.columns.drawn_layer;
    paintTrack(ctx, view, drawing, rows, of, layers.drawingStyles(colours));
    paintDrills(ctx, view, layers, colours);
    if (!moves.count) return;
    const pale = layers.paleStyles(colours);
    paintTrack(ctx, view, moves, { from: 0, to: moves.count }, pale.of, pale.styles);
    if (!layers.on.get("wanted")) return;
    const every = new Uint8Array(this.wanted.count), line = { colour: colours.wanted, width: 1 };
    paintTrack(ctx, view, this.wanted, { from: 0, to: every.length }, every, [line]);
  }

  /** What has been done since the last time; everything after a step back in time. */
  paintDone(colours) {
    if (!this.moves.count) return;
    const ctx = this.contexts.done, { view, moves, layers, run } = this;
    const whole = run.row + (run.share === 1 ? 1 : 0);
    if (whole < this.done.row) this.clearDone(colours);
    if (whole === this.done.row) return;
    const { of, styles } = layers.moveStyles(colours), rows = { from: this.done.row, to: whole };
    const traced = layers.on.get("trace") && layers.columns.trace_row.length;
    const plain = traced && layers.isPlain ? { ...layers.paleStyles(colours) } : { of, styles };
    const swept = layers.sweptStyles(colours, view.scale);
    paintTrack(this.contexts.ground, view, moves, rows, layers.sortOf, swept);
    const wide = layers.on.get("swept") ? layers.columns.move_wide : [];
    if (wide.length) paintTapers(this.contexts.ground, view, moves, rows, wide, colours.swept);
    paintTrack(ctx, view, moves, rows, plain.of, plain.styles);
    this.paintTrace(ctx, whole);
    this.done.row = whole;
  }

  paintTrace(ctx, whole) {
    const { points, columns: { trace_row: row, trace_bin: bins } } = this.layers;
    let to = this.done.trace;
    while (to < row.length && row[to] < whole) to++;
    const range = { from: this.done.trace, to };
    paintPoints(ctx, this.view, points, range, bins, this.layers.traceStyles());
    this.done.trace = to;
  }

  paintOver(colours) {
    const ctx = this.contexts.over, { view, moves, drawing, run } = this;
    this.clear("over");
    const picked = { colour: colours.pick, width: 4 };
    const drawn = this.hover.moves < 0 ? this.hover.drawing : -1;
    for (const [track, row] of [[moves, this.hover.moves], [drawing, drawn]]) {
      if (row < 0) continue;
      paintTrack(ctx, view, track, { from: row, to: row + 1 }, { [row]: 0 }, [picked]);
    }
    if (this.mark) paintDots(ctx, view, this.mark, 14, { line: colours.pick, width: 3 });
    if (run.travel) paintTravel(ctx, view, run.travel, colours);
    if (moves.count) paintTool(ctx, view, moves, run, this.layers.widthAt(run), colours);
  }

  /** Copy everything to the lowest canvas: printed, an empty canvas would hide those below it. */
  join() {
    const { width, height } = this.view, [lowest, ...others] = Object.values(this.contexts);
    for (const ctx of others) lowest.drawImage(ctx.canvas, 0, 0, width, height);
  }

  /** Paint everything now. */
  paintNow() {
    this.rest();
    this.wantsAll = true;
    this.paint();
  }
}

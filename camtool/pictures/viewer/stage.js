// The canvases on top of each other: what stays, what is done, and what moves.

/** Painting that takes longer than this waits until the hand rests. */
const SLOW_MS = 40;
const REST_MS = 120;

/** From the ground up: travel and what the tool covers, the plan, what is done, signs, the tool. */
const CANVASES = ["ground", "plan", "done", "signs", "over"];

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
    // Canvases of another size are empty: no waiting here.
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

  /** The view or a style has changed: everything anew, at once where that is quick. */
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

  /** Show the old picture where it belongs in the new view. */
  slide() {
    const { painted: old, view } = this, factor = view.scale / old.scale;
    const x = view.px(old.mmX(0)), y = view.py(old.mmY(0));
    for (const ctx of Object.values(this.contexts)) {
      ctx.canvas.style.transform = `translate(${x}px, ${y}px) scale(${factor})`;
    }
  }

  /** Paint in the next frame: "all", or what has moved. */
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
    if (this.wantsAll) {
      this.wantsAll = false;
      this.paintPlan(colours);
      this.clearDone(colours);
      for (const ctx of Object.values(this.contexts)) ctx.canvas.style.transform = "";
      this.painted = this.view.copy();
      this.paintDone(colours);
      this.clear("signs");
      paintSigns(this.contexts.signs, this.view, this.moves, this.layers, colours);
      this.slowest = performance.now() - begin;
    } else this.paintDone(colours);
    this.paintOver(colours);
    if (this.layers.printing) this.join();
    if (!this.frame && !this.resting) delete document.body.dataset.waiting;
    document.body.dataset.painted = String(Number(document.body.dataset.painted || 0) + 1);
  }

  clear(name) {
    this.contexts[name].clearRect(0, 0, this.view.width, this.view.height);
  }

  /** Nothing is done yet. */
  clearDone(colours) {
    this.done = { row: 0, trace: 0 };
    this.clear("done");
    this.clear("ground");
    const { on, head } = this.layers;
    if (on.get("travel")) paintTravel(this.contexts.ground, this.view, head.travel_mm, colours);
  }

  paintPlan(colours) {
    const ctx = this.contexts.plan, { view, drawing, moves, layers } = this;
    this.clear("plan");
    paintGrid(ctx, view, colours);
    const rows = { from: 0, to: drawing.count }, of = layers.columns.drawn_layer;
    paintTrack(ctx, view, drawing, rows, of, layers.drawingStyles(colours));
    paintMarks(ctx, view, layers, colours);
    if (!moves.count) return;
    const pale = layers.paleStyles(colours);
    paintTrack(ctx, view, moves, { from: 0, to: moves.count }, pale.of, pale.styles);
    if (!layers.on.get("wanted")) return;
    const every = new Uint8Array(this.wanted.count), line = { colour: colours.wanted, width: 1 };
    paintTrack(ctx, view, this.wanted, { from: 0, to: every.length }, every, [line]);
  }

  /** What has been done since the last time; all of it when time went back. */
  paintDone(colours) {
    if (!this.moves.count) return;
    const ctx = this.contexts.done, { view, moves, layers, run } = this;
    const whole = run.row + (run.share === 1 ? 1 : 0);
    if (whole < this.done.row) this.clearDone(colours);
    if (whole === this.done.row) return;
    const { of, styles } = layers.moveStyles(colours), rows = { from: this.done.row, to: whole };
    const traced = layers.on.get("trace") && layers.columns.trace_row.length;
    const plain = traced && layers.by === "kind" ? { ...layers.paleStyles(colours) } : { of, styles };
    const swept = layers.sweptStyles(colours, view.scale);
    paintTrack(this.contexts.ground, view, moves, rows, layers.sortOf, swept);
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
    if (moves.count) paintTool(ctx, view, moves, run, this.layers.head.tool_mm, colours);
  }

  /** Everything on the lowest canvas: on paper, what is cleared on one canvas would hide those
   * below it. */
  join() {
    const { width, height } = this.view, [lowest, ...others] = Object.values(this.contexts);
    for (const ctx of others) lowest.drawImage(ctx.canvas, 0, 0, width, height);
  }

  /** All anew, and now. */
  paintNow() {
    this.rest();
    this.wantsAll = true;
    this.paint();
  }
}

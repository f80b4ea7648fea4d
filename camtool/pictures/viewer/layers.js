// What is to be seen and in which colour: the layers, the ways to colour moves, their styles.

const SORTS = ["rapid", "feed", "plunge"];
const COLOURS = [
  "paper", "ink", "quiet", "grid", "drawing", "feed", "rapid", "plunge", "pale", "tool", "pick",
  "swept", "travel", "turn", "wanted",
];

/** The colours of the page as they are now: the system's preference, or paper. */
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

  /** What there is, from the ground up; with a predicted path little beside it is on at first. */
  listAll() {
    const { head, columns } = this, plain = !columns.trace_row.length;
    head.layers.forEach((layer, index) => {
      const name = layer.name ? `drawing: ${layer.name}` : "drawing";
      this.add(`drawing ${index}`, name, index < 9 ? String(index + 1) : "");
    });
    const moves = columns.move_kind.length > 0, travel = head.travel_mm;
    const width = head.tool_mm === null ? "" : Number(head.tool_mm.toPrecision(4));
    if (moves && width) this.add("swept", `tool's width, ${width} mm`, "s");
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
    if (columns.turn_at.length) this.add("turn", "reversals of X and Y", "v", false);
    if (head.worst.length) this.add("worst", "worst places", "x");
    if (head.doubts.length) this.add("doubt", "open ends, crossings", "u");
    this.add("zero", "part zero", "z");
  }

  add(key, name, letter, isOn = true) {
    this.list.push({ key, name, letter });
    this.on.set(key, isOn);
  }

  /** From now on deviations are drawn so many times as large. */
  exaggerate(times) {
    this.times = times;
    const { trace_point: points, trace_off: off } = this.columns, more = (times - 1) * this.head.off_mm;
    this.points = times === 1 ? points : points.map((at, k) => at + more * off[k]);
  }

  /** [left, low, right, high] mm of the predicted path where it cuts; null without one. */
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

  /** Per move: the step of the map for each way to colour; behind the map where unknown. */
  bins() {
    const { move_error: errors, move_kind: kinds, move_end: ends } = this.columns;
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
    return { error, height };
  }

  get isDark() { return matchMedia("(prefers-color-scheme: dark)").matches && !this.printing; }

  mapColours() { return this.isDark ? this.head.map.dark : this.head.map.light; }

  /** The move's style: its sort while coloured by kind, else its step of the map. */
  moveStyles(colours) {
    const drawn = (sort, style) => (this.on.get(sort) ? style : null);
    const rapid = drawn("rapid", { colour: colours.rapid, width: 1, dash: [5, 4] });
    const plunge = drawn("plunge", { colour: colours.plunge, width: 1.5 });
    if (this.by === "kind") {
      const feed = drawn("feed", { colour: colours.feed, width: 1.5 });
      return { of: this.sortOf, styles: [rapid, feed, plunge] };
    }
    const map = this.mapColours().map((colour) => drawn("feed", { colour, width: 2 }));
    const unknown = drawn("feed", { colour: colours.pale, width: 1 });
    return { of: this.styleByMap(map.length), styles: [...map, unknown, rapid, plunge] };
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

  /** The tool's true width, of what is cut. */
  sweptStyles(colours, scale) {
    if (!this.on.get("swept")) return [null, null, null];
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

  /** Whether a move is to be seen. */
  shows(row) { return this.on.get(SORTS[this.sortOf[row]]); }
}

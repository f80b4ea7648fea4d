// Elements of the page. Text goes in as text, never as markup.

function element(name, text, attributes) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  for (const [key, value] of Object.entries(attributes || {})) made.setAttribute(key, value);
  return made;
}

const find = (id) => document.getElementById(id);

const KIND_NAMES = {
  0: "rapid", 1: "line", 2: "arc, clockwise", 3: "arc, counter-clockwise", 10: "dwell",
  11: "spindle on, clockwise", 12: "spindle on, counter-clockwise", 13: "spindle off",
  14: "tool change", 15: "message", 16: "part zero here", 17: "home X and Y", 18: "home Z",
  19: "end of program",
};

/** What is known of a move, as [name, words] each. */
function moveFacts(head, columns, run, row) {
  const mm = (value) => value.toFixed(4), end = columns.move_end.subarray(3 * row, 3 * row + 3);
  const block = columns.move_block[row], source = columns.move_source[row];
  const facts = [["move", `${row + 1}, ${KIND_NAMES[columns.move_kind[row]]}`]];
  if (block >= 0) facts.push(["block", String(block + 1)]);
  if (block >= 0 && head.blocks) facts.push([head.hex ? "bytes" : "line", head.blocks[block] || ""]);
  if (source >= 0) facts.push(["from", head.texts[source]]);
  facts.push(["to", `X ${mm(end[0])}  Y ${mm(end[1])}  Z ${mm(end[2])} mm`]);
  const feed = columns.move_feed[row];
  if (feed === feed) facts.push(["feed", `${Number(feed.toPrecision(6))} mm/min`]);
  facts.push(["time", `${clock(run.begins(row))}, lasts ${Number((run.ends[row] - run.begins(row)).toPrecision(4))} s`]);
  const error = columns.move_error[row];
  if (error === error) facts.push(["error", `${error.toFixed(2)} µm at most`]);
  const angle = columns.move_engaged[row];
  if (angle === angle && angle !== undefined) facts.push(["engaged", angle < 0 ? "entry" : `${angle.toFixed(1)}° at most`]);
  return facts;
}

/** What is known of a line or arc of the drawing. */
function drawnFacts(head, columns, row) {
  const path = columns.drawn_path[row], layer = head.layers[columns.drawn_layer[row]];
  const facts = [["layer", layer.name], ["drawn", `path ${path + 1}`]];
  if (head.sources[path]) facts.push(["entity", head.sources[path]]);
  return facts;
}

function factTable(facts) {
  const list = element("dl");
  for (const [name, words] of facts) list.append(element("dt", name), element("dd", words));
  return list;
}

// Beside the picture: layers, colours with their scale, and the program's lines.

const LINES_AROUND = 5;

class LayerPanel {
  constructor(layers, changed) {
    this.layers = layers;
    this.changed = changed;
    this.boxes = new Map();
    this.swatchOf = new Map();
    for (const layer of layers.list) find("layers").append(this.label(layer));
    this.colourChoice();
    this.timesChoice();
  }

  label({ key, name, letter, parts }) {
    const box = element("input", undefined, { type: "checkbox" }), label = element("label");
    box.checked = this.layers.on.get(key);
    box.addEventListener("change", () => {
      this.layers.on.set(key, box.checked);
      this.changed();
    });
    label.append(box);
    if (!parts.length) {
      label.append(element("i", undefined, { class: `swatch ${key.split(" ")[0]}` }), element("span", name));
    }
    for (const part of parts) {
      const kind = part.texts ? "texts" : part.dash ? "lines" : "dots";
      const swatch = element("i", part.texts && part.texts[0], { class: `swatch ${kind}` });
      this.swatchOf.set(part, swatch);
      label.append(swatch, element("span", part.legend || name));
    }
    if (!letter) return label;
    box.setAttribute("aria-keyshortcuts", letter);
    label.append(element("kbd", letter.toUpperCase(), { "aria-hidden": "true" }));
    this.boxes.set(letter, box);
    return label;
  }

  /** The choice of the factor by which deviations of the predicted path are drawn larger. */
  timesChoice() {
    const choice = find("times");
    find("exaggeration").hidden = !this.layers.head.off_mm;
    choice.addEventListener("change", () => {
      const times = Number(choice.value), factor = find("factor");
      this.layers.exaggerate(times);
      factor.hidden = times === 1;
      factor.textContent = `predicted path: deviation × ${times}`;
      this.changed();
    });
  }

  nextTimes(by) {
    if (find("exaggeration").hidden) return;
    step(find("times"), by);
  }

  colourChoice() {
    const { columns, heights } = this.layers, choice = find("colour-by");
    if (!columns.move_kind.length) {
      find("colours").hidden = true;
      this.scale();
      return;
    }
    const known = columns.move_error.some((um) => um >= 0);
    if (known) choice.append(element("option", "error", { value: "error" }));
    if (heights[1] > heights[0]) choice.append(element("option", "height", { value: "height" }));
    if (columns.move_engaged.length) choice.append(element("option", "engagement", { value: "engagement" }));
    if (columns.goal_height.length) choice.append(element("option", "gouged and left", { value: "beside" }));
    choice.addEventListener("change", () => {
      this.layers.by = choice.value;
      this.scale();
      this.changed();
    });
    this.scale();
  }

  /** Switch the layer of a key; false when there is none. */
  toggle(letter) {
    const box = this.boxes.get(letter);
    if (box) box.click();
    return Boolean(box);
  }

  nextColour() {
    const choice = find("colour-by");
    if (choice.options.length) step(choice, choice.selectedIndex === choice.options.length - 1 ? -choice.selectedIndex : 1);
  }

  /** Colour the swatches of a drawing's layers and of parts. */
  swatches() {
    const { layers } = this;
    for (const [{ texts, dash, line, fill }, { style }] of this.swatchOf) {
      if (texts) style.color = layers.tone(line);
      else style.borderColor = layers.tone(line) || "transparent";
      if (dash && dash.length) style.borderStyle = "dashed";
      if (fill) style.background = layers.tone(fill);
    }
    const found = document.querySelectorAll(".swatch.drawing");
    this.layers.drawingStyles(palette(), true).forEach((style, index) => {
      found[index].style.borderColor = style.colour;
    });
  }

  /** The colours of the map with the numbers at its ends. */
  scale() {
    this.swatches();
    const { layers } = this, { by, heights, columns } = layers, place = find("scale");
    place.hidden = by === "kind" && !columns.trace_row.length;
    find("beside").hidden = by !== "beside";
    find("engagement").hidden = by !== "engagement";
    if (place.hidden) return;
    const bar = find("scale-bar");
    bar.width = layers.mapColours().length;
    const ctx = bar.getContext("2d");
    layers.mapColours().forEach((colour, index) => {
      ctx.fillStyle = colour;
      ctx.fillRect(index, 0, 1, bar.height);
    });
    const ends = {
      height: [`Z ${heights[1].toFixed(3)} mm`, `${heights[0].toFixed(3)} mm`],
      engagement: ["0°", `${HALF_CIRCLE}°`],
    };
    [find("scale-low").textContent, find("scale-high").textContent] = ends[by]
      || ["0 µm", `${Number(layers.head.top_um.toPrecision(4))} µm`];
  }
}

/** Choose another option of a list, at most its first or last one. */
function step(choice, by) {
  choice.selectedIndex = Math.min(choice.options.length - 1, Math.max(0, choice.selectedIndex + by));
  choice.dispatchEvent(new Event("change"));
}

/** The program's lines around the current one; a click on one goes to its first move. */
class Listing {
  constructor(head, columns, go) {
    this.head = head;
    this.place = find("listing");
    this.place.hidden = !head.blocks;
    if (!head.blocks) return;
    this.rows = firstRows(columns.move_block, head.blocks.length);
    this.go = go;
    this.place.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.show(this.middle + Math.sign(event.deltaY) * 3, this.current);
    }, { passive: false });
    this.place.addEventListener("keydown", (event) => {
      const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
      if (!step || event.shiftKey) return;
      event.preventDefault();
      event.stopPropagation();
      let block = this.current + step;
      while (this.rows[block] === -1) block += step;
      if (this.rows[block] >= 0) this.go(this.rows[block]);
    });
    this.lines = Array.from({ length: 2 * LINES_AROUND + 1 }, () => this.line());
  }

  line() {
    const line = element("li");
    line.append(element("span"), element("code"));
    line.addEventListener("click", () => {
      const row = this.rows[Number(line.dataset.block)];
      if (row >= 0) this.go(row);
    });
    this.place.append(line);
    return line;
  }

  /** Lines around `middle`, with `current` marked; blocks from 0. */
  show(middle, current) {
    if (!this.head.blocks) return;
    const count = this.head.blocks.length;
    this.middle = Math.min(count - 1, Math.max(0, middle));
    this.current = current;
    this.lines.forEach((line, index) => {
      const block = this.middle + index - LINES_AROUND, there = block >= 0 && block < count;
      line.dataset.block = String(block);
      line.classList.toggle("current", block === current);
      line.children[0].textContent = there ? String(block + 1) : "";
      line.children[1].textContent = there ? this.head.blocks[block] : " ";
    });
  }
}

/** The first move of each block, −1 for blocks without any. */
function firstRows(blockOf, count) {
  const rows = new Int32Array(count).fill(-1);
  for (let row = blockOf.length - 1; row >= 0; row--) {
    if (blockOf[row] >= 0 && blockOf[row] < count) rows[blockOf[row]] = row;
  }
  return rows;
}

/** The report's tables below the picture; a row about a move or a place has a button that shows it. */
function showTables(head, go, look) {
  for (const table of head.tables) {
    const made = element("table"), body = element("tbody");
    made.append(element("caption", table.title));
    if (table.columns.length) {
      const names = element("tr");
      table.columns.forEach((name) => names.append(element("th", name, { scope: "col" })));
      const top = element("thead");
      top.append(names);
      made.append(top);
    }
    for (const row of table.rows) {
      const line = element("tr");
      row.cells.forEach((cell) => line.append(element("td", cell)));
      if (row.move !== null || row.at) {
        const name = row.at ? `show X ${row.at[0]} Y ${row.at[1]}` : `show move ${row.move + 1}`;
        const button = element("button", "show", { type: "button", "aria-label": name });
        button.addEventListener("click", () => (row.at ? look(row.at) : go(row.move)));
        const last = element("td");
        last.append(button);
        line.append(last);
      }
      body.append(line);
    }
    made.append(body);
    find("tables").append(made);
  }
}

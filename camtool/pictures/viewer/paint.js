// Which part of the work frame the canvases show.

const FIT_MARGIN = 0.06;
const LEAST_MM_ACROSS = 1e-4;
const NEAR_PX = 12;

class View {
  constructor() {
    this.width = this.height = 1;
    this.x = this.y = 0;
    this.scale = 1;
  }

  /** A size in CSS pixels. */
  resize(width, height) {
    this.width = Math.max(1, width);
    this.height = Math.max(1, height);
  }

  fit([left, low, right, high]) {
    const room = 1 - 2 * FIT_MARGIN;
    const wide = Math.max(right - left, LEAST_MM_ACROSS), tall = Math.max(high - low, LEAST_MM_ACROSS);
    this.scale = Math.min((this.width * room) / wide, (this.height * room) / tall);
    this.x = (left + right) / 2;
    this.y = (low + high) / 2;
    this.isFitted = true;
  }

  px(x) { return (x - this.x) * this.scale + this.width / 2; }
  py(y) { return (this.y - y) * this.scale + this.height / 2; }
  mmX(px) { return (px - this.width / 2) / this.scale + this.x; }
  mmY(py) { return this.y - (py - this.height / 2) / this.scale; }

  pan(dx, dy) {
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
    this.isFitted = false;
  }

  /** Zoom about a point of the canvas, which stays where it is. */
  zoom(factor, px, py) {
    const x = this.mmX(px), y = this.mmY(py);
    const most = this.width / LEAST_MM_ACROSS;
    this.scale = Math.min(most, Math.max(most * 1e-12, this.scale * factor));
    this.x = x - (px - this.width / 2) / this.scale;
    this.y = y + (py - this.height / 2) / this.scale;
    this.isFitted = false;
  }

  copy() { return Object.assign(new View(), this); }

  /** [left, low, right, high] mm, with `more` mm on each side. */
  box(more = 0) {
    const { width, height } = this;
    return [this.mmX(0) - more, this.mmY(height) - more, this.mmX(width) + more, this.mmY(0) + more];
  }

  /** Whether a line on the canvas lies beyond one of its edges. */
  isBeside(x0, y0, x1, y1) {
    const beyond = (a, b, size) => (a < -NEAR_PX && b < -NEAR_PX) || (a > size + NEAR_PX && b > size + NEAR_PX);
    return beyond(x0, x1, this.width) || beyond(y0, y1, this.height);
  }

  /** Whether a place lies on the canvas, or at most `NEAR_PX` beside it. */
  shows(px, py) {
    return px > -NEAR_PX && py > -NEAR_PX && px < this.width + NEAR_PX && py < this.height + NEAR_PX;
  }
}

// Moves on a canvas: all of one style as one path, without points nearer than a pixel.

const MERGED_PX = 0.7;
/** The same for wide lines, as a share of their width: their edges move by 0.5 % of it at most. */
const MERGED_SHARE = 0.1;

/** A path of one style, without points nearer than a pixel to the last one. */
class Pen {
  constructor(width) {
    this.path = new Path2D();
    this.merged = Math.max(MERGED_PX, width * MERGED_SHARE);
    this.row = -2;
    this.waiting = false;
  }

  /** Continue the row before, or begin a new line. */
  begin(row, x, y) {
    if (row !== this.row + 1 || x !== this.lastX || y !== this.lastY) {
      this.flush();
      this.path.moveTo(x, y);
      this.x = this.lastX = x;
      this.y = this.lastY = y;
    }
    this.row = row;
  }

  to(x, y) {
    this.lastX = x;
    this.lastY = y;
    if (Math.abs(x - this.x) + Math.abs(y - this.y) < this.merged) {
      this.waiting = true;
      return;
    }
    this.path.lineTo(x, y);
    this.x = x;
    this.y = y;
    this.waiting = false;
  }

  arc(view, arc, x, y) {
    const radius = arc.radius * view.scale;
    if (radius * Math.abs(arc.sweep) < 2) { this.to(x, y); return; }
    this.flush();
    this.path.arc(
      view.px(arc.x), view.py(arc.y), radius, -arc.angle, -arc.angle - arc.sweep, arc.sweep > 0,
    );
    this.x = this.lastX = x;
    this.y = this.lastY = y;
  }

  flush() {
    if (this.waiting) this.path.lineTo(this.lastX, this.lastY);
    this.waiting = false;
  }
}

/** Stroke the rows from … to−1 of a track; `styles[styleOf[row]]` is {colour, width, dash}, or
 * null for rows that are not shown. */
function paintTrack(ctx, view, track, rows, styleOf, styles) {
  const reach = Math.max(...styles.map((style) => (style ? style.width : 0))) / 2 / view.scale;
  const [left, low, right, high] = view.box(reach), { boxes } = track;
  const pens = styles.map((style) => (style ? new Pen(style.width) : null));
  for (let row = rows.from; row < rows.to; row++) {
    const pen = pens[styleOf[row]], at = 4 * row;
    if (!pen || boxes[at] > right || boxes[at + 2] < left) continue;
    if (boxes[at + 1] > high || boxes[at + 3] < low) continue;
    const x = view.px(track.to[2 * row]), y = view.py(track.to[2 * row + 1]);
    pen.begin(row, view.px(track.from[2 * row]), view.py(track.from[2 * row + 1]));
    if (track.bend[row] < 0) pen.to(x, y);
    else pen.arc(view, track.arc(row), x, y);
  }
  strokePens(ctx, pens, styles);
}

const TAPER_TURN = 0.2;

/** Fill what the rows from … to−1 of a track cut with a tool that is as wide as it is deep: `wide`
 * (2 N) mm on each side, at the start and the end of each; arcs in chords. */
function paintTapers(ctx, view, track, rows, wide, colour) {
  const path = new Path2D();
  for (let row = rows.from; row < rows.to; row++) {
    const first = wide[2 * row] * view.scale, last = wide[2 * row + 1] * view.scale;
    if (!first && !last) continue;
    const arc = track.arc(row);
    // A chord of this turn is a quarter of a pixel off its arc.
    const turn = arc ? Math.min(TAPER_TURN, Math.sqrt(2 / Math.max(arc.radius * view.scale, 1))) : 0;
    const pieces = arc ? Math.max(1, Math.ceil(Math.abs(arc.sweep) / turn)) : 1;
    let from = track.at(row, 0), radius = first;
    for (let piece = 1; piece <= pieces; piece++) {
      const share = piece / pieces, to = track.at(row, share);
      const next = first + share * (last - first);
      addHull(path, [view.px(from[0]), view.py(from[1]), radius], [view.px(to[0]), view.py(to[1]), next]);
      from = to;
      radius = next;
    }
  }
  ctx.fillStyle = colour;
  ctx.fill(path);
}

/** Two discs (x, y, radius) and what lies between them, along their common tangents. */
function addHull(path, one, other) {
  const [x, y, radius] = one, [u, v, last] = other, distance = Math.hypot(u - x, v - y);
  if (distance <= Math.abs(radius - last) + 1e-6) {
    const [atX, atY, wide] = radius > last ? one : other;
    path.moveTo(atX + wide, atY);
    path.arc(atX, atY, wide, 0, TURN);
    return;
  }
  const angle = Math.atan2(v - y, u - x), touch = Math.acos((radius - last) / distance);
  path.moveTo(x + radius * Math.cos(angle + touch), y + radius * Math.sin(angle + touch));
  path.arc(x, y, radius, angle + touch, angle - touch + TURN);
  path.arc(u, v, last, angle - touch, angle + touch);
  path.closePath();
}

/** Stroke points first … last of a line of points (2 T) mm, each piece in the style of its end;
 * pieces smaller than a pixel become one, in the highest of their styles. */
function paintPoints(ctx, view, points, range, styleOf, styles) {
  const pens = styles.map((style) => (style ? new Pen(style.width) : null));
  const first = Math.max(1, range.from), px = (at) => view.px(points[2 * at]), py = (at) => view.py(points[2 * at + 1]);
  let fromX = px(first - 1), fromY = py(first - 1), worst = -1, x = fromX, y = fromY;
  const put = (step) => {
    if (worst >= 0 && !view.isBeside(fromX, fromY, x, y)) {
      pens[worst].begin(step, fromX, fromY);
      pens[worst].to(x, y);
    }
    fromX = x;
    fromY = y;
    worst = -1;
  };
  let step = 0;
  for (let at = first; at < range.to; at++) {
    if (!pens[styleOf[at]]) {
      put(step++);
      fromX = x = px(at);
      fromY = y = py(at);
      continue;
    }
    x = px(at);
    y = py(at);
    worst = Math.max(worst, styleOf[at]);
    if (Math.abs(x - fromX) + Math.abs(y - fromY) >= MERGED_PX) put(step++);
  }
  put(step);
  strokePens(ctx, pens, styles);
}

function strokePens(ctx, pens, styles) {
  ctx.lineCap = ctx.lineJoin = "round";
  pens.forEach((pen, index) => {
    if (!pen) return;
    pen.flush();
    ctx.strokeStyle = styles[index].colour;
    ctx.lineWidth = styles[index].width;
    ctx.setLineDash(styles[index].dash || []);
    ctx.stroke(pen.path);
  });
  ctx.setLineDash([]);
}

// What is drawn beside moves: the grid with its numbers, points of the drawing, travel, the tool.

const GRID_PX = 90;
const TOOL_PX = 5;

/** 1, 2 or 5 times a power of ten that is not below `least`. */
function roundStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return power * [1, 2, 5, 10].find((digit) => digit * power >= least * 0.999999);
}

function paintGrid(ctx, view, colours) {
  const step = roundStep(GRID_PX / view.scale), [left, low, right, high] = view.box();
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  ctx.font = "11px system-ui, sans-serif";
  ctx.lineWidth = 1;
  ctx.lineCap = "butt";
  ctx.setLineDash([]);
  ctx.strokeStyle = colours.grid;
  ctx.fillStyle = colours.quiet;
  ctx.beginPath();
  for (let n = Math.ceil(left / step); n * step <= right; n++) {
    const x = Math.round(view.px(n * step)) + 0.5;
    ctx.moveTo(x, 0);
    ctx.lineTo(x, view.height);
    ctx.fillText((n * step).toFixed(decimals), x + 3, view.height - 4);
  }
  for (let n = Math.ceil(low / step); n * step <= high; n++) {
    const y = Math.round(view.py(n * step)) + 0.5;
    ctx.moveTo(0, y);
    ctx.lineTo(view.width, y);
    ctx.fillText((n * step).toFixed(decimals), 3, y - 3);
  }
  ctx.stroke();
}

/** The table's travel from part zero. */
function paintTravel(ctx, view, [left, low, right, high], colours) {
  ctx.strokeStyle = colours.travel;
  ctx.lineWidth = 2;
  ctx.setLineDash([]);
  ctx.strokeRect(view.px(left), view.py(high), (right - left) * view.scale, (high - low) * view.scale);
}

/** Single points of the drawing. */
function paintDrills(ctx, view, layers, colours) {
  const { mark_at: at, mark_layer: of } = layers.columns;
  ctx.fillStyle = colours.feed;
  for (let index = 0; index < of.length; index++) {
    if (!layers.on.get(`drawing ${of[index]}`)) continue;
    ctx.beginPath();
    ctx.arc(view.px(at[2 * index]), view.py(at[2 * index + 1]), 3, 0, TURN);
    ctx.fill();
  }
}

/** The tool where it is now, and the part of its move that is done. */
function paintTool(ctx, view, moves, run, toolMm, colours) {
  const [x, y] = run.place || moves.at(run.row, run.share), px = view.px(x), py = view.py(y);
  ctx.setLineDash([]);
  if (run.share < 1) {
    const arc = moves.arc(run.row);
    ctx.strokeStyle = colours.tool;
    ctx.lineWidth = 2;
    ctx.beginPath();
    if (arc) {
      const angle = arc.angle + run.share * arc.sweep;
      ctx.arc(view.px(arc.x), view.py(arc.y), arc.radius * view.scale, -arc.angle, -angle, arc.sweep > 0);
    } else {
      ctx.moveTo(view.px(moves.from[2 * run.row]), view.py(moves.from[2 * run.row + 1]));
      ctx.lineTo(px, py);
    }
    ctx.stroke();
  }
  ctx.strokeStyle = ctx.fillStyle = colours.tool;
  ctx.lineWidth = 1.5;
  ctx.beginPath();
  ctx.arc(px, py, TOOL_PX, 0, TURN);
  ctx.fill();
  if (toolMm === null || (toolMm / 2) * view.scale <= TOOL_PX) return;
  ctx.beginPath();
  ctx.arc(px, py, (toolMm / 2) * view.scale, 0, TURN);
  ctx.stroke();
}

// Marks of one size at places in mm: starts, plunges, arrows, numbers, worst places, and the layers
// that the page describes by their parts.

const FULL_SIZE_UP_TO = 120;
const SMALLEST_MARK = 0.3;
const ARROW_PX = 13;
const ARROW_EVERY_PX = 240;
const MOST_ARROWS = 150;
const MOST_NUMBERS = 400;
const NUMBER_PX = 13;

/** All marks of a picture, from the ground up. */
function paintMarks(ctx, view, moves, layers, colours) {
  const { columns, head, on } = layers, ring = { fill: colours.paper, line: colours.feed, width: 2 };
  const disc = (fill) => ({ fill, line: colours.paper, width: 1.2 });
  ctx.setLineDash([]);
  for (const { name, parts } of head.rows) {
    if (on.get(`row ${name}`)) for (const part of parts) paintPart(ctx, view, part, layers, colours);
  }
  if (on.get("arrow")) paintArrows(ctx, view, moves, columns.move_sort, colours);
  if (on.get("start")) {
    paintDots(ctx, view, columns.bare_at, 4.5, ring);
    paintDots(ctx, view, columns.plunge_at, 4.5, disc(colours.plunge));
  }
  if (on.get("order")) paintNumbers(ctx, view, columns.start_at, colours.ink, colours);
  if (on.get("zero")) paintZero(ctx, view, colours);
  const red = { line: colours.tool, width: 2 };
  if (on.get("ambiguous")) paintDots(ctx, view, head.ambiguous.flat(), 7, red);
  if (!on.get("worst")) return;
  const worst = head.worst.flatMap(({ at, off }) => at.map((mm, k) => mm + (layers.times - 1) * off[k]));
  paintDots(ctx, view, worst, 8, red);
  paintNumbers(ctx, view, worst, colours.tool, colours);
}

/** Lines, texts or dots of a layer that the page describes by its parts. */
function paintPart(ctx, view, part, layers, colours) {
  const { columns } = layers, { columns: name, texts, radius, width, dash } = part;
  const line = layers.tone(part.line);
  if (texts) paintTexts(ctx, view, texts, columns[`${name}_at`], line, colours);
  else if (dash) {
    part.track = part.track || new Track(
      Float64Array.from(columns[`${name}_from`]), Float64Array.from(columns[`${name}_to`]),
      columns[`${name}_arc`], columns[`${name}_bend`],
    );
    const every = new Uint8Array(part.track.count);
    paintTrack(ctx, view, part.track, { from: 0, to: every.length }, every, [{ colour: line, width, dash }]);
  } else paintDots(ctx, view, columns[`${name}_at`], radius, { fill: layers.tone(part.fill), line, width });
}

/** Round marks at `places` (2 P) mm, smaller where there are very many; at most one per pixel. */
function paintDots(ctx, view, places, radius, { fill, line, width }) {
  const seen = new Set(), shown = [];
  for (let at = 0; at < places.length; at += 2) {
    const x = view.px(places[at]), y = view.py(places[at + 1]), pixel = `${x | 0} ${y | 0}`;
    if (!view.shows(x, y) || seen.has(pixel)) continue;
    seen.add(pixel);
    shown.push([x, y]);
  }
  const size = radius * Math.max(Math.sqrt(Math.min(1, FULL_SIZE_UP_TO / shown.length)), SMALLEST_MARK);
  const path = new Path2D();
  for (const [x, y] of shown) {
    path.moveTo(x + size, y);
    path.arc(x, y, size, 0, TURN);
  }
  ctx.lineWidth = width * Math.min(1, size / radius + 0.3);
  if (line) {
    ctx.strokeStyle = line;
    ctx.stroke(path);
  }
  if (!fill) return;
  ctx.fillStyle = fill;
  ctx.fill(path);
}

/** Arrows along level feeds, at most about `MOST_ARROWS`. */
function paintArrows(ctx, view, moves, sortOf, colours) {
  const [left, low, right, high] = view.box(), { boxes } = moves;
  const isSeen = (row) => sortOf[row] === 1 && boxes[4 * row] <= right && boxes[4 * row + 2] >= left
    && boxes[4 * row + 1] <= high && boxes[4 * row + 3] >= low;
  let whole = 0, since = 0;
  for (let row = 0; row < moves.count; row++) if (isSeen(row)) whole += moves.length(row) * view.scale;
  const every = Math.max(ARROW_EVERY_PX, whole / MOST_ARROWS), path = new Path2D();
  for (let row = 0; row < moves.count; row++) {
    if (sortOf[row] !== 1) since = every / 2;
    if (!isSeen(row)) continue;
    since += moves.length(row) * view.scale;
    if (since < every) continue;
    since = 0;
    const share = [0.5, 0.25, 0.75, 0.1, 0.9].find((part) => {
      const [x, y] = moves.at(row, part);
      return x > left && x < right && y > low && y < high;
    });
    if (share !== undefined) addArrow(path, view, moves, row, share);
  }
  ctx.fillStyle = colours.feed;
  ctx.fill(path);
}

function addArrow(path, view, moves, row, share) {
  const [[x0, y0], [x1, y1]] = [share - 0.01, share + 0.01].map((part) => moves.at(row, part));
  const [x, y] = moves.at(row, share), angle = Math.atan2(y0 - y1, x1 - x0);
  const cos = Math.cos(angle), sin = Math.sin(angle), half = ARROW_PX / 2;
  [[half, 0], [-half, 0.7 * half], [-half / 2, 0], [-half, -0.7 * half]].forEach(([u, v], index) => {
    const to = [view.px(x) + u * cos - v * sin, view.py(y) + u * sin + v * cos];
    if (index) path.lineTo(...to);
    else path.moveTo(...to);
  });
  path.closePath();
}

/** Numbers from 1 beside places. */
function paintNumbers(ctx, view, places, colour, colours) {
  const texts = Array.from({ length: places.length / 2 }, (_, index) => String(index + 1));
  paintTexts(ctx, view, texts, places, colour, colours);
}

/** Texts beside places (2 P) mm; a text without room is left out. */
function paintTexts(ctx, view, texts, places, colour, colours) {
  ctx.font = `bold ${NUMBER_PX}px system-ui, sans-serif`;
  ctx.lineJoin = "round";
  ctx.lineWidth = 4;
  ctx.strokeStyle = colours.paper;
  ctx.fillStyle = colour;
  const taken = [], count = Math.min(texts.length, MOST_NUMBERS);
  for (let index = 0; index < count; index++) {
    const x = view.px(places[2 * index]), y = view.py(places[2 * index + 1]);
    if (!view.shows(x, y)) continue;
    const name = texts[index], wide = ctx.measureText(name).width;
    for (const [across, up] of [[1, 1], [-1, 1], [1, -1], [-1, -1]]) {
      const from = across > 0 ? x + 9 : x - 9 - wide, base = up > 0 ? y - 5 : y + 5 + NUMBER_PX;
      const box = [from, base - NUMBER_PX, from + wide, base + 2];
      if (taken.some((other) => touches(box, other))) continue;
      taken.push(box);
      ctx.strokeText(name, from, base);
      ctx.fillText(name, from, base);
      break;
    }
  }
}

function touches(a, b) {
  return a[0] < b[2] + 2 && b[0] < a[2] + 2 && a[1] < b[3] && b[1] < a[3];
}

/** Part zero: a cross with a ring. */
function paintZero(ctx, view, colours) {
  const x = view.px(0), y = view.py(0);
  ctx.strokeStyle = colours.ink;
  ctx.lineWidth = 1.2;
  ctx.beginPath();
  ctx.moveTo(x - 10, y);
  ctx.lineTo(x + 10, y);
  ctx.moveTo(x, y - 10);
  ctx.lineTo(x, y + 10);
  ctx.moveTo(x + 5, y);
  ctx.arc(x, y, 5, 0, TURN);
  ctx.stroke();
}

// Moves on a canvas: all of one style as one path, and what is smaller than a pixel as one line.

const MERGED_PX = 0.7;
/** The same as a share of a wide line's width: its edge stays true to half a hundredth of that. */
const MERGED_SHARE = 0.1;

/** One growing path of one style, which leaves out points nearer than a pixel to the last. */
class Pen {
  constructor(width) {
    this.path = new Path2D();
    this.merged = Math.max(MERGED_PX, width * MERGED_SHARE);
    this.row = -2;
    this.waiting = false;
  }

  /** Go on from the row before, or begin anew. */
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
 * null where the row is not to be seen. */
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

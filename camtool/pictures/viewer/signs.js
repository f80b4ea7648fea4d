// Signs of one size at places in mm: starts, plunges, reversals, arrows, numbers, worst places.

const FULL_SIZE_UP_TO = 120;
const SMALLEST_SIGN = 0.3;
const ARROW_PX = 13;
const ARROW_EVERY_PX = 240;
const MOST_ARROWS = 150;
const MOST_NUMBERS = 400;
const NUMBER_PX = 13;

/** All signs of a picture, from the ground up. */
function paintSigns(ctx, view, moves, layers, colours) {
  const { columns, head, on } = layers, ring = { fill: colours.paper, line: colours.feed, width: 2 };
  const disc = (fill) => ({ fill, line: colours.paper, width: 1.2 });
  ctx.setLineDash([]);
  if (on.get("turn")) paintDots(ctx, view, columns.turn_at, 3.2, disc(colours.turn));
  if (on.get("arrow")) paintArrows(ctx, view, moves, columns.move_sort, colours);
  if (on.get("start")) {
    paintDots(ctx, view, columns.bare_at, 4.5, ring);
    paintDots(ctx, view, columns.plunge_at, 4.5, disc(colours.plunge));
  }
  if (on.get("order")) paintNumbers(ctx, view, columns.start_at, colours.ink, colours);
  if (on.get("zero")) paintZero(ctx, view, colours);
  const red = { line: colours.tool, width: 2 };
  if (on.get("doubt")) paintDots(ctx, view, head.doubts.flat(), 7, red);
  if (!on.get("worst")) return;
  const worst = head.worst.flatMap(({ at, off }) => at.map((mm, k) => mm + (layers.times - 1) * off[k]));
  paintDots(ctx, view, worst, 8, red);
  paintNumbers(ctx, view, worst, colours.tool, colours);
}

/** Round signs at `places` (2 P) mm, smaller where there are very many; one for each pixel. */
function paintDots(ctx, view, places, radius, { fill, line, width }) {
  const seen = new Set(), shown = [];
  for (let at = 0; at < places.length; at += 2) {
    const x = view.px(places[at]), y = view.py(places[at + 1]), pixel = `${x | 0} ${y | 0}`;
    if (!view.shows(x, y) || seen.has(pixel)) continue;
    seen.add(pixel);
    shown.push([x, y]);
  }
  const size = radius * Math.max(Math.sqrt(Math.min(1, FULL_SIZE_UP_TO / shown.length)), SMALLEST_SIGN);
  const path = new Path2D();
  for (const [x, y] of shown) {
    path.moveTo(x + size, y);
    path.arc(x, y, size, 0, TURN);
  }
  ctx.lineWidth = width * Math.min(1, size / radius + 0.3);
  ctx.strokeStyle = line;
  ctx.stroke(path);
  if (!fill) return;
  ctx.fillStyle = fill;
  ctx.fill(path);
}

/** Arrows along level feeds, so far apart that they stay few. */
function paintArrows(ctx, view, moves, sortOf, colours) {
  const [left, low, right, high] = view.box(), { boxes } = moves;
  const isSeen = (row) => sortOf[row] === 1 && boxes[4 * row] <= right && boxes[4 * row + 2] >= left
    && boxes[4 * row + 1] <= high && boxes[4 * row + 3] >= low;
  let whole = 0, way = 0;
  for (let row = 0; row < moves.count; row++) if (isSeen(row)) whole += moves.length(row) * view.scale;
  const every = Math.max(ARROW_EVERY_PX, whole / MOST_ARROWS), path = new Path2D();
  for (let row = 0; row < moves.count; row++) {
    if (sortOf[row] !== 1) way = every / 2;
    if (!isSeen(row)) continue;
    way += moves.length(row) * view.scale;
    if (way < every) continue;
    way = 0;
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

/** Numbers from 1 beside places; one that finds no room is left out. */
function paintNumbers(ctx, view, places, colour, colours) {
  ctx.font = `bold ${NUMBER_PX}px system-ui, sans-serif`;
  ctx.lineJoin = "round";
  ctx.lineWidth = 4;
  ctx.strokeStyle = colours.paper;
  ctx.fillStyle = colour;
  const taken = [], count = Math.min(places.length / 2, MOST_NUMBERS);
  for (let index = 0; index < count; index++) {
    const x = view.px(places[2 * index]), y = view.py(places[2 * index + 1]);
    if (!view.shows(x, y)) continue;
    const name = String(index + 1), wide = ctx.measureText(name).width;
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

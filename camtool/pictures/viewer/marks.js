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
function paintTravel(ctx, view, [width, height], colours) {
  ctx.strokeStyle = colours.travel;
  ctx.lineWidth = 2;
  ctx.setLineDash([]);
  ctx.strokeRect(view.px(0), view.py(height), width * view.scale, height * view.scale);
}

/** Single points of the drawing. */
function paintMarks(ctx, view, layers, colours) {
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
  const [x, y] = moves.at(run.row, run.share), px = view.px(x), py = view.py(y);
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

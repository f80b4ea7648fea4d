// Put together what the page holds.

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

  const panel = new LayerPanel(layers, () => stage.changed());
  const listing = new Listing(head, columns, (row) => player.toRow(row));
  let player = null;
  const moved = () => {
    showMove(head, columns, run);
    const block = columns.move_block[run.row];
    listing.show(block, block);
    stage.soon("moved");
  };
  if (tracks.moves.count) player = new Player(run, moved);
  else document.body.classList.add("still");
  showTables(head, (row) => { player.toRow(row); centre(stage, tracks.moves, row); });

  const hovered = (move, drawn, px, py) => {
    stage.hover = { moves: move, drawing: drawn };
    showTip({ head, columns, run, listing }, stage.hover, px, py);
    stage.soon("hover");
  };
  const clicked = () => {
    if (player && stage.hover.moves >= 0) player.toRow(stage.hover.moves);
  };
  new Hand(stage, hovered, clicked);
  listen({ stage, player, panel });
  document.body.dataset.ready = "yes";
}

/** Grids are made when first asked for: a page opens sooner. */
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
  find("fit").addEventListener("click", () => stage.fit());
  find("help-button").addEventListener("click", () => showHelp(find("help").hidden));
}

function showHelp(isShown) {
  find("help").hidden = !isShown;
  find("help-button").setAttribute("aria-expanded", String(isShown));
}

function centre(stage, moves, row) {
  [stage.view.x, stage.view.y] = moves.at(row, 1);
  stage.changed();
  stage.place.scrollIntoView({ block: "nearest" });
}

/** The move under way, beside the picture. */
function showMove(head, columns, run) {
  find("now").replaceChildren(factTable(moveFacts(head, columns, run, run.row)));
}

/** What lies under the cursor, beside it. */
function showTip({ head, columns, run, listing }, hover, px, py) {
  const tip = find("tip"), block = hover.moves >= 0 ? columns.move_block[hover.moves] : -1;
  tip.hidden = hover.moves < 0 && hover.drawing < 0;
  const now = columns.move_block.length ? columns.move_block[run.row] : 0;
  listing.show(block >= 0 ? block : now, block >= 0 ? block : now);
  if (tip.hidden) return;
  const moved = hover.moves >= 0 ? moveFacts(head, columns, run, hover.moves) : [];
  const drawn = hover.drawing >= 0 ? drawnFacts(head, columns, hover.drawing) : [];
  tip.replaceChildren(factTable([...moved, ...drawn]));
  const place = find("stage"), right = px > place.clientWidth / 2, low = py > place.clientHeight / 2;
  tip.style.left = `${px + (right ? -14 - tip.offsetWidth : 14)}px`;
  tip.style.top = `${py + (low ? -14 - tip.offsetHeight : 14)}px`;
}

begin();

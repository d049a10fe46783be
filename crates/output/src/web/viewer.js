"use strict";

// A view of a pyramid of tiles: drawn on a canvas, moved by pointers, wheel and keys. The tiles are files beside the page,
// or a server draws them while one looks: then the map has no end, and each tile comes as a draft first.
//
// Places are counted in pixels of the finest zoom from the north-western corner of the square of tiles ("world"), or in
// CSS pixels of the window ("screen"). `view.zoom` may lie between two levels; a world pixel is 2^(zoom - finest) on screen.
// Tile numbers may be negative and have more bits than an Int32: there are no bit operators on them.
const terrane = (() => {
  const TILE = 256;
  const KEPT_TILES = { plain: 480, dense: 160 }; // pictures in memory: 130 MB, or 170 MB of dense ones
  const KEPT_HEIGHTS = 128;
  const ARRIVALS = 3; // pictures that one frame draws for the first time, since each is then copied to the GPU
  const FADE_MS = 160;
  const NEAR_PX = 44; // a name this near to the pointer is told
  const KEY_PX = 140;

  const $ = (id) => document.getElementById(id);
  const canvas = $("map");
  const context = canvas.getContext("2d", { alpha: false });
  const calm = matchMedia("(prefers-reduced-motion: reduce)");

  // Files beside the page. A page from the disk may not fetch, but it may show pictures and run scripts.
  const FILES = {
    live: false,
    kinds: [""], // of pictures of one tile, the best last
    beyond: 2, // levels that the finest tiles may be enlarged by
    atOnce: 8, // pictures under way
    address: (said, layer, kind, { z, x, y }) =>
      `${said.layers[layer].name}/${z}/${x}/${y}${said.dense && size.dense > 1.25 ? "@2x" : ""}.${said.ending}`,
    async picture(at) {
      const image = new Image();
      image.src = at;
      await image.decode();
      return image;
    },
    askHeights(said, key) {
      const script = document.createElement("script");
      script.src = `heights/${key}.js`;
      script.onload = script.onerror = () => script.remove();
      document.head.append(script);
    },
  };

  let about = null; // what map.js says
  let source = FILES;
  let ground = null;
  let bounds = null; // in world pixels: { x0, y0, x1, y1 }
  let names = [];
  let layer = 0;
  let earlier = []; // what was shown before: { said, layer }, until all of the new is there
  const hooks = {}; // what a page adds; the last lines tell which there are
  let size = { width: 0, height: 0, dense: 1 };
  const view = { x: 0, y: 0, zoom: 0 };
  // What moves the view: (milliseconds since the last frame) => whether it goes on. Its `end` is the view that it leads to.
  let motion = null;
  let framed = false;
  let paused = false;
  let lastFrame = 0;

  const clamp = (value, low, high) => Math.min(Math.max(value, low), Math.max(low, high));

  // ---------- places

  const scale = (of = view) => 2 ** (of.zoom - ground.max_zoom);
  const toWorld = ([east, north]) => ({
    x: (east - ground.corner_m[0]) / ground.finest_m,
    y: (ground.corner_m[1] - north) / ground.finest_m,
  });
  const toMetres = ({ x, y }) => [ground.corner_m[0] + x * ground.finest_m, ground.corner_m[1] - y * ground.finest_m];
  const toScreen = ({ x, y }) => ({
    x: (x - view.x) * scale() + size.width / 2,
    y: (y - view.y) * scale() + size.height / 2,
  });
  const fromScreen = ({ x, y }, of = view) => ({
    x: (x - size.width / 2) / scale(of) + of.x,
    y: (y - size.height / 2) / scale(of) + of.y,
  });

  // The part of the window that no panel covers, on phones above and below.
  const margins = () =>
    size.width <= 640 ? { top: 104, right: 12, bottom: 76, left: 12 } : { top: 24, right: 60, bottom: 60, left: 24 };

  // All of the map, or where a map without end began.
  function whole() {
    if (source.live) return { ...toWorld(about.home.at_m), zoom: zoomOf(about.home.pixel_m) };
    const { top, right, bottom, left } = margins();
    const [width, height] = [Math.max(size.width - left - right, 80), Math.max(size.height - top - bottom, 80)];
    const fit = Math.min(width / (bounds.x1 - bounds.x0), height / (bounds.y1 - bounds.y0));
    const zoom = ground.max_zoom + Math.log2(fit);
    return {
      x: (bounds.x0 + bounds.x1) / 2 + (right - left) / 2 / fit,
      y: (bounds.y0 + bounds.y1) / 2 + (bottom - top) / 2 / fit,
      zoom: Math.min(zoom, ground.max_zoom),
    };
  }

  const zoomOf = (pixel_m) => ground.max_zoom + Math.log2(ground.finest_m / pixel_m);
  const lowest = () => (source.live ? ground.min_zoom : whole().zoom - 0.25);
  const highest = () => ground.max_zoom + source.beyond;

  // A view whose middle is in the map; the nearer it comes to showing all, the nearer to the middle of all.
  function kept({ x, y, zoom }) {
    const all = whole();
    const near = clamp(zoom, lowest(), highest());
    if (source.live) return { x: clamp(x, bounds.x0, bounds.x1), y: clamp(y, bounds.y0, bounds.y1), zoom: near };
    const free = clamp((near - all.zoom) / 0.75, 0.12, 1);
    const between = (at, middle, low, high) => clamp(at, middle + (low - middle) * free, middle + (high - middle) * free);
    return { x: between(x, all.x, bounds.x0, bounds.x1), y: between(y, all.y, bounds.y0, bounds.y1), zoom: near };
  }

  const keepIn = () => Object.assign(view, kept(view));

  // The view with another zoom in which the anchor on the screen stands over the same place.
  function zoomed(zoom, anchor) {
    const held = fromScreen(anchor);
    const other = { ...view, zoom: clamp(zoom, lowest(), highest()) };
    const now = fromScreen(anchor, other);
    return kept({ x: other.x + held.x - now.x, y: other.y + held.y - now.y, zoom: other.zoom });
  }

  const zoomAround = (zoom, anchor) => Object.assign(view, zoomed(zoom, anchor));

  const middle = () => ({ x: size.width / 2, y: size.height / 2 });

  // ---------- motions

  function move(step) {
    // A motion begins now, and not with the last frame before it.
    if (!framed) lastFrame = performance.now();
    motion = step;
    invalidate();
  }

  // What is left of a way after so many milliseconds, if half of it takes about 70.
  const left = (ms) => (calm.matches ? 0 : Math.exp(-ms / 100));

  let zoomGoal = null;
  function zoomTo(zoom, anchor) {
    zoomGoal = clamp(zoom, lowest(), highest());
    const step = (ms) => {
      const rest = (view.zoom - zoomGoal) * left(ms);
      const done = Math.abs(rest) < 0.002;
      zoomAround(done ? zoomGoal : zoomGoal + rest, anchor);
      if (done) zoomGoal = null;
      return !done;
    };
    step.zooms = true;
    step.end = zoomed(zoomGoal, anchor);
    move(step);
  }
  const zoomFrom = () => (motion && motion.zooms && zoomGoal !== null ? zoomGoal : view.zoom);
  // Whole levels, where tiles are as sharp as they can be.
  const zoomBy = (levels, anchor) => {
    const from = zoomFrom();
    zoomTo(levels > 0 ? Math.floor(from + 0.001) + levels : Math.ceil(from - 0.001) + levels, anchor ?? middle());
  };

  let panGoal = null;
  function panBy(dx, dy) {
    const from = motion && motion.pans ? panGoal : { x: view.x, y: view.y };
    panGoal = { x: clamp(from.x + dx / scale(), bounds.x0, bounds.x1), y: clamp(from.y + dy / scale(), bounds.y0, bounds.y1) };
    const step = (ms) => {
      const rest = left(ms);
      const [x, y] = [view.x, view.y];
      view.x = panGoal.x + (x - panGoal.x) * rest;
      view.y = panGoal.y + (y - panGoal.y) * rest;
      keepIn();
      // Near the ends of an endless world a step may round to none.
      const stuck = rest > 0 && view.x === x && view.y === y;
      return !stuck && Math.hypot(view.x - panGoal.x, view.y - panGoal.y) * scale() > 0.4;
    };
    step.pans = true;
    step.end = { ...panGoal, zoom: view.zoom };
    move(step);
  }

  // Goes on with the speed of the hand, in pixels a millisecond, and slows down.
  function glide(vx, vy) {
    if (calm.matches || Math.hypot(vx, vy) < 0.06) return;
    move((ms) => {
      view.x -= (vx * ms) / scale();
      view.y -= (vy * ms) / scale();
      const slower = Math.exp(-ms / 320);
      vx *= slower;
      vy *= slower;
      keepIn();
      return Math.hypot(vx, vy) > 0.02;
    });
  }

  // The way on which the eye follows best, out and in again: Van Wijk and Nuij, "Smooth and efficient zooming and
  // panning", 2003, with their rho of 1.4.
  function fly(goal) {
    const RHO = 1.4;
    const end = kept(goal);
    const start = { ...view };
    const [w0, w1] = [start, end].map(({ zoom }) => size.width / 2 ** (zoom - ground.max_zoom));
    const [dx, dy] = [end.x - start.x, end.y - start.y];
    const far = Math.hypot(dx, dy);
    let path;
    if (far < w0 / 1e3) {
      const sign = w1 < w0 ? -1 : 1;
      path = { length: Math.abs(Math.log(w1 / w0)) / RHO, at: (s) => [0, w0 * Math.exp(sign * RHO * s)] };
    } else {
      const turn = (w, sign) => {
        const b = (w1 * w1 - w0 * w0 + sign * RHO ** 4 * far * far) / (2 * w * RHO * RHO * far);
        return -Math.asinh(b);
      };
      const [r0, r1] = [turn(w0, 1), turn(w1, -1)];
      path = {
        length: (r1 - r0) / RHO,
        at: (s) => {
          const along = (w0 / (RHO * RHO)) * (Math.cosh(r0) * Math.tanh(RHO * s + r0) - Math.sinh(r0));
          return [along / far, (w0 * Math.cosh(r0)) / Math.cosh(RHO * s + r0)];
        },
      };
    }
    const lasts = calm.matches ? 0 : clamp(path.length * 420, 250, 1800);
    let passed = 0;
    const step = (ms) => {
      passed += ms;
      const t = lasts > 0 ? Math.min(passed / lasts, 1) : 1;
      if (t >= 1) {
        Object.assign(view, end);
      } else {
        const [share, width] = path.at(t * t * (3 - 2 * t) * path.length);
        view.zoom = ground.max_zoom + Math.log2(size.width / width);
        view.x = start.x + dx * share;
        view.y = start.y + dy * share;
      }
      return t < 1;
    };
    step.end = end;
    move(step);
  }

  // ---------- tiles

  const tiles = new Map(); // address -> { picture, kind, state, since, used, stop }
  let arrived = []; // those that the next frames draw for the first time
  let frame = 0;
  let under = 0;
  let lacking = { draft: 0, full: 0 }; // tiles on the screen that are not there

  const best = () => source.kinds.length - 1;
  const address = (at, kind = best(), of = { said: about, layer }) => source.address(of.said, of.layer, kind, at);

  function tile(at, kind, of) {
    const found = tiles.get(address(at, kind, of));
    if (!found || found.state !== "ready") return null;
    found.used = frame;
    return found;
  }

  // The best picture of a tile that is there.
  function bestTile(at, of) {
    for (let kind = best(); kind >= 0; kind--) {
      const found = tile(at, kind, of);
      if (found) return found;
    }
    return null;
  }

  function load({ at, kind, place }) {
    const stop = new AbortController();
    const entry = { picture: null, kind, state: "waiting", since: 0, used: frame, stop };
    tiles.set(at, entry);
    under += 1;
    const of = { said: about, layer };
    const gone = () => tiles.get(at) !== entry;
    source.picture(at, stop.signal).then(
      (picture) => {
        under -= 1;
        invalidate();
        if (gone()) return picture.close?.();
        entry.picture = picture;
        arrived.push({ entry, place, of });
      },
      (error) => {
        under -= 1;
        invalidate();
        if (gone()) return;
        entry.state = "missing";
        // A server may be busy, or not there for a while.
        if (error.again_ms) setTimeout(() => (gone() || tiles.delete(at), invalidate()), error.again_ms);
      },
    );
  }

  function drop(at, entry) {
    entry.stop.abort();
    entry.picture?.close?.();
    tiles.delete(at);
  }

  function receive(now) {
    for (const { entry, place, of } of arrived.splice(0, ARRIVALS)) {
      Object.assign(entry, { state: "ready", since: now });
      hooks.arrived?.(place, entry.kind, of);
    }
  }

  // The tiles of a level that are in a rectangle of the world and in the map.
  function* covering(z, area = shown(0)) {
    const side = TILE * 2 ** (ground.max_zoom - z);
    const first = (a, b) => Math.floor(Math.max(a, b) / side);
    const last = (a, b) => Math.ceil(Math.min(a, b) / side) - 1;
    for (let y = first(area.y0, bounds.y0); y <= last(area.y1, bounds.y1); y++) {
      for (let x = first(area.x0, bounds.x0); x <= last(area.x1, bounds.x1); x++) yield { z, x, y };
    }
  }

  function shown(pad, of = view) {
    const a = fromScreen({ x: -pad, y: -pad }, of);
    const b = fromScreen({ x: size.width + pad, y: size.height + pad }, of);
    return { x0: a.x, y0: a.y, x1: b.x, y1: b.y };
  }

  const level = (of = view) => clamp(Math.round(of.zoom), ground.min_zoom, ground.max_zoom);

  // Asks for what is missing: the coarse picture of all, what is shown, from the middle outwards, then what is around. What
  // a server draws is asked for where a motion ends, a coarse picture first where there is none, then drafts, and stopped when
  // it is no longer wanted.
  function request() {
    const goal = (source.live && motion?.end) || view;
    const z = level(goal);
    const wanted = [];
    const want = (tilesOf, kind, priority) => {
      let lacks = 0;
      for (const place of tilesOf) {
        const at = address(place, kind);
        const known = tiles.get(at);
        lacks += known?.state !== "ready";
        if (known) {
          known.used = frame;
          continue;
        }
        const side = 2 ** (ground.max_zoom - place.z) * TILE;
        const far = Math.hypot((place.x + 0.5) * side - goal.x, (place.y + 0.5) * side - goal.y) * scale(goal);
        wanted.push({ at, kind, place, order: priority + far });
      }
      return lacks;
    };
    const seen = [...covering(z, shown(0, goal))];
    const around = covering(z, shown(TILE, goal));
    if (source.live) {
      const draftless = seen.filter((at) => tiles.get(address(at))?.state !== "ready");
      lacking = { draft: want(draftless, best() - 1, 1e4), full: want(seen, best(), 1e6) };
      want(coarseUnder(draftless.filter((at) => !coarser(at))), 0, 0);
      want(around, best() - 1, 1e8);
      thin(lacking.draft > 0);
    } else {
      want(covering(Math.min(z, ground.min_zoom + 2), shown(0)), 0, 0);
      lacking = { draft: 0, full: want(seen, 0, 1e4) };
      want(around, 0, 1e8);
    }
    wanted.sort((a, b) => a.order - b.order);
    let full = source.live ? fullUnderWay().length : 0;
    for (const one of wanted) {
      if (under >= source.atOnce) break;
      if (tiles.has(one.at) || (one.order >= 1e8 && motion)) continue;
      if (source.live && one.kind === best()) {
        if (full >= (lacking.draft > 0 ? source.fullBesideDrafts : source.fullAtOnce)) continue;
        full += 1;
      }
      load(one);
    }
  }

  // The tiles two levels up that hold some: a sixteenth of their pixels, so that there is something to go by at once.
  function coarseUnder(places) {
    const coarse = new Map();
    for (const { z, x, y } of places) {
      const up = Math.min(z - ground.min_zoom, 2);
      const [column, row] = [x, y].map((at) => Math.floor(at / 2 ** up));
      if (up > 0) coarse.set(`${column}/${row}`, { z: z - up, x: column, y: row });
    }
    return coarse.values();
  }

  const fullUnderWay = () => [...tiles].filter(([, entry]) => entry.state === "waiting" && !entry.picture && entry.kind === best());

  // Stops what nobody wants, and makes way for drafts.
  function thin(draftsLack) {
    for (const [at, entry] of tiles) if (entry.state === "waiting" && !entry.picture && entry.used < frame) drop(at, entry);
    if (draftsLack) for (const [at, entry] of fullUnderWay().slice(source.fullBesideDrafts)) drop(at, entry);
  }

  function forget() {
    const kept = about.dense && size.dense > 1.25 ? KEPT_TILES.dense : KEPT_TILES.plain;
    if (tiles.size <= kept) return;
    const old = [...tiles].filter(([, entry]) => entry.state !== "waiting" && entry.used < frame);
    old.sort(([, a], [, b]) => a.used - b.used);
    for (const [at, entry] of old.slice(0, tiles.size - kept)) drop(at, entry);
  }

  // Draws a part of a picture where a tile is; edges lie on whole pixels of the screen, so that neighbours meet.
  function put({ picture }, { z, x, y }, part) {
    const side = TILE * 2 ** (ground.max_zoom - z);
    const edge = (at, from, half) => Math.round(((at * side - from) * scale() + half) * size.dense);
    const [x0, x1] = [edge(x, view.x, size.width / 2), edge(x + 1, view.x, size.width / 2)];
    const [y0, y1] = [edge(y, view.y, size.height / 2), edge(y + 1, view.y, size.height / 2)];
    const { u, v, share } = part ?? { u: 0, v: 0, share: 1 };
    const pixels = picture.naturalWidth ?? picture.width;
    context.drawImage(picture, u * pixels, v * pixels, share * pixels, share * pixels, x0, y0, x1 - x0, y1 - y0);
  }

  // The nearest coarser tile that is there, and which part of it a tile is.
  function coarser({ z, x, y }) {
    for (let up = 1; up <= z - ground.min_zoom; up++) {
      const many = 2 ** up;
      const [column, row] = [Math.floor(x / many), Math.floor(y / many)];
      const found = bestTile({ z: z - up, x: column, y: row });
      if (found) return { found, part: { u: (x - column * many) / many, v: (y - row * many) / many, share: 1 / many } };
    }
    return null;
  }

  // Draws a tile, or what there is in its place: a part of a coarser one, finer ones over it, or that of before. Returns
  // whether it fades in, and whether it is there.
  function drawTile(at, now) {
    const own = []; // the best first, down to one that hides what is under it
    const opacity = ({ since }) => (calm.matches ? 1 : Math.min((now - since) / FADE_MS, 1));
    for (let kind = best(); kind >= 0; kind--) {
      const found = tile(at, kind);
      if (found && own.push({ found, opacity: opacity(found) }) && opacity(found) === 1) break;
    }
    if (own.at(-1)?.opacity !== 1) drawInstead(at);
    for (const { found, opacity } of own.reverse()) {
      context.globalAlpha = opacity;
      put(found, at);
    }
    context.globalAlpha = 1;
    return { fades: own.some(({ opacity }) => opacity < 1), there: own[0]?.opacity === 1 };
  }

  function drawInstead(at) {
    const { z, x, y } = at;
    const coarse = coarser(at);
    if (coarse) put(coarse.found, at, coarse.part);
    for (const [dx, dy] of z < ground.max_zoom ? [[0, 0], [1, 0], [0, 1], [1, 1]] : []) {
      const part = { z: z + 1, x: 2 * x + dx, y: 2 * y + dy };
      const fine = bestTile(part);
      if (fine) put(fine, part);
    }
    for (const of of earlier) {
      const before = bestTile(at, of);
      if (before) return put(before, at);
    }
  }

  // ---------- drawing

  function invalidate() {
    if (framed) return;
    framed = true;
    requestAnimationFrame(draw);
  }

  function draw(now) {
    framed = false;
    if (!about || paused) return;
    const ms = clamp(now - lastFrame, 1, 50);
    lastFrame = now;
    frame += 1;
    if (motion && !motion(ms)) {
      motion = null;
      remember();
    }
    receive(now);
    const still = hooks.paint ? hooks.paint(now) : paint(now);
    request();
    forget();
    tellScale();
    tell();
    $("in").disabled = view.zoom >= highest() - 0.01;
    $("out").disabled = view.zoom <= lowest() + 0.01;
    hooks.drawn?.(lacking);
    if (motion || !still || arrived.length > 0) invalidate();
  }

  // Draws the map; returns whether it would look the same in the next frame.
  function paint(now) {
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.fillStyle = "#e9ebe6";
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.save();
    const frame = source.live ? null : edges();
    if (frame) {
      context.beginPath();
      context.rect(...frame);
      context.fillStyle = "#dcdfd9";
      context.fill();
      context.clip();
    }
    context.imageSmoothingQuality = "medium";
    let [fades, there] = [false, true];
    for (const at of covering(level())) {
      const tile = drawTile(at, now);
      fades ||= tile.fades;
      there &&= tile.there;
    }
    if (there) earlier = [];
    context.restore();
    if (frame) {
      const [left, top, width, height] = frame;
      context.lineWidth = size.dense;
      context.strokeStyle = "#00000052";
      context.strokeRect(left - size.dense / 2, top - size.dense / 2, width + size.dense, height + size.dense);
    }
    context.setTransform(size.dense, 0, 0, size.dense, 0, 0);
    hooks.overlay?.(context);
    drawMarks();
    return !fades;
  }

  // The map's edges in pixels of the canvas: left, top, width, height.
  function edges() {
    const [a, b] = [toScreen({ x: bounds.x0, y: bounds.y0 }), toScreen({ x: bounds.x1, y: bounds.y1 })];
    const [left, top, right, bottom] = [a.x, a.y, b.x, b.y].map((edge) => Math.round(edge * size.dense));
    return [left, top, right - left, bottom - top];
  }

  function ring(at, radius, colour, width) {
    context.beginPath();
    context.arc(at.x, at.y, radius, 0, 7);
    context.lineWidth = width + 2.5;
    context.strokeStyle = "#ffffffd9";
    context.stroke();
    context.lineWidth = width;
    context.strokeStyle = colour;
    context.stroke();
  }

  function drawMarks() {
    const near = probe.near;
    if (near && near !== chosen) ring(toScreen(near), 7, "#23282d", 1.5);
    if (chosen) drawChosen(toScreen(chosen));
    if (probe.kind === "pin") ring(toScreen(probe.at), 4, "#23282d", 2);
    if (probe.kind === "middle" && probe.cross) {
      const { x, y } = middle();
      for (const [width, colour] of [[3.5, "#ffffffc0"], [1.25, "#23282d"]]) {
        context.beginPath();
        for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
          context.moveTo(x + 4 * dx, y + 4 * dy);
          context.lineTo(x + 11 * dx, y + 11 * dy);
        }
        context.lineWidth = width;
        context.strokeStyle = colour;
        context.stroke();
      }
    }
  }

  function drawChosen(at) {
    ring(at, 9, "#a2402a", 2.5);
    context.font = "600 13px system-ui, sans-serif";
    const width = context.measureText(chosen.name).width;
    const [x, y] = [at.x - width / 2 - 9, at.y - 43];
    context.beginPath();
    context.roundRect(x, y, width + 18, 25, 6);
    context.fillStyle = "#a2402a";
    context.fill();
    context.fillStyle = "#fff";
    context.textBaseline = "middle";
    context.fillText(chosen.name, x + 9, y + 13);
  }

  // ---------- heights

  const heights = new Map(); // "z/x/y" -> { values, used, rough }, which is whether better ones come

  function askHeights(key) {
    if (heights.has(key)) return;
    heights.set(key, { values: null, used: frame });
    source.askHeights(about, key);
    if (heights.size <= KEPT_HEIGHTS) return;
    const [oldest] = [...heights].sort(([, a], [, b]) => a.used - b.used)[0];
    heights.delete(oldest);
  }

  // The inverse of what encode.rs packs: differences in zigzag numbers, of a row's first to that of the row before.
  function unpacked(bytes) {
    const side = TILE / about.heights.spacing_px + 1;
    const values = new Int32Array(side * side);
    let at = 0;
    for (let index = 0; index < values.length; index++) {
      let [number, shift, byte] = [0, 0, 0x80];
      for (; byte & 0x80; shift += 7) {
        byte = bytes[at++];
        number |= (byte & 0x7f) << shift;
      }
      const before = index === 0 ? 0 : index % side === 0 ? values[index - side] : values[index - 1];
      values[index] = before + ((number >>> 1) ^ -(number & 1));
    }
    return values;
  }

  async function takeHeights(key, text, rough = false) {
    const of = about;
    const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
    if (of !== about) return;
    heights.set(key, { values: unpacked(bytes), used: frame, rough });
    tell();
    hooks.heights?.(key);
  }

  // Height in metres and slope in degrees, from the tile of this zoom or, until it is there, from the finest that is.
  function groundAt(world) {
    if (!about.heights || world.x < bounds.x0 || world.x > bounds.x1 || world.y < bounds.y0 || world.y > bounds.y1) return null;
    for (let z = level(); z >= ground.min_zoom; z--) {
      const [x, y] = [world.x, world.y].map((at) => at * 2 ** (z - ground.max_zoom));
      const [column, row] = [x, y].map((at) => Math.floor(at / TILE));
      const key = `${z}/${column}/${row}`;
      if (z === level() && !(source.live && motion)) askHeights(key);
      const found = heights.get(key);
      if (!found?.values) continue;
      found.used = frame;
      const under = between(found.values, x - column * TILE, y - row * TILE, ground.finest_m * 2 ** (ground.max_zoom - z));
      return { ...under, rough: found.rough || z < level() };
    }
    return null;
  }

  // The finest heights that there are of a tile, and which part of their own tile it is.
  function gridOf({ z, x, y }) {
    for (let up = 0; up <= z - ground.min_zoom; up++) {
      const many = 2 ** up;
      const [column, row] = [Math.floor(x / many), Math.floor(y / many)];
      const found = heights.get(`${z - up}/${column}/${row}`);
      if (!found?.values) continue;
      found.used = frame;
      return { values: found.values, u: (x - column * many) / many, v: (y - row * many) / many, share: 1 / many };
    }
    return null;
  }

  // Heights are those of the middles of pixels.
  function between(values, x, y, pixel_m) {
    const { spacing_px: spacing, step_m: step } = about.heights;
    const cells = TILE / spacing;
    const [u, v] = [x, y].map((at) => clamp((at - 0.5) / spacing, 0, cells));
    const [i, j] = [u, v].map((at) => Math.min(Math.floor(at), cells - 1));
    const at = (di, dj) => values[(j + dj) * (cells + 1) + i + di] * step;
    const mix = (a, b, share) => a * (1 - share) + b * share;
    const [north, south] = [0, 1].map((dj) => mix(at(0, dj), at(1, dj), u - i));
    const [west, east] = [0, 1].map((di) => mix(at(di, 0), at(di, 1), v - j));
    const rise = Math.hypot(east - west, south - north) / (spacing * pixel_m);
    return { height: mix(north, south, v - j), slope: (Math.atan(rise) * 180) / Math.PI };
  }

  // ---------- what stands under the pointer

  let pointer = null; // of a mouse, on the screen
  let pin = null; // where a finger has tapped, in the world
  let chosen = null; // the name that was searched for
  const probe = { kind: "middle", at: { x: 0, y: 0 }, near: null, cross: false };

  function findProbe() {
    if (pointer) return ["pointer", fromScreen(pointer)];
    if (pin) return ["pin", pin];
    return ["middle", { x: view.x, y: view.y }];
  }

  function nearest(world) {
    let [best, far] = [null, NEAR_PX / scale()];
    for (const name of names) {
      const distance = Math.hypot(name.x - world.x, name.y - world.y);
      if (distance < far) [best, far] = [name, distance];
    }
    return best;
  }

  const compass = (dx, dy) => {
    const points = ["E", "NE", "N", "NW", "W", "SW", "S", "SE"];
    return points[(Math.round(Math.atan2(-dy, dx) / (Math.PI / 4)) + 8) % 8];
  };
  const length = (metres) => (metres < 995 ? `${Math.round(metres)} m` : `${(metres / 1e3).toFixed(metres < 9950 ? 1 : 0)} km`);
  const grouped = (number) => number.toLocaleString("en").replaceAll(",", "\u202f").replace("-", "\u2212");
  const write = (id, text) => {
    if ($(id).textContent !== text) $(id).textContent = text;
  };

  function tell() {
    const before = probe.near;
    [probe.kind, probe.at] = findProbe();
    probe.near = nearest(probe.at);
    // What is drawn follows at the next frame.
    if (before !== probe.near) invalidate();
    const [east, north] = toMetres(probe.at);
    const pixel_m = ground.finest_m / scale();
    const digits = pixel_m < 3 ? 3 : pixel_m < 30 ? 2 : 1;
    const side = (metres, plus, minus) => {
      const km = Math.abs(metres) < 1e7 ? Math.abs(metres / 1e3).toFixed(digits) : grouped(Math.round(Math.abs(metres / 1e3)));
      return `${km}\u202fkm ${metres < 0 ? minus : plus}`;
    };
    write("at", `${side(east, "E", "W")}, ${side(north, "N", "S")}`);
    const under = groundAt(probe.at);
    write("height", under === null ? "" : `${under.rough ? "\u2248\u202f" : ""}${grouped(Math.round(under.height))}\u202fm`);
    tellName();
    hooks.told?.({ at_m: [east, north], kind: probe.kind, ...under });
  }

  function tellName() {
    const near = probe.near;
    if (!near) return write("near", "");
    const metres = Math.hypot(near.x - probe.at.x, near.y - probe.at.y) * ground.finest_m;
    const away = metres * scale() < 4 * ground.finest_m ? "" : `, ${length(metres)} ${compass(near.x - probe.at.x, near.y - probe.at.y)}`;
    const [name, rest] = [document.createElement("b"), document.createElement("i")];
    name.textContent = near.name;
    rest.textContent = ` ${near.kind}${away}`;
    if ($("near").textContent !== near.name + rest.textContent) $("near").replaceChildren(name, rest);
  }

  function tellScale() {
    const most = ((size.width <= 640 ? 72 : 110) / scale()) * ground.finest_m;
    const power = 10 ** Math.floor(Math.log10(most));
    const metres = [5, 2, 1].find((step) => step * power <= most) * power;
    write("length", metres >= 1e3 ? `${grouped(metres / 1e3)} km` : metres >= 1 ? `${metres} m` : `${Math.round(metres * 100)} cm`);
    $("bar").style.width = `${((metres / ground.finest_m) * scale()).toFixed(1)}px`;
  }

  // ---------- pointers

  const touching = new Map(); // pointer -> where it is
  let trail = []; // where the one pointer was, for its speed
  let travelled = 0;
  let lastTap = null;

  let grip = null; // what a page's tool does with the one pointer: { move, end }

  const place = (event) => ({ x: event.clientX, y: event.clientY });

  function down(event) {
    if (event.pointerType === "mouse" && event.button !== 0) return;
    canvas.setPointerCapture(event.pointerId);
    canvas.focus({ preventScroll: true });
    if (touching.size === 0) {
      travelled = 0;
      grip = hooks.grip?.(place(event), event) ?? null;
    } else if (grip) {
      grip.end(false);
      grip = null;
    }
    touching.set(event.pointerId, place(event));
    if (grip) return;
    canvas.classList.add("held");
    motion = null;
    zoomGoal = null;
    trail = [{ ...place(event), time: event.timeStamp }];
  }

  function moved(event) {
    const at = place(event);
    pointer = event.pointerType === "mouse" ? at : null;
    const before = touching.get(event.pointerId);
    if (before && grip) {
      grip.move(at);
    } else if (before && touching.size <= 2) {
      const held = hold();
      touching.set(event.pointerId, at);
      follow(held, hold());
      travelled += Math.hypot(at.x - before.x, at.y - before.y);
      if (event.pointerType !== "mouse" && travelled > 8) pin = null;
      trail.push({ ...at, time: event.timeStamp });
      while (trail.length > 2 && trail[0].time < event.timeStamp - 90) trail.shift();
    } else if (!before) {
      hooks.hover?.(at);
    }
    invalidate();
  }

  // Where the fingers hold the map: their middle, and how far they are from it.
  function hold() {
    const all = [...touching.values()];
    const x = all.reduce((sum, at) => sum + at.x, 0) / all.length;
    const y = all.reduce((sum, at) => sum + at.y, 0) / all.length;
    return { x, y, spread: all.length < 2 ? 0 : Math.hypot(all[0].x - x, all[0].y - y) };
  }

  function follow(from, to) {
    view.x -= (to.x - from.x) / scale();
    view.y -= (to.y - from.y) / scale();
    if (from.spread > 1 && to.spread > 1) zoomAround(view.zoom + Math.log2(to.spread / from.spread), to);
    keepIn();
  }

  function up(event) {
    if (!touching.delete(event.pointerId)) return;
    if (grip) {
      grip.end(event.type === "pointerup");
      grip = null;
      invalidate();
      return;
    }
    if (touching.size > 0) {
      // The fingers that stay do not fling the map.
      trail = [];
      return;
    }
    canvas.classList.remove("held");
    if (event.type === "pointerup" && travelled <= 8) {
      tapped(event);
    } else if (trail.length > 1) {
      const [first, last] = [trail[0], trail[trail.length - 1]];
      const ms = Math.max(last.time - first.time, 8);
      if (event.timeStamp - last.time < 60) glide((last.x - first.x) / ms, (last.y - first.y) / ms);
    }
    if (!motion) remember();
    invalidate();
  }

  function tapped(event) {
    const at = place(event);
    const twice = lastTap && event.timeStamp - lastTap.time < 320 && Math.hypot(at.x - lastTap.x, at.y - lastTap.y) < 28;
    lastTap = twice ? null : { ...at, time: event.timeStamp };
    if (event.pointerType !== "mouse") pin = fromScreen(at);
    if (twice) zoomBy(event.shiftKey ? -1 : 1, at);
  }

  function wheeled(event) {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 24 : event.deltaMode === 2 ? 400 : 1;
    // A pinch on a touchpad comes as a wheel with the control key, in small steps.
    const levels = -event.deltaY * lines * (event.ctrlKey ? 0.012 : 0.0032);
    zoomTo(zoomFrom() + clamp(levels, -1.5, 1.5), place(event));
  }

  // ---------- keys

  function pressed(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.("input, select, textarea")) return;
    if (hooks.key?.(event)) return event.preventDefault();
    // Buttons and the switch of layers have keys of their own.
    const onButton = event.target instanceof HTMLButtonElement;
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const arrow = onButton ? null : arrows[event.key];
    const far = event.shiftKey ? 3 * KEY_PX : KEY_PX;
    const acts = {
      "+": () => zoomBy(1),
      "=": () => zoomBy(1),
      "-": () => zoomBy(-1),
      _: () => zoomBy(-1),
      0: () => fly(whole()),
      Home: () => fly(whole()),
      "/": () => $("query").focus(),
      l: () => show((layer + 1) % about.layers.length),
      Escape: () => choose(null),
    };
    const act = arrow ? () => panBy(arrow[0] * far, arrow[1] * far) : acts[event.key];
    if (!act) return;
    event.preventDefault();
    if (arrow || event.key === "+" || event.key === "-") [probe.cross, pointer, pin] = [true, null, null];
    act();
  }

  // ---------- search

  // Letters without marks, so that a keyboard without them finds all.
  const plain = (text) => text.normalize("NFD").replace(/\p{M}/gu, "").replaceAll("ß", "ss").toLowerCase();
  let found = [];
  let picked = 0;

  function search() {
    const query = plain($("query").value.trim());
    const worth = ({ plain }) => {
      const at = plain.indexOf(query);
      return at < 0 ? 3 : at === 0 ? 0 : /[\p{L}\p{N}]/u.test(plain[at - 1]) ? 2 : 1;
    };
    const matches = names.map((name) => ({ name, worth: worth(name) })).filter(({ worth }) => worth < 3);
    // Names come by rank, and the order of equals stays.
    matches.sort((a, b) => a.worth - b.worth);
    const { rows = [], first = false } = hooks.search?.($("query").value.trim()) ?? {};
    found = matches.slice(0, 8 - rows.length).map(({ name }) => name);
    found.push(...rows);
    list(query !== "");
    if (first) pick(found.length - rows.length);
  }

  function list(asked) {
    const rows = found.map((name, index) => {
      const row = document.createElement("li");
      const [title, kind] = [document.createElement("b"), document.createElement("i")];
      row.classList.toggle("act", Boolean(name.act));
      title.textContent = name.name;
      kind.textContent = name.kind;
      row.append(title, kind);
      row.id = `found-${index}`;
      row.setAttribute("role", "option");
      // Before the search loses the focus and its list.
      row.addEventListener("pointerdown", (event) => event.preventDefault());
      row.addEventListener("click", () => go(name));
      return row;
    });
    if (asked && rows.length === 0) {
      const none = document.createElement("li");
      none.className = "none";
      none.textContent = "No such name";
      rows.push(none);
    }
    $("found").replaceChildren(...rows);
    $("query").setAttribute("aria-expanded", String(found.length > 0));
    pick(0);
  }

  function pick(index) {
    picked = found.length ? (index + found.length) % found.length : 0;
    for (const [at, row] of [...$("found").children].entries()) {
      row.setAttribute("aria-selected", String(at === picked && found.length > 0));
      if (at === picked) row.scrollIntoView({ block: "nearest" });
    }
    if (found.length) $("query").setAttribute("aria-activedescendant", `found-${picked}`);
    else $("query").removeAttribute("aria-activedescendant");
  }

  function close() {
    found = [];
    $("found").replaceChildren();
    $("query").setAttribute("aria-expanded", "false");
    $("query").removeAttribute("aria-activedescendant");
  }

  function go(name) {
    if (name.act) {
      close();
      return name.act();
    }
    $("query").value = name.name;
    canvas.focus({ preventScroll: true });
    close();
    choose(name);
    fly({ x: name.x, y: name.y, zoom: Math.max(view.zoom, ground.max_zoom - (source.live ? 3 : 1)) });
  }

  function choose(name) {
    chosen = name;
    [pointer, pin, probe.cross] = [null, null, false];
    if (!name) $("query").value = "";
    invalidate();
  }

  function typed(event) {
    const steps = { ArrowDown: 1, ArrowUp: -1 };
    if (steps[event.key]) {
      if (!found.length) search();
      else pick(picked + steps[event.key]);
    } else if (event.key === "Enter") {
      if (found[picked]) go(found[picked]);
    } else if (event.key === "Escape") {
      close();
      choose(null);
      canvas.focus({ preventScroll: true });
    } else {
      return;
    }
    event.preventDefault();
  }

  // ---------- layers

  function show(index) {
    if (index !== layer) remind({ said: about, layer });
    layer = index;
    for (const [at, button] of [...$("layers").children].entries()) {
      button.setAttribute("aria-checked", String(at === index));
      button.tabIndex = at === index ? 0 : -1;
    }
    remember();
    invalidate();
  }

  // What was shown stays until all of the new is there.
  const remind = (of) => {
    earlier = [of, ...earlier].slice(0, 3);
  };

  function offerLayers() {
    const buttons = about.layers.map(({ title }, index) => {
      const button = document.createElement("button");
      button.textContent = title;
      button.setAttribute("role", "radio");
      button.addEventListener("click", () => show(index));
      return button;
    });
    $("layers").replaceChildren(...buttons);
    $("layers").hidden = buttons.length < 2;
    $("layers").onkeydown = (event) => {
      const step = { ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1 }[event.key];
      if (!step) return;
      event.preventDefault();
      show((layer + step + buttons.length) % buttons.length);
      buttons[layer].focus();
    };
  }

  // ---------- the address: #east,north,metres a pixel,layer

  let remembering = 0;
  function remember() {
    clearTimeout(remembering);
    remembering = setTimeout(() => {
      if (!about) return;
      const [east, north] = toMetres(view).map(Math.round);
      const pixel_m = Number((ground.finest_m / scale()).toPrecision(4));
      try {
        history.replaceState(null, "", `#${east},${north},${pixel_m},${about.layers[layer].name}`);
      } catch {
        // A browser may forbid it for pages from the disk; the map does without.
      }
    }, 200);
  }

  function recall() {
    const [east, north, pixel_m, name] = decodeURIComponent(location.hash.slice(1)).split(",");
    const numbers = [east, north, pixel_m].map(Number);
    show(Math.max(0, about.layers.findIndex((layer) => layer.name === name)));
    if (!(pixel_m && numbers.every(Number.isFinite) && numbers[2] > 0)) return Object.assign(view, whole());
    Object.assign(view, kept({ ...toWorld(numbers), zoom: zoomOf(numbers[2]) }));
  }

  // ---------- the beginning

  function resize() {
    const all = about && !source.live && Math.abs(view.zoom - whole().zoom) < 0.01;
    size = { width: innerWidth, height: innerHeight, dense: devicePixelRatio || 1 };
    canvas.width = Math.round(size.width * size.dense);
    canvas.height = Math.round(size.height * size.dense);
    if (!about) return;
    if (all) Object.assign(view, whole());
    keepIn();
    invalidate();
  }

  const looking = () => ({ at_m: toMetres(view), pixel_m: ground.finest_m / scale() });

  // Shows a map: at first where the address says, and another one after it from where one was.
  function start(said, from = FILES) {
    const before = about && { said: about, layer, look: looking(), style: about.layers[layer].name };
    [about, source, ground] = [said, from, said.ground];
    const [west, south, east, north] = ground.bounds_m;
    const [a, b] = [toWorld([west, north]), toWorld([east, south])];
    bounds = { x0: a.x, y0: a.y, x1: b.x, y1: b.y };
    document.title = about.name;
    write("name", about.name);
    write("about", about.description);
    $("about").title = about.description;
    $("foot").hidden = false;
    probe.cross = matchMedia("(hover: none)").matches;
    if (before) {
      [motion, zoomGoal, pin, names] = [null, null, null, []];
      heights.clear();
      layer = Math.max(0, about.layers.findIndex(({ name }) => name === before.style));
      Object.assign(view, kept({ ...toWorld(before.look.at_m), zoom: zoomOf(before.look.pixel_m) }));
      const alike = ground.finest_m === before.said.ground.finest_m && ground.max_zoom === before.said.ground.max_zoom;
      if (alike) remind(before);
      else earlier = [];
    }
    offerLayers();
    if (before) show(layer);
    else recall();
    invalidate();
  }

  resize();
  addEventListener("resize", resize);
  addEventListener("hashchange", () => {
    recall();
    invalidate();
  });
  addEventListener("keydown", (event) => about && pressed(event));
  const listen = (target, listeners) => Object.entries(listeners).forEach(([type, act]) => target.addEventListener(type, (event) => about && act(event)));
  listen(canvas, { pointerdown: down, pointermove: moved, pointerup: up, pointercancel: up });
  listen(canvas, {
    pointerleave: () => {
      pointer = null;
      invalidate();
    },
  });
  canvas.addEventListener("wheel", (event) => about && wheeled(event), { passive: false });
  listen($("query"), { input: search, focus: search, keydown: typed, blur: close });
  listen($("in"), { click: () => zoomBy(1) });
  listen($("out"), { click: () => zoomBy(-1) });
  listen($("all"), { click: () => fly(whole()) });

  return {
    map: start,
    names(rows) {
      names = rows.map(([name, kind, east, north, rank]) => ({ name, kind, rank, plain: plain(name), ...toWorld([east, north]) }));
      invalidate();
    },
    heights: takeHeights,
    // For tests: where the view is, and whether anything still moves or loads.
    state() {
      const { at_m: [east_m, north_m], pixel_m } = looking();
      const missing = [...tiles].filter(([, entry]) => entry.state === "missing").map(([at]) => at);
      const still = !motion && !framed && under === 0;
      return { east_m, north_m, pixel_m, zoom: view.zoom, layer: about.layers[layer].name, tiles: tiles.size, missing, lacking, moving: motion !== null, still };
    },

    // What a page that adds to the map needs, in metres and in pixels of the screen.
    //
    // Hooks: overlay(context) draws over the map, paint(now) draws instead of it, drawn(lacking) follows each frame,
    // arrived(place, kind, of) each picture and heights(key) each grid; told(under) what is told of the place under the
    // pointer; grip(at, event) may take the pointer and returns { move, end }; hover, key and search(query) => { rows, first }.
    hooks,
    invalidate,
    looking,
    look({ at_m, pixel_m }, flies = false) {
      const goal = kept({ ...toWorld(at_m), zoom: zoomOf(pixel_m) });
      if (flies) return fly(goal);
      [motion, zoomGoal] = [null, null];
      Object.assign(view, goal);
      remember();
      invalidate();
    },
    toScreen: (at_m) => toScreen(toWorld(at_m)),
    toMetres: (at) => toMetres(fromScreen(at)),
    panBy,
    zoomBy,
    nothingWanted: (is) => {
      paused = is;
      if (is) for (const [at, entry] of tiles) if (entry.state === "waiting") drop(at, entry);
      invalidate();
    },
    noHeights: (key) => (heights.delete(key), invalidate()),
    // The tiles on the screen, each with the best picture there is of it and which part of that it is, and heights likewise.
    patches() {
      const whole = { u: 0, v: 0, share: 1 };
      const of = (at) => {
        const own = bestTile(at);
        if (!motion) askHeights(`${at.z}/${at.x}/${at.y}`);
        return { ...at, picture: own ? { found: own, part: whole } : coarser(at), grid: gridOf(at) };
      };
      return [...covering(level())].map(of);
    },
    about: () => about,
    layer: () => about.layers[layer].name,
    choose: (name, at_m) => choose(name === null ? null : { name, ...toWorld(at_m) }),
    addNames(rows) {
      const known = new Set(names.map(({ name, kind, x, y }) => `${name} ${kind} ${x} ${y}`));
      for (const { name, kind, at } of rows) {
        const one = { name, kind, rank: 0, plain: plain(name), ...toWorld(at) };
        if (!known.has(`${name} ${kind} ${one.x} ${one.y}`)) names.push(one);
      }
      // As many as are looked through at each move of the pointer without being felt.
      names = names.slice(-4000);
      tell();
    },
  };
})();

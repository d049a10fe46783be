// The rectangle of tiles to bake: drawn on the map, told as a command, baked.
import { $, bytes, copy, debounced, duration, grouped, kilometres, make } from "./page.js";
import { ask } from "./server.js";

const EXPORTS = ["height", "blend", "normal", "map", "colour", "water", "geotiff", "vector", "gltf", "web"];
const FIRST = ["height", "blend", "normal", "map"];
// What may be done with a bake that is in the folder, by the option that does it.
const WAYS = { resume: "Go on with it", overwrite: "Replace it" };
const GRIP_PX = { mouse: 9, touch: 22 };
const POLL_MS = 600;

export function rectangle() {
  let world = null;
  let area = null; // in tiles: { x, y, cols, rows }
  let armed = false; // the next drag draws
  let planning = null;
  let bake = null; // { number, timer }
  let planned = null;

  const side = () => world.tile_cells * world.spacing_m;
  // Tiles are counted east and south.
  const tileAt = (at) => terrane.toMetres(at).map((metres, axis) => Math.floor((axis ? -metres : metres) / side()));
  const corner = (x, y) => terrane.toScreen([x * side(), -y * side()]);
  const isOpen = () => !$("bake").hidden;

  function box() {
    const [a, b] = [corner(area.x, area.y), corner(area.x + area.cols, area.y + area.rows)];
    return { x0: a.x, y0: a.y, x1: b.x, y1: b.y };
  }

  const between = ([x0, y0], [x1, y1]) => ({
    x: Math.min(x0, x1),
    y: Math.min(y0, y1),
    cols: Math.abs(x1 - x0) + 1,
    rows: Math.abs(y1 - y0) + 1,
  });

  // ---------- on the map

  function overlay(context) {
    if (!isOpen() || !area) return;
    const { x0, y0, x1, y1 } = box();
    // Far beyond the screen a canvas loses its precision.
    const [left, right] = [x0, x1].map((x) => Math.min(Math.max(x, -50), innerWidth + 50));
    const [top, bottom] = [y0, y1].map((y) => Math.min(Math.max(y, -50), innerHeight + 50));
    context.fillStyle = "#a2402a14";
    context.fillRect(left, top, right - left, bottom - top);
    lines(context, { left, right, top, bottom, x0, y0, x1, y1 });
    for (const [width, colour] of [[4.5, "#ffffffd0"], [2, "#a2402a"]]) {
      context.lineWidth = width;
      context.strokeStyle = colour;
      context.strokeRect(left, top, right - left, bottom - top);
    }
    for (const { x, y, middle } of handles()) {
      context.beginPath();
      context.arc(x, y, middle ? 8 : 5.5, 0, 7);
      context.fillStyle = middle ? "#a2402a" : "#fff";
      context.fill();
      context.lineWidth = 2;
      context.strokeStyle = middle ? "#fff" : "#a2402a";
      context.stroke();
    }
  }

  // The edges of the tiles, where they are wide enough to tell apart.
  function lines(context, { left, right, top, bottom, x0, y0, x1, y1 }) {
    const step = (x1 - x0) / area.cols;
    if (step < 12) return;
    context.beginPath();
    for (let x = x0 + step * Math.max(1, Math.ceil((left - x0) / step)); x < Math.min(right, x1 - 1); x += step) {
      context.moveTo(x, top);
      context.lineTo(x, bottom);
    }
    for (let y = y0 + step * Math.max(1, Math.ceil((top - y0) / step)); y < Math.min(bottom, y1 - 1); y += step) {
      context.moveTo(left, y);
      context.lineTo(right, y);
    }
    context.lineWidth = 1;
    context.strokeStyle = "#a2402a59";
    context.stroke();
  }

  // Corners, middles of edges and the middle: which sides each moves.
  function handles() {
    const { x0, y0, x1, y1 } = box();
    const [xs, ys] = [[x0, (x0 + x1) / 2, x1], [y0, (y0 + y1) / 2, y1]];
    const room = Math.min(x1 - x0, y1 - y0) > 56;
    const all = [];
    for (const h of [-1, 0, 1]) {
      for (const v of [-1, 0, 1]) {
        const middle = h === 0 && v === 0;
        if (!room && (h === 0) !== (v === 0)) continue;
        all.push({ x: xs[h + 1], y: ys[v + 1], h, v, middle });
      }
    }
    return all;
  }

  function handleAt(at, reach) {
    if (!isOpen() || !area) return null;
    const far = (handle) => Math.hypot(handle.x - at.x, handle.y - at.y);
    const [nearest] = handles().sort((a, b) => far(a) - far(b));
    return far(nearest) <= reach ? nearest : null;
  }

  function grip(at, event) {
    if (armed) {
      const first = tileAt(at);
      const before = area;
      let moved = false;
      return {
        move(to) {
          moved = true;
          set(between(first, tileAt(to)));
        },
        end(good) {
          if (!good) area = before;
          else if (!moved) set(between(first, first));
          arm(!good);
        },
      };
    }
    const handle = handleAt(at, event.pointerType === "mouse" ? GRIP_PX.mouse : GRIP_PX.touch);
    if (!handle) return null;
    const from = { ...area };
    const [startX, startY] = tileAt(at);
    return {
      move(to) {
        const [dx, dy] = [tileAt(to)[0] - startX, tileAt(to)[1] - startY];
        if (handle.middle) return set({ ...from, x: from.x + dx, y: from.y + dy });
        const stretched = (low, count, way, d) => {
          const [a, b] = [low + (way < 0 ? d : 0), low + count - 1 + (way > 0 ? d : 0)];
          return way < 0 ? [Math.min(a, b), b] : [a, Math.max(a, b)];
        };
        const [x0, x1] = stretched(from.x, from.cols, handle.h, dx);
        const [y0, y1] = stretched(from.y, from.rows, handle.v, dy);
        set(between([x0, y0], [x1, y1]));
      },
      end: () => {},
    };
  }

  const CURSORS = ["draws", "moves", "ns", "ew", "nwse", "nesw"];
  function hover(at) {
    const handle = armed ? null : handleAt(at, GRIP_PX.mouse);
    const shape = armed ? "draws" : !handle ? "" : handle.middle ? "moves" : handle.h === 0 ? "ns" : handle.v === 0 ? "ew" : handle.h === handle.v ? "nwse" : "nesw";
    for (const one of CURSORS) $("map").classList.toggle(one, one === shape);
  }

  // ---------- the panel

  function arm(is) {
    armed = is;
    $("map").classList.toggle("draws", is);
    $("bake-hint").hidden = !is && Boolean(area);
    $("bake-body").hidden = !area || is;
    terrane.invalidate();
  }

  function set(now) {
    if (area && ["x", "y", "cols", "rows"].every((key) => area[key] === now[key])) return;
    area = now;
    for (const key of ["x", "y", "cols", "rows"]) $(`bake-${key}`).value = area[key];
    const scale = Number($("bake-scale").value);
    const vertices = [area.cols, area.rows].map((tiles) => grouped(tiles * world.tile_cells + 1));
    const [wide, high] = [area.cols, area.rows].map((tiles) => kilometres(tiles * side()));
    $("bake-size").textContent = `${wide.replace(/\u202fkm$/, "")} \u00d7 ${high}, ${scale === 1 ? `${vertices.join(" \u00d7 ")} vertices` : `every ${scale}${scale === 2 ? "nd" : "th"} vertex`}`;
    ended();
    plan();
    terrane.invalidate();
  }

  const asked = () => ({
    world: world.id,
    at: [area.x, area.y],
    size: [area.cols, area.rows],
    scale: Number($("bake-scale").value),
    ...files(),
  });

  // A profile has its own files, and any others beside them.
  function files() {
    const profile = $("bake-profile").value || null;
    const exports = [...$("bake-exports").querySelectorAll("input:checked")].map(({ value }) => value).join(",");
    return { profile, exports: profile && !exports ? null : exports };
  }

  function plan() {
    planning?.abort();
    planned = null;
    $("bake-plan").classList.add("old");
    $("bake-go").disabled = true;
    planQuick();
    planSoon();
  }

  const planQuick = debounced(async () => {
    const signal = (planning = new AbortController()).signal;
    try {
      $("bake-command").querySelector("code").textContent = (await ask("POST", "api/plan", { ...asked(), quick: true }, signal)).command;
    } catch (fault) {
      if (fault.name !== "AbortError") tellFault(fault);
    }
  }, 60);

  const planSoon = debounced(async () => {
    const signal = (planning ??= new AbortController()).signal;
    try {
      const told = await ask("POST", "api/plan", asked(), signal);
      planned = told;
      $("bake-command").querySelector("code").textContent = told.command;
      const facts = [
        ["On disk", bytes(told.disk_bytes)],
        ["Time", `about ${duration(told.seconds)}`],
        ["Memory", bytes(told.memory_bytes)],
      ];
      $("bake-plan").replaceChildren(...facts.map(([title, text]) => make("div", {}, make("dt", { textContent: title }), make("dd", { textContent: text }))));
      $("bake-plan").classList.remove("old");
      if (bake) return;
      tellFault(told.fault);
      $("bake-go").disabled = Boolean(told.fault);
    } catch (fault) {
      if (fault.name === "AbortError") return;
      $("bake-plan").replaceChildren();
      tellFault(fault);
    }
  }, 450);

  // With a button for each way out that the hint names.
  function tellFault(fault) {
    $("bake-fault").hidden = !fault;
    if (!fault) return;
    const parts = [make("div", { textContent: fault.error })];
    if (fault.place) parts.push(make("pre", { textContent: fault.place }));
    if (fault.hint) parts.push(make("p", { textContent: fault.hint }));
    const ways = Object.entries(WAYS).filter(([mode]) => fault.hint?.includes(`--${mode}`));
    const acts = ways.map(([mode, title]) => make("button", { className: "plain", textContent: title, onclick: () => start(mode) }));
    $("bake-fault").replaceChildren(...parts, ...acts);
  }

  // ---------- the bake

  async function start(mode) {
    ended();
    $("bake-go").disabled = true;
    try {
      const { bake: number } = await ask("POST", "api/bakes", { ...asked(), mode });
      bake = { number, timer: 0 };
      $("bake-go").textContent = "Cancel";
      $("bake-go").disabled = false;
      $("bake-progress").hidden = false;
      look();
    } catch (fault) {
      $("bake-go").disabled = !planned;
      tellFault(fault);
    }
  }

  async function look() {
    const own = bake;
    let told;
    try {
      told = await ask("GET", `api/bakes/${own.number}`);
    } catch (fault) {
      if (bake === own) finish(() => tellFault(fault));
      return;
    }
    if (bake !== own) return;
    const share = told.of ? told.done / told.of : 0;
    $("bake-progress").querySelector(".meter div").style.transform = `scaleX(${share})`;
    const left = told.seconds_left === null || told.seconds_left === undefined ? "" : `, ${duration(told.seconds_left)} left`;
    $("bake-progress").querySelector("p").textContent = `${told.stage ?? "begins"}${told.of ? ` ${grouped(told.done)} of ${grouped(told.of)}` : ""}${left}`;
    const ends = { done: () => done(own.number, told.out), failed: () => tellFault(told.error), cancelled: plan };
    if (told.state in ends) finish(ends[told.state]);
    else own.timer = setTimeout(look, POLL_MS);
  }

  function finish(tell) {
    bake = null;
    $("bake-go").textContent = "Bake";
    $("bake-go").disabled = !planned;
    $("bake-progress").hidden = true;
    tell();
  }

  function done(number, out) {
    const [link, image, text] = [$("bake-done").querySelector("a"), $("bake-done").querySelector("img"), $("bake-done").querySelector("p")];
    const map = `bakes/${number}/map.png`;
    const hasMap = Boolean(asked().exports?.split(",").includes("map"));
    link.hidden = !hasMap;
    if (hasMap) [link.href, image.src] = [map, map];
    const copyIt = make("button", { className: "text", textContent: "Copy", onclick: () => copy(out) });
    text.replaceChildren(`Baked into ${out} `, copyIt);
    $("bake-done").hidden = false;
    $("bake-done").scrollIntoView({ block: "nearest" });
  }

  // Forgets what was said of another rectangle.
  function ended() {
    tellFault(null);
    $("bake-done").hidden = true;
  }

  // ---------- open and closed

  function toggle() {
    if (isOpen()) return close();
    $("bake").hidden = false;
    $("tool-bake").setAttribute("aria-pressed", "true");
    arm(!area);
    if (armed) $("bake-screen").focus({ preventScroll: true });
    if (area) plan();
  }

  function close() {
    if (!isOpen()) return;
    $("bake").hidden = true;
    $("tool-bake").setAttribute("aria-pressed", "false");
    arm(false);
    hover({ x: -1e4, y: -1e4 });
  }

  function takeScreen() {
    const [x, y] = [innerWidth, innerHeight];
    // All tiles that lie on the screen whole, or the one in the middle.
    const [a, b] = [tileAt({ x: 0.06 * x, y: 0.1 * y }), tileAt({ x: 0.94 * x, y: 0.9 * y })];
    const inside = { x: a[0] + 1, y: a[1] + 1, cols: b[0] - a[0] - 1, rows: b[1] - a[1] - 1 };
    const middle = tileAt({ x: x / 2, y: y / 2 });
    set(inside.cols > 0 && inside.rows > 0 ? inside : between(middle, middle));
    arm(false);
    $("bake-cols").focus({ preventScroll: true });
  }

  // A bake may have no picture of its map, as one in tiles.
  $("bake-done").querySelector("img").addEventListener("error", () => ($("bake-done").querySelector("a").hidden = true));
  for (const name of EXPORTS) {
    const box = make("input", { type: "checkbox", value: name, checked: FIRST.includes(name) });
    box.addEventListener("change", () => area && (ended(), plan()));
    $("bake-exports").append(make("label", {}, box, name));
  }
  $("bake-profile").addEventListener("change", () => {
    const has = $("bake-profile").value ? ["map"] : FIRST;
    for (const box of $("bake-exports").querySelectorAll("input")) box.checked = has.includes(box.value);
    if (area) (ended(), plan());
  });
  for (const key of ["x", "y", "cols", "rows"]) {
    $(`bake-${key}`).addEventListener("change", () => {
      const value = Math.round(Number($(`bake-${key}`).value));
      const good = Number.isSafeInteger(value) && (key === "x" || key === "y" || value > 0);
      if (good) set({ ...area, [key]: value });
      else $(`bake-${key}`).value = area[key];
    });
  }
  $("bake-scale").addEventListener("change", () => {
    const same = area;
    area = null;
    set(same);
  });
  $("bake-screen").addEventListener("click", takeScreen);
  $("bake-again").addEventListener("click", () => arm(true));
  $("bake-close").addEventListener("click", close);
  $("bake").addEventListener("keydown", (event) => event.key === "Escape" && close());
  $("bake-go").addEventListener("click", async () => {
    if (!bake) return start("new");
    $("bake-go").disabled = true;
    await ask("DELETE", `api/bakes/${bake.number}`).catch(tellFault);
  });
  $("bake-copy").addEventListener("click", async () => {
    await copy($("bake-command").querySelector("code").textContent);
    $("bake-copy").textContent = "Copied";
    setTimeout(() => ($("bake-copy").textContent = "Copy"), 1500);
  });

  return {
    offer: (profiles) => $("bake-profile").append(...profiles.map(({ name, about }) => make("option", { value: name, textContent: name, title: about }))),
    overlay,
    grip,
    hover,
    toggle,
    close,
    key(event) {
      if (event.key !== "Escape" || !isOpen()) return false;
      if (armed && area) arm(false);
      else close();
      return true;
    },
    show(about) {
      const other = world?.id !== about.id;
      world = about;
      if (other && area && isOpen()) {
        const same = area;
        area = null;
        set(same);
      }
    },
  };
}

// The page of an endless world: what is shown, and what the parts of the page do with one another.
import { $, debounced, hush, make, notify } from "./page.js";
import { ask, tilesOf } from "./server.js";
import { finder } from "./finder.js";
import { rectangle } from "./rectangle.js";
import { scene } from "./scene.js";
import { sliders } from "./sliders.js";
import { child, pair } from "./pair.js";

const MEMORY_MS = 2000; // from asking how much is remembered until it is asked again

const embedded = new URLSearchParams(location.search).has("embedded");
document.body.classList.toggle("embedded", embedded);
document.body.classList.toggle("right", new URLSearchParams(location.search).get("embedded") === "right");
let world = null;
let shown = null; // the id of the one that the map shows
let tiles = null;
let watch = null;
let opening = null;
let home = null;
let first = null; // the world that the command was given
let told = new Map(); // what the built-in presets are

// ---------- the world

// Shows a world that the server knows.
function show(about, address = "replace") {
  const other = shown !== about.id;
  shown = about.id;
  world = about;
  if (other) {
    tiles?.stop();
    tiles = tilesOf(about, embedded, away);
    // A pixel of 4 vertices shows a massif, and is a level of the pyramid.
    home ??= { at_m: [0, 0], pixel_m: about.ground.finest_m * 16 };
    terrane.map({ ...about, description: describe(about), home }, tiles.pictures);
  }
  document.title = `${about.name}, seed ${about.seed}`;
  tell();
  if (address) remember(address);
  parts.sliders.show(about);
  parts.rectangle.show(about);
  parts.finder.show(about);
  parts.scene.show(about);
  watchFile();
  for (const warning of other ? about.warnings : []) notify({ error: warning }, { calm: true });
}

// Opens the world of a preset, a seed and keys that are set; the last that was asked for wins.
async function open({ preset = world.preset, seed = world.seed, set = world.set }, address = "replace") {
  opening?.abort();
  const stop = (opening = new AbortController());
  try {
    const about = await ask("POST", "api/worlds", { preset, seed, set }, stop.signal);
    if (opening !== stop) return false;
    hush();
    show(about, address);
    return true;
  } catch (fault) {
    if (fault.name === "AbortError") return false;
    tell();
    parts.sliders.fault(fault);
    notify(fault);
    return false;
  }
}

const describe = ({ preset, file, description }) => told.get(preset) ?? (preset === "@" ? `${file} is read again whenever it is saved` : description);

function tell() {
  $("preset").value = world.preset;
  $("seed").value = world.seed;
}

// Each preset and seed is a step of the browser's history; what sliders make of them is not.
function remember(how) {
  const query = new URLSearchParams({ preset: world.preset, seed: world.seed });
  for (const one of world.set) query.append("set", one);
  if (embedded) query.set("embedded", new URLSearchParams(location.search).get("embedded"));
  history[`${how}State`](null, "", `?${query}${location.hash}`);
}

// The world that the address asks for; null where it asks for none.
function asked() {
  const query = new URLSearchParams(location.search);
  if (!query.has("preset")) return null;
  return { preset: query.get("preset"), seed: query.has("seed") ? Number(query.get("seed")) : null, set: query.getAll("set") };
}

addEventListener("popstate", () => {
  const want = asked() ?? first;
  const same = world && want && want.preset === world.preset && want.seed === world.seed && String(want.set) === String(world.set);
  if (want && !same) open(want, null);
});

let gone = false;
function away(is) {
  if (is && !gone) notify({ error: "The server does not answer.", hint: "The map goes on when terrane explore runs again at this address." });
  if (!is && gone) hush();
  gone = is;
}

// The preset's file, which may be edited while one looks.
function watchFile() {
  if (world.preset !== "@" && !watch) return;
  watch?.close();
  watch = world.preset === "@" ? new EventSource(`w/${world.id}/watch`) : null;
  watch?.addEventListener("changed", (event) => {
    const about = JSON.parse(event.data);
    show(about);
    notify({ error: `${about.file} was read again.` }, { calm: true });
  });
  watch?.addEventListener("faulty", (event) => notify(JSON.parse(event.data)));
}

// What the server remembers, which it says when it is asked.
async function tellMemory() {
  if (document.hidden) return;
  const { held_bytes, most_bytes } = await ask("GET", "api/memory");
  const megabytes = (bytes) => Math.round(bytes / 1e6);
  write("memory", `memory ${megabytes(held_bytes)} of ${megabytes(most_bytes)}\u202fMB`);
}
// A server that is away is told of by the tiles.
if (!embedded) setInterval(() => tellMemory().catch(() => {}), MEMORY_MS);

// ---------- the map's hooks

const parts = {
  sliders: sliders({ set: (set) => open({ set }) }),
  rectangle: rectangle(),
  finder: finder(),
  scene: scene(),
  pair: pair({ world: () => world, adopt: (query) => open(query), pause: (is) => (is ? (watch?.close(), (watch = null)) : watchFile()) }),
  child: child({ embedded, world: () => world }),
};

let most = 0; // tiles that were lacking when the line began
function progress({ draft, full }) {
  const lacks = draft + full;
  most = lacks === 0 ? 0 : Math.max(most, lacks);
  const line = $("progress");
  line.classList.toggle("on", lacks > 0);
  if (lacks > 0) line.style.transform = `scaleX(${(1 - lacks / (most + 1)).toFixed(3)})`;
}

const write = (id, text) => {
  if ($(id).textContent !== text) $(id).textContent = text;
};

Object.assign(terrane.hooks, {
  overlay(context) {
    parts.finder.overlay(context);
    parts.rectangle.overlay(context);
    parts.child.overlay(context);
  },
  drawn(lacking) {
    progress(lacking);
    parts.child.drawn();
  },
  arrived(place, kind, of) {
    if (kind === 1 && of.said.id === world.id) tiles.names.ask(of.said.layers[of.layer].name, place);
  },
  heights: () => terrane.invalidate(),
  told({ at_m: [east, north], slope, kind }) {
    const side = world.tile_cells * world.spacing_m;
    const number = (metres) => String(Math.floor(metres / side)).replace("-", "\u2212");
    write("slope", slope === undefined ? "" : `${Math.round(slope)}\u00b0`);
    write("tile", `tile ${number(east)}, ${number(-north)}`);
    parts.child.pointed(kind === "pointer" ? [east, north] : null);
  },
  grip: (at, event) => parts.rectangle.grip(at, event),
  hover: (at) => parts.rectangle.hover(at),
  search: (query) => parts.finder.rows(query),
  key(event) {
    if (parts.scene.key(event) || parts.rectangle.key(event)) return true;
    const acts = {
      b: () => $("tool-bake").click(),
      p: () => $("tool-sliders").click(),
      r: () => $("dice").click(),
      2: () => $("tool-pair").click(),
      3: () => $("tool-scene").click(),
    };
    const act = acts[event.key];
    const shown = { b: "tool-bake", 2: "tool-pair", 3: "tool-scene" }[event.key];
    if (!act || (embedded && shown)) return false;
    act();
    return true;
  },
});

// ---------- controls

function offerPresets(presets, start) {
  told = new Map(presets.map(({ name, about }) => [name, about]));
  const options = presets.map(({ name, about }) => make("option", { value: name, textContent: name[0].toUpperCase() + name.slice(1), title: about }));
  if (start.file) options.unshift(make("option", { value: "@", textContent: start.file.split(/[\\/]/).pop(), title: start.file }));
  $("preset").replaceChildren(...options);
}

$("preset").addEventListener("change", () => open({ preset: $("preset").value, seed: null, set: [] }, "push"));
$("seed").addEventListener("change", () => {
  const seed = Number($("seed").value);
  if (/^\d+$/.test($("seed").value) && Number.isSafeInteger(seed)) open({ seed }, "push");
  else tell();
});
$("dice").addEventListener("click", () => open({ seed: 1 + Math.floor(Math.random() * 99999) }, "push"));
$("tool-sliders").addEventListener("click", () => parts.sliders.toggle());
$("tool-bake").addEventListener("click", () => {
  parts.scene.leave();
  parts.rectangle.toggle();
});
$("tool-scene").addEventListener("click", () => {
  parts.rectangle.close();
  parts.scene.toggle();
});
$("tool-pair").addEventListener("click", () => {
  parts.scene.leave();
  parts.pair.open();
});

// Panels below the head begin where it ends.
new ResizeObserver(debounced(() => document.documentElement.style.setProperty("--head", `${$("head").offsetHeight}px`), 0)).observe($("head"));

async function begin() {
  const start = await ask("GET", "api/start");
  offerPresets(start.presets, start.world);
  parts.rectangle.offer(start.profiles);
  if (start.at || start.pixel_m) home = { at_m: start.at ?? [0, 0], pixel_m: start.pixel_m ?? start.world.ground.finest_m * 16 };
  world = first = start.world;
  const want = asked();
  if (!want || !(await open(want))) show(start.world, null);
}

begin().catch(notify);

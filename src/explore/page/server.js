// What the page asks of the server that gave it.

// Text of people's own words, or an error with `error`, `hint` and `place` as the server told it, and `status`.
export async function ask(method, path, body, signal) {
  const options = { method, signal };
  if (method !== "GET") Object.assign(options, { headers: { "content-type": "application/json" }, body: JSON.stringify(body ?? {}) });
  let answer;
  try {
    answer = await fetch(path, options);
  } catch (fault) {
    if (fault.name === "AbortError") throw fault;
    throw { error: "The server does not answer.", hint: "Is terrane explore still running?", place: null, status: 0 };
  }
  const said = await answer.json().catch(() => ({ error: `${answer.status} ${answer.statusText}` }));
  if (!answer.ok) throw { hint: null, place: null, ...said, status: answer.status };
  return said;
}

const BUSY_MS = 1000; // until a busy server is asked again
const AWAY_MS = 4000; // until one that failed is

const later = (again_ms) => Object.assign(new Error("not now"), { again_ms });

// A browser holds six connections to a server, and the watch of the file, a search and heights need theirs.
const SHARE = { atOnce: 4, fullAtOnce: 3, fullBesideDrafts: 2 };
const HALF = { atOnce: 2, fullAtOnce: 1, fullBesideDrafts: 1 };

// The tiles of a world, for the map: glances from afar, drafts, and what is drawn in full after them. `away` is told when
// the server does not answer, and when it does again.
export function tilesOf(world, embedded, away) {
  const pictures = {
    live: true,
    kinds: ["glance", "draft", "full"],
    beyond: 1,
    ...(embedded ? HALF : SHARE),
    // All but the best are soft, and have no more pixels on dense screens.
    address: (said, layer, kind, { z, x, y }) => {
      const dense = kind === pictures.kinds.length - 1 && said.dense && devicePixelRatio > 1.25 ? "@2x" : "";
      return `w/${said.id}/${said.layers[layer].name}/${pictures.kinds[kind]}/${z}/${x}/${y}${dense}.${said.ending}`;
    },
    async picture(at, signal) {
      const answer = await fetch(at, { signal }).catch((fault) => {
        if (fault.name === "AbortError") throw fault;
        away(true);
        throw later(AWAY_MS);
      });
      away(false);
      if (answer.status === 503) throw later(BUSY_MS);
      if (!answer.ok) throw later(AWAY_MS);
      // Decoded off the main thread.
      return createImageBitmap(await answer.blob());
    },
    askHeights: (said, key) => heights.ask(key),
  };
  const heights = heightsOf(world);
  const names = namesOf(world);
  return { pictures, heights, names, stop: () => (heights.stop(), names.stop()) };
}

// The grids of heights, the last asked for first, since that is where the pointer is now. Each is asked for twice: of the glance's land,
// which is there soon and only about right, and of the draft's, which gives way whenever another place is pointed at.
function heightsOf(world) {
  const MOST = 64; // that wait
  const waiting = { glance: [], draft: [] };
  let under = null; // what is under way: { stage, stop }
  let over = false;
  async function next() {
    if (under || over) return;
    const stage = waiting.glance.length > 0 ? "glance" : "draft";
    const key = waiting[stage].pop();
    if (!key) return;
    const stop = new AbortController();
    under = { stage, stop };
    try {
      const answer = await fetch(`w/${world.id}/heights/${stage}/${key}.js`, { signal: stop.signal });
      const [, text] = answer.ok ? /"([^"]*)"\);\s*$/.exec(await answer.text()) : [];
      if (text === undefined) throw later(answer.status === 503 ? BUSY_MS : AWAY_MS);
      if (!over) await terrane.heights(key, text, stage === "glance");
      if (stage === "glance") push("draft", key);
    } catch (fault) {
      if (stop.signal.aborted) push(stage, key);
      else setTimeout(() => over || (stage === "glance" ? terrane.noHeights(key) : (push(stage, key), next())), fault.again_ms ?? AWAY_MS);
    }
    under = null;
    next();
  }
  // What has waited for the longest time is given up: of a glance, so that it may be asked for again.
  function push(stage, key) {
    waiting[stage].push(key);
    const old = waiting[stage].splice(0, Math.max(0, waiting[stage].length - MOST));
    if (stage === "glance") old.forEach((key) => terrane.noHeights(key));
  }
  return {
    ask(key) {
      push("glance", key);
      if (under?.stage === "draft") under.stop.abort();
      next();
    },
    stop() {
      over = true;
      under?.stop.abort();
    },
  };
}

// The names that stand in the tiles that were drawn in full, one tile after another.
function namesOf(world) {
  const asked = new Set();
  const waiting = [];
  let busy = false;
  let over = false;
  async function next() {
    if (busy || over || waiting.length === 0) return;
    busy = true;
    const path = waiting.pop();
    try {
      const answer = await fetch(path);
      const rows = answer.ok ? await answer.json() : [];
      if (!over) terrane.addNames(rows);
    } catch {
      // Names are told as far as they are known.
      asked.delete(path);
    }
    busy = false;
    next();
  }
  return {
    ask(style, { z, x, y }) {
      const path = `w/${world.id}/names/${style}/${z}/${x}/${y}.json`;
      if (asked.has(path)) return;
      asked.add(path);
      waiting.push(path);
      next();
    },
    stop() {
      over = true;
    },
  };
}

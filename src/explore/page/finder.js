// The search for what has no name yet: "lake", "peak > 3500 m".
import { $, grouped, make } from "./page.js";
import { ask } from "./server.js";

const EXAMPLES = ["lake > 2 km2", "peak > 3000 m", "town on river"];
const ASKS = /[<>]|\d\s*(m|km|km2|ha)$|^(lake|peak|river|town|village|hamlet|place|confluence)s?\b/i;

const away = (km) => `${km < 9.95 ? km.toFixed(1) : grouped(Math.round(km))}\u202fkm`;

export function finder() {
  let world = null;
  let found = [];
  let on = -1;
  let stop = null;

  const row = (query, name, kind) => ({ name, kind, act: () => find(query) });

  // What the list of names offers besides names.
  function rows(query) {
    if (query === "") return { rows: EXAMPLES.map((one) => row(one, one, "look for")) };
    return { rows: [row(query, `Look for \u201c${query}\u201d`, "in the world")], first: ASKS.test(query) };
  }

  async function find(query) {
    close();
    stop = new AbortController();
    const own = stop;
    $("query").value = query;
    $("features").hidden = false;
    say(`Looking for ${query}`, true);
    const [east, north] = terrane.looking().at_m.map((metres) => metres / 1e3);
    const asked = new URLSearchParams({ q: query, near: `${east},${north}`, limit: 20 });
    try {
      const answer = await ask("GET", `w/${world.id}/find?${asked}`, null, own.signal);
      if (stop === own) list(query, answer.found);
    } catch (fault) {
      if (fault.name === "AbortError" || stop !== own) return;
      say(fault.error, false);
      $("features-list").replaceChildren(make("li", { className: "none", textContent: fault.hint ?? "" }));
    }
  }

  function say(text, busy) {
    $("features-title").textContent = text;
    $("features-title").classList.toggle("busy", busy);
    $("features-close").textContent = busy ? "Cancel" : "Close";
  }

  function list(query, answer) {
    found = answer;
    say(found.length === 0 ? `No ${query} near here` : `${query}: ${found.length} found`, false);
    const row = (one, index) => {
      const button = make("button", { onclick: () => go(index) });
      button.append(
        make("i", { textContent: index + 1 }),
        make("b", { textContent: one.name ?? one.kind }),
        make("span", { textContent: away(one.distance_km) }),
        make("span", { className: "more", textContent: [one.name ? one.kind : "", ...one.values.map(({ text }) => text)].filter(Boolean).join(", ") }),
      );
      button.addEventListener("pointerenter", () => point(index));
      button.addEventListener("focus", () => point(index));
      return make("li", {}, button);
    };
    $("features-list").replaceChildren(...found.map(row));
    terrane.invalidate();
  }

  function point(index) {
    on = index;
    terrane.invalidate();
  }

  function go(index) {
    const one = found[index];
    for (const [at, item] of [...$("features-list").children].entries()) item.firstChild.classList.toggle("on", at === index);
    const at_m = one.at_km.map((km) => km * 1e3);
    terrane.choose(one.name ?? one.kind, at_m);
    terrane.look({ at_m, pixel_m: (one.around_km * 1e3) / (0.7 * Math.min(innerWidth, innerHeight)) }, true);
  }

  function close() {
    stop?.abort();
    stop = null;
    [found, on] = [[], -1];
    $("features").hidden = true;
    $("features-list").replaceChildren();
    terrane.invalidate();
  }

  function overlay(context) {
    for (let index = found.length - 1; index >= 0; index--) {
      const at = terrane.toScreen(found[index].at_km.map((km) => km * 1e3));
      if (at.x < -20 || at.y < -20 || at.x > innerWidth + 20 || at.y > innerHeight + 20) continue;
      context.beginPath();
      context.arc(at.x, at.y, index === on ? 12 : 9, 0, 7);
      context.fillStyle = "#a2402a";
      context.fill();
      context.lineWidth = 2;
      context.strokeStyle = "#fff";
      context.stroke();
      context.font = "600 11px system-ui, sans-serif";
      context.textAlign = "center";
      context.textBaseline = "middle";
      context.fillStyle = "#fff";
      context.fillText(String(index + 1), at.x, at.y + 0.5);
      context.textAlign = "start";
    }
  }

  $("features-close").addEventListener("click", () => {
    close();
    terrane.choose(null);
  });

  return {
    rows,
    overlay,
    show(about) {
      if (world?.id !== about.id) close();
      world = about;
    },
  };
}

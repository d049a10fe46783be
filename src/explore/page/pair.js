// Two worlds side by side: the page itself twice, in frames whose views follow each other.
import { $, make } from "./page.js";

// The page that holds the frames.
export function pair({ world, adopt, pause }) {
  let frames = [];
  let look = null;

  function address(of, side) {
    const query = new URLSearchParams({ embedded: side, preset: of.preset, seed: of.seed });
    for (const one of of.set) query.append("set", one);
    const { at_m: [east, north], pixel_m } = terrane.looking();
    return `?${query}#${Math.round(east)},${Math.round(north)},${pixel_m},${terrane.layer()}`;
  }

  function open() {
    const own = world();
    terrane.nothingWanted(true);
    pause(true);
    // Another seed to begin with, since the same world twice says nothing.
    const both = [own, { ...own, seed: own.seed + 1 }];
    frames = both.map((of, index) => make("iframe", { src: address(of, index ? "right" : "left"), title: index ? "The other world" : "One world" }));
    const back = make("button", { className: "plain", textContent: "One world", title: "Back to one world (Escape)", onclick: close });
    $("pair").replaceChildren(...frames, back);
    $("pair").hidden = false;
    back.focus();
  }

  function close() {
    const kept = new URLSearchParams(frames[0]?.contentWindow.location.search);
    frames = [];
    $("pair").hidden = true;
    $("pair").replaceChildren();
    terrane.nothingWanted(false);
    if (look) terrane.look(look);
    look = null;
    $("tool-pair").focus();
    if (kept.has("preset")) adopt({ preset: kept.get("preset"), seed: Number(kept.get("seed")), set: kept.getAll("set") });
    pause(false);
  }

  addEventListener("message", ({ data, source, origin }) => {
    if (origin !== location.origin || !frames.length || !data?.terrane) return;
    if (data.look) look = data.look;
    if (data.leave) return close();
    for (const frame of frames) if (frame.contentWindow !== source) frame.contentWindow.postMessage(data, origin);
  });
  addEventListener("keydown", (event) => event.key === "Escape" && frames.length && close());

  return { open };
}

// The page in a frame: says where it looks and points, and follows the other.
export function child({ embedded }) {
  let last = null; // the view that both have
  let told = null;
  let other = null; // where the other's pointer is
  const say = (what) => parent.postMessage({ terrane: true, ...what }, location.origin);
  const same = (a, b) => a && b && a.pixel_m === b.pixel_m && a.at_m[0] === b.at_m[0] && a.at_m[1] === b.at_m[1];

  if (embedded) {
    addEventListener("message", ({ data, source, origin }) => {
      if (origin !== location.origin || source !== parent || !data?.terrane || !terrane.about()) return;
      if (data.look) {
        terrane.look(data.look);
        last = terrane.looking();
      }
      if (data.point !== undefined) {
        other = data.point;
        terrane.invalidate();
      }
    });
    addEventListener("keydown", (event) => event.key === "Escape" && !event.defaultPrevented && say({ leave: true }));
  }

  return {
    drawn() {
      if (!embedded) return;
      const look = terrane.looking();
      if (last && !same(look, last)) say({ look });
      last = look;
    },
    pointed(at_m) {
      if (!embedded || String(at_m) === String(told)) return;
      told = at_m;
      say({ point: at_m });
    },
    overlay(context) {
      if (!other) return;
      const { x, y } = terrane.toScreen(other);
      for (const [width, colour] of [[4, "#ffffffd9"], [1.75, "#a2402a"]]) {
        context.beginPath();
        context.arc(x, y, 7, 0, 7);
        context.lineWidth = width;
        context.strokeStyle = colour;
        context.stroke();
      }
    },
  };
}

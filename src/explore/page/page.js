// Small things that all parts of the page use.

export const $ = (id) => document.getElementById(id);

// An element with properties and children.
export function make(tag, properties = {}, ...children) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
}

export const grouped = (number) => number.toLocaleString("en").replaceAll(",", "\u202f").replace("-", "\u2212");

export function debounced(act, ms) {
  let timer = 0;
  const later = (...rest) => {
    clearTimeout(timer);
    timer = setTimeout(() => act(...rest), ms);
  };
  later.stop = () => clearTimeout(timer);
  return later;
}

export function bytes(count) {
  const units = ["B", "KiB", "MiB", "GiB", "TiB"];
  const power = Math.min(Math.floor(Math.log2(Math.max(count, 1)) / 10), 4);
  const value = count / 1024 ** power;
  return `${value.toFixed(value < 10 && power > 0 ? 1 : 0)}\u202f${units[power]}`;
}

export function duration(seconds) {
  if (seconds < 1.5) return "a second";
  if (seconds < 100) return `${Math.round(seconds)}\u202fs`;
  if (seconds < 5400) return `${Math.round(seconds / 60)}\u202fmin`;
  return seconds < 172800 ? `${(seconds / 3600).toFixed(1)}\u202fh` : `${Math.round(seconds / 86400)}\u202fdays`;
}

export const kilometres = (metres) => `${grouped(Number((metres / 1e3).toPrecision(3)))}\u202fkm`;

// What the page has to say: an error with its place and hint, which stays, or a sentence, which goes.
let fades = 0;
export function notify({ error, place = null, hint = null }, { calm = false, acts = [] } = {}) {
  const notice = $("notice");
  clearTimeout(fades);
  notice.hidden = false;
  notice.classList.toggle("calm", calm);
  notice.querySelector("b").textContent = error;
  notice.querySelector("pre").textContent = place ?? "";
  notice.querySelector("p").textContent = hint ?? "";
  const button = ([title, act]) => make("button", { className: "plain", textContent: title, onclick: () => (hush(), act()) });
  notice.querySelector(".acts").replaceChildren(...acts.map(button));
  if (calm) fades = setTimeout(hush, 4000);
}

export function hush() {
  $("notice").hidden = true;
}

$("notice").querySelector("button.icon").addEventListener("click", hush);

export async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    // From another machine the page is not in a secure context.
    const area = make("textarea", { value: text, className: "unseen" });
    document.body.append(area);
    area.select();
    document.execCommand("copy");
    area.remove();
  }
}

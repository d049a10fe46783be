// The keys of a preset as sliders: which there are, from the world's values; what they may be, from the schema.
import { $, debounced, hush, make, notify } from "./page.js";
import { ask } from "./server.js";

const UNITS = { m: "m", km: "km", m3s: "m\u00b3/s", px: "px", cells: "cells" };

export function sliders({ set }) {
  let world = null;
  let schema = null;
  let shape = ""; // of the keys that are listed
  let rows = new Map(); // key -> { row, show }
  const spans = new Map(); // key -> the slider's span, which stays while the preset does
  let changes = new Map(); // key -> TOML value
  let pending = false; // a change that has not been sent yet

  // ---------- the schema

  function resolved(part) {
    const some = part?.anyOf?.find(({ type }) => type !== "null") ?? part ?? {};
    const named = some.$ref && schema.$defs[some.$ref.split("/").pop()];
    return named ? { ...named, description: part.description ?? named.description } : { ...part, ...some };
  }

  const isObject = (value) => value !== null && typeof value === "object" && !Array.isArray(value);
  const types = ({ type }) => [type].flat();

  // All keys with values, in groups by their table.
  function* listed(values, part, path, groups) {
    const own = [];
    for (const [name, described] of Object.entries(part.properties ?? {})) {
      const value = values[name];
      if (value === undefined || name === "seed" || name === "extends") continue;
      const rules = resolved(described);
      const key = path ? `${path}.${name}` : name;
      if (isObject(value)) groups.push([key, value, rules]);
      else if (Array.isArray(value) && value.some(isObject)) value.forEach((one, index) => groups.push([`${key}[${index}]`, one, resolved(rules.items)]));
      else if (!rules.properties && !(rules.items?.$ref)) own.push({ key, name, value, rules });
    }
    if (own.length) yield { path, keys: own };
    for (const [key, value, rules] of groups) yield* listed(value, rules, key, []);
  }

  // ---------- rows

  // Bounds for a slider: all that is allowed where that can be told apart, or else some times the value.
  function span({ minimum, maximum, ...rules }, value) {
    const whole = types(rules).includes("integer");
    let [low, high] = [minimum ?? Math.min(0, 4 * value), maximum ?? Math.max(1, 4 * value)];
    const wide = high - low > 25 && (high - low) > 25 * Math.max(Math.abs(value), 1e-9);
    if (wide || (low > 0 && high / low > 2000)) {
      const size = Math.abs(value) || Math.min((high - low) / 10, 1000);
      low = low < 0 ? Math.max(low, -4 * size) : low > 0 ? Math.max(low, size / 8) : 0;
      high = Math.min(high, 4 * size);
    }
    const rough = (high - low) / 200;
    const power = 10 ** Math.floor(Math.log10(rough || 1));
    const step = whole ? 1 : [1, 2, 5, 10].find((one) => one * power >= rough) * power;
    return { low: whole ? Math.floor(low) : Math.floor(low / step) * step < (minimum ?? -Infinity) ? low : Math.floor(low / step) * step, high: whole ? Math.ceil(high) : high, step };
  }

  const tidy = (number) => Number(number.toPrecision(6));

  function slide(range) {
    const part = (range.value - range.min) / (range.max - range.min || 1);
    range.style.setProperty("--part", `${(100 * part).toFixed(1)}%`);
  }

  // A number with a slider under it.
  function numberField(key, value, rules, label, changed) {
    if (!spans.has(key)) spans.set(key, span(rules, value ?? 0));
    const { low, high, step } = spans.get(key);
    const number = make("input", { type: "number", step: "any", placeholder: "none", value: value ?? "" });
    number.setAttribute("aria-label", label);
    const range = make("input", { type: "range", min: low, max: high, step, value: value ?? low, tabIndex: -1 });
    range.setAttribute("aria-hidden", "true");
    range.addEventListener("input", () => {
      number.value = tidy(Number(range.value));
      slide(range);
      changed(false);
    });
    number.addEventListener("change", () => changed(true));
    number.addEventListener("keydown", (event) => {
      const way = { ArrowUp: 1, ArrowDown: -1 }[event.key];
      if (!way) return;
      event.preventDefault();
      number.value = tidy(Math.min(Math.max(Number(number.value) + way * step, rules.minimum ?? -Infinity), rules.maximum ?? Infinity));
      changed(false);
    });
    const show = (now) => {
      if (document.activeElement !== number) number.value = now === null ? "" : tidy(now);
      range.value = now ?? low;
      slide(range);
    };
    show(value);
    return { number, range, show, read: () => (number.value === "" ? null : Number(number.value)) };
  }

  function rowOf({ key, name, value, rules }) {
    const [, title, unit] = /^(.*?)(?:_(m|km|m3s|px|cells))?$/.exec(name);
    const label = make("label", { title: rules.description ?? "" }, title.replaceAll("_", " "), " ", make("span", { className: "unit", textContent: UNITS[unit] ?? "" }));
    const back = make("button", { className: "icon back", title: "As in the preset" });
    back.setAttribute("aria-label", `${title} as in the preset`);
    back.innerHTML = `<svg viewBox="0 0 16 16" fill="none" stroke="currentColor" stroke-width="1.5" stroke-linecap="round" stroke-linejoin="round"><path d="M3 8a5 5 0 1 0 1.6-3.7L3 5.8M3 2.8v3h3"/></svg>`;
    back.addEventListener("click", () => {
      changes.delete(key);
      send();
    });
    const top = make("div", { className: "top" }, label, back);
    const help = make("p", { className: "help", textContent: (rules.description ?? "").replaceAll("\n", " ").replaceAll("`", "") });
    const row = make("div", { className: "key" }, top);
    row.dataset.key = key;
    const change = (toml, now) => {
      if (toml === null) changes.delete(key);
      else changes.set(key, toml);
      mark();
      pending = true;
      (now ? send : sendSoon)();
    };

    let show;
    const choices = rules.oneOf?.filter((one) => one.const !== undefined).map((one) => one.const) ?? rules.enum;
    if (choices) {
      const select = make("select", {}, ...choices.map((one) => make("option", { value: one, textContent: one })));
      select.addEventListener("change", () => change(JSON.stringify(select.value), true));
      select.setAttribute("aria-label", title);
      top.append(select);
      show = (now) => (select.value = now);
    } else if (types(rules).includes("boolean")) {
      const box = make("input", { type: "checkbox" });
      box.setAttribute("aria-label", title);
      box.addEventListener("change", () => change(String(box.checked), true));
      top.append(box);
      show = (now) => (box.checked = now);
    } else if (Array.isArray(value) && value.every((one) => typeof one === "number")) {
      const fields = value.map((one, index) =>
        numberField(`${key}[${index}]`, one, rules.items ?? {}, `${title}, number ${index + 1}`, (now) => change(`[${fields.map(({ read }) => read() ?? 0).join(", ")}]`, now)),
      );
      top.append(...fields.map(({ number }) => number));
      for (const { number } of fields) number.style.width = fields.length > 2 ? "54px" : "66px";
      row.append(...fields.map(({ range }) => range));
      show = (now) => fields.forEach((field, index) => field.show(now[index]));
    } else if (types(rules).some((type) => type === "number" || type === "integer")) {
      const field = numberField(key, value, rules, title, (now) => change(field.read() === null ? null : String(field.read()), now));
      top.append(field.number);
      row.append(field.range);
      show = field.show;
    } else {
      const input = make("input", { type: "text", placeholder: "none" });
      input.setAttribute("aria-label", title);
      input.addEventListener("change", () => change(input.value.trim() === "" ? null : input.value, true));
      top.append(input);
      show = (now) => (input.value = now === null ? "" : JSON.stringify(now));
    }
    row.append(help);
    show(value);
    rows.set(key, { row, show });
    return row;
  }

  // ---------- the list

  const SHAPING = ["fluvial", "land", "noise", "warp"];

  function list(groups) {
    rows = new Map();
    const open = new Set([...$("keys").querySelectorAll("details[open]")].map(({ dataset }) => dataset.path));
    const section = ({ path, keys }, index) => {
      const details = make("details", { open: open.size ? open.has(path) : index === 0 }, make("summary", {}, path || "world", make("i")), ...keys.map(rowOf));
      details.dataset.path = path;
      return details;
    };
    // What shapes the land first, the world's own keys last.
    const rank = ({ path }) => (path === "" ? 9 : SHAPING.findIndex((table) => path.startsWith(table)) + 1 || 5);
    const ordered = [...groups].sort((a, b) => rank(a) - rank(b));
    $("keys").replaceChildren(...ordered.map(section));
    filter();
  }

  function filter() {
    const text = $("filter").value.trim().toLowerCase().replaceAll(" ", "_");
    let any = false;
    for (const details of $("keys").querySelectorAll("details")) {
      let shown = 0;
      for (const row of details.querySelectorAll(".key")) {
        row.hidden = !row.dataset.key.toLowerCase().includes(text);
        shown += !row.hidden;
      }
      details.hidden = shown === 0;
      if (text && shown) details.open = true;
      any ||= shown > 0;
    }
    $("keys").querySelector("p.none")?.remove();
    if (!any && rows.size) $("keys").append(make("p", { className: "none", textContent: "No such key" }));
  }

  function mark() {
    for (const [key, { row }] of rows) {
      row.classList.toggle("changed", changes.has(key));
      row.classList.remove("faulty");
    }
    for (const details of $("keys").querySelectorAll("details")) {
      const count = details.querySelectorAll(".key.changed").length;
      details.querySelector("summary i").textContent = count ? `${count} changed` : "";
    }
    $("reset").disabled = changes.size === 0;
  }

  const send = () => {
    sendSoon.stop();
    pending = false;
    set([...changes].map(([key, value]) => `${key}=${value}`));
  };
  // As soon as the hand rests.
  const sendSoon = debounced(() => send(), 160);

  async function show(about) {
    const other = !world || world.preset !== about.preset;
    world = about;
    // The answer to an earlier change leaves the later ones alone.
    if (pending && !other) return;
    changes = new Map(about.set.map((one) => [one.slice(0, one.indexOf("=")).trim(), one.slice(one.indexOf("=") + 1).trim()]));
    if (other) spans.clear();
    if ($("sliders").hidden) return;
    schema ??= await ask("GET", "api/schema");
    if (world !== about) return;
    const groups = [...listed(about.values, schema, "", [])];
    const now = JSON.stringify([about.preset, groups.map(({ keys }) => keys.map(({ key, value }) => [key, value === null, Array.isArray(value) && value.length]))]);
    if (now !== shape) {
      shape = now;
      list(groups);
    } else {
      for (const { keys } of groups) for (const { key, value } of keys) rows.get(key).show(value);
    }
    mark();
  }

  // Marks the keys that an error is about.
  function fault({ error, place }) {
    for (const [key, { row }] of rows) {
      const name = key.split(".").pop();
      if (changes.has(key) && new RegExp(`\\b${name.replace(/[[\]]/g, "\\$&")}\\b`).test(`${error} ${place ?? ""}`)) row.classList.add("faulty");
    }
  }

  function toggle(on = $("sliders").hidden) {
    $("sliders").hidden = !on;
    $("tool-sliders").setAttribute("aria-pressed", String(on));
    if (on) show(world).catch(notify);
    else $("tool-sliders").focus();
  }

  async function save(name, overwrite) {
    try {
      const { path } = await ask("POST", "api/save", { name, world: world.id, overwrite });
      notify({ error: `Saved as ${path}.`, hint: `terrane explore ${path}` }, { calm: true });
    } catch (fault) {
      notify(fault, { acts: fault.status === 409 ? [["Overwrite it", () => save(name, true)]] : [] });
    }
  }

  $("filter").addEventListener("input", filter);
  $("reset").addEventListener("click", () => {
    changes.clear();
    hush();
    send();
  });
  $("sliders-close").addEventListener("click", () => toggle(false));
  $("sliders").addEventListener("keydown", (event) => event.key === "Escape" && toggle(false));
  $("save").addEventListener("submit", (event) => {
    event.preventDefault();
    save($("save-name").value.trim(), false);
  });

  return { show, fault, toggle };
}
